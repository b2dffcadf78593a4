"""Everything an experiment knows, in one frozen, validated description; TOML in and out."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

__all__ = [
    "FRAMES_PER_MINUTE",
    "Babbling",
    "BodyChoice",
    "Description",
    "DescriptionError",
    "Fiducial",
    "FixedControl",
    "Geometric",
    "Hebbian",
    "MapSettings",
    "NearestControl",
    "NoDamage",
    "OffsetDamage",
    "OwnLearner",
    "Phase",
    "RandomControl",
    "frames_of",
    "load_description",
    "validated",
]

FRAMES_PER_MINUTE = 900
MOST_UNITS = 10_000_000

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
    head_speed: Positive | None = Field(
        None, description="Speed of the head's set-points, rad/s; the body's limit if none."
    )


class Fiducial(_Table):
    """The rendered camera and OpenCV's marker detector."""

    kind: Literal["fiducial"] = "fiducial"
    skip: bool = Field(True, description="Spare pictures in which the marker is provably out of view.")


class Geometric(_Table):
    """A model of that eye, computed from the true poses without a picture."""

    kind: Literal["geometric"] = "geometric"


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
    learning_rate: float = Field(0.1, gt=0, le=1, description="epsilon of equation 1.")
    elasticity: Elasticity = Field(0.1, description="eta of equation 2.")

    @field_validator("shape")
    @classmethod
    def _has_units(cls, shape: tuple[int, int]) -> tuple[int, int]:
        if min(shape) < 1:
            raise ValueError(f"both sides must be at least 1, not {shape}")
        if math.prod(shape) > MOST_UNITS:
            raise ValueError(f"a map has at most {MOST_UNITS:.0e} units, not {math.prod(shape):.1e}. Make it smaller")
        return shape


class Hebbian(_Table):
    """The paper's learner: arm map, head map, positive Hebbian links."""

    kind: Literal["hebbian"] = "hebbian"
    arm_map: MapSettings = MapSettings()
    head_map: MapSettings = MapSettings()
    link_rate: Positive = Field(0.01, description="eta of equation 3.")
    arm_codes: Literal["uniform", "sampled"] = Field(
        "uniform",
        description="Start codes of the arm map: uniform in the joint ranges, or from 30 minutes of babbling.",
    )


class RandomControl(_Table):
    """Control: uniform random head postures, each held until reached or for one second."""

    kind: Literal["random"] = "random"


class FixedControl(_Table):
    """Control: one head posture for ever."""

    kind: Literal["fixed"] = "fixed"
    head: tuple[Finite, ...] | None = Field(
        None, description="That posture, rad; if none, the one that sees the hand most often while babbling."
    )


class NearestControl(_Table):
    """Control: the head posture of the nearest arm posture at which the hand was seen, all hits remembered."""

    kind: Literal["nearest"] = "nearest"


class OwnLearner(_Table):
    """A learner from outside somatopy, handed to `Experiment` or `run` beside the description."""

    kind: Literal["own"] = "own"
    name: str = Field(description="What it is called; written into the run folder.")


class NoDamage(_Table):
    """The intact robot."""

    kind: Literal["none"] = "none"


class OffsetDamage(_Table):
    """A constant added to the sensed arm posture and to the efference copy of the arm command; nothing is clipped."""

    kind: Literal["offset"] = "offset"
    offset: tuple[Finite, ...] = Field((0.1265, 1.1411, 1.2295, -0.2242), description="One a joint, rad.")


EyeChoice = Annotated[Fiducial | Geometric, Field(discriminator="kind")]
LearnerChoice = Annotated[
    Hebbian | RandomControl | FixedControl | NearestControl | OwnLearner, Field(discriminator="kind")
]
Damage = Annotated[NoDamage | OffsetDamage, Field(discriminator="kind")]


class Phase(_Table):
    """A stretch of the experiment with one damage."""

    name: str = Field("intact", min_length=1)
    frames: int = Field(177_823, ge=0, description="Length, frames of 1/15 s.")
    damage: Damage = NoDamage()
    trend_breaks: tuple[int, ...] = Field((), description="Windows at which a new trend line starts.")
    plastic: tuple[str, ...] | None = Field(None, description="Parts of the learner that learn; all of them if none.")
    start: Literal["continue", "afresh", "shuffled"] = Field(
        "continue",
        description="What the learner brings into this phase: all it knows, nothing, or links in wrong rows.",
    )

    @field_validator("trend_breaks")
    @classmethod
    def _increasing(cls, breaks: tuple[int, ...]) -> tuple[int, ...]:
        if any(after <= before for before, after in pairwise((0, *breaks))):
            raise ValueError(f"windows must be positive and increasing, such as [7], not {list(breaks)}")
        return breaks


class Description(_Table):
    """An experiment: seed, robot, eye, babbling, learner and phases."""

    name: str = Field("experiment", pattern=r"^[A-Za-z0-9._-]+$", description="Goes into the run folder's name.")
    seed: int = Field(0, ge=0, description="One seed; every part draws from its own named stream.")
    body: BodyChoice = BodyChoice()
    eye: EyeChoice = Fiducial()
    babbling: Babbling = Babbling()
    learner: LearnerChoice = Hebbian()
    phases: tuple[Phase, ...] = (Phase(),)

    @field_validator("phases")
    @classmethod
    def _named_apart(cls, phases: tuple[Phase, ...]) -> tuple[Phase, ...]:
        names = [phase.name for phase in phases]
        if not names:
            raise ValueError("an experiment needs at least one phase")
        if len(set(names)) < len(names):
            raise ValueError(f"phases need names of their own, not {names}")
        return phases

    @property
    def frames(self) -> int:
        """Frames of all phases together."""
        return sum(phase.frames for phase in self.phases)

    def replaced(self, **tables: Any) -> Description:
        """A copy with some top-level keys replaced, validated again.

        Raises:
            DescriptionError: unknown keys (the valid ones are listed), wrong types or values.
        """
        return validated(self.model_dump() | tables, "The changed description")


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
        raise DescriptionError(f"{source}: {explain(error)}.") from error


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


_PLAIN = {"missing": "a value is missing", "tuple_type": "must be a list", "model_type": "must be a table of keys"}


def explain(error: ValidationError) -> str:
    """All that is wrong, each with its key as a description file writes it, its value and the valid choices."""
    return "; ".join(_explain(error))


def _explain(error: ValidationError) -> Iterable[str]:
    for item in error.errors():
        keys, tables = _walk(item["loc"])
        where = ".".join(keys)
        match item["type"]:
            case "extra_forbidden":
                key = ".".join([*keys, str(item["loc"][-1])])
                yield f"unknown key {key!r}; valid keys there: {', '.join(tables[0].model_fields)}"
            case "union_tag_invalid":
                yield f"{where}.kind = {item['ctx']['tag']!r} is unknown; choose one of {', '.join(map(_kind, tables))}"
            case "union_tag_not_found":
                yield f"{where} lacks its kind; choose one of {', '.join(map(_kind, tables))}"
            case "value_error":
                yield f"{where}: {item['ctx']['error']}"
            case _ if item["loc"][-1:] != ("str",):  # of a union with text, the other member says what is wrong
                yield f"{where} = {item['input']!r}: {_PLAIN.get(item['type'], item['msg'])}"


def _walk(location: tuple[int | str, ...]) -> tuple[list[str], list[type[BaseModel]]]:
    """Follow the location of a validation error: its keys as a file writes them, and the tables that may stand there.

    A location names the members of unions too, tables by their kind; no file does.
    """
    keys: list[str] = []
    tables: list[type[BaseModel]] = [Description]
    for part in location:
        if isinstance(part, int):
            keys.append(str(part))
        elif len(tables) > 1:
            tables = [table for table in tables if _kind(table) == part]
        elif tables and part in tables[0].model_fields:
            keys.append(part)
            tables = _members(tables[0].model_fields[part].annotation)
    return keys, tables


def _kind(table: type[BaseModel]) -> str:
    return str(table.model_fields["kind"].default)


def _members(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [m for a in getattr(annotation, "__args__", ()) for m in _members(a)]
