"""The oracle without memory: exact in worlds that can be counted, between a fixed gaze and the ceiling on a robot."""

from __future__ import annotations

from contextlib import closing

import numpy as np
import pytest
from numpy.typing import NDArray

from somatopy.bodies import MujocoBody
from somatopy.experiment.ceiling import Vantages, best_fixed_head, reachable
from somatopy.experiment.reference import blurred, memoryless, unfelt
from somatopy.percept import Floats

BINS = 8


class Bins:
    """Gaze k sees the hand where the first joint is in the k-th of eight parts of its range, 0 to 1."""

    def seeing(self, arm: Floats) -> NDArray[np.bool_]:
        return np.arange(BINS) == int(arm[0] * BINS)


def uneven(count: int, seed: int = 0) -> Floats:
    """First joints in the last part with a probability of 0.3, in each other with 0.1; second ones uniform."""
    rng, shares = np.random.default_rng(seed), [0.1] * (BINS - 1) + [0.3]
    first = (rng.choice(BINS, count, p=shares) + rng.uniform(0, 1, count)) / BINS
    return np.column_stack([first, rng.uniform(0, 1, count)])


def test_what_is_not_needed_is_not_missed() -> None:
    """With the second joint dead, which nothing depends on, all is seen."""
    assert memoryless(Bins(), uneven(300), unfelt([1], uneven(2000, 1))).all()


def test_without_the_joint_that_counts_it_looks_where_the_hand_is_most_often() -> None:
    """In three of ten postures, in the last part; so it is with all joints dead."""
    arms, babbled = uneven(500), uneven(2000, 1)
    for dead in ([0], [0, 1]):
        hits = memoryless(Bins(), arms, unfelt(dead, babbled, 150))
        assert np.array_equal(hits, arms[:, 0] * BINS >= BINS - 1)
        assert hits.mean() == pytest.approx(0.3, abs=0.07)


def test_a_dead_joint_is_told_by_others_that_move_with_it() -> None:
    """Where babbling couples two joints, one tells the other."""
    first = np.random.default_rng(0).uniform(0, 1, 3000)
    babbled = np.column_stack([first, first])
    assert memoryless(Bins(), babbled[:300], unfelt([0], babbled, 5)).mean() > 0.98


@pytest.mark.parametrize("deviation", [0.01, 0.04, 0.2])
def test_noise_costs_what_can_be_computed(deviation: float) -> None:
    """Of a uniform joint under normal noise the best gaze is the part that was felt: its rate is an integral."""
    rng = np.random.default_rng(2)
    arms = rng.uniform(0, 1, (1000, 1))
    felt = np.random.default_rng(3).normal(arms.ravel(), deviation)
    inside = np.clip((felt * BINS).astype(int), 0, BINS - 1)
    expected = (inside == (arms.ravel() * BINS).astype(int)).mean()
    hits = memoryless(Bins(), arms, blurred(deviation, arms, rng, 80))
    assert hits.mean() == pytest.approx(expected, abs=0.05)


def test_on_a_robot_it_lies_between_the_best_fixed_gaze_and_the_ceiling() -> None:
    """The elbow's yaw dead costs something, not all; with exact knowledge it is the ceiling, posture by posture."""
    with closing(MujocoBody("nao", motion="kinematic")) as body:
        vantages = Vantages.of(body, (49, 15))
        low, high = body.arm.space.limits.T
        babbled = np.random.default_rng(0).uniform(low, high, (3000, 4))
        arms = np.random.default_rng(1).uniform(low, high, (150, 4))
        possible = reachable(vantages, arms)
        assert np.array_equal(memoryless(vantages, arms, lambda arm: arm[None]), possible)
        assert np.array_equal(memoryless(vantages, arms, blurred(0.0, babbled, np.random.default_rng(0), 1)), possible)
        hits = memoryless(vantages, arms, unfelt([2], babbled, 24))
        assert not (hits & ~possible).any()
        fixed = best_fixed_head(body, babbled[:300], (25, 9))
        by_chance = np.mean([vantages.eye.find(body.view(arm, fixed)) is not None for arm in arms])
        assert by_chance + 0.05 < hits.mean() < possible.mean() - 0.05
