"""The description of an experiment, frozen and validated, and how it is read from TOML."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from itertools import pairwise
from numbers import Real
from pathlib import Path
from typing import Annotated, Any, Self, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator
from pydantic_core import InitErrorDetails, PydanticCustomError

# Each package names its kinds when it is imported.
import somatopy.babbling
import somatopy.bodies
import somatopy.eyes
import somatopy.interventions
import somatopy.learners  # noqa: F401
from somatopy.clock import FRAMES_PER_MINUTE
from somatopy.registry import BABBLERS, BODIES, EYES, INTERVENTIONS, LEARNERS, Settings
from somatopy.validation import check_numbers, explain, no_toml

__all__ = [
    "DESCRIPTION",
    "FORMAT",
    "NO_DAMAGE",
    "Description",
    "DescriptionError",
    "Phase",
    "frames_of",
    "load_description",
    "read_table",
    "validated",
]

#: Of experiment.toml and the rest of a run folder.
FORMAT = 2
#: The file's name in a run folder.
DESCRIPTION = "experiment.toml"
#: Tables that a run folder writes beside its description.
RECORDS = ("format", "versions", "written_by", "resumed", "cite", "remarks")
#: Kinds of intervention that are no damage: they touch the learner alone.
NO_DAMAGE = frozenset({"plastic", "afresh", "shuffled"})

T = TypeVar("T", bound=BaseModel)
Intervention = Annotated[Settings, INTERVENTIONS]


class DescriptionError(ValueError):
    """A description cannot be run. The message names the key, its value and the valid choices."""


class _Table(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")

    @model_validator(mode="before")
    @classmethod
    def _numbers(cls, table: Any) -> Any:
        if isinstance(table, Mapping):
            check_numbers({name: info.annotation for name, info in cls.model_fields.items()}, table)
        return table

    def replaced(self, **changes: Any) -> Self:
        """A copy with some keys replaced, validated again.

        Raises:
            DescriptionError: unknown keys (the valid ones are listed), wrong types or values.
        """
        table = {name: getattr(self, name) for name in type(self).model_fields}
        return _model(type(self), self._changed(table, changes), f"The changed {type(self).__name__.lower()}")

    def _changed(self, table: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
        return table | changes


class Phase(_Table):
    """A phase of an experiment: its length, and what is done to body and learner during it.

    `damage`, `plastic` and `start` are short forms for common interventions. `damage` takes the name or table of one
    damage, or "none". `plastic` lists the parts of the learner that learn. `start` is "continue", "afresh" or
    "shuffled". They become interventions in the order start, plastic, damage, before those that `interventions` lists.
    """

    name: str = Field("intact", min_length=1, description="Its name, which no other phase has.")
    frames: int = Field(177_823, ge=0, le=10**12, description="Length, frames of 1/15 s.")
    interventions: tuple[Intervention, ...] = Field((), description="What is done, in this order.")
    trend_breaks: tuple[int, ...] = Field((), description="Windows at which a new trend line starts.")

    @model_validator(mode="before")
    @classmethod
    def _resolved(cls, table: Any) -> Any:
        if not isinstance(table, Mapping):
            return table
        given = dict(table)
        short = [settings for key in ("start", "plastic", "damage") for settings in _short_form(key, given)]
        listed = given.get("interventions", ())
        if short and isinstance(listed, list | tuple):
            given["interventions"] = (*short, *listed)
        return given

    @field_validator("trend_breaks")
    @classmethod
    def _increasing(cls, breaks: tuple[int, ...]) -> tuple[int, ...]:
        if any(after <= before for before, after in pairwise((0, *breaks))):
            raise ValueError(f"windows must be positive and increasing, such as [7], not {list(breaks)}")
        return breaks

    @property
    def damage(self) -> str:
        """The kinds of the phase's damages, joined by +; "none" if it has no damage."""
        return damage_of(settings.kind for settings in self.interventions)

    def _changed(self, table: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
        """A short form takes the place of the interventions that it stands for."""
        if "interventions" not in changes:
            kept = table["interventions"]
            for key in SHORT_FORMS.keys() & changes.keys():
                kept = [settings for settings in kept if not stands_for(key, settings.kind)]
            table["interventions"] = tuple(kept)
        return table | changes


def damage_of(kinds: Iterable[str]) -> str:
    """The damages of a phase as one text, from the kinds of its interventions.

    Example:
        >>> damage_of(["plastic", "offset", "my_file:Noise"]), damage_of(["afresh"])
        ('offset+my_file:Noise', 'none')
    """
    return "+".join(kind for kind in kinds if kind not in NO_DAMAGE) or "none"


#: Short forms of a phase, and the kinds of intervention that each can stand for.
SHORT_FORMS: dict[str, frozenset[str]] = {
    "start": frozenset({"afresh", "shuffled"}),
    "plastic": frozenset({"plastic"}),
    "damage": frozenset(),
}


def stands_for(key: str, kind: str) -> bool:
    """Whether a short form stands for interventions of this kind."""
    return kind not in NO_DAMAGE if key == "damage" else kind in SHORT_FORMS[key]


def _short_form(key: str, table: dict[str, Any]) -> list[Settings]:
    """Take a short form out of a table; the intervention that it stands for, if any."""
    value = table.pop(key, None)
    if value is None:
        return []
    if key == "start":
        if value not in ("continue", "afresh", "shuffled"):
            raise _wrong(key, value, "choice", "choose one of continue, afresh, shuffled")
        return [] if value == "continue" else [INTERVENTIONS.validated(value)]
    if key == "plastic":
        value = {"kind": "plastic", "parts": value}
    elif value == "none" or (isinstance(value, Mapping) and value.get("kind") == "none"):
        if isinstance(value, Mapping) and len(value) > 1:
            raise _wrong(key, value, "choice", "the kind none has no keys of its own; leave them out")
        return []
    try:
        return [INTERVENTIONS.validated(value)]
    except PydanticCustomError as error:
        raise ValidationError.from_exception_data("", [{"type": error, "loc": (key,), "input": value}]) from error
    except ValidationError as error:
        raise ValidationError.from_exception_data("", list(_under(key, error))) from error


def _under(key: str, error: ValidationError) -> Iterable[InitErrorDetails]:
    """The errors of a short form, at its key."""
    for item in error.errors(include_url=False):
        loc = tuple(part for part in item["loc"] if not (key == "plastic" and part == "parts"))
        kind = PydanticCustomError(item["type"], "{said}", {**item.get("ctx", {}), "said": item["msg"]})
        yield {"type": kind, "loc": (key, *loc), "input": item["input"]}


def _wrong(key: str, value: Any, kind: str, said: str) -> ValidationError:
    error = PydanticCustomError(kind, "{said}", {"said": said})
    return ValidationError.from_exception_data("", [{"type": error, "loc": (key,), "input": value}])


class Description(_Table):
    """An experiment: seed, robot, eye, babbling, learner and phases."""

    name: str = Field("experiment", description="Goes into the run folder's name.")
    seed: int = Field(0, ge=0, lt=2**63, description="All random numbers follow from it.")
    body: Annotated[Settings, BODIES] = Field(default_factory=lambda: BODIES.validated({}))
    eye: Annotated[Settings, EYES] = Field(default_factory=lambda: EYES.validated("fiducial"))
    babbling: Annotated[Settings, BABBLERS] = Field(default_factory=lambda: BABBLERS.validated({}))
    learner: Annotated[Settings, LEARNERS] = Field(default_factory=lambda: LEARNERS.validated("hebbian"))
    phases: tuple[Phase, ...] = (Phase(),)

    @field_validator("name")
    @classmethod
    def _plain(cls, name: str) -> str:
        if not re.fullmatch(r"[A-Za-z0-9._-]+", name):
            said = "must hold only A to Z, a to z, digits, ., _ and -, since it goes into a folder's name"
            raise PydanticCustomError("name", said)
        return name

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


def frames_of(minutes: float) -> int:
    """Number of frames in some minutes of robot time: 900 a minute, rounded.

    Raises:
        DescriptionError: the minutes are negative, not finite, or not a number.
    """
    if not isinstance(minutes, Real) or isinstance(minutes, bool) or not 0 <= minutes < math.inf:
        raise DescriptionError(f"Minutes must be finite and at least 0, not {minutes!r}.")
    return round(FRAMES_PER_MINUTE * minutes)


def validated(table: Mapping[str, Any], source: str) -> Description:
    """A description from plain data.

    Args:
        table: the parsed TOML. In place of a kind's name it may hold a class or function of your own.
        source: its name in error messages.

    Raises:
        DescriptionError: unknown keys (the valid ones are listed), wrong types or values.
    """
    return _model(Description, table, source)


def _model(model: type[T], table: Mapping[str, Any], source: str) -> T:
    try:
        return model.model_validate(table)
    except ValidationError as error:
        raise DescriptionError(f"{source}: {explain(error, partial(_fields, model))}.") from error


def read_table(path: str | Path) -> dict[str, Any]:
    """A description file (TOML) as plain data, without what a run folder adds to the description.

    Raises:
        DescriptionError: the file cannot be read, is no TOML, or belongs to a run folder of another format.
    """
    try:
        table = tomllib.loads(Path(path).read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise DescriptionError(f"Cannot read the description {path}: {error.strerror}.") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise DescriptionError(f"The description {path} {no_toml(error)}.") from error
    if "versions" in table and table.get("format") != FORMAT:
        raise DescriptionError(
            f"{path} was written by another version of somatopy (run folder format {table.get('format', 1)}, "
            f"this version has {FORMAT}): use the version that it names, or run the experiment again."
        )
    return {key: value for key, value in table.items() if key not in RECORDS}


def load_description(path: str | Path) -> Description:
    """Read a description file (TOML). The experiment.toml of a run folder is one as well.

    With the key `preset` it starts from that preset, and says only what differs (docs/description.md).

    Raises:
        DescriptionError: the file cannot be read, is no TOML, or does not fit.
    """
    table = read_table(path)
    if "preset" in table:
        from somatopy.experiment.starting import from_preset  # presets are descriptions themselves

        table = from_preset(table, str(path))
    return validated(table, str(path))


def _fields(model: type[BaseModel], keys: Sequence[str]) -> list[str]:
    """Names of the fields of the table at some keys."""
    if [*keys[:1]] == ["phases"] and model is Description:
        return [*Phase.model_fields, *SHORT_FORMS]
    return [*model.model_fields, *(SHORT_FORMS if model is Phase else ())]
