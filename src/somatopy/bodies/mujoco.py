"""A body made from any MuJoCo model and an anatomy file, moved by physics or by kinematics."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from copy import copy
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Literal, Self

import mujoco
import numpy as np
from annotated_types import Gt, Lt
from numpy.typing import ArrayLike
from typing_extensions import Doc

from somatopy.bodies.alterations import Alterations
from somatopy.bodies.anatomy import Anatomy, anatomy_path
from somatopy.bodies.arm_track import Arm, ArmTrack, kept_track
from somatopy.bodies.base import BodyError, Diverged
from somatopy.bodies.cameras import eye_camera
from somatopy.bodies.constants import saved
from somatopy.bodies.foreign import check_joints, check_scale
from somatopy.bodies.layout import Layout
from somatopy.bodies.limits import aim, clip_targets
from somatopy.bodies.model import Build, build
from somatopy.bodies.motion import Dynamic, Kinematic
from somatopy.bodies.occluders import Occluders
from somatopy.bodies.rendering import Renderer
from somatopy.bodies.sensing import Sensing
from somatopy.clock import FRAME
from somatopy.percept import Floats, Image, JointGroup, Marker, Part, Picture, Reading, View
from somatopy.registry import BuildContext, Settings

__all__ = ["Motion", "Mujoco", "MujocoBody", "OnHand", "Optics"]

Motion = Literal["dynamic", "kinematic"]


class MujocoBody(Alterations):
    """A robot simulated by MuJoCo, described by a model (MJCF or URDF) and an anatomy file.

    Set-points move towards the targets at constant speed, as those of NAOqi's setAngles do. With the motion "dynamic",
    the model's position servos follow the set-points under gravity, contact and torque limits. Filters of the servos
    are removed. With the motion "kinematic", the joints are always at their set-points. Arm and head can pass through
    each other, and readings mark the frames in which they do. The anatomy can add to the model: a fixed base, a neck, a
    camera, limits, servos.

    Args:
        anatomy: an Anatomy, the path of an anatomy file, or the name of a body that comes with somatopy.
        motion: "dynamic" or "kinematic".
        arm_speed: speed of the arm's set-points, rad/s. With None they move at the velocity limits.
        head_speed: speed of the head's set-points, likewise.
        marker: the cube of tags on the hand.
        fovy: vertical field of view of the camera, degrees. With None it is that of the model.

    Attributes:
        arm: names and limits of the arm's joints.
        head: names and limits of the head's joints.
        camera: the camera that the eye looks through.
        marker: the cube of tags.
        occluders: shapes that can stand between camera and marker. Their poses are in the view of each reading.
        arm_moves_alone: whether nothing couples arm and head, so that the arm moves the same to the last bit whatever
            the head does.
        ranges: babbling ranges by name, shape (n_arm, 2), rad. They are those of the anatomy, and "mechanical", the
            joint limits. Presets babble in "confined" or in "wide". If the anatomy has no wide range, the confined one
            takes its place. If it has no confined range, the joint limits do.
        model: the compiled MuJoCo model.
        data: the model's state. If arm and head are stepped apart, its joint positions and poses are up to date, and
            its velocities and forces are not. Writing into it then moves nothing: change the model instead.

    Raises:
        BodyError: model and anatomy do not fit. The message lists what there is.

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
        fovy: float | None = None,
    ) -> None:
        if motion not in ("dynamic", "kinematic"):
            raise BodyError(f"Motion {motion!r} is unknown; choose dynamic or kinematic.")
        for part, speed in (("arm_speed", arm_speed), ("head_speed", head_speed)):
            if speed is not None and not 0 < speed < np.inf:
                raise BodyError(f"{part} must be a positive number of rad/s, not {speed!r}.")
        if fovy is not None and not 0 < fovy < 180:
            raise BodyError(f"fovy must be between 0 and 180 degrees, not {fovy!r}.")
        self.anatomy = anatomy if isinstance(anatomy, Anatomy) else Anatomy.load(anatomy_path(str(anatomy)))
        self.motion = motion
        self.marker = marker or Marker()
        self._speeds = arm_speed or np.inf, head_speed or np.inf
        self._take(build(self.anatomy, self.marker, servos=motion == "dynamic", fovy=fovy))
        check_scale(self._sensing.view(), self.camera, self.marker, self.anatomy)

    def _take(self, built: Build) -> None:
        """Be the robot of this model, at its start."""
        self._built, self.model, self.data = built, built.model, mujoco.MjData(built.model)
        self._positions = self.data.qpos  # the same array each time; to ask for it takes longer than to read it
        self._layout = Layout.of(self.model, self.anatomy)
        self.arm, self.head = self._layout.arm, self._layout.head
        for joints in (self.arm, self.head):
            check_joints(joints, self.anatomy)
        groups = zip((self.arm, self.head), self._speeds, strict=True)
        self._stride = FRAME * np.concatenate([np.minimum(group.velocity, speed) for group, speed in groups])
        self.ranges: Mapping[str, Floats] = MappingProxyType(self._layout.ranges(self.anatomy))
        self.camera = eye_camera(self.model, self.anatomy)
        self._limits: Any = self._layout.lower, self._layout.upper, *self._layout.coupling
        self._occluders = Occluders(self.model)
        self.occluders = self._occluders.shapes
        self._sensing = self._sensing_of(self.data)
        moving = Dynamic if self.motion == "dynamic" else Kinematic
        self._motion = moving(built, self.data, self._layout)
        self.arm_moves_alone = self._motion.arm_moves_alone
        self._renderers: dict[tuple[str, int, int], Renderer] = {}
        self._imagined: mujoco.MjData | None = None
        self.reset()

    # -- the contract ------------------------------------------------------------------------------------------------

    def reset(self, seed: int | None = None) -> Reading:
        """Stand in the home posture at time 0. Since the body has no noise, `seed` changes nothing."""
        self._go_home(self.data)
        self._frame = 0
        self._setpoint = self.data.qpos[self._layout.places]
        self._clip(self._setpoint)
        self.data.qpos[self._layout.places] = self._setpoint
        self._target = self._setpoint.copy()
        self._layout.rest.hold(self.data)
        self._motion.begin(self._setpoint)
        return self._sense(0.0)

    def step(self, arm: ArrayLike, head: ArrayLike) -> Reading:
        """Move for one frame (1/15 s) towards the targets, clipped to all limits, and sense.

        Args:
            arm: arm target, shape (n_arm,), rad.
            head: head target, shape (n_head,), rad.

        Raises:
            ValueError: a target has a wrong length, or is not finite.
            Diverged: the physics became unstable. The body is then in the state before this step.
        """
        targets = _vector("arm", arm, self.arm), _vector("head", head, self.head)
        sensed, before, aimed = self._positions[self._layout.places], self._setpoint.copy(), self._target.copy()
        if not aim(targets[0], targets[1], self._target, self._setpoint, sensed, self._stride, *self._limits):
            raise _not_finite(*targets)
        try:
            self._motion.move(before, self._setpoint, self._target, self._frame)
        except Diverged:
            self._setpoint, self._target = before, aimed
            self._sense(FRAME)
            raise
        self._frame += 1
        return self._sense(FRAME)

    def state(self) -> dict[str, Any]:
        """Everything that a later `restore` needs: the physical state, set-points, targets and the number of frames."""
        return {
            "physics": self._motion.state(self._frame),
            "setpoint": self._setpoint.copy(),
            "target": self._target.copy(),
            "frame": np.int64(self._frame),
        }

    def restore(self, state: dict[str, Any]) -> Reading:
        """Continue bit for bit from a `state()` of the same body."""
        self._setpoint = np.array(state["setpoint"], float)
        self._target = np.array(state["target"], float)
        self._frame = int(state["frame"])
        self._motion.restore(np.asarray(state["physics"], float), self._frame, self._setpoint)
        return self._sense(FRAME if self._frame else 0.0)

    def use_track(self, track: ArmTrack) -> bool:
        """Take the arm's movement from a track. All readings and states stay the same to the last bit.

        The track is used from this frame on, until it ends. It is given up earlier if the arm's target is not that of
        the track, if a constant of the model changes, or if the body is placed or restored elsewhere. Physics then
        moves the arm.

        Returns:
            Whether the track is used. It is not if the arm is not in the state that the track has at this frame, or
            if the arm moves without physics or depends on the head.
        """
        return self._motion.use(track, self.arm, self._stride[: len(self.arm)], self._frame, self._setpoint)

    def share_arm(self, key: bytes, frames: int, commands: Callable[[], Floats] | None) -> bool:
        """Take the arm's movement from the user's cache; see `somatopy.contract.SharesArm`.

        If the physics of the arm becomes unstable during that movement, no track is used, and the run ends with the
        frame in which this happens.
        """
        try:
            track = kept_track(self, key, frames, commands)
        except Diverged:
            return False
        return track is not None and self.use_track(track)

    def unshare_arm(self) -> None:
        """Move the arm by its own physics from now on; see `somatopy.contract.SharesArm`."""
        self.drop_track()

    def drop_track(self) -> None:
        """Move the arm without a track from now on."""
        self._motion.drop(self._frame)

    @property
    def tracked(self) -> bool:
        """Whether the arm's movement is taken from a track."""
        return self._motion.tracked

    def arm_alone(self) -> Arm:
        """The arm, which can be moved without the rest of this body. Meanwhile the body itself must not move.

        Raises:
            ValueError: the arm moves without physics, or depends on the head.
        """
        if not (isinstance(self._motion, Dynamic) and self.arm_moves_alone):
            raise ValueError(f"The arm of {self.anatomy.name} ({self.motion}) does not move by physics and alone.")
        arm = Arm(self._motion.parts[0], self.arm, self._stride[: len(self.arm)])
        arm.setpoint[:] = self._setpoint[: len(self.arm)]
        return arm

    def close(self) -> None:
        """Free the renderers. A second call does nothing."""
        for renderer in self._renderers.values():
            renderer.close()
        self._renderers.clear()

    def picture(
        self,
        camera: str | None = None,
        width: int | None = None,
        height: int | None = None,
        part: Part | None = None,
    ) -> Image:
        """Draw the robot as one of the model's cameras sees it now, RGB, shape (height, width, 3).

        Args:
            camera: the camera's name. With None it is the camera that the eye looks through.
            width: width of the picture, px. With None it is that of the eye's camera.
            height: height of the picture, px. With None it is that of the eye's camera.
            part: left, top, right and bottom, px, of the part to draw. Its pixels are the same as in the whole picture.
        """
        key = camera or self.camera.name, width or self.camera.width, height or self.camera.height
        if key not in self._renderers:
            cameras = [self.model.camera(k).name for k in range(self.model.ncam)]
            if key[0] not in cameras:
                raise BodyError(f"The camera {key[0]!r} does not exist. Available: {', '.join(cameras)}.")
            self.model.vis.global_.offwidth, self.model.vis.global_.offheight = key[1:]
            self._renderers[key] = Renderer(self.model, *key)
        return self._renderers[key].render(self.data, part)

    def place(self, arm: ArrayLike, head: ArrayLike) -> Reading:
        """Put the robot at rest into a posture, at once and without clipping, and sense. Pictures and tests use this.

        Args:
            arm: arm posture, shape (n_arm,), rad.
            head: head posture, shape (n_head,), rad.
        """
        targets = _vector("arm", arm, self.arm), _vector("head", head, self.head)
        if not all(np.isfinite(target).all() for target in targets):
            raise _not_finite(*targets)
        self._setpoint = np.concatenate(targets)
        self._target = self._setpoint.copy()
        self._motion.drop(self._frame)
        self._motion.put(self._setpoint)
        return self._sense(0.0)

    def view(self, arm: ArrayLike, head: ArrayLike) -> View:
        """The true poses at any posture, which is not clipped. The robot does not move.

        Args:
            arm: arm posture, shape (n_arm,), rad.
            head: head posture, shape (n_head,), rad.
        """
        if self._imagined is None:
            self._imagined = mujoco.MjData(self.model)
            self._go_home(self._imagined)
            self._imagination = self._sensing_of(self._imagined)
        self._imagined.qpos[self._layout.places] = np.concatenate([arm, head])
        return self._imagination.view()

    def legal(self, head: ArrayLike) -> Floats:
        """A head posture, shape (n_head,), rad, clipped to all limits, the coupled ones included."""
        posture = np.concatenate([self.arm.lower, np.asarray(head, float)])
        self._clip(posture)
        return posture[len(self.arm) :]

    def fingerprint(self) -> bytes:
        """A hash of the model as it is now, with its injuries, and of motion, speeds, anatomy, camera and marker.

        It does not depend on the place of the model's file, nor on pictures that were drawn.
        """
        anatomy = self.anatomy.model_copy(update={"model": Path(self.anatomy.model.name)})
        said = (mujoco.mj_versionString(), self.motion, self._stride.tolist(), anatomy, self.camera, self.marker)
        return hashlib.sha256(saved(self.model) + repr(said).encode()).digest()

    def arm_fingerprint(self) -> bytes:
        """A hash of everything that the arm's movement depends on, except its targets, where it moves alone."""
        arm = self.another().arm_alone()
        limits = self.arm.lower, self.arm.upper, self.arm.velocity, self._stride[: len(self.arm)]
        said = [values.tobytes() for values in (*limits, arm.setpoint, arm.part.state())]
        return hashlib.sha256(saved(arm.part.model) + repr(self.arm.names).encode() + b"".join(said)).digest()

    def another(self) -> Self:
        """A second body at its start. It has a copy of the present model, with its injuries.

        Its limits, camera and occluders are read from that copy. The caller must close it.
        """
        second = copy(self)
        model = copy(self.model)
        parts = tuple(model if part is self.model else copy(part) for part in self._built.parts)
        second._take(replace(self._built, model=model, parts=parts))
        return second

    # -- moving and sensing ------------------------------------------------------------------------------------------

    def _go_home(self, data: mujoco.MjData) -> None:
        home = self._built.home
        if home is None:
            mujoco.mj_resetData(self.model, data)
        else:
            mujoco.mj_resetDataKeyframe(self.model, data, self.model.key(home).id)

    def _sensing_of(self, data: mujoco.MjData) -> Sensing:
        return Sensing(self._built, data, self.camera.name, self._occluders)

    def _sense(self, dt: float) -> Reading:
        """Bring poses up to the posture, as a step ends before they are, and read them."""
        view, split = self._sensing.view(), len(self.arm)
        posture, target = self._positions[self._layout.places], self._target.copy()
        return Reading(
            time=self._frame * FRAME,
            arm=posture[:split],
            head=posture[split:],
            arm_command=target[:split],
            head_command=target[split:],
            dt=dt,
            overlap=self._sensing.overlap(),
            image=self._picture_of_now(),
            view=view,
        )

    def _picture_of_now(self) -> Picture:
        """This frame's picture, which can be drawn only while the body is still in this frame."""
        frame = self._frame
        self._sensed = moment = object()

        def draw(part: Part | None = None) -> Image:
            if moment is not self._sensed:
                raise RuntimeError(f"The picture of frame {frame} was not taken before the body moved on.")
            return self.picture(part=part)

        return Picture(draw, draw)

    def _clip(self, posture: Floats) -> None:
        clip_targets(posture, *self._limits)


def _vector(part: str, target: ArrayLike, group: JointGroup) -> Floats:
    values = np.asarray(target, float)
    if values.shape != group.lower.shape:
        raise ValueError(f"The {part} target has shape {values.shape}; {len(group)} joints: {list(group.names)}.")
    return values


def _not_finite(arm: Floats, head: Floats) -> ValueError:
    part, values = ("head", head) if np.isfinite(arm).all() else ("arm", arm)
    return ValueError(f"The {part} target {values.tolist()} is not finite.")


@dataclass(frozen=True)
class Optics:
    """The camera behind the eye."""

    __pydantic_config__: ClassVar[Any] = {"extra": "forbid"}

    fovy: Annotated[
        Annotated[float, Gt(0), Lt(180)] | None, Doc("Vertical field of view, degrees; the model's if none.")
    ] = None


@dataclass(frozen=True)
class OnHand:
    """The cube of tags on the hand."""

    __pydantic_config__: ClassVar[Any] = {"extra": "forbid"}

    size: Annotated[float, Gt(0), Lt(1), Doc("Edge of the cube, m; the tags on it scale along.")] = Marker.size


@dataclass(frozen=True)
class Mujoco(Settings):
    """A robot simulated by MuJoCo: its model, how it moves, its camera and its marker."""

    model: Annotated[str, Doc("A robot that comes with somatopy, or the path of an anatomy file.")] = "nao"
    motion: Annotated[Motion, Doc("Physics, or joints that obey at once.")] = "dynamic"
    head_speed: Annotated[
        Annotated[float, Gt(0)] | None, Doc("Speed of the head's set-points, rad/s; the body's limit if none.")
    ] = None
    camera: Annotated[Optics, Doc("The camera behind the eye.")] = field(default_factory=Optics)
    marker: Annotated[OnHand, Doc("The cube of tags on the hand.")] = field(default_factory=OnHand)

    def build(self, context: BuildContext) -> MujocoBody:
        """The robot, with an arm that moves at the speed of the babbling.

        Raises:
            BodyError: model and anatomy do not fit. The message lists what there is.
        """
        return MujocoBody(
            self.model,
            motion=self.motion,
            arm_speed=context.arm_speed,
            head_speed=self.head_speed,
            marker=Marker(size=self.marker.size, tag_size=self.marker.size * 4 / 5),
            fovy=self.camera.fovy,
        )
