"""Adapts models made for other purposes, where that changes nothing else, and refuses those that cannot run."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from somatopy.bodies.anatomy import Anatomy
from somatopy.bodies.base import BodyError
from somatopy.clock import FRAME
from somatopy.percept import Camera, Floats, JointGroup, Marker, View

__all__ = [
    *("check_compiled", "check_joints", "check_names", "check_scale", "check_servos", "prepare", "said", "see_far"),
]

_OURS = "somatopy_"
_SORTS = (
    *("bodies", "joints", "geoms", "sites", "cameras", "lights", "meshes", "materials", "textures", "hfields", "skins"),
    *("flexes", "pairs", "excludes", "equalities", "tendons", "actuators", "sensors", "keys", "frames"),
)
_SINGULAR = {"bodies": "body", "meshes": "mesh", "flexes": "flex", "equalities": "equality"}
#: Numbers that models give, by the prefix of MuJoCo's arrays, with the word for what they belong to.
_GIVEN = {
    "body": ("body", ("pos", "quat", "mass", "inertia")),
    "jnt": ("joint", ("pos", "axis", "range", "stiffness")),
    "geom": ("geom", ("pos", "quat", "size")),
    "cam": ("camera", ("pos", "quat", "fovy", "intrinsic")),
    "actuator": ("actuator", ("gainprm", "biasprm", "gear", "forcerange")),
    "key": ("keyframe", ("qpos",)),
}
_OF_THE_WORLD = ("gravity", "wind", "magnetic", "density", "viscosity")
_MOST_STEPS = 10_000  # physics steps in a frame
_ASIDE = 1e-3  # rad, or m: as far beyond a limit a posture may be by rounding
_LEAST_TAG = 0.5  # px; one in the picture of a robot in metres is larger, one in millimetres is smaller
_SHAKES = {int(mujoco.mjtIntegrator.mjINT_EULER): ("Euler", 2.0), int(mujoco.mjtIntegrator.mjINT_RK4): ("RK4", 2.785)}


def said(error: Exception, path: Path) -> str:
    """An error of MuJoCo as one paragraph. If a file was not found or not understood, it says what to write."""
    words = " ".join(str(error).removeprefix("Error: ").split()).rstrip(".")
    if "Error opening file" in words:
        words += (
            f". Files are looked for in {path.parent}, and package://NAME/FILE in a folder NAME, which is above the "
            "model or beside a folder above it. Put the file there, or say where it is: "
            '<compiler meshdir="FOLDER" texturedir="FOLDER"/>; a URDF says <mujoco><compiler meshdir="FOLDER" '
            'strippath="true"/></mujoco> inside <robot>, which reads FOLDER/name.stl for package://any/where/name.stl'
        )
    elif "decoder" in words and str(path) in words:
        words += f". What a model is, its file's name tells: call it {path.stem}.xml (MJCF) or {path.stem}.urdf"
    elif "decoder" in words or "content type" in words:
        words += ". Convert the mesh to .obj or .stl"
    return f"{words}."


def check_names(spec: mujoco.MjSpec, path: Path) -> None:
    """Check that all names in a spec can be read. MuJoCo takes any file for UTF-8, whatever the file says of itself.

    Raises:
        BodyError: one cannot be read.
    """
    try:
        for sort in _SORTS:
            for thing in getattr(spec, sort):
                _ = thing.name
    except UnicodeDecodeError as error:
        raise BodyError(
            f"A name in {path} is not in UTF-8, as MuJoCo needs it ({error}). Save the file as UTF-8, or give what it "
            "names another name."
        ) from error


def prepare(spec: mujoco.MjSpec, path: Path) -> None:
    """Check that no name in a spec begins with `somatopy_`, and keep MuJoCo from removing shapes and bodies.

    Some models tell MuJoCo to leave out shapes that cannot touch anything, as the cube of tags cannot, and to merge
    bodies without joints into others, which loses their names. For a URDF, both are the default.

    Raises:
        BodyError: something has a name that begins with `somatopy_`.
    """
    for sort in _SORTS:
        for thing in getattr(spec, sort):
            if thing.name.startswith(_OURS):
                raise BodyError(
                    f"The {_SINGULAR.get(sort, sort[:-1])} {thing.name!r} of {path} has a name that begins with "
                    f"{_OURS}, as those of all that somatopy adds to a model do. Give it another name."
                )
    spec.compiler.discardvisual = spec.compiler.fusestatic = False


def see_far(model: mujoco.MjModel) -> None:
    """Set the clipping planes of all cameras: they draw from 1 mm away to beyond the reach of the robot."""
    model.vis.map.znear = 0.001 / model.stat.extent
    far = 2 * _reach(model) / model.stat.extent
    if model.vis.map.zfar < far:
        model.vis.map.zfar = far


def _reach(model: mujoco.MjModel) -> float:
    """No body that moves, nor its shapes and cameras, can be farther from the world's origin, m.

    A free joint may go anywhere; it counts as where it starts.
    """
    lengths = np.linalg.norm(model.body_pos, axis=1)
    ways = 2 * np.linalg.norm(model.jnt_pos, axis=1)
    slides = model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE
    ways[slides] += np.where(model.jnt_limited[:], np.abs(model.jnt_range).max(axis=1, initial=0.0), 0.0)[slides]
    np.add.at(lengths, model.jnt_bodyid, np.where(np.isfinite(ways), ways, 0.0))
    for body in range(1, model.nbody):
        lengths[body] += lengths[model.body_parentid[body]]
    shapes = lengths[model.geom_bodyid] + np.linalg.norm(model.geom_pos, axis=1) + model.geom_rbound
    cameras = lengths[model.cam_bodyid] + np.linalg.norm(model.cam_pos, axis=1)
    free = np.linalg.norm(np.vstack([model.qpos0, *model.key_qpos]), axis=1)
    return float(max(shapes[model.geom_bodyid > 0].max(initial=0.0), cameras.max(initial=0.0)) + free.max())


def check_compiled(model: mujoco.MjModel, path: Path) -> None:
    """Check that no number of a model is NaN, and that its physics step can be used.

    Raises:
        BodyError: a number is NaN, or the step cannot be used. The message names the place in the model.
    """
    for what, owner in _missing_numbers(model):
        raise BodyError(f"The {owner} of {path} has a {what} that is no number (nan). Write a number, or leave it out.")
    step = model.opt.timestep
    if step <= 0 or FRAME / step > _MOST_STEPS:
        raise BodyError(
            f"The physics step of {path} is {step:g} s. It must be positive, and a frame of 1/15 s may take "
            f'{_MOST_STEPS} steps at most. Write <option timestep="0.002"/>.'
        )


def _missing_numbers(model: mujoco.MjModel) -> Iterator[tuple[str, str]]:
    """What is no number, and whose it is."""
    for prefix, (kind, names) in _GIVEN.items():
        for name in names:
            values: Any = getattr(model, f"{prefix}_{name}")
            for row in np.unique(np.argwhere(np.isnan(values))[:, 0]):
                yield name, f"{kind} {getattr(model, prefix)(int(row)).name!r}"
    for name in _OF_THE_WORLD:
        if np.isnan(getattr(model.opt, name)).any():
            yield name, "<option/>"


def check_joints(group: JointGroup, anatomy: Anatomy) -> None:
    """Check that joints have finite limits, names that figures can show, and start positions inside their limits.

    Raises:
        BodyError: a joint has no finite limits, figures cannot show its name, or [posture] puts it beyond its limits.
    """
    for name, low, high in zip(group.names, group.lower, group.upper, strict=True):
        if not name.isprintable() or "$" in name:
            raise BodyError(
                f"The joint {name!r} of {anatomy.model} has a name that figures cannot show: it must have neither "
                "tabs nor line ends nor $. Give it another name."
            )
        if not np.isfinite((low, high)).all():
            raise BodyError(
                f"The joint {name!r} of {anatomy.model} moves from {low:g} to {high:g}: a map of postures needs "
                'finite limits. Give it range="low high", about -3.14 and 3.14 for one that turns all around.'
            )
        start = anatomy.posture.get(name, low)
        if not low - _ASIDE <= start <= high + _ASIDE:
            raise BodyError(
                f"[posture] puts the joint {name!r} at {start:g}, and its limits are {low:g} and {high:g}. Write a "
                "number between them, rad (slides: m)."
            )


def check_servos(model: mujoco.MjModel, servos: tuple[str, ...], path: Path) -> None:
    """Check that servos can move their joints to their targets.

    Args:
        model: the model.
        servos: names of the servos of arm and head.
        path: the model's file, for the message.

    Raises:
        BodyError: a servo is switched off, works against another one, or damps its joint too strongly.
    """
    numbers = [int(model.actuator(name).id) for name in servos]
    joints = [model.joint(model.actuator_trnid[k, 0]).name for k in numbers]
    if not numbers:
        return
    off = model.opt.disableactuator
    if model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_ACTUATION or any(
        off >> g & 1 for g in _groups(model, numbers)
    ):
        raise BodyError(
            f'The servos of {path} are switched off. Leave out actuation="disable" of its <flag/> and '
            "actuatorgroupdisable of its <option/>, or use the kinematic motion."
        )
    for number, joint in zip(numbers, joints, strict=True):
        if rivals := [name for name in _pulling(model, model.actuator_trnid[number, 0]) if name not in servos]:
            raise BodyError(
                f"The joint {joint!r} of {path} has two position servos, {model.actuator(number).name!r} and "
                f"{rivals[0]!r}; the second would hold the joint where it is. Delete one of them."
            )
    _refuse_shaking(model, numbers, path)


def _groups(model: mujoco.MjModel, actuators: list[int]) -> list[int]:
    """Groups of actuators that can be switched off."""
    return [int(group) for group in model.actuator_group[actuators] if 0 <= group < 31]


def _pulling(model: mujoco.MjModel, joint: int) -> list[str]:
    """Names of the position servos of a joint."""
    of_joint = (model.actuator_trntype == mujoco.mjtTrn.mjTRN_JOINT) & (model.actuator_trnid[:, 0] == joint)
    pulls = (model.actuator_gainprm[:, 0] == -model.actuator_biasprm[:, 1]) & (model.actuator_gainprm[:, 0] != 0)
    return [model.actuator(int(k)).name for k in np.flatnonzero(of_joint & pulls)]


def _refuse_shaking(model: mujoco.MjModel, servos: list[int], path: Path) -> None:
    """See that no servo brakes so hard that its joint shakes instead of moving.

    Two of MuJoCo's integrators take the force of kv as it was at the step's begin. With inertia M a step of length h
    then turns a velocity v into v (1 - h kv / M), which grows where h kv / M exceeds 2 (Euler) or 2.785 (Runge-Kutta).
    Limits of velocity and position hide this: nothing becomes infinite, and the joint rattles between its ends.
    """
    if int(model.opt.integrator) not in _SHAKES:
        return
    integrator, most = _SHAKES[int(model.opt.integrator)]
    brakes = np.zeros(model.nv)
    brakes[model.jnt_dofadr[model.actuator_trnid[servos, 0]]] = np.maximum(0.0, -model.actuator_biasprm[servos, 2])
    inertia = _inertia(model)
    if integrator == "Euler" and not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_EULERDAMP:
        inertia += model.opt.timestep * np.diag(model.dof_damping)
    root = np.linalg.inv(np.linalg.cholesky(inertia))
    ratios, ways = np.linalg.eigh(root @ np.diag(brakes) @ root.T)
    if model.opt.timestep * ratios[-1] > most:
        worst = int(np.argmax(brakes * (root.T @ ways[:, -1]) ** 2))
        raise BodyError(
            f"The servo of the joint {model.joint(model.dof_jntid[worst]).name!r} of {path} brakes too hard (kv="
            f"{brakes[worst]:g}) for what it moves: with the integrator {integrator} and a physics step of "
            f'{model.opt.timestep:g} s its joint shakes. Write <option integrator="implicitfast"/>, which takes any kv.'
        )


def _inertia(model: mujoco.MjModel) -> Floats:
    """The joints' inertia in the model's own posture, shape (nv, nv)."""
    data, inertia = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    for step in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_makeM):
        step(model, data)
    mujoco.mj_fullM(model, data, inertia)
    return inertia


def check_scale(view: View, camera: Camera, marker: Marker, anatomy: Anatomy) -> None:
    """Check that the model is in metres, by the size of a tag in the picture in the start posture.

    Raises:
        BodyError: the tag is as small as a point in the picture.
    """
    distance = float(np.linalg.norm(view.camera[:3] - view.marker[:3]))
    if distance * _LEAST_TAG > max(camera.focals) * marker.tag_size:
        raise BodyError(
            f"At the start the marker of {anatomy.model} is {distance:.3g} m from the camera {camera.name!r}, and its "
            f"tags of {marker.tag_size:g} m are points in the picture. Where lengths are in millimetres, write them in "
            'metres (a mesh has scale="0.001 0.001 0.001"); where the robot is that large, give it a larger marker '
            "(--body.marker.size)."
        )
