"""Runs cells on a Ray cluster, whose machines share no disk, and may join or leave while a study runs.

A cell is a Ray task of one CPU. The task starts a process for the cell, as on one machine. A cell that crashes can thus
be told from a machine that is lost: the first has failed, while the second is tried again. Only measures are sent back.
"""

from __future__ import annotations

import socket
import sys
import sysconfig
import time
import uuid
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from somatopy.experiment.description import DescriptionError
from somatopy.studies.code import modules_of, packages, places
from somatopy.studies.driver import Backend
from somatopy.studies.local import Outcome
from somatopy.studies.node import remove, run_cell
from somatopy.studies.plan import Study
from somatopy.studies.task import Task

__all__ = ["Cluster", "modules_for", "on_cluster"]

#: How long to wait for an answer of the address, until it is looked again which machines are there, and for an end.
_ANSWER_S, _LOOK_S, _END_S = 5.0, 2.0, 20.0
#: How often a cell may take the Ray worker with it that looks after it, on machines that stay.
_CRASHES = 3


def on_cluster(study: Study, address: str) -> Callable[[Path], Backend]:
    """The backend with which `perform` runs a study on a Ray cluster.

    Args:
        study: the study. Parts of your own that it uses are sent to the cluster.
        address: HOST:PORT of a cluster to which this machine belongs, "auto" for the one that runs on this machine, or
            ray://HOST:PORT from outside of it.

    Raises:
        DescriptionError: Ray is not installed, no Ray answers at the address, or the study keeps run folders.
    """
    if study.keep_frames:
        raise DescriptionError(
            "keep_frames = true keeps the run folders of all cells on this machine, but a cluster shares no disk with "
            "it. Leave it out, or run the study without --ray."
        )
    _ray()
    _check_address(address)
    return lambda scratch: Cluster(address, modules_for(study))


class Cluster:
    """A Ray cluster.

    Args:
        address: see `on_cluster`.
        modules: modules and packages that are sent there, as files or folders.

    Attributes:
        capacity: number of CPUs that it has now, at least 1.

    Raises:
        DescriptionError: the cluster cannot be reached, or its Python or Ray has another version.
    """

    def __init__(self, address: str, modules: Iterable[Path]) -> None:
        ray = self._ray = _ray()
        carried = {"py_modules": [str(path) for path in modules], "excludes": ["*.pyc", "*.tmp.*"]}
        try:
            ray.init(address, runtime_env=carried, log_to_driver=False, logging_level="ERROR")
        except (OSError, RuntimeError, ImportError, ValueError) as error:
            raise DescriptionError(f"The Ray cluster at {address} cannot be used: {_line(error)}") from error
        self._run, self._remove = ray.remote(run_cell), ray.remote(remove)
        self._scratch = f"somatopy-{uuid.uuid4().hex[:12]}"
        self._under_way: dict[Any, Task] = {}
        self._crashes: Counter[str] = Counter()
        self._trained: defaultdict[str, set[str]] = defaultdict(set)
        self._freed = ""
        self._look()

    def submit(self, task: Task) -> None:
        """Start a cell, if possible on a machine on which its first phase has been trained."""
        stays = self._freed in self._trained[task.trunk]
        strategy = self._at(self._freed) if stays else "DEFAULT"
        options = {"num_cpus": 1, "max_retries": 0, "scheduling_strategy": strategy}
        reference = self._run.options(**options).remote(list(task), self._scratch, packages())
        self._under_way[reference] = task

    def next(self) -> Outcome | None:
        """Wait for a cell to end, but only for a moment, since machines may have joined."""
        references = [*self._under_way]
        if not references:
            time.sleep(_LOOK_S)
        ready = self._ray.wait(references, timeout=_LOOK_S)[0] if references else []
        self._look()
        return self._outcome(ready[0], self._under_way.pop(ready[0])) if ready else None

    def forget(self, trunk: str) -> None:
        """Remove a first phase that no cell needs any more from the machines that trained it."""
        for node in self._trained.pop(trunk, ()):
            self._remove_at(node, f"training-{trunk}")

    def close(self) -> None:
        """End all running cells, remove all files that were written on the machines, and disconnect."""
        try:
            for reference in self._under_way:
                self._ray.cancel(reference, force=True)
            pause = 1.0 if self._under_way else 0.0  # cells end themselves when the worker that started them has ended
            removed = [self._remove_at(node["NodeID"], "", pause) for node in self._nodes()]
            self._ray.wait(removed, num_returns=len(removed), timeout=_END_S) if removed else None
        finally:
            self._ray.shutdown()

    def _outcome(self, reference: Any, task: Task) -> Outcome | None:
        """How a task ended; None if it is tried again."""
        errors = self._ray.exceptions
        try:
            rows, cause, self._freed = self._ray.get(reference)
        except (errors.NodeDiedError, errors.ObjectLostError):
            self.submit(task)
            return None
        except (errors.WorkerCrashedError, errors.OutOfMemoryError) as error:
            self._crashes[task.key] += 1
            if self._crashes[task.key] < _CRASHES:
                self.submit(task)
                return None
            return Outcome(task.key, None, f"its Ray worker ended {_CRASHES} times: {_line(error)}")
        except errors.RayTaskError as error:
            return Outcome(task.key, None, _line(error.cause or error))
        except errors.RayError as error:
            return Outcome(task.key, None, f"{type(error).__name__}: {_line(error)}")
        if task.training is not None:
            self._trained[task.trunk].add(self._freed)
        return Outcome(task.key, rows, cause)

    def _look(self) -> None:
        self.capacity = max(1, int(sum(node["Resources"].get("CPU", 0) for node in self._nodes())))

    def _nodes(self) -> list[dict[str, Any]]:
        return [node for node in self._ray.nodes() if node["Alive"]]

    def _at(self, node: str, soft: bool = True) -> Any:
        return self._ray.util.scheduling_strategies.NodeAffinitySchedulingStrategy(node, soft=soft)

    def _remove_at(self, node: str, name: str, pause: float = 0.0) -> Any:
        options = {"num_cpus": 0, "max_retries": 0, "scheduling_strategy": self._at(node, soft=False)}
        return self._remove.options(**options).remote(self._scratch, name, pause)


def modules_for(study: Study) -> list[Path]:
    """The code that is sent to a cluster: somatopy, and each module or package with parts of the study.

    somatopy is sent even to machines where it is installed, because a cell's key depends on the code that runs it. Of
    installed packages only those are sent that a description names.
    """
    installed = {Path(sysconfig.get_path(name)) for name in ("purelib", "platlib")}
    found = {"somatopy": Path(__file__).parents[1]}
    for condition in study.conditions:
        for name in {*modules_of(condition.experiment), *places(condition.experiment)}:
            top = name.partition(".")[0]
            path = found.get(top) or _place(top)
            if path and (path.parent not in installed or name in places(condition.experiment)):
                found[top] = path
    return [*found.values()]


def _place(top: str) -> Path | None:
    """The file of a module, or the folder of a package."""
    module = sys.modules.get(top)
    folders = [*getattr(module, "__path__", ())]
    file = folders[0] if folders else getattr(module, "__file__", None)
    return Path(file) if file else None


# -- addresses ---------------------------------------------------------------------------------------------------------


def _ray() -> Any:
    try:
        import ray
        import ray.util.scheduling_strategies
    except ImportError as error:
        raise DescriptionError(
            'A study on a cluster needs Ray, which is not installed: pip install "somatopy[cluster]".'
        ) from error
    return ray


def _check_address(address: str) -> None:
    """Whether something answers there; Ray itself would try for a minute."""
    if address == "auto":
        return
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if not host or not port.isdigit():
        raise DescriptionError(f"--ray {address} is no address of a Ray cluster: auto, HOST:PORT or ray://HOST:PORT.")
    try:
        socket.create_connection((host.strip("[]"), int(port)), _ANSWER_S).close()
    except (OSError, OverflowError) as error:
        raise DescriptionError(
            f"No Ray cluster answers at {address} ({error}). Start one with `ray start --head --port {port}`, or name "
            "the address that it printed."
        ) from error


def _line(error: BaseException) -> str:
    """What an error says, in one line."""
    lines = str(error).strip().splitlines()
    return lines[0] if lines else type(error).__name__
