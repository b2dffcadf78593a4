"""What a description can say of babbling: its range and its speed, and what is refused."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from somatopy.babbling import UniformBabbler
from somatopy.babbling.uniform import Uniform
from somatopy.contract import same
from somatopy.percept import Floats, JointGroup
from somatopy.registry import BABBLERS, Kinds
from somatopy.validation import explain

ARM = JointGroup(("shoulder", "elbow"), np.array([-2.0, -1.0]), np.array([2.0, 1.0]), np.array([8.0, 0.25]))
START = np.array([0.25, -0.1])
RANGES = {"mechanical": np.column_stack([ARM.lower, ARM.upper]), "near": np.array([[-0.5, 0.5], [0.0, 0.5]])}


def said(kinds: Kinds, value: Any) -> str:
    """Why a value is refused, in the words that a user reads."""
    with pytest.raises(ValueError) as caught:
        kinds.validated(value)
    error = caught.value
    return explain(error, lambda keys: []) if isinstance(error, ValidationError) else str(error)


def context(seed: int = 0) -> Any:
    """What an experiment hands over to a babbler."""

    def named(name: str) -> Floats:
        if name not in RANGES:
            raise ValueError(f"range {name!r} is unknown")
        return RANGES[name]

    return SimpleNamespace(arm=ARM, start=START, rng=np.random.default_rng(seed), range=named)


def commands(babbler: Any) -> list[Floats]:
    return [babbler.command(k / 3) for k in range(300)]


def test_without_settings_it_babbles_in_the_whole_range() -> None:
    """The joints' limits, at .8 rad/s."""
    assert BABBLERS.validated("uniform") == BABBLERS.validated({}) == Uniform("mechanical", 0.8)
    babbler = BABBLERS.validated({}).build(context())
    expected = UniformBabbler(ARM, RANGES["mechanical"], 0.8, START, np.random.default_rng(0))
    assert same(commands(babbler), commands(expected))


@pytest.mark.parametrize(
    ("wanted", "bounds"),
    [
        ("near", RANGES["near"]),
        ([[-1, 1], [0, 0.75]], [[-1, 1], [0, 0.75]]),
        (((0.5, 0.5), (0, 1)), [[0.5, 0.5], [0, 1]]),
    ],
)
def test_range_and_speed_are_those_of_the_settings(wanted: Any, bounds: Any) -> None:
    """A range that the body names, or low and high of each joint; the start is where the arm is at time 0."""
    babbler = BABBLERS.validated({"range": wanted, "speed": 0.3}).build(context(4))
    expected = UniformBabbler(ARM, bounds, 0.3, START, np.random.default_rng(4))
    assert same(commands(babbler), commands(expected))


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"speed": 0}, "speed.*greater than 0"),
        ({"speed": float("inf")}, "speed"),
        ({"range": 3}, "range"),
        ({"range": [[0, 1, 2]]}, "range"),
        ({"range": [[0, float("nan")]]}, "range"),
    ],
)
def test_wrong_values_are_refused_at_their_key(table: dict[str, Any], message: str) -> None:
    """Before anything is built."""
    assert re.match(message, said(BABBLERS, table))
    with pytest.raises(ValueError, match=f"^The changed uniform: {message}"):
        Uniform().replaced(**table)


@pytest.mark.parametrize(
    ("wanted", "message"),
    [
        ("far", "range 'far' is unknown"),
        ([[-1, 1]], r"\[low, high\] for each of shoulder, elbow"),
        ([[-3, 1], [0, 1]], r"\[-3, 1\] of shoulder must lie inside its limits"),
        ([[1, -1], [0, 1]], "low end first"),
    ],
)
def test_a_range_that_does_not_fit_the_arm_is_refused_when_it_is_built(wanted: Any, message: str) -> None:
    """The joint and its limits are named."""
    with pytest.raises(ValueError, match=message):
        BABBLERS.validated({"range": wanted}).build(context())
