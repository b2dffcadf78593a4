"""Checks that the arm carries the marker, that the head carries the camera, and that neither carries both."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco

from somatopy.bodies.anatomy import Anatomy
from somatopy.bodies.base import BodyError

__all__ = ["check_chains"]


def check_chains(spec: mujoco.MjSpec, anatomy: Anatomy) -> None:
    """Check that the arm moves only the marker, and that the head moves only the camera.

    The ceiling asks, for an arm posture, from which head postures the hand can be seen. This question has an answer
    only if the head does not move the hand, and the arm does not move the camera.

    Raises:
        BodyError: a chain moves the wrong one, both, or neither.
    """
    marker, camera = spec.body(anatomy.marker.body), spec.camera(anatomy.camera.name).parent
    of_marker, of_camera = _joints_above(marker), _joints_above(camera)
    arm, head = anatomy.arm.joints, anatomy.head.joints
    carried = f"The marker's body {marker.name!r}", f"The camera {anatomy.camera.name!r}, on the body {camera.name!r},"
    if not set(arm) & set(of_marker):
        raise BodyError(
            f"{carried[0]} moves with none of the arm's joints {list(arm)}. Name a body that the arm carries as "
            f"[marker] body, or its joints as [arm] joints; {_moves(of_marker)}."
        )
    if not set(head) & set(of_camera):
        raise BodyError(
            f"{carried[1]} moves with none of the head's joints {list(head)}. Name a camera that the head carries as "
            f"[camera] name, or its joints as [head] joints; {_moves(of_camera)}. Where nothing does, put a neck with "
            "a camera on the robot: [add.neck] and [add.camera]."
        )
    _refuse(carried[0], of_marker, "head", head, "arm")
    _refuse(carried[1], of_camera, "arm", arm, "head")


def _refuse(what: str, above: Sequence[str], part: str, joints: Sequence[str], other: str) -> None:
    both = [name for name in joints if name in above]
    if both:
        raise BodyError(
            f"{what} moves with the {part}'s joints {both}, but only the {other} may move it: head and arm must part "
            f"where they begin. Leave these joints out of [{part}] joints."
        )


def _moves(above: Sequence[str]) -> str:
    return f"it moves with {', '.join(above)}" if above else "no joint moves it"


def _joints_above(body: Any) -> list[str]:
    """Names of the joints that move a body, the nearest last."""
    if body.name == "world":
        return []
    return [*_joints_above(body.parent), *(joint.name or "an unnamed joint" for joint in body.joints)]
