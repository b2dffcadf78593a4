"""Keeps set-points and joints inside their limits: of position, of velocity, and those between two joints."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from somatopy._jit import jit
from somatopy.percept import Floats

__all__ = ["CLEARANCE", "advance_setpoints", "aim", "clip_targets", "hold_inside"]

Ints = NDArray[np.int64]

#: Distance (rad) that set-points keep from coupled limits, so that a servo's small error neither breaks nor jams them.
CLEARANCE = 0.002


@jit
def _interpolate(x: float, at: Floats, values: Floats) -> float:
    if x <= at[0]:
        return float(values[0])
    for k in range(1, at.size):
        if x <= at[k]:
            return float(values[k - 1] + (values[k] - values[k - 1]) * (x - at[k - 1]) / (at[k] - at[k - 1]))
    return float(values[-1])


@jit
def _lowest_upper(a: float, b: float, at: Floats, values: Floats) -> float:
    """Minimum of the piecewise linear function over [a, b]."""
    least = min(_interpolate(a, at, values), _interpolate(b, at, values))
    for k in range(at.size):
        if a < at[k] < b:
            least = min(least, values[k])
    return least


@jit
def _highest_lower(a: float, b: float, at: Floats, values: Floats) -> float:
    """Maximum of the piecewise linear function over [a, b]."""
    greatest = max(_interpolate(a, at, values), _interpolate(b, at, values))
    for k in range(at.size):
        if a < at[k] < b:
            greatest = max(greatest, values[k])
    return greatest


@jit
def clip_targets(
    target: Floats, lower: Floats, upper: Floats, limited: int, by: int, at: Floats, low: Floats, high: Floats
) -> None:
    """Clip `target` in place to the position limits, and joint `limited` also to its limits at the angle of `by`.

    Args:
        target: joint targets, shape (n,), rad.
        lower: lower position limits, shape (n,), rad.
        upper: upper position limits, shape (n,), rad.
        limited: index of the joint whose limits depend on another joint. -1 if there is none.
        by: index of that other joint.
        at: increasing angles of joint `by`, shape (m,), rad.
        low: lower limits of joint `limited` at these angles, shape (m,), rad.
        high: upper limits of joint `limited` at these angles, shape (m,), rad.
    """
    for k in range(target.size):
        target[k] = min(max(target[k], lower[k]), upper[k])
    if limited >= 0:
        least, most = _interpolate(target[by], at, low), _interpolate(target[by], at, high)
        target[limited] = min(max(target[limited], least), most)


@jit
def advance_setpoints(
    setpoint: Floats,
    sensed: Floats,
    target: Floats,
    stride: Floats,
    limited: int,
    by: int,
    at: Floats,
    low: Floats,
    high: Floats,
) -> None:
    """Move `setpoint` in place towards clipped targets, each joint by at most `stride`.

    If one joint limits another, it moves only through angles at which the other one is inside its limits, both where it
    is and where its set-point is. The other one moves towards the position that is legal on the whole way. So the pair
    is legal all the way, and not only at its ends.

    Args:
        setpoint: set-points of the frame before, shape (n,), rad. They are overwritten.
        sensed: sensed posture, shape (n,), rad.
        target: targets that `clip_targets` has clipped, shape (n,), rad.
        stride: largest change of each set-point in this frame, shape (n,), rad.
        limited: as in `clip_targets`, as are the four that follow.
        by: see there.
        at: see there.
        low: see there.
        high: see there.
    """
    for k in range(setpoint.size):
        if k != limited and k != by:
            setpoint[k] += min(max(target[k] - setpoint[k], -stride[k]), stride[k])
    if limited < 0:
        if by >= 0:
            setpoint[by] += min(max(target[by] - setpoint[by], -stride[by]), stride[by])
        return
    first, last = min(sensed[by], setpoint[by]), max(sensed[by], setpoint[by])
    goal = target[limited]
    way_from, way_to = min(first, target[by]), max(last, target[by])
    least = _highest_lower(way_from, way_to, at, low) + CLEARANCE
    most = _lowest_upper(way_from, way_to, at, high) - CLEARANCE
    goal = min(max(goal, least), most)
    bottom = top = setpoint[limited]
    if abs(sensed[limited] - setpoint[limited]) > CLEARANCE:
        bottom, top = min(bottom, sensed[limited]), max(top, sensed[limited])
    setpoint[limited] += min(max(goal - setpoint[limited], -stride[limited]), stride[limited])
    move = min(max(target[by] - setpoint[by], -stride[by]), stride[by])
    share, step = 0.0, 1.0
    for _ in range(12):
        end = setpoint[by] + (share + step) * move
        a, b = min(first, end), max(last, end)
        if _lowest_upper(a, b, at, high) >= top and _highest_lower(a, b, at, low) <= bottom:
            share += step
            if share >= 1.0:
                break
        step *= 0.5
    setpoint[by] += min(share, 1.0) * move


@jit
def aim(
    arm: Floats,
    head: Floats,
    target: Floats,
    setpoint: Floats,
    sensed: Floats,
    stride: Floats,
    lower: Floats,
    upper: Floats,
    limited: int,
    by: int,
    at: Floats,
    low: Floats,
    high: Floats,
) -> bool:
    """Clip targets to all limits, and move the set-points towards them for one frame.

    Args:
        arm: targets of the arm, shape (n_arm,), rad.
        head: targets of the head, shape (n_head,), rad.
        target: clipped targets of both, shape (n,), rad. They are overwritten.
        setpoint: as in `advance_setpoints`, as are the two that follow. It is overwritten.
        sensed: see there.
        stride: see there.
        lower: as in `clip_targets`, as are the six that follow.
        upper: see there.
        limited: see there.
        by: see there.
        at: see there.
        low: see there.
        high: see there.

    Returns:
        Whether all targets are finite. If one is not, nothing changes.
    """
    if not (np.isfinite(arm).all() and np.isfinite(head).all()):
        return False
    target[: arm.size], target[arm.size :] = arm, head
    clip_targets(target, lower, upper, limited, by, at, low, high)
    advance_setpoints(setpoint, sensed, target, stride, limited, by, at, low, high)
    return True


@jit
def hold_inside(
    qpos: Floats,
    qvel: Floats,
    places: Ints,
    dofs: Ints,
    lower: Floats,
    upper: Floats,
    velocity: Floats,
    duration: float,
) -> None:
    """Move joints back in place that one physics step has taken beyond their position or velocity limits.

    The ends of a joint are stops without bounce, and its gear turns no faster than its limit, even if a saturated servo
    or a neighbouring joint shakes it. This removes motion, and never adds any.

    Args:
        qpos: generalised positions. They are overwritten.
        qvel: generalised velocities. They are overwritten.
        places: indices of the n joints in `qpos`.
        dofs: indices of the n joints in `qvel`.
        lower: lower position limits, shape (n,).
        upper: upper position limits, shape (n,).
        velocity: velocity limits, shape (n,).
        duration: length of the physics step, s.
    """
    for k in range(places.size):
        q, v = places[k], dofs[k]
        excess = qvel[v] - min(max(qvel[v], -velocity[k]), velocity[k])
        qvel[v] -= excess
        qpos[q] -= duration * excess
        if qpos[q] < lower[k]:
            qpos[q], qvel[v] = lower[k], max(qvel[v], 0.0)
        elif qpos[q] > upper[k]:
            qpos[q], qvel[v] = upper[k], min(qvel[v], 0.0)
