"""Pictures as video: MP4 that every browser plays, and a small GIF of the same."""

from __future__ import annotations

import importlib.util
import subprocess
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from shutil import copyfileobj
from tempfile import TemporaryDirectory, TemporaryFile

from somatopy.analysis.runs import RunFolderError, writing
from somatopy.clock import FRAMES_PER_SECOND
from somatopy.files import write_whole
from somatopy.percept import Image

__all__ = ["GIF_BYTES", "NoEncoder", "encoder", "write_video"]

#: A GIF is smaller than this, so that a README can show it.
GIF_BYTES = 3_000_000
_WIDTH, _COLOURS = 564, 64
#: Pictures in a GIF at most; a longer film is shown faster in it.
_PICTURES = 240

#: H.264 with colours as browsers want them, its index first, so that it plays before it is loaded.
_H264 = (
    *("-c:v", "libx264", "-preset", "veryfast", "-crf", "20"),
    *("-pix_fmt", "yuv420p", "-movflags", "+faststart"),
)


class NoEncoder(RuntimeError):
    """The package that encodes video is not installed."""


def encoder() -> str:
    """The program that encodes video: ffmpeg, as the package imageio-ffmpeg brings or finds it.

    Raises:
        NoEncoder: it is not installed; the message says how to install it.
    """
    if importlib.util.find_spec("imageio_ffmpeg") is not None:
        import imageio_ffmpeg

        with suppress(RuntimeError):  # a package without its program, as on rare systems
            found: str = imageio_ffmpeg.get_ffmpeg_exe()
            return found
    raise NoEncoder('A film needs the package imageio-ffmpeg, which is not installed: pip install "somatopy[film]".')


def write_video(folder: Path, stem: str, frames: Iterable[Image], count: int) -> tuple[Path, Path]:
    """Write `stem`.mp4, 15 frames a second, and `stem`.gif, at most half as many and half as large.

    The GIF leaves out as many frames as it must to stay below `GIF_BYTES`. Each file is written whole or not at all.

    Args:
        folder: an existing folder.
        stem: name of both files.
        frames: pictures of one size, shape (height, width, 3), RGB; height and width are even.
        count: how many there are.

    Returns:
        The paths of both files.

    Raises:
        NoEncoder: the package that encodes is not installed.
        RunFolderError: a file cannot be written.
    """
    program, mp4, gif = encoder(), folder / f"{stem}.mp4", folder / f"{stem}.gif"
    with TemporaryDirectory() as aside:
        made = Path(aside) / "film.mp4", Path(aside) / "film.gif"
        _encode(program, frames, made[0])
        _make_small(program, made[0], made[1], count)
        for source, target in zip(made, (mp4, gif), strict=True):
            with writing(target), source.open("rb") as content:
                write_whole(target, lambda file, content=content: copyfileobj(content, file))  # type: ignore[misc]
    return mp4, gif


def _encode(program: str, frames: Iterable[Image], target: Path) -> None:
    pictures = iter(frames)
    first = next(pictures)
    height, width = first.shape[:2]
    raw = ("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", str(FRAMES_PER_SECOND), "-i", "-")
    with TemporaryFile() as said:
        command = [program, "-v", "error", *raw, *_H264, str(target)]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=said) as running:
            try:
                assert running.stdin is not None
                with suppress(BrokenPipeError):  # then it has ended, and has said why
                    running.stdin.write(first.tobytes())
                    for picture in pictures:
                        running.stdin.write(picture.tobytes())
                    running.stdin.close()
            except BaseException:
                running.kill()
                raise
        said.seek(0)
        _check(running.returncode, said.read())


def _make_small(program: str, film: Path, target: Path, count: int) -> None:
    """Make a GIF of a film, of each second frame or fewer."""
    step = max(2, -(-count // _PICTURES))
    pace = max(
        1, step // 3
    )  # so that it does not crawl: at most three frames of the film stand still in one of its own
    while True:
        chosen = f"select=not(mod(n\\,{step})),setpts=PTS/{pace},scale={_WIDTH}:-2:flags=area"
        colours = f"split[a][b];[a]palettegen=max_colors={_COLOURS}[p];[b][p]paletteuse=dither=none:diff_mode=rectangle"
        command = [program, "-v", "error", "-y", "-i", str(film), "-lavfi", f"{chosen},{colours}"]
        done = subprocess.run([*command, "-fps_mode", "passthrough", str(target)], capture_output=True, check=False)
        _check(done.returncode, done.stderr)
        if target.stat().st_size < GIF_BYTES or step >= count:
            return
        step += max(1, step // 4)


def _check(code: int, said: bytes) -> None:
    if code:
        lines: Sequence[str] = said.decode(errors="replace").strip().splitlines() or [f"exit code {code}"]
        raise RunFolderError(f"The film cannot be encoded: ffmpeg says {lines[-1]!r}.")
