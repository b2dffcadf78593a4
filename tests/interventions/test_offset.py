"""The paper's damage: what the shift changes, and what it leaves alone."""

from __future__ import annotations

from contextlib import closing
from types import SimpleNamespace

import numpy as np
import pytest
from pydantic import ValidationError

from somatopy.bodies import MujocoBody
from somatopy.interventions import PAPER_OFFSET, Intervention, JointOffset
from somatopy.interventions.offset import NAO_LIMITS, paper_offset
from somatopy.percept import JointGroup, Percept, Sighting
from somatopy.registry import INTERVENTIONS

OFFSET = np.array([0.1265, 1.1411, 1.2295, -0.2242])
PERCEPT = Percept(
    time=1.0,
    arm=np.array([2.0, 1.3, -2.0, -1.5]),
    head=np.array([0.3, 0.2]),
    arm_command=np.array([-1.0, 0.5, 1.0, -0.1]),
    head_command=np.array([0.4, 0.1]),
    sighting=Sighting((10.0, 20.0), 2, 300.0),
    dt=1 / 15,
    more={"torso": np.array([0.7])},
)
ARM = JointGroup(("a", "b", "c", "d"), -np.ones(4), np.ones(4), np.ones(4))


def test_it_keeps_the_contract() -> None:
    """It is an Intervention, and changes neither what the body could see nor how the arm moves."""
    damage = JointOffset(OFFSET)
    assert isinstance(damage, Intervention) and not damage.alters_ceiling and not damage.moves_arm


def test_an_offset_shifts_posture_and_efference_copy_alike_without_clipping() -> None:
    """Sums, even far beyond the joint limits; otherwise the efference copy would undo the damage."""
    sensed = JointOffset(OFFSET).sense(PERCEPT, np.random.default_rng())
    assert np.array_equal(sensed.arm, PERCEPT.arm + OFFSET)
    assert np.array_equal(sensed.arm_command, PERCEPT.arm_command + OFFSET)


def test_an_offset_leaves_all_else_alone() -> None:
    """Head, head command, further senses, sighting and times stay, and so does the percept that came in."""
    before = PERCEPT.arm.copy()
    sensed = JointOffset(OFFSET).sense(PERCEPT, np.random.default_rng())
    assert sensed.head is PERCEPT.head and sensed.head_command is PERCEPT.head_command
    assert (sensed.time, sensed.dt, sensed.sighting) == (PERCEPT.time, PERCEPT.dt, PERCEPT.sighting)
    assert sensed["torso"] is PERCEPT["torso"]
    assert np.array_equal(PERCEPT.arm, before)


def test_an_offset_leaves_commands_alone() -> None:
    """The body is told what babbler and learner said: only what is sensed is damaged."""
    target, gaze = np.ones(4), np.zeros(2)
    acted = JointOffset(OFFSET).act(target, gaze, np.random.default_rng())
    assert acted[0] is target and acted[1] is gaze and target.tolist() == [1] * 4


def test_an_offset_is_constant() -> None:
    """It draws no random numbers and does not follow later changes of the array it was given."""
    given, rng = OFFSET.copy(), np.random.default_rng(1)
    damage = JointOffset(given)
    given[:] = 99
    sensed = damage.sense(PERCEPT, rng)
    assert np.array_equal(sensed.arm, damage.sense(PERCEPT, rng).arm)
    assert np.array_equal(sensed.arm, PERCEPT.arm + OFFSET)
    assert rng.random() == np.random.default_rng(1).random()


# -- settings --------------------------------------------------------------------------------------------------------


def test_without_settings_it_is_the_papers() -> None:
    """The shift that the paper prints, joint by joint, to the last bit, and nothing to remark on."""
    with closing(MujocoBody("nao", motion="kinematic")) as nao:
        damage = INTERVENTIONS.validated("offset").build(SimpleNamespace(arm=nao.arm))
    sensed = damage.sense(PERCEPT, np.random.default_rng())
    assert np.array_equal(sensed.arm, PERCEPT.arm + OFFSET)
    assert np.array_equal(OFFSET, PAPER_OFFSET) and damage.remark == ""


def test_the_papers_shift_of_another_arm_is_the_same_share_of_each_range() -> None:
    """By the ranges that NAO's maker prints, again from the first on behind the fourth joint; the units count not."""
    spans = np.array([2 * 2.0857, 1.3265 + 0.3142, 2 * 2.0857, 1.5446 - 0.0349])
    names, low = tuple("abcdefg"), np.array([-1.0, 0.0, -0.5, 2.0, 0.0, -3.0, 0.1])
    span = np.array([1.0, 0.1, 2.0, 0.5, 3.0, 6.0, 0.2])
    units = ("rad", "m", "rad", "rad", "rad", "rad", "m")
    for n in (1, 2, 4, 7):
        arm = JointGroup(names[:n], low[:n], (low + span)[:n], np.ones(n), units[:n])
        shares = [(OFFSET / spans)[k % 4] for k in range(n)]
        assert np.allclose(paper_offset(arm), shares * span[:n], rtol=1e-12)
        damage = INTERVENTIONS.validated("offset").build(SimpleNamespace(arm=arm))
        zero = np.zeros(n)
        assert np.array_equal(
            damage.sense(Percept(0.0, zero, zero, zero, zero), np.random.default_rng()).arm, paper_offset(arm)
        )
        assert damage.remark.count(" rad") + damage.remark.count(" m") == n and "a +0.03033 rad" in damage.remark


def test_four_slides_are_no_nao() -> None:
    """Limits of the same numbers in metres are another arm's, and said to be."""
    arm = JointGroup(tuple("abcd"), *np.transpose(NAO_LIMITS), np.ones(4), ("m",) * 4)
    assert "a +0.1265 m" in INTERVENTIONS.validated("offset").build(SimpleNamespace(arm=arm)).remark


def test_the_shift_of_the_settings_is_applied() -> None:
    """Whole numbers and a list will do, as TOML has them."""
    arm = JointGroup(("a", "b"), -np.ones(2), np.ones(2), np.ones(2))
    damage = INTERVENTIONS.validated({"kind": "offset", "offset": [1, -0.5]}).build(SimpleNamespace(arm=arm))
    sensed = damage.sense(Percept(0.0, np.zeros(2), np.zeros(1), np.ones(2), np.zeros(1)), np.random.default_rng())
    assert sensed.arm.tolist() == [1.0, -0.5] and sensed.arm_command.tolist() == [2.0, 0.5]


@pytest.mark.parametrize("offset", [[0.1], [0.1] * 5])
def test_an_offset_of_another_length_than_the_arm_is_refused(offset: list[float]) -> None:
    """Both numbers and the joints are named."""
    settings = INTERVENTIONS.validated({"kind": "offset", "offset": offset})
    mend = r'Write one for each, such as offset = \[0.1, 0.1, 0.1, 0.1\], or offset = "paper"'
    with pytest.raises(ValueError, match=rf"{len(offset)} offsets; the arm has 4 joints: a, b, c, d. {mend}"):
        settings.build(SimpleNamespace(arm=ARM))


@pytest.mark.parametrize("offset", [[], [float("nan")], [float("inf"), 0.1], ["much"], 0.1])
def test_an_offset_that_is_no_list_of_finite_numbers_is_refused(offset: object) -> None:
    """Before anything is built, at the key."""
    with pytest.raises(ValidationError, match="offset"):
        INTERVENTIONS.validated({"kind": "offset", "offset": offset})
