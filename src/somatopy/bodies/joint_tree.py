"""The tree of a model's moving bodies: which joints move a body, and where the tree branches."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

__all__ = ["HINGE", "SLIDE", "carrier", "joints_above", "moved_by", "one_dof_tail", "rigid_with", "segments"]

HINGE, SLIDE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)


def own_joints(model: mujoco.MjModel, body: int) -> range:
    first = int(model.body_jntadr[body])
    return range(first, first + int(model.body_jntnum[body])) if first >= 0 else range(0)


def carrier(model: mujoco.MjModel, joint: int) -> str:
    """Name of the body that a joint moves."""
    return str(model.body(model.jnt_bodyid[joint]).name)


def path_to(model: mujoco.MjModel, body: int) -> list[int]:
    """Bodies on the way from the world to this one, without the world, this one last."""
    path: list[int] = []
    while body:
        path.append(body)
        body = int(model.body_parentid[body])
    return path[::-1]


def joints_above(model: mujoco.MjModel, body: int) -> list[int]:
    """All joints that move a body, the one nearest to the world first."""
    return [joint for above in path_to(model, body) for joint in own_joints(model, above)]


def moving_children(model: mujoco.MjModel) -> list[list[int]]:
    """For each body, those of its children that have a joint, or carry a body that has one."""
    has = np.array([model.body_jntnum[b] > 0 for b in range(model.nbody)])
    children: list[list[int]] = [[] for _ in has]
    for body in range(model.nbody - 1, 0, -1):
        if has[body]:
            parent = int(model.body_parentid[body])
            has[parent] = True
            children[parent].insert(0, body)
    return children


def segments(model: mujoco.MjModel) -> Iterator[list[int]]:
    """The chains of joints between places where the tree of moving bodies branches."""
    children = moving_children(model)
    open_ends = [(child, [*own_joints(model, child)]) for child in children[0]]
    while open_ends:
        body, joints = open_ends.pop(0)
        while len(children[body]) == 1:
            body = children[body][0]
            joints = [*joints, *own_joints(model, body)]
        yield joints
        open_ends += [(child, [*own_joints(model, child)]) for child in children[body]]


def one_dof_tail(model: mujoco.MjModel, joints: list[int]) -> list[int]:
    """The hinges and slides at the end of a chain, after its last ball or free joint."""
    tail: list[int] = []
    for joint in reversed(joints):
        if model.jnt_type[joint] not in (HINGE, SLIDE):
            break
        tail.insert(0, joint)
    return tail


def rigid_with(model: mujoco.MjModel, body: int) -> list[int]:
    """A body and all that are fixed to it without a joint, in the model's order."""
    return [b for b in range(body, model.nbody) if model.body_weldid[b] == model.body_weldid[body]]


def moved_by(model: mujoco.MjModel, body: int) -> tuple[str, ...]:
    """Names of all joints between the world and a body."""
    return tuple(model.joint(j).name for j in joints_above(model, body))
