"""An experiment in one call: run it, resume it, fork it."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.compute as pc

from somatopy.analysis import load_run
from somatopy.analysis.runs import Run
from somatopy.analysis.summary import write_summary
from somatopy.experiment import Description, DescriptionError, Experiment, load_description
from somatopy.experiment.ceiling import ceiling
from somatopy.experiment.checkpoint import FILE
from somatopy.experiment.loop import MakeLearner
from somatopy.experiment.recorder import prepare_folder, write_json
from somatopy.percept import Floats

__all__ = ["finish", "fork", "reopen", "resume", "run"]


def run(description: Description, out: str | Path | None = None, learner: MakeLearner | None = None) -> Run:
    """Run an experiment, then the analysis.

    Args:
        description: what to run.
        out: the run folder, new or empty; runs/<time>_<name>_seed<k> if None.
        learner: makes a learner of your own, see `Experiment`; the description's if None.

    Returns:
        The run folder, opened, with its summary.

    Raises:
        DescriptionError: the description does not fit the robot, or the folder cannot be used; nothing has run then.
        BodyError: the robot's model or anatomy does not fit.
        NoGL: the eye needs pictures and no OpenGL works here.
    """
    experiment = Experiment(description, learner)
    folder = prepare_folder(out, description)
    experiment.run(folder)
    return finish(experiment, folder)


def resume(folder: str | Path, learner: MakeLearner | None = None) -> Run:
    """Continue an interrupted or killed run bit for bit, then the analysis; a finished run is only analysed.

    Args:
        folder: the run folder.
        learner: the learner of your own that the run began with, if it did.

    Raises:
        DescriptionError: no run folder, a broken checkpoint, or another process runs in it.
    """
    folder = Path(folder)
    experiment = reopen(folder, learner)
    experiment.run(folder)
    return finish(experiment, folder)


def fork(
    folder: str | Path,
    description: Description,
    phase: int = 0,
    out: str | Path | None = None,
    learner: MakeLearner | None = None,
) -> Run:
    """Run other phases after a phase that has ended already: one training, many continuations.

    Args:
        folder: a run folder whose phase `phase` has ended.
        description: the new experiment; up to and including that phase it must be the old one.
        phase: the last phase to take over.
        out: the new run folder, new or empty; runs/<time>_<name>_seed<k> if None.
        learner: the learner of your own that the run began with, if it did.

    Raises:
        DescriptionError: that phase has not ended, or the descriptions differ before it ends.
    """
    folder, experiment = Path(folder), Experiment(description, learner)
    description, old = experiment.description, load_description(folder / "experiment.toml")
    shared = {"name": description.name, "phases": old.phases[: phase + 1]}
    if old.model_copy(update=shared) != description.model_copy(update={"phases": description.phases[: phase + 1]}):
        raise DescriptionError(f"The description differs from that of {folder} before the end of phase {phase}.")
    end = folder / f"phase-{phase}.npz"
    if not end.exists():
        raise DescriptionError(
            f"Phase {phase} of {folder} has not ended: there is no {end.name}. Resume that run first."
        )
    experiment.restore_from(end)
    target = prepare_folder(out, description)
    _take_over(folder, target, experiment.parts, phase)
    experiment.run(target)
    return finish(experiment, target)


def _take_over(old: Path, new: Path, windows: int, phase: int) -> None:
    """Copy frames, maps and checkpoints that were written up to the end of a phase."""
    taken = [
        *sorted((old / "frames").glob("part-*.parquet"))[:windows],
        *sorted((old / "maps").glob("window-*.npz"))[:windows],
        *(end for k in range(phase + 1) if (end := old / f"phase-{k}.npz").exists()),
    ]
    for file in taken:
        copy = new / file.relative_to(old)
        copy.parent.mkdir(exist_ok=True)
        shutil.copy2(file, copy)


def reopen(folder: Path, learner: MakeLearner | None = None) -> Experiment:
    """The experiment of a run folder, standing at its last checkpoint, or at its beginning if there is none.

    Raises:
        DescriptionError: no run folder, or a broken checkpoint.
    """
    experiment = Experiment(load_description(folder / "experiment.toml"), learner)
    if (folder / FILE).exists():
        experiment.restore_from(folder / FILE)
    return experiment


def finish(experiment: Experiment, folder: Path) -> Run:
    """What comes after the last frame: the ceiling of this trajectory, then the summary."""
    opened = load_run(folder)
    names = [f"arm_{name}_rad" for name in experiment.body.arm.names]
    table = opened.frames(["phase", *names])
    arms = [
        _matrix(table.filter(pc.equal(table["phase"], index)), names)
        for index in range(len(experiment.description.phases))
    ]
    write_json(
        folder / "ceiling.json", ceiling(experiment.body, arms, head_speed=experiment.description.body.head_speed)
    )
    write_summary(opened)
    return opened


def _matrix(table: Any, names: list[str]) -> Floats:

    return np.column_stack([table[name].to_numpy() for name in names])
