"""What the learner finds out about head, eye and arm: the equations of docs/best.md, step 1, and when they apply."""

from __future__ import annotations

import numpy as np
import pytest
from tests.learners.best.world import robot

from somatopy.experiment import Session
from somatopy.experiment.changes import changed
from somatopy.experiment.presets import paper
from somatopy.learners.best.calibration import bin_of, learn_bias, learn_ends, learn_gain
from somatopy.learners.best.directions import powers
from somatopy.learners.best.memory import DOUBT_MOST, TURNS, Memory, fresh
from somatopy.percept import Floats


def still(stride: float = 1.0) -> Memory:
    """A head at 0 that has been seen to go so far in a frame, and a hand in the middle of the picture."""
    memory = fresh(robot(4))
    memory.head[:], memory.pixel[:] = 0.0, 0.0
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


def moved(memory: Memory, x: Floats, head: Floats, pixel: Floats) -> bool:
    """One frame: whether the gain learns; the frame becomes the last one."""
    learned = learn_gain(memory, x, head, pixel)
    memory.felt[0], memory.head[:], memory.pixel[:] = x, head, pixel
    return learned


def test_gain_and_sway_are_those_of_least_squares() -> None:
    """Of dy + G dp = C dphi over all movements, each counting .997 times as much as the next; solved at once, beside.

    What the first one counts besides is the prior, that all values are 0 and known to within 1,000.
    """
    memory, rng = still(), np.random.default_rng(0)
    before, now = np.empty(15), np.empty(15)
    seen, told = np.eye(16) / DOUBT_MOST, np.zeros((16, 2))
    for frame in range(1500):
        x, head, pixel = rng.uniform(0.4, 0.6, 4), rng.uniform(-0.5, 0.5, 2), rng.uniform(-1, 1, 2)
        kept = 0.997 if np.trace(np.linalg.inv(seen)) < 16 * DOUBT_MOST else 1.0
        powers(memory.felt[0], before)
        powers(x, now)
        z = np.concatenate([pixel - memory.pixel, before[1:] - now[1:]])
        seen, told = kept * seen + np.outer(z, z), kept * told - np.outer(z, head - memory.head)
        assert moved(memory, x, head, pixel)
        assert memory.numbers[TURNS] == frame + 1
    gain, sway = np.split(np.linalg.solve(seen, told).T, [2], axis=1)
    np.testing.assert_allclose(memory.gain, gain, rtol=1e-6)
    np.testing.assert_allclose(memory.sway, sway, rtol=1e-6)


@pytest.mark.parametrize(("moves", "minutes"), [(True, 10), (False, 60)])
def test_doubt_stays_symmetric_and_positive(moves: bool, minutes: int) -> None:
    """Whether or not the arm moves: asymmetry grows by 1 / .997 a frame, e^27 times in 10 minutes: G is useless then.

    While the arm stands still, G comes near the truth by 1 / frames only, so that an hour is needed.
    """
    memory, rng = still(), np.random.default_rng(0)
    x, head, truth = np.full(4, 0.5), np.zeros(2), np.array([[-0.6, 0.1], [0.0, 0.6]])
    for _ in range(900 * minutes):
        if moves:
            x = np.clip(x + rng.uniform(-0.02, 0.02, 4), 0.0, 1.0)
        head = head + rng.uniform(-0.1, 0.1, 2) - 0.1 * head
        moved(memory, x, head, np.linalg.solve(truth, x[:2] - head))
    np.testing.assert_array_equal(memory.doubt, memory.doubt.T)
    own = np.linalg.eigvalsh(memory.doubt)
    assert own.min() > 0 and own.sum() < 1.01 * 16 * DOUBT_MOST
    np.testing.assert_allclose(memory.gain, truth, atol=1e-6)


def test_a_head_at_rest_says_nothing_of_the_pixel_gain() -> None:
    """However the hand moves; and the least turn does."""
    memory, none = still(), np.zeros(2)
    assert not moved(memory, np.full(4, 0.5), none, np.array([0.2, 0.1]))
    assert not memory.gain.any() and not memory.sway.any() and not memory.numbers[TURNS]
    assert moved(memory, np.full(4, 0.5), np.array([0.0, 1e-3]), none)


def test_a_miss_says_nothing_of_the_pixel_gain() -> None:
    """Neither now nor in the frame before."""
    memory, none = still(), np.full(2, np.nan)
    turns = np.random.default_rng(0).uniform(-0.3, 0.3, (4, 2))
    seen = (np.array([0.2, 0.1]), none, np.array([0.1, 0.0]), np.array([0.3, 0.0]))
    learned = [moved(memory, np.full(4, 0.5), turn, pixel) for turn, pixel in zip(turns, seen, strict=True)]
    assert learned == [True, False, False, True]


def test_a_mirrored_picture_is_learned_even_by_a_slow_head() -> None:
    """The hand is seen again two minutes after the picture was mirrored, whether or not the errors are a surprise."""
    short = {"learner": "best", "eye": "geometric", "motion": "kinematic", "minutes": 6, "damage_minutes": 5}
    with Session(changed(paper(), short | {"damage": "mirrored"})) as session:
        seen = [frame.sighting is not None for frame in session]
    assert np.mean(seen[4 * 900 : 6 * 900]) > 0.85 and np.mean(seen[-2 * 900 :]) > 0.7
