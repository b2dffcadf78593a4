"""Checks whether a robot can do an experiment: whether its hand can be seen, and whether its physics is stable."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass

import mujoco
import numpy as np

from somatopy.bodies import Anatomy, BodyError, MujocoBody
from somatopy.bodies.joint_tree import moved_by
from somatopy.bodies.survey import Survey
from somatopy.bodies.trial import FAR, Trial, trial
from somatopy.experiment.ceiling import Vantages
from somatopy.experiment.context import Context
from somatopy.experiment.look import Outlook, outlook, why_unseen
from somatopy.experiment.presets import paper
from somatopy.percept import Floats

__all__ = ["Checkup", "Fault", "checkup", "model_faults"]

_POSTURES, _MOVES = 300, 5
_LONG = 5.0  # m: an arm as long as that is likely one in millimetres
_LOOPS = (int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD))
_TURNS = 20.0  # rad: an arm whose hinges turn as far is likely one whose ranges are in degrees
_SELDOM = 0.2  # share of arm postures below which a run teaches little


@dataclass(frozen=True)
class Fault:
    """Something that is wrong with a robot, and how to mend it.

    Attributes:
        stops: whether the robot cannot run because of it.
        text: one or two sentences.
    """

    stops: bool
    text: str


@dataclass(frozen=True)
class Checkup:
    """The result of `checkup`.

    Attributes:
        faults: what is wrong.
        arms: arm postures from babbling, shape (n, n_arm), rad. None if the robot could not be built.
        outlook: what can be seen at these postures. None if the robot could not be built.
        trial: how the robot moved by physics. None if physics cannot move it.
    """

    faults: tuple[Fault, ...]
    arms: Floats | None = None
    outlook: Outlook | None = None
    trial: Trial | None = None

    @property
    def runs(self) -> bool:
        """Whether the robot can run."""
        return not any(fault.stops for fault in self.faults)


def checkup(anatomy: Anatomy) -> Checkup:
    """Build a robot, let it babble, test whether its hand can be seen, and move it by physics.

    Example:
        >>> from somatopy.bodies import MODELS
        >>> found = checkup(Anatomy.load(MODELS["nao"]))
        >>> found.runs, found.faults, found.outlook.rate > 0.9
        (True, (), True)
    """
    try:
        body = MujocoBody(anatomy, motion="kinematic")
    except BodyError as error:
        return Checkup((Fault(True, str(error)),))
    with closing(body):
        faults = list(_of_its_joints(body))
        try:
            arms = _context(body).babbled(_POSTURES)
            found = outlook(Vantages.of(body), arms)
        except ValueError as error:
            return Checkup((*faults, Fault(True, f"{str(error).rstrip('.')}.")))
        faults += _of_sight(body, found, arms)
        tried, failed = _moved(anatomy, arms, found.heads)
    return Checkup((*faults, *failed), arms, found, tried)


def _context(body: MujocoBody) -> Context:
    """What the preset `paper` would find, which babbles in the range `confined`."""
    return Context(paper(), body, start=body.reset().arm)


# -- faults ------------------------------------------------------------------------------------------------------------


def model_faults(found: Survey) -> Iterator[Fault]:
    """Faults of a model that do not depend on the anatomy."""
    if found.arms and found.arms[0].reach > _LONG:
        yield Fault(
            False,
            f"The arm is {found.arms[0].reach:.4g} m long. MuJoCo's lengths are metres: if the file has millimetres, "
            'divide each pos, size and fromto by 1000, and give meshes scale="0.001 0.001 0.001".',
        )
    yield from _of_its_angles(found)
    if found.arms and not found.arms[0].tip:
        yield Fault(
            False,
            f"The joints {', '.join(found.arms[0].joints)} look most like an arm, but end in a body without a name, to "
            'which no marker can be fixed. Name it in the model: <body name="hand">.',
        )
    unnamed = [joint for joint in found.one_dof if not joint.name]
    if unnamed and found.arms:
        bodies = ", ".join(sorted({joint.body or "?" for joint in unnamed})[:4])
        yield Fault(
            False,
            f"Without name, and so of no use to an anatomy: {len(unnamed)} of {len(found.one_dof)} hinges and slides "
            f'(of {bodies}). Where arm or head need them, write <joint name="..."/>.',
        )


def _of_its_angles(found: Survey) -> Iterator[Fault]:
    """Whether the ranges of the likeliest arm look as if radians had been read as degrees, or degrees as radians."""
    joints = [found.joint(name) for name in (found.arms[0].joints if found.arms else ())]
    spans = [joint.limits[1] - joint.limits[0] for joint in joints if joint.kind == "hinge" and joint.limits]
    if spans and max(spans) <= np.deg2rad(2 * np.pi):
        yield Fault(
            False,
            f"No hinge of the arm turns by more than {np.rad2deg(max(spans)):.1f} degrees. In MJCF, ranges are in "
            'degrees unless the file says otherwise: if it has radians, write <compiler angle="radian"/>.',
        )
    if spans and np.median(spans) > _TURNS:
        yield Fault(
            False,
            f"The hinges of the arm turn by up to {max(spans):.4g} rad. If the ranges in the file are in degrees, take "
            'angle="radian" out of its <compiler>; a URDF must have radians.',
        )


def _of_its_joints(body: MujocoBody) -> Iterator[Fault]:
    """Whether each joint of arm and head moves what it shall, and whether the robot stands fast."""
    anatomy, model = body.anatomy, body.model
    eye, hand = (
        moved_by(model, int(carrier))
        for carrier in (model.cam_bodyid[model.camera(anatomy.camera.name).id], model.body(anatomy.marker.body).id)
    )
    groups = ("arm", "marker", anatomy.arm.joints, hand), ("head", "camera", anatomy.head.joints, eye)
    for part, what, joints, moving in groups:
        if idle := [name for name in joints if name not in moving]:
            yield Fault(False, f"{_these(idle)} not move the {what}. Leave such joints out of [{part}] joints.")
    yield from _of_its_ties(model, hand, eye)
    yield from _of_mimics(model, {*anatomy.arm.joints, *anatomy.head.joints})
    free = [model.joint(k).name for k in range(model.njnt) if model.jnt_type[k] < 2]
    if free := [name for name in free if name in hand or name in eye]:
        yield Fault(
            False,
            f"The robot stands on the free joint {free[0]!r}, so that it falls or drifts while it babbles. Fix it in "
            "the anatomy: [add] with fixed_base = true.",
        )


def _of_its_ties(model: mujoco.MjModel, *moving: tuple[str, ...]) -> Iterator[Fault]:
    """Equalities that close a loop through the arm or the head, so that its joints cannot move one by one."""
    names = {name for each in moving for name in each}
    for k in np.flatnonzero(model.eq_active0):
        ends = [int(model.eq_obj1id[k]), int(model.eq_obj2id[k])]
        if model.eq_objtype[k] == mujoco.mjtObj.mjOBJ_SITE:
            ends = [int(model.site_bodyid[end]) for end in ends]
        if int(model.eq_type[k]) in _LOOPS and any(names.intersection(moved_by(model, end)) for end in ends):
            one, other = (model.body(end).name for end in ends)
            yield Fault(
                False,
                f"An equality of the model ties {one!r} to {other!r}, so that the joints cannot move one by one: with "
                "physics they stop short, and kinematic motion does not heed it. Take it out of <equality>.",
            )


def _of_mimics(model: mujoco.MjModel, moving: set[str]) -> Iterator[Fault]:
    """Equalities by which a joint of arm or head follows another one, as `mimic` of a URDF makes them."""
    for k in np.flatnonzero(model.eq_active0 & (model.eq_type == mujoco.mjtEq.mjEQ_JOINT) & (model.eq_obj2id >= 0)):
        one, other = (model.joint(int(ends[k])).name for ends in (model.eq_obj1id, model.eq_obj2id))
        if {one, other} <= moving:
            yield Fault(
                False,
                f"The joint {one!r} follows the joint {other!r} (<equality>; <mimic> in a URDF), so that they cannot "
                "move one by one: with physics they stop short, and kinematic motion does not heed it. Leave one of "
                "them out of the joints of arm and head, or take the tie out of the model.",
            )


def _these(names: list[str]) -> str:
    return f"The joint {names[0]!r} does" if len(names) == 1 else f"The joints {', '.join(map(repr, names))} do"


def _of_sight(body: MujocoBody, found: Outlook, arms: Floats) -> Iterator[Fault]:
    if found.rate == 0.0:
        yield Fault(True, f"The hand is never seen, at none of {len(arms)} arm postures. {_cause(body, arms)}")
    elif found.rate < _SELDOM:
        yield Fault(
            False,
            f"The hand can be seen at only {found.rate:.0%} of the arm postures. Narrow the babbling to where it can: "
            "[ranges] with confined = [[low, high], ...]; `--propose` computes one.",
        )


def _cause(body: MujocoBody, arms: Floats) -> str:
    why, camera, marker = why_unseen(body, arms[:40]), body.anatomy.camera, body.anatomy.marker
    if why == "hidden":
        around = _shapes_around(body, arms[0], found_head=body.legal(0.5 * (body.head.lower + body.head.upper)))
        inside = f" (it is inside a shape of {around[0]!r})" if around else ""
        return (
            f"Something always stands between camera and marker{inside}. Move the marker out of it: [marker] "
            f"position = [x, y, z] in the frame of {marker.body!r}, m, now {list(marker.position)}."
        )
    if why == "aside":
        return (
            f"The camera {camera.name!r} looks elsewhere at every head posture. Turn it in the model, or add a neck "
            "that looks at the hand: [add.neck], as `--propose` writes it."
        )
    if why == "small":
        width, height = body.camera.width, body.camera.height
        return (
            f"The tags are too small in a picture of {width} x {height}. Take a larger one: [camera] "
            f"width = {2 * width}, height = {2 * height}; or a larger cube: --body.marker.size 0.1."
        )
    return (
        "The hand comes into view, but its tags are cut off or turned away. Turn the cube, whose tags surround its "
        f"axis: [marker] axis = [x, y, z], now {list(marker.axis)}."
    )


def _shapes_around(body: MujocoBody, arm: Floats, found_head: Floats) -> list[str]:
    """Bodies in a shape of which the marker's centre is."""
    body.place(arm, found_head)
    model, data = body.model, body.data
    hand = data.site("somatopy_marker").xpos
    found = []
    for geom in range(model.ngeom):
        local = data.geom_xmat[geom].reshape(3, 3).T @ (hand - data.geom_xpos[geom]) - model.geom_aabb[geom, :3]
        name = model.body(model.geom_bodyid[geom]).name
        if (np.abs(local) < model.geom_aabb[geom, 3:]).all() and model.geom(geom).name != "somatopy_marker":
            found.append(name)
    return found


def _moved(anatomy: Anatomy, arms: Floats, heads: Floats) -> tuple[Trial | None, list[Fault]]:
    """What physics does to the robot, and what is wrong with that."""
    try:
        body = MujocoBody(anatomy, arm_speed=None)
    except BodyError as error:
        return None, [Fault(False, f"Physics cannot move the robot, kinematic motion can. {error}")]
    with closing(body):
        tried = trial(body, list(zip(arms[:_MOVES], heads[:_MOVES], strict=True)))
    return tried, list(_of_motion(tried))


def _of_motion(tried: Trial) -> Iterator[Fault]:
    if tried.diverged is not None:
        yield Fault(False, f"{tried.diverged.rstrip('.')}. Kinematic motion needs no physics: --motion kinematic.")
    weak = [(name, error) for name, error in zip(tried.joints, tried.errors, strict=True) if error > FAR]
    if weak:
        worst, error = max(weak, key=lambda pair: pair[1])
        yield Fault(
            False,
            f"Of {len(tried.joints)} servos, {len(weak)} came to rest far from the target, that of {worst!r} "
            f"{error:.2f} rad (slides: m). {_held(tried)}",
        )


def _held(tried: Trial) -> str:
    """What may have held the joints that did not get there."""
    if not tried.touching:
        return (
            "Too little force is there, or the model ties joints together: raise kp and the force range, in the model "
            "or in [add.servos], or take the tie out of <equality> or <tendon>."
        )
    one, other = tried.touching[0]
    pairs = " and ".join(f"{a!r} touched {b!r}" for a, b in tried.touching[:3])
    return (
        f"There {pairs}. Narrow [ranges] confined to where nothing is in the way. If these are neighbours that may "
        f'overlap, write into the model <contact><exclude body1="{one}" body2="{other}"/></contact>.'
    )
