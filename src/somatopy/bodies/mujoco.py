"""Any MuJoCo model with an anatomy file as a body: physics or kinematics, camera, marker, limits."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import Any, Literal

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from somatopy.bodies.anatomy import Anatomy, anatomy_path
from somatopy.bodies.base import BodyError
from somatopy.bodies.limits import CLEARANCE, advance_setpoints, clip_targets, hold_inside
from somatopy.bodies.marker import SITE
from somatopy.bodies.model import FRAME, Build, build
from somatopy.bodies.occluders import Occluders
from somatopy.bodies.rendering import Renderer
from somatopy.percept import Camera, Floats, Image, JointGroup, Marker, Reading, View

__all__ = ["Motion", "MujocoBody"]

Motion = Literal["dynamic", "kinematic"]
_JOINT = int(mujoco.mjtTrn.mjTRN_JOINT)
_ONE_DOF = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))


class MujocoBody:
    """A robot simulated by MuJoCo, described by an MJCF and an anatomy file.

    Set-points move towards the targets at constant speed, as NAOqi's setAngles does. `dynamic`: the model's position
    servos follow them under gravity, contact and torque limits. `kinematic`: the joints are where the set-points are.
    Arm and head pass through each other; frames in which they do are marked in the reading.

    Args:
        anatomy: an Anatomy, the path of an anatomy file, or the name of a body that comes with somatopy.
        motion: "dynamic" or "kinematic".
        arm_speed: speed of the arm's set-points, rad/s; the velocity limits where None.
        head_speed: the same for the head.
        marker: the cube of tags on the hand.

    Attributes:
        arm: names and limits of the arm's joints.
        head: names and limits of the head's joints.
        camera: the camera that the eye looks through.
        marker: the cube of tags.
        occluders: what can stand between camera and marker; their poses are in each reading's view.
        model: the compiled MuJoCo model.
        data: its state.
        render_s: seconds spent on drawing so far.

    Raises:
        BodyError: model and anatomy do not fit; the message lists what there is.

    Example:
        >>> body = MujocoBody("nao", motion="kinematic")
        >>> reading = body.reset()
        >>> reading = body.step(arm=reading.arm, head=[0.5, 0.2])
        >>> reading.head.round(3)
        array([0.5, 0.2])
        >>> body.close()
    """

    def __init__(
        self,
        anatomy: Anatomy | str | Path = "nao",
        motion: Motion = "dynamic",
        arm_speed: float | None = 0.8,
        head_speed: float | None = None,
        marker: Marker | None = None,
    ) -> None:
        if motion not in ("dynamic", "kinematic"):
            raise BodyError(f"Motion {motion!r} is unknown; choose dynamic or kinematic.")
        for part, speed in (("arm_speed", arm_speed), ("head_speed", head_speed)):
            if speed is not None and not 0 < speed < np.inf:
                raise BodyError(f"{part} must be a positive number of rad/s, not {speed!r}.")
        self.anatomy = anatomy if isinstance(anatomy, Anatomy) else Anatomy.load(anatomy_path(str(anatomy)))
        self.motion = motion
        self.marker = marker or Marker()
        built = build(self.anatomy, self.marker, servos=motion == "dynamic")
        self.model, self._substeps = built.model, built.substeps
        self.data = mujoco.MjData(self.model)
        self.arm = self._group(self.anatomy.arm.joints, self.anatomy.arm.velocity)
        self.head = self._group(self.anatomy.head.joints, self.anatomy.head.velocity)
        self._n_arm = len(self.arm)
        self._index(built)
        speeds = [np.minimum(g.velocity, s or np.inf) for g, s in ((self.arm, arm_speed), (self.head, head_speed))]
        self._stride = np.concatenate(speeds) * FRAME
        name, size = self.anatomy.camera.name, (self.anatomy.camera.width, self.anatomy.camera.height)
        self.camera = Camera(name, *size, fovy=float(np.deg2rad(self.model.camera(name).fovy[0])))
        self.render_s = 0.0
        self._renderers: dict[tuple[str, int, int], Renderer] = {}
        self._imagined: mujoco.MjData | None = None
        self._frame = 0
        self.reset()

    # -- the contract ------------------------------------------------------------------------------------------------

    def reset(self, seed: int | None = None) -> Reading:
        """Stand in the home posture at time 0. The body has no noise: `seed` changes nothing."""
        self._go_home(self.data)
        self._frame = 0
        self._setpoint = self.data.qpos[self._qpos]
        clip_targets(self._setpoint, self._lower, self._upper, *self._coupling)
        self.data.qpos[self._qpos] = self._setpoint
        self._target = self._setpoint.copy()
        for servo, qpos in self._others.items():
            self.data.ctrl[servo] = self.data.qpos[qpos]
        if self.motion == "dynamic":
            self.data.ctrl[self._servo] = 0.0
            self.data.act[self._act] = self._setpoint
        return self._sense(0.0)

    def step(self, arm: ArrayLike, head: ArrayLike) -> Reading:
        """Move for one frame (1/15 s) towards the targets, clipped to all limits, and sense.

        Args:
            arm: arm target, shape (n_arm,), rad.
            head: head target, shape (n_head,), rad.

        Raises:
            ValueError: a target of wrong length or not finite.
        """
        self._target = np.concatenate([self._checked("arm", arm, self.arm), self._checked("head", head, self.head)])
        clip_targets(self._target, self._lower, self._upper, *self._coupling)
        sensed = self.data.qpos[self._qpos]
        before = self._setpoint.copy()
        advance_setpoints(self._setpoint, sensed, self._target, self._stride, *self._coupling)
        if self.motion == "dynamic":
            self._follow(before)
        else:
            self.data.qpos[self._qpos] = self._setpoint
        self._frame += 1
        return self._sense(FRAME)

    def state(self) -> dict[str, Any]:
        """MuJoCo's full integration state, set-points, targets and the frame count."""
        physics = np.empty(mujoco.mj_stateSize(self.model, mujoco.mjtState.mjSTATE_INTEGRATION))
        mujoco.mj_getState(self.model, self.data, physics, mujoco.mjtState.mjSTATE_INTEGRATION)
        return {
            "physics": physics,
            "setpoint": self._setpoint.copy(),
            "target": self._target.copy(),
            "frame": np.int64(self._frame),
        }

    def restore(self, state: dict[str, Any]) -> Reading:
        """Continue bit for bit from a `state()` of the same body."""
        mujoco.mj_setState(self.model, self.data, state["physics"], mujoco.mjtState.mjSTATE_INTEGRATION)
        self._setpoint = np.array(state["setpoint"], float)
        self._target = np.array(state["target"], float)
        self._frame = int(state["frame"])
        return self._sense(FRAME if self._frame else 0.0)

    def close(self) -> None:
        """Free the renderers; a second call does nothing."""
        for renderer in self._renderers.values():
            renderer.close()
        self._renderers.clear()

    def picture(self, camera: str | None = None, width: int | None = None, height: int | None = None) -> Image:
        """Draw the robot as one of the model's cameras sees it now, (height, width, 3); its own by default."""
        key = camera or self.camera.name, width or self.camera.width, height or self.camera.height
        if key not in self._renderers:
            cameras = [self.model.camera(k).name for k in range(self.model.ncam)]
            if key[0] not in cameras:
                raise BodyError(f"The camera {key[0]!r} does not exist. Available: {', '.join(cameras)}.")
            self.model.vis.global_.offwidth, self.model.vis.global_.offheight = key[1:]
            self._renderers[key] = Renderer(self.model, *key)
        return self._renderers[key].render(self.data)

    def place(self, arm: ArrayLike, head: ArrayLike) -> Reading:
        """Put the robot at rest into a posture, at once and without clipping, and sense; for pictures and tests.

        Args:
            arm: arm posture, shape (n_arm,), rad.
            head: head posture, shape (n_head,), rad.
        """
        self._setpoint = np.concatenate([self._checked("arm", arm, self.arm), self._checked("head", head, self.head)])
        self._target = self._setpoint.copy()
        self.data.qpos[self._qpos], self.data.qvel[:] = self._setpoint, 0.0
        if self.motion == "dynamic":
            self.data.act[self._act] = self._setpoint
        return self._sense(0.0)

    def view(self, arm: ArrayLike, head: ArrayLike) -> View:
        """True poses at any posture, without moving the robot; nothing is clipped.

        Args:
            arm: arm posture, shape (n_arm,), rad.
            head: head posture, shape (n_head,), rad.
        """
        if self._imagined is None:
            self._imagined = mujoco.MjData(self.model)
            self._go_home(self._imagined)
        self._imagined.qpos[self._qpos[: self._n_arm]] = arm
        self._imagined.qpos[self._qpos[self._n_arm :]] = head
        for refresh in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_camlight):
            refresh(self.model, self._imagined)
        return self._view(self._imagined)

    def legal(self, head: ArrayLike) -> Floats:
        """A head posture, shape (n_head,), rad, clipped to all limits, the coupled ones included."""
        posture = np.concatenate([self.arm.lower, np.asarray(head, float)])
        clip_targets(posture, self._lower, self._upper, *self._coupling)
        return posture[self._n_arm :]

    def allows(self, head: ArrayLike) -> bool:
        """Whether a head posture, shape (n_head,), rad, is inside all limits."""
        return bool((self.legal(head) == head).all())

    # -- moving and sensing ------------------------------------------------------------------------------------------

    def _go_home(self, data: mujoco.MjData) -> None:
        home = self.anatomy.home
        if home is None:
            mujoco.mj_resetData(self.model, data)
        else:
            mujoco.mj_resetDataKeyframe(self.model, data, self.model.key(home).id)

    def _follow(self, before: Floats) -> None:
        """Let the servos track set-points that ramp from `before` to the new ones, and the physics pass."""
        self.data.ctrl[self._servo] = (self._setpoint - before) / FRAME
        self.data.act[self._act] = before
        for _ in range(self._substeps):
            mujoco.mj_step(self.model, self.data)
            hold_inside(self.data.qpos, self.data.qvel, *self._joint_limits, self.model.opt.timestep)

    def _sense(self, dt: float) -> Reading:
        """Bring poses and contacts up to the posture, as a step ends before they are, and read them."""
        for refresh in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_camlight, mujoco.mj_collision):
            refresh(self.model, self.data)
        posture = self.data.qpos[self._qpos]
        split = self._n_arm
        return Reading(
            time=self._frame * FRAME,
            arm=posture[:split],
            head=posture[split:],
            arm_command=self._target[:split].copy(),
            head_command=self._target[split:].copy(),
            dt=dt,
            overlap=self.data.ncon > 0 and bool((self._side[self.data.contact.geom].sum(axis=1) == 3).any()),
            image=self._photographer(),
            view=self._view(self.data),
        )

    def _view(self, data: mujoco.MjData) -> View:
        camera, site = self._camera_id, self._site_id
        return View(
            camera=np.concatenate([data.cam_xpos[camera], data.cam_xmat[camera]]),
            marker=np.concatenate([data.site_xpos[site], data.site_xmat[site]]),
            occluders=self._occluders.poses(data),
        )

    def _photographer(self) -> Callable[[], Image]:
        """A function that draws this frame's picture once, and only while the body is still in this frame."""
        frame, drawn = self._frame, []  # type: ignore[var-annotated]
        self._sensed = moment = object()

        def image() -> Image:
            if not drawn:
                if moment is not self._sensed:
                    raise RuntimeError(f"The picture of frame {frame} was not taken before the body moved on.")
                start = perf_counter()
                drawn.append(self.picture())
                self.render_s += perf_counter() - start
            return drawn[0]

        return image

    @staticmethod
    def _checked(part: str, target: ArrayLike, group: JointGroup) -> Floats:
        values = np.array(target, float)
        if values.shape != (len(group),):
            raise ValueError(f"The {part} target has shape {values.shape}; {len(group)} joints: {list(group.names)}.")
        if not np.isfinite(values).all():
            raise ValueError(f"The {part} target {values.tolist()} is not finite.")
        return values

    # -- building ----------------------------------------------------------------------------------------------------

    def _index(self, built: Build) -> None:
        names = (*self.arm.names, *self.head.names)
        self._qpos = np.array([self.model.joint(n).qposadr[0] for n in names])
        self._lower = np.concatenate([self.arm.lower, self.head.lower])
        self._upper = np.concatenate([self.arm.upper, self.head.upper])
        joints = [self.model.joint(n).id for n in names]
        velocity = np.concatenate([self.arm.velocity, self.head.velocity])
        self._joint_limits = self._qpos, self.model.jnt_dofadr[joints].astype(int), self._lower, self._upper, velocity
        self._servo = np.array(built.servos, int)
        self._act = self.model.actuator_actadr[self._servo]
        driven = enumerate(self.model.actuator_trnid[:, 0])
        self._others = {k: self.model.jnt_qposadr[j] for k, j in driven if self._is_servo(k) and j not in joints}
        self._coupling = self._couple(names)
        self._camera_id = self.model.camera(self.anatomy.camera.name).id
        self._site_id = self.model.site(SITE).id
        self._occluders = Occluders(self.model)
        self.occluders = self._occluders.shapes
        self._side = np.zeros(self.model.ngeom, int)
        for side, geoms in ((1, built.arm_solids), (2, built.head_solids)):
            self._side[[self.model.geom(n).id for n in geoms]] = side

    def _couple(self, names: tuple[str, ...]) -> tuple[int, int, Floats, Floats, Floats]:
        table = self.anatomy.head.coupling
        if table is None:
            return -1, -1, np.zeros(1), np.zeros(1), np.zeros(1)
        k = names.index(table.joint)
        least, most = max(*table.lower, self._lower[k]), min(*table.upper, self._upper[k])
        if least + 2 * CLEARANCE >= most:
            raise BodyError(
                f"No angle of {table.joint!r} is allowed at every angle of {table.by!r}: the lower limits reach "
                f"{least:g}, the upper ones come down to {most:g}. Leave more than {2 * CLEARANCE:g} rad between them."
            )
        return k, names.index(table.by), np.array(table.at), np.array(table.lower), np.array(table.upper)

    def _is_servo(self, actuator: int) -> bool:
        gain, bias = self.model.actuator_gainprm[actuator, 0], self.model.actuator_biasprm[actuator, 1]
        return int(self.model.actuator_trntype[actuator]) == _JOINT and bool(gain == -bias != 0)

    def _group(self, names: tuple[str, ...], velocity: tuple[float, ...]) -> JointGroup:
        for name in names:
            joint = self.model.joint(name)
            if int(self.model.jnt_type[joint.id]) not in _ONE_DOF:
                raise BodyError(f"The joint {name!r} of {self.anatomy.model} is neither a hinge nor a slide.")
            if not self.model.jnt_limited[joint.id]:
                raise BodyError(f'The joint {name!r} of {self.anatomy.model} has no limits. Give it range="low high".')
        ranges = np.array([self.model.joint(name).range for name in names])
        return JointGroup(names, ranges[:, 0].copy(), ranges[:, 1].copy(), np.array(velocity))
