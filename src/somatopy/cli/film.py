"""somatopy film: a moving picture of any run, drawn anew from the postures that it recorded."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from rich.console import Console
from rich.progress import track

from somatopy.analysis import load_run
from somatopy.analysis.described import phases_of
from somatopy.analysis.film import OUTSIDE, SHEET, Narrator, Sheet
from somatopy.analysis.runs import Run, RunFolderError
from somatopy.analysis.video import encoder, write_video
from somatopy.bodies import gl_backend
from somatopy.cli.mirror import mark
from somatopy.cli.options import OnRun
from somatopy.cli.run import note
from somatopy.cli.words import read
from somatopy.clock import FRAMES_PER_MINUTE, FRAMES_PER_SECOND
from somatopy.experiment.film import Replay
from somatopy.percept import Floats, Image

__all__ = ["Scene", "film", "main"]

TEXT = """Make a film of a run, RUN/film.mp4 and a small RUN/film.gif: the robot from outside, and what its eye sees.

Pictures are drawn anew from the recorded postures, some 30 a second. Shown in full, a frame lasts 1/15 s, as on the
robot. Without --every a film lasts 40 s at most: of a long run it shows fewer frames, and so plays faster.

example: somatopy film runs/20141013-120000_paper_seed0 --from 9.5 --to 10.5
"""
#: Frames of a film whose length nobody has chosen, at most.
_LONGEST = 40 * FRAMES_PER_SECOND
#: Frames by which a place for the camera in the room is chosen.
_TRIED = 24


@dataclass(frozen=True)
class Scene:
    """A stretch of a film.

    Attributes:
        title: the words above the pictures.
        frames: which frames of the run it shows, in this order.
    """

    title: str
    frames: Sequence[int]


def _minutes(name: str, text: str) -> Any:
    return tyro.conf.arg(name=name, metavar="MINUTES", help=text, help_behavior_hint="")


@dataclass(frozen=True)
class Options(OnRun):
    """Options of this command."""

    begin: Annotated[float | None, _minutes("from", "Robot time at which it begins.")] = None
    end: Annotated[float | None, _minutes("to", "Robot time at which it ends.")] = None
    every: Annotated[int | None, mark("N", "Show each Nth frame, N times as fast.", None)] = None


def main(args: Sequence[str]) -> int:
    """Run `somatopy film RUN [--from MINUTES] [--to MINUTES] [--every N] [--json]`."""
    options = read(Options, args, "somatopy film", TEXT)
    run = load_run(options.run)
    scene = _scene(run, options)
    mp4, gif = film(run, [scene], options.quiet)
    if options.json:
        print(json.dumps(_told(mp4, gif, scene)))
    else:
        print(mp4, gif, sep="\n")
    return 0


def film(run: Run, scenes: Sequence[Scene], quiet: bool = False) -> tuple[Path, Path]:
    """Write RUN/film.mp4 and RUN/film.gif.

    Args:
        run: an open run folder, with frames.
        scenes: what is shown; at least one frame.
        quiet: whether to show no progress.

    Returns:
        The paths of both files.

    Raises:
        RunFolderError: the folder is damaged, or its robot has other joints by now.
        DescriptionError: body or interventions of the run cannot be made again.
        BodyError: its body cannot be drawn.
        NoGL: no OpenGL works here.
        NoEncoder: the package that encodes video is not installed.
    """
    encoder(), gl_backend()  # they say so before anything is read
    arms, heads, narrator = run.postures("arm"), run.postures("head"), Narrator(run)
    count = sum(len(scene.frames) for scene in scenes)
    with Replay(run.description, OUTSIDE) as replay:
        _check_joints(run, replay)
        replay.surround(_spread(arms, heads))
        sheets = _sheets(replay, narrator, scenes, arms, heads)
        shown = track(sheets, "film", total=count, console=Console(stderr=True), disable=quiet)
        return write_video(run.path, "film", shown, count)


def _sheets(
    replay: Replay, narrator: Narrator, scenes: Sequence[Scene], arms: Floats, heads: Floats
) -> Iterator[Image]:
    for scene in scenes:
        sheet = Sheet(narrator, scene.title)
        for frame in scene.frames:
            yield sheet.frame(frame, replay.still(narrator.phase_of(frame), arms[frame], heads[frame]))


def _spread(arms: Floats, heads: Floats) -> list[tuple[Floats, Floats]]:
    """Postures from all over the run."""
    return [(arms[k], heads[k]) for k in np.linspace(0, len(arms) - 1, _TRIED, dtype=int)]


def _check_joints(run: Run, replay: Replay) -> None:
    for sense, group in (("arm", replay.robot.arm), ("head", replay.robot.head)):
        if run.joints(sense) != tuple(group.names):
            raise RunFolderError(
                f"The frames in {run.path} have the {sense} joints {', '.join(run.joints(sense))}, and its robot has "
                f"{', '.join(group.names)} by now: give it back the model and the anatomy with which it was recorded."
            )


def _scene(run: Run, options: Options) -> Scene:
    """The frames that were asked for."""
    run.check_format()
    recorded = len(run.values("hit"))
    if not recorded:
        raise RunFolderError(
            f"{run.path} has no recorded frame yet, so that there is nothing to film. Frames are written each five "
            f"minutes of robot time, and where a run ends. Go on with: somatopy resume {shlex.quote(str(run.path))}"
        )
    start, stop = _stretch(run, options, recorded)
    described = sum(phase.get("frames", 0) for phase in phases_of(run))
    if recorded < described and not options.quiet:
        note(f"{run.path} is unfinished: {recorded} of its {described} frames are recorded, and can be filmed.")
    every = -(-(stop - start) // _LONGEST) if options.every is None else options.every
    if every < 1:
        raise RunFolderError(f"--every {every} must be at least 1: which frames to show, such as --every 15.")
    pace = f", {every} times as fast" if every > 1 else ""
    return Scene(Narrator(run).source + pace, range(start, stop, every))


def _stretch(run: Run, options: Options, recorded: int) -> tuple[int, int]:
    """First frame, and the frame to stop before."""
    length = recorded / FRAMES_PER_MINUTE
    begin, end = options.begin or 0.0, length if options.end is None else options.end
    if not 0 <= begin < end <= length:  # false also for what is no number
        raise RunFolderError(
            f"--from {begin:g} --to {end:g} is no stretch of {run.path}, of which {length:.4g} minutes are recorded: "
            f"name two times in order, such as --from 0 --to {np.floor(100 * length) / 100:g}."
        )
    start = round(begin * FRAMES_PER_MINUTE)
    return min(start, recorded - 1), max(start + 1, round(end * FRAMES_PER_MINUTE))


def _told(mp4: Path, gif: Path, scene: Scene) -> dict[str, Any]:
    return {
        "film": str(mp4),
        "gif": str(gif),
        "frames": len(scene.frames),
        "seconds": len(scene.frames) / FRAMES_PER_SECOND,
        "size": list(SHEET),
        "bytes": {path.name: path.stat().st_size for path in (mp4, gif)},
    }
