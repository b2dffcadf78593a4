"""The tables of an anatomy file: arm, head, camera and marker, and what is added where the model lacks something."""

from __future__ import annotations

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

__all__ = ["Add", "AddedCamera", "CameraTable", "Coupling", "Head", "Joints", "MarkerTable", "Neck", "Servo", "Table"]

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[Finite, Field(gt=0)]
Vector = tuple[Finite, Finite, Finite]
Interval = tuple[Finite, Finite]
Turn = Literal["pan", "tilt", "roll"]


class Table(BaseModel):
    """A table of an anatomy file. Unknown keys are errors."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Coupling(Table):
    """Limits of one head joint as a piecewise linear function of another's angle (rad)."""

    joint: str
    by: str
    at: tuple[Finite, ...] = Field(min_length=2)
    lower: tuple[Finite, ...]
    upper: tuple[Finite, ...]

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if not len(self.at) == len(self.lower) == len(self.upper):
            lengths = len(self.at), len(self.lower), len(self.upper)
            raise ValueError(f"at, lower and upper need the same length, not {', '.join(map(str, lengths))}")
        if any(b <= a for a, b in zip(self.at, self.at[1:], strict=False)):
            raise ValueError("at must increase")
        if any(low > high for low, high in zip(self.lower, self.upper, strict=True)):
            raise ValueError("lower must not exceed upper")
        return self


#: Of so many joints a grid of head postures can be searched for the ceiling.
MOST_HEAD_JOINTS = 3


class Joints(Table):
    """Joint names, in the order of the posture vector, and what limits them.

    Attributes:
        joints: names of hinges and slides of the model.
        velocity: velocity limits, rad/s (m/s for slides); where it is left out, 3 rad/s, and .5 m/s for slides.
        limits: [low, high] of each joint, rad (m for slides), in place of the model's; needed where a joint of the
            model has none.
    """

    joints: tuple[str, ...] = Field(min_length=1)
    velocity: tuple[Positive, ...] | None = None
    limits: tuple[Interval, ...] | None = Field(None, repr=False)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.velocity is not None and len(self.joints) != len(self.velocity):
            raise ValueError(f"{len(self.joints)} joints need as many velocities, not {len(self.velocity)}")
        if len(set(self.joints)) != len(self.joints):
            raise ValueError(f"a joint stands twice in {list(self.joints)}")
        if self.limits is not None:
            check_limits(self.joints, self.limits)
        return self


def check_limits(joints: tuple[str, ...], limits: tuple[Interval, ...]) -> None:
    """Check that each joint has one interval that is not empty.

    Raises:
        ValueError: a joint has none, or an empty one.
    """
    if len(limits) != len(joints):
        raise ValueError(f"limits needs one [low, high] for each of {list(joints)}, not {len(limits)}")
    for joint, (low, high) in zip(joints, limits, strict=True):
        if low >= high:
            raise ValueError(f"the limits [{low:g}, {high:g}] of {joint!r} leave it no room; low must be under high")


class Head(Joints):
    """The head's joints, and how they limit each other."""

    coupling: Coupling | None = None

    @model_validator(mode="after")
    def _coupled(self) -> Self:
        if len(self.joints) > MOST_HEAD_JOINTS:
            raise ValueError(
                f"a head has one to {MOST_HEAD_JOINTS} joints, since its ceiling is searched over a grid of them; keep "
                f"at most {MOST_HEAD_JOINTS} of {list(self.joints)}, and let the others stand still: [add] freeze"
            )
        if self.coupling is None:
            return self
        for name in (self.coupling.joint, self.coupling.by):
            if name not in self.joints:
                raise ValueError(f"coupling names {name!r}, which is no head joint; head joints: {list(self.joints)}")
        if self.coupling.joint == self.coupling.by:
            raise ValueError(f"coupling cannot limit {self.coupling.joint!r} by itself")
        return self


class CameraTable(Table):
    """The camera that the eye looks through, of the model or of [add.camera], and its picture's size in pixels.

    Without a size, the camera's own resolution counts, or 320 x 240 where it has none.
    """

    name: str
    width: int | None = Field(None, gt=0, le=4096)
    height: int | None = Field(None, gt=0, le=4096)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if (self.width is None) != (self.height is None):
            raise ValueError("width and height stand together or not at all")
        return self


class MarkerTable(Table):
    """The body that carries the cube of tags, and where: position (m) and axis in that body's frame."""

    body: str
    position: Vector
    axis: Vector = (1.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if not any(self.axis):
            raise ValueError("axis must not be zero")
        return self


class Directed(Table):
    """A place on a body, in that body's frame.

    Attributes:
        position: m.
        forward: where the camera looks.
        up: what is up in its picture; only what is perpendicular to `forward` counts.
    """

    position: Vector = (0.0, 0.0, 0.0)
    forward: Vector = (1.0, 0.0, 0.0)
    up: Vector = (0.0, 0.0, 1.0)

    @model_validator(mode="after")
    def _directed(self) -> Self:
        across, sizes = np.cross(self.forward, self.up), np.linalg.norm([self.forward, self.up], axis=1)
        if not np.linalg.norm(across) > 1e-6 * sizes.prod():
            raise ValueError(f"forward {list(self.forward)} and up {list(self.up)} must be two directions, not one")
        return self


class Neck(Directed):
    """A neck that is put on a body: up to three hinges in one point, which stand in [head] joints.

    It has a mass of 0.1 kg, and servos of its own unless [add.servos] names its joints.

    Attributes:
        body: the body that carries it; "world" for one that stands in the room.
        joints: names of the hinges. Each turns what the ones before it have turned.
        turns: what each does, in their order: pan turns to the left about `up`, tilt turns `forward` down, roll turns
            about `forward`, the left side up.
        limits: [low, high] of each hinge, rad.
    """

    body: str
    joints: tuple[str, ...] = Field(min_length=1, max_length=3)
    turns: tuple[Turn, ...] = ("pan", "tilt", "roll")
    limits: tuple[Interval, ...]

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        check_limits(self.joints, self.limits)
        if len(set(self.joints)) != len(self.joints):
            raise ValueError(f"a joint stands twice in {list(self.joints)}")
        if len(self.turns) < len(self.joints):
            raise ValueError(f"turns says what {len(self.turns)} joints do, but there are {len(self.joints)}")
        return self


class AddedCamera(Directed):
    """A camera that is put on a body, or on the neck where `body` is left out; [camera] gives its name.

    Attributes:
        body: the body that carries it.
        fovy: vertical field of view, degrees.
    """

    body: str | None = None
    fovy: float = Field(45.0, gt=0, lt=180)


class Servo(Table):
    """A position servo of one joint: it pulls with kp (set-point - position) - kv velocity.

    Attributes:
        kp: N m/rad (N/m for slides).
        kv: N m s/rad (N s/m for slides).
        force: the most that it exerts either way, N m (N for slides); None for no limit.
    """

    kp: Positive
    kv: Annotated[Finite, Field(ge=0)]
    force: Positive | None = None


class Add(Table):
    """What the model lacks, and the anatomy adds.

    Attributes:
        fixed_base: whether the free and ball joints above arm and head go away, so that the robot stands where its
            home posture puts it.
        freeze: joints that go away, whose bodies stand as in the home posture: names, or "rest" for all that are
            neither arm nor head. Of the joints that stay, position servos hold those that they drive. Motors and
            velocity servos get no command, so that theirs sag under their load: `freeze = "rest"` is the mend.
        neck: hinges that carry the camera.
        camera: the camera.
        servos: a position servo for each of these joints, in place of whatever drives it in the model.
    """

    fixed_base: bool = False
    freeze: Literal["rest"] | tuple[str, ...] = ()
    neck: Neck | None = None
    camera: AddedCamera | None = None
    servos: dict[str, Servo] = Field({})

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.camera is not None and self.camera.body is None and self.neck is None:
            raise ValueError('the camera has no place: say body = "...", the body that carries it, or add a neck')
        return self
