"""Damages: what the paper's shift changes, and what it leaves alone."""

from __future__ import annotations

import numpy as np

from somatopy.experiment.damage import Damage, JointOffset, NoDamage
from somatopy.percept import Percept, Sighting

OFFSET = np.array([0.1265, 1.1411, 1.2295, -0.2242])
PERCEPT = Percept(
    time=1.0,
    arm=np.array([2.0, 1.3, -2.0, -1.5]),
    head=np.array([0.3, 0.2]),
    arm_command=np.array([-1.0, 0.5, 1.0, -0.1]),
    head_command=np.array([0.4, 0.1]),
    sighting=Sighting((10.0, 20.0), 2, 300.0),
    dt=1 / 15,
)


def test_damages_keep_the_contract() -> None:
    """Both are Damages; neither changes what the body could see."""
    for damage in (NoDamage(), JointOffset(OFFSET)):
        assert isinstance(damage, Damage) and not damage.alters_ceiling


def test_an_offset_shifts_posture_and_efference_copy_alike_without_clipping() -> None:
    """Sums, even far beyond the joint limits; otherwise the efference copy would undo the damage."""
    sensed = JointOffset(OFFSET).sense(PERCEPT, np.random.default_rng())
    assert np.array_equal(sensed.arm, PERCEPT.arm + OFFSET)
    assert np.array_equal(sensed.arm_command, PERCEPT.arm_command + OFFSET)


def test_an_offset_leaves_all_else_alone() -> None:
    """Head, head command, sighting and times stay, and so does the percept that came in."""
    before = PERCEPT.arm.copy()
    sensed = JointOffset(OFFSET).sense(PERCEPT, np.random.default_rng())
    assert sensed.head is PERCEPT.head and sensed.head_command is PERCEPT.head_command
    assert (sensed.time, sensed.dt, sensed.sighting) == (PERCEPT.time, PERCEPT.dt, PERCEPT.sighting)
    assert np.array_equal(PERCEPT.arm, before)


def test_an_offset_is_constant() -> None:
    """It draws no random numbers and does not follow later changes of the array it was given."""
    given, rng = OFFSET.copy(), np.random.default_rng(1)
    damage = JointOffset(given)
    given[:] = 99
    sensed = damage.sense(PERCEPT, rng)
    assert np.array_equal(sensed.arm, damage.sense(PERCEPT, rng).arm)
    assert np.array_equal(sensed.arm, PERCEPT.arm + OFFSET)
    assert rng.random() == np.random.default_rng(1).random()


def test_no_damage_is_none() -> None:
    """The intact robot's percept is handed on as it is."""
    assert NoDamage().sense(PERCEPT, np.random.default_rng()) is PERCEPT
