"""somatopy reproduce: the paper from end to end."""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from pathlib import Path

from somatopy.analysis import load_run
from somatopy.analysis.standings import render_standings, standings
from somatopy.analysis.table import comparison, render
from somatopy.api import finish, reopen
from somatopy.cli.options import parse
from somatopy.cli.progress import run_with_progress
from somatopy.cli.report import illustrate
from somatopy.cli.run import note, result
from somatopy.experiment import Description, Experiment, load_description, paper
from somatopy.experiment.description import Hebbian
from somatopy.experiment.presets import CONTROLS
from somatopy.experiment.recorder import prepare_folder

__all__ = ["CONTROLS_FOLDER", "complete", "main"]

TEXT = """Reproduce the paper: the whole experiment, ceiling and controls, its table beside ours, figures, a report.

In full it is 304 minutes of robot time. A quick look:
example: somatopy reproduce --minutes 20 --damage-minutes 10
"""

CONTROLS_FOLDER = "controls"
BESIDE = ("random", "fixed", "frozen")


def main(args: Sequence[str]) -> int:
    """Run `somatopy reproduce [OPTIONS]`."""
    options = parse(args, paper(), "somatopy reproduce", TEXT)
    experiment = Experiment(options.description)
    folder = prepare_folder(options.out, options.description)
    (folder / CONTROLS_FOLDER).mkdir()
    run_with_progress(experiment, folder)
    finish(experiment, folder)
    complete(folder, options.json)
    return 0


def complete(folder: Path, as_json: bool) -> None:
    """What follows the main run, from wherever it was interrupted: controls, figures, report, tables."""
    description = load_description(folder / "experiment.toml")
    run_controls(description, folder)
    report = illustrate(folder)
    run = load_run(folder)
    if as_json:
        print(json.dumps(result(folder)))
    else:
        names = [phase.name for phase in description.phases]
        print(render(comparison(run.summary or {})), render_standings(standings(run), names), sep="\n\n")
    note(f"Run folder: {folder}\nReport:     {report}")


def run_controls(description: Description, folder: Path) -> None:
    """Run, or go on with, the controls of an experiment on the same seed, with the geometric eye."""
    for name in BESIDE if isinstance(description.learner, Hebbian) else BESIDE[:2]:
        control = CONTROLS[name](description).replaced(name=f"{description.name}-{name}", eye={"kind": "geometric"})
        target = folder / CONTROLS_FOLDER / name
        begun = (target / "experiment.toml").exists()
        experiment = reopen(target) if begun else Experiment(control)
        if not begun:
            shutil.rmtree(target, ignore_errors=True)
            prepare_folder(target, control)
        run_with_progress(experiment, target, whole=folder)
        finish(experiment, target)
