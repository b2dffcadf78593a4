"""Controls: random head postures, and one for ever."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import kstest

from somatopy.learners import FixedGaze, RandomGaze
from somatopy.percept import Camera, Percept, Robot, Space

LIMITS = np.array([[-2.0857, 2.0857], [-0.6720, 0.5149]])
ROBOT = Robot(
    {"arm": Space("abcd", [-2.0] * 4, [2.0] * 4), "head": Space(("yaw", "pitch"), *LIMITS.T)},
    ("head",),
    Camera("eye", 320, 240, fovy=0.83),
)
FAR, NEAR = np.array([0.5, 0.3]), np.array([0.01, -0.01])
ZERO = np.zeros(2)
FRAME = 1 / 15
UNREACHED = Percept(time=0.0, arm=np.zeros(4), head=FAR, arm_command=np.zeros(4), head_command=ZERO)


def control(seed: int = 0) -> RandomGaze:
    return RandomGaze(ROBOT, np.random.default_rng(seed))


def targets(gaze: RandomGaze, frames: int, head: np.ndarray = FAR, first: int = 0) -> np.ndarray:
    """What it commands in each frame while the head stays `head` away from its command."""
    return np.array([gaze.gaze(replace(UNREACHED, time=k * FRAME, head=head)) for k in range(first, first + frames)])


def test_targets_are_uniform_within_the_limits() -> None:
    """Each head joint's targets are uniform over its range."""
    found = targets(control(), 30_000)[::15]
    for k, (low, high) in enumerate(LIMITS):
        assert (found[:, k] >= low).all() and (found[:, k] <= high).all()
        assert kstest(found[:, k], "uniform", (low, high - low)).pvalue > 1e-3


def test_a_target_out_of_reach_is_held_for_one_second() -> None:
    """15 frames of 1/15 s each, however large the time is: rounding never makes it 16."""
    short = [k for k in range(20_000) if (k + 15) * FRAME - k * FRAME < 1]
    for first in (0, *short[:5]):
        found = targets(control(), 1500, first=first)
        changes = np.flatnonzero((found[1:] != found[:-1]).any(axis=1)) + 1
        assert changes.tolist() == list(range(15, 1500, 15))


def test_a_reached_target_is_given_up() -> None:
    """Once the head is where it was commanded, after one frame at least, a new target is drawn."""
    found = targets(control(), 50, head=NEAR)
    assert (found[1:] != found[:-1]).any(axis=1).all()


@pytest.mark.parametrize(("unit", "near"), [("rad", 0.02), ("m", 0.002)])
def test_a_target_is_reached_within_a_degree_or_two_millimetres(unit: str, near: float) -> None:
    """.02 rad of a hinge, .002 m of a slide, to either side."""
    head = Space(("yaw", "lift"), *LIMITS.T, ("rad", unit))
    robot = Robot({"arm": ROBOT.arm, "head": head}, ("head",), ROBOT.camera)
    for share, reached in ((0.95, True), (1.05, False)):
        for side in (-1, 1):
            gaze = RandomGaze(robot, np.random.default_rng(0))
            found = targets(gaze, 2, head=np.array([0.0, side * share * near]))
            assert (found[0] != found[1]).any() == reached


@pytest.mark.parametrize("head", [[0.5, 0.0], [0.0, 0.3]])
def test_a_target_that_one_joint_has_reached_is_held(head: list[float]) -> None:
    """A posture is reached when every joint is: with one joint still under way it stays for its second."""
    found = targets(control(), 16, head=np.array(head))
    assert (found[:15] == found[0]).all() and (found[15] != found[0]).any()


def test_learns_nothing() -> None:
    """observe changes no number of what follows; there are no plastic parts and no probes."""
    watched, blind = control(), control()
    for k in range(100):
        watched.observe(replace(UNREACHED, time=k / 15))
    assert np.array_equal(targets(watched, 100), targets(blind, 100))
    assert watched.probes() == {} == watched.maps() and watched.plastic == frozenset()


def test_prediction_is_pure() -> None:
    """predict draws nothing: the gaze that follows is that of a twin which never predicted."""
    asked, silent = control(), control()
    assert np.array_equal(asked.predict(np.ones(4)), asked.predict(np.zeros(4)))
    assert np.array_equal(targets(asked, 100), targets(silent, 100))


def test_continues_bit_for_bit_from_a_state() -> None:
    """state and restore in mid-target."""
    original, other = control(1), control(2)
    targets(original, 40)
    state = original.state()
    future = targets(original, 100, first=40)
    other.restore(state)
    assert np.array_equal(targets(other, 100, first=40), future)


def test_its_state_is_plain_from_the_start() -> None:
    """Before the first frame too: a checkpoint can hold it, and it goes on bit for bit."""
    fresh, other = control(1), control(2)
    other.restore(json.loads(json.dumps(fresh.state(), default=np.ndarray.tolist)))
    assert np.array_equal(targets(other, 40), targets(fresh, 40))


def test_a_fixed_gaze_never_moves() -> None:
    """Commands and predictions are the posture, whatever comes; callers cannot change it."""
    fixed = FixedGaze([0.5, 0.2])
    fixed.gaze(UNREACHED)[:] = 9
    fixed.predict(np.zeros(4))[:] = 9
    fixed.observe(UNREACHED)
    fixed.restore(fixed.state())
    assert fixed.gaze(UNREACHED) == pytest.approx([0.5, 0.2]) == fixed.predict(np.ones(4))
    assert fixed.probes() == {} == fixed.maps() and fixed.plastic == frozenset()
