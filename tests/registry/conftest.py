"""Modules of one's own, each under a name that no other test has."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path

import pytest

Write = Callable[[str], str]
Stand = Callable[..., str]

LEARNER = """
class Mine:
    '''Looks at one place.'''

    def __init__(self, robot, rng, rate: float = 0.5, label: str = "left"):
        self.robot, self.rng, self.rate, self.label = robot, rng, rate, label
"""
NUMBERS = count()


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Write]:
    """Writes a module into a folder where modules are found, and gives its name."""
    monkeypatch.syspath_prepend(str(tmp_path))

    def module(source: str) -> str:
        name = f"own_parts_{next(NUMBERS)}"
        (tmp_path / f"{name}.py").write_text("from __future__ import annotations\n" + source)
        return name

    yield module
    for name in [name for name in sys.modules if name.startswith("own_parts_")]:
        del sys.modules[name]


@pytest.fixture
def stand(write: Write) -> Stand:
    """Writes a module, and gives the place of what is called `Mine` in it, or otherwise."""
    return lambda source, name="Mine": f"{write(source)}:{name}"


@pytest.fixture
def source() -> str:
    """A learner of one's own, as far as the registry looks at it."""
    return LEARNER


@pytest.fixture
def mine(stand: Stand) -> str:
    """The place where that learner stands."""
    return stand(LEARNER)
