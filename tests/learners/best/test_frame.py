"""A frame as a whole: where it looks is where the arm will be, and what must learn together for anything to fade."""

from __future__ import annotations

import numpy as np
import pytest
from tests.learners.best.test_learner import HEADS, lived
from tests.learners.best.world import HEAD, World, live, robot

from somatopy.learners import BestLearner
from somatopy.learners.best.frame import PARTS
from somatopy.learners.best.memory import CALM, FORGOTTEN, LASTING, SURPRISE, UNITS, fresh
from somatopy.percept import Space


@pytest.mark.parametrize("head", HEADS.values(), ids=HEADS)
def test_it_looks_where_the_arm_will_be_in_the_next_frame(head: Space) -> None:
    """One step of the speed that it has learned towards the target, and no farther than the target."""
    learner, world = lived(head)
    learner.plastic = frozenset(PARTS) - {"memory"}  # without working memory gaze and prediction are one
    memory, command, ahead, differ = learner._memory, world.head, [], 0
    for _ in range(60):
        percept = world.percept(command)
        learner.observe(percept)
        command = learner.gaze(percept)
        most = np.maximum(memory.speed, 0.0) * memory.span
        way = np.clip(percept.arm_command - percept.arm, -most, most)
        np.testing.assert_allclose(command, learner.predict(percept.arm + way), atol=1e-9)
        differ += bool((learner.predict(percept.arm) != command).any())
        ahead.append(np.abs(way).max())
    assert 0.03 < max(ahead) < 0.06 and differ > 20  # the world's arm goes .05 rad a frame


def test_an_arm_that_seemed_to_go_backwards_is_not_looked_for_behind() -> None:
    """A speed below 0 counts as none."""
    learner, world = lived(HEAD)
    learner.plastic = frozenset()
    learner._memory.speed[:] = -0.1
    percept = world.percept(world.head)
    learner.observe(percept)
    np.testing.assert_array_equal(learner.gaze(percept), learner.predict(percept.arm))


@pytest.mark.parametrize(("still", "fades"), [("directions", False), ("visibility", False), ("schema", True)])
def test_nothing_fades_that_cannot_be_learned_anew(still: str, fades: bool) -> None:
    """While directions or visibility do not learn."""
    learner, world = lived(HEAD)
    learner.plastic = frozenset(PARTS) - {still}
    learner._memory.numbers[[SURPRISE, LASTING]] = 1.0, 1.0
    learner.observe(world.percept(world.head))
    assert (learner._memory.numbers[FORGOTTEN] > 0.0) == fades


def test_before_anything_is_known_the_sheet_reaches_half_the_smallest_range() -> None:
    """Of the head's joints, along each axis."""
    for head, reach in zip(HEADS.values(), (1.75, 0.65, 0.35), strict=True):
        np.testing.assert_allclose(fresh(robot(2, head)).reach, reach)


@pytest.mark.parametrize("learns", [True, False])
def test_an_arm_that_moves_little_gets_a_finer_map_if_directions_learn(learns: bool) -> None:
    """The learner finds out by itself how far its arm moves."""
    learner, world = BestLearner(robot(), np.random.default_rng(0)), World(robot(), reach=0.1)
    learner.plastic = frozenset(PARTS) - (frozenset() if learns else {"directions"})
    live(learner, world, 2000)
    memory = learner._memory
    if learns:
        assert memory.extent.max() < 0.6
        assert memory.numbers[UNITS] > 1  # by the limits no two of its postures are as far apart as .22
    else:
        for name in ("middle", "apart", "extent"):
            np.testing.assert_array_equal(getattr(memory, name), getattr(fresh(robot()), name))


def test_only_directions_slow_down_while_all_is_calm() -> None:
    """From one hit B and b learn a fifth as much after very many calm hits; visibility learns as much as ever."""
    learner, world = lived(HEAD)
    state, percept = learner.state(), world.percept(world.head)
    while percept.sighting is None:
        percept = world.percept(learner.predict(world.arm))
    changes = []
    for calm in (0.0, 1e9):
        learner.restore(state)
        learner._memory.numbers[CALM] = calm
        before = learner.state()["memory"]
        learner.observe(percept)
        after = learner.state()["memory"]
        changes.append({name: after[name] - before[name] for name in ("plane", "turns", "fields", "sheet", "common")})
    fast, slow = changes
    for name, share in (("plane", 0.2), ("turns", 0.2), ("fields", 1.0), ("sheet", 1.0), ("common", 1.0)):
        assert fast[name].any()
        np.testing.assert_allclose(slow[name], share * fast[name], rtol=1e-6, atol=1e-15, err_msg=name)
