"""The experiment in one call, for scripts and notebooks."""

from __future__ import annotations

from pathlib import Path

from somatopy.analysis import load_run
from somatopy.analysis.runs import Run
from somatopy.analysis.summary import write_summary
from somatopy.experiment import Description, Experiment
from somatopy.experiment.recorder import prepare_folder

__all__ = ["run"]


def run(description: Description, out: str | Path | None = None) -> Run:
    """Run an experiment, then the analysis.

    Args:
        description: what to run.
        out: the run folder, new or empty; runs/<time>_<name>_seed<k> if None.

    Returns:
        The run folder, opened, with its summary.

    Raises:
        DescriptionError: the description does not fit the robot, or the folder cannot be used; nothing has run then.
        BodyError: the robot's model or anatomy does not fit.
        NoGL: the eye needs pictures and no OpenGL works here.
    """
    experiment = Experiment(description)
    folder = prepare_folder(out, description)
    experiment.run(folder)
    opened = load_run(folder)
    write_summary(opened)
    return opened
