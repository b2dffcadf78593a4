"""What the tests of damages share: arms, percepts, and damages as a description names them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from somatopy.interventions import Intervention
from somatopy.percept import Camera, Floats, JointGroup, Percept, Sighting
from somatopy.registry import INTERVENTIONS

#: Three hinges and a slide of unlike ranges, none about 0.
ARM = JointGroup(
    ("pitch", "roll", "yaw", "lift"),
    np.array([-1.0, -0.25, 0.5, 0.0]),
    np.array([2.0, 1.25, 0.75, 0.1]),
    np.ones(4),
    ("rad", "rad", "rad", "m"),
)
HEAD = JointGroup(("pan", "tilt"), -np.ones(2), np.ones(2), np.ones(2))


def built(damage: str | dict[str, Any], arm: JointGroup = ARM, seed: int = 0) -> Intervention:
    """A damage from its settings, for an arm and under a seed."""
    body = SimpleNamespace(arm=arm, head=HEAD, camera=Camera("eye", 320, 240, fovy=0.83))
    context: Any = SimpleNamespace(arm=arm, body=body, description=SimpleNamespace(seed=seed))
    made: Intervention = INTERVENTIONS.validated(damage).build(context)
    return made


def percept(arm: Floats, time: float = 0.0, command: Floats | None = None, sighting: Sighting | None = None) -> Percept:
    return Percept(time, arm, np.array([0.3, 0.2]), arm if command is None else command, np.array([0.4, 0.1]), sighting)


def felt(damage: Intervention, arm: Floats) -> Floats:
    """What a damage makes of an arm posture; of a command it must make the same."""
    sensed = damage.sense(percept(arm), np.random.default_rng(0))
    assert np.array_equal(sensed.arm, sensed.arm_command)
    return sensed.arm


def postures(count: int = 20, arm: JointGroup = ARM) -> Floats:
    """Postures inside an arm's limits, shape (count, n_arm)."""
    return np.random.default_rng(5).uniform(arm.lower, arm.upper, (count, len(arm)))
