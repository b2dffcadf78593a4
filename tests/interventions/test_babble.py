"""Other babbling: slower movements are the same ones in more time, and another range lies about the same middle."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tests.interventions.damages import ARM, percept

from somatopy.babbling.uniform import Uniform
from somatopy.percept import Floats
from somatopy.registry import INTERVENTIONS

BOUNDS = np.array([[-0.5, 1.5], [0.0, 1.0], [0.55, 0.75], [0.0, 0.08]])
START = BOUNDS.mean(axis=1)
SPEED = 0.6
TIMES = np.arange(400) / 15


def built(damage: Any, range: Any = "near", seed: int = 0, fresh: int = 0) -> Any:
    """The damage of an experiment whose arm babbles in `BOUNDS`; `fresh` seeds what else the context has."""

    def context(rng: np.random.Generator) -> Any:
        return SimpleNamespace(
            arm=ARM,
            start=START,
            rng=rng,
            range={"near": BOUNDS, "mechanical": ARM.space.limits}.__getitem__,
            description=SimpleNamespace(babbling=Uniform(range, SPEED), seed=seed),
            told=lambda rng: context(rng),
        )

    return INTERVENTIONS.validated(damage).build(context(np.random.default_rng(fresh)))


def targets(damage: Any, times: Floats = TIMES) -> Floats:
    """What the arm is told at these times, whatever the experiment's own babbler says."""
    rng, told = np.random.default_rng(0), []
    for time in times:
        damage.sense(percept(START, time), rng)
        target, gaze = damage.act(START, np.array([0.1, 0.2]), rng)
        assert gaze.tolist() == [0.1, 0.2]
        told.append(target)
    return np.array(told)


@pytest.mark.parametrize("factor", [0.5, 1.5])
def test_at_another_speed_the_same_movements_take_another_time(factor: float) -> None:
    """At half the speed twice as long; so there are half as many of them."""
    slower = targets(built({"kind": "arm-speed", "factor": factor}), TIMES / factor)
    plain = targets(built({"kind": "babbling-range", "range": 1.0}))
    np.testing.assert_allclose(slower, plain)
    assert len(np.unique(plain, axis=0)) > 5


def test_a_share_of_the_range_lies_about_its_middle() -> None:
    """All targets of a quarter are in the middle quarter, and reach both of its ends."""
    found = targets(built({"kind": "babbling-range", "range": 0.25}), np.arange(0.0, 9000.0, 9.0))
    shares = (found - START) / np.ptp(BOUNDS, axis=1)
    np.testing.assert_allclose(shares.min(axis=0), -0.125, atol=0.003)
    np.testing.assert_allclose(shares.max(axis=0), 0.125, atol=0.003)


@pytest.mark.parametrize(
    ("wanted", "bounds"),
    [
        (10.0, ARM.space.limits),  # never beyond the joints' limits
        ("mechanical", ARM.space.limits),
        ([[0, 1], [0, 0.5], [0.5, 0.6], [0, 0.1]], [[0, 1], [0, 0.5], [0.5, 0.6], [0, 0.1]]),
    ],
)
@pytest.mark.parametrize("own", ["near", tuple(map(tuple, BOUNDS.tolist()))])
def test_a_range_is_the_one_that_was_said(own: Any, wanted: Any, bounds: Any) -> None:
    """As wide as the joints go, by its name, or low and high of each joint; whether the own one has a name or not."""
    found = targets(built({"kind": "babbling-range", "range": wanted}, own), np.arange(0.0, 9000.0, 9.0))
    low, high = np.transpose(bounds)
    assert (found >= low).all() and (found <= high).all()
    np.testing.assert_allclose(np.ptp(found, axis=0), high - low, rtol=0.02)


def test_the_movement_depends_on_the_seed_alone() -> None:
    """Not on what random numbers the damage has, which depend on its place in the description."""
    slow = {"kind": "arm-speed"}
    assert np.array_equal(targets(built(slow)), targets(built(slow, fresh=9)))
    assert not np.array_equal(targets(built(slow)), targets(built(slow, seed=1)))


def test_it_goes_on_from_a_state() -> None:
    """In mid-movement, bit for bit, and a percept of an earlier time does not turn the clock back."""
    slow = {"kind": "arm-speed"}
    whole, other = built(slow), built(slow, seed=5)
    targets(whole, TIMES[:150])
    state = whole.state()
    expected = targets(whole, TIMES[150:])
    other.restore(state)
    other.sense(percept(START, 0.0), np.random.default_rng(0))
    assert np.array_equal(targets(other, TIMES[150:]), expected)
