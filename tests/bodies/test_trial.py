"""The short trial of physics: it finds servos that are too weak, and physics that becomes unstable."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from somatopy.bodies import MujocoBody
from somatopy.bodies.trial import trial
from somatopy.clock import FRAME

Robot = Callable[..., Path]
LIFT = '<position joint="lift" kp="20" kv="1"/>'


def tried(anatomy: Path, angle: float = 0.0) -> tuple[dict[str, float], str | None]:
    body = MujocoBody(anatomy, arm_speed=None)
    done = trial(body, [(np.array([angle, 0.0]), np.zeros(2))])
    body.close()
    return dict(zip(done.joints, done.errors.tolist(), strict=True)), done.diverged


def test_a_weak_servo_sags_by_torque_over_stiffness(robot: Robot) -> None:
    """The level boom of 50 g, its middle 10 cm out, and the jib of 20 g 25 cm out, on a spring of 1 N m/rad.

    The cosine of the angle that it sags to takes part: a fixed point, found by iteration.
    """
    kp, sagged = 1.0, 0.0
    for _ in range(50):
        sagged = 9.81 * (0.05 * 0.1 + 0.02 * 0.25) * math.cos(sagged) / kp
    errors, said = tried(robot((LIFT, f'<position joint="lift" kp="{kp}" kv=".3"/>')))
    assert errors["lift"] == pytest.approx(sagged, rel=0.02) and said is None
    assert max(errors[name] for name in ("swing", "pan")) < 1e-3


def test_unstable_physics_is_told(robot: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A servo far too stiff for any step."""
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its log there
    _, said = tried(robot((LIFT, '<position joint="lift" kp="1e13"/>')), 0.9)
    assert said is not None and "smaller physics step" in said


def test_forty_frames_are_enough_to_get_there(robot: Robot) -> None:
    """At 2 rad/s and 3 rad/s the crane crosses its whole range in less."""
    errors, _ = tried(robot((LIFT, LIFT.replace("20", "2000").replace('"1"', '"40"'))), -1.0)
    assert errors["lift"] < 0.01 and 40 * FRAME > 2.0 / 2.0
