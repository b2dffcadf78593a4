"""The tables of an anatomy file: arm, head, camera, marker, and what is added to a model that lacks something."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from somatopy.validation import check_numbers

__all__ = ["Add", "AddedCamera", "CameraTable", "Coupling", "Head", "Joints", "MarkerTable", "Neck", "Servo", "Table"]

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[Finite, Field(gt=0)]
Name = Annotated[str, Field(min_length=1, pattern=r"^[^\x00]+$")]
Vector = tuple[Finite, Finite, Finite]
Interval = tuple[Finite, Finite]
Turn = Literal["pan", "tilt", "roll"]


class Table(BaseModel):
    """A table of an anatomy file. Unknown keys are errors."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    @model_validator(mode="before")
    @classmethod
    def _numbers(cls, table: Any) -> Any:
        if isinstance(table, Mapping):
            check_numbers({name: info.annotation for name, info in cls.model_fields.items()}, table)
        return table


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
    """Names and limits of joints, in the order of the posture vector.

    Attributes:
        joints: names of hinges and slides of the model.
        velocity: velocity limit of each joint, rad/s (m/s for slides). By default 3 rad/s, and 0.5 m/s for slides.
        limits: [low, high] of each joint, rad (m for slides). They replace those of the model, and are required if a
            joint of the model has none.
    """

    joints: tuple[Name, ...] = Field(min_length=1)
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
    """Check that there is one interval for each joint, and that none is empty.

    Raises:
        ValueError: an interval is missing or empty.
    """
    if len(limits) != len(joints):
        raise ValueError(f"limits needs one [low, high] for each of {list(joints)}, not {len(limits)}")
    for joint, (low, high) in zip(joints, limits, strict=True):
        if low >= high:
            raise ValueError(f"the limits [{low:g}, {high:g}] of {joint!r} leave it no room; low must be under high")


class Head(Joints):
    """The joints of the head, and how they limit each other."""

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
    """The camera that the eye looks through, and the size of its picture, px.

    It is a camera of the model, or the one of [add.camera]. Without a size, the picture has the resolution that the
    model gives the camera, or else 320 x 240 px.
    """

    name: Name
    width: int | None = Field(None, gt=0, le=4096)
    height: int | None = Field(None, gt=0, le=4096)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if (self.width is None) != (self.height is None):
            raise ValueError("width and height stand together or not at all")
        return self


class MarkerTable(Table):
    """The body that carries the cube of tags, and the cube's position (m) and axis in that body's frame."""

    body: Name
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
        position: the place, m.
        forward: the direction in which the camera looks.
        up: the direction that is up in its picture. Only its component perpendicular to `forward` counts.
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
    """A neck that is added to a body. Its one to three hinges meet in one point, and [head] joints lists them.

    It has a mass of 0.1 kg. It has servos of its own unless [add.servos] names its joints.

    Attributes:
        body: the body that carries it. "world" for a neck that stands in the room.
        joints: names of the hinges. The first one moves all others.
        turns: what each hinge does. "pan" turns to the left about `up`, "tilt" turns `forward` down, and "roll" turns
            about `forward`, so that the left side goes up.
        limits: [low, high] of each hinge, rad.
    """

    body: Name
    joints: tuple[Name, ...] = Field(min_length=1, max_length=3)
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
    """A camera that is added to the model. [camera] gives its name.

    Attributes:
        body: the body that carries it. By default it is the added neck.
        fovy: vertical field of view, degrees.
    """

    body: Name | None = None
    fovy: float = Field(45.0, gt=0, lt=180)


class Servo(Table):
    """A position servo of one joint. It exerts the force kp (set-point - position) - kv velocity.

    Attributes:
        kp: N m/rad (N/m for slides).
        kv: N m s/rad (N s/m for slides).
        force: the largest force that it exerts in either direction, N m (N for slides). None for no limit.
    """

    kp: Positive
    kv: Annotated[Finite, Field(ge=0)]
    force: Positive | None = None


class Add(Table):
    """What an anatomy adds to a model, or removes from it.

    Attributes:
        fixed_base: whether the free and ball joints above arm and head are removed. The robot then stands where its
            home posture puts it.
        freeze: joints that are removed, by name. Their bodies stay as in the home posture. "rest" stands for all joints
            that belong neither to the arm nor to the head. Position servos hold the joints that they drive. Motors and
            velocity servos get no command, so that their joints sag under their load; `freeze = "rest"` prevents this.
        neck: a neck that carries the camera.
        camera: a camera.
        servos: a position servo for each joint that is named. It replaces whatever drives the joint in the model.
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
