"""From an MJCF and an anatomy to the model that a body runs: marker, passable head, ramping servos, step, quality."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from somatopy.bodies.anatomy import Anatomy
from somatopy.bodies.base import BodyError
from somatopy.bodies.cameras import set_fovy
from somatopy.bodies.foreign import check_compiled, check_servos, prepare, said, see_far
from somatopy.bodies.marker import add_marker
from somatopy.bodies.parts import cut, name_all, trees_of
from somatopy.clock import FRAME
from somatopy.percept import Marker

__all__ = ["Build", "build"]

_JOINT = int(mujoco.mjtTrn.mjTRN_JOINT)
_NO_DYNAMICS = mujoco.mjtDyn.mjDYN_NONE


@dataclass(frozen=True)
class Build:
    """A compiled model, and what of it a body must find again.

    Attributes:
        model: the model; its step divides a frame.
        parts: what is stepped in its place: a model of the arm and one of the head, with what belongs to them, or the
            model itself where they cannot be parted; none in kinematic motion.
        substeps: physics steps in a frame.
        servos: names of the servos that ramp, in the order of arm and head joints; none in kinematic motion.
        calls_directly: whether MuJoCo's functions may be called from compiled code. Not so where the model says how
            much memory it takes: where that is too little, MuJoCo ends the process, unless it was called from Python.
        arm_solids: names of the arm's geoms that can touch.
        head_solids: the same of the head.
    """

    model: mujoco.MjModel
    parts: tuple[mujoco.MjModel, ...]
    substeps: int
    servos: tuple[str, ...]
    calls_directly: bool
    arm_solids: tuple[str, ...]
    head_solids: tuple[str, ...]


def build(anatomy: Anatomy, marker: Marker, servos: bool, fovy: float | None = None) -> Build:
    """Compile the anatomy's model.

    Args:
        anatomy: names the model's file and its parts.
        marker: the cube to put on the hand.
        servos: whether the joints are to be driven by the model's position servos.
        fovy: vertical field of view of the anatomy's camera, degrees; the model's where None.

    Raises:
        BodyError: the file is missing or broken, or lacks something that the anatomy names.
    """
    spec = _parse(anatomy.model)
    prepare(spec, anatomy.model)
    for kind, names in (
        ("joint", (*anatomy.arm.joints, *anatomy.head.joints)),
        ("camera", (anatomy.camera.name,)),
        ("body", (anatomy.marker.body,)),
        ("keyframe", (anatomy.home,) if anatomy.home else ()),
    ):
        _require(spec, anatomy, kind, names)
    if fovy is not None:
        set_fovy(spec, anatomy.camera.name, fovy)
    add_marker(spec, anatomy.marker.body, np.array(anatomy.marker.position), np.array(anatomy.marker.axis), marker)
    solids = _part_arm_and_head(spec, anatomy)
    ramping = _ramp_servos(spec, anatomy) if servos else []
    model = _compile(spec, anatomy.model)
    check_compiled(model, anatomy.model)
    substeps = int(np.ceil(FRAME / model.opt.timestep - 1e-6))
    model.opt.timestep = FRAME / substeps
    check_servos(model, tuple(servo.name for servo in ramping), anatomy.model)
    see_far(model)
    model.vis.quality.shadowsize = model.vis.quality.offsamples = 0
    parts = _parts(spec, model, anatomy) if servos else ()
    return Build(model, parts, substeps, tuple(servo.name for servo in ramping), spec.memory == -1, *solids)


def _parts(spec: mujoco.MjSpec, model: mujoco.MjModel, anatomy: Anatomy) -> tuple[mujoco.MjModel, ...]:
    trees = trees_of(model, anatomy.arm.joints, anatomy.head.joints)
    return (model,) if trees is None else tuple(cut(spec, model, some) for some in trees)


def _parse(path: Path) -> mujoco.MjSpec:
    if not path.is_file():
        raise BodyError(f"The model {path} does not exist.")
    try:
        return mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise BodyError(f"MuJoCo cannot read the model {path}: {said(error, path)}") from error


def _compile(spec: mujoco.MjSpec, path: Path) -> mujoco.MjModel:
    try:
        return spec.compile()
    except ValueError as error:
        raise BodyError(f"MuJoCo cannot compile the model {path}: {said(error, path)}") from error


def _require(spec: mujoco.MjSpec, anatomy: Anatomy, kind: str, names: Sequence[str]) -> None:
    parts = {"joint": spec.joints, "camera": spec.cameras, "body": spec.bodies, "keyframe": spec.keys}[kind]
    there = [part.name for part in parts]
    for name in names:
        if not name or name not in there:
            known = ", ".join(filter(None, there)) or "none"
            raise BodyError(f"The {kind} {name!r} does not exist in {anatomy.model}. Available: {known}.")


def _part_arm_and_head(spec: mujoco.MjSpec, anatomy: Anatomy) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Arm and head pass through each other: a pair with a negative margin is noticed but exerts no force.

    Pairs of the model's own between the two give way to it. A torso that turns with the arm and carries the head
    belongs to neither.
    """
    name_all(spec)
    limb, neck = (spec.joint(group.joints[0]).parent for group in (anatomy.arm, anatomy.head))
    arm, head = _solids(limb, _carriers(neck)), _solids(neck, _carriers(limb))
    between = {frozenset((a.name, b.name)) for a, b in product(arm, head)}
    for pair in list(spec.pairs):
        if frozenset((pair.geomname1, pair.geomname2)) in between:
            spec.delete(pair)
    for a, b in product(arm, head):
        spec.add_pair(geomname1=a.name, geomname2=b.name, margin=-1.0, gap=1.0)
    return tuple(g.name for g in arm), tuple(g.name for g in head)


def _ramp_servos(spec: mujoco.MjSpec, anatomy: Anatomy) -> list[Any]:
    """Give each position servo an integrator, so that its set-point ramps inside MuJoCo at the speed in `ctrl`."""
    servos = []
    for name in (*anatomy.arm.joints, *anatomy.head.joints):
        servo = next((a for a in spec.actuators if a.target == name and _is_position_servo(a)), None)
        if servo is None:
            raise BodyError(
                f"The joint {name!r} of {anatomy.model} has no position servo. Add "
                f'<actuator><position joint="{name}" kp="..." kv="..."/></actuator>, or use the kinematic motion.'
            )
        servo.dyntype = mujoco.mjtDyn.mjDYN_INTEGRATOR
        servo.ctrllimited = False
        if servo.inheritrange != 1:  # else its range is the joint's
            servo.actlimited = False
        servos.append(servo)
    return servos


def _is_position_servo(actuator: Any) -> bool:
    """Whether an actuator of a spec pulls a joint towards its control value, as `<position>` does, without a filter."""
    pulls = actuator.gainprm[0] == -actuator.biasprm[1] != 0 and actuator.gear[0] == 1
    return bool(pulls and int(actuator.trntype) == _JOINT and actuator.dyntype == _NO_DYNAMICS)


def _carriers(body: Any) -> list[str]:
    """Names of a body and of all on which it hangs."""
    return [] if body is None else [body.name, *_carriers(body.parent)]


def _solids(body: Any, carriers: list[str]) -> list[Any]:
    """The geoms of a body and of all that hang on it which can touch anything, without another limb and its carriers.

    Args:
        body: the body.
        carriers: the other limb's first body, and all on which that hangs.
    """
    if body.name == carriers[0]:
        return []
    own = [g for g in body.geoms if body.name not in carriers and (g.contype or g.conaffinity)]
    return own + [g for child in body.bodies for g in _solids(child, carriers)]
