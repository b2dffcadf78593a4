"""Proposes an anatomy for a model: which joints are arm and head, and where marker and eye go."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

import mujoco
import numpy as np

from somatopy.bodies.base import BodyError
from somatopy.bodies.survey import Chain, Head, Survey, home_data
from somatopy.percept import Floats, Marker

__all__ = ["Eye", "Group", "Neck", "Proposal", "propose"]

Interval = tuple[float, float]
Vector = tuple[float, float, float]

_SPEED, _SLIDE_SPEED = 3.0, 0.5  # rad/s and m/s, where a model says nothing of velocities
_TURN, _SLIDE = (-1.5, 1.5), (-0.2, 0.2)  # rad and m around rest, where a model has no limits
_FOVY = 47.64  # degrees, NAO's
_HEIGHTS = (240, 480, 720, 960, 1200)  # px, of pictures of which the smallest that shows the tags is taken
_TAG_PIXELS = 28.0  # px of a tag's edge, far away: seen aslant it is half as high, or less
_SAMPLED = 300  # arm postures
_GAP = 0.005  # m between the tip and the cube


@dataclass(frozen=True)
class Group:
    """The joints of arm or head, with their velocities. If the model lacks limits, they have limits, too.

    Attributes:
        joints: names of the joints.
        velocity: velocity limit of each joint, rad/s (m/s for slides).
        limits: low and high of each joint, rad (m for slides). None if the model has limits for all of them.
    """

    joints: tuple[str, ...]
    velocity: tuple[float, ...]
    limits: tuple[Interval, ...] | None = None


@dataclass(frozen=True)
class Neck:
    """A neck with pan and tilt, which is added to a model without a head.

    Attributes:
        body: the body on which it stands.
        position: its position in that body's frame, m.
        forward: the direction in which its camera looks at zero angles, in that frame.
        up: the direction that is up in the camera's picture, in that frame.
        limits: low and high of pan and of tilt, rad.
    """

    body: str
    position: Vector
    forward: Vector
    up: Vector
    limits: tuple[Interval, Interval]


@dataclass(frozen=True)
class Eye:
    """The camera to look through.

    Attributes:
        name: its name.
        width: width of its picture, px.
        height: height of its picture, px.
        fovy: vertical field of view, degrees.
        body: the body that carries it, if it is added. "" if the model has it, or if the neck carries it.
        position: its position in that body's frame, m, if it is added.
        forward: the direction in which it looks, in that frame, if it is added.
        up: the direction that is up in its picture, in that frame, if it is added.
        added: whether it is added because the model lacks it.
    """

    name: str
    width: int
    height: int
    fovy: float
    body: str = ""
    position: Vector = (0.0, 0.0, 0.0)
    forward: Vector = (1.0, 0.0, 0.0)
    up: Vector = (0.0, 0.0, 1.0)
    added: bool = False


@dataclass(frozen=True)
class Proposal:
    """The content of an anatomy file for a model. `anatomy_text` writes the file.

    Attributes:
        name: name of the robot.
        model: path of the model, as the file names it.
        home: the keyframe in which the robot starts. None for the model's zero posture.
        arm: the joints of the arm.
        head: the joints of the head.
        neck: the neck that is added. None if the model has a head.
        eye: the camera.
        marker: the body that carries the cube of tags.
        position: position of the cube in that body's frame, m.
        axis: axis of the cube in that frame.
        floats: whether free or ball joints move arm or head, so that they must be removed.
        others: number of joints that belong neither to the arm nor to the head.
        servos: joints of arm and head that no position servo drives.
        other_arms: other chains that could be the arm.
        other_cameras: names of other cameras that the head moves.
        ranges: babbling ranges by name.
        posture: start positions by joint, rad (m for slides). They replace those of the keyframe.
    """

    name: str
    model: str
    home: str | None
    arm: Group
    head: Group
    neck: Neck | None
    eye: Eye
    marker: str
    position: Vector
    axis: Vector
    floats: bool
    others: int
    servos: tuple[str, ...]
    other_arms: tuple[Chain, ...] = ()
    other_cameras: tuple[str, ...] = ()
    ranges: dict[str, tuple[Interval, ...]] = field(default_factory=dict)
    posture: dict[str, float] = field(default_factory=dict)


def propose(model: mujoco.MjModel, found: Survey, path: str | Path, neck: bool = False) -> Proposal:
    """Propose the anatomy that fits a model best.

    Args:
        model: the model.
        found: what the survey found in it.
        path: the path of the model, as the anatomy file names it.
        neck: whether to add a neck even if the model has a head.

    Raises:
        BodyError: nothing in the model could be an arm.
    """
    arm = next((chain for chain in found.arms if chain.tip), None)
    if arm is None:
        raise BodyError(_no_arm(found))
    data = home_data(model, found.home)
    position, axis = _marker_pose(model, data, arm)
    hands = _hands(model, found, arm, position)
    head = None if neck else _best_head(model, data, found, hands)
    added = _neck(model, data, arm, hands) if head is None else None
    eye = _eye(model, data, found, head, added, hands)
    names = head.joints if head else ("neck_pan", "neck_tilt")
    used, moving = {*arm.joints, *names}, (*arm.joints, *(head.joints if head else ()))
    return Proposal(
        name=found.name or Path(path).stem,
        model=str(path),
        home=found.home,
        arm=_group(found, arm.joints),
        head=_group(found, head.joints) if head else Group(names, (_SPEED, _SPEED)),
        neck=added,
        eye=eye,
        marker=arm.tip,
        position=_rounded(position),
        axis=_rounded(axis),
        floats=_floats(model, arm, head),
        others=sum(joint.name not in used and joint.kind in ("hinge", "slide") for joint in found.joints),
        servos=tuple(name for name in moving if not found.joint(name).servo),
        other_arms=tuple(_likely(found, arm)),
        other_cameras=tuple(
            h.camera for h in found.heads if head and h.joints == head.joints and h.camera not in ("", eye.name)
        ),
    )


def _likely(found: Survey, arm: Chain) -> list[Chain]:
    """Chains that look nearly as much like an arm."""
    return [chain for chain in found.arms if chain is not arm and chain.tip and chain.score > max(arm.score - 2, 0)][:3]


def _no_arm(found: Survey) -> str:
    if not found.one_dof:
        return (
            "The model has no hinge and no slide, so that nothing of it can be an arm. Give the bodies of the arm "
            'joints: <joint name="shoulder" type="hinge" axis="0 1 0" range="-1.5 1.5"/>.'
        )
    unnamed = sum(not joint.name for joint in found.one_dof)
    if unnamed:
        return (
            f"{unnamed} of {len(found.one_dof)} hinges and slides have no name, and an anatomy file knows joints by "
            'their names. Write names into the model: <joint name="shoulder" .../>.'
        )
    return 'No chain of joints ends in a body that has a name. Name the last one: <body name="hand">.'


def _rounded(vector: Floats) -> Vector:
    x, y, z = (round(float(value), 5) + 0.0 for value in vector)
    return x, y, z


def _group(found: Survey, names: tuple[str, ...]) -> Group:
    joints = [found.joint(name) for name in names]
    velocity = tuple(_SLIDE_SPEED if joint.kind == "slide" else _SPEED for joint in joints)
    if all(joint.limits for joint in joints):
        return Group(names, velocity)
    limits = tuple(joint.limits or (_SLIDE if joint.kind == "slide" else _TURN) for joint in joints)
    return Group(names, velocity, tuple((round(low, 4), round(high, 4)) for low, high in limits))


def _floats(model: mujoco.MjModel, arm: Chain, head: Head | None) -> bool:
    """Whether a free or ball joint moves the arm or the head."""
    bodies = [model.joint(group.joints[0]).bodyid[0] for group in (arm, head) if group is not None]
    above = {int(b) for body in bodies for b in _above(model, int(body))}
    return any(int(model.jnt_bodyid[j]) in above and model.jnt_type[j] < 2 for j in range(model.njnt))


def _above(model: mujoco.MjModel, body: int) -> list[int]:
    found = [body]
    while found[-1]:
        found.append(int(model.body_parentid[found[-1]]))
    return found


# -- the marker --------------------------------------------------------------------------------------------------------


def _marker_pose(model: mujoco.MjModel, data: mujoco.MjData, arm: Chain) -> tuple[Floats, Floats]:
    """Position and axis of the cube in the frame of the tip: beyond all that is at the end of the arm."""
    body = model.body(arm.tip).id
    turn, origin = data.xmat[body].reshape(3, 3), data.xpos[body]
    corners = (_corners(model, data, _beyond(model, arm)) - origin) @ turn
    anchor = (data.xanchor[model.joint(arm.joints[-1]).id] - origin) @ turn
    if not len(corners):
        corners = np.zeros((1, 3))
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    axis = _along(middle - anchor, np.ptp(corners, axis=0), _link(data, model, arm) @ turn)
    end = float((corners @ axis).max())
    return middle + (end - middle @ axis + 0.5 * Marker.size + _GAP) * axis, axis


def _beyond(model: mujoco.MjModel, arm: Chain) -> list[int]:
    """The bodies that the arm's last joint moves, fingers included."""
    first = int(model.joint(arm.joints[-1]).bodyid[0])
    return [b for b in range(first, model.nbody) if first in _above(model, b)]


def _corners(model: mujoco.MjModel, data: mujoco.MjData, bodies: list[int]) -> Floats:
    """Corners of the boxes around all shapes of some bodies, shape (n, 3), m, in the world."""
    geoms = np.flatnonzero(np.isin(model.geom_bodyid, bodies) & (model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE))
    signs = np.array(list(product((-1, 1), repeat=3)))
    boxes = [model.geom_aabb[g, :3] + signs * model.geom_aabb[g, 3:] for g in geoms]
    turned = [box @ data.geom_xmat[g].reshape(3, 3).T + data.geom_xpos[g] for g, box in zip(geoms, boxes, strict=True)]
    return np.vstack(turned) if turned else np.empty((0, 3))


def _link(data: mujoco.MjData, model: mujoco.MjModel, arm: Chain) -> Floats:
    """From the joint before the last, that is not at the same place, to the tip, in the world."""
    ends = [data.xanchor[model.joint(name).id] for name in arm.joints]
    tip = data.xpos[model.body(arm.tip).id]
    ways = [np.asarray(tip - end) for end in reversed(ends)]
    return next((way for way in ways if np.linalg.norm(way) > 1e-3), np.array([1.0, 0.0, 0.0]))


def _along(way: Floats, extent: Floats, link: Floats) -> Floats:
    """Unit vector along a link: from joint to middle where that is clear, one of the frame's axes where it is near."""
    chosen = way if np.linalg.norm(way) > 0.1 * max(float(extent.max()), 1e-3) else link
    unit = chosen / np.linalg.norm(chosen)
    nearest = int(np.abs(unit).argmax())
    if abs(unit[nearest]) > 0.9:
        return np.asarray(np.sign(unit[nearest]) * np.eye(3)[nearest])
    return np.asarray(unit)


def _hands(model: mujoco.MjModel, found: Survey, arm: Chain, position: Floats) -> Floats:
    """Where the marker is at random arm postures, shape (n, 3), m, in the world; everything else stands at home."""
    rng, data = np.random.default_rng(0), home_data(model, found.home)
    group = _group(found, arm.joints)
    limits = np.array(group.limits or [found.joint(name).limits for name in arm.joints])
    places = [model.joint(name).qposadr[0] for name in arm.joints]
    body, hands = model.body(arm.tip).id, np.empty((_SAMPLED, 3))
    for k in range(_SAMPLED):
        data.qpos[places] = rng.uniform(limits[:, 0], limits[:, 1])
        mujoco.mj_kinematics(model, data)
        hands[k] = data.xpos[body] + data.xmat[body].reshape(3, 3) @ position
    return hands


# -- the head ----------------------------------------------------------------------------------------------------------


def _best_head(model: mujoco.MjModel, data: mujoco.MjData, found: Survey, hands: Floats) -> Head | None:
    """The head whose camera looks nearest to the middle of where the hand can be; else one without a camera."""
    seeing = [head for head in found.heads if head.camera]

    def aside(head: Head) -> float:
        camera = model.camera(head.camera).id
        way = hands.mean(axis=0) - data.cam_xpos[camera]
        return float(way @ data.cam_xmat[camera].reshape(3, 3)[:, 2] / np.linalg.norm(way))

    return min(seeing, key=aside) if seeing else next(iter(found.heads), None)


def _front(data: mujoco.MjData, hands: Floats, shoulder: Floats, hand: Floats) -> Floats:
    """Horizontal unit vector to where the hand mostly is, as seen from the shoulder."""
    reach = float(np.linalg.norm(hands - shoulder, axis=1).max())
    for way in (hands.mean(axis=0) - shoulder, hand - shoulder):
        flat = np.array([way[0], way[1], 0.0])
        if np.linalg.norm(flat) > 0.15 * reach:
            return np.asarray(flat / np.linalg.norm(flat))
    return np.array([1.0, 0.0, 0.0])


def _neck(model: mujoco.MjModel, data: mujoco.MjData, arm: Chain, hands: Floats) -> Neck:
    """A pan-tilt neck above and behind the shoulder, where most of what is in front of it is in plain view."""
    shoulder = data.xanchor[model.joint(arm.joints[0]).id].copy()
    tip = data.xpos[model.body(arm.tip).id]
    front, up = _front(data, hands, shoulder, tip), np.array([0.0, 0.0, 1.0])
    front_hands = hands[(hands - shoulder) @ front > 0] if ((hands - shoulder) @ front > 0).any() else hands
    reach = float(np.quantile(np.linalg.norm(hands - shoulder, axis=1), 0.95))
    left = np.cross(up, front)
    ways = list(product((0.0, 0.35, -0.35), (0.4, 0.7, 1.0), (0.3, 0.0, 0.6)))  # aside, up, back; the first are best
    places = [shoulder + reach * (high * up - back * front + side * left) for side, high, back in ways]
    costs = [0.1 * k / len(ways) - _in_plain_view(model, data, place, front_hands) for k, place in enumerate(places)]
    eye = places[int(np.argmin(costs))]
    way = front_hands.mean(axis=0) - eye
    down = float(np.arctan2(-way[2], np.linalg.norm(way[:2])))
    flat = np.array([way[0], way[1], 0.0])
    forward = flat / np.linalg.norm(flat) if np.linalg.norm(flat) > 0.05 * reach else front
    body = int(model.body_parentid[model.joint(arm.joints[0]).bodyid[0]])
    while not model.body(body).name:
        body = int(model.body_parentid[body])
    turn = data.xmat[body].reshape(3, 3)
    tilt = round(max(-1.5, down - 0.9), 2), round(min(1.55, down + 0.9), 2)
    position, ahead, above = (_rounded(turn.T @ vector) for vector in (eye - data.xpos[body], forward, up))
    return Neck(model.body(body).name, position, ahead, above, ((-1.5, 1.5), tilt))


def _in_plain_view(model: mujoco.MjModel, data: mujoco.MjData, eye: Floats, hands: Floats) -> float:
    """Share of places that a straight line from the eye reaches; 0 if the eye is inside a shape or beside one."""
    for g in np.flatnonzero(model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE):
        local = data.geom_xmat[g].reshape(3, 3).T @ (eye - data.geom_xpos[g]) - model.geom_aabb[g, :3]
        if (np.abs(local) < model.geom_aabb[g, 3:] + 0.02).all():
            return 0.0
    clear, geom = 0, np.zeros(1, np.int32)
    for hand in hands[:100]:
        way = hand - eye
        hit = mujoco.mj_ray(model, data, eye, way, None, 1, -1, geom)
        clear += hit < 0 or hit >= 0.95
    return clear / len(hands[:100])


# -- the eye -----------------------------------------------------------------------------------------------------------


def _eye(
    model: mujoco.MjModel, data: mujoco.MjData, found: Survey, head: Head | None, neck: Neck | None, hands: Floats
) -> Eye:
    taken = {camera.name for camera in found.cameras}
    name = next(name for name in ("eye", "somatopy_eye", "somatopy_eye_2") if name not in taken)
    if neck is not None:
        body = model.body(neck.body).id
        place = data.xpos[body] + data.xmat[body].reshape(3, 3) @ np.array(neck.position)
        return Eye(name, *_picture(place, hands, _FOVY), _FOVY, added=True)
    assert head is not None
    if head.camera:
        camera = model.camera(head.camera).id
        fovy = float(model.cam_fovy[camera])
        return Eye(head.camera, *_picture(data.cam_xpos[camera], hands, fovy), fovy)
    return _eye_on(model, data, head, name, hands)


def _eye_on(model: mujoco.MjModel, data: mujoco.MjData, head: Head, name: str, hands: Floats) -> Eye:
    """A camera in front of a head that has none, level, towards where the hand mostly is."""
    body = model.body(head.body).id
    turn, origin = data.xmat[body].reshape(3, 3), data.xpos[body]
    corners = _corners(model, data, [body])
    middle = corners.mean(axis=0) if len(corners) else origin
    way = hands.mean(axis=0) - middle
    flat = np.array([way[0], way[1], 0.0])
    front = flat / np.linalg.norm(flat) if np.linalg.norm(flat) > 1e-6 else np.array([1.0, 0.0, 0.0])
    ahead = float(((corners - middle) @ front).max()) + 0.01 if len(corners) else 0.0
    place = middle + ahead * front
    up = np.array([0.0, 0.0, 1.0])
    position, forward, above = (_rounded(turn.T @ vector) for vector in (place - origin, front, up))
    return Eye(name, *_picture(place, hands, _FOVY), _FOVY, head.body, position, forward, above, added=True)


def _picture(eye: Floats, hands: Floats, fovy: float) -> tuple[int, int]:
    """Width and height, px, at which nine of ten places of the hand show the tags large enough."""
    far = float(np.quantile(np.linalg.norm(hands - eye, axis=1), 0.9))
    needed = 2 * np.tan(np.deg2rad(fovy) / 2) * _TAG_PIXELS * far / Marker.tag_size
    height = next((height for height in _HEIGHTS if height >= 0.9 * needed), _HEIGHTS[-1])
    return height * 4 // 3, height
