"""The physics of a frame: servos follow set-points that move at constant speed, and joints stay inside their limits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from somatopy._jit import jit
from somatopy.bodies.base import Diverged
from somatopy.bodies.constants import Constants, places
from somatopy.bodies.engine import call, function
from somatopy.bodies.layout import Layout
from somatopy.bodies.limits import hold_inside
from somatopy.bodies.model import Build
from somatopy.clock import FRAME
from somatopy.percept import Floats, Ints

__all__ = ["Physics"]

_ALL = mujoco.mjtState.mjSTATE_INTEGRATION
_BAD = mujoco.mjtWarning
_FIRST_BAD = int(_BAD.mjWARN_BADQPOS)  # this warning and all after it are of values that are huge or no numbers


class Physics:
    """Moves the joints of a part of a model by physics. The part is the whole model, or nothing couples it to the rest.

    Args:
        built: the model.
        part: the part that is stepped.
        whole: the state of the whole model. References to its arrays are kept.
        layout: the joints of arm and head.

    Attributes:
        model: the model of the part.
        members: which joints of arm and head the part has, as a slice of vectors of shape (n,).
        constants: keeps the part's constants equal to those of the whole model. None if the part is the whole model.
        size: length of the part's state.
    """

    def __init__(self, built: Build, part: mujoco.MjModel, whole: mujoco.MjData, layout: Layout) -> None:
        self.model, self._whole, self._substeps = part, whole, built.substeps
        self._data = whole if part is built.model else mujoco.MjData(part)
        joints = [built.model.joint(part.joint(k).name).id for k in range(part.njnt)]
        self.constants = None if part is built.model else Constants(built.model, part, joints)
        self._there = places(built.model, joints, "qpos"), places(built.model, joints, "dof")
        names = (*layout.arm.names, *layout.head.names)
        here = [k for k, name in enumerate(names) if mujoco.mj_name2id(part, mujoco.mjtObj.mjOBJ_JOINT, name) >= 0]
        self.members = slice(here[0], here[-1] + 1)
        self._motors(built)
        mine = [part.joint(name).id for name in names[self.members]]
        self._places = part.jnt_qposadr[mine].astype(np.int64)
        ends = (ends[self.members] for ends in (layout.lower, layout.upper, layout.velocity))
        dofs = part.jnt_dofadr[mine].astype(np.int64)
        self._joints: Any = (self._data.qpos, self._data.qvel, self._places, dofs, *ends)
        self._step = function("mj_step") if built.calls_directly else 0
        self.size = mujoco.mj_stateSize(part, _ALL)
        self._marked = np.empty(self.size)

    def _motors(self, built: Build) -> None:
        """Where the servos of arm and head, and all motors of the whole model, are in this part."""
        names = [self.model.actuator(k).name for k in range(self.model.nu)]
        servos = [names.index(name) for name in built.servos if name in names]
        self._servos = self.model.actuator_ctrladr[servos].astype(np.int64)
        self._ramps = self.model.actuator_actadr[servos].astype(np.int64)
        self._commands = self._data.ctrl, self._data.act, self._servos, self._ramps
        whole = [built.model.actuator(name).id for name in names]
        self._acting = _acting(built.model, whole), _acting(self.model, range(self.model.nu))

    def begin(self, setpoint: Floats) -> None:
        """Start at rest in the posture of the whole model. The servos' set-points have the shape (n,), rad."""
        if self._data is not self._whole:
            mujoco.mj_resetData(self.model, self._data)
            self._data.qpos[:], self._data.qvel[:] = self._whole.qpos[self._there[0]], self._whole.qvel[self._there[1]]
            (ctrl, act), (mine, my_act) = self._acting
            self._data.ctrl[mine], self._data.act[my_act] = self._whole.ctrl[ctrl], self._whole.act[act]
        self._data.ctrl[self._servos] = 0.0
        self._data.act[self._ramps] = setpoint[self.members]

    def put(self, posture: Floats) -> None:
        """Stand still in a posture of arm and head, shape (n,), rad."""
        self._data.qpos[self._places], self._data.qvel[:] = posture[self.members], 0.0
        self._data.act[self._ramps] = posture[self.members]

    def show(self) -> None:
        """Copy the positions of this part's joints to the whole model."""
        if self._data is not self._whole:
            _show(self._data.qpos, self._data.qvel, self._whole.qpos, self._whole.qvel, *self._there)

    def show_at(self, places: Floats) -> None:
        """Put this part's joints in the whole model at positions that `places` has returned."""
        self._whole.qpos[self._there[0]] = places

    @property
    def places(self) -> Floats:
        """The positions of all joints of the part."""
        return np.array(self._data.qpos)

    def state(self) -> Floats:
        """Everything that is needed to continue bit for bit, shape (size,)."""
        state = np.empty(self.size)
        mujoco.mj_getState(self.model, self._data, state, _ALL)
        return state

    def restore(self, state: Floats) -> None:
        """Continue from a state."""
        mujoco.mj_setState(self.model, self._data, state, _ALL)

    def mark(self) -> None:
        """Remember the present state for `back`."""
        mujoco.mj_getState(self.model, self._data, self._marked, _ALL)

    def back(self) -> None:
        """Return to the state at the last `mark`."""
        self.restore(self._marked)

    def follow(self, before: Floats, after: Floats, now: float) -> None:
        """Let one frame pass, in which set-points move at constant speed.

        Args:
            before: set-points at the start of the frame, shape (n,), rad.
            after: set-points at its end, shape (n,), rad.
            now: time at its start, s.

        Raises:
            Diverged: a position, velocity or acceleration is huge or not finite. MuJoCo has then reset the state.
        """
        _ramp(before[self.members], after[self.members], *self._commands)
        joints = (*self._joints, self.model.opt.timestep)
        warnings = self._data.warning.number
        if self._step:
            passed = _pass(self._step, self.model._address, self._data._address, self._substeps, warnings, *joints)
        else:
            passed = self._pass(warnings, joints)
        if passed < self._substeps:
            raise Diverged(self._divergence(now + passed * self.model.opt.timestep))

    def _pass(self, warnings: Ints, joints: Any) -> int:
        """As the function of this name, through Python."""
        warnings[_FIRST_BAD:] = 0
        for passed in range(self._substeps):
            mujoco.mj_step(self.model, self._data)
            if warnings[_FIRST_BAD:].any():
                return passed
            hold_inside(*joints)
        return self._substeps

    def _divergence(self, time: float) -> str:
        """What MuJoCo's warning says: which value of which joint."""
        model, warning = self.model, self._data.warning
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


def _acting(model: mujoco.MjModel, actuators: Sequence[int]) -> tuple[Ints, Ints]:
    """Where actuators stand in `ctrl` and in `act`."""
    ctrl, act = (
        [np.arange(first[k], first[k] + count[k]) for k in actuators if count[k]]
        for first, count in (
            (model.actuator_ctrladr, model.actuator_ctrlnum),
            (model.actuator_actadr, model.actuator_actnum),
        )
    )
    return np.concatenate([np.empty(0, np.int64), *ctrl]), np.concatenate([np.empty(0, np.int64), *act])


@jit
def _show(qpos: Floats, qvel: Floats, whole_qpos: Floats, whole_qvel: Floats, there: Ints, dofs: Ints) -> None:
    for k in range(there.size):
        whole_qpos[there[k]] = qpos[k]
    for k in range(dofs.size):
        whole_qvel[dofs[k]] = qvel[k]


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
