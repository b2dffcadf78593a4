"""The places of the arm's and the head's joints in the arrays of a compiled model, and their limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import mujoco
import numpy as np

from somatopy.bodies.anatomy import Anatomy
from somatopy.bodies.base import BodyError
from somatopy.bodies.limits import CLEARANCE
from somatopy.bodies.tables import Joints
from somatopy.percept import Floats, Ints, JointGroup

__all__ = ["Coupled", "Layout"]

_JOINT = int(mujoco.mjtTrn.mjTRN_JOINT)
_HINGE, _SLIDE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)
_ONE_DOF = _HINGE, _SLIDE
_USUAL_SPEED = {_HINGE: 3.0, _SLIDE: 0.5}  # rad/s and m/s
_ROUNDING = 1e-9  # rad, or m
_DIRECT, _INTEGRATED = int(mujoco.mjtDyn.mjDYN_NONE), int(mujoco.mjtDyn.mjDYN_INTEGRATOR)
_FOLLOWING = (_DIRECT, _INTEGRATED, int(mujoco.mjtDyn.mjDYN_FILTER), int(mujoco.mjtDyn.mjDYN_FILTEREXACT))

#: Index of the coupled joint and of the one that limits it, -1 for none; angles of the latter, lower and upper limits.
Coupled = tuple[int, int, Floats, Floats, Floats]


@dataclass(frozen=True, eq=False)
class Rest:
    """Position servos of joints that belong neither to the arm nor to the head.

    Attributes:
        servos: servos whose set-point is in `ctrl`: three arrays of shape (k,), with the indices of the set-points in
            `ctrl`, the indices in `qpos` of the positions that they hold, and the gears.
        ramps: servos whose set-point is in `act`, where a filter or an integrator makes it from `ctrl`. The arrays are
            the same, with indices in `act`.
    """

    servos: tuple[Ints, Ints, Floats]
    ramps: tuple[Ints, Ints, Floats]

    @classmethod
    def of(cls, model: mujoco.MjModel, moving: Sequence[int]) -> Self:
        """The servos of a model that hold none of the joints in `moving`, which are those of arm and head."""
        found = [k for k in range(model.nu) if _is_servo(model, k) and model.actuator_trnid[k, 0] not in moving]
        kinds = model.actuator_dyntype[found]
        servos, ramps = (np.array(found, np.int64)[there] for there in (kinds != _INTEGRATED, kinds != _DIRECT))
        return cls(_held(model, servos, model.actuator_ctrladr), _held(model, ramps, model.actuator_actadr))

    def hold(self, data: mujoco.MjData) -> None:
        """Set all set-points to the present positions of the joints."""
        for values, (there, places, gears) in ((data.ctrl, self.servos), (data.act, self.ramps)):
            values[there] = data.qpos[places] * gears


def _held(model: mujoco.MjModel, servos: Ints, addresses: Ints) -> tuple[Ints, Ints, Floats]:
    places = model.jnt_qposadr[model.actuator_trnid[servos, 0]]
    return addresses[servos].astype(np.int64), places.astype(np.int64), model.actuator_gear[servos, 0].copy()


@dataclass(frozen=True, eq=False)
class Layout:
    """The joints of a compiled model that belong to arm and head, those of the arm first.

    Attributes:
        arm: names and limits of the arm's joints.
        head: names and limits of the head's joints.
        places: indices of the n joints in `qpos`, shape (n,).
        dofs: indices of the n joints in `qvel`, shape (n,).
        lower: lower position limits, shape (n,), rad.
        upper: upper position limits, shape (n,), rad.
        velocity: velocity limits, shape (n,), rad/s. Where none is given it is 3 rad/s, and 0.5 m/s for slides.
        coupling: how one head joint limits another one, as `clip_targets` takes it.
        rest: the servos of all other joints, which hold these where they are.
    """

    arm: JointGroup
    head: JointGroup
    places: Ints
    dofs: Ints
    lower: Floats
    upper: Floats
    velocity: Floats
    coupling: Coupled
    rest: Rest

    @classmethod
    def of(cls, model: mujoco.MjModel, anatomy: Anatomy) -> Self:
        """The layout of an anatomy's joints in its model.

        Raises:
            BodyError: a joint is neither hinge nor slide, or has no limits. Or joints that limit each other leave no
                posture.
        """
        arm, head = (_group(model, anatomy, group) for group in (anatomy.arm, anatomy.head))
        lower, upper, velocity = (
            np.concatenate([getattr(arm, name), getattr(head, name)]) for name in ("lower", "upper", "velocity")
        )
        joints = [model.joint(name).id for name in (*arm.names, *head.names)]
        return cls(
            arm=arm,
            head=head,
            places=model.jnt_qposadr[joints].astype(np.int64),
            dofs=model.jnt_dofadr[joints].astype(np.int64),
            lower=lower,
            upper=upper,
            velocity=velocity,
            coupling=_coupling(anatomy, (*arm.names, *head.names), lower, upper),
            rest=Rest.of(model, joints),
        )

    def ranges(self, anatomy: Anatomy) -> dict[str, Floats]:
        """Babbling ranges by name, shape (n_arm, 2), rad: the joint limits, and the ranges of the anatomy.

        The ranges "confined" and "wide", in which presets babble, always exist. If the anatomy has no wide range, the
        confined one takes its place. If it has no confined range, the joint limits do.
        """
        limits = self.arm.space.limits
        own = {name: _up_to(limits, np.array(range_)) for name, range_ in anatomy.ranges.items()}
        confined = own.get("confined", limits)
        return {"mechanical": limits, "confined": confined, "wide": confined} | own


def _up_to(limits: Floats, interval: Floats) -> Floats:
    """An interval that reaches a limit but for rounding, as of degrees in the model, reaches it."""
    return np.where(np.abs(interval - limits) < _ROUNDING, limits, interval)


def _group(model: mujoco.MjModel, anatomy: Anatomy, group: Joints) -> JointGroup:
    names = group.joints
    for name in names:
        joint = model.joint(name)
        if int(model.jnt_type[joint.id]) not in _ONE_DOF:
            raise BodyError(f"The joint {name!r} of {anatomy.model} is neither a hinge nor a slide.")
        if not model.jnt_limited[joint.id]:
            raise BodyError(
                f'The joint {name!r} of {anatomy.model} has no limits. Give it range="low high" limited="true" in '
                "the model, or limits = [[low, high], ...], one for each joint, beside its name in the anatomy."
            )
    ranges = np.array([model.joint(name).range for name in names])
    slides = [int(model.joint(name).type[0]) == _SLIDE for name in names]
    usual = tuple(_USUAL_SPEED[_SLIDE if slide else _HINGE] for slide in slides)
    units = tuple("m" if slide else "rad" for slide in slides)
    return JointGroup(names, ranges[:, 0].copy(), ranges[:, 1].copy(), np.array(group.velocity or usual), units)


def _coupling(anatomy: Anatomy, names: tuple[str, ...], lower: Floats, upper: Floats) -> Coupled:
    table = anatomy.head.coupling
    if table is None:
        return -1, -1, np.zeros(1), np.zeros(1), np.zeros(1)
    k = names.index(table.joint)
    least, most = max(*table.lower, lower[k]), min(*table.upper, upper[k])
    if least + 2 * CLEARANCE >= most:
        raise BodyError(
            f"No angle of {table.joint!r} is allowed at every angle of {table.by!r}: the lower limits reach "
            f"{least:g}, the upper ones come down to {most:g}. Leave more than {2 * CLEARANCE:g} rad between them."
        )
    return k, names.index(table.by), np.array(table.at), np.array(table.lower), np.array(table.upper)


def _is_servo(model: mujoco.MjModel, actuator: int) -> bool:
    gain, bias = model.actuator_gainprm[actuator, 0], model.actuator_biasprm[actuator, 1]
    known = int(model.actuator_trntype[actuator]) == _JOINT and int(model.actuator_dyntype[actuator]) in _FOLLOWING
    if not known or not gain == -bias != 0:
        return False
    return int(model.jnt_type[model.actuator_trnid[actuator, 0]]) in _ONE_DOF
