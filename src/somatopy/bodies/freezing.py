"""Removes joints from a model. Their bodies stay where a posture puts them, and nothing refers to the joints."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from somatopy.bodies.plain import PLAIN
from somatopy.percept import Floats

__all__ = ["Pose", "forget", "freeze", "name_tendons", "stand"]

_FREE, _BALL, _SLIDE = (int(kind) for kind in (mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_BALL, 2))
_EQUAL, _OBJECT, _TRANSMISSION = mujoco.mjtEq, mujoco.mjtObj, mujoco.mjtTrn


class Pose(NamedTuple):
    """A position and a rotation: they take coordinates in a body's frame to its parent's frame."""

    place: Floats
    turn: Floats

    def then(self, other: Pose) -> Pose:
        """The pose of a frame that has the pose `other` in the frame of this pose."""
        place, turn = np.empty(3), np.empty(4)
        mujoco.mju_mulPose(place, turn, self.place, self.turn, other.place, other.turn)
        return Pose(place, turn)

    def inverse(self) -> Pose:
        """The pose that undoes this one."""
        place, turn = np.empty(3), np.empty(4)
        mujoco.mju_negPose(place, turn, self.place, self.turn)
        return Pose(place, turn)

    def point(self, point: Floats) -> Floats:
        """A point, shape (3,), m, in the outer frame."""
        return self.place + self.direction(point)

    def direction(self, direction: Floats) -> Floats:
        """A direction, shape (3,), in the outer frame."""
        turned = np.empty(3)
        mujoco.mju_rotVecQuat(turned, direction, self.turn)
        return turned


def freeze(
    spec: mujoco.MjSpec,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    joints: Collection[str],
    driven: Collection[str] = (),
) -> mujoco.MjModel:
    """Remove joints from a spec, and leave their bodies where they are in `data`.

    Everything that refers to these joints is removed, too: tendons over them, and their actuators, sensors, equalities
    and tuples. A joint that an equality ties to a removed one is held where it is, unless a servo drives it. Bodies
    that could not touch each other before still cannot.

    Args:
        spec: the spec. All its bodies, joints, geoms and actuators must have names.
        model: the compiled spec.
        data: the posture in which the bodies stay. Its kinematics must be up to date.
        joints: names of the joints to remove.
        driven: names of joints that servos move.

    Returns:
        The compiled model without these joints.
    """
    if not joints:
        return model
    name_tendons(spec)
    _hold_constraints(spec, model, data, joints, driven)
    for body in {spec.joint(name).parent.name for name in joints}:
        _bake(spec.body(body), model, data, joints)
    gone = {("joint", name) for name in joints} | {("tendon", t.name) for t in _tendons_over(spec, joints)}
    gone |= {("actuator", actuator.name) for actuator in spec.actuators if _drives(actuator) in gone}
    forget(spec, gone)
    after = spec.copy().compile()  # see `loading.compiled`
    _keep_apart(spec, model, after)
    return after


def name_tendons(spec: mujoco.MjSpec) -> None:
    """Give names to the tendons that have none."""
    for k, tendon in enumerate(spec.tendons):
        tendon.name = tendon.name or f"somatopy_tendon_{k}"


def forget(spec: mujoco.MjSpec, gone: set[tuple[str, str]]) -> None:
    """Delete joints, tendons and actuators, given as pairs of kind and name, and everything that refers to them."""
    for kind, things in (("tendon", spec.tendons), ("actuator", spec.actuators), ("joint", spec.joints)):
        named = [thing for thing in things if (kind, thing.name) in gone]
        if kind == "joint":
            _forget_references(spec, gone)
        for thing in named:
            spec.delete(thing)


def _forget_references(spec: mujoco.MjSpec, gone: set[tuple[str, str]]) -> None:
    kinds = {_OBJECT.mjOBJ_JOINT: "joint", _OBJECT.mjOBJ_TENDON: "tendon", _OBJECT.mjOBJ_ACTUATOR: "actuator"}
    for sensor in list(spec.sensors):
        ends = (sensor.objtype, sensor.objname), (sensor.reftype, sensor.refname)
        if any((kinds.get(kind), name) in gone for kind, name in ends):
            spec.delete(sensor)
    for thing in list(spec.tuples):
        if any(
            (kinds.get(_OBJECT(kind)), name) in gone for kind, name in zip(thing.objtype, thing.objname, strict=True)
        ):
            spec.delete(thing)
    ties = {_EQUAL.mjEQ_JOINT: "joint", _EQUAL.mjEQ_TENDON: "tendon"}
    for equality in list(spec.equalities):
        if {(ties.get(equality.type), name) for name in (equality.name1, equality.name2)} & gone:
            spec.delete(equality)


def stand(body: Any, pose: Pose) -> None:
    """Set the pose of a spec's body in its parent's frame."""
    if body.frame is not None:
        body.set_frame(body.parent.add_frame())
    body.pos, body.quat, body.alt.type = pose.place, pose.turn, mujoco.mjtOrientation.mjORIENTATION_QUAT


def _bake(body: Any, model: mujoco.MjModel, data: mujoco.MjData, joints: Collection[str]) -> None:
    """A joint acts in the frame that those before it have moved: what stays before one that goes moves along."""
    whole = model.body(body.name)
    pose, before = Pose(whole.pos, whole.quat), dict[str, Pose]()
    for joint in range(whole.jntadr[0], whole.jntadr[0] + whole.jntnum[0]):
        name = model.joint(joint).name
        if name not in joints:
            before[name] = Pose(np.zeros(3), np.array([1.0, 0, 0, 0]))
            continue
        motion = _motion(model, data, joint)
        pose = motion if model.jnt_type[joint] == _FREE else pose.then(motion)
        before = {kept: motion.inverse().then(moved) for kept, moved in before.items()}
    stand(body, pose)
    for joint in body.joints:
        if joint.name in before and not _is_still(before[joint.name]):
            if joint.frame is not None:
                joint.set_frame(body.add_frame())
            moved, whole = before[joint.name], model.joint(joint.name)
            joint.pos, joint.axis = moved.point(whole.pos), moved.direction(whole.axis)


def _is_still(pose: Pose) -> bool:
    return not pose.place.any() and not pose.turn[1:].any()


def _motion(model: mujoco.MjModel, data: mujoco.MjData, joint: int) -> Pose:
    """What a joint does to its body's frame where it is."""
    at, kind, turn = model.jnt_qposadr[joint], model.jnt_type[joint], np.empty(4)
    anchor, axis = model.jnt_pos[joint], model.jnt_axis[joint]
    if kind == _FREE:
        return Pose(data.qpos[at : at + 3].copy(), data.qpos[at + 3 : at + 7].copy())
    if kind == _SLIDE:
        return Pose(axis * (data.qpos[at] - model.qpos0[at]), np.array([1.0, 0, 0, 0]))
    if kind == _BALL:
        turn[:] = data.qpos[at : at + 4]
    else:
        mujoco.mju_axisAngle2Quat(turn, axis, data.qpos[at] - model.qpos0[at])
    return Pose(anchor - Pose(np.zeros(3), turn).direction(anchor), turn)


def _tendons_over(spec: mujoco.MjSpec, joints: Collection[str]) -> list[Any]:
    """Tendons whose length is a sum of joint positions, some of these among them."""
    wraps = ((tendon, wrap) for tendon in spec.tendons for wrap in tendon.path)
    over = {t.id: t for t, wrap in wraps if wrap.type == mujoco.mjtWrap.mjWRAP_JOINT and wrap.target.name in joints}
    return list(over.values())


def _drives(actuator: Any) -> tuple[str, str]:
    by_joint = _TRANSMISSION.mjTRN_JOINT, _TRANSMISSION.mjTRN_JOINTINPARENT
    kind = "joint" if actuator.trntype in by_joint else "tendon"
    return (kind if actuator.trntype in (*by_joint, _TRANSMISSION.mjTRN_TENDON) else "other"), actuator.target


def _hold_constraints(
    spec: mujoco.MjSpec,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    joints: Collection[str],
    driven: Collection[str],
) -> None:
    """Say outright what MuJoCo would otherwise measure in a reference posture that is about to change."""
    for k, tendon in enumerate(spec.tendons):
        tendon.springlength = model.tendon_lengthspring[k]
    for k, equality in enumerate(list(spec.equalities)):
        if equality.type == _EQUAL.mjEQ_JOINT:
            _hold_tied(model, data, equality, joints, driven)
        elif equality.objtype == _OBJECT.mjOBJ_BODY and equality.type == _EQUAL.mjEQ_WELD:
            equality.data = model.eq_data[k]
        elif equality.objtype == _OBJECT.mjOBJ_BODY and equality.type == _EQUAL.mjEQ_CONNECT:
            _connect_at_sites(spec, equality, model.eq_data[k], k)


def _hold_tied(
    model: mujoco.MjModel, data: mujoco.MjData, equality: Any, joints: Collection[str], driven: Collection[str]
) -> None:
    tied = [name for name in (equality.name1, equality.name2) if name]
    staying = [name for name in tied if name not in joints]
    if len(tied) == 2 and len(staying) == 1 and staying[0] not in driven:
        at = model.joint(staying[0]).qposadr[0]
        equality.name1, equality.name2 = staying[0], ""
        equality.data = [data.qpos[at] - model.qpos0[at], *np.zeros(len(equality.data) - 1)]


def _connect_at_sites(spec: mujoco.MjSpec, equality: Any, anchors: Floats, number: int) -> None:
    bodies = equality.name1, equality.name2 or "world"
    sites = [f"somatopy_anchor_{number}_{end}" for end in range(2)]
    for body, site, anchor in zip(bodies, sites, (anchors[:3], anchors[3:6]), strict=True):
        spec.body(body).add_site(PLAIN, name=site, pos=anchor, group=5)
    equality.objtype, (equality.name1, equality.name2) = _OBJECT.mjOBJ_SITE, sites


def _keep_apart(spec: mujoco.MjSpec, before: mujoco.MjModel, after: mujoco.MjModel) -> None:
    """Bodies that a joint joined do not touch, but those that the room and a joint join do: exclude what was."""
    now_static = _untouching(before) & ~_untouching(after)
    for first, second in np.argwhere(np.triu(now_static)):
        if before.body_geomnum[first] and before.body_geomnum[second]:
            names = before.body(first).name, before.body(second).name
            spec.add_exclude(bodyname1=names[0], bodyname2=names[1])
    for k, equality in enumerate(list(spec.equalities)):
        if equality.type in (_EQUAL.mjEQ_CONNECT, _EQUAL.mjEQ_WELD) and _is_rigid(after, k):
            spec.delete(equality)


def _untouching(model: mujoco.MjModel) -> NDArray[np.bool_]:
    """Which bodies are rigidly joined, or neighbours of which neither stands still, shape (nbody, nbody)."""
    rigid = model.body_weldid
    carrier = rigid[model.body_parentid[rigid]]
    apart = rigid[:, None] == rigid
    if not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_FILTERPARENT:
        neighbours = (carrier[:, None] == rigid) & (rigid[:, None] != 0) & (rigid != 0)
        apart |= neighbours | neighbours.T
    return np.asarray(apart)


def _is_rigid(model: mujoco.MjModel, equality: int) -> bool:
    """Whether what an equality holds together cannot move apart."""
    ends: Iterable[int] = (model.eq_obj1id[equality], model.eq_obj2id[equality])
    if model.eq_objtype[equality] == int(_OBJECT.mjOBJ_SITE):
        ends = (model.site_bodyid[end] for end in ends)
    first, second = ends
    moving = model.body_mocapid[[first, second]] >= 0
    return bool(model.body_weldid[first] == model.body_weldid[second]) and not moving.any()
