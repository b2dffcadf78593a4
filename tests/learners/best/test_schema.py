"""Surprise, what it lets be learned, and being lost: the numbers of docs/best.md, steps 7 and 8, by hand."""

from __future__ import annotations

import numpy as np
import pytest
from tests.learners.best.world import robot

from somatopy.learners.best.directions import NEAREST, active, direction, dual_of, learn_direction, powers
from somatopy.learners.best.memory import (
    CALM,
    FAST_ERROR,
    FAST_SIGHT,
    FRAMES,
    HITS,
    LASTING,
    NUMBERS,
    SLOW_ERROR,
    SLOW_SIGHT,
    SURPRISE,
    UNITS,
    fresh,
)
from somatopy.learners.best.schema import count_sight, is_lost, move_schema, pace_of, surprise, trust_of
from somatopy.percept import Floats


def test_surprise_compares_a_fast_and_a_slow_average_and_lambda_follows_it() -> None:
    """kappa = 2 (n_f - 2 n_s) / n_f after both have moved, .01 and .0005 of the way; lambda then .005 of the way."""
    numbers = np.zeros(NUMBERS)
    numbers[[FAST_ERROR, SLOW_ERROR, LASTING, HITS]] = 0.3, 0.1, 0.2, 4000
    surprise(numbers, np.array([0.3, 0.4]))
    fast, slow = 0.3 + 0.01 * (0.5 - 0.3), 0.1 + 0.0005 * (0.5 - 0.1)
    kappa = 2 * (fast - 2 * slow) / fast
    assert 0 < kappa < 1
    assert numbers[[FAST_ERROR, SLOW_ERROR, SURPRISE]] == pytest.approx([fast, slow, kappa])
    assert numbers[LASTING] == pytest.approx(0.2 + 0.005 * (kappa - 0.2))


def test_a_beginner_is_not_surprised() -> None:
    """Until its 4,000th hit the slow average is never below the fast one."""
    for hits, surprised in ((3999, False), (4000, True)):
        numbers = np.zeros(NUMBERS)
        numbers[[FAST_ERROR, SLOW_ERROR, HITS]] = 0.5, 0.1, hits
        surprise(numbers, np.array([0.5, 0.0]))
        assert (numbers[SURPRISE] > 0) == surprised and (numbers[SLOW_ERROR] < 0.11) == surprised


@pytest.mark.parametrize(
    ("kappa", "lasting", "trust"), [(0.0, 0.7, 1.0), (1.0, 0.0, 0.0), (0.5, 0.6, 0.68), (1.0, 0.5, 0.25), (1, 1, 1)]
)
def test_what_is_learned_in_surprise(kappa: float, lasting: float, trust: float) -> None:
    """1 - kappa (1 - lambda^2)."""
    numbers = np.zeros(NUMBERS)
    numbers[[SURPRISE, LASTING]] = kappa, lasting
    assert trust_of(numbers) == pytest.approx(trust)


def test_sight_is_a_plain_mean_at_first() -> None:
    """Of the first 5,000 frames; it moves by .0002 of the way after them, the fast one by .0033 throughout."""
    numbers, hits, fast = np.zeros(NUMBERS), np.random.default_rng(0).random(5000) < 0.4, 0.0
    for hit in hits:
        count_sight(numbers, bool(hit))
        fast += 0.0033 * (hit - fast)
    assert numbers[SLOW_SIGHT] == pytest.approx(hits.mean()) and numbers[FAST_SIGHT] == pytest.approx(fast)
    count_sight(numbers, True)
    assert numbers[SLOW_SIGHT] == pytest.approx(hits.mean() + 0.0002 * (1 - hits.mean()))


@pytest.mark.parametrize(("frames", "share", "lost"), [(5001, 0.24, True), (5001, 0.26, False), (5000, 0.24, False)])
def test_a_hand_that_is_seen_less_than_a_quarter_as_often_is_lost(frames: int, share: float, lost: bool) -> None:
    """Once it is known how often it used to be."""
    numbers = np.zeros(NUMBERS)
    numbers[[FRAMES, SLOW_SIGHT, FAST_SIGHT]] = frames, 0.8, share * 0.8
    assert is_lost(numbers) == lost


# -- how fast directions learn ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("calm", "pace"), [(0, 1.0), (4000, 0.5), (12_000, 0.25), (16_001, 0.2), (1_000_000, 0.2)])
def test_directions_slow_down_while_all_is_calm(calm: int, pace: float) -> None:
    """1 / (1 + h / 4,000) after h hits, and .2 at least."""
    numbers = fresh(robot(4)).numbers
    numbers[CALM] = calm
    assert pace_of(numbers) == pytest.approx(pace)


def test_hits_are_calm_beyond_the_first_four_thousand() -> None:
    """A beginner learns as fast as it can."""
    numbers = fresh(robot(4)).numbers
    for _ in range(4010):
        surprise(numbers, np.array([0.02, 0.0]))
    assert numbers[CALM] == 10.0


def test_a_surprise_makes_directions_learn_fast_again() -> None:
    """It takes a percent of the calm hits at each hit while kappa is 1."""
    numbers = fresh(robot(4)).numbers
    for _ in range(30_000):
        surprise(numbers, np.array([0.02, 0.0]))
    assert pace_of(numbers) == 0.2
    for _ in range(500):
        surprise(numbers, np.array([0.5, 0.0]))
    assert pace_of(numbers) > 0.9
    numbers[[HITS, CALM, SURPRISE]] = 50_000, 1000, 0.0
    numbers[[FAST_ERROR, SLOW_ERROR]] = 1.0, 1e-3
    surprise(numbers, np.array([1.0, 0.0]))
    assert numbers[SURPRISE] == 1.0 and numbers[CALM] == pytest.approx(0.99 * 1001)


def test_a_direction_that_learns_slowly_is_the_mean_over_what_cannot_be_learned() -> None:
    """Where a hand is seen to either side by chance, as with a dead joint: nearer to its middle after calm hours."""
    rng = np.random.default_rng(0)
    off = {}
    for calm in (0.0, 1e6):
        memory, g = fresh(robot(1)), np.empty(2)
        memory.numbers[[UNITS, CALM]] = 1, calm
        phi, dual, own, share = np.array([1.0, 0.0, 0.0]), np.empty(3), np.zeros(1, np.int64), np.ones(1)
        found = []
        for side in rng.normal(0.0, 0.2, (3000, 2)):
            direction(memory.plane, memory.turns, phi, own, share, 1, g)
            found.append(np.linalg.norm(g))
            length = dual_of(memory, phi, dual)
            learn_direction(memory, side - g, pace_of(memory.numbers), dual, length, own, share, 1)
        off[calm] = np.mean(found[500:])
    assert off[1e6] < 0.5 * off[0.0]


# -- the schema's step ------------------------------------------------------------------------------------------------


def test_the_schema_steps_along_the_slope_of_the_direction() -> None:
    """c += clip(.1 kappa J' (J J' + .05 I)^-1 e, +-.05), where J is the slope of g, here by differences.

    The arm moves unequally far in its joints. All units are active, since where units come and go, g jumps.
    """
    memory, rng = fresh(robot(3)), np.random.default_rng(0)
    memory.extent[:], memory.numbers[UNITS] = (0.3, 0.6, 1.0), NEAREST
    x = np.array([0.4, 0.6, 0.5])
    memory.units[:NEAREST] = x + 0.1 * memory.extent * rng.uniform(-1, 1, (NEAREST, 3))
    memory.turns[:NEAREST], memory.plane[:] = rng.normal(size=(NEAREST, 2)), rng.normal(size=memory.plane.shape)
    index, share, phi = np.empty(NEAREST, np.int64), np.empty(NEAREST), np.empty(10)

    def g(posture: Floats) -> Floats:
        out = np.empty(2)
        found = active(memory.units, memory.extent, NEAREST, posture, index, share)
        assert found == NEAREST
        powers(posture, phi)
        direction(memory.plane, memory.turns, phi, index, share, found, out)
        return out

    slope = np.column_stack([(g(x + way) - g(x - way)) / 2e-6 for way in 1e-6 * np.eye(3)])
    g(x)
    error = np.array([0.02, -0.03])
    step = move_schema(memory, x, error, 0.7, index, share, NEAREST)
    expected = 0.07 * slope.T @ np.linalg.solve(slope @ slope.T + 0.05 * np.eye(2), error)
    assert 1e-4 < np.abs(expected).max() < 0.05
    np.testing.assert_allclose(step, expected, rtol=1e-5)
    np.testing.assert_allclose(np.abs(move_schema(memory, x, 1e4 * error, 0.7, index, share, NEAREST)), 0.05)
