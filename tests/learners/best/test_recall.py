"""What was known before a surprise is kept, and comes back once it explains again what is seen."""

from __future__ import annotations

from copy import copy, deepcopy
from dataclasses import replace

import numpy as np
import pytest
from tests.learners.best.world import World, live, robot

from somatopy.learners import BestLearner
from somatopy.learners.best.memory import (
    FORGOTTEN,
    KEPT,
    KEPT_ERROR,
    KEPT_UNITS,
    KNOWN_ERROR,
    LASTING,
    MOST_UNITS,
    SURPRISE,
    TRIED,
    UNITS,
    Memory,
    fresh,
    packed,
)
from somatopy.learners.best.recall import TRIED_LEAST, recall
from somatopy.percept import Floats, Percept

#: What all postures share: as it was in calm, it is kept.
SHARED = "shift", "plane", "common", "sway", "gain"
#: A felt posture, a head posture, and where in the picture the hand is seen.
POSTURE, HEAD, PIXEL = np.full(4, 0.5), np.zeros(2), np.array([0.3, -0.2])
HIT = POSTURE, HEAD, PIXEL


def knowing(seed: int, units: int = 40) -> Memory:
    """A memory full of things, of which some units have forgotten a third, as they are after a calm hit."""
    memory, rng = fresh(robot(4)), np.random.default_rng(seed)
    for name in ("units", "turns", "fields"):
        getattr(memory, name)[:units] = rng.normal(size=getattr(memory, name)[:units].shape)
    for name in (*SHARED, "metric"):
        getattr(memory, name)[:] = rng.normal(size=getattr(memory, name).shape)
    memory.plane[:] = 0.0  # so that units alone say where the hand is expected
    assert not recall(memory, *HIT, np.zeros(2))
    memory.used[:units] = rng.integers(1, 1000, units)
    memory.faded[:units] = rng.choice([0.4, 0.0], units)
    memory.numbers[[UNITS, FORGOTTEN]] = units, 0.4
    return memory


def said(memory: Memory) -> dict[str, Floats]:
    """What is known, as the map says it."""
    count = int(memory.numbers[UNITS])
    voice = np.exp(memory.faded[:count] - memory.numbers[FORGOTTEN])[:, None]
    own = {"units": memory.units[:count].copy(), "used": memory.used[:count].astype(float)}
    own |= {"turns": voice * memory.turns[:count], "fields": voice * memory.fields[:count]}
    return own | {name: getattr(memory, name).copy() for name in (*SHARED, "metric")}


def keep(memory: Memory) -> None:
    """Let a surprise last until what is known is kept."""
    memory.numbers[[SURPRISE, LASTING]] = 1.0, 0.21
    assert not recall(memory, *HIT, np.zeros(2))
    assert memory.numbers[KEPT] == 1.0


def exchange(memory: Memory) -> int:
    """Let all go wrong, although what is kept knows better; after so many hits it is known again."""
    memory.numbers[[SURPRISE, LASTING]] = 1.0, 0.15
    for hits in range(1, 100):
        if recall(memory, POSTURE, head_of_kept(memory), PIXEL, np.array([0.5, 0.5])):
            return hits
    raise AssertionError("What is kept never came back.")


def head_of_kept(memory: Memory) -> Floats:
    """The head posture at which what is kept expects the hand at this pixel: a second way to it, by its units alone."""
    first = MOST_UNITS - int(memory.numbers[KEPT_UNITS])
    square = (((memory.units[first:] - POSTURE - memory.kept[:4]) / memory.extent) ** 2).sum(axis=1)
    near = np.argsort(square)[:16]
    near = near[square[near] <= square.min() + 6 * 0.15**2]
    share = np.exp(-(square[near] - square.min()) / (2 * 0.15**2))
    gain = memory.kept[memory.calm.size - 4 : memory.calm.size].reshape(2, 2)
    return np.asarray(share @ memory.turns[first:][near] / share.sum() - gain @ PIXEL)


@pytest.mark.parametrize("units", [(40, 40), (40, 60), (60, 40), (500, 500)])
def test_what_was_known_comes_back_whole_and_so_does_what_it_took_the_place_of(units: tuple[int, int]) -> None:
    """Whichever of the two has more units, and whatever of them has been forgotten.

    What all postures share is as it was in calm, whatever the surprise has made of it.
    """
    memory, later = knowing(0, units[0]), knowing(1, units[1])
    first, second = said(memory), said(later)
    disturb(memory)
    keep(memory)
    for name in ("units", "turns", "fields", "used", "faded"):
        getattr(memory, name)[: units[1]] = getattr(later, name)[: units[1]]
    for name in (*SHARED, "metric"):
        getattr(memory, name)[:] = getattr(later, name)
    memory.numbers[[UNITS, SURPRISE, LASTING]] = units[1], 0.0, 0.0
    assert not recall(memory, *HIT, np.zeros(2))
    for expected in (first, second, first):
        disturb(memory)
        assert exchange(memory) == TRIED_LEAST
        for name, array in said(memory).items():
            np.testing.assert_allclose(array, expected[name], rtol=1e-12, err_msg=name)
        assert memory.numbers[SURPRISE] == memory.numbers[LASTING] == 0.0


def disturb(memory: Memory) -> None:
    """What the first hits of a surprise do to what all postures share."""
    for name in SHARED:
        getattr(memory, name)[:] += 0.1


def test_what_is_kept_must_be_twice_as_good() -> None:
    """For 500 hits of errors that are just less than twice as large nothing comes back; of larger ones, it does."""
    for known, comes in ((0.39, False), (0.41, True)):
        memory = knowing(0)
        keep(memory)
        head = head_of_kept(memory) + np.array([0.2, 0.0])
        came = [recall(memory, POSTURE, head, PIXEL, np.array([0.0, known])) for _ in range(500)]
        assert any(came) == comes


def test_a_surprise_keeps_what_was_known_once() -> None:
    """Not what was half forgotten later in it. The next surprise keeps anew."""
    memory = knowing(0)
    keep(memory)
    kept = memory.kept.copy()
    memory.plane[:] += 1.0
    memory.numbers[[SURPRISE, LASTING]] = 0.0, 0.9
    recall(memory, *HIT, np.zeros(2))
    memory.numbers[SURPRISE] = 0.9
    recall(memory, *HIT, np.zeros(2))
    np.testing.assert_array_equal(memory.kept, kept)
    memory.numbers[[SURPRISE, LASTING]] = 0.0, 0.05
    recall(memory, *HIT, np.zeros(2))
    keep(memory)
    np.testing.assert_array_equal(memory.kept[4:34], kept[4:34] + 1.0)


def test_calm_changes_nothing_that_is_known() -> None:
    """It is only remembered how what all postures share is then."""
    memory = knowing(0)
    disturb(memory)
    before = memory._replace(**{name: array.copy() for name, array in memory._asdict().items()})
    assert not recall(memory, *HIT, np.ones(2))
    before.calm[:] = np.concatenate([getattr(memory, name).ravel() for name in SHARED])
    for old, now in zip(packed(before), packed(memory), strict=True):
        np.testing.assert_array_equal(old, now)


def test_a_map_that_is_more_than_half_full_keeps_nothing() -> None:
    """501 of its 1,000 units leave no room for a copy."""
    memory = knowing(0, MOST_UNITS // 2 + 1)
    units = memory.units.copy()
    keep(memory)
    assert memory.numbers[KEPT_UNITS] == 0.0
    np.testing.assert_array_equal(memory.units, units)


class Rewired(World):
    """A world in which the senses of the arm's joints may be reversed in order and sign."""

    reversed = False

    def percept(self, command: Floats) -> Percept:
        percept = super().percept(command)
        if not self.reversed:
            return percept
        middle = self.robot.arm.limits.sum(axis=1)
        return replace(
            percept, arm=(middle - percept.arm)[::-1].copy(), arm_command=(middle - percept.arm_command)[::-1].copy()
        )


def errors(learner: BestLearner, world: Rewired, frames: int) -> Floats:
    """The direction's errors of the frames with a hit, rad."""
    command, found = world.head, []
    for _ in range(frames):
        percept = world.percept(command)
        learner.observe(percept)
        command = learner.gaze(percept)
        found.append(learner.probes()["direction_error"])
    return np.array(found)[np.isfinite(found)]


def test_joints_that_are_put_right_are_known_again_at_once() -> None:
    """Errors are as small as ever soon after the thirtieth hit; a learner that keeps nothing has larger ones for long.

    Their means are over the hits 80 to 400. The learner has lived with wrong senses for nine minutes before.
    """
    learner, world = BestLearner(robot(), np.random.default_rng(0)), Rewired(robot())
    world.mix *= 2
    calm = errors(learner, world, 20_000)[-1000:].mean()
    world.reversed = True
    wrong = errors(learner, world, 8000)
    assert wrong[:100].mean() > 10 * calm and wrong[-1000:].mean() < 3 * calm  # it was a surprise, and learned
    world.reversed = False
    other, same = BestLearner(robot(), np.random.default_rng(0)), copy(world)
    other.restore(learner.state())
    same.rng = deepcopy(world.rng)
    other._memory.numbers[KEPT_UNITS] = 0.0
    assert errors(learner, world, 400)[80:].mean() < 2 * calm
    assert errors(other, same, 400)[80:].mean() > 5 * calm


@pytest.mark.parametrize("frozen", sorted(BestLearner.parts))
def test_a_frozen_part_keeps_all_from_coming_back(frozen: str) -> None:
    """What is kept stays where it is, however bad what is known has become."""
    learner, world = BestLearner(robot(), np.random.default_rng(0)), World(robot())
    live(learner, world, 2000)
    keep(learner._memory)
    learner.plastic = learner.parts - {frozen}
    kept = learner._memory.kept.copy()
    for _ in range(100):
        learner._memory.numbers[[SURPRISE, KEPT_ERROR, KNOWN_ERROR, TRIED]] = 1.0, 0.0, 1.0, 50
        live(learner, world, 1)
    np.testing.assert_array_equal(learner._memory.kept, kept)
