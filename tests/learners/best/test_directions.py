"""The map of units: in which units it measures distances, and what it does once it is full."""

from __future__ import annotations

import numpy as np
import pytest
from tests.learners.best.world import robot

from somatopy.clock import FRAMES_PER_MINUTE
from somatopy.learners.best.directions import NEAREST, active, find_or_add, learn_extent
from somatopy.learners.best.memory import FORGOTTEN, FRAMES, MOST_UNITS, UNITS, Memory, fresh
from somatopy.percept import Floats

NOW = 20_000


def full(longest: int) -> Memory:
    """A map without room, all in one corner; unit 17 was nearest so many frames ago, the others a minute ago."""
    memory, rng = fresh(robot(4)), np.random.default_rng(0)
    memory.units[:] = rng.uniform(0.0, 0.1, memory.units.shape)
    memory.turns[:], memory.fields[:] = 1.0, 2.0
    memory.used[:] = NOW - FRAMES_PER_MINUTE
    memory.used[17] = NOW - longest
    memory.numbers[[UNITS, FRAMES, FORGOTTEN]] = MOST_UNITS, NOW, 3.5
    return memory


def found_at(memory: Memory, x: float) -> tuple[int, np.ndarray]:
    """How many units are active there, and which."""
    index = np.full(NEAREST, -1)
    return find_or_add(memory, np.full(4, x), True, index, np.empty(NEAREST)), index


def test_a_full_map_replaces_what_was_never_nearest_for_five_minutes() -> None:
    """By a unit that says nothing yet, has nothing to forget, and was nearest now; there are no more of them."""
    memory = full(5 * FRAMES_PER_MINUTE + 1)
    others = np.arange(MOST_UNITS) != 17
    before = memory.units[others].copy()
    count, index = found_at(memory, 0.9)
    assert (count, index[0], memory.numbers[UNITS], memory.used[17]) == (1, 17, MOST_UNITS, NOW)
    np.testing.assert_array_equal(memory.units[17], 0.9)
    assert not memory.turns[17].any() and not memory.fields[17].any() and memory.faded[17] == 3.5
    np.testing.assert_array_equal(memory.units[others], before)
    assert (memory.turns[others] == 1.0).all() and not memory.faded[others].any()


@pytest.mark.parametrize(("longest", "x"), [(5 * FRAMES_PER_MINUTE, 0.9), (NOW, 0.1)])
def test_else_it_stays_as_it_is(longest: int, x: float) -> None:
    """Where all have been nearest since then, and where a posture is not far from all of them."""
    memory = full(longest)
    before = memory.units.copy()
    count, index = found_at(memory, x)
    np.testing.assert_array_equal(memory.units, before)
    assert count >= 1 and memory.used[index[0]] == NOW


# -- in which units distances are measured ----------------------------------------------------------------------------


def babbled(postures: Floats) -> Memory:
    """A map that has met these postures, one a frame."""
    memory, index, share = fresh(robot(4)), np.empty(NEAREST, np.int64), np.empty(NEAREST)
    for x in postures:
        memory.numbers[FRAMES] += 1
        find_or_add(memory, x, True, index, share)
        learn_extent(memory, x)
    return memory


def test_the_extent_is_six_times_how_far_postures_are_from_their_mean() -> None:
    """A first guess of .25 counts as much as 300 frames; the result is held between .05 and 1."""
    spread = np.array([0.02, 0.08, 0.14, 0.0])
    postures = 0.5 + spread * np.random.default_rng(0).uniform(-1, 1, (5000, 4))
    means = np.cumsum(postures, axis=0) / np.arange(1, 5001)[:, None]
    apart = 0.25 * np.ones(4)
    for k, away in enumerate(np.abs(postures - means)):
        apart += (away - apart) / (301 + k)
    memory = babbled(postures)
    np.testing.assert_allclose(memory.middle, postures.mean(axis=0))
    np.testing.assert_allclose(memory.extent, np.clip(6 * apart, 0.05, 1.0))
    assert np.all(np.abs(memory.extent - [0.14, 0.31, 0.48, 0.08]) < 0.02)


def test_the_extent_is_the_whole_range_at_first_and_stands_after_five_thousand_frames() -> None:
    """A beginner does not yet know how far its arm moves; later a new range, or a dead joint, changes nothing."""
    rng = np.random.default_rng(0)
    np.testing.assert_array_equal(fresh(robot(4)).extent, 1.0)
    np.testing.assert_array_equal(babbled(np.full((1, 4), 0.5)).extent, 1.0)
    memory = babbled(rng.uniform(0.4, 0.6, (5000, 4)))
    before = memory.extent.copy()
    for x in rng.uniform(size=(500, 4)):
        memory.numbers[FRAMES] += 1
        learn_extent(memory, x)
    np.testing.assert_array_equal(memory.extent, before)
    assert before.max() < 0.5


def test_an_arm_that_moves_in_a_tenth_of_its_range_gets_more_than_one_unit() -> None:
    """It gets twenty at least, and no more than an arm that moves in all of it; by the limits it would get one."""
    rng = np.random.default_rng(0)
    wide, narrow = (babbled(0.5 + width * rng.uniform(-0.5, 0.5, (8000, 4))) for width in (1.0, 0.1))
    assert 20 <= narrow.numbers[UNITS] < wide.numbers[UNITS]
    assert np.linalg.norm(np.ptp(narrow.units[: int(narrow.numbers[UNITS])], axis=0)) < 0.22


def test_units_are_active_by_their_distance_in_those_lengths() -> None:
    """As if units and posture were told in these lengths, and each were 1."""
    rng, extent = np.random.default_rng(0), np.array([0.1, 1.0, 0.4])
    units, x = rng.uniform(size=(300, 3)), rng.uniform(size=3)
    index, share = np.empty((2, NEAREST), np.int64), np.empty((2, NEAREST))
    one = active(units, extent, 300, x, index[0], share[0])
    other = active(units / extent, np.ones(3), 300, x / extent, index[1], share[1])
    assert one == other > 2
    np.testing.assert_array_equal(index[0, :one], index[1, :one])
    np.testing.assert_allclose(share[0, :one], share[1, :one], rtol=1e-9)
