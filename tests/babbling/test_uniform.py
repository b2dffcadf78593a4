"""Motor babbling: uniform targets, movements that last as long as they travel, and no look at the robot."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import kstest

from somatopy.babbling import Babbler, UniformBabbler, check_bounds
from somatopy.percept import JointGroup

ARM = JointGroup(("shoulder", "elbow"), np.array([-2.0, -1.0]), np.array([2.0, 1.0]), np.array([8.0, 0.25]))
BOUNDS = np.array([[-1.5, 1.0], [-0.5, 0.75]])
SPEED = 0.5
START = np.array([0.25, -0.1])

Make = Callable[..., UniformBabbler]


@pytest.fixture
def make() -> Make:
    def babbler(seed: int = 0, bounds: object = BOUNDS, speed: float = SPEED) -> UniformBabbler:
        return UniformBabbler(ARM, bounds, speed, START, np.random.default_rng(seed))  # type: ignore[arg-type]

    return babbler


def movements(babbler: UniformBabbler, step: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Targets and the times at which they were first given, asking every `step` seconds."""
    targets, times, k = [babbler.command(0.0)], [0.0], 0
    while len(targets) < count:
        k += 1
        target = babbler.command(k * step)
        if (target != targets[-1]).any():
            targets.append(target)
            times.append(k * step)
    return np.array(targets), np.array(times)


def test_keeps_the_contract(make: Make) -> None:
    """It is a Babbler: command, state, restore."""
    assert isinstance(make(), Babbler)


def test_targets_are_uniform_in_the_range(make: Make) -> None:
    """Each joint's targets lie in its range and are uniform there, and joints are independent."""
    targets, _ = movements(make(), step=20.0, count=2000)
    assert (targets >= BOUNDS[:, 0]).all() and (targets <= BOUNDS[:, 1]).all()
    for k, (low, high) in enumerate(BOUNDS):
        assert kstest(targets[:, k], "uniform", (low, high - low)).pvalue > 1e-3
    assert abs(np.corrcoef(targets.T)[0, 1]) < 4 / np.sqrt(2000)


@given(seed=st.integers(0, 10**6), frame=st.sampled_from([1 / 15, 0.01, 0.5]))
def test_a_movement_lasts_as_long_as_its_longest_joint_travels(seed: int, frame: float) -> None:
    """The next target comes at the first question after max |change| / speed, a joint's own limit counting if lower."""
    babbler = UniformBabbler(ARM, BOUNDS, SPEED, START, np.random.default_rng(seed))
    targets, times = movements(babbler, frame, count=6)
    speeds = np.array([SPEED, 0.25])
    durations = (np.abs(np.diff(np.vstack([START, targets[:-1]]), axis=0)) / speeds).max(axis=1)
    waits = np.diff(times)
    assert (waits >= durations - 1e-6).all()
    assert (waits <= durations + frame + 1e-6).all()


def test_the_target_stays_while_the_movement_lasts(make: Make) -> None:
    """Asking often or seldom within a movement gives the same target and the same next one."""
    often, seldom = make(5), make(5)
    first = often.command(0.0)
    assert (first == seldom.command(0.0)).all()
    end = float((np.abs(first - START) / [SPEED, 0.25]).max())
    assert all((often.command(time) == first).all() for time in np.linspace(0, 0.99 * end, 50))
    assert (often.command(end) == seldom.command(end)).all()
    assert (often.command(end) != first).any()


def test_a_movement_begins_with_the_question_that_finds_the_last_one_ended(make: Make) -> None:
    """Asked late, the babbler gives the next movement its whole time from then on, as set-points start only then."""
    babbler, speeds = make(6), np.array([SPEED, 0.25])
    first = babbler.command(0.0)
    late = float((np.abs(first - START) / speeds).max()) + 0.4
    second = babbler.command(late)
    end = late + float((np.abs(second - first) / speeds).max())
    assert (babbler.command(end - 0.01) == second).all()
    assert (babbler.command(end + 0.01) != second).any()


def test_rounded_times_shorten_no_later_movement(make: Make) -> None:
    """A question half a rounding early is answered as if in time; the movement after it is not early for that."""
    babbler, speeds, early = make(6), np.array([SPEED, 0.25]), 0.9e-9
    targets, ends = [START, babbler.command(0.0)], [0.0]
    for _ in range(20):
        ends.append(ends[-1] + float((np.abs(targets[-1] - targets[-2]) / speeds).max()))
        assert (babbler.command(ends[-1] - 2 * early) == targets[-1]).all()
        targets.append(babbler.command(ends[-1] - early))
        assert (targets[-1] != targets[-2]).any()


def test_one_seed_one_stream_and_two_seeds_differ(make: Make) -> None:
    """The commands are a function of the seed and of the times asked."""
    times = np.arange(300) / 15
    a, b, c = ([babbler.command(t) for t in times] for babbler in (make(1), make(1), make(2)))
    assert np.array_equal(a, b)
    assert not np.array_equal(a, c)


def test_a_changed_answer_changes_nothing(make: Make) -> None:
    """What it returns belongs to the caller."""
    babbler = make()
    babbler.command(0.0)[:] = 99.0
    assert np.abs(babbler.command(0.0)).max() <= 2.0


def test_continues_bit_for_bit_from_a_state(make: Make) -> None:
    """state and restore, in mid-movement and into a babbler of another seed; the state is a copy."""
    original, other = make(3), make(4)
    for t in np.arange(100) / 15:
        original.command(t)
    state = original.state()
    future = [original.command(t) for t in np.arange(100, 400) / 15]
    other.restore(state)
    assert np.array_equal([other.command(t) for t in np.arange(100, 400) / 15], future)
    original.restore(state)
    assert np.array_equal([original.command(t) for t in np.arange(100, 400) / 15], future)


def test_a_range_of_one_point_is_held(make: Make) -> None:
    """A range without width is a posture: the babbler goes there and stays, at every time."""
    babbler = make(bounds=[[0.5, 0.5], [0.25, 0.25]])
    assert all((babbler.command(t) == [0.5, 0.25]).all() for t in np.arange(100) / 3)


@pytest.mark.parametrize("speed", [0.0, -1.0, np.nan, np.inf])
def test_a_speed_must_be_positive(make: Make, speed: float) -> None:
    """Zero, negative, infinite and NaN speeds are refused, with the value."""
    with pytest.raises(ValueError, match=r"speed must be a positive number of rad/s, not (0|-1|nan|inf|np)"):
        make(speed=speed)


@pytest.mark.parametrize(
    ("bounds", "message"),
    [
        ([[-1, 1]], r"\[low, high\] for each of shoulder, elbow; its shape is \(1, 2\)"),
        ([[-1, 1, 2], [0, 1, 2]], r"its shape is \(2, 3\)"),
        ([[-1, 1], [-0.5, 1.5]], r"\[-0.5, 1.5\] of elbow must lie inside its limits \[-1.0000, 1.0000\]"),
        ([[-3, 1], [-0.5, 0.5]], r"\[-3, 1\] of shoulder must lie inside its limits"),
        ([[1, -1], [-0.5, 0.5]], r"\[1, -1\] of shoulder must have its low end first"),
        ([[np.nan, 1], [-0.5, 0.5]], r"\[nan, 1\] of shoulder"),
    ],
)
def test_a_wrong_range_is_named(bounds: object, message: str) -> None:
    """Wrong shapes, ends outside the limits, swapped or NaN ends: the joint and its limits are in the message."""
    with pytest.raises(ValueError, match=message):
        check_bounds(bounds, ARM)  # type: ignore[arg-type]


def test_rounded_limits_are_taken_for_the_limits() -> None:
    """A range whose ends were rounded to four digits is cut to the limits instead of refused."""
    arm = JointGroup(("a",), np.array([-2.08567]), np.array([2.08567]), np.array([8.0]))
    assert check_bounds([[-2.0857, 2.0857]], arm).tolist() == [[-2.08567, 2.08567]]
