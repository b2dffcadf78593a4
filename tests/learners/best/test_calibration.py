"""What the learner finds out about head, eye and arm: the equations of docs/best.md, step 1, and when they apply."""

from __future__ import annotations

import numpy as np
import pytest
from tests.learners.best.world import robot

from somatopy.experiment import Session
from somatopy.experiment.changes import changed
from somatopy.experiment.presets import paper
from somatopy.learners.best.calibration import bin_of, learn_bias, learn_ends, learn_gain
from somatopy.learners.best.memory import FAST_SIGHT, FRAMES, SLOW_SIGHT, SURPRISE, TURNS, Memory, fresh
from somatopy.percept import Floats


def still(stride: float = 1.0) -> Memory:
    """A head at 0 that has been seen to go so far in a frame, and a hand in the middle of the picture."""
    memory = fresh(robot(4))
    for name in ("head", "pixel", "moved", "slip"):
        getattr(memory, name)[:] = 0.0
    memory.stride[:] = stride
    return memory


def biased(memory: Memory, head: float, command: float) -> float:
    """How far the yaw's bias moves when it is sensed there after a command."""
    before = memory.bias[0]
    learn_bias(memory, np.array([head, 0.0]), np.array([command, 0.0]))
    return float(memory.bias[0] - before)


def test_the_bias_goes_a_twentieth_of_the_way() -> None:
    """beta += .05 (y - command - beta)."""
    memory = still()
    memory.bias[0] = 0.02
    assert biased(memory, 0.25, 0.15) == pytest.approx(0.05 * (0.25 - 0.15 - 0.02))


@pytest.mark.parametrize(("apart", "learns"), [(0.29, True), (-0.29, True), (0.31, False), (-0.31, False)])
def test_a_head_that_is_far_from_its_command_is_no_bias(apart: float, learns: bool) -> None:
    """From .3 rad on something else has moved it."""
    assert (biased(still(), 0.4 + apart, 0.4) != 0.0) == learns


@pytest.mark.parametrize("bias", [0.0, 0.2, -0.2])
@pytest.mark.parametrize(("way", "learns"), [(0.39, True), (-0.39, True), (0.41, False), (-0.41, False)])
def test_a_move_that_the_head_cannot_finish_is_no_bias(bias: float, way: float, learns: bool) -> None:
    """It must be at most .8 of the longest way of a frame, .5 here, to where the command will bring the head."""
    memory = still(0.5)
    memory.bias[0] = bias
    assert (biased(memory, way + 0.01, way - bias) != 0.0) == learns


def test_ends_are_remembered_where_the_body_cut() -> None:
    """At this command of the joint before: the upper end if less came than was asked, the lower end if more did."""
    memory = still()
    memory.asked[:] = 0.3, 0.5
    learn_ends(memory, np.array([0.32, 0.3]))
    learn_ends(memory, np.array([-0.68, 0.6]))
    known = np.argwhere(np.isfinite(memory.ends)).tolist()
    assert known == [[1, 0, 13], [1, 1, 23]]  # bins of .1 rad from the yaw's lower limit, -2
    assert (memory.ends[1, 1, 23], memory.ends[1, 0, 13]) == (0.3, 0.6)


def test_rounding_is_no_end() -> None:
    """What comes back as it was asked, to a ten-thousandth, tells nothing."""
    memory = still()
    memory.asked[:] = 0.3, 0.5
    for cut in (0.5, 0.50009, 0.49991):
        learn_ends(memory, np.array([0.3, cut]))
    assert not np.isfinite(memory.ends).any()
    learn_ends(memory, np.array([0.3, 0.4998]))
    assert np.isfinite(memory.ends).sum() == 1


def test_commands_beyond_the_limits_are_in_the_last_bins() -> None:
    """41 of them between the yaw's limits, -2 and 2."""
    memory = still()
    assert [bin_of(memory, 0, command) for command in (-3.0, -2.0, -1.96, -1.94, 0.0, 2.0, 9.0)] == [
        *(0, 0, 0, 1),
        *(20, 40, 40),
    ]


def gained(memory: Memory, head: Floats, pixel: Floats) -> Floats:
    """By how much the pixel gain changes."""
    before = memory.gain.copy()
    learn_gain(memory, head, pixel)
    return memory.gain - before


@pytest.mark.parametrize(("movement", "rate"), [(0, 1.0), (1, 5 / 6), (5, 0.5), (94, 5 / 99), (96, 0.05), (5000, 0.05)])
def test_each_movement_says_less_of_the_pixel_gain(movement: int, rate: float) -> None:
    """G += eta e d2p' / (|d2p|^2 + .02) with eta = 1 / (1 + k/5) at the k-th movement, and .05 at least."""
    memory, d2y, d2p = still(), np.array([0.1, -0.05]), np.array([-0.3, 0.2])
    memory.moved[:], memory.slip[:] = (0.03, 0.01), (0.05, -0.02)
    memory.gain[:] = [[0.1, 0.0], [0.2, -0.3]]
    memory.numbers[TURNS] = movement
    error = -d2y - memory.gain @ d2p
    expected = rate * np.outer(error, d2p) / (d2p @ d2p + 0.02)
    np.testing.assert_allclose(gained(memory, memory.moved + d2y, memory.slip + d2p), expected, rtol=5e-3)
    assert memory.numbers[TURNS] == movement + 1


@pytest.mark.parametrize(
    ("stride", "turn", "learns"),
    [(1.0, 0.051, True), (1.0, 0.049, False), (0.1, 0.041, True), (0.1, 0.039, False), (0.1, -0.041, True)],
)
def test_small_turns_say_nothing_of_the_pixel_gain(stride: float, turn: float, learns: bool) -> None:
    """They must be longer than .05 rad, or than .4 of the longest way of a frame, of the quicker joint, if less."""
    memory = still()
    memory.stride[:] = 0.2 * stride, stride
    found = gained(memory, np.array([0.6, 0.8]) * turn, np.array([0.2, 0.1]))
    assert bool(found.any()) == learns == bool(memory.numbers[TURNS])


def test_a_miss_says_nothing_of_the_pixel_gain() -> None:
    """Neither now, nor in the frame before, nor in the one before that."""
    for name in ("pixel", "slip"):
        memory = still()
        getattr(memory, name)[:] = np.nan
        assert not gained(memory, np.array([0.2, 0.0]), np.array([0.2, 0.1])).any()
    assert not gained(still(), np.array([0.2, 0.0]), np.full(2, np.nan)).any()


@pytest.mark.parametrize("seen_before", [True, False])
@pytest.mark.parametrize("wrong", [{SURPRISE: 0.01}, {FRAMES: 6000, FAST_SIGHT: 0.19, SLOW_SIGHT: 0.8}])
def test_where_something_is_wrong_plain_movements_teach_the_gain(wrong: dict[int, float], seen_before: bool) -> None:
    """In a surprise, or when the hand is hardly seen: from dy and dp, for which it need be seen in two frames alone."""
    memory, dy, dp = still(), np.array([0.1, -0.05]), np.array([-0.3, 0.2])
    memory.moved[:], memory.slip[:] = (0.03, 0.01), (0.05, -0.02) if seen_before else (np.nan, np.nan)
    memory.gain[:] = [[0.1, 0.0], [0.2, -0.3]]
    memory.numbers[[TURNS, *wrong]] = 95, *wrong.values()
    expected = 0.05 * np.outer(-dy - memory.gain @ dp, dp) / (dp @ dp + 0.02)
    np.testing.assert_allclose(gained(memory, dy, dp), expected, rtol=5e-3)


def test_a_mirrored_picture_is_learned_even_by_a_slow_head() -> None:
    """The hand is seen again two minutes after the picture was mirrored, whether or not the errors are a surprise."""
    short = {"learner": "best", "eye": "geometric", "motion": "kinematic", "minutes": 6, "damage_minutes": 5}
    with Session(changed(paper(), short | {"damage": "mirrored"})) as session:
        seen = [frame.sighting is not None for frame in session]
    assert np.mean(seen[4 * 900 : 6 * 900]) > 0.85 and np.mean(seen[-2 * 900 :]) > 0.7
