"""The contracts of an experiment's parts, and the capabilities that some parts have in addition.

An implementation need not derive from these classes. It must have their members, and pass the check of its kind, such
as `somatopy.check_learner`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from somatopy.percept import Camera, Column, Floats, Image, JointGroup, Marker, Percept, Reading, Shapes, Sighting, View

__all__ = [
    "Alterable",
    "Babbler",
    "Believing",
    "Body",
    "Eye",
    "Intervention",
    "Learner",
    "Modelled",
    "Posable",
    "Recorded",
    "Resumable",
    "SharesArm",
    "Shuffles",
    "Stage",
    "Twin",
]


@runtime_checkable
class Body(Protocol):
    """A robot with an arm, a head with a camera in it, and a marker on its hand.

    `arm`, `head`, `camera` and `marker` can be read before the robot is connected. The body alone clips commands: to
    position limits, to velocity limits, and to limits of a joint that depend on another joint. One `step` lasts one
    frame, 1/15 s.

    Attributes:
        arm: names, limits and units of the arm's joints.
        head: the same of the head's joints.
        camera: the camera that the eye looks through.
        marker: the cube of tags on the hand.
    """

    arm: JointGroup
    head: JointGroup
    camera: Camera
    marker: Marker

    def reset(self, seed: int | None = None) -> Reading:
        """Go to the start posture; `seed` is for bodies with noise of their own."""
        ...

    def step(self, arm: ArrayLike, head: ArrayLike) -> Reading:
        """Move towards the targets, (n_arm,) and (n_head,) rad, for one frame, and sense."""
        ...

    def close(self) -> None:
        """Release renderer and connections; a second call does nothing."""
        ...


@runtime_checkable
class Resumable(Protocol):
    """A body that can be put back into an earlier state. Simulations have this capability; real robots do not."""

    def state(self) -> dict[str, Any]:
        """All that a bit-exact continuation needs."""
        ...

    def restore(self, state: dict[str, Any]) -> Reading:
        """Continue from `state`; returns the reading of that moment."""
        ...


@runtime_checkable
class Twin(Protocol):
    """A body that has a model of itself: it can compute its true poses at any posture, without moving.

    The geometric eye, the ceiling and `evaluate` need this capability. A body without it can run too, and its report
    says that there is no ceiling.

    Attributes:
        occluders: shapes that can stand between camera and marker.
        ranges: babbling ranges by name, low and high of each arm joint, each of shape (n_arm, 2), rad.
    """

    occluders: Shapes
    ranges: Mapping[str, Floats]

    def view(self, arm: ArrayLike, head: ArrayLike) -> View:
        """True poses at any posture, (n_arm,) and (n_head,) rad, without moving the robot; nothing is clipped."""
        ...

    def legal(self, head: ArrayLike) -> Floats:
        """A head posture, shape (n_head,), rad, clipped to all limits, the coupled ones included."""
        ...

    def fingerprint(self) -> bytes:
        """A digest of all that poses, limits and movements depend on, damages included; caches use it as key."""
        ...

    def another(self) -> Body:
        """A second, independent body like this one, damages included. The caller must close it."""
        ...


@runtime_checkable
class SharesArm(Protocol):
    """A body whose arm moves in the same way whatever the head does, so that runs of one seed can share it."""

    def share_arm(self, key: bytes, frames: int, commands: Callable[[], Floats] | None) -> bool:
        """From the present frame on, take the arm's movement from a cache. This changes no bit of any result.

        The body stops using the stored movement as soon as the arm gets another target, or the body itself is changed.

        Args:
            key: identifies everything that the arm's targets depend on.
            frames: the least length of the movement, in frames from time 0. A longer stored movement will do.
            commands: returns the arm's target in each of these frames, shape (frames, n_arm), rad. With it, a movement
                that is not in the cache is computed and stored. None to use only a movement that is stored already.

        Returns:
            Whether the arm now follows a stored movement.
        """
        ...

    def unshare_arm(self) -> None:
        """From the present frame on, move the arm by its own physics again."""
        ...


@runtime_checkable
class Alterable(Protocol):
    """A body that can be changed for a while, as by a damage or by growth.

    Each method returns a function that undoes the change to the last bit. It raises a ValueError if this body cannot be
    changed in this way. A change also holds for the twin, for bodies that `another` returns, and for the fingerprint.
    It lasts through `reset` and `restore`. Arrays that the body has given out, such as the sizes of its occluders,
    change in place.
    """

    def turn_camera(self, tilt: float, roll: float) -> Callable[[], None]:
        """Turn the eye's camera in the head.

        Args:
            tilt: angle about its axis to the right, rad. With a positive one it looks further up.
            roll: angle about its line of sight, rad. With a positive one the top of the picture goes to the left, as
                the camera sees it.
        """
        ...

    def move_marker(self, by: float) -> Callable[[], None]:
        """Move the marker along its axis by so many metres, as if the hand held a tool."""
        ...

    def stretch_arm(self, factor: float) -> Callable[[], None]:
        """Make the links of the arm, up to the marker, `factor` times as long. Joint angles stay the same."""
        ...

    def pace_arm(self, factor: float) -> Callable[[], None]:
        """Let the servo set-points of the arm move `factor` times as fast, within the joints' velocity limits."""
        ...


@runtime_checkable
class Posable(Body, Protocol):
    """A body that can be put into any posture at once, and drawn. Reports and films need this for their pictures."""

    def place(self, arm: ArrayLike, head: ArrayLike) -> Reading:
        """Put the body at rest into a posture, (n_arm,) and (n_head,) rad, without clipping, and return a reading."""
        ...

    def picture(self, camera: str | None = None, width: int | None = None, height: int | None = None) -> Image:
        """The body as one of its cameras sees it now, (height, width, 3), RGB; its eye's camera by default."""
        ...


class Modelled(Body, Twin, Protocol):
    """A body that has a twin."""


@runtime_checkable
class Recorded(Protocol):
    """A part that adds columns of its own to the record of frames.

    Attributes:
        columns: their names, types and meanings, the same for the life of the part.
    """

    columns: Sequence[Column]

    def probes(self) -> Mapping[str, float]:
        """The values of all its columns in the last frame, by name."""
        ...


@runtime_checkable
class Eye(Protocol):
    """Finds the marker in what the body senses. The same reading always gives the same answer.

    An eye may also be `Recorded`. If it has an attribute `needs_pictures = True`, a session tests at its start whether
    the body's pictures can be drawn.
    """

    def look(self, reading: Reading) -> Sighting | None:
        """The marker's pixel, tag and area, or None on a miss."""
        ...


@runtime_checkable
class Babbler(Protocol):
    """Commands the arm. It gets no feedback, so that one seed gives every learner the same arm movement."""

    def command(self, time: float) -> Floats:
        """Final target of the movement under way at `time` (s, never decreasing), shape (n_arm,), rad."""
        ...

    def state(self) -> dict[str, Any]:
        """All that a bit-exact continuation needs, random numbers included."""
        ...

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from `state`."""
        ...


@runtime_checkable
class Learner(Protocol):
    """Learns online where to look.

    Attributes:
        parts: names of what can learn, the same for the life of the learner; empty if it learns nothing.
        plastic: those of the parts that may learn now; settable at any time.
        columns: the values that `probes` gives to the record of frames.
    """

    parts: frozenset[str]
    plastic: frozenset[str]
    columns: Sequence[Column]

    def observe(self, percept: Percept) -> None:
        """Learn from this frame."""
        ...

    def gaze(self, percept: Percept) -> Floats:
        """The head posture to command in this frame, shape (n_head,), rad; may draw random numbers."""
        ...

    def predict(self, arm: ArrayLike) -> Floats:
        """Where the learner would look for this arm posture, shape (n_head,), rad.

        Draws no random numbers and changes nothing.
        """
        ...

    def probes(self) -> Mapping[str, float]:
        """The values of `columns` in the last observed frame, by name."""
        ...

    def maps(self) -> dict[str, Any]:
        """Arrays that show what was learned; a run stores them at the end of each window. {} if there are none."""
        ...

    def state(self) -> dict[str, Any]:
        """All that a bit-exact continuation needs, random numbers included."""
        ...

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from `state`."""
        ...


@runtime_checkable
class Shuffles(Protocol):
    """A learner whose associations can be shuffled, so that it hits by chance only. This makes a control."""

    def shuffle(self, rng: np.random.Generator) -> None:
        """Randomly permute what the inputs are associated with."""
        ...


@runtime_checkable
class Believing(Protocol):
    """A learner that can say from where it believes that the hand can be seen."""

    def belief(self, arms: ArrayLike, gazes: ArrayLike) -> Floats:
        """How strongly the learner believes that a gaze sees the hand, for each arm posture and gaze.

        Like `predict`, it draws no random numbers and changes nothing. It must agree with `predict`: of all gazes that
        the head can take, none may have a greater belief than the predicted one. Memory of the last few frames is left
        out.

        Args:
            arms: arm postures as they are perceived, shape (k, n_arm), rad.
            gazes: head postures to command, shape (n, n_head), rad.

        Returns:
            Shape (k, n), from 0 to 1. Above one half the learner believes that the hand is seen.
        """
        ...


class Stage(Protocol):
    """What an intervention may touch.

    Attributes:
        body: the robot.
        learner: the learner, which commands the head.
        rng: the intervention's own random numbers.
    """

    @property
    def body(self) -> Body:
        """The robot."""
        ...

    @property
    def learner(self) -> Learner:
        """What moves the head."""
        ...

    @property
    def rng(self) -> np.random.Generator:
        """The intervention's own random numbers."""
        ...

    def renew_learner(self) -> None:
        """Replace the learner by a fresh one that has learned nothing."""
        ...


@runtime_checkable
class Intervention(Protocol):
    """Something that is done to an experiment for the length of a phase, such as a damage, freezing or shuffling.

    Derive from `somatopy.interventions.NoIntervention`, whose methods do nothing, and override those that you need.

    Attributes:
        alters_ceiling: whether it changes what the body can see, so that the ceiling must be computed on the changed
            body.
        moves_arm: whether it may change how the arm moves, by changing the body or the arm's targets.
        columns: the values that `probes` gives to the record of frames; () if there are none.
    """

    alters_ceiling: bool
    moves_arm: bool
    columns: Sequence[Column]

    def check(self, stage: Stage) -> None:
        """Raise a ValueError if the body or the learner does not fit. Called before anything runs."""
        ...

    def begin(self, stage: Stage) -> None:
        """Change things that belong to the state of body or learner. Called once, before the phase's first frame."""
        ...

    def hold(self, stage: Stage) -> None:
        """Change things that belong to no state, such as constants of a model.

        Called after `begin`, and again whenever a run is resumed within the phase.
        """
        ...

    def release(self, stage: Stage) -> None:
        """Undo what `hold` did; called after the last frame of the phase."""
        ...

    def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
        """Change what the learner perceives. Called in every frame, after the eye has looked."""
        ...

    def act(self, target: Floats, gaze: Floats, rng: np.random.Generator) -> tuple[Floats, Floats]:
        """Change the targets of arm (n_arm,) and head (n_head,), rad, on their way to the body, in every frame."""
        ...

    def probes(self) -> Mapping[str, float]:
        """The values of `columns` in the last frame, by name."""
        ...

    def state(self) -> dict[str, Any]:
        """All that a bit-exact continuation needs, except for the generator, whose state is saved separately."""
        ...

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from `state`."""
        ...
