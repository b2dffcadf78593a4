"""Everything an experiment knows, in one frozen, validated description; TOML in and out."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

__all__ = [
    "FRAMES_PER_MINUTE",
    "Babbling",
    "BodyChoice",
    "Description",
    "DescriptionError",
    "Fiducial",
    "FixedControl",
    "Hebbian",
    "MapSettings",
    "NoDamage",
    "OffsetDamage",
    "Phase",
    "RandomControl",
    "frames_of",
    "load_description",
    "validated",
]

FRAMES_PER_MINUTE = 900

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Elasticity = Positive


class DescriptionError(ValueError):
    """A description that cannot be run; the message names the key, its value and the valid choices."""


class _Table(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class BodyChoice(_Table):
    """The robot, and how it moves."""

    model: str = Field("nao", description="A known body, or the path of an anatomy file.")
    motion: Literal["dynamic", "kinematic"] = Field("dynamic", description="Physics, or joints that obey at once.")
    head_speed: Positive | None = Field(None, description="Speed of the head's set-points, rad/s; the body's limit if none.")


class Fiducial(_Table):
    """The rendered camera and OpenCV's marker detector."""

    kind: Literal["fiducial"] = "fiducial"


class Babbling(_Table):
    """Motor babbling to uniform random targets."""

    kind: Literal["uniform"] = "uniform"
    range: str | tuple[tuple[Finite, Finite], ...] = Field(
        "mechanical", description="A range that the body names, or low and high of each arm joint, rad."
    )
    speed: Positive = Field(0.8, description="Speed of the arm's set-points, rad/s.")


class MapSettings(_Table):
    """A Dynamic Self-Organising Map of [0, 1] units."""

    shape: tuple[int, int] = Field((30, 30), description="Rows and columns of the lattice.")
    learning_rate: float = Field(0.1, ge=0, le=1, description="epsilon of equation 1.")
    elasticity: Elasticity = Field(0.1, description="eta of equation 2.")

    @field_validator("shape")
    @classmethod
    def _has_units(cls, shape: tuple[int, int]) -> tuple[int, int]:
        if min(shape) < 1:
            raise ValueError(f"both sides must be at least 1, not {shape}")
        return shape


class Hebbian(_Table):
    """The paper's learner: arm map, head map, positive Hebbian links."""

    kind: Literal["hebbian"] = "hebbian"
    arm_map: MapSettings = MapSettings()
    head_map: MapSettings = MapSettings()
    link_rate: float = Field(0.01, ge=0, allow_inf_nan=False, description="eta of equation 3.")


class RandomControl(_Table):
    """Control: uniform random head postures, each held until reached or for one second."""

    kind: Literal["random"] = "random"


class FixedControl(_Table):
    """Control: one head posture for ever."""

    kind: Literal["fixed"] = "fixed"
    head: tuple[Finite, ...] = Field((0.0, 0.0), description="That posture, rad.")


class NoDamage(_Table):
    """The intact robot."""

    kind: Literal["none"] = "none"


class OffsetDamage(_Table):
    """A constant added to the sensed arm posture and to the efference copy of the arm command; nothing is clipped."""

    kind: Literal["offset"] = "offset"
    offset: tuple[Finite, ...] = Field((0.1265, 1.1411, 1.2295, -0.2242), description="One a joint, rad.")


Eye = Annotated[Fiducial, Field()]
LearnerChoice = Annotated[Hebbian | RandomControl | FixedControl, Field(discriminator="kind")]
Damage = Annotated[NoDamage | OffsetDamage, Field(discriminator="kind")]


class Phase(_Table):
    """A stretch of the experiment with one damage."""

    name: str = Field("intact", min_length=1)
    frames: int = Field(177_823, ge=0, description="Length, frames of 1/15 s.")
    damage: Damage = NoDamage()
    trend_breaks: tuple[int, ...] = Field((), description="Windows at which a new trend line starts.")


class Description(_Table):
    """An experiment: seed, robot, eye, babbling, learner and phases."""

    name: str = Field("experiment", pattern=r"^[A-Za-z0-9._-]+$", description="Goes into the run folder's name.")
    seed: int = Field(0, ge=0, description="One seed; every part draws from its own named stream.")
    body: BodyChoice = BodyChoice()
    eye: Eye = Fiducial()
    babbling: Babbling = Babbling()
    learner: LearnerChoice = Hebbian()
    phases: tuple[Phase, ...] = Field((Phase(),), min_length=1)

    @field_validator("phases")
    @classmethod
    def _named_apart(cls, phases: tuple[Phase, ...]) -> tuple[Phase, ...]:
        names = [phase.name for phase in phases]
        if len(set(names)) < len(names):
            raise ValueError(f"phases need names of their own, not {names}")
        return phases

    @property
    def frames(self) -> int:
        """Frames of all phases together."""
        return sum(phase.frames for phase in self.phases)

    def replaced(self, **tables: Any) -> Self:
        """A copy with some top-level keys replaced, validated again."""
        return type(self).model_validate(self.model_dump() | tables)


def frames_of(minutes: float) -> int:
    """Frames in that many minutes of robot time: round(900 minutes).

    Raises:
        DescriptionError: negative or not finite.
    """
    if not 0 <= minutes < math.inf:
        raise DescriptionError(f"Minutes must be finite and at least 0, not {minutes}.")
    return round(FRAMES_PER_MINUTE * minutes)


def validated(table: dict[str, Any], source: str) -> Description:
    """A description from plain data.

    Args:
        table: the parsed TOML.
        source: what to call it in an error.

    Raises:
        DescriptionError: unknown keys (the valid ones are listed), wrong types or values.
    """
    try:
        return Description.model_validate(table)
    except ValidationError as error:
        raise DescriptionError(f"{source}: {'; '.join(_explain(error))}.") from error


def load_description(path: str | Path) -> Description:
    """Read a description file (TOML). A run folder's experiment.toml is one too.

    Raises:
        DescriptionError: the file cannot be read, is no TOML, or does not fit.
    """
    try:
        table = tomllib.loads(Path(path).read_text())
    except OSError as error:
        raise DescriptionError(f"Cannot read the description {path}: {error.strerror}.") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise DescriptionError(f"The description {path} is not valid TOML: {error}.") from error
    for record in ("versions", "cite"):
        table.pop(record, None)
    return validated(table, str(path))


def _explain(error: ValidationError) -> Iterable[str]:
    for item in error.errors():
        where = ".".join(str(part) for part in item["loc"])
        if item["type"] == "extra_forbidden":
            yield f"unknown key {where!r}; valid keys there: {', '.join(_valid_keys(item['loc'][:-1]))}"
        else:
            yield f"{where} = {item['input']!r}: {item['msg']}"


def _valid_keys(location: tuple[int | str, ...]) -> list[str]:
    """The keys of the table at a location of a validation error, in which a union's member stands by its kind."""
    table: Any = Description
    for part in location:
        if isinstance(part, int):
            continue
        members = _members(table.model_fields[part].annotation) if part in table.model_fields else _CHOICES[str(part)]
        table = members[0]
    return list(table.model_fields)


def _members(annotation: Any) -> list[Any]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [m for a in getattr(annotation, "__args__", ()) for m in _members(a)]


_CHOICES = {m.model_fields["kind"].default: [m] for m in (Fiducial, Hebbian, RandomControl, FixedControl, NoDamage, OffsetDamage)}
