"""Studies of one robot minute and a half, with small maps, and learners of one's own that say when they run or fail."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from somatopy.experiment import Description, paper
from somatopy.experiment.changes import changed
from somatopy.studies.local import Outcome
from somatopy.studies.work import Task, work

#: What all cells have, as `every` of a study.
EVERY: dict[str, Any] = {
    "motion": "kinematic",
    "minutes": 1,
    "damage_minutes": 0.5,
    "learner.arm_map.shape": [8, 8],
    "learner.head_map.shape": [8, 8],
}
OWN = '''
"""Learners of one's own."""
import ctypes
import os
import signal
import time
from pathlib import Path

from somatopy.learners.controls import RandomGaze

LOG = Path(__file__).with_name("log")


class Counted(RandomGaze):
    """Says in a file when it meets its first frame, and the last one of all; the variable SLOW makes it slow."""

    first = True
    slow = float(os.environ.get("SLOW", 0))

    def observe(self, percept):
        if self.first or percept.time > 89.9:
            with LOG.open("a") as log:
                log.write(f"{os.getpid()} {percept.time:.1f}\\n")
        self.first = False
        time.sleep(self.slow)


class Raises(RandomGaze):
    """Fails at its first frame."""

    def fail(self):
        raise ValueError("this learner has had enough")

    def observe(self, percept):
        if not LOG.with_name("mended").exists():
            self.fail()


class Leaves(Raises):
    """Ends its process."""

    def fail(self):
        os._exit(3)


class Killed(Raises):
    """As one that took too much memory."""

    def fail(self):
        os.kill(os.getpid(), signal.SIGKILL)


class Crashes(Raises):
    """Brings down the interpreter."""

    def fail(self):
        ctypes.string_at(0)
'''


class Here:
    """Runs cells in this process."""

    capacity = 1

    def __init__(self, scratch: Path, processes: int | None = None) -> None:
        self._scratch, self._outcomes = scratch, list[Outcome]()

    def submit(self, task: Task) -> None:
        try:
            self._outcomes.append(Outcome(task.key, work(task, self._scratch)))
        except ValueError as error:
            self._outcomes.append(Outcome(task.key, None, str(error)))

    def next(self) -> Outcome:
        return self._outcomes.pop(0)

    def forget(self, trunk: str) -> None: ...

    def close(self) -> None:
        assert not self._outcomes


Described = Callable[..., Description]


@pytest.fixture(scope="session")
def described() -> Described:
    """A small description; keywords are changes, with __ for a dot."""

    def make(**changes: Any) -> Description:
        own = {key.replace("__", "."): value for key, value in changes.items()}
        return changed(changed(paper(), {**EVERY, "eye": "geometric"}), own)

    return make


@pytest.fixture(scope="session")
def in_process() -> type[Here]:
    """A backend without processes, for what is not about them: to start one takes seconds."""
    return Here


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Iterator[Path]:
    """A folder with learners of one's own, in a module that this process and those that it starts can import.

    Its name differs from test module to test module, since Python keeps what it has imported.
    """
    name = f"own_of_{request.module.__name__.rpartition('.')[2]}"
    folder = tmp_path_factory.mktemp("own")
    (folder / f"{name}.py").write_text(OWN, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        yield folder / f"{name}.py"
