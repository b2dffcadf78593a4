"""The arm felt otherwise: gain, joints in each other's places, a dead joint, noise."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from pydantic import ValidationError
from tests.interventions.damages import ARM, built, felt, percept, postures

from somatopy.percept import JointGroup

MIDDLE, SPAN = (ARM.lower + ARM.upper) / 2, ARM.upper - ARM.lower
ONE = JointGroup(("only",), -np.ones(1), np.ones(1), np.ones(1))
TWO = JointGroup(("a", "b"), -np.ones(2), np.ones(2), np.ones(2))


def shares(arm: np.ndarray) -> np.ndarray:
    return np.asarray((arm - ARM.lower) / SPAN)


# -- gain ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("gain", [0.7, 1.5, -1.0])
def test_a_gain_leaves_the_middle_and_stretches_all_distances(gain: float) -> None:
    """Of any two postures, beyond the limits too: nothing is clipped."""
    damage = built({"kind": "gain", "gain": gain})
    assert np.allclose(felt(damage, MIDDLE), MIDDLE)
    for one, other in pairwise([*postures(), ARM.upper + 1]):
        assert np.allclose(felt(damage, one) - felt(damage, other), gain * (one - other))


def test_a_gain_and_its_inverse_are_no_damage() -> None:
    """One after the other."""
    one, other = built({"kind": "gain", "gain": 0.7}), built({"kind": "gain", "gain": 1 / 0.7})
    for arm in postures():
        assert np.allclose(felt(other, felt(one, arm)), arm)


# -- joints in each other's places -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("joints", "first", "second"), [((0, 1), 0, 1), (("lift", "roll"), 3, 1), ((2, "pitch"), 2, 0)]
)
def test_swapped_joints_have_each_others_share_of_the_range(
    joints: tuple[object, object], first: int, second: int
) -> None:
    """The others stay; swapped twice is the identity."""
    damage = built({"kind": "swapped", "joints": joints})
    for arm in postures():
        sensed = felt(damage, arm)
        assert np.allclose(shares(sensed)[[first, second]], shares(arm)[[second, first]])
        rest = [k for k in range(4) if k not in (first, second)]
        assert np.allclose(sensed[rest], arm[rest])
        assert np.allclose(felt(damage, sensed), arm)


def test_permuted_joints_all_move_and_come_back_after_as_many_times() -> None:
    """No joint is felt in its own place, limits go to limits, and four cyclic shifts are the identity."""
    damage = built("permuted")
    assert np.allclose(felt(damage, ARM.lower), ARM.lower) and np.allclose(felt(damage, ARM.upper), ARM.upper)
    for joint in range(4):
        arm = ARM.lower + SPAN * (np.arange(4) == joint)
        assert np.flatnonzero(shares(felt(damage, arm)) > 0.5).tolist() == [(joint - 1) % 4]
    for arm in postures():
        once = felt(damage, arm)
        assert np.allclose(felt(damage, felt(damage, felt(damage, once))), arm)


def test_an_order_is_taken_as_written() -> None:
    """By names or numbers: first what is felt in the first joint's place."""
    damage = built({"kind": "permuted", "order": ["lift", 2, "pitch", 1]})
    for arm in postures():
        assert np.allclose(shares(felt(damage, arm)), shares(arm)[[3, 2, 0, 1]])


def test_two_joints_permuted_are_two_joints_swapped() -> None:
    """Both are the only way to change places."""
    for arm in postures(arm=TWO):
        assert np.array_equal(felt(built("permuted", TWO), arm), felt(built("swapped", TWO), arm))


@pytest.mark.parametrize(
    ("damage", "arm", "said"),
    [
        ("swapped", ONE, "this one has only alone; choose another damage, such as gain"),
        ("permuted", ONE, "this one has only alone; choose another damage, such as gain"),
        (
            {"kind": "swapped", "joints": ["roll", 1]},
            ARM,
            r"\['roll', 1\] name one twice; name different ones of pitch",
        ),
        ({"kind": "swapped", "joints": [0, 9]}, ARM, r"no joint 9; .* lift \(3\)"),
        ({"kind": "permuted", "order": [1, 0]}, ARM, "order names 2 joints; name all that the arm has: pitch, roll"),
        ({"kind": "dead-joint", "joint": "knee"}, ARM, r"no joint 'knee'; .* pitch \(0\)"),
        ({"kind": "noise", "deviation": [0.1, 0.2]}, ARM, "2 deviations; write one for all joints"),
        ({"kind": "head-offset", "offset": [0.1]}, ARM, "1 offsets; write one for all .*each of pan, tilt"),
    ],
)
def test_what_an_arm_cannot_have_is_refused(damage: dict[str, object] | str, arm: JointGroup, said: str) -> None:
    """In a sentence with the valid choices."""
    with pytest.raises(ValueError, match=said):
        built(damage, arm)


@pytest.mark.parametrize(
    "damage",
    [
        {"kind": "noise", "deviation": -0.1},
        {"kind": "noise", "deviation": float("inf")},
        {"kind": "noise", "deviation": [0.1, float("nan")]},
        {"kind": "longer-arm", "factor": 1e9},
        {"kind": "drift", "minutes": 0},
        {"kind": "random-offset", "norm": -1.0},
        {"kind": "random-offset", "draw": -1},
        {"kind": "gain", "gain": float("inf")},
        {"kind": "swapped", "joints": [1]},
    ],
)
def test_values_without_sense_are_refused(damage: dict[str, object]) -> None:
    """Before anything is built."""
    with pytest.raises(ValidationError):
        built(damage)


# -- a dead joint ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("joint", "place"), [(1, 1), ("yaw", 2)])
def test_a_dead_joint_says_for_ever_what_it_said_first(joint: object, place: int) -> None:
    """In posture and command; all others pass, and what the body is told passes."""
    damage, rng = built({"kind": "dead-joint", "joint": joint}), np.random.default_rng(0)
    arms = postures()
    rest = [k for k in range(4) if k != place]
    for arm, command in zip(arms, arms[::-1], strict=True):
        sensed = damage.sense(percept(arm, command=command), rng)
        assert sensed.arm[place] == sensed.arm_command[place] == arms[0, place]
        assert np.array_equal(sensed.arm[rest], arm[rest])
        assert np.array_equal(sensed.arm_command[rest], command[rest])
        assert np.array_equal(damage.act(command, arm, rng)[0], command)


# -- noise -----------------------------------------------------------------------------------------------------------


def test_noise_is_on_the_posture_alone_with_mean_0_and_the_deviation_that_was_said() -> None:
    """Independent between joints and frames; of a slide, as a share of its range; the efference copy is exact."""
    damage, rng, arm = built({"kind": "noise", "deviation": 0.2}), np.random.default_rng(1), MIDDLE
    sensed = [damage.sense(percept(arm), rng) for _ in range(4000)]
    noise = (np.array([one.arm for one in sensed]) - arm) / [1, 1, 1, 0.1]
    assert all(np.array_equal(one.arm_command, arm) for one in sensed)
    assert np.abs(noise.mean(axis=0)).max() < 4 * 0.2 / np.sqrt(4000)
    assert np.allclose(noise.std(axis=0), 0.2, rtol=0.05)
    related = np.corrcoef(np.hstack([noise[1:], noise[:-1]]).T) - np.eye(8)
    assert np.abs(related).max() < 4 / np.sqrt(4000)


def test_noise_of_each_joint() -> None:
    """A joint whose deviation is 0 is exact."""
    damage, rng = built({"kind": "noise", "deviation": [0.1, 0, 0, 0.5]}), np.random.default_rng(1)
    noise = np.array([damage.sense(percept(MIDDLE), rng).arm for _ in range(2000)]) - MIDDLE
    assert np.allclose(noise.std(axis=0), [0.1, 0, 0, 0.05], rtol=0.08)
