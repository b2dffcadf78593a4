"""Stored arm movements. All runs of one seed can share one, since babbling does not depend on the learner."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from somatopy.bodies.limits import advance_setpoints, clip_targets
from somatopy.bodies.physics import Physics
from somatopy.files import cache_folder, write_whole
from somatopy.percept import Floats, JointGroup

if TYPE_CHECKING:
    from somatopy.bodies.mujoco import MujocoBody

__all__ = ["EVERY", "Arm", "ArmTrack", "Player", "kept_track"]

#: Frames from one stored state to the next: between them the arm is stepped again where its state is asked for.
EVERY = 900
_UNCOUPLED: Any = (-1, -1, np.zeros(1), np.zeros(1), np.zeros(1))


class Arm:
    """The arm of a body, which can be moved without the rest of the body.

    Args:
        part: the part of the model that is stepped.
        group: its joints.
        stride: largest change of each set-point in a frame, shape (n_arm,), rad.

    Attributes:
        setpoint: set-points, shape (n_arm,), rad.
    """

    def __init__(self, part: Physics, group: JointGroup, stride: Floats) -> None:
        self.part, self._group, self._stride = part, group, stride
        self.setpoint = np.zeros(len(group))

    def clipped(self, command: Floats) -> Floats:
        """A target, shape (n_arm,), rad, inside the limits."""
        target = command.copy()
        clip_targets(target, self._group.lower, self._group.upper, *_UNCOUPLED)
        return target

    def step(self, target: Floats) -> None:
        """Move towards a clipped target, shape (n_arm,), rad, for one frame."""
        before = self.setpoint.copy()
        advance_setpoints(self.setpoint, before, target, self._stride, *_UNCOUPLED)
        self.part.follow(before, self.setpoint, 0.0)


@dataclass(frozen=True, eq=False)
class ArmTrack:
    """A recorded movement of an arm, from frame 0 on.

    Attributes:
        targets: the clipped target in each frame, shape (frames, n_arm), rad.
        places: positions of all joints that move with the arm, at the start and at the end of each frame, shape
            (frames + 1, m), rad.
        states: the full physical state of these joints at frames 0, `EVERY`, 2 `EVERY` and so on, shape (k, size).
        setpoints: set-points in the same frames, shape (k, n_arm), rad.
    """

    targets: Floats
    places: Floats
    states: Floats
    setpoints: Floats

    def __len__(self) -> int:
        return len(self.targets)

    @classmethod
    def of(cls, body: MujocoBody, commands: ArrayLike) -> Self:
        """Record how a body's arm moves.

        Args:
            body: a body whose arm moves by physics and independently of the head. It is not moved.
            commands: the arm's target in each frame from the start on, shape (frames, n_arm), rad.

        Raises:
            ValueError: the arm moves without physics, or depends on the head.
            Diverged: the physics became unstable.
        """
        second = body.another()
        arm = second.arm_alone()
        targets = np.stack([arm.clipped(command) for command in np.array(commands, float)])
        places, states, setpoints = [arm.part.places], [], []
        for frame, target in enumerate(targets):
            if frame % EVERY == 0:
                states.append(arm.part.state())
                setpoints.append(arm.setpoint.copy())
            arm.step(target)
            places.append(arm.part.places)
        return cls(targets, np.array(places), np.array(states), np.array(setpoints))

    def save(self, path: Path) -> None:
        """Write the movement to a file, whole or not at all."""
        first = np.flatnonzero(np.append(True, (np.diff(self.targets, axis=0) != 0).any(axis=1)))
        write_whole(
            path,
            lambda file: np.savez(
                file,
                first=first,
                targets=self.targets[first],
                frames=np.int64(len(self)),
                places=self.places,
                states=self.states,
                setpoints=self.setpoints,
            ),
        )

    @classmethod
    def load(cls, path: Path) -> Self:
        """Read a movement from a file.

        Raises:
            OSError: there is no such file.
            ValueError: the file is no track.
        """
        try:
            with np.load(path, allow_pickle=False) as file:
                lengths = np.diff(np.append(file["first"], file["frames"]))
                targets = np.repeat(file["targets"], lengths, axis=0)
                return cls(targets, file["places"], file["states"], file["setpoints"])
        except OSError:
            raise
        except Exception as error:  # a damaged archive raises errors of a dozen kinds
            raise ValueError(f"{path} is no arm movement: {error}.") from error


class Player:
    """Moves an arm along a track instead of by physics.

    Args:
        track: the movement.
        arm: the arm that was recorded, or one like it.
    """

    def __init__(self, track: ArmTrack, arm: Arm) -> None:
        self._track, self._arm, self._at = track, arm, -1

    def leads(self, frame: int, target: Floats) -> bool:
        """Whether the track has this frame with this clipped target, shape (n_arm,), rad."""
        return frame < len(self._track) and bool((self._track.targets[frame] == target).all())

    def show(self, frame: int) -> None:
        """Put the joints of the whole model where the track has them at the end of a frame."""
        self._arm.part.show_at(self._track.places[frame + 1])

    def fits(self, frame: int, setpoint: Floats) -> bool:
        """Whether the arm is now in the same state as the track at a frame. Its set-points have shape (n_arm,), rad."""
        now, self._at = self._arm.part.state(), -1
        if frame <= len(self._track):
            self.catch_up(frame)
            if self._arm.part.state().tobytes() == now.tobytes() and (self._arm.setpoint == setpoint).all():
                return True
        self._arm.part.restore(now)
        return False

    def catch_up(self, frame: int) -> None:
        """Bring the physics of the arm to a frame of the track, by steps from the last stored state before it."""
        stored = min(frame // EVERY, len(self._track.states) - 1)
        if not stored * EVERY <= self._at <= frame:
            self._at = stored * EVERY
            self._arm.part.restore(self._track.states[stored])
            self._arm.setpoint[:] = self._track.setpoints[stored]
        for target in self._track.targets[self._at : frame]:
            self._arm.step(target)
        self._at = frame


def kept_track(body: MujocoBody, key: bytes, frames: int, commands: Callable[[], ArrayLike] | None) -> ArmTrack | None:
    """The movement of a body's arm, from the user's cache folder if it is there.

    The cache keeps the longest version of each movement. A shorter one is the beginning of it.

    Args:
        body: the robot.
        key: everything that the targets depend on, such as the babbler's settings and the seed, except their number.
        frames: the number of frames that are needed, from frame 0 on.
        commands: function that returns the arm's target in each frame, shape (frames, n_arm), rad. It is called only
            if the cache has no movement of that length. With None, nothing is computed.

    Returns:
        The movement, which may be longer than needed. None if the cache has none of that length and `commands` is None.
        None, too, where a track would be of no use: for 0 frames, and for an arm that moves without physics or depends
        on the head.

    Raises:
        Diverged: the physics became unstable.
    """
    if frames == 0 or body.motion != "dynamic" or not body.arm_moves_alone:
        return None
    said = repr((EVERY, mujoco.mj_versionString(), len(key))).encode()
    name = hashlib.sha256(said + key + body.arm_fingerprint() + _sources()).hexdigest()
    folder = cache_folder("arm")
    path = folder / f"{name}.npz" if folder else None
    kept = _loaded(path)
    if kept is not None and len(kept) >= frames:
        return kept
    if commands is None:
        return None
    track = ArmTrack.of(body, commands())
    if path is not None:
        with suppress(OSError):
            path.parent.mkdir(parents=True, exist_ok=True)
            track.save(path)
    return track


def _loaded(path: Path | None) -> ArmTrack | None:
    """The track in a file; None if there is none, or nothing readable."""
    with suppress(OSError, ValueError):
        return ArmTrack.load(path) if path else None
    return None


@cache
def _sources() -> bytes:
    """A hash of the code that a movement depends on."""
    files = sorted(Path(__file__).parent.glob("*.py"))
    return hashlib.sha256(b"".join(hashlib.sha256(file.read_bytes()).digest() for file in files)).digest()
