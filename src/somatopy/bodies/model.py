"""Builds the MuJoCo model that a body runs, from a model file and an anatomy."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import mujoco
import numpy as np

from somatopy.bodies.additions import add
from somatopy.bodies.anatomy import Anatomy
from somatopy.bodies.base import BodyError
from somatopy.bodies.cameras import set_fovy
from somatopy.bodies.carrying import check_chains
from somatopy.bodies.foreign import check_compiled, check_servos, prepare, see_far
from somatopy.bodies.loading import compiled, parse
from somatopy.bodies.marker import add_marker
from somatopy.bodies.parts import cut, name_all, trees_of
from somatopy.clock import FRAME
from somatopy.percept import Marker

__all__ = ["Build", "build"]

_JOINT = int(mujoco.mjtTrn.mjTRN_JOINT)
_FOLLOWING = mujoco.mjtDyn.mjDYN_NONE, mujoco.mjtDyn.mjDYN_FILTER, mujoco.mjtDyn.mjDYN_FILTEREXACT


@dataclass(frozen=True)
class Build:
    """A compiled model, with the names and settings that a body needs.

    Attributes:
        model: the model. A frame is a whole number of its physics steps.
        parts: the models that are stepped. They are one of the arm and one of the head, or the whole model if these
            cannot be separated. Kinematic motion has none.
        substeps: number of physics steps in a frame.
        servos: names of the servos of arm and head, in the order of the joints. Kinematic motion has none.
        calls_directly: whether MuJoCo's functions may be called from compiled code. They may not if the model fixes how
            much memory it uses. If that is too little, MuJoCo ends the process, unless it was called from Python.
        arm_solids: names of the arm's geoms that can touch something.
        head_solids: names of the head's geoms that can touch something.
        home: the keyframe in which the robot starts. None for the model's reference posture.
    """

    model: mujoco.MjModel
    parts: tuple[mujoco.MjModel, ...]
    substeps: int
    servos: tuple[str, ...]
    calls_directly: bool
    arm_solids: tuple[str, ...]
    head_solids: tuple[str, ...]
    home: str | None


def build(anatomy: Anatomy, marker: Marker, servos: bool, fovy: float | None = None) -> Build:
    """Compile the anatomy's model.

    Args:
        anatomy: the anatomy, which names the model's file and its parts.
        marker: the cube of tags for the hand.
        servos: whether the model's position servos drive the joints.
        fovy: vertical field of view of the anatomy's camera, degrees. With None it is that of the model.

    Raises:
        BodyError: the file is missing or broken, or lacks something that the anatomy names.
    """
    spec = parse(anatomy.model)
    prepare(spec, anatomy.model)
    home = add(spec, anatomy)
    check_chains(spec, anatomy)
    if fovy is not None:
        set_fovy(spec, anatomy.camera.name, fovy)
    add_marker(spec, anatomy.marker.body, np.array(anatomy.marker.position), np.array(anatomy.marker.axis), marker)
    solids = _part_arm_and_head(spec, anatomy)
    ramping = _ramp_servos(spec, anatomy) if servos else []
    model = compiled(spec, anatomy.model)
    check_compiled(model, anatomy.model)
    substeps = int(np.ceil(FRAME / model.opt.timestep - 1e-6))
    model.opt.timestep = FRAME / substeps
    check_servos(model, tuple(servo.name for servo in ramping), anatomy.model)
    see_far(model)
    model.vis.quality.shadowsize = model.vis.quality.offsamples = 0
    parts = _parts(spec, model, anatomy) if servos else ()
    return Build(model, parts, substeps, tuple(servo.name for servo in ramping), spec.memory == -1, *solids, home)


def _parts(spec: mujoco.MjSpec, model: mujoco.MjModel, anatomy: Anatomy) -> tuple[mujoco.MjModel, ...]:
    trees = trees_of(model, anatomy.arm.joints, anatomy.head.joints)
    return (model,) if trees is None else tuple(cut(spec, model, some) for some in trees)


def _part_arm_and_head(spec: mujoco.MjSpec, anatomy: Anatomy) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Arm and head pass through each other: a pair with a negative margin is noticed but exerts no force.

    Pairs of the model's own between the two give way to it. A torso that turns with the arm and carries the head
    belongs to neither.
    """
    name_all(spec)
    arm, head = (_solids(spec.joint(group.joints[0]).parent) for group in (anatomy.arm, anatomy.head))
    between = {frozenset((a.name, b.name)) for a, b in product(arm, head)}
    for pair in list(spec.pairs):
        if frozenset((pair.geomname1, pair.geomname2)) in between:
            spec.delete(pair)
    for a, b in product(arm, head):
        spec.add_pair(geomname1=a.name, geomname2=b.name, margin=-1.0, gap=1.0)
    return tuple(g.name for g in arm), tuple(g.name for g in head)


def _ramp_servos(spec: mujoco.MjSpec, anatomy: Anatomy) -> list[Any]:
    """Give each position servo an integrator, so that its set-point ramps inside MuJoCo at the speed in `ctrl`.

    The integrator takes the place of a filter: what is told to ramp needs none. A gear goes into the gains.
    """
    servos = []
    for name in (*anatomy.arm.joints, *anatomy.head.joints):
        servo = next((a for a in spec.actuators if a.target == name and _is_position_servo(a)), None)
        if servo is None:
            raise BodyError(
                f"The joint {name!r} of {anatomy.model} has no position servo. Add "
                f'<actuator><position joint="{name}" kp="..." kv="..."/></actuator> to the model, or '
                f'[add.servos] "{name}" = {{ kp = ..., kv = ... }} to the anatomy, or use the kinematic motion.'
            )
        _without_gear(servo)
        servo.dyntype = mujoco.mjtDyn.mjDYN_INTEGRATOR
        servo.ctrllimited = False
        if servo.inheritrange != 1:  # else its range is the joint's
            servo.actlimited = False
        servos.append(servo)
    return servos


def _is_position_servo(actuator: Any) -> bool:
    """Whether an actuator of a spec pulls a joint towards its control value, as `<position>` does."""
    pulls = actuator.gainprm[0] == -actuator.biasprm[1] != 0 and actuator.gear[0] != 0
    return bool(pulls and int(actuator.trntype) == _JOINT and actuator.dyntype in _FOLLOWING)


def _without_gear(servo: Any) -> None:
    """The same servo in the joint's own units: behind a gear, the motor's position and force are others."""
    gear = servo.gear[0]
    if gear == 1:
        return
    servo.gainprm[0] *= gear**2
    servo.biasprm[0] *= gear
    servo.biasprm[1] *= gear**2
    if servo.biasprm[2] < 0:  # a positive one is a damping ratio, which is the same on both sides
        servo.biasprm[2] *= gear**2
    servo.armature *= gear**2
    servo.damping = servo.damping * abs(gear) ** np.arange(2, 5)  # with v, v^2 and v^3
    servo.actrange = np.sort(servo.actrange / gear)
    servo.forcerange, servo.gear[0] = np.sort(servo.forcerange * gear), 1.0


def _solids(body: Any) -> list[Any]:
    """The geoms of a body and of all that hang on it which can touch anything."""
    own = [g for g in body.geoms if g.contype or g.conaffinity]
    return own + [g for child in body.bodies for g in _solids(child)]
