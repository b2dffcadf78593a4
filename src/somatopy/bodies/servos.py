"""Computes gains for position servos from the inertia and the load of each joint."""

from __future__ import annotations

import mujoco
import numpy as np

from somatopy.bodies.additions import add
from somatopy.bodies.anatomy import Anatomy, Servo
from somatopy.bodies.foreign import prepare
from somatopy.bodies.loading import compiled, parse
from somatopy.clock import FRAME
from somatopy.percept import Floats, Ints

__all__ = ["proposed_servos"]

_POSTURES = 64
_FREQUENCY = 2 * np.pi * 10.0  # rad/s
_SAG = 0.015  # rad, or m
_LATE = 0.1  # s
_RESOLVED = 0.5  # rad a physics step


def proposed_servos(anatomy: Anatomy) -> dict[str, Servo]:
    """Gains with which position servos can move the joints of arm and head, computed from the model.

    For each joint let :math:`I` be the inertia that it moves if all other joints hamper it as much as they can. Let
    :math:`m` be the load that it holds: gravity, springs and friction. Both are the largest over postures inside the
    limits. With the joint's damping :math:`d` and the physics step :math:`h`:

    .. math::
        k_p = \\max(I \\omega^2, \\; m / 0.015, \\; d / 0.1 s), \\qquad k_v = 2 \\sqrt{k_p I} - d

    The first term of the maximum is the stiffness of a servo of 10 Hz (:math:`\\omega = 2 \\pi \\cdot 10` rad/s), which
    can follow the babbling. The second term keeps the joint from sagging by more than 0.015 rad. The third term moves a
    joint that has a damping of its own within a tenth of a second. :math:`k_v` damps the joint critically, so that it
    does not overshoot. If the physics step is too long for such a stiffness, :math:`k_p` is the largest that it can
    resolve: :math:`I (0.5 / h)^2`. It is stable for any smaller inertia, since [add.servos] are damped implicitly.

    The force limit is that of the model, if the model has one that exceeds the load by a quarter. Otherwise it is twice
    the load, plus the force that starts a movement of 0.3 rad.

    Args:
        anatomy: the anatomy of a model with arm and head. Its own [add.servos] are ignored.

    Returns:
        A servo for each joint, those of the arm first. Its gains have three significant digits.

    Raises:
        BodyError: model and anatomy do not fit.

    Example:
        >>> from somatopy.bodies import MODELS
        >>> servos = proposed_servos(Anatomy.load(MODELS["nao"]))
        >>> list(servos)
        ['LShoulderPitch', 'LShoulderRoll', 'LElbowYaw', 'LElbowRoll', 'HeadYaw', 'HeadPitch']
    """
    bare = anatomy.model_copy(update={"add": anatomy.add.model_copy(update={"servos": {}})})
    spec = parse(bare.model)
    prepare(spec, bare.model)
    home = add(spec, bare)
    model = compiled(spec, bare.model)
    data = mujoco.MjData(model)
    if home is not None:
        mujoco.mj_resetDataKeyframe(model, data, model.key(home).id)
    servos = {}
    for group in (anatomy.arm, anatomy.head):
        joints = np.array([model.joint(name).id for name in group.joints])
        for name, joint, inertia, held in zip(group.joints, joints, *_loads(model, data, joints), strict=True):
            servos[name] = _servo(model, int(joint), inertia, held)
    return servos


def _loads(model: mujoco.MjModel, data: mujoco.MjData, joints: Ints) -> Floats:
    """The largest inertia that each joint moves, kg m^2, and the largest torque that holds it, N m, shape (2, n)."""
    rng, home = np.random.default_rng(0), data.qpos.copy()
    dofs, places = model.jnt_dofadr[joints], model.jnt_qposadr[joints]
    limits = np.where(model.jnt_limited[joints, None] != 0, model.jnt_range[joints], [-np.pi, np.pi])
    inside = rng.uniform(limits[:, 0], limits[:, 1], (_POSTURES, len(joints)))
    postures = np.vstack([home[places], limits.T, inside])
    return np.asarray(np.max([_felt(model, data, places, dofs, posture) for posture in postures], axis=0))


def _felt(model: mujoco.MjModel, data: mujoco.MjData, places: Ints, dofs: Ints, posture: Floats) -> Floats:
    """Inertia and load in a posture, shape (2, n).

    Where joints move together, the inertia of some motion may be more than that of each joint alone. The diagonal is
    scaled up until no motion has more.
    """
    data.qpos[places], data.qvel[:] = posture, 0.0
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    held = np.abs(data.qfrc_bias - data.qfrc_passive) + model.dof_frictionloss
    mass, alone = mass[np.ix_(dofs, dofs)], mass.diagonal()[dofs]
    together = np.linalg.eigvalsh(mass / np.sqrt(np.outer(alone, alone)))[-1]
    return np.array([together * alone, held[dofs]])


def _servo(model: mujoco.MjModel, joint: int, inertia: float, held: float) -> Servo:
    damping = float(model.dof_damping[model.jnt_dofadr[joint]])
    step = FRAME / np.ceil(FRAME / model.opt.timestep - 1e-6)
    kp = min(max(inertia * _FREQUENCY**2, held / _SAG, damping / _LATE), inertia * (_RESOLVED / step) ** 2)
    kv = max(2 * np.sqrt(kp * inertia) - damping, 0.0)
    force = _force_limit(model, joint)
    if force < 1.25 * held or not np.isfinite(force):
        force = 2 * held + 0.3 * kp
    return Servo(kp=_rounded(kp), kv=_rounded(kv), force=_rounded(force))


def _force_limit(model: mujoco.MjModel, joint: int) -> float:
    """What the model lets motors exert on a joint, N m; infinite where it says nothing."""
    limits = [np.inf]
    if model.jnt_actfrclimited[joint]:
        limits.append(np.abs(model.jnt_actfrcrange[joint]).min())
    by_joint = model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_JOINT)
    for k in np.flatnonzero(by_joint & (model.actuator_trnid[:, 0] == joint)):
        gear, plain = abs(model.actuator_gear[k, 0]), model.actuator_biastype[k] == int(mujoco.mjtBias.mjBIAS_NONE)
        if model.actuator_forcelimited[k]:
            limits.append(gear * np.abs(model.actuator_forcerange[k]).min())
        if plain and model.actuator_ctrllimited[k]:
            gain = abs(model.actuator_gainprm[k, 0])
            limits.append(gear * gain * np.abs(model.actuator_ctrlrange[k]).min())
    return float(min(limits))


def _rounded(value: float) -> float:
    return float(f"{value:.3g}")
