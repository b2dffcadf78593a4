"""Tries the physics of a body for a short time: is it stable, do servos reach their targets, is it fast enough?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from time import perf_counter

import mujoco
import numpy as np

from somatopy.bodies.base import Diverged
from somatopy.bodies.joint_tree import moved_by
from somatopy.bodies.mujoco import MujocoBody
from somatopy.percept import Floats

__all__ = ["FAR", "Trial", "trial"]

FAR = 0.1  # rad or m from its target at rest: a servo that is too weak, or held
_EACH = 40  # frames to reach a posture and settle there


@dataclass(frozen=True)
class Trial:
    """What a body did when it was sent to some postures.

    Attributes:
        frames: number of frames of 1/15 s in which it moved.
        diverged: the message with which its physics became unstable. None if it stayed stable.
        joints: names of the joints of arm and head.
        errors: largest distance of each joint from its target at the end of a movement, shape (n,), rad (m for slides).
            NaN if physics became unstable before the first movement ended.
        seconds: median of the wall time of a frame, s.
        touching: pairs of bodies that touched while a joint was far from its target. One of each pair belongs to the
            arm or the head.
    """

    frames: int
    diverged: str | None
    joints: tuple[str, ...]
    errors: Floats
    seconds: float
    touching: tuple[tuple[str, str], ...] = ()


def trial(body: MujocoBody, postures: Sequence[tuple[Floats, Floats]]) -> Trial:
    """Reset a body, and send it to some postures of arm and head, for 40 frames each.

    Args:
        body: the robot.
        postures: pairs of an arm posture, shape (n_arm,), and a head posture, shape (n_head,), rad, inside all limits.

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
    touching: dict[tuple[str, str], None] = {}
    try:
        for arm, head in postures:
            for _ in range(_EACH):
                began = perf_counter()
                reading = body.step(arm, head)
                took.append(perf_counter() - began)
            missed = np.concatenate([reading.arm - reading.arm_command, reading.head - reading.head_command])
            errors = np.fmax(errors, np.abs(missed))
            if np.abs(missed).max() > FAR:
                touching |= dict.fromkeys(_touching(body, names))
    except Diverged as error:
        said = str(error)
    return Trial(len(took), said, names, errors, float(np.median(took)) if took else float("nan"), (*touching,))


def _touching(body: MujocoBody, joints: Sequence[str]) -> Iterator[tuple[str, str]]:
    """The bodies in each contact of what these joints move.

    Found anew, since a body that moves in parts keeps no contacts of the whole.
    """
    model, posed = body.model, mujoco.MjData(body.model)
    posed.qpos[:] = body.data.qpos
    mujoco.mj_forward(model, posed)
    for contact in posed.contact:
        bodies = [int(model.geom_bodyid[geom]) for geom in contact.geom]
        if contact.dist <= 0 and any(name in moved_by(model, b) for b in bodies for name in joints):
            one, other = sorted(model.body(b).name or f"body {b}" for b in bodies)
            yield one, other
