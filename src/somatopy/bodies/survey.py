"""Surveys a MuJoCo model: it finds chains of joints that could be arm or head, cameras and servos."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from somatopy.bodies.base import BodyError
from somatopy.bodies.foreign import check_compiled
from somatopy.bodies.joint_tree import (
    HINGE,
    SLIDE,
    carrier,
    joints_above,
    moved_by,
    one_dof_tail,
    rigid_with,
    segments,
)
from somatopy.bodies.loading import compiled, parse
from somatopy.percept import Floats

__all__ = ["CameraFacts", "Chain", "Head", "JointFacts", "Survey", "home_data", "read_model", "survey"]

#: The longest arm and the longest head that somatopy takes, in joints.
LONGEST_ARM, LONGEST_HEAD = 8, 3

_KINDS = {0: "free", 1: "ball", 2: "slide", 3: "hinge"}
_CUT = 7  # of a longer chain the last so many joints are proposed
_AT_HOME = re.compile(r"home|init|stand|rest|ready", re.IGNORECASE)
_HEAD = re.compile(r"head|neck|skull|eye(?!let)", re.IGNORECASE)
_FINGER = re.compile(r"finger|thumb|jaw|knuckle|(?<![a-z])(ff|mf|rf|lf|th)(?=j|[^a-z]|$)", re.IGNORECASE)
_ARM = re.compile(r"arm|hand|wrist|elbow|shoulder|gripper|palm|tool|flange|radius|humerus", re.IGNORECASE)
_LEG = re.compile(
    r"leg|hip|knee|ankle|foot|toe|thigh|shin|tibia|femur|wheel|tail|wing|door|abdomen|haltere", re.IGNORECASE
)
_TIP = re.compile(r"hand|wrist|gripper|palm|tool|tcp|flange|ee(?![a-z])", re.IGNORECASE)
_NO_HAND = re.compile(r"camera|sensor|imu|frame", re.IGNORECASE)
_LEFT = re.compile(
    r"left|(?<![A-Za-z])[lL](?![a-z])|(?<![A-Za-z])L(?=[A-Z][a-z])|\bl(?=shoulder|arm|hand|wrist|elbow|humerus)"
)


@dataclass(frozen=True)
class JointFacts:
    """A joint of a model.

    Attributes:
        name: its name. "" if it has none.
        kind: "hinge", "slide", "ball" or "free".
        body: the body that it moves.
        limits: low and high, rad (m for slides). None if it has no limits.
        servo: whether a position servo drives it.
    """

    name: str
    kind: str
    body: str
    limits: tuple[float, float] | None
    servo: bool


@dataclass(frozen=True)
class Chain:
    """A chain of hinges and slides that could be an arm.

    Attributes:
        joints: names of the joints, from the base to the tip.
        base: the body that carries the first joint.
        tip: the body at the end that could carry the marker. "" if no body there has a name.
        tips: names of all bodies that are fixed to the tip.
        reach: length from the first joint to the tip along the links, m.
        score: how much the chain looks like an arm. A higher score is better.
    """

    joints: tuple[str, ...]
    base: str
    tip: str
    tips: tuple[str, ...]
    reach: float
    score: float


@dataclass(frozen=True)
class CameraFacts:
    """A camera of a model.

    Attributes:
        name: its name. "" if it has none.
        body: the body that carries it.
        fovy: vertical field of view, degrees.
        moved_by: names of all joints between the world and the camera.
        follows: whether it turns by itself to look at something. Joints do not turn such a camera.
    """

    name: str
    body: str
    fovy: float
    moved_by: tuple[str, ...]
    follows: bool


@dataclass(frozen=True)
class Head:
    """A chain of joints that could be a head.

    Attributes:
        joints: names of its one to three hinges.
        body: the body that they move.
        camera: name of the camera on that body. "" if there is none.
    """

    joints: tuple[str, ...]
    body: str
    camera: str


@dataclass(frozen=True)
class Survey:
    """What a model has.

    Attributes:
        name: the model's name. "" if it has none.
        size: largest extent of the robot's joints and bodies, m.
        bodies: number of bodies, without the world.
        joints: all joints.
        arms: chains that could be an arm, the likeliest first.
        heads: chains that could be a head, those with a camera first.
        cameras: all cameras.
        keyframes: names of all keyframes that have a name.
        home: the keyframe that looks like a posture to start in. None if there is none.
    """

    name: str
    size: float
    bodies: int
    joints: tuple[JointFacts, ...]
    arms: tuple[Chain, ...]
    heads: tuple[Head, ...]
    cameras: tuple[CameraFacts, ...]
    keyframes: tuple[str, ...]
    home: str | None

    def joint(self, name: str) -> JointFacts:
        """The joint with a name."""
        return next(joint for joint in self.joints if joint.name == name)

    @property
    def one_dof(self) -> tuple[JointFacts, ...]:
        """All joints that are hinges or slides."""
        return tuple(joint for joint in self.joints if joint.kind in ("hinge", "slide"))


def read_model(path: str | Path) -> mujoco.MjModel:
    """The compiled model of an MJCF or URDF file.

    Raises:
        BodyError: the file is missing, MuJoCo cannot read or compile it, or a number in it is none. The message says
            how to mend it.
    """
    path = Path(path)
    try:
        spec = parse(path)
        spec.compiler.fusestatic = spec.compiler.discardvisual = False  # all bodies and shapes, of a URDF too
        model = compiled(spec, path)
    except BodyError as error:
        said = " ".join(str(error).split()).rstrip(".")
        raise BodyError(f"{said}. {_mend(said)}".rstrip()) from error
    check_compiled(model, path)
    return model


def _mend(said: str) -> str:
    """What to do about an error of MuJoCo's."""
    if not said.startswith("MuJoCo"):
        return ""
    if "mass" in said and "inertia" in said:
        return 'Give the body a geom, or <inertial mass="0.1" pos="0 0 0" diaginertia="1e-4 1e-4 1e-4"/>.'
    if "coplanar" in said:
        return (
            'In the place of that mesh write a thin box: <geometry><box size="0.05 0.05 0.001"/></geometry> in a URDF.'
        )
    if re.search(r"opening|not found|decoder", said):
        return ""  # the sentence says what to do
    return "Correct the line that it names."


def home_data(model: mujoco.MjModel, home: str | None) -> mujoco.MjData:
    """The state of a model in a keyframe. Joints are moved inside their limits, and all poses are computed."""
    data = mujoco.MjData(model)
    if home is not None:
        mujoco.mj_resetDataKeyframe(model, data, model.key(home).id)
    for joint in np.flatnonzero(model.jnt_limited & np.isin(model.jnt_type, (HINGE, SLIDE))):
        place = model.jnt_qposadr[joint]
        data.qpos[place] = np.clip(data.qpos[place], *model.jnt_range[joint])
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_camlight(model, data)
    return data


def survey(model: mujoco.MjModel) -> Survey:
    """Find out what a compiled model has.

    Args:
        model: the model. It is not changed.

    Example:
        >>> from somatopy.bodies import MODELS
        >>> found = survey(read_model(MODELS["nao"].with_name("nao.xml")))
        >>> found.arms[0].joints[0], found.arms[0].tip, found.heads[0].joints
        ('LShoulderPitch', 'l_wrist', ('HeadYaw', 'HeadPitch'))
    """
    keys = tuple(name for k in range(model.nkey) if (name := model.key(k).name))
    home = next((name for name in keys if _AT_HOME.search(name)), keys[0] if keys else None)
    data = home_data(model, home)
    arms = tuple(sorted(_arms(model, data), key=lambda chain: -chain.score))
    cameras = tuple(_camera(model, k) for k in range(model.ncam))
    moving = [b for b in range(1, model.nbody) if model.body_weldid[b]]
    places = data.xpos[moving] if moving else np.zeros((1, 3))
    return Survey(
        name=model.names[: model.names.index(b"\0")].decode().replace("MuJoCo Model", ""),
        size=float(np.ptp(places, axis=0).max()),
        bodies=model.nbody - 1,
        joints=tuple(_joint(model, k) for k in range(model.njnt)),
        arms=arms,
        heads=tuple(_heads(model, data, cameras, arms)),
        cameras=cameras,
        keyframes=keys,
        home=home,
    )


def _joint(model: mujoco.MjModel, k: int) -> JointFacts:
    limits = (float(model.jnt_range[k, 0]), float(model.jnt_range[k, 1])) if model.jnt_limited[k] else None
    return JointFacts(
        name=model.joint(k).name,
        kind=_KINDS[int(model.jnt_type[k])],
        body=carrier(model, k),
        limits=limits,
        servo=any(_pulls(model, a, k) for a in range(model.nu)),
    )


def _pulls(model: mujoco.MjModel, actuator: int, joint: int) -> bool:
    """Whether an actuator is a position servo, without a filter, of this joint."""
    gain, bias = model.actuator_gainprm[actuator, 0], model.actuator_biasprm[actuator, 1]
    plain = model.actuator_dyntype[actuator] == mujoco.mjtDyn.mjDYN_NONE and model.actuator_gear[actuator, 0] == 1
    on = model.actuator_trntype[actuator] == mujoco.mjtTrn.mjTRN_JOINT and model.actuator_trnid[actuator, 0] == joint
    return bool(on and plain and gain == -bias != 0)


def _camera(model: mujoco.MjModel, k: int) -> CameraFacts:
    body = int(model.cam_bodyid[k])
    name, fovy, mode = model.camera(k).name, float(model.cam_fovy[k]), int(model.cam_mode[k])
    return CameraFacts(
        name, model.body(body).name, fovy, moved_by(model, body), follows=mode != mujoco.mjtCamLight.mjCAMLIGHT_FIXED
    )


# -- arms --------------------------------------------------------------------------------------------------------------


def _arms(model: mujoco.MjModel, data: mujoco.MjData) -> Iterator[Chain]:
    chains = [_without_fingers(model, one_dof_tail(model, joints)) for joints in segments(model)]
    chains = [chain[-_CUT:] if len(chain) > LONGEST_ARM else chain for chain in chains if chain]
    reaches = [_reach(model, data, chain) for chain in chains]
    longest = max(reaches, default=0.0) or 1.0
    for chain, reach in zip(chains, reaches, strict=True):
        names = tuple(model.joint(j).name for j in chain)
        if not all(names):
            continue
        named = tuple(name for b in rigid_with(model, int(model.jnt_bodyid[chain[-1]])) if (name := model.body(b).name))
        tip = _tip(model, named)
        base = model.body(model.body_parentid[model.jnt_bodyid[chain[0]]]).name
        bodies = [carrier(model, j) for j in chain]
        looks = bool(np.isin(model.cam_bodyid, rigid_with(model, int(model.jnt_bodyid[chain[-1]]))).any())
        slides = (model.jnt_type[chain[:2]] == SLIDE).sum() == 2  # as of a base that drives about
        score = _score(names, bodies, tip) + reach / longest - 0.6 * looks - 1.5 * slides
        yield Chain(names, base, tip, named, reach, score)


def _tip(model: mujoco.MjModel, named: tuple[str, ...]) -> str:
    """Of the bodies at the end of a chain the one for the marker: called a hand, or else the last that has a shape."""
    solid = [name for name in named if model.body(name).geomnum[0] and not _NO_HAND.search(name)] or list(named)
    return next((name for name in reversed(solid) if _TIP.search(name)), solid[-1] if solid else "")


def _without_fingers(model: mujoco.MjModel, chain: list[int]) -> list[int]:
    """A chain without the joints of a gripper at its end, as long as three or more others are left."""
    kept = list(chain)
    while len(kept) > 3 and _FINGER.search(f"{model.joint(kept[-1]).name} {carrier(model, kept[-1])}"):
        kept.pop()
    return kept


def _reach(model: mujoco.MjModel, data: mujoco.MjData, chain: list[int]) -> float:
    """Length from the first joint of a chain over all its joints to the farthest body or geom that its end carries."""
    anchors = data.xanchor[chain]
    along = float(np.linalg.norm(np.diff(anchors, axis=0), axis=1).sum())
    rigid = rigid_with(model, int(model.jnt_bodyid[chain[-1]]))
    ends = np.vstack([data.xpos[rigid], data.geom_xpos[np.isin(model.geom_bodyid, rigid)]])
    return along + float(np.linalg.norm(ends - anchors[-1], axis=1).max())


def _score(joints: tuple[str, ...], bodies: list[str], tip: str) -> float:
    """How much a chain looks like an arm by its names and its number of joints."""
    words = " ".join([*joints, *bodies, tip])
    score = 2.0 if 4 <= len(joints) <= 7 else 1.0 if len(joints) in (3, 8) else 0.0
    score += 2.0 * bool(_ARM.search(words)) - 2.0 * bool(_LEG.search(words))
    score -= 3.0 * bool(_HEAD.search(words)) + bool(_FINGER.search(words))
    score -= 4.0 * (not tip)
    return score + 0.3 * bool(_LEFT.search(words))


# -- heads -------------------------------------------------------------------------------------------------------------


def _heads(
    model: mujoco.MjModel, data: mujoco.MjData, cameras: tuple[CameraFacts, ...], arms: tuple[Chain, ...]
) -> Iterator[Head]:
    """Joints that move a camera but no arm, and then those that are called so and move none.

    The arm is the likeliest that has a body for the marker.
    """
    arm = next((chain for chain in arms if chain.tip), arms[0] if arms else None)
    carrying = set(arm.joints) if arm else set()
    if arm:
        first = model.joint(arm.joints[0]).bodyid[0]
        carrying |= {model.joint(j).name for j in joints_above(model, int(first))}
    found: dict[tuple[str, ...], Head] = {}
    for k, camera in enumerate(cameras):
        own = [j for j in joints_above(model, int(model.cam_bodyid[k])) if model.joint(j).name not in carrying]
        chain = _turning(model, data, one_dof_tail(model, own), data.cam_xmat[k].reshape(3, 3))
        names = tuple(model.joint(j).name for j in chain)
        on_arm = arm is not None and set(arm.joints) & set(camera.moved_by)
        if names and all(names) and camera.name and not camera.follows and not on_arm:
            yield (head := Head(names, camera.body, camera.name))
            found[names] = head
    for segment in segments(model):
        chain = [j for j in one_dof_tail(model, segment) if model.jnt_type[j] == HINGE][-LONGEST_HEAD:]
        names = tuple(model.joint(j).name for j in chain)
        bodies = [carrier(model, j) for j in chain]
        body = bodies[-1] if bodies else ""
        looks = all(names) and _HEAD.search(" ".join([*names, *bodies])) and not carrying & set(names)
        if chain and body and looks and not any(set(names) & set(known) for known in found):
            yield Head(names, body, "")


def _turning(model: mujoco.MjModel, data: mujoco.MjData, chain: list[int], turn: Floats) -> list[int]:
    """Of the joints that move a camera, one that pans and one that tilts it, or else the last three hinges.

    Args:
        model: the model.
        data: its state at home.
        chain: joints between what carries the arm and the camera.
        turn: rotation of the camera; its columns point right, up and backwards.
    """
    hinges = [j for j in chain if model.jnt_type[j] == HINGE]
    if len(hinges) <= LONGEST_HEAD:
        return hinges
    axes = np.abs(data.xaxis[hinges] @ turn)  # along right, up, back
    pan, tilt = int(axes[:, 1].argmax()), int(axes[:, 0].argmax())
    if pan != tilt and min(axes[pan, 1], axes[tilt, 0]) > 0.7:
        return [hinges[k] for k in sorted((pan, tilt))]
    return hinges[-LONGEST_HEAD:]
