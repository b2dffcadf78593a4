"""somatopy report: a page of one run, or of several side by side."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from somatopy.analysis import load_run
from somatopy.analysis.claims import judge
from somatopy.analysis.described import kind_of
from somatopy.analysis.figures import Shot, filmstrip_frames, save_figures
from somatopy.analysis.report import write_report
from somatopy.analysis.runs import Run, RunFolderError
from somatopy.analysis.series import distance_units
from somatopy.analysis.summary import summarise, write_summary

__all__ = ["illustrate", "main", "shots"]

TEXT = """usage: somatopy report RUN... [--out FILE] [--json] [--debug]

Of one run: draw its figures, and write RUN/report.html, which opens in any browser, offline.
Of several: write one page that compares them, into the first run's folder as comparison.html.

  --out FILE   the page to write instead
  --json       print one object: the page, its size, and every claim's verdict, run by run
  --debug      show tracebacks

example: somatopy report runs/first
example: somatopy report runs/first runs/second --out comparison.html
"""


def main(args: Sequence[str]) -> int:
    """Run `somatopy report RUN... [--out FILE]`."""
    if any(a in ("-h", "--help") for a in args):
        print(TEXT, end="")
        return 0
    folders, out, as_json = _parse(args)
    if len(folders) == 1:
        page = illustrate(folders[0], out)
    else:
        page = write_report(folders, out or folders[0] / "comparison.html")
    if as_json:
        runs = [{"folder": str(folder), "claims": _verdicts(load_run(folder))} for folder in folders]
        print(json.dumps({"report": str(page), "bytes": page.stat().st_size, "runs": runs}))
    else:
        print(page)
    return 0


def illustrate(folder: Path, out: Path | None = None) -> Path:
    """Bring a run folder's summary up to date, draw all its figures, and write its report.

    Returns:
        The page.
    """
    run = load_run(folder)
    write_summary(run)
    save_figures(run, shots(run))
    return write_report([folder], out)


def shots(run: Run) -> list[Shot]:
    """Photographs for the filmstrip of a run that looked through the rendered eye; none where nothing can render.

    Only somatopy's own bodies and eyes are asked: a report imports nothing of what a run was made of.
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
        print(f"No filmstrip: {error}", file=sys.stderr)
        return []
    corners = [np.array([*photo.tags.values()]).reshape(-1, 4, 2) for photo in taken]
    return [Shot(f, photo.image, photo.pixel, c) for f, photo, c in zip(frames, taken, corners, strict=True)]


def _parse(args: Sequence[str]) -> tuple[list[Path], Path | None, bool]:
    words = list(args)
    out: Path | None = None
    folders = []
    while words:
        word = words.pop(0)
        if word == "--out" or word.startswith("--out="):
            value = word.partition("=")[2] or (words.pop(0) if words else "")
            if not value:
                raise RunFolderError("--out needs a file to write, such as --out comparison.html.")
            out = Path(value)
        elif word.startswith("-") and word not in ("--json", "--debug"):
            raise RunFolderError(f"Unknown option {word}. Valid ones: --out, --json, --debug.")
        elif not word.startswith("-"):
            folders.append(Path(word))
    if not folders:
        raise RunFolderError("Name at least one run folder: somatopy report runs/first.")
    return folders, out, "--json" in args


def _verdicts(run: Run) -> dict[str, str]:
    return {claim.key: finding.verdict for claim, finding in judge(summarise(run), distance_units(run))}
