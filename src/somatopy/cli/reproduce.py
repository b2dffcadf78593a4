"""somatopy reproduce: the paper from end to end."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from somatopy.analysis import load_run
from somatopy.analysis.band import render_verdicts, verdicts_of
from somatopy.analysis.band import seeds_of as seeds_of_band
from somatopy.analysis.described import on_papers_robot
from somatopy.analysis.runs import Run
from somatopy.analysis.series import distance_units
from somatopy.analysis.standings import render_standings, standings
from somatopy.analysis.summary import summarise
from somatopy.analysis.table import comparison, render
from somatopy.api import begin, finish, play, reopen
from somatopy.cli.band import Band
from somatopy.cli.mirror import mark
from somatopy.cli.options import Flags, parse
from somatopy.cli.report import illustrate, verdicts
from somatopy.cli.run import note, result
from somatopy.experiment import Description, load_description, paper
from somatopy.experiment.presets import CONTROLS
from somatopy.experiment.run_folder import CHECKPOINT, DESCRIPTION
from somatopy.studies.plan import seeds_of

__all__ = ["CONTROLS_FOLDER", "complete", "main"]

TEXT = """Reproduce the paper: experiment, ceiling and controls, table, figures, report.

In full it is 304 minutes of robot time. The run has rendered pictures. At the same time more seeds run with the
geometric eye: a band that shows how much of the result is chance. This is a quick look:

example: somatopy reproduce --minutes 20 --damage-minutes 10
"""

CONTROLS_FOLDER = "controls"
BESIDE = ("random", "fixed", "frozen")


@dataclass(frozen=True)
class ReproduceFlags(Flags):
    """The common flags, and how many seeds there are."""

    seeds: Annotated[int, mark("N", "Seeds of the band; 1 leaves the band out.")] = 8


def main(args: Sequence[str]) -> int:
    """Run `somatopy reproduce [OPTIONS]`."""
    options = parse(args, paper(), "somatopy reproduce", TEXT, ReproduceFlags)
    seeds = len(seeds_of(options.flags.seeds, options.description.seed))
    with begin(options.description, options.out) as (session, opened):
        folder = opened.path
        with _marked(folder), Band.planned(folder, session.description, seeds) as band:
            session.share_arm(compute=True)  # the controls have the same
            play(session, opened, progress=not options.quiet)
            finish(session, folder)
            return complete(folder, options.json, band=band, quiet=options.quiet)


@contextmanager
def _marked(folder: Path) -> Iterator[None]:
    """A folder for the controls, which tells `resume` what to bring to its end; gone if nothing was recorded."""
    (folder / CONTROLS_FOLDER).mkdir()
    try:
        yield
    except BaseException:
        if not (folder / DESCRIPTION).exists():
            Band(folder).discard()
            (folder / CONTROLS_FOLDER).rmdir()
            with suppress(OSError):
                folder.rmdir()
        raise


def complete(folder: Path, as_json: bool, anyway: bool = False, band: Band | None = None, quiet: bool = False) -> int:
    """What follows the main run, from wherever it was interrupted: controls, band, figures, report, tables.

    Args:
        folder: the run folder.
        as_json: whether to print one JSON object instead of the tables.
        anyway: whether to go on with controls that other versions or code began.
        band: the band of seeds, if it runs already.
        quiet: whether to print nothing but the result.

    Returns:
        0 done, 1 if the band failed: the report then shows what of it has ended.
    """
    description = load_description(folder / "experiment.toml")
    with nullcontext(band) if band else Band(folder) as going_on:
        run_controls(description, folder, anyway, quiet)
        went_well = going_on.wait(quiet)
    report = illustrate(folder, quiet=quiet)
    run = load_run(folder)
    beside = on_papers_robot(run)
    if as_json:
        print(json.dumps({**result(folder), **_beside(run)}))
    else:
        names = [phase.name for phase in description.phases]
        print(
            render(comparison(run.summary or {}, distance_units(run), beside), paper=beside),
            render_standings(standings(run), names),
            *([render_verdicts(judged, seeds_of_band(run))] if (judged := verdicts_of(run)) else []),
            sep="\n\n",
        )
    if not quiet:
        note(f"Run folder: {folder}\nReport:     {report}")
    return 0 if went_well else 1


def _beside(run: Run) -> dict[str, Any]:
    """What --json says beside the run itself: its controls by name, and what became of the paper's claims."""
    return {"controls": {name: summarise(control) for name, control in run.controls.items()}, "claims": verdicts(run)}


def run_controls(description: Description, folder: Path, anyway: bool = False, quiet: bool = False) -> None:
    """Run, or go on with, the controls of an experiment on the same seed, with the geometric eye."""
    for name in BESIDE if description.learner.kind == "hebbian" else BESIDE[:2]:
        control = CONTROLS[name](description).replaced(name=f"{description.name}-{name}", eye={"kind": "geometric"})
        target = folder / CONTROLS_FOLDER / name
        if (target / CHECKPOINT).exists():
            with reopen(target, anyway=anyway) as (session, opened, since):
                play(session, opened, since, progress=not quiet, whole=folder)
                finish(session, target, whole=folder)
        else:
            with begin(control, target) as (session, opened):
                play(session, opened, progress=not quiet, whole=folder)
                finish(session, target, whole=folder)
