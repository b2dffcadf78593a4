"""Runs cells in processes of this machine. If one of them crashes, the others go on."""

from __future__ import annotations

import json
import os
import selectors
import shutil
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from somatopy.studies.task import Task

__all__ = ["Local", "Outcome"]

#: One thread a process: processes share the cores. LP_NUM_THREADS is that of software OpenGL.
_ONE_THREAD = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "NUMBA_NUM_THREADS": "1",
    "LP_NUM_THREADS": "0",
}
_PATIENCE_S = 20.0


class Outcome(NamedTuple):
    """How a cell ended.

    Attributes:
        key: key of the cell.
        rows: measures of the cell; None if it failed.
        cause: why the cell failed; "" if it did not.
    """

    key: str
    rows: list[dict[str, Any]] | None
    cause: str = ""


class _Process:
    """A worker process, and the cell that it runs."""

    def __init__(self, number: int, scratch: Path) -> None:
        self.key = ""
        self.log = scratch / f"worker-{os.getpid()}-{number}.log"  # several may share the folder
        with self.log.open("ab") as log:
            self.popen = subprocess.Popen(
                [sys.executable, "-m", "somatopy.studies.worker"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path)), **_ONE_THREAD},
                process_group=0,  # Ctrl-C reaches the driver alone, which then tells each worker once
            )
        self._say({"path": sys.path, "scratch": str(scratch.resolve())})
        self._said = self.log.stat().st_size

    def _say(self, message: Any) -> None:
        assert self.popen.stdin is not None
        with suppress(BrokenPipeError):  # it has ended: reading its answer tells
            self.popen.stdin.write(json.dumps(message).encode() + b"\n")
            self.popen.stdin.flush()

    def start(self, task: Task) -> None:
        self.key, self._said = task.key, self.log.stat().st_size
        self._say(task)

    def answer(self) -> Outcome:
        """How the cell ended; the process may have ended with it."""
        assert self.popen.stdout is not None
        line = self.popen.stdout.readline()
        key, self.key = self.key, ""
        if line.endswith(b"\n"):
            found = json.loads(line)
            return Outcome(key, found.get("rows"), found.get("cause", ""))
        return Outcome(key, None, self._why_it_ended())

    def _why_it_ended(self) -> str:
        code = self.popen.wait()
        if code >= 0:
            return f"its process ended with code {code}{self._last_words()}"
        name = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
        hint = "; there may have been too little memory" if -code == signal.SIGKILL else ""
        return f"its process was ended by {name}{hint}{self._last_words()}"

    def _last_words(self) -> str:
        with self.log.open("rb") as log:
            log.seek(self._said)
            lines = log.read().decode(errors="replace").strip().splitlines()
        fatal = [line for line in lines if line.startswith("Fatal")]
        return f" ({(fatal or lines)[-1]})" if lines else ""

    def end(self) -> None:
        assert self.popen.stdin is not None and self.popen.stdout is not None
        with suppress(OSError):
            self.popen.stdin.close()
        try:
            self.popen.wait(_PATIENCE_S if self.key else None)
        except subprocess.TimeoutExpired:
            self.popen.kill()
            self.popen.wait()
        self.popen.stdout.close()


class Local:
    """Processes of this machine.

    Args:
        scratch: a folder for files that the processes share.
        processes: number of processes; as many as there are cores if None.
    """

    def __init__(self, scratch: Path, processes: int | None = None) -> None:
        self.capacity = processes or cores()
        self._scratch = scratch
        self._processes: list[_Process] = []
        self._started = 0

    def submit(self, task: Task) -> None:
        """Start a cell. Fewer than `capacity` cells may be running."""
        free = next((each for each in self._processes if not each.key and each.popen.poll() is None), None)
        if free is None:
            free = _Process(self._started, self._scratch)
            self._started += 1
            self._processes.append(free)
        free.start(task)

    def next(self) -> Outcome:
        """Wait until a cell ends."""
        with selectors.DefaultSelector() as selector:
            for process in self._processes:
                if process.key:
                    assert process.popen.stdout is not None
                    selector.register(process.popen.stdout, selectors.EVENT_READ, process)
            ready: _Process = selector.select()[0][0].data
        outcome = ready.answer()
        if ready.popen.poll() is not None:
            ready.end()
            self._processes.remove(ready)
        return outcome

    def forget(self, trunk: str) -> None:
        """Remove a shared first phase that no cell needs any more."""
        shutil.rmtree(self._scratch / f"training-{trunk}", ignore_errors=True)

    def close(self) -> None:
        """End all processes. Those that run a cell write a checkpoint of it."""
        for process in self._processes:
            if process.key:
                process.popen.send_signal(signal.SIGTERM)
        for process in self._processes:
            process.end()
        self._processes.clear()


def cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
