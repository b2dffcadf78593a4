"""The work of one cell: run or continue it, and measure it."""

from __future__ import annotations

import platform
import shutil
from collections.abc import Mapping
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

from somatopy.analysis.cells import measures
from somatopy.analysis.runs import Run, RunFolderError
from somatopy.api import fork, resume, run
from somatopy.experiment.description import Description, DescriptionError, validated
from somatopy.experiment.run_folder import CHECKPOINT
from somatopy.experiment.session import Session
from somatopy.files import cache_folder
from somatopy.posix import alone
from somatopy.studies.task import Task

__all__ = ["Task", "trim", "work"]

#: Bytes of stored arm movements that stay in the user's cache: some forty of the paper's length.
MOST_KEPT = 1e9


def work(task: Task, scratch: Path) -> list[dict[str, Any]]:
    """Run a cell, or go on with it where an interrupted study left it.

    Args:
        task: the cell.
        scratch: a folder of this machine, for run folders; cells that share a phase or a movement find it there.

    Returns:
        The measures of its phases and what it cost.

    Raises:
        Exception: whatever the experiment raises.
    """
    began, processor = perf_counter(), process_time()
    scratch.mkdir(parents=True, exist_ok=True)
    experiment, folder = _described(task.experiment), scratch / task.key
    if task.movement:
        lock = scratch / f"movement-{task.movement}.lock"  # others wait until what they share is there
        with alone(lock, wait=True), Session(experiment) as session:
            if session.share_arm(compute=True):
                trim(cache_folder("arm"))
    done = _run(task, experiment, folder, scratch)
    rows, spent = measures(done), done.cost or {}
    if not task.keep:
        shutil.rmtree(folder)
    cost = {
        "wall_s": perf_counter() - began,
        "cpu_s": process_time() - processor,
        "peak_memory_bytes": spent.get("peak_memory_bytes"),
        "learner_us": spent.get("learner_us"),
        "learner_bytes": spent.get("learner_bytes"),
        "host": platform.node(),
        "finished": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    return [{**row, **cost} for row in rows]


def trim(folder: Path | None, most: float = MOST_KEPT) -> None:
    """Remove the files of a folder that were read least lately, until the rest is small enough.

    Args:
        folder: the folder; nothing happens if there is none.
        most: bytes that may stay.
    """
    files = [(file.stat(), file) for file in folder.iterdir() if file.is_file()] if folder and folder.is_dir() else []
    total = 0
    for status, file in sorted(files, key=lambda each: -max(each[0].st_atime, each[0].st_mtime)):
        total += status.st_size
        if total > most:
            file.unlink(missing_ok=True)


def _described(table: Mapping[str, Any]) -> Description:
    return validated(table, "The cell")


def _run(task: Task, experiment: Description, folder: Path, scratch: Path) -> Run:
    quiet: dict[str, Any] = {"progress": False, "ceiling": task.ceiling, "every": task.every, "maps": False}
    if (folder / CHECKPOINT).exists():
        try:
            return resume(folder, **quiet)
        except (DescriptionError, RunFolderError):  # of another code, or broken: begin again
            pass
    shutil.rmtree(folder, ignore_errors=True)
    if task.training is not None:
        trained = _trained(_described(task.training), scratch / f"training-{task.trunk}")
        if trained is not None:
            with suppress(DescriptionError):  # written before code changed that it does not need: do without it
                return fork(trained, experiment, 0, folder, **quiet)
            shutil.rmtree(folder, ignore_errors=True)
    return run(experiment, folder, **quiet)


def _trained(training: Description, folder: Path) -> Path | None:
    """The run folder of a first phase that several cells share; None where the body cannot be resumed."""
    with alone(folder.with_suffix(".lock"), wait=True):
        ended = folder / "phase-0.npz"
        if ended.exists():
            return folder
        if (folder / CHECKPOINT).exists():
            try:
                resume(folder, progress=False, ceiling=False, maps=False)
                return folder
            except (DescriptionError, RunFolderError):
                pass
        elif (folder / "summary.json").exists():
            return None
        shutil.rmtree(folder, ignore_errors=True)
        run(training, folder, progress=False, ceiling=False, maps=False)
        return folder if ended.exists() else None
