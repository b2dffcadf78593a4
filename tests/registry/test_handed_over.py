"""Parts that are handed over: what can be imported is named by its place, what cannot is asked for again."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from types import SimpleNamespace
from typing import Any

import pytest
from pydantic import ValidationError

from somatopy.learners import RandomGaze
from somatopy.registry import (
    LEARNERS,
    Kinds,
    Settings,
    UnknownKind,
    handed_over,
)
from somatopy.validation import explain

Write = Callable[[str], str]
Stand = Callable[..., str]
CONTEXT: Any = SimpleNamespace(robot="the robot", rng="the generator")


def said(kinds: Kinds, value: Any) -> str:
    """Why a value is refused."""
    with pytest.raises(ValueError) as caught:
        kinds.validated(value)
    error = caught.value
    return explain(error, lambda keys: []) if isinstance(error, ValidationError) else str(error)


def built(settings: Settings) -> Any:
    return settings.build(CONTEXT)


AGAIN = "was handed over when the run began and cannot be imported; hand it over again: learner=..."


class Instance:
    """A learner, as far as anybody asks."""

    def observe(self, percept: Any) -> None: ...


def local(robot: Any, rng: Any, rate: float = 1.0) -> Any:
    return robot, rate


def in_main(robot: Any, rng: Any) -> Any:
    return robot


in_main.__module__ = "__main__"


def nested() -> Any:
    class Mine:
        def __init__(self, robot: Any, rng: Any) -> None: ...

    return Mine


class Factory:
    """Makes a learner when it is called."""

    def __call__(self, robot: Any, rng: Any) -> Any:
        return robot


@pytest.mark.parametrize(
    ("part", "name"),
    [
        (lambda robot, rng: robot, "<lambda>"),
        (nested(), "nested.<locals>.Mine"),
        (in_main, "__main__:in_main"),
        (partial(local, rate=3), "partial"),
        (Factory(), "Factory"),
        (Instance(), "Instance"),
    ],
    ids=["lambda", "local class", "main", "partial", "callable", "instance"],
)
def test_what_cannot_be_imported_is_recorded_by_name_and_asked_for_again(part: Any, name: str) -> None:
    """Its settings stand for it and build it; read again from a file, the name is answered with what to do."""
    settings = handed_over(LEARNERS, part)
    assert settings.kind.endswith(name)
    assert LEARNERS.dumped(settings)["kind"] == settings.kind
    built(settings)
    assert said(LEARNERS, settings.kind) == f"kind = '{settings.kind}' {AGAIN}"
    assert said(LEARNERS, {"kind": settings.kind}) == f"kind = '{settings.kind}' {AGAIN}"


def test_an_instance_is_built_as_it_is() -> None:
    """The very same, each time; what a partial function was told stays told."""
    instance = Instance()
    settings = handed_over(LEARNERS, instance)
    assert settings.build(CONTEXT) is settings.build(CONTEXT) is instance
    assert built(handed_over(LEARNERS, partial(local, rate=3))) == ("the robot", 3)


def test_what_can_be_imported_is_recorded_by_its_place(mine: str) -> None:
    """A class or function of a module is found again by itself; ours have their names."""
    settings = LEARNERS.validated(mine)
    part = sys.modules[mine.partition(":")[0]].Mine
    assert handed_over(LEARNERS, part) == settings and settings.kind == mine
    assert handed_over(LEARNERS, RandomGaze) == LEARNERS.validated("random")
    settings = LEARNERS.validated({"kind": mine, "rate": 9})
    assert handed_over(LEARNERS, settings) is settings


def test_a_class_that_no_longer_stands_at_its_place_has_none(write: Write, source: str) -> None:
    """What its name leads to now is another: to resume with that would be a mistake."""
    module = write(f"{source}\nOld = Mine\n{source}")
    LEARNERS.settings(f"{module}:Mine")
    assert said(LEARNERS, handed_over(LEARNERS, sys.modules[module].Old).kind).endswith(AGAIN)


def test_a_part_that_needs_values_says_which(write: Write) -> None:
    """Handed over alone, nobody says them; with them, it is built."""
    module = write("class Mine:\n    def __init__(self, robot, rng, rate: float):\n        self.rate = rate\n")
    LEARNERS.settings(f"{module}:Mine")
    mine = sys.modules[module].Mine
    with pytest.raises(UnknownKind, match=r"needs a value for rate; hand over functools.partial\(Mine, rate=\.\.\.\)"):
        handed_over(LEARNERS, mine)
    assert built(handed_over(LEARNERS, partial(mine, rate=2.0))).rate == 2.0
