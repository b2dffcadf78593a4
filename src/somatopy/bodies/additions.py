"""Adds to a model what its anatomy asks for: a fixed base, frozen joints, a neck, a camera, limits, servos."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import mujoco
import numpy as np

from somatopy.bodies.anatomy import Anatomy
from somatopy.bodies.base import BodyError
from somatopy.bodies.freezing import Pose, forget, freeze, name_tendons, stand
from somatopy.bodies.loading import available, compiled, require
from somatopy.bodies.parts import name_all
from somatopy.bodies.plain import PLAIN
from somatopy.bodies.tables import Directed, Neck, Servo
from somatopy.percept import Floats

__all__ = ["HOME", "add"]

HOME = "somatopy_home"
NECK = "somatopy_neck"
_FREE, _BALL = mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_BALL
_AXES = {"pan": (0, 0, 1), "tilt": (0, 1, 0), "roll": (1, 0, 0)}  # a neck looks along x, and up is z
_TIES = mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD
_EXPLICIT = mujoco.mjtIntegrator.mjINT_EULER, mujoco.mjtIntegrator.mjINT_RK4

#: The neck's own: about 10 Hz and critically damped, with an inertia of .0011 kg m^2.
_NECK_SERVO = Servo(kp=4.4, kv=0.14, force=5.0)
_NECK_MASS, _NECK_INERTIA, _NECK_ARMATURE = 0.1, 1e-4, 1e-3


def add(spec: mujoco.MjSpec, anatomy: Anatomy) -> str | None:
    """Add to a spec, in place, what its anatomy asks for.

    Where an anatomy adds nothing, the spec stays as it is.

    Args:
        spec: the spec of the anatomy's model, not changed yet.
        anatomy: the anatomy.

    Returns:
        The name of the keyframe in which the robot starts, None for the model's reference posture.

    Raises:
        BodyError: the model lacks something that the anatomy names, or already has something that is to be added.
    """
    _require_named(spec, anatomy)
    if not anatomy.changes_model:
        return anatomy.home
    name_all(spec)
    name_tendons(spec)
    start = _start(spec, anatomy)
    for key in list(spec.keys):  # they have the size of the model as it was
        spec.delete(key)
    driven = (*anatomy.arm.joints, *anatomy.head.joints)
    frozen = freeze(spec, *start, _frozen(spec, anatomy), driven)
    _let_go(spec, frozen, [name for name in anatomy.add.servos if name not in anatomy.neck_joints], start)
    _limit(spec, anatomy)
    neck = _add_neck(spec, anatomy.add.neck)
    _add_camera(spec, anatomy, neck)
    _add_servos(spec, anatomy)
    _keep_home(spec, anatomy, *start)
    return HOME


def _require_named(spec: mujoco.MjSpec, anatomy: Anatomy) -> None:
    """What the anatomy names is there, or added; what is added is not there."""
    added = anatomy.neck_joints
    bodies = [anatomy.marker.body, *(thing.body for thing in (anatomy.add.neck, anatomy.add.camera) if thing)]
    moving = [name for name in (*anatomy.arm.joints, *anatomy.head.joints) if name not in added]
    placed = [name for name in anatomy.posture if name not in added]
    frozen = () if anatomy.add.freeze == "rest" else anatomy.add.freeze
    served = [name for name in anatomy.add.servos if name not in added]
    require(spec, anatomy, "joint", (*moving, *placed, *frozen, *served))
    if anatomy.add.camera is None:
        require(spec, anatomy, "camera", (anatomy.camera.name,))
    require(spec, anatomy, "body", [body for body in bodies if body])
    require(spec, anatomy, "keyframe", (anatomy.home,) if anatomy.home else ())
    for kind, names, there in (
        ("joint", added, spec.joints),
        ("camera", (anatomy.camera.name,) if anatomy.add.camera else (), spec.cameras),
    ):
        for name in set(names) & {thing.name for thing in there}:
            raise BodyError(
                f"{anatomy.model} has a {kind} {name!r} already, so that none of this name can be added. Give the "
                f"added one another name, or leave it out of [add]. The model's: {available(kind, there)}."
            )


def _start(spec: mujoco.MjSpec, anatomy: Anatomy) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """The model without additions, and its home posture."""
    model = compiled(spec, anatomy.model)
    data = mujoco.MjData(model)
    if anatomy.home:
        mujoco.mj_resetDataKeyframe(model, data, model.key(anatomy.home).id)
    for name, position in anatomy.posture.items():
        if name in anatomy.neck_joints:
            continue
        joint = model.joint(name)
        if joint.type[0] in (_FREE, _BALL):
            raise BodyError(f"The joint {name!r} in [posture] is neither a hinge nor a slide; place it by a keyframe.")
        data.qpos[joint.qposadr[0]] = position
    mujoco.mj_kinematics(model, data)
    return model, data


def _frozen(spec: mujoco.MjSpec, anatomy: Anatomy) -> set[str]:
    """Names of the joints that go away."""
    moving = [name for name in (*anatomy.arm.joints, *anatomy.head.joints) if name not in anatomy.neck_joints]
    if anatomy.add.freeze == "rest":
        return {joint.name for joint in spec.joints} - set(moving)
    frozen = set(anatomy.add.freeze)
    if anatomy.add.fixed_base:
        bodies = [spec.joint(name).parent for name in moving]
        bodies += [spec.body(thing.body) for thing in (anatomy.add.neck, anatomy.add.camera) if thing and thing.body]
        above = [joint for body in bodies for joint in _joints_above(body)]
        frozen |= {joint.name for joint in above if joint.type in (_FREE, _BALL)}
    return frozen - set(moving)


def _joints_above(body: Any) -> list[Any]:
    """The joints that move a body."""
    return [] if body.name == "world" else [*body.joints, *_joints_above(body.parent)]


def _limit(spec: mujoco.MjSpec, anatomy: Anatomy) -> None:
    for group in (anatomy.arm, anatomy.head):
        for name, interval in zip(group.joints, group.limits or (), strict=False):
            if name not in anatomy.neck_joints:
                _set_limits(spec.joint(name), interval)


def _set_limits(joint: Any, interval: tuple[float, float]) -> None:
    turns = joint.type == mujoco.mjtJoint.mjJNT_HINGE
    joint.range = np.rad2deg(interval) if turns and joint.compiler.degree else interval
    joint.limited = True


def _turn(directed: Directed) -> Floats:
    """The turn, shape (3, 3), whose columns are forward, left and up."""
    forward = np.array(directed.forward) / np.linalg.norm(directed.forward)
    left = np.cross(directed.up, forward)
    left /= np.linalg.norm(left)
    return np.column_stack([forward, left, np.cross(forward, left)])


def _quaternion(turn: Floats) -> Floats:
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, turn.ravel())
    return quaternion


def _add_neck(spec: mujoco.MjSpec, neck: Neck | None) -> Any:
    """Hinges of one light body, the first outermost."""
    if neck is None:
        return None
    body = spec.body(neck.body).add_body(PLAIN, name=NECK, pos=neck.position, quat=_quaternion(_turn(neck)))
    body.mass, body.inertia, body.explicitinertial = _NECK_MASS, np.full(3, _NECK_INERTIA), True
    body.ipos, body.iquat = np.zeros(3), np.array([1.0, 0, 0, 0])
    for name, turn, interval in zip(neck.joints, neck.turns, neck.limits, strict=False):
        joint = body.add_joint(PLAIN, name=name, axis=_AXES[turn], armature=_NECK_ARMATURE)
        _set_limits(joint, interval)
    return body


def _add_camera(spec: mujoco.MjSpec, anatomy: Anatomy, neck: Any) -> None:
    camera = anatomy.add.camera
    if camera is None:
        return
    forward, left, up = _turn(camera).T
    quaternion = _quaternion(np.column_stack([-left, up, -forward]))  # MuJoCo's cameras look along -z, and up is y
    body = spec.body(camera.body) if camera.body else neck
    body.add_camera(PLAIN, name=anatomy.camera.name, pos=camera.position, quat=quaternion, fovy=camera.fovy)


def _add_servos(spec: mujoco.MjSpec, anatomy: Anatomy) -> None:
    """Servos of the joints that the anatomy names, and of the neck's.

    Their damping is stiff, so that a model that integrates explicitly takes it in implicitly from here on.
    """
    servos = dict.fromkeys(anatomy.neck_joints, _NECK_SERVO) | anatomy.add.servos
    for name, servo in servos.items():
        _add_servo(spec, name, servo)
    if servos and spec.option.integrator in _EXPLICIT:
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST


def _add_servo(spec: mujoco.MjSpec, joint: str, servo: Servo) -> None:
    limit = {} if servo.force is None else {"forcelimited": True, "forcerange": [-servo.force, servo.force]}
    actuator = spec.add_actuator(
        PLAIN,
        name=f"somatopy_servo_{joint}",
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        target=joint,
        gaintype=mujoco.mjtGain.mjGAIN_FIXED,
        biastype=mujoco.mjtBias.mjBIAS_AFFINE,
        **limit,
    )
    actuator.gainprm[0], actuator.biasprm[1], actuator.biasprm[2] = servo.kp, -servo.kp, -servo.kv


def _let_go(
    spec: mujoco.MjSpec,
    model: mujoco.MjModel,
    servos: Collection[str],
    start: tuple[mujoco.MjModel, mujoco.MjData],
) -> None:
    """Take away what drives these joints alone, and handles by which a user drags what they move."""
    for name in servos:
        if spec.joint(name) is None:
            raise BodyError(f"The joint {name!r} in [add.servos] goes away by [add] freeze or fixed_base; keep one.")
        if spec.joint(name).type in (_FREE, _BALL):
            raise BodyError(f"The joint {name!r} in [add.servos] is neither a hinge nor a slide.")
    if not servos:
        return
    dofs = [model.joint(name).dofadr[0] for name in servos]
    driving = _driven(model)
    here = driving[:, dofs].any(axis=1) & ~np.delete(driving, dofs, axis=1).any(axis=1)
    gone = [spec.actuator(model.actuator(k).name) for k in np.flatnonzero(here)]
    for motor in gone:
        if motor.target in servos:  # its rotor turns on
            joint, gear = spec.joint(motor.target), abs(motor.gear[0])
            joint.armature += motor.armature * gear**2
            joint.damping = joint.damping + motor.damping * gear ** np.arange(2, 5)  # with v, v^2 and v^3
    forget(spec, {("actuator", motor.name) for motor in gone})
    _forget_idle_tendons(spec)
    _let_go_of_handles(spec, [spec.joint(name).parent for name in servos], start)


def _forget_idle_tendons(spec: mujoco.MjSpec) -> None:
    """Tendons that only carried a motor's pull; where none is left, arm and head may move alone."""
    used = {actuator.target for actuator in spec.actuators if actuator.trntype == mujoco.mjtTrn.mjTRN_TENDON}
    used |= {name for equality in spec.equalities for name in (equality.name1, equality.name2)}
    used |= {sensor.objname for sensor in spec.sensors}
    idle = [tendon for tendon in spec.tendons if tendon.name not in used and not _pulls(tendon)]
    forget(spec, {("tendon", tendon.name) for tendon in idle})


def _pulls(tendon: Any) -> bool:
    """Whether a tendon does anything by itself."""
    forces = tendon.frictionloss, tendon.armature, *np.ravel(tendon.stiffness), *np.ravel(tendon.damping)
    return any(forces) or any(tendon.range) or tendon.limited == mujoco.mjtLimited.mjLIMITED_TRUE


def _driven(model: mujoco.MjModel) -> np.ndarray[tuple[int, int], np.dtype[np.bool_]]:
    """Which degrees of freedom each actuator moves in some of a few postures, shape (nu, nv)."""
    data, found, rng = mujoco.MjData(model), np.zeros((model.nu, model.nv), bool), np.random.default_rng(0)
    for size in (0.0, 0.3, 0.3, 1.0):
        mujoco.mj_integratePos(model, data.qpos, rng.normal(size=model.nv) * size, 1.0)
        mujoco.mj_fwdPosition(model, data)
        moment = np.zeros((model.nu, model.nv))
        mujoco.mju_sparse2dense(
            moment, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind
        )
        found |= np.abs(moment) > 1e-9
    return found


def _let_go_of_handles(spec: mujoco.MjSpec, moved: list[Any], start: tuple[mujoco.MjModel, mujoco.MjData]) -> None:
    """Mocap bodies that are welded or connected to what servos move; those that then hold nothing just stand."""
    handles, moving = [body for body in spec.bodies if body.mocap], {body.name for body in moved}
    names, held = {body.name for body in handles}, set[str]()
    for equality in list(spec.equalities):
        ends = _ends(spec, equality) if equality.type in _TIES else []
        handle = names & {body.name for body in ends}
        carried = {above for body in ends for above in _names_above(body)}
        if handle and carried & moving:
            spec.delete(equality)
        else:
            held |= handle
    model, data = start
    for body in handles:
        if body.name not in held:
            k = model.body(body.name).mocapid[0]
            body.mocap = False
            stand(body, Pose(data.mocap_pos[k], data.mocap_quat[k]))


def _ends(spec: mujoco.MjSpec, equality: Any) -> list[Any]:
    """The bodies that a weld or connect ties."""
    names = [name for name in (equality.name1, equality.name2) if name]
    if equality.objtype == mujoco.mjtObj.mjOBJ_SITE:
        return [spec.site(name).parent for name in names]
    return [spec.body(name) for name in names]


def _names_above(body: Any) -> list[str]:
    return [] if body.name == "world" else [body.name, *_names_above(body.parent)]


def _keep_home(spec: mujoco.MjSpec, anatomy: Anatomy, before: mujoco.MjModel, home: mujoco.MjData) -> None:
    """One keyframe, with what is left of the home posture."""
    model = compiled(spec, anatomy.model)
    data = mujoco.MjData(model)
    for name in (model.joint(k).name for k in range(model.njnt)):
        if name in anatomy.neck_joints:
            data.joint(name).qpos = anatomy.posture.get(name, 0.0)
        else:
            data.joint(name).qpos = home.joint(name).qpos
    there = {before.actuator(k).name for k in range(before.nu)}
    for name in (model.actuator(k).name for k in range(model.nu)):
        if name in there:
            data.actuator(name).ctrl = home.actuator(name).ctrl
    for body in np.flatnonzero(model.body_mocapid >= 0):
        mine, its = model.body_mocapid[body], before.body(model.body(body).name).mocapid[0]
        data.mocap_pos[mine], data.mocap_quat[mine] = home.mocap_pos[its], home.mocap_quat[its]
    spec.add_key(name=HOME, qpos=data.qpos, ctrl=data.ctrl, mpos=data.mocap_pos.ravel(), mquat=data.mocap_quat.ravel())
