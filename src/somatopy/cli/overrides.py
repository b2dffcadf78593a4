"""What dotted options do to a description before values are parsed: chosen kinds, short forms of phases."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import MISSING, fields
from typing import Any, NamedTuple, get_origin, get_type_hints

from pydantic import PydanticUserError, TypeAdapter, ValidationError

from somatopy.experiment.changes import damage_named, replace_short, standing_for
from somatopy.experiment.description import SHORT_FORMS, Description, DescriptionError, stands_for
from somatopy.registry import INTERVENTIONS, Kinds, Settings, UnknownKind

__all__ = ["Option", "aliases", "chosen", "damage_of_phase"]


class Option(NamedTuple):
    """A dotted option as it was written.

    Attributes:
        path: its keys.
        word: the option itself.
        values: the words behind it.
    """

    path: tuple[str, ...]
    word: str
    values: tuple[str, ...]

    @classmethod
    def of(cls, words: Sequence[str]) -> Option:
        """From an option and its values, also where it was written --option=value."""
        word, equals, value = words[0].partition("=")
        path = tuple(word.removeprefix("--").replace("-", "_").split("."))
        return cls(path, word, (*([value] if equals else []), *words[1:]))

    @property
    def words(self) -> list[str]:
        """The option and its values."""
        return [self.word, *self.values]

    @property
    def short_form(self) -> str | None:
        """The short form of a phase that it speaks of."""
        return self.path[2] if self.path[0] == "phases" and self.path[2:3] and self.path[2] in SHORT_FORMS else None


# -- dotted options ----------------------------------------------------------------------------------------------------


def chosen(table: dict[str, Any], options: Sequence[Option]) -> list[Option]:
    """Choose kinds in a table, and tell the short forms of its phases by the names of their interventions.

    Args:
        table: of the description; changed.
        options: the dotted options.

    Returns:
        Those that are left to set a field.
    """
    for option in sorted(options, key=lambda option: len(option.path)):
        if option.short_form:
            _choose_short(table, option)
        elif option.path[-1] == "kind" and len(option.values) == 1:
            _choose(table, option.path[:-1], option.values[0])
    left = [told for option in options if (told := _told(table, option)) is not None]
    for option in left:
        _fill(table, option)
    return left


def _phase(table: Mapping[str, Any], number: str) -> dict[str, Any] | None:
    phases: list[dict[str, Any]] = table["phases"]
    return phases[int(number)] if number.isdigit() and int(number) < len(phases) else None


def _choose_short(table: dict[str, Any], option: Option) -> None:
    """Do what `--phases.N.start`, `--phases.N.plastic`, `--phases.N.damage` and `--phases.N.damage.kind` say."""
    phase, key, behind, values = _phase(table, option.path[1]), option.path[2], option.path[3:], option.values
    if phase is None:
        return
    if key != "plastic" and behind in ((), ("kind",)) and len(values) != 1:
        raise DescriptionError(f"{option.word} takes one value, not {len(values)}.")
    if key == "plastic" and not behind:
        replace_short(phase["interventions"], key, {"kind": "plastic", "parts": values})
    elif key == "start" and not behind:
        choices = ["continue", *sorted(SHORT_FORMS["start"])]
        if values[0] not in choices:
            raise DescriptionError(f"{option.word} {values[0]!r} is unknown; choose one of {', '.join(choices)}.")
        replace_short(phase["interventions"], key, None if values[0] == "continue" else {"kind": values[0]})
    elif key == "damage" and behind in ((), ("kind",)):
        _choose_damage(phase["interventions"], option)


def _choose_damage(interventions: list[dict[str, Any]], option: Option) -> None:
    """A damage of the kind that is there already keeps its settings when its kind is chosen again."""
    text, by_kind = option.values[0], option.path[3:] == ("kind",)
    places = standing_for("damage", interventions)
    if by_kind and len(places) == 1 and interventions[places[0]]["kind"] == text:
        return
    plain = {"kind": text} if by_kind and text != "none" else None
    replace_short(interventions, "damage", plain if by_kind else damage_named(text, option.word))


def _choose(table: dict[str, Any], path: tuple[str, ...], kind: str) -> None:
    """Choose the kind of the part at a path; of another kind than before, it begins with its defaults."""
    if not path:
        return
    parent, last = _at(table, path[:-1]), path[-1]
    if isinstance(parent, list) and last == str(len(parent)):
        parent.append({"kind": kind})
    part = _entry(parent, last)
    is_part = isinstance(part, dict) and "kind" in part
    if (is_part and part["kind"] != kind) or (part is None and _kinds_in(_settings_at(table, path[:-1]), last)):
        parent[int(last) if isinstance(parent, list) else last] = {"kind": kind}


def _at(table: Any, path: Sequence[str]) -> Any:
    """What stands at a path; None if nothing does."""
    for key in path:
        table = _entry(table, key)
    return table


def _entry(table: Any, key: str) -> Any:
    if isinstance(table, Mapping):
        return table.get(key)
    if isinstance(table, list | tuple) and key.isdigit() and int(key) < len(table):
        return table[int(key)]
    return None


def _settings_at(table: dict[str, Any], path: Sequence[str]) -> type[Settings] | None:
    """The settings of the part at a path, as far as the kinds on the way are known."""
    kinds: Kinds | None
    if path[:1] == ("phases",):
        kinds, part, behind = INTERVENTIONS, _at(table, path[:4]), path[4:]
    else:
        kinds, part, behind = _kinds_in(Description, path[0]) if path else None, _at(table, path[:1]), path[1:]
    with suppress(UnknownKind):
        while kinds and isinstance(part, dict) and isinstance(part.get("kind"), str):
            settings = kinds.settings(part["kind"])
            if not behind:
                return settings
            kinds, part, behind = _kinds_in(settings, behind[0]), part.get(behind[0]), behind[1:]
    return None


def _kinds_in(owner: type | None, key: str) -> Kinds | None:
    """The kinds of which one stands in a field."""
    hint = get_type_hints(owner, include_extras=True).get(key) if owner else None
    return next((mark for mark in getattr(hint, "__metadata__", ()) if isinstance(mark, Kinds)), None)


def _told(table: dict[str, Any], option: Option) -> Option | None:
    """A short form of a phase by the name of its intervention; None where it has been done already."""
    if option.short_form is None:
        return option
    phase, number, behind = _phase(table, option.path[1]), option.path[1], option.path[3:]
    if phase is None or option.short_form != "damage":
        return None if not behind else option
    if behind in ((), ("kind",)):
        return None
    places = standing_for("damage", phase["interventions"])
    if len(places) != 1:
        raise DescriptionError(
            f"{option.word} asks for one damage in phases.{number}, which has {len(places)}; choose one with "
            f"--phases.{number}.damage.kind KIND, or name the place: --phases.{number}.interventions.K.{behind[-1]}."
        )
    path = ("phases", number, "interventions", str(places[0]), *behind)
    return Option(path, "--" + ".".join(path).replace("_", "-"), option.values)


def _fill(table: dict[str, Any], option: Option) -> None:
    """Give a setting that has no default what was written, so that the description is whole before it is parsed."""
    part, name = _at(table, option.path[:-1]), option.path[-1]
    settings = _settings_at(table, option.path[:-1])
    if settings is None or name in part or not option.values:
        return
    if any(entry.name == name and _is_required(entry) for entry in fields(settings)):
        hint = get_type_hints(settings)[name]
        part[name] = option.values if get_origin(hint) in (tuple, list) else option.values[0]
        with suppress(ValidationError, PydanticUserError):
            part[name] = TypeAdapter(hint).validate_python(part[name])


def _is_required(entry: Any) -> bool:
    return entry.default is MISSING and entry.default_factory is MISSING


# -- names of short forms ----------------------------------------------------------------------------------------------


def damage_of_phase(kinds: Iterable[str]) -> int | None:
    """The place of a phase's only damage among the kinds of its interventions."""
    places = [k for k, kind in enumerate(kinds) if stands_for("damage", kind)]
    return places[0] if len(places) == 1 else None


def aliases(description: Description) -> list[str]:
    """The dotted names of short forms."""
    found = []
    for number, phase in enumerate(description.phases):
        place = damage_of_phase(settings.kind for settings in phase.interventions)
        own = [] if place is None else [entry.name for entry in fields(phase.interventions[place])]
        short = ["start", "plastic", "damage", "damage.kind", *(f"damage.{name}" for name in own)]
        found += [f"phases.{number}.{name}" for name in short]
    return found
