"""Set-points stay inside every limit on the whole way, and arrive; joints are held inside."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from somatopy.bodies.limits import CLEARANCE, advance_setpoints, clip_targets, hold_inside
from somatopy.percept import Floats

LOWER, UPPER = np.array([-1.2, -2.0, -1.5]), np.array([1.2, 2.0, 1.5])
FREE, BY, LIMITED = 0, 1, 2
TINY = 1e-12


class Table(NamedTuple):
    """Limits of joint LIMITED by the angle of joint BY."""

    at: Floats
    low: Floats
    high: Floats

    @property
    def arguments(self) -> tuple[int, int, Floats, Floats, Floats]:
        return LIMITED, BY, self.at, self.low, self.high

    @property
    def slope(self) -> float:
        return float(max(np.abs(np.diff(v) / np.diff(self.at)).max() for v in (self.low, self.high)))

    def excess(self, by: Any, limited: Any) -> float:
        """How far the pair leaves the limits; negative inside."""
        low, high = np.interp(by, self.at, self.low), np.interp(by, self.at, self.high)
        return float(np.max(np.maximum(low - limited, limited - high)))


@st.composite
def tables(draw: st.DrawFn) -> Table:
    """Tables of any shape that leave one angle free throughout."""
    gaps = draw(st.lists(st.floats(0.05, 1.5), min_size=1, max_size=5))
    at = draw(st.floats(-2.5, 0.5)) + np.concatenate([[0.0], np.cumsum(gaps)])
    middle = draw(st.floats(-0.5, 0.5))
    rooms = st.lists(st.floats(1.5 * CLEARANCE, 0.9), min_size=at.size, max_size=at.size)
    return Table(at, middle - np.array(draw(rooms)), middle + np.array(draw(rooms)))


angles = st.one_of(st.floats(-3, 3), st.sampled_from([-1e9, 1e9, 0.0]))
targets = st.lists(st.tuples(angles, angles, angles), min_size=1, max_size=25)
strides = st.tuples(st.floats(0.01, 0.6), st.floats(0.01, 0.6), st.floats(0.01, 0.6)).map(np.array)


def clipped(target: Any, table: Table) -> Floats:
    legal = np.array(target, float)
    clip_targets(legal, LOWER, UPPER, *table.arguments)
    return legal


def advanced(setpoint: Floats, sensed: Floats, target: Any, stride: Floats, table: Table) -> Floats:
    moved = setpoint.copy()
    advance_setpoints(moved, sensed, clipped(target, table), stride, *table.arguments)
    return moved


@given(angles, angles, angles, tables())
def test_clipped_targets_obey_all_limits(free: float, by: float, limited: float, table: Table) -> None:
    """Position limits and coupled limits hold, and what is legal stays as it is."""
    once = clipped([free, by, limited], table)
    assert (once >= LOWER).all() and (once <= UPPER).all()
    assert table.excess(once[BY], once[LIMITED]) <= TINY
    assert (clipped(once, table) == once).all()


@given(tables(), targets, strides, st.tuples(st.integers(0, 1), st.integers(0, 1), st.integers(0, 1)))
def test_no_command_leads_out_of_the_limits_on_the_way(
    table: Table, commands: Any, stride: Floats, delay: tuple[int, int, int]
) -> None:
    """Both joints ramp at once, and each may lag by a frame: every combination in between is legal."""
    path = [clipped([0, 0, 0], table)] * 3
    blend = np.linspace(0, 1, 9)
    for command in commands:
        sensed = np.array([path[-1 - lag][k] for k, lag in enumerate(delay)])
        before, after = path[-1], advanced(path[-1], sensed, command, stride, table)
        assert (np.abs(after - before) <= stride + TINY).all()
        assert (after >= LOWER - TINY).all() and (after <= UPPER + TINY).all()
        ramp = before + blend[:, None] * (after - before)
        assert table.excess(ramp[:, BY], ramp[:, LIMITED]) <= TINY
        path.append(after)
        real = np.array([path[-1 - lag][k] for k, lag in enumerate(delay)])
        ramp = sensed + blend[:, None] * (real - sensed)
        # A joint that is less than CLEARANCE off counts as arrived.
        assert table.excess(ramp[:, BY], ramp[:, LIMITED]) <= CLEARANCE


@given(tables(), targets, st.tuples(angles, angles, angles), strides, st.booleans(), st.sampled_from([-1e-3, 0, 1e-3]))
def test_every_legal_target_is_reached(
    table: Table, commands: Any, last: Any, stride: Floats, lags: bool, error: float
) -> None:
    """From wherever commands have led, in the time of a few travels, also where posture lags or is 1 mrad off."""
    path = [clipped([0, 0, 0], table)] * 2
    travel = int(np.ceil(((UPPER - LOWER) / stride).max()))
    for command in [*commands, *[last] * (4 * travel + 10)]:
        path.append(advanced(path[-1], path[-2 if lags else -1] + error, command, stride, table))
    off = np.abs(path[-1] - clipped(last, table))
    assert off[FREE] <= TINY and off[BY] <= TINY
    assert off[LIMITED] <= CLEARANCE + table.slope * abs(error) + TINY


def test_free_joints_move_at_constant_speed_and_stop_at_the_target() -> None:
    """Without coupling a set-point is a ramp: start + stride * frames, clipped to the target."""
    setpoint, target, stride = np.array([0.0, 1.0]), np.array([1.0, -1.0]), np.array([0.3, 0.25])
    none = np.zeros(1)
    for frame in range(1, 12):
        advance_setpoints(setpoint, setpoint, target, stride, -1, -1, none, none, none)
        np.testing.assert_allclose(setpoint, [min(0.3 * frame, 1.0), max(1 - 0.25 * frame, -1.0)], atol=1e-12)


def test_a_joint_that_stands_in_the_way_yields_first() -> None:
    """The narrow part of the table is entered only when the other joint has left what it forbids."""
    table = Table(np.array([-1.0, 0.0, 1.0]), np.array([-1.0, -0.1, -1.0]), np.array([1.0, 0.1, 1.0]))
    setpoint, stride, seen = np.array([0.0, -1.0, 0.9]), np.full(3, 0.2), []
    for _ in range(40):
        setpoint = advanced(setpoint, setpoint, [0, 1.0, 0.9], stride, table)
        seen.append(setpoint)
    assert min(s[LIMITED] for s in seen) <= 0.1
    np.testing.assert_allclose(seen[-1], [0, 1.0, 0.9], atol=CLEARANCE)


places = st.floats(-3, 3)
speeds = st.floats(-50, 50)


@given(st.tuples(places, places), st.tuples(speeds, speeds), st.tuples(places, places), st.floats(1e-4, 1e-2))
def test_held_joints_are_inside_and_never_gain(position: Any, speed: Any, edges: Any, duration: float) -> None:
    """Position and velocity end inside their limits, no speed grows or turns, and other joints stay as they are."""
    low, high = min(edges), max(edges)
    assume(low < high)
    qpos, qvel = np.array([7.0, *position]), np.array([*speed, 7.0])
    limit = np.array([8.0, 3.0])
    where, dofs = np.array([2, 1]), np.array([1, 0])
    lower, upper = np.full(2, low), np.full(2, high)
    hold_inside(qpos, qvel, where, dofs, lower, upper, limit, duration)
    assert (qpos[where] >= low).all() and (qpos[where] <= high).all()
    assert (np.abs(qvel[dofs]) <= limit).all()
    assert qpos[0] == 7.0 and qvel[2] == 7.0
    assert (np.abs(qvel[:2]) <= np.abs(speed)).all() and (qvel[:2] * speed >= 0).all()


def test_a_stop_takes_the_velocity_into_it_and_no_other() -> None:
    """A joint beyond an end stands still there if it was moving on, and keeps its velocity if it was coming back."""
    qpos, qvel, four = np.array([-1.1, -1.1, 1.1, 1.1]), np.array([-0.5, 0.5, 0.5, -0.5]), np.arange(4)
    hold_inside(qpos, qvel, four, four, -np.ones(4), np.ones(4), np.full(4, 8.0), 0.01)
    assert qpos.tolist() == [-1, -1, 1, 1] and qvel.tolist() == [0, 0.5, 0, -0.5]


def test_held_joints_inside_their_limits_are_left_alone() -> None:
    """To the last bit: free motion is MuJoCo's own."""
    qpos, qvel = np.array([0.1, -0.2]), np.array([1.3, -0.7])
    both = np.arange(2)
    hold_inside(qpos, qvel, both, both, -np.ones(2), np.ones(2), np.full(2, 1.3), 0.01)
    assert qpos.tolist() == [0.1, -0.2] and qvel.tolist() == [1.3, -0.7]


def test_a_joint_thrown_too_fast_moves_as_far_as_its_limit_allows() -> None:
    """A step's displacement is the limited velocity times its length."""
    qpos, qvel, duration = np.array([0.5]), np.array([20.0]), 0.01
    start = qpos[0] - duration * qvel[0]
    one = np.zeros(1, int)
    hold_inside(qpos, qvel, one, one, np.array([-2.0]), np.array([2.0]), np.array([8.0]), duration)
    assert qpos[0] - start == pytest.approx(8.0 * duration)
