"""A description as options: a mirror of it in plain dataclasses, from which the parser of options is made."""

from __future__ import annotations

import re
import types
import unicodedata
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import field, fields, is_dataclass, make_dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import docstring_parser
import tyro
from pydantic import BaseModel
from typing_extensions import Doc

from somatopy.experiment.description import SHORT_FORMS, Phase, stands_for
from somatopy.registry import INTERVENTIONS, SORTS, Settings

__all__ = ["described_fields", "is_table", "keys", "kinds_of", "mark", "mirrored", "plain", "shown"]

_Entry = tuple[str, Any, Any]
_AS_IT_IS = "default: as it is"


def mirrored(part: Any, as_help: bool = False) -> Any:
    """A description, or a table in it, as a plain dataclass of its present kinds, its values the defaults.

    Args:
        part: the description, or a table in it.
        as_help: whether phases show their short forms instead of the interventions that these stand for.
    """
    entries: list[_Entry] = []
    if isinstance(part, Settings):
        entries.append(("kind", Annotated[str, mark("KIND", kinds_of(part))], part.kind))
    for name, hint, text in described_fields(part):
        value = getattr(part, name)
        if name == "interventions" and as_help:
            entries += _short_forms(part)
        elif is_table(value):
            value = mirrored(value, as_help)
            entries.append((name, type(value), value))
        elif isinstance(value, tuple) and any(map(is_table, value)):
            value = tuple(mirrored(item, as_help) for item in value)
            entries.append((name, tuple[tuple(map(type, value))], value))  # type: ignore[misc]
        elif not (value == () and name == "interventions"):
            entries.append((name, _settable(hint, text, value), value))
    return _made(type(part).__name__, _first_line(part), entries)


def _made(name: str, text: str, entries: list[_Entry]) -> Any:
    made = make_dataclass(
        name, [(key, hint, field(default_factory=_giving(value))) for key, hint, value in entries], frozen=True
    )
    made.__doc__ = text
    return made()


def _first_line(part: Any) -> str:
    return (type(part).__doc__ or "").partition("\n")[0]


def _giving(value: Any) -> Callable[[], Any]:
    return lambda: value


def shown(mirror: type) -> Any:
    """A mirror's options without a common name, its truth values written out."""
    return Annotated[mirror, tyro.conf.FlagConversionOff, tyro.conf.arg(name="")]


def mark(metavar: str | None, text: str, default: str | None = _AS_IT_IS) -> Any:
    """What makes a field an option, for `Annotated`.

    Args:
        metavar: what the help writes for its value; None for a switch, which has none.
        text: what it means.
        default: what the help says of its default instead of the value; None if nothing.
    """
    if default == _AS_IT_IS:
        return tyro.conf.arg(metavar=metavar, help=text)
    return tyro.conf.arg(metavar=metavar, help=text, help_behavior_hint=f"({default})" if default else "")


def _settable(hint: Any, text: str, value: Any) -> Any:
    """The type of a field, with its meaning; what words cannot say keeps its value."""
    metavar = _metavar(hint)
    if metavar is None:
        return Annotated[hint, tyro.conf.Fixed, tyro.conf.Suppress]
    default = None if value is None else "default: none" if value == () else _AS_IT_IS
    return Annotated[hint, mark(metavar, text, default)]


_WORDS = {str: "TEXT", int: "INT", float: "FLOAT", Path: "PATH", bool: "True|False", type(None): "None"}


def _metavar(hint: Any) -> str | None:
    """How the help writes a value of this type; None if words cannot say it."""
    if hint in _WORDS:
        return _WORDS[hint]
    origin, inner = get_origin(hint), get_args(hint)
    if origin is Literal:
        return "|".join(map(str, inner))
    if origin in (Union, types.UnionType):
        parts = [_metavar(each) for each in sorted(inner, key=lambda each: each is type(None))]
        return None if None in parts else "|".join(map(str, parts))
    if origin in (tuple, list):
        parts = [_metavar(each) for each in inner if each is not Ellipsis]
        more = " ..." if Ellipsis in inner or origin is list else ""
        return None if None in parts else " ".join(map(str, parts)) + more
    return None


# -- what is in a table ------------------------------------------------------------------------------------------------


def kinds_of(part: Settings) -> str:
    """What may stand in the place of a part."""
    for kinds in SORTS.values():
        if part.kind in kinds:
            return f"One of {', '.join(kinds)}, {_OWN}"
    return "A part of your own, by its place, module:Name."


def is_table(value: Any) -> bool:
    """Whether a value has keys of its own."""
    return isinstance(value, BaseModel) or (is_dataclass(value) and not isinstance(value, type))


def described_fields(part: Any) -> Iterator[tuple[str, Any, str]]:
    """Name, plain type and meaning of each field."""
    if isinstance(part, BaseModel):
        for name, info in type(part).model_fields.items():
            yield name, info.annotation, info.description or ""
        return
    hints, said = get_type_hints(type(part)), get_type_hints(type(part), include_extras=True)
    texts = {entry.arg_name: entry.description for entry in docstring_parser.parse(type(part).__doc__ or "").params}
    for entry in fields(part):
        marks = getattr(said[entry.name], "__metadata__", ())
        text = next((mark.documentation for mark in marks if isinstance(mark, Doc)), texts.get(entry.name))
        yield entry.name, _parsed(hints[entry.name], getattr(part, entry.name)), _told(text or "")


def _parsed(hint: Any, value: Any) -> Any:
    """A type that words can be parsed to; of what says none, that of its value."""
    return _type_of(value) if hint in (Any, tuple[Any, ...]) else hint


def _type_of(value: Any) -> Any:
    if value is None:
        return str | None
    if isinstance(value, tuple | list) and value:
        inner = {type(each) for each in value}
        one: Any = float if inner == {int, float} else type(value[0])
        return tuple[one, ...] if inner <= _WORDS.keys() else tuple
    return type(value)


_MATH = re.compile(r":math:`([^`]*)`")
_LETTER = re.compile(r"\\(?:var)?([a-z]+)")


def _told(text: str) -> str:
    """A docstring's text as a terminal shows it: formulas in letters, no quotes of code, a capital first."""
    text = _MATH.sub(lambda formula: _LETTER.sub(_greek, formula[1]), " ".join(text.split())).replace("`", "")
    return text[:1].upper() + text[1:] if text[:1].isascii() else text


def _greek(name: re.Match[str]) -> str:
    with suppress(KeyError):
        return unicodedata.lookup(f"GREEK SMALL LETTER {name[1]}")
    return name[1]


# -- short forms of phases, for the help -------------------------------------------------------------------------------

_START = "How the learner begins this phase."
_PLASTIC = "Parts of the learner that learn in this phase."
_DAMAGE = "One of none, paper, offset:A,B,C,D (rad, one a joint)"
_OWN = "or one of your own by its place, module:Name."


def _short_forms(phase: Phase) -> list[_Entry]:
    """Short forms in the place of the interventions that they stand for, then all others by their number."""
    by_form: dict[str, list[int]] = {
        key: [k for k, settings in enumerate(phase.interventions) if stands_for(key, settings.kind)]
        for key in SHORT_FORMS
    }
    one: dict[str, Any] = {key: phase.interventions[ks[0]] for key, ks in by_form.items() if len(ks) == 1}
    start, plastic = (one.get(key) for key in ("start", "plastic"))
    parts: tuple[str, ...] = plastic.parts if plastic else ()
    others = [k for key, ks in by_form.items() if key not in one for k in ks]
    return [
        ("start", Annotated[str, mark("continue|afresh|shuffled", _START)], start.kind if start else "continue"),
        ("plastic", Annotated[tuple[str, ...], mark("PART ...", _PLASTIC, _parts_said(parts, bool(plastic)))], parts),
        _damage(phase, one.get("damage")),
        *(_numbered(k, phase.interventions[k]) for k in sorted(others)),
    ]


def _parts_said(parts: tuple[str, ...], given: bool) -> str:
    return f"default: {' '.join(parts) or 'none of them'}" if given else "default: all of them"


def _damage(phase: Phase, damage: Settings | None) -> _Entry:
    kinds = [kind for kind in INTERVENTIONS if stands_for("damage", kind)]
    if damage is None:
        others = [kind for kind in kinds if kind != "offset"]
        text = ", ".join([_DAMAGE, *others, _OWN])
        return "damage", Annotated[str, mark("KIND", text)], phase.damage
    kind = Annotated[str, mark("KIND", f"One of none, {', '.join(kinds)}, {_OWN}")]
    own = [
        (name, _settable(hint, said, getattr(damage, name)), getattr(damage, name))
        for name, hint, said in described_fields(damage)
    ]
    value = _made("Damage", _first_line(damage), [("kind", kind, damage.kind), *own])
    return "damage", type(value), value


def _numbered(place: int, settings: Settings) -> _Entry:
    value = mirrored(settings)
    return f"intervention_{place}", Annotated[type(value), tyro.conf.arg(name=f"interventions.{place}")], value


# -- mirrors as data ---------------------------------------------------------------------------------------------------


def plain(part: Any) -> Any:
    """A mirror as a table."""
    if is_dataclass(part) and not isinstance(part, type):
        return {entry.name: plain(getattr(part, entry.name)) for entry in fields(part)}
    return tuple(map(plain, part)) if isinstance(part, tuple) else part


def keys(part: Any, prefix: str = "") -> Iterator[str]:
    """Dotted keys of a mirror's leaves that words can set."""
    if is_dataclass(part) and not isinstance(part, type):
        for entry in (e for e in fields(part) if tyro.conf.Fixed not in getattr(e.type, "__metadata__", ())):
            yield from keys(getattr(part, entry.name), f"{prefix}.{entry.name}" if prefix else entry.name)
    elif isinstance(part, tuple) and part and is_dataclass(part[0]):
        for number, item in enumerate(part):
            yield from keys(item, f"{prefix}.{number}")
    else:
        yield prefix
