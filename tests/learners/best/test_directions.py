"""The map of units once it is full."""

from __future__ import annotations

import numpy as np
import pytest
from tests.learners.best.world import robot

from somatopy.clock import FRAMES_PER_MINUTE
from somatopy.learners.best.directions import NEAREST, find_or_add
from somatopy.learners.best.memory import FORGOTTEN, FRAMES, MOST_UNITS, UNITS, Memory, fresh

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
