"""A short trial of a body's physics: is it stable, do servos reach their targets, how long does a frame take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from somatopy.bodies.base import Diverged
from somatopy.bodies.mujoco import MujocoBody
from somatopy.percept import Floats

__all__ = ["Trial", "trial"]

_EACH = 40  # frames to reach a posture and settle there


@dataclass(frozen=True)
class Trial:
    """What a body did when it was sent to some postures.

    Attributes:
        frames: how many frames of 1/15 s it moved.
        diverged: what was said when its physics became unstable; None if it did not.
        joints: names of arm and head joints.
        errors: largest distance of each from its target at the end of a movement, shape (n,), rad or m; NaN where
            physics broke off before.
        seconds: time that a frame took, s, its median.
    """

    frames: int
    diverged: str | None
    joints: tuple[str, ...]
    errors: Floats
    seconds: float


def trial(body: MujocoBody, postures: Sequence[tuple[Floats, Floats]]) -> Trial:
    """Send a body to postures of arm and head, 40 frames each; it is reset before.

    Args:
        body: the robot.
        postures: arm (n_arm,) and head (n_head,), rad, inside their limits.

    Example:
        >>> body = MujocoBody("nao", arm_speed=None)
        >>> done = trial(body, [(np.array([1.0, 0.3, -1.0, -0.8]), np.array([0.5, 0.2]))])
        >>> done.frames, done.diverged, bool(done.errors.max() < 0.05)
        (40, None, True)
        >>> body.close()
    """
    names = (*body.arm.names, *body.head.names)
    body.reset()
    errors, took, said = np.full(len(names), np.nan), [], None
    try:
        for arm, head in postures:
            for _ in range(_EACH):
                began = perf_counter()
                reading = body.step(arm, head)
                took.append(perf_counter() - began)
            missed = np.concatenate([reading.arm - reading.arm_command, reading.head - reading.head_command])
            errors = np.fmax(errors, np.abs(missed))
    except Diverged as error:
        said = str(error)
    return Trial(len(took), said, names, errors, float(np.median(took)) if took else float("nan"))
