"""somatopy report: a page of one run, of several side by side, or of a study."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from somatopy.analysis import load_run
from somatopy.analysis.cells import STUDY, load_study
from somatopy.analysis.claims import judge
from somatopy.analysis.comparison import compare
from somatopy.analysis.comparison_table import csv_rows
from somatopy.analysis.described import kind_of, on_papers_robot
from somatopy.analysis.figures import Shot, filmstrip_frames, save, save_figures
from somatopy.analysis.report import write_report, write_study
from somatopy.analysis.runs import Run, RunFolderError
from somatopy.analysis.series import distance_units
from somatopy.analysis.summary import summarise, write_summary
from somatopy.cli.mirror import mark
from somatopy.cli.options import DEBUG, QUIET, SWITCH
from somatopy.cli.words import read
from somatopy.percept import Floats

__all__ = ["illustrate", "main", "portray", "shots", "verdicts"]

TEXT = """Write the page of a run, of several runs side by side, or of a study. It opens in any browser, offline.

Of one run it draws the figures, too, and writes RUN/report.html. Of several it writes comparison.html into the first
one's folder; runs that differ in nothing but their seed are also taken together. Of a study it writes
STUDY/report.html, means over seeds and paired differences, and beside it table.csv and table.tex.

example: somatopy report runs/first
example: somatopy report runs/first runs/second --out comparison.html
example: somatopy report my_study --against frozen
"""
#: What --json says beside the page, computed when it is asked for.
Told = Callable[[], dict[str, Any]]


@dataclass(frozen=True)
class Options:
    """Options of this command."""

    run: Annotated[
        tyro.conf.Positional[tuple[Path, ...]], mark("RUN...", "A run folder, several of them, or a study.", None)
    ]
    against: Annotated[
        str | None, mark("NAME", "The condition of a study to compare with. (default: the first)", None)
    ] = None
    out: Annotated[Path | None, mark("FILE", "The page to write instead.", None)] = None
    json: Annotated[SWITCH, mark(None, "Print one object: the page, its size, claims or rows.", None)] = False
    quiet: QUIET = False
    debug: DEBUG = False


def main(args: Sequence[str]) -> int:
    """Run `somatopy report RUN... [--out FILE]` or `somatopy report STUDY [--against NAME]`."""
    options = read(Options, args, "somatopy report", TEXT)
    folders = options.run
    if options.out:
        _check_target(options.out)
    report = _of_study if _is_study(folders, options.against) else _of_runs
    page, told = report(folders, options)
    if options.json:
        print(json.dumps({"report": str(page), "bytes": page.stat().st_size, **told()}))
    else:
        print(page)
    return 0


def _check_target(page: Path) -> None:
    """Refuse a page that cannot be written before anything is drawn."""
    if page.is_dir():
        raise RunFolderError(f"--out {page} is a folder: name a file to write, such as --out {page / 'report.html'}.")
    if not page.parent.is_dir():
        raise RunFolderError(f"--out {page}: there is no folder {page.parent}. Make it first, or name another file.")
    if not os.access(page if page.exists() else page.parent, os.W_OK):
        raise RunFolderError(f"--out {page} cannot be written: name a file that you may write.")


def _is_study(folders: Sequence[Path], against: str | None) -> bool:
    studies = [folder for folder in folders if (folder / STUDY).is_file()]
    if studies and len(folders) > 1:
        raise RunFolderError(f"{studies[0]} is a study, which has a report of its own: somatopy report {studies[0]}.")
    if against is not None and not studies:
        raise RunFolderError(f"--against chooses a condition of a study, and {folders[0]} is none: leave it out.")
    return bool(studies)


def _of_study(folders: Sequence[Path], options: Options) -> tuple[Path, Told]:
    result = load_study(folders[0])
    page = write_study(result, options.out, options.against)
    return page, lambda: {
        "study": str(folders[0]),
        "rows": csv_rows(compare(result, options.against)),
        "failures": result.failures,
    }


def _of_runs(folders: Sequence[Path], options: Options) -> tuple[Path, Told]:
    if len(folders) == 1:
        page = illustrate(folders[0], options.out, options.quiet)
    else:
        page = write_report(folders, options.out or folders[0] / "comparison.html")
    return page, lambda: {"runs": [{"folder": str(folder), "claims": verdicts(load_run(folder))} for folder in folders]}


def illustrate(folder: Path, out: Path | None = None, quiet: bool = False) -> Path:
    """Bring a run folder's summary up to date, draw all its figures, and write its report.

    Args:
        folder: the run folder.
        out: the page; RUN/report.html if None.
        quiet: whether to leave it to the page to say which pictures could not be drawn, and why.

    Returns:
        The page.
    """
    missing: list[str] = []
    run = load_run(folder)
    write_summary(run)
    save_figures(run, shots(run, missing.append))
    portray(run, missing.append)
    if missing and not quiet:
        _say("\n".join(missing))
    return write_report([folder], out, missing)


def _say(text: str) -> None:
    print(text, file=sys.stderr)


def shots(run: Run, tell: Callable[[str], None] = _say) -> list[Shot]:
    """Photographs for the filmstrip of a run that looked through the rendered eye; none where nothing can render.

    Only somatopy's own bodies and eyes are asked: a report imports nothing of what a run was made of.

    Args:
        run: the open run folder.
        tell: takes a sentence that says why there is no filmstrip, if it could not be drawn.
    """
    frames = [frame for row in filmstrip_frames(run) for frame in row]
    kinds = [kind_of(run, part) for part in ("body", "eye")]
    if kinds != ["mujoco", "fiducial"] or not (frames and run.joints("arm") and run.joints("head")):
        return []
    from somatopy.bodies import NoGL
    from somatopy.experiment.film import photographs

    arms, heads = (run.postures(sense)[frames] for sense in ("arm", "head"))
    try:
        taken = photographs(run.description["body"], list(arms), list(heads))
    except (NoGL, ValueError) as error:  # ValueError: the robot's file is gone, or it has other joints by now
        tell(_undrawn(run, "filmstrip", "filmstrip", error))
        return []
    corners = [np.array([*photo.tags.values()]).reshape(-1, 4, 2) for photo in taken]
    return [Shot(f, photo.image, photo.pixel, c) for f, photo, c in zip(frames, taken, corners, strict=True)]


def portray(run: Run, tell: Callable[[str], None] = _say) -> None:
    """Draw a robot other than the NAO as figures/robot, in two postures of its run; nothing where nothing can render.

    Only somatopy's own body is asked: a report imports nothing of what a run was made of.

    Args:
        run: the open run folder.
        tell: takes a sentence that says why there is no picture, if it could not be drawn.
    """
    drawable = kind_of(run, "body") == "mujoco" and run.joints("arm") and run.joints("head")
    if on_papers_robot(run) or not drawable:
        return
    from somatopy.bodies import NoGL
    from somatopy.cli.body_picture import body_picture
    from somatopy.experiment.film import posed

    try:
        with posed(run.description["body"]) as robot:
            save(body_picture(robot, _apart(run)), run.path / "figures", "robot")
    except (NoGL, ValueError) as error:  # ValueError: the robot's file is gone, or it has other joints by now
        tell(_undrawn(run, "robot", "picture of the robot", error))


def _undrawn(run: Run, name: str, what: str, error: Exception) -> str:
    """Why a picture is missing, or is the one that an earlier report drew."""
    there = (run.path / "figures" / f"{name}.png").is_file()
    return f"The {what} is that of an earlier report: {error}" if there else f"No {what}: {error}"


def _apart(run: Run) -> list[tuple[Floats, Floats]]:
    """Arm and head in two frames in which the hand was seen, if it ever was: the first, and that with the arm farthest.

    How far is counted in shares of what each joint has moved.
    """
    arms, heads, hit = run.postures("arm"), run.postures("head"), run.values("hit")
    frames = np.flatnonzero(hit) if hit.any() else np.arange(len(arms))
    moved = np.ptp(arms, axis=0)
    ways = (arms[frames] - arms[frames[0]]) / np.where(moved > 0, moved, 1.0)
    return [(arms[k], heads[k]) for k in (frames[0], frames[np.linalg.norm(ways, axis=1).argmax()])]


def verdicts(run: Run) -> dict[str, str]:
    """What became of each claim of the paper in a run, by its key."""
    judged = judge(summarise(run), distance_units(run), on_papers_robot(run))
    return {claim.key: finding.verdict for claim, finding in judged}
