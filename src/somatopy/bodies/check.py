"""A check that any body keeps its contract."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from copy import deepcopy
from functools import partial
from typing import Any, cast

import numpy as np

from somatopy.bodies.check_twin import check_twin
from somatopy.contract import Body, Resumable, Twin, check_members, check_state, facts, law, refused, same
from somatopy.percept import Camera, Floats, JointGroup, Marker, View

__all__ = ["check_body"]

#: What a joint may be beyond a limit: rounding only.
_ROUNDING = 1e-6


def check_body(
    make: Callable[[], Body], *, pictures: bool = True, injure: Callable[[Any], object] | None = None
) -> None:
    """Check that a body keeps the contract `Body`, and that of each capability it has, such as `Twin`.

    Args:
        make: function that makes a new body. `reset` has not been called on it.
        pictures: whether to check the camera's pictures, too. Many bodies need OpenGL for them.
        injure: function that changes the body it is given, as a damage does. With None, this check is left out.

    Raises:
        ContractError: the body breaks a law. The message says which law, what was seen, and how to mend it.

    Example:
        >>> from somatopy.bodies import MujocoBody
        >>> check_body(lambda: MujocoBody("nao", motion="kinematic"), pictures=False)
    """
    bodies: list[Body] = []

    def start(seed: int = 0) -> Body:
        bodies.append(make())
        _describes_itself(bodies[-1])
        bodies[-1].reset(seed)
        return bodies[-1]

    try:
        _shares_no_arrays(start())
        _keeps_limits_and_time(start())
        _resets_alike(start(), start())
        _moves_towards_targets(start(), "arm")
        _moves_towards_targets(start(), "head")
        _refuses_wrong_targets(start())
        _senses_soundly(start(), pictures)
        if isinstance(bodies[0], Resumable):
            check_state(cast("Callable[[int], Any]", start), _play)
        if isinstance(bodies[0], Twin):
            check_twin(cast("Callable[[int], Any]", start), injure)
        for body in bodies:
            _closes(body)
    finally:
        for body in bodies:
            with suppress(Exception):
                body.close()


def _describes_itself(body: Body) -> None:
    check_members(body, Body)
    with law(
        "arm, head, camera and marker are readable before reset and after close",
        "set them in __init__ as JointGroup, Camera and Marker, with arrays (n,)",
    ) as holds:
        holds(isinstance(body.camera, Camera) and isinstance(body.marker, Marker), "{}, {}", body.camera, body.marker)
        for group in (body.arm, body.head):
            holds(isinstance(group, JointGroup) and len(set(group.names)) == len(group) > 0, "the joints {}", group)
            shapes = {values.shape for values in (group.lower, group.upper, group.velocity)}
            holds(shapes == {(len(group),)}, "limits of shapes {} for {} joints", shapes, len(group))
            holds((group.lower < group.upper).all() and (group.velocity > 0).all(), "the limits {}", group)


def _closes(body: Body) -> None:
    with law("close can be called twice", "do nothing in a second close()"):
        body.close()
        body.close()
    _describes_itself(body)


def _commands(body: Body, frames: int = 80) -> list[tuple[Floats, Floats]]:
    """Targets of arm and head inside the limits and up to a range outside, each held for 8 frames."""
    rng, found = np.random.default_rng(0), []
    for _ in range(0, frames, 8):
        arm, head = (rng.uniform(2 * g.lower - g.upper, 2 * g.upper - g.lower) for g in (body.arm, body.head))
        found += [(arm.copy(), head.copy()) for _ in range(8)]
    return found


def _play(body: Body, first: int, last: int) -> object:
    return [facts(body.step(arm, head)) for arm, head in _commands(body)[first:last]]


def _resets_alike(body: Body, twin: Body) -> None:
    with law("one seed, one start at time 0, whatever was before", "set in reset all that steps change") as holds:
        first = facts(body.reset(7))
        holds(first["time"] == 0, "the time {}", first["time"])
        _play(body, 0, 20)
        for name, again in (("again", facts(body.reset(7))), ("in another body", facts(twin.reset(7)))):
            holds(same(again, first), "{}, and {} {}", first, name, again)


def _keeps_limits_and_time(body: Body) -> None:
    before = body.reset(0)
    for arm, head in _commands(body, 160):
        with law("each step lasts one frame: dt > 0, and time advances by it", "measure dt, and add it up") as holds:
            after = body.step(arm, head)
            advance = after.time - before.time
            holds(after.dt > 0 and abs(advance - after.dt) < _ROUNDING, "{} s with dt = {} s", advance, after.dt)
        with law("arm_command is the arm's target, clipped, from the first step on", "keep no ramp in it") as holds:
            clipped = np.clip(arm, body.arm.lower, body.arm.upper)
            holds(np.allclose(after.arm_command, clipped, atol=_ROUNDING), "{} for {}", after.arm_command, arm)
        _is_inside(body.arm, after.dt, before.arm, after.arm, after.arm_command)
        _is_inside(body.head, after.dt, before.head, after.head, after.head_command)
        before = after


def _is_inside(group: JointGroup, dt: float, before: Floats, after: Floats, command: Floats) -> None:
    with law("no command takes a joint beyond its limits", "clip targets to lower and upper first") as holds:
        for name, values in (("posture", after), ("command", command)):
            holds(values.shape == (len(group),), "a {} of shape {} for {}", name, values.shape, group.names)
            inside = (group.lower - _ROUNDING <= values) & (values <= group.upper + _ROUNDING)
            holds(inside.all(), "the {} {} of {}", name, values, group.names)
    with law("no joint moves faster than its velocity limit", "move by at most velocity x dt in a step") as holds:
        speed = np.abs(after - before) / dt
        holds((speed <= group.velocity * (1 + _ROUNDING)).all(), "{} rad/s of {}", speed, group.names)


def _moves_towards_targets(body: Body, part: str) -> None:
    reading, group = body.reset(0), getattr(body, part)
    here, middle = getattr(reading, part), 0.5 * (group.lower + group.upper)
    goal = here + 0.25 * np.where(here < middle, 1, -1) * (group.upper - group.lower)
    with law("joints move towards their targets", "mind the order of the joints, and the signs of their axes") as holds:
        targets = {"arm": reading.arm, "head": reading.head} | {part: goal}
        for _ in range(60):
            reading = body.step(**targets)
        left = np.abs(goal - getattr(reading, part)) / np.abs(goal - here)
        holds((left < 0.5).all(), "after 60 frames {} of the way is left to {}, of {}", left, goal, group.names)


def _state(body: Body) -> object:
    """All that a body holds, or nothing where it cannot tell."""
    return deepcopy(body.state()) if isinstance(body, Resumable) else None


def _refuses_wrong_targets(body: Body) -> None:
    start = body.reset(0)
    before = _state(body)
    with law(
        "targets of wrong length or not finite are refused before anything moves",
        "check both targets first of all in step, and raise a ValueError that names the joints",
    ) as holds:
        for part, good in (("arm", start.arm), ("head", start.head)):
            for wrong in (good[:-1], np.append(good, 0.0), good * np.nan, good + np.inf):
                targets = {"arm": start.arm, "head": start.head} | {part: wrong}
                holds(refused(partial(body.step, **targets)), "step took the {} target {}", part, wrong)
                holds(same(_state(body), before), "the {} target {} was refused too late", part, wrong)


def _shares_no_arrays(body: Body) -> None:
    with law("readings and targets stay the caller's", "copy arrays, those you take and those you give") as holds:
        first = reading = body.reset(0)
        senses = facts(first)
        for arm, head in _commands(body):
            reading = body.step(arm, head)
        holds(same(facts(first), senses), "a later step changed a reading")
        state = _state(body)
        for array in (arm, head, reading.arm, reading.head, reading.arm_command, reading.head_command):
            if array.flags.writeable:
                array[:] = np.nan
        holds(same(_state(body), state), "changing a target or a reading changed the body")


def _senses_soundly(body: Body, pictures: bool) -> None:
    reading = body.reset(0)
    with law("a view holds positions and rotation matrices, row by row", "see View; transpose nothing") as holds:
        for pose in _poses(reading.view):
            turn = pose[3:].reshape(3, 3)
            proper = np.allclose(turn @ turn.T, np.eye(3), atol=_ROUNDING) and np.linalg.det(turn) > 0
            holds(proper and np.isfinite(pose).all(), "the pose {}", pose)
    if not pictures or reading.image is None:
        return
    with law("image() is the picture, (height, width, 3) uint8, whenever it is asked", "draw it once") as holds:
        picture, expected = reading.image(), (body.camera.height, body.camera.width, 3)
        holds(picture.shape == expected and picture.dtype == np.uint8, "{} {}", picture.shape, picture.dtype)
        holds(same(picture, reading.image()), "another picture the second time")


def _poses(view: View | None) -> list[Floats]:
    return [] if view is None else [view.camera, view.marker, *view.occluders]
