"""The anatomy file: which joints of a model are arm and head, which camera looks, where the marker sits."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Annotated, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from somatopy.bodies.base import BodyError

__all__ = ["MODELS", "Anatomy", "Coupling", "anatomy_path"]

Finite = Annotated[float, Field(allow_inf_nan=False)]
Velocity = Annotated[Finite, Field(gt=0)]

#: Robots that come with somatopy: name -> anatomy file.
MODELS = {"nao": Path(__file__).parent / "nao" / "anatomy.toml"}


class _Table(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Coupling(_Table):
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


class Joints(_Table):
    """Joint names and their velocity limits (rad/s), in the order of the posture vector."""

    joints: tuple[str, ...] = Field(min_length=1)
    velocity: tuple[Velocity, ...]

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if len(self.joints) != len(self.velocity):
            raise ValueError(f"{len(self.joints)} joints need as many velocities, not {len(self.velocity)}")
        if len(set(self.joints)) != len(self.joints):
            raise ValueError(f"a joint stands twice in {list(self.joints)}")
        return self


class Head(Joints):
    """The head's joints, and how they limit each other."""

    coupling: Coupling | None = None

    @model_validator(mode="after")
    def _coupled(self) -> Self:
        if self.coupling is None:
            return self
        for name in (self.coupling.joint, self.coupling.by):
            if name not in self.joints:
                raise ValueError(f"coupling names {name!r}, which is no head joint; head joints: {list(self.joints)}")
        if self.coupling.joint == self.coupling.by:
            raise ValueError(f"coupling cannot limit {self.coupling.joint!r} by itself")
        return self


class CameraTable(_Table):
    """The camera of the model that the eye looks through, and its picture's size in pixels.

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


class MarkerTable(_Table):
    """The body that carries the cube of tags, and where: position (m) and axis in that body's frame."""

    body: str
    position: tuple[Finite, Finite, Finite]
    axis: tuple[Finite, Finite, Finite] = (1.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if not any(self.axis):
            raise ValueError("axis must not be zero")
        return self


class Anatomy(_Table):
    """What MujocoBody must know of a model beyond its MJCF."""

    name: str
    model: Path
    home: str | None = None
    arm: Joints
    head: Head
    camera: CameraTable
    marker: MarkerTable
    ranges: dict[str, tuple[tuple[Finite, Finite], ...]] = {}

    @model_validator(mode="after")
    def _apart(self) -> Self:
        both = set(self.arm.joints) & set(self.head.joints)
        if both:
            raise ValueError(f"a joint belongs to arm or head, not to both: {sorted(both)}")
        for name, intervals in self.ranges.items():
            if len(intervals) != len(self.arm.joints):
                joints = list(self.arm.joints)
                raise ValueError(f"the range {name!r} needs one [low, high] for each of {joints}, not {len(intervals)}")
        return self

    @classmethod
    def load(cls, path: str | Path) -> Anatomy:
        """Read an anatomy file (TOML); `model` is resolved relative to it.

        Raises:
            BodyError: the file is missing or does not parse, or a key is unknown, missing or wrong.
        """
        path = Path(path)
        try:
            table = tomllib.loads(path.read_text(encoding="utf-8"))
        except OSError as error:
            raise BodyError(f"Cannot read the anatomy file {path}: {error.strerror}.") from error
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise BodyError(f"The anatomy file {path} is not valid TOML: {error}.") from error
        try:
            anatomy = cls.model_validate(table)
        except ValidationError as error:
            lines = (f"{'.'.join(map(str, e['loc'])) or 'file'}: {e['msg']}" for e in error.errors())
            raise BodyError(
                f"The anatomy file {path} does not fit: {'; '.join(lines)}. Keys: {', '.join(cls.model_fields)}."
            ) from error
        return anatomy.model_copy(update={"model": path.parent / anatomy.model})


def anatomy_path(body: str) -> Path:
    """The anatomy file of a body that comes with somatopy, or of one named by its path.

    Raises:
        BodyError: neither a known name nor an existing file.
    """
    if body in MODELS:
        return MODELS[body]
    if Path(body).is_file():
        return Path(body)
    raise BodyError(f"Body {body!r} is neither a known body nor an anatomy file. Known bodies: {', '.join(MODELS)}.")
