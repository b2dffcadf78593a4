"""Films as files: as many frames as were given, in their colours, as browsers play them; a GIF that is small."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import PIL.Image
import pytest

from somatopy.analysis import video
from somatopy.analysis.runs import RunFolderError
from somatopy.analysis.video import NoEncoder, write_video
from somatopy.percept import Image

SIZE = (320, 180)


def frames(count: int, size: tuple[int, int] = SIZE) -> list[Image]:
    """Grey that grows lighter, frame by frame, with a red corner."""
    made = [np.full((size[1], size[0], 3), 30 + 2 * k, np.uint8) for k in range(count)]
    for picture in made:
        picture[:60, :80] = (200, 30, 30)
    return made


def test_a_film_decodes_to_what_was_given(tmp_path: Path) -> None:
    """Each frame once, in order, 15 a second, in H.264 and the colours that browsers play."""
    given = frames(31)
    mp4, gif = write_video(tmp_path, "film", iter(given), len(given))
    assert (mp4, gif) == (tmp_path / "film.mp4", tmp_path / "film.gif")
    decoding = imageio_ffmpeg.read_frames(str(mp4))
    told = next(decoding)
    assert (told["size"], told["fps"], told["codec"]) == (SIZE, 15, "h264")
    assert told["pix_fmt"].startswith("yuv420p")
    decoded = [np.frombuffer(raw, np.uint8).reshape(SIZE[1], SIZE[0], 3).astype(int) for raw in decoding]
    assert len(decoded) == len(given)
    for got, picture in zip(decoded, given, strict=True):
        assert np.abs(got[100:, 100:] - picture[100:, 100:]).max() <= 3
        assert np.abs(got[:50, :70] - picture[0, 0]).max() <= 8
    assert sorted(path.name for path in tmp_path.iterdir()) == ["film.gif", "film.mp4"]
    with PIL.Image.open(gif) as shown:
        assert shown.n_frames == 16 and shown.info["loop"] == 0  # type: ignore[attr-defined]
        assert shown.width / shown.height == pytest.approx(SIZE[0] / SIZE[1], rel=0.01)
        assert lasts(shown) == pytest.approx(31 / 15, abs=0.2)


def lasts(shown: PIL.Image.Image) -> float:
    """Seconds of a GIF."""
    total = 0.0
    for k in range(shown.n_frames):  # type: ignore[attr-defined]
        shown.seek(k)
        total += shown.info["duration"] / 1000
    return total


def test_a_gif_leaves_out_frames_to_stay_small(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As many as it must; what is left still lasts as long."""
    noise = np.random.default_rng(0)
    blocks = [60 * noise.integers(0, 4, (9, 16, 1), np.uint8) for _ in range(24)]
    given = [block.repeat(20, axis=0).repeat(20, axis=1).repeat(3, axis=2) for block in blocks]
    whole = write_video(tmp_path, "whole", iter(given), 24)[1].stat().st_size
    monkeypatch.setattr(video, "GIF_BYTES", whole // 2)
    small = write_video(tmp_path, "small", iter(given), 24)[1]
    assert small.stat().st_size < whole // 2
    with PIL.Image.open(small) as shown:
        assert shown.n_frames < 7 and lasts(shown) == pytest.approx(24 / 15, abs=0.4)  # type: ignore[attr-defined]


def test_without_the_package_one_sentence_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And no frame is asked for."""
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(NoEncoder) as error:
        write_video(tmp_path, "film", iter([]), 1)
    assert str(error.value) == (
        'A film needs the package imageio-ffmpeg, which is not installed: pip install "somatopy[film]".'
    )


def test_what_the_encoder_refuses_is_told(tmp_path: Path) -> None:
    """Its own words, for pictures of odd size; nothing is left behind."""
    with pytest.raises(RunFolderError, match=r"The film cannot be encoded: ffmpeg says '.+'\.$"):
        write_video(tmp_path, "film", iter(frames(40, (321, 181))), 40)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(RunFolderError, match=r"film\.mp4 cannot be written"):
        write_video(tmp_path / "gone", "film", iter(frames(2)), 2)
