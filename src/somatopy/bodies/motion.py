"""The two kinds of motion: joints are at their set-points at once, or physics moves them there."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from somatopy.bodies.arm_track import Arm, ArmTrack, Player
from somatopy.bodies.base import Diverged
from somatopy.bodies.constants import Watch
from somatopy.bodies.layout import Layout
from somatopy.bodies.model import Build
from somatopy.bodies.physics import Physics
from somatopy.clock import FRAME
from somatopy.percept import Floats, JointGroup

__all__ = ["Dynamic", "Kinematic"]

_ALL = mujoco.mjtState.mjSTATE_INTEGRATION


class Kinematic:
    """Motion without physics: joints are always exactly at their set-points.

    Args:
        built: the model.
        data: the state of the model.
        layout: the joints of arm and head.

    Attributes:
        arm_moves_alone: whether the arm moves the same to the last bit, whatever the head does.
    """

    arm_moves_alone = True
    tracked = False

    def __init__(self, built: Build, data: mujoco.MjData, layout: Layout) -> None:
        self._model, self._data, self._places = built.model, data, layout.places
        self._positions = data.qpos

    def begin(self, setpoint: Floats) -> None:
        """Start at set-points, shape (n,), rad."""

    def use(self, track: ArmTrack, arm: JointGroup, stride: Floats, frame: int, setpoint: Floats) -> bool:
        """Take the arm's movement from a track.

        Args:
            track: the movement.
            arm: the arm's joints.
            stride: largest change of each of the arm's set-points in a frame, shape (n_arm,), rad.
            frame: the present frame.
            setpoint: the set-points of arm and head, shape (n,), rad.

        Returns:
            Whether the arm is in the state that the track has at this frame. If not, the track is not used.
        """
        return False

    def drop(self, frame: int) -> None:
        """Move the arm without a track from this frame on."""

    def put(self, posture: Floats) -> None:
        """Stand still in a posture, shape (n,), rad."""
        self._data.qpos[self._places], self._data.qvel[:] = posture, 0.0

    def move(self, before: Floats, after: Floats, target: Floats, frame: int) -> None:
        """Let a frame pass: set-points move from `before` to `after` on their way to `target`, each (n,), rad."""
        self._positions[self._places] = after

    def state(self, frame: int) -> Floats:
        """Everything that is needed to continue bit for bit from a frame."""
        state = np.empty(mujoco.mj_stateSize(self._model, _ALL))
        mujoco.mj_getState(self._model, self._data, state, _ALL)
        return state

    def restore(self, state: Floats, frame: int, setpoint: Floats) -> None:
        """Continue from a state that was taken at a frame, with set-points of shape (n,), rad."""
        mujoco.mj_setState(self._model, self._data, state, _ALL)


class Dynamic:
    """Motion by physics: servos follow the set-points under gravity, contact and torque limits.

    It has the arguments, attributes and methods of `Kinematic`. If nothing couples arm and head, each is stepped in a
    model of its own. When constants of the whole model change, these models change before the next frame.
    """

    def __init__(self, built: Build, data: mujoco.MjData, layout: Layout) -> None:
        self.parts = tuple(Physics(built, part, data, layout) for part in built.parts)
        self.arm_moves_alone = len(self.parts) > 1
        self._constants = [part.constants for part in self.parts if part.constants is not None]
        self._watch = Watch([source for constants in self._constants for source in constants.sources])
        self._player: Player | None = None
        self._renew()

    def _renew(self) -> None:
        for constants in self._constants:
            constants.renew()

    @property
    def tracked(self) -> bool:
        """Whether the arm's movement is taken from a track."""
        return self._player is not None

    def use(self, track: ArmTrack, arm: JointGroup, stride: Floats, frame: int, setpoint: Floats) -> bool:
        """As `Kinematic.use`."""
        self.drop(frame)
        if self.arm_moves_alone:
            self._keep(Player(track, Arm(self.parts[0], arm, stride)), frame, setpoint)
        return self.tracked

    def drop(self, frame: int) -> None:
        """As `Kinematic.drop`."""
        if self._player is not None:
            self._player.catch_up(frame)
            self._player = None

    def _keep(self, player: Player | None, frame: int, setpoint: Floats) -> None:
        """Let a player lead if the arm is where its track is."""
        fits = player is not None and player.fits(frame, setpoint[self.parts[0].members])
        self._player = player if fits else None

    def begin(self, setpoint: Floats) -> None:
        """Start in the posture of the whole model, with set-points of shape (n,), rad."""
        for part in self.parts:
            part.begin(setpoint)
        self._keep(self._player, 0, setpoint)

    def put(self, posture: Floats) -> None:
        """Stand still in a posture, shape (n,), rad."""
        for part in self.parts:
            part.put(posture)
            part.show()

    def move(self, before: Floats, after: Floats, target: Floats, frame: int) -> None:
        """As `Kinematic.move`.

        Raises:
            Diverged: the physics became unstable. The state is then the one before this call.
        """
        if self._watch.changed():
            self.drop(frame)
            self._renew()
        if self._player is not None and not self._player.leads(frame, target[self.parts[0].members]):
            self.drop(frame)
        stepped = self.parts if self._player is None else self.parts[1:]
        self._follow(stepped, before, after, frame * FRAME)
        if self._player is not None:
            self._player.show(frame)

    @staticmethod
    def _follow(parts: Sequence[Physics], before: Floats, after: Floats, now: float) -> None:
        for part in parts:
            part.mark()
        try:
            for part in parts:
                part.follow(before, after, now)
        except Diverged:
            for part in parts:
                part.back()
            raise
        for part in parts:
            part.show()

    def state(self, frame: int) -> Floats:
        """Everything that is needed to continue bit for bit from a frame, part by part. A track makes no difference."""
        if self._player is not None:
            self._player.catch_up(frame)
        return np.concatenate([part.state() for part in self.parts])

    def restore(self, state: Floats, frame: int, setpoint: Floats) -> None:
        """As `Kinematic.restore`. A track stays in use if it has the same movement."""
        ends = np.cumsum([part.size for part in self.parts])[:-1]
        for part, own in zip(self.parts, np.split(state, ends), strict=True):
            part.restore(own)
            part.show()
        self._keep(self._player, frame, setpoint)
