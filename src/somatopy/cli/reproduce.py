"""somatopy reproduce: the paper from end to end."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from somatopy.analysis import load_run
from somatopy.analysis.standings import render_standings, standings
from somatopy.analysis.table import comparison, render
from somatopy.api import finish
from somatopy.cli.options import parse
from somatopy.cli.progress import run_with_progress
from somatopy.cli.report import illustrate
from somatopy.cli.run import note, result, run_options
from somatopy.experiment import Description, Experiment, paper
from somatopy.experiment.description import Hebbian
from somatopy.experiment.presets import CONTROLS
from somatopy.experiment.recorder import prepare_folder

__all__ = ["main"]

TEXT = """Reproduce the paper: the whole experiment, ceiling and controls, its table beside ours, figures, a report.

In full it is 304 minutes of robot time. A quick look:
example: somatopy reproduce --minutes 20 --damage-minutes 10
"""

BESIDE = ("random", "fixed", "frozen")


def main(args: Sequence[str]) -> int:
    """Run `somatopy reproduce [OPTIONS]`."""
    options = parse(args, paper(), "somatopy reproduce", TEXT)
    folder = run_options(options)
    run_controls(options.description, folder / "controls")
    report = illustrate(folder)
    run = load_run(folder)
    if options.json:
        print(json.dumps(result(folder)))
    else:
        names = [phase.name for phase in options.description.phases]
        print(render(comparison(run.summary or {})), render_standings(standings(run), names), sep="\n\n")
    note(f"Run folder: {folder}\nReport:     {report}")
    return 0


def run_controls(description: Description, folder: Path) -> None:
    """Run the controls of an experiment on the same seed, with the geometric eye."""
    for name in BESIDE if isinstance(description.learner, Hebbian) else BESIDE[:2]:
        control = CONTROLS[name](description).replaced(name=f"{description.name}-{name}", eye={"kind": "geometric"})
        experiment = Experiment(control)
        target = prepare_folder(folder / name, control)
        run_with_progress(experiment, target)
        finish(experiment, target)
