"""What the learner promises beyond the laws of learners: it is small and local, and fits any robot."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import numpy as np
import pytest
from tests.learners.best.world import HEAD, World, live, robot

from somatopy.contract import size
from somatopy.learners import BestLearner
from somatopy.learners.best.calibration import learn_gain
from somatopy.learners.best.directions import NEAREST, active, direction, dual_of, learn_direction, powers
from somatopy.learners.best.memory import (
    LASTING,
    METRIC_MOST,
    MOST_UNITS,
    SURPRISE,
    TURNS,
    Memory,
    fresh,
    opened,
    packed,
    spacing,
)
from somatopy.learners.best.visibility import corners, evidence, fit_sheet
from somatopy.percept import Floats, Space


def test_it_is_at_most_150_kb() -> None:
    """For four arm joints and two head joints, whatever it has seen."""
    learner = BestLearner(robot(), np.random.default_rng(0))
    live(learner, World(robot()), 600)
    assert size(learner.state()) <= 150_000


#: What the units hold, a row each; what all share and a frame may change; what stays as it was made.
OWN = {"units", "turns", "fields", "faded", "used"}
SHARED = {"numbers", "shift", "home", "speed", "felt", "head", "pixel", "bias", "stride", "gain", "drift", "plane"}
SHARED |= {"middle", "apart", "extent", "sway", "doubt", "metric", "common", "sheet", "recent", "asked", "ends"}
SHARED |= {"calm", "kept"}
FITTED = {"reach", "scale"}  # with the pixel gain, and the sheet and all fields with them
MADE = {"shape", "limits", "low", "span"}


@pytest.mark.parametrize("surprise", [0.0, 0.9])
def test_a_frame_changes_active_units_and_shared_parts_alone(surprise: float) -> None:
    """Units whose share a is 0 keep all that they hold, to the last bit, and of the sheet at most four cells learn.

    That holds while a surprise lasts and everything fades, too. In one frame of a surprise all units are copied to the
    end of the map.
    """
    learner, world = BestLearner(robot(), np.random.default_rng(0)), World(robot())
    live(learner, world, 1500)
    command, moved, fitted, copied = world.head, 0, 0, 0
    for _ in range(200):
        percept = world.percept(command)
        if surprise:
            learner._memory.numbers[[SURPRISE, LASTING]] = surprise, surprise
        before = learner.state()["memory"]
        learner.observe(percept)
        command, after = learner.gaze(percept), learner.state()["memory"]
        assert set(after) == OWN | SHARED | FITTED | MADE
        changed = {name for name in after if not np.array_equal(before[name], after[name], equal_nan=True)}
        assert not changed & MADE
        if changed & FITTED:
            fitted += 1
            continue
        index, share = np.empty(NEAREST, np.int64), np.empty(NEAREST)
        found = active(after["units"], before["extent"], int(after["numbers"][0]), after["felt"][0], index, share)
        for name in OWN:
            rows = np.flatnonzero((before[name] != after[name]).reshape(len(after[name]), -1).any(axis=1))
            own, kept = rows[rows < MOST_UNITS // 2].tolist(), rows[rows >= MOST_UNITS // 2]
            moved += len(own)
            copied += name == "units" and kept.size > 0
            assert set(own) <= set(index[:found].tolist())
        known = int(before["numbers"][0])
        np.testing.assert_array_equal(before["units"][:known], after["units"][:known])
        assert (before["sheet"] != after["sheet"]).sum() <= 4
    assert moved > 1000 and fitted <= 1 and copied == (surprise > 0)


def test_a_copy_lives_its_own_life() -> None:
    """It goes on as the one that it was copied from would have, and leaves that one as it is."""
    learner, world = BestLearner(robot(), np.random.default_rng(0)), World(robot())
    live(learner, world, 300)
    learner.restore(learner.state())  # so that it holds no percept, which nothing copies
    before, copy = learner.state()["memory"], deepcopy(learner)
    percepts = [world.percept(world.head) for _ in range(50)]
    own = [(copy.observe(percept), copy.gaze(percept))[1] for percept in percepts]
    for name, array in learner.state()["memory"].items():
        np.testing.assert_array_equal(array, before[name])
    expected = [(learner.observe(percept), learner.gaze(percept))[1] for percept in percepts]
    np.testing.assert_array_equal(own, expected)


@pytest.mark.parametrize("joints", [1, 3])
def test_a_memory_is_packed_without_loss(joints: int) -> None:
    """All values come back by their names, and in the same shapes."""
    memory = fresh(robot(5, Space([f"head{k}" for k in range(joints)], np.full(joints, -1.0), np.full(joints, 0.9))))
    filled = memory._replace(
        **{
            name: np.arange(array.size, dtype=float).reshape(array.shape) + 1000 * k
            for k, (name, array) in enumerate(memory._asdict().items())
            if array.dtype == float
        }
    )
    for name, array in opened(*packed(filled))._asdict().items():
        np.testing.assert_array_equal(array, getattr(filled, name), err_msg=name)


@pytest.mark.parametrize("joints", range(1, 9))
def test_a_map_of_one_to_eight_joints_stays_below_its_room(joints: int) -> None:
    """Filled by 12,000 postures all over the range, by the rule of the learner: one of its own where none is near."""
    rng, units = np.random.default_rng(0), np.empty((0, joints))
    for x in rng.uniform(size=(12_000, joints)):
        if not len(units) or ((units - x) ** 2).sum(axis=1).min() > spacing(joints) ** 2:
            units = np.vstack([units, x])
    assert 10 < len(units) < MOST_UNITS
    assert spacing(4) == pytest.approx(0.22)


@pytest.mark.parametrize(
    ("arm", "head", "size"),
    [
        (1, Space(("pan",), [-2.0], [2.0]), (320, 240)),
        (4, HEAD, (640, 480)),
        (8, Space(("yaw", "pitch", "roll"), [-2, -0.7, -0.3], [2, 0.6, 0.3]), (240, 320)),
    ],
)
def test_it_learns_where_to_look_on_any_robot(arm: int, head: Space, size: tuple[int, int]) -> None:
    """In four minutes it sees a smooth hand twice as often as random gazes, and in three of four frames at least."""
    body = robot(arm, head, *size)
    world = World(body)
    hits = live(BestLearner(body, np.random.default_rng(0)), world, 3600)
    rng, blind = np.random.default_rng(1), World(body)
    chance = np.mean([blind.percept(rng.uniform(*head.limits.T)).sighting is not None for _ in range(3600)])
    assert hits[-900:].mean() > max(0.75, min(2 * chance, 0.95))


def test_frozen_it_still_acts_and_predicts_without_working_memory() -> None:
    """With nothing plastic, predictions stay, and what was just seen does not count."""
    learner, world = BestLearner(robot(), np.random.default_rng(0)), World(robot())
    live(learner, world, 1500)
    learner.plastic = frozenset()
    arm = world.arm
    before: dict[str, Any] = learner.state()["memory"]
    expected = learner.predict(arm)
    hits = live(learner, world, 900)
    np.testing.assert_array_equal(learner.predict(arm), expected)
    for name in (
        *("plane", "metric", "turns", "fields", "common", "sheet", "shift", "bias"),
        *("gain", "sway", "doubt", "middle", "apart", "extent"),
    ):
        np.testing.assert_array_equal(learner.state()["memory"][name], before[name])
    assert hits.mean() > 0.5


@pytest.mark.parametrize("head", [Space(("pan",), [-2.0], [2.0]), HEAD])
def test_a_sheet_that_is_fitted_anew_says_the_same(head: Space) -> None:
    """On offsets that both sheets hold: exactly what units say, and the sheet itself but for its coarser cells."""
    memory = fresh(robot(2, head))
    rng, m = np.random.default_rng(0), len(head)
    memory.numbers[0] = 1
    memory.fields[0], memory.common[:] = rng.normal(size=memory.fields.shape[1]), rng.normal(size=memory.common.shape)
    phi, index, share = rng.uniform(size=len(memory.common)), np.array([0]), np.array([1.0])
    axes = [np.linspace(-1, 1, n) for n in memory.shape]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, m)
    memory.sheet[:] = (grid * memory.reach) @ rng.normal(size=m)  # linear, which interpolation keeps
    memory.gain[:] = 0.8 * memory.reach[0] / 1.4 * np.eye(m, 2)
    before, old = evidence(memory, False, phi, index, share, 1), memory.reach.copy()
    fit_sheet(memory, 1.0)
    after = evidence(memory, False, phi, index, share, 1)
    assert (memory.reach < old).all()
    place, weight = np.empty(8, np.int64), np.empty(8)
    wide = memory._replace(reach=old)
    for cell, offset in enumerate(grid * memory.reach):
        count = corners(wide, offset, np.zeros(m), place, weight)
        assert after[cell] == pytest.approx(before[place[:count]] @ weight[:count], abs=0.05)


# -- belief ------------------------------------------------------------------------------------------------------------


def lived(head: Space, frames: int = 400) -> tuple[BestLearner, World]:
    """A learner after some frames with a hand that is often seen."""
    world = World(robot(3, head))
    learner, command = BestLearner(world.robot, np.random.default_rng(1)), head.limits.mean(axis=1)
    for _ in range(frames):
        percept = world.percept(command)
        learner.observe(percept)
        command = learner.gaze(percept)
    assert learner._memory.numbers[2] > frames / 10
    return learner, world


HEADS = {
    "one": Space(("yaw",), [-1.5], [2.0]),
    "two": HEAD,
    "three": Space(("yaw", "pitch", "roll"), [-2.0, -0.7, -0.3], [2.0, 0.6, 0.4]),
}


@pytest.mark.parametrize("name", HEADS)
def test_no_gaze_is_believed_more_than_the_one_that_it_predicts(name: str) -> None:
    """Of all within the limits of a head whose joints do not limit each other: that is how the gaze is chosen."""
    head = HEADS[name]
    learner, world = lived(head)
    rng = np.random.default_rng(2)
    arms, gazes = (rng.uniform(*space.limits.T, (n, len(space))) for space, n in ((world.robot.arm, 20), (head, 2000)))
    chosen = [learner.belief([arm], [learner.predict(arm)])[0, 0] for arm in arms]
    believed = learner.belief(arms, gazes)
    assert (believed.max(axis=1) <= np.array(chosen) + 1e-9).all()
    assert believed.max() > 0.5 > believed.min()


def test_belief_is_the_chance_by_the_sheet_and_the_fields() -> None:
    """sigma(f + (F' phi + sum a w) . psi) at the cells of the sheet, written out; beyond it nothing is believed."""
    learner, world = lived(HEAD)
    memory, arm = learner._memory, world.rng.uniform(*world.robot.arm.limits.T)
    memory.extent[:] = 0.4, 0.7, 1.0
    x = (arm - memory.low) / memory.span + memory.shift
    count = int(memory.numbers[0])
    squares = np.sum(((memory.units[:count] - x) / memory.extent) ** 2, axis=1)
    nearest = np.argsort(squares)[:NEAREST]
    width = spacing(3) * 0.15 / 0.22
    nearest = nearest[squares[nearest] <= squares.min() + 6 * width**2]
    shares = np.exp(-(squares[nearest] - squares.min()) / (2 * width**2))
    shares /= shares.sum()
    t = 2 * x - 1
    phi = np.concatenate([[1.0], t, [t[i] * t[j] for i in range(3) for j in range(i, 3)]])
    centre = memory.plane @ phi + shares @ memory.turns[nearest] + memory.drift
    own = phi @ memory.common + shares @ memory.fields[nearest]
    assert np.abs(phi @ memory.common).max() > 0.1
    for row, column in ((0, 0), (15, 15), (30, 7), (12, 19)):
        offset = (2 * np.array([row, column]) / 30 - 1) * memory.reach
        u = offset / memory.scale
        z = memory.sheet[31 * row + column] + own @ [1, *u, *(u * u - 0.4), u[0] * u[1]]
        found = learner.belief([arm], [centre + offset - memory.bias])[0, 0]
        assert found == pytest.approx(1 / (1 + np.exp(-z)), abs=1e-6)
    assert learner.belief([arm], [centre + 1.01 * memory.reach])[0, 0] == 0.0


def test_before_the_first_hit_nothing_is_believed() -> None:
    """As nothing is known of where the hand is."""
    learner = BestLearner(robot(), np.random.default_rng(0))
    assert not learner.belief(np.zeros((2, 4)), [[0.0, 0.0], [1.0, 0.5]]).any()


# -- a fast start ------------------------------------------------------------------------------------------------------


def test_the_metric_is_the_inverse_of_what_monomials_have_in_common() -> None:
    """Of their outer products, summed with forgetting: by inverting the sum, beside the recursion."""
    memory, rng = fresh(robot(2)), np.random.default_rng(0)
    phi, dual = np.empty(6), np.empty(6)
    index, share, common = np.array([0]), np.array([1.0]), np.eye(6) / METRIC_MOST
    for _ in range(2000):
        powers(rng.uniform(size=2), phi)
        kept = 0.9995 if np.trace(np.linalg.inv(common)) < 6 * METRIC_MOST else 1.0
        learn_direction(memory, np.zeros(2), 1.0, dual, dual_of(memory, phi, dual), index, share, 1)
        assert dual @ phi == pytest.approx(1.0)
        common = kept * common + np.outer(phi, phi)
    np.testing.assert_allclose(memory.metric, np.linalg.inv(common), rtol=1e-6, atol=1e-9)


def test_the_metric_stays_bounded_and_positive_while_the_arm_stands_still() -> None:
    """For twenty minutes: what is not moved is not forgotten without end, which would be e^9 times in all."""
    memory, phi, dual = fresh(robot(4)), np.empty(15), np.empty(15)
    powers(np.array([0.3, 0.5, 0.9, 0.1]), phi)
    for _ in range(18_000):
        length = dual_of(memory, phi, dual)
        learn_direction(memory, np.zeros(2), 1.0, dual, length, np.array([0]), np.array([1.0]), 1)
    own = np.linalg.eigvalsh(memory.metric)
    assert own.min() > 0 and own.sum() < 15.1 * METRIC_MOST


def error_of_a_polynomial(postures: Floats, alike: bool) -> float:
    """How far directions are off at the last 100 of the postures after the others, rad; the hand's are a polynomial."""
    memory, truth = fresh(robot(4)), np.random.default_rng(1).normal(size=(2, 15))
    phi, dual, expected, nobody = np.empty(15), np.empty(15), np.empty(2), np.zeros(1, np.int64)
    errors = np.empty((len(postures), 2))
    for error, x in zip(errors, postures, strict=True):
        powers(x, phi)
        direction(memory.plane, memory.turns, phi, nobody, np.zeros(1), 0, expected)
        error[:] = truth @ phi - expected
        learn_direction(memory, error, 1.0, dual, dual_of(memory, phi, dual), nobody, np.zeros(1), 0)
        if alike:
            memory.metric[:] = METRIC_MOST * np.eye(15)
    return float(np.abs(errors[-100:]).mean())


def test_directions_are_sooner_known_where_the_arm_moves_little() -> None:
    """In a tenth of the range, after 2,000 hits: less than half the error that monomials have that learn alike."""
    postures = 0.45 + 0.1 * np.random.default_rng(0).uniform(size=(2000, 4))
    assert error_of_a_polynomial(postures, False) < 0.5 * error_of_a_polynomial(postures, True)


def meet(memory: Memory, x: Floats, head: Floats, pixel: Floats) -> None:
    """The gain learns from a frame, and this becomes the last one."""
    learn_gain(memory, x, head, pixel)
    memory.felt[0], memory.head[:], memory.pixel[:] = x, head, pixel


@pytest.mark.parametrize(("share", "most"), [(0.5, 0.05), (0.25, 0.05), (0.25, 0.08)])
def test_the_pixel_gain_is_right_for_a_head_that_lags_behind_the_hand(share: float, most: float) -> None:
    """It goes a share of the way to the hand in each frame, or to a place beside it, while the arm moves the hand.

    A gain that learns from movements of head and image alone is off by .09 and .39 in the last two cases.
    """
    rng, truth = np.random.default_rng(0), np.array([[-0.6, 0.1], [0.0, 0.6]])
    memory, x, head = fresh(robot(4)), np.full(4, 0.5), np.zeros(2)
    speed, goal = np.zeros(4), np.zeros(2)
    for frame in range(3000):
        speed = 0.4 * rng.uniform(-most, most, 4) if frame % 20 == 0 else speed
        x = np.clip(x + speed, 0.0, 1.0)
        hand = np.array([2.5 * x[0] - x[3] ** 2, 2.5 * x[1] + x[2] * x[0]]) - 1.0
        goal = rng.uniform(-0.3, 0.3, 2) if frame % 45 == 0 else goal
        head = head + share * (hand + goal - head)
        meet(memory, x, head, np.linalg.solve(truth, hand - head))
    np.testing.assert_allclose(memory.gain, truth, atol=0.01)


def test_a_slow_head_soon_knows_its_pixel_gain() -> None:
    """One that moves at most .03 rad a frame knows it within a tenth after half a minute."""
    rng, truth = np.random.default_rng(0), np.array([[-0.6, 0.1], [0.0, 0.6]])
    memory, x, head = fresh(robot(4)), np.full(4, 0.5), np.zeros(2)
    speed, goal = np.zeros(4), np.zeros(2)
    for frame in range(450):
        speed = rng.uniform(-0.005, 0.005, 4) if frame % 20 == 0 else speed
        x = np.clip(x + speed, 0.0, 1.0)
        hand = np.array([2.0 * x[0] - np.sin(x[3]), 2.0 * x[1] + x[2] * x[0]]) - 1.0
        goal = rng.uniform(-0.2, 0.2, 2) if frame % 10 == 0 else goal
        head = head + np.clip(hand + goal - head, -0.03, 0.03)
        meet(memory, x, head, np.linalg.solve(truth, hand - head))
    np.testing.assert_allclose(memory.gain, truth, atol=0.06)


def test_the_pixel_gain_is_known_after_ten_movements() -> None:
    """Of a head that looks about a hand that stands still: within a hundredth, whatever the camera."""
    rng = np.random.default_rng(0)
    for truth in (np.array([[-0.6, 0.1], [0.0, 0.6]]), np.array([[0.3, 0.0], [0.05, -0.3]])):
        memory, hand, x = fresh(robot(4)), np.array([0.2, -0.1]), np.full(4, 0.5)
        for _ in range(11):
            head = hand + rng.uniform(-0.25, 0.25, size=2)
            meet(memory, x, head, np.linalg.solve(truth, hand - head))
        assert memory.numbers[TURNS] == 10
        np.testing.assert_allclose(memory.gain, truth, atol=0.01 * np.abs(truth).max())


def test_no_axis_of_the_sheet_is_narrower_than_half_the_widest() -> None:
    """Though the gain of a joint that has hardly turned is still near 0."""
    memory = fresh(robot(4))
    memory.gain[:] = [[-0.6, 0.0], [0.0, 0.01]]
    fit_sheet(memory, 0.75)
    np.testing.assert_allclose(memory.reach, [0.84, 0.42])
