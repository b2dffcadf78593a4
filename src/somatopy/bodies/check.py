"""The laws of bodies, tried on any implementation."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy

import numpy as np

from somatopy.bodies.base import Body
from somatopy.contract import check_state, law, missing, refused, same
from somatopy.percept import Camera, Floats, JointGroup, Marker, Reading

__all__ = ["check_body"]

Make = Callable[[], Body]

_FRAMES = 80
#: What a joint may lie beyond a limit, rad: rounding only.
_ROUNDING = 1e-6


def check_body(make: Make, *, pictures: bool = True) -> None:
    """Check that a body keeps its contract.

    Args:
        make: a fresh body, as it is before `reset`.
        pictures: whether to look at the camera's pictures too; they may need OpenGL.

    Raises:
        ContractError: it breaks a law; the message says which, what was seen and how to fix it.

    Example:
        >>> from somatopy.bodies import MujocoBody
        >>> check_body(lambda: MujocoBody("nao", motion="kinematic"), pictures=False)
    """
    body, twin = make(), make()
    try:
        _describes_itself(body)
        _resets_alike(body, twin)
        _keeps_limits_and_time(body)
        _moves_towards_targets(body)
        _steps_alike(body, twin)
        _refuses_wrong_targets(body)
        _senses_soundly(body, pictures)
        check_state(lambda seed: _started(make()), _play)
    finally:
        with law("close can be called twice, and joints be read after it", "do nothing in a second close()"):
            for each in (body, twin, body):
                each.close()
            _describes_itself(body)


def _describes_itself(body: Body) -> None:
    with law(
        "arm, head, camera and marker are readable without a connection, before reset and after close",
        "set them in __init__ as JointGroup, Camera and Marker",
    ) as holds:
        holds(not missing(body, Body), "{} lacks {}", type(body).__name__, missing(body, Body))
        holds(isinstance(body.camera, Camera) and isinstance(body.marker, Marker), "{}, {}", body.camera, body.marker)
        for group in (body.arm, body.head):
            holds(isinstance(group, JointGroup) and len(set(group.names)) == len(group) > 0, "the joints {}", group)
            shapes = {values.shape for values in (group.lower, group.upper, group.velocity)}
            holds(shapes == {(len(group),)}, "limits of shapes {} for {} joints", shapes, len(group))
            holds((group.lower < group.upper).all() and (group.velocity > 0).all(), "the limits {}", group)


def _commands(body: Body, frames: int = _FRAMES) -> list[tuple[Floats, Floats]]:
    """Targets of arm and head inside the limits and up to a range outside, each held for 8 frames."""
    rng = np.random.default_rng(0)
    targets = [
        tuple(rng.uniform(2 * g.lower - g.upper, 2 * g.upper - g.lower) for g in (body.arm, body.head))
        for _ in range(-(-frames // 8))
    ]
    return [(arm.copy(), head.copy()) for arm, head in targets for _ in range(8)][:frames]


def _senses(reading: Reading) -> dict[str, object]:
    """All of a reading but its picture, copied."""
    view = {} if reading.view is None else vars(reading.view)
    return deepcopy({name: value for name, value in vars(reading).items() if name not in ("image", "view")} | view)


def _started(body: Body) -> Body:
    body.reset(0)
    return body


def _play(body: Body, first: int, last: int) -> object:
    return [_senses(body.step(arm, head)) for arm, head in _commands(body)[first:last]]


def _resets_alike(body: Body, twin: Body) -> None:
    with law(
        "reset with one seed goes to one start at time 0, whatever was before", "set all that steps change"
    ) as holds:
        first = _senses(body.reset(7))
        holds(first["time"] == 0, "the time {}", first["time"])
        _play(body, 0, 20)
        again, other = _senses(body.reset(7)), _senses(twin.reset(7))
        holds(same(again, first), "{} at first, then {}", first, again)
        holds(same(other, first), "{}, and {} of a second body", first, other)


def _steps_alike(body: Body, twin: Body) -> None:
    with law(
        "equal commands after equal resets give equal readings", "carry nothing over reset, and seed what is random"
    ) as holds:
        body.reset(3), twin.reset(3)
        for k, (arm, head) in enumerate(_commands(body)):
            a, b = _senses(body.step(arm, head)), _senses(twin.step(arm, head))
            holds(same(a, b), "in frame {}: {} and {}", k, a, b)


def _keeps_limits_and_time(body: Body) -> None:
    before = body.reset(0)
    for arm, head in _commands(body, 160):
        with law("a body moves for one frame in each step: time advances by dt", "measure dt, and add it up") as holds:
            after = body.step(arm, head)
            advance = after.time - before.time
            holds(after.dt > 0 and abs(advance - after.dt) < 1e-6, "{} s with dt = {} s", advance, after.dt)
        for part, group in (("arm", body.arm), ("head", body.head)):
            was, now = getattr(before, part), getattr(after, part)
            target, command = {"arm": arm, "head": head}[part], getattr(after, f"{part}_command")
            with law("no command takes a joint beyond its limits", "clip targets to lower and upper first") as holds:
                for name, values in (("posture", now), ("command after clipping", command)):
                    low, high = group.lower - _ROUNDING, group.upper + _ROUNDING
                    holds(values.shape == (len(group),), "the {}'s {} of shape {}", part, name, values.shape)
                    holds((low <= values).all() and (values <= high).all(), "the {}'s {} {}", part, name, values)
            with law("no joint moves faster than its velocity limit", "move by at most velocity x dt a step") as holds:
                speed = np.abs(now - was) / after.dt
                holds((speed <= group.velocity * (1 + _ROUNDING)).all(), "the {}'s speeds {} rad/s", part, speed)
            with law(
                "arm_command is the clipped arm target, the movement's end", "report it from the first step"
            ) as holds:
                clipped = np.clip(target, group.lower, group.upper)
                holds(part == "head" or np.allclose(command, clipped, atol=_ROUNDING), "{} for {}", command, target)
        before = after


def _moves_towards_targets(body: Body) -> None:
    with law("joints move towards their targets", "mind the order of the joints and the sign of their axes") as holds:
        start = body.reset(0)
        for part, group in (("arm", body.arm), ("head", body.head)):
            middle, here = 0.5 * (group.lower + group.upper), getattr(start, part)
            goal = here + 0.25 * np.where(here < middle, 1, -1) * (group.upper - group.lower)
            targets = {"arm": start.arm, "head": start.head} | {part: goal}
            reading = body.reset(0)
            for _ in range(60):
                reading = body.step(**targets)
            left = np.abs(goal - getattr(reading, part)) / np.abs(goal - here)
            holds(
                (left < 0.5).all(), "the {} from {} to {}: {} of the way left after 60 frames", part, here, goal, left
            )


def _refuses_wrong_targets(body: Body) -> None:
    start = body.reset(0)
    with law(
        "targets of wrong length or not finite are refused before anything moves",
        "check both targets first of all in step, and raise a ValueError that names the joints",
    ) as holds:
        before = deepcopy(body.state())
        for part in ("arm", "head"):
            good = {"arm": start.arm.copy(), "head": start.head.copy()}
            for wrong in (good[part][:-1], np.append(good[part], 0.0), good[part] * np.nan, good[part] + np.inf):
                targets = good | {part: wrong}
                holds(refused(lambda t=targets: body.step(**t)), "step took the {} target {}", part, wrong)
                holds(same(body.state(), before), "the {} target {} was refused too late", part, wrong)


def _senses_soundly(body: Body, pictures: bool) -> None:
    with law("a reading is the caller's, and stays as it was", "copy what goes into a reading, and targets") as holds:
        first = body.reset(0)
        senses, targets = _senses(first), _commands(body)
        for arm, head in targets:
            reading = body.step(arm, head)
            arm[:], head[:] = np.nan, np.nan
        holds(same(_senses(first), senses), "a later step changed it")
        state = deepcopy(body.state())
        for name in ("arm", "head", "arm_command", "head_command"):
            if getattr(reading, name).flags.writeable:
                getattr(reading, name)[:] = np.nan
        holds(same(body.state(), state), "changing it changed the body")
    reading = body.reset(0)
    if reading.view is not None:
        _knows_poses(reading)
    if pictures and reading.image is not None:
        _takes_pictures(body, reading)


def _knows_poses(reading: Reading) -> None:
    with law("a view holds positions and rotation matrices, row by row", "see View; transpose nothing") as holds:
        assert reading.view is not None
        view = reading.view
        holds(view.camera.shape == view.marker.shape == (12,), "{} and {}", view.camera.shape, view.marker.shape)
        holds(view.occluders.ndim == 2 and view.occluders.shape[1] == 12, "occluders {}", view.occluders.shape)
        for pose in (view.camera, view.marker, *view.occluders):
            turn = pose[3:].reshape(3, 3)
            proper = np.allclose(turn @ turn.T, np.eye(3), atol=1e-6) and np.linalg.det(turn) > 0
            holds(np.isfinite(pose).all() and proper, "the pose {}", pose)


def _takes_pictures(body: Body, reading: Reading) -> None:
    with law(
        "image() is the camera's picture, (height, width, 3) uint8, the same when asked again",
        "draw in the camera's size, and once a reading",
    ) as holds:
        assert reading.image is not None
        picture = reading.image()
        expected = body.camera.height, body.camera.width, 3
        holds(picture.shape == expected and picture.dtype == np.uint8, "{} {}", picture.shape, picture.dtype)
        holds(same(picture, reading.image()), "another picture the second time")
