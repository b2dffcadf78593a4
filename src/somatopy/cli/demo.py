"""somatopy demo: watch a robot learn, be damaged, and learn again; a film and a report."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from somatopy.analysis import load_run
from somatopy.analysis.film import Narrator
from somatopy.analysis.runs import Run
from somatopy.analysis.video import NoEncoder, encoder
from somatopy.api import run as run_it
from somatopy.bodies import NoGL, gl_backend
from somatopy.cli.film import Scene, film
from somatopy.cli.mirror import mark
from somatopy.cli.options import DEBUG, QUIET
from somatopy.cli.report import illustrate
from somatopy.cli.run import note
from somatopy.cli.words import read
from somatopy.clock import FRAMES_PER_MINUTE, FRAMES_PER_SECOND
from somatopy.experiment import Description, Phase, paper
from somatopy.posix import require

__all__ = ["demo", "main", "told"]

TEXT = """Watch a robot learn to see its hand: ten minutes of robot time, a damage, five minutes more.

A film and a report show what came of it. This takes one to two minutes on two cores. The first time it takes one more,
because the learner is compiled.

example: somatopy demo --out runs/demo
"""

BEFORE = """A simulated NAO moves its left arm at random. For {minutes:g} minutes of robot time it learns where to look
to see its own hand, with the learner `best`, which knows no model of the robot. Then it is damaged: it is told where
its hand is in a mirrored picture, as behind a prism. It learns on for {after:g} minutes. A report and a film follow.

This takes one to two minutes on two cores. The first time it takes one more, because the learner is compiled.
"""
#: Length of each scene of the film.
_SCENE = 6 * FRAMES_PER_SECOND
_OUT = "A folder, new or empty. (default: one in runs/)"


@dataclass(frozen=True)
class Options:
    """Options of this command."""

    out: Annotated[Path | None, mark("FOLDER", _OUT, None)] = None
    seed: Annotated[int, mark("K", "All random numbers follow from it.")] = 0
    quiet: QUIET = False
    debug: DEBUG = False


def main(args: Sequence[str]) -> int:
    """Run `somatopy demo [--out FOLDER] [--seed K] [--quiet]`."""
    options = read(Options, args, "somatopy demo", TEXT)
    demo(options.out, options.seed, quiet=options.quiet)
    return 0


def demo(
    out: Path | None = None, seed: int = 0, minutes: float = 10.0, after: float = 5.0, quiet: bool = False
) -> Path:
    """Run the demonstration, and tell on standard output what was seen.

    Args:
        out: the run folder, new or empty; one in runs/ if None.
        seed: of the experiment.
        minutes: robot time before the damage.
        after: robot time with it.
        quiet: whether to say only what was seen, and where film and report are.

    Returns:
        The run folder.

    Raises:
        DescriptionError: the folder cannot be used.
        NotPosix: the operating system has no file locks, as Windows.
        Interrupted: on Ctrl-C, with a checkpoint written.
    """
    require()
    eye, no_film = _possible()
    description = described(seed, minutes, after, eye)
    say = _nothing if quiet else note
    say(BEFORE.format(minutes=minutes, after=after))
    if no_film:
        say(f"There will be no film. {no_film}\n")
    run = run_it(description, out, progress=not quiet)
    say("The report is written; this takes some ten seconds.")
    paths = {"Report": illustrate(run.path, quiet=quiet)}
    if not no_film:
        say("The film is drawn.")
        paths = {"Film": film(run, scenes(description), quiet)[0], **paths}
    result = "\n".join([told(load_run(run.path)), "", *(f"{name + ':':<9}{path}" for name, path in paths.items())])
    print(result if quiet else f"\n{result}\n\n{_next(run.path, minutes)}")
    return run.path


def _nothing(text: str) -> None:
    """What --quiet says instead of a note."""


def described(seed: int, minutes: float, after: float, eye: str = "fiducial") -> Description:
    """The experiment: the paper's robot and babbling, the best learner, and a mirrored picture after a while."""
    lengths = [round(length * FRAMES_PER_MINUTE) for length in (minutes, after)]
    phases = [
        Phase(name="intact", frames=lengths[0]),
        Phase.model_validate({"name": "damaged", "frames": lengths[1], "damage": "mirrored"}),
    ]
    return paper().replaced(name="demo", seed=seed, eye=eye, learner={"kind": "best"}, phases=phases)


def scenes(description: Description) -> list[Scene]:
    """Four scenes, at times set by the clock and not by success: begin and end of both phases."""
    intact, damaged = (phase.frames for phase in description.phases)
    end = intact + damaged
    return [
        Scene("Before it has learned", range(min(_SCENE, intact))),
        Scene(f"After {_minutes(intact)} of learning", range(max(0, intact - _SCENE), intact)),
        Scene("Right after a damage: its picture is mirrored", range(intact, min(intact + _SCENE, end))),
        Scene(f"After {_minutes(damaged)} more with the damage", range(max(intact, end - _SCENE), end)),
    ]


def told(run: Run) -> str:
    """What was seen, in two sentences: the first and the last minute of both phases, and the ceiling."""
    narrator = Narrator(run)
    start, damage, end = narrator.starts
    first, last, hurt, again = (
        narrator.rates[min(start + FRAMES_PER_MINUTE, damage) - 1],
        narrator.rates[damage - 1],
        narrator.rates[min(damage + FRAMES_PER_MINUTE, end) - 1],
        narrator.rates[end - 1],
    )
    possible = "" if narrator.ceiling is None else f" (the best possible gaze: {_percent(narrator.ceiling)})"
    return (
        f"The robot saw its hand in {_percent(first)} of the first minute, and in {_percent(last)} of the last minute "
        f"before the damage{possible}.\n"
        f"It saw its hand in {_percent(hurt)} of the first minute after the damage, and in {_percent(again)} of the "
        "last minute."
    )


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"


def _minutes(frames: int) -> str:
    length = frames / FRAMES_PER_MINUTE
    return "one minute" if length == 1 else f"{length:g} minutes"


def _possible() -> tuple[str, str]:
    """The eye to use here, and why there can be no film; nothing if there can."""
    try:
        gl_backend()
    except NoGL as error:
        return "geometric", f"{error} Until then a geometric model of the eye looks for the hand."
    try:
        encoder()
    except NoEncoder as error:
        return "fiducial", str(error)
    return "fiducial", ""


def _next(folder: Path, minutes: float) -> str:
    """What to type next."""
    hurt = f"somatopy film {shlex.quote(str(folder))} --from {minutes:g} --every 4"
    commands = {
        hurt: "a film of all that followed the damage",
        "somatopy run best --damage permuted --eye geometric": "an hour and a half with another damage, in a minute",
        "somatopy reproduce --minutes 20 --damage-minutes 10": "the experiment of the paper, shortened",
    }
    return "\n".join(["To go on:", *(f"  {command}\n      {what}" for command, what in commands.items())])
