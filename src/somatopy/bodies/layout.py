"""Where the joints of arm and head stand in a compiled model, and what limits them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import mujoco
import numpy as np

from somatopy.bodies.anatomy import Anatomy
from somatopy.bodies.base import BodyError
from somatopy.bodies.limits import CLEARANCE
from somatopy.percept import Floats, Ints, JointGroup

__all__ = ["Coupled", "Layout"]

_JOINT = int(mujoco.mjtTrn.mjTRN_JOINT)
_SLIDE = int(mujoco.mjtJoint.mjJNT_SLIDE)
_ONE_DOF = (int(mujoco.mjtJoint.mjJNT_HINGE), _SLIDE)

#: Index of the coupled joint and of the one that limits it, -1 for none; angles of the latter, lower and upper limits.
Coupled = tuple[int, int, Floats, Floats, Floats]


@dataclass(frozen=True, eq=False)
class Layout:
    """The joints of arm and head, in this order, in a compiled model.

    Attributes:
        arm: names and limits of the arm's joints.
        head: names and limits of the head's joints.
        places: where the n joints stand in `qpos`, shape (n,).
        dofs: where they stand in `qvel`, shape (n,).
        lower: lower position limits, shape (n,), rad.
        upper: upper position limits, shape (n,), rad.
        velocity: velocity limits, shape (n,), rad/s.
        coupling: how one head joint limits another, as `clip_targets` takes it.
        others: servos of all other joints, shape (k,).
        rests: where their joints stand in `qpos`, shape (k,).
    """

    arm: JointGroup
    head: JointGroup
    places: Ints
    dofs: Ints
    lower: Floats
    upper: Floats
    velocity: Floats
    coupling: Coupled
    others: Ints
    rests: Ints

    @classmethod
    def of(cls, model: mujoco.MjModel, anatomy: Anatomy) -> Self:
        """The layout of an anatomy's joints in its model.

        Raises:
            BodyError: a joint is neither hinge nor slide or has no limits, or joints that limit each other leave
                nothing free.
        """
        arm, head = (_group(model, anatomy, g.joints, g.velocity) for g in (anatomy.arm, anatomy.head))
        lower, upper, velocity = (
            np.concatenate([getattr(arm, name), getattr(head, name)]) for name in ("lower", "upper", "velocity")
        )
        joints = [model.joint(name).id for name in (*arm.names, *head.names)]
        others = [k for k in range(model.nu) if _is_servo(model, k) and model.actuator_trnid[k, 0] not in joints]
        return cls(
            arm=arm,
            head=head,
            places=model.jnt_qposadr[joints].astype(np.int64),
            dofs=model.jnt_dofadr[joints].astype(np.int64),
            lower=lower,
            upper=upper,
            velocity=velocity,
            coupling=_coupling(anatomy, (*arm.names, *head.names), lower, upper),
            others=np.array(others, np.int64),
            rests=model.jnt_qposadr[model.actuator_trnid[others, 0]].astype(np.int64),
        )


def _group(model: mujoco.MjModel, anatomy: Anatomy, names: tuple[str, ...], velocity: tuple[float, ...]) -> JointGroup:
    for name in names:
        joint = model.joint(name)
        if int(model.jnt_type[joint.id]) not in _ONE_DOF:
            raise BodyError(f"The joint {name!r} of {anatomy.model} is neither a hinge nor a slide.")
        if not model.jnt_limited[joint.id]:
            raise BodyError(f'The joint {name!r} of {anatomy.model} has no limits. Give it range="low high".')
    ranges = np.array([model.joint(name).range for name in names])
    units = tuple("m" if int(model.joint(name).type[0]) == _SLIDE else "rad" for name in names)
    return JointGroup(names, ranges[:, 0].copy(), ranges[:, 1].copy(), np.array(velocity), units)


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
    return int(model.actuator_trntype[actuator]) == _JOINT and bool(gain == -bias != 0)
