"""Runs the unfinished cells of a study, in an order in which cells can share what they have in common."""

from __future__ import annotations

import shutil
import signal
import threading
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from types import FrameType
from typing import Any, Protocol

from somatopy.analysis.cells import StudyResult, load_study
from somatopy.api import Interrupted
from somatopy.experiment import DescriptionError
from somatopy.studies.folder import StudyFolder
from somatopy.studies.local import Local, Outcome
from somatopy.studies.plan import Cell, Study
from somatopy.studies.progress import StudyProgress
from somatopy.studies.task import Task

__all__ = ["Backend", "Queue", "perform"]


class Backend(Protocol):
    """Something that can run cells, such as processes of this machine or a cluster."""

    capacity: int

    def submit(self, task: Task) -> None:
        """Start a cell. Fewer than `capacity` cells are running."""
        ...

    def next(self) -> Outcome | None:
        """Wait until a cell ends. None if none has ended; the capacity may have changed then."""
        ...

    def forget(self, trunk: str) -> None:
        """Remove a shared first phase that no cell needs any more."""
        ...

    def close(self) -> None:
        """End all running cells."""
        ...


def perform(
    study: Study,
    out: str | Path | None = None,
    *,
    processes: int | None = None,
    backend: Callable[[Path], Backend] | None = None,
    progress: bool = True,
    failed: Sequence[Mapping[str, Any]] = (),
) -> StudyResult:
    """Run all cells of a study that are not finished yet.

    Args:
        study: the study.
        out: the study folder: new, empty, or one in which a study has run; runs/<time>_<name> if None.
        processes: number of processes on this machine; as many as there are cores if None.
        backend: makes the backend that runs the cells, given the folder of what they share; processes of this machine
            if None.
        progress: whether to show the progress on standard error.
        failed: the `failures` of an earlier call. Their cells are not tried again.

    Returns:
        The study folder, opened. Cells that failed are in its `failures`.

    Raises:
        DescriptionError: the folder cannot be used, or the number of processes is less than one.
        Interrupted: on Ctrl-C; finished cells are kept.
    """
    if processes is not None and processes < 1:
        raise DescriptionError(f"--processes {processes}: at least one process must work.")
    folder = StudyFolder(out, study.name)
    cells = _once(study.cells())
    with folder.opened(study) as finished:
        failures = [dict(failure) for failure in failed]
        given_up = {failure["key"] for failure in failures}
        waiting = [cell for cell in cells if cell.key not in finished and cell.key not in given_up]
        bar: AbstractContextManager[Any] = StudyProgress(cells, waiting) if progress else nullcontext()
        if waiting:
            runner = backend(folder.scratch) if backend else Local(folder.scratch, processes)
            try:
                with _interruptible(), bar as shown:
                    _work_off(Queue(waiting, study.keep_frames, cells), runner, folder, failures, shown)
            except KeyboardInterrupt as stopped:
                ended = sum(cell.key in folder.rows for cell in cells)
                raise Interrupted(
                    f"Interrupted: {ended} of {len(cells)} cells have ended, and are kept in {folder.path}. "
                    f"Go on with the same command and --out {folder.path}.",
                    getattr(stopped, "signal", signal.SIGINT),
                ) from None
            finally:
                runner.close()
                folder.write_failures(failures)
        if not failures:
            _tidy(folder.scratch, study.keep_frames)
        folder.write_failures(failures)
    return load_study(folder.path)


@contextmanager
def _interruptible() -> Iterator[None]:
    """Let Ctrl-C and SIGTERM interrupt, also where a shell that started this in the background ignores the first."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(number: int, frame: FrameType | None) -> None:
        raise Interrupted(number=number)

    before = {number: signal.signal(number, interrupt) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler if handler is not None else signal.SIG_DFL)


def _once(cells: Iterable[Cell]) -> list[Cell]:
    """Cells that are described alike run once."""
    return list({cell.key: cell for cell in cells}.values())


def _work_off(
    queue: Queue, runner: Backend, folder: StudyFolder, failures: list[dict[str, Any]], shown: StudyProgress | None
) -> None:
    while queue:
        while queue.waiting and len(queue.under_way) < runner.capacity:
            runner.submit(queue.take())
        outcome = runner.next()
        if outcome is None:
            continue
        cell = queue.ended(outcome.key)
        if outcome.rows is None:
            failures.append({"condition": cell.condition, "seed": cell.seed, "key": cell.key, "cause": outcome.cause})
        else:
            folder.append(cell, outcome.rows)
            if not queue.keep:
                shutil.rmtree(folder.scratch / cell.key, ignore_errors=True)
        for trunk in queue.no_longer_shared(cell):
            runner.forget(trunk)
        if shown:
            shown.ended(cell, outcome)


def _tidy(scratch: Path, keep: bool) -> None:
    """Remove what only a study under way needs."""
    if not keep:
        shutil.rmtree(scratch, ignore_errors=True)
        return
    for entry in scratch.iterdir():
        if entry.name.startswith(("training-", "movement-", "worker-")):
            shutil.rmtree(entry) if entry.is_dir() else entry.unlink()


class Queue:
    """The cells that wait and those that run.

    Cells come in the given order, except that a cell waits while another one computes something that both share.

    Args:
        cells: all cells that have not ended.
        keep: whether run folders are kept.
        whole: all cells of the study. What finished cells shared with others may still exist.
    """

    def __init__(self, cells: Sequence[Cell], keep: bool = False, whole: Sequence[Cell] | None = None) -> None:
        self.waiting = list(cells)
        self.under_way: dict[str, Cell] = {}
        self.keep = keep
        self._trunks = Counter(cell.trunk for cell in whole or cells)
        self._movements = Counter(cell.movement for cell in whole or cells)
        self._there: set[str] = set()

    def __bool__(self) -> bool:
        return bool(self.waiting or self.under_way)

    def take(self) -> Task:
        """The next cell to start."""
        computed = {name for cell in self.under_way.values() for name in self._shared(cell)} - self._there
        cell = min(self.waiting, key=lambda cell: sum(name in computed for name in self._shared(cell)))
        self.waiting.remove(cell)
        self.under_way[cell.key] = cell
        return Task.of(cell, self._trunks[cell.trunk] > 1, self._shares_movement(cell), self.keep)

    def ended(self, key: str) -> Cell:
        """A cell has ended, well or not."""
        cell = self.under_way.pop(key)
        self._there |= self._shared(cell)
        return cell

    def no_longer_shared(self, cell: Cell) -> list[str]:
        """First phases that no cell will need any more, now that this one has ended."""
        others = [*self.waiting, *self.under_way.values()]
        return [] if any(other.trunk == cell.trunk for other in others) else [cell.trunk]

    def _shared(self, cell: Cell) -> set[str]:
        """Names of what a cell shares with others."""
        trunk = {cell.trunk} if self._trunks[cell.trunk] > 1 else set()
        return trunk | ({cell.movement} if self._movements[cell.movement] > 1 else set())

    def _shares_movement(self, cell: Cell) -> bool:
        """Whether other cells have its arm movement, and storing it pays: it does for physics, which takes long."""
        dynamic = getattr(cell.experiment.body, "motion", None) == "dynamic"
        return dynamic and self._movements[cell.movement] > 1
