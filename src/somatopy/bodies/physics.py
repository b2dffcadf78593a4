"""The physics of a frame: servos follow ramping set-points, and no joint passes its ends."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from somatopy._jit import jit
from somatopy.bodies.base import Diverged
from somatopy.bodies.engine import call, function
from somatopy.bodies.layout import Layout
from somatopy.bodies.limits import hold_inside
from somatopy.bodies.model import Build
from somatopy.clock import FRAME
from somatopy.percept import Floats, Ints

__all__ = ["Physics"]

_BAD = mujoco.mjtWarning
_FIRST_BAD = int(_BAD.mjWARN_BADQPOS)  # this warning and all after it are of values that are huge or no numbers


class Physics:
    """Lets a model's state go on by physics.

    Args:
        built: the model.
        data: its state; its arrays are looked up once and for all.
        layout: the joints of arm and head.
    """

    def __init__(self, built: Build, data: mujoco.MjData, layout: Layout) -> None:
        self._model, self._data, self._substeps = built.model, data, built.substeps
        self._step = function("mj_step") if built.calls_directly else 0
        self._servos = np.array(built.servos, np.int64)
        self._ramps = built.model.actuator_actadr[self._servos].astype(np.int64)
        self._commands = data.ctrl, data.act, self._servos, self._ramps
        ends = layout.lower, layout.upper, layout.velocity
        self._joints: Any = (data.qpos, data.qvel, layout.places, layout.dofs, *ends)

    def rest(self, setpoint: Floats) -> None:
        """Stand still with the servos at a set-point, shape (n,), rad."""
        self._data.ctrl[self._servos] = 0.0
        self._data.act[self._ramps] = setpoint

    def follow(self, before: Floats, after: Floats, now: float) -> None:
        """Let one frame pass, from time `now` (s) on, while the set-points ramp from `before` to `after`, (n,), rad.

        Raises:
            Diverged: a position, velocity or acceleration is not finite, or huge. MuJoCo has reset the state.
        """
        _ramp(before, after, *self._commands)
        joints = (*self._joints, self._model.opt.timestep)
        warnings = self._data.warning.number
        if self._step:
            passed = _pass(self._step, self._model._address, self._data._address, self._substeps, warnings, *joints)
        else:
            passed = self._pass(warnings, joints)
        if passed < self._substeps:
            raise Diverged(self._divergence(now + passed * self._model.opt.timestep))

    def _pass(self, warnings: Ints, joints: Any) -> int:
        """As the function of this name, through Python."""
        warnings[_FIRST_BAD:] = 0
        for passed in range(self._substeps):
            mujoco.mj_step(self._model, self._data)
            if warnings[_FIRST_BAD:].any():
                return passed
            hold_inside(*joints)
        return self._substeps

    def _divergence(self, time: float) -> str:
        """What MuJoCo's warning says: which value of which joint."""
        model, warning = self._model, self._data.warning
        kind = _FIRST_BAD + int(warning.number[_FIRST_BAD:].argmax())
        of_places = np.repeat(np.arange(model.njnt), np.diff([*model.jnt_qposadr, model.nq]))
        value, joints = {
            _BAD.mjWARN_BADQPOS: ("position", of_places),
            _BAD.mjWARN_BADQVEL: ("velocity", model.dof_jntid),
            _BAD.mjWARN_BADQACC: ("acceleration", model.dof_jntid),
            _BAD.mjWARN_BADCTRL: ("control", model.actuator_trnid[:, 0]),
        }[_BAD(kind)]
        joint = model.joint(joints[warning.lastinfo[kind]]).name
        return (
            f"The robot's physics became unstable at {time:.4f} s: the {value} of the joint {joint!r} is huge or no "
            f'number. Try a smaller physics step than {model.opt.timestep:g} s (<option timestep="..."/>), softer '
            "servos (kp, kv), or the kinematic motion."
        )


@jit
def _ramp(before: Floats, after: Floats, ctrl: Floats, act: Floats, servos: Ints, ramps: Ints) -> None:
    """Set-points stand in `act`; `ctrl` is their speed, rad/s."""
    for k in range(servos.size):
        ctrl[servos[k]] = (after[k] - before[k]) / FRAME
        act[ramps[k]] = before[k]


@jit
def _pass(
    step: int,
    model: int,
    data: int,
    substeps: int,
    warnings: Ints,
    qpos: Floats,
    qvel: Floats,
    places: Ints,
    dofs: Ints,
    lower: Floats,
    upper: Floats,
    velocity: Floats,
    duration: float,
) -> int:
    """Number of physics steps before one that went wrong; all of them if none did."""
    warnings[_FIRST_BAD:] = 0
    for passed in range(substeps):
        call(step, model, data)
        if warnings[_FIRST_BAD:].any():
            return passed
        hold_inside(qpos, qvel, places, dofs, lower, upper, velocity, duration)
    return substeps
