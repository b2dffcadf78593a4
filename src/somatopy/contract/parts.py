"""The contracts of an experiment's parts: what each must do, and what only some can do beside it.

An implementation derives from nothing here. It has the members, and it passes the `check_*` of its kind.
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

    `arm`, `head`, `camera` and `marker` are readable while disconnected. Only the body clips commands: to position
    and velocity limits and to limits that couple joints. One `step` lasts one frame.
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
    """A body that can be put back into a state: simulations can, devices cannot."""

    def state(self) -> dict[str, Any]:
        """All that a bit-exact continuation needs."""
        ...

    def restore(self, state: dict[str, Any]) -> Reading:
        """Continue from `state`; returns the reading of that moment."""
        ...


@runtime_checkable
class Twin(Protocol):
    """A body that has a model of itself: true poses at any posture, without moving.

    The geometric eye, the ceiling and `evaluate` ask for it. A body without one runs all the same, and its report
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
        """All that poses, limits and movements of this body depend on, injuries included; for keys of caches."""
        ...

    def another(self) -> Body:
        """A second body like this one, injuries included, which moves by itself; whoever asks for it closes it."""
        ...


@runtime_checkable
class SharesArm(Protocol):
    """A body whose arm moves the same whatever the head does, so that runs of one seed can share its movement."""

    def share_arm(self, key: bytes, frames: int, commands: Callable[[], Floats] | None) -> bool:
        """Take the arm's movement from where it is kept, from the present frame on; nothing else changes in any bit.

        The body goes on without as soon as the arm's target is another one, or something of the body is changed.

        Args:
            key: all that the arm's targets depend on.
            frames: how many frames the movement has at least, from time 0 on; a longer one that is kept serves.
            commands: gives the arm's target in each of them, shape (frames, n_arm), rad, so that a movement that is not
                kept yet is computed and kept; None if only one that is kept is to be used.

        Returns:
            Whether the arm is led by a movement now.
        """
        ...

    def unshare_arm(self) -> None:
        """Move the arm by its own physics from the present frame on."""
        ...


@runtime_checkable
class Alterable(Protocol):
    """A body of which something can be changed for a while: injuries and growth are uses of it.

    Each method returns what undoes it to the last bit, or raises a ValueError where this body cannot have it. What is
    changed holds for the twin, for bodies that `another`
    gives, and in the fingerprint, and it stays through `reset` and `restore`. Arrays that the body has given out, such
    as the sizes of its occluders, change in place.
    """

    def turn_camera(self, tilt: float, roll: float) -> Callable[[], None]:
        """Turn the eye's camera in the head.

        Args:
            tilt: about its axis to the right, rad: it looks further up.
            roll: about its line of sight, rad: the top of the picture goes to the left as the camera sees it.
        """
        ...

    def move_marker(self, by: float) -> Callable[[], None]:
        """Move the marker along its axis, m; the hand seems longer, as with a tool in it."""
        ...

    def stretch_arm(self, factor: float) -> Callable[[], None]:
        """Make the links between the arm's joints and up to the marker `factor` times as long; angles stay."""
        ...

    def pace_arm(self, factor: float) -> Callable[[], None]:
        """Let the set-points of the arm move `factor` times as fast, within the joints' own limits."""
        ...


@runtime_checkable
class Posable(Body, Protocol):
    """A body that can be put into any posture at once, and drawn: for pictures of a run, after it."""

    def place(self, arm: ArrayLike, head: ArrayLike) -> Reading:
        """Be at rest in a posture, (n_arm,) and (n_head,) rad, without clipping, and sense."""
        ...

    def picture(self, camera: str | None = None, width: int | None = None, height: int | None = None) -> Image:
        """The body as one of its cameras sees it now, (height, width, 3), RGB; its eye's camera by default."""
        ...


class Modelled(Body, Twin, Protocol):
    """A body that has a twin."""


@runtime_checkable
class Recorded(Protocol):
    """A part that has columns of its own in the record of frames.

    Attributes:
        columns: their names, types and meanings, the same for the life of the part.
    """

    columns: Sequence[Column]

    def probes(self) -> Mapping[str, float]:
        """The values of all its columns in the last frame, by name."""
        ...


@runtime_checkable
class Eye(Protocol):
    """Finds the marker. Pure: the same reading gives the same answer.

    An eye may be `Recorded`. One that says `needs_pictures = True` lets a session find out at its start whether the
    body's pictures can be drawn.
    """

    def look(self, reading: Reading) -> Sighting | None:
        """The marker's pixel, tag and area, or None on a miss."""
        ...


@runtime_checkable
class Babbler(Protocol):
    """Says where the arm should go. Open loop, so that one seed gives every learner the same arm movement."""

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
        columns: what `probes` tells, for the recorder.
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
        """Where it would look for this arm posture, shape (n_head,), rad. Pure: draws nothing, changes nothing."""
        ...

    def probes(self) -> Mapping[str, float]:
        """The values of `columns` in the last observed frame, by name."""
        ...

    def maps(self) -> dict[str, Any]:
        """Arrays worth keeping at window ends, to show what was learned; {} if there are none."""
        ...

    def state(self) -> dict[str, Any]:
        """All that a bit-exact continuation needs, random numbers included."""
        ...

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from `state`."""
        ...


@runtime_checkable
class Shuffles(Protocol):
    """A learner whose associations can be given to other inputs, which leaves only chance."""

    def shuffle(self, rng: np.random.Generator) -> None:
        """Permute what inputs are associated with."""
        ...


@runtime_checkable
class Believing(Protocol):
    """A learner that can say from where it believes that the hand can be seen."""

    def belief(self, arms: ArrayLike, gazes: ArrayLike) -> Floats:
        """How far it believes, of each arm posture and gaze, that this gaze sees the hand there.

        Pure, as `predict` is, and about what `predict` commands: of all gazes that the head can take none should be
        believed more than that one. Working memory of the last frames does not count.

        Args:
            arms: arm postures as they are perceived, shape (k, n_arm), rad.
            gazes: head postures to command, shape (n, n_head), rad.

        Returns:
            Shape (k, n), from 0 to 1: above one half it rather believes that the hand is seen.
        """
        ...


class Stage(Protocol):
    """What an intervention may touch.

    Attributes:
        body: the robot.
        learner: what moves the head.
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
        """Put a learner that has learned nothing in the place of the one that is there."""
        ...


@runtime_checkable
class Intervention(Protocol):
    """What is done to an experiment for the length of a phase: damage, freezing and shuffling are uses of it.

    Derive from `somatopy.interventions.NoIntervention`, whose methods do nothing, and write those that do something.

    Attributes:
        alters_ceiling: whether the body, as `hold` leaves it, must be asked anew what it could see.
        moves_arm: whether it may change how the arm moves: its body, or the targets that it is given.
        columns: what `probes` tells, for the recorder; () if nothing.
    """

    alters_ceiling: bool
    moves_arm: bool
    columns: Sequence[Column]

    def check(self, stage: Stage) -> None:
        """Raise a ValueError if body or learner cannot have this done to them; called before anything runs."""
        ...

    def begin(self, stage: Stage) -> None:
        """Change, once, what states of body and learner hold; called before the first frame of the phase."""
        ...

    def hold(self, stage: Stage) -> None:
        """Change what no state holds, such as a model's constants.

        Called after `begin`, and again whenever a run is resumed within the phase.
        """
        ...

    def release(self, stage: Stage) -> None:
        """Undo what `hold` did; called after the last frame of the phase."""
        ...

    def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
        """Change what is sensed, in every frame (step 3)."""
        ...

    def act(self, target: Floats, gaze: Floats, rng: np.random.Generator) -> tuple[Floats, Floats]:
        """Change what is commanded, in every frame (step 9): arm target (n_arm,) and head target (n_head,), rad."""
        ...

    def probes(self) -> Mapping[str, float]:
        """The values of `columns` in the last frame, by name."""
        ...

    def state(self) -> dict[str, Any]:
        """All that a bit-exact continuation needs beside the generator, which is kept for it."""
        ...

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from `state`."""
        ...
