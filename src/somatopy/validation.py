"""Settings from a table, and what is wrong with it in a sentence: key as a file writes it, value, valid choices."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from difflib import get_close_matches
from itertools import repeat
from types import UnionType
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

if TYPE_CHECKING:
    from pydantic import ValidationError

__all__ = ["check_numbers", "explain", "meant", "near", "no_toml", "read"]

T = TypeVar("T")

_LONGEST = 120  # letters of a value in a message
_MEMBER = re.compile(r"(constrained|finite|function|lax|literal|nullable|tuple|union)[-\[]")  # as pydantic names them
_PLAIN = {
    "tuple_type": "must be a list",
    "model_type": "must be a table of keys",
    "dataclass_type": "must be a table of keys",
    "dict_type": "must be a table of keys",
    "path_type": "must be the path of a file",
    "string_too_short": "must not be empty",
    "predicate_failed": "must be finite",
}


def meant(word: str, valid: Iterable[str]) -> str:
    """The question whether another word was meant, with a space behind it; nothing where none is near.

    Example:
        >>> meant("geometic", ["fiducial", "geometric"]), meant("rust", ["paper"])
        ('Did you mean geometric? ', '')
    """
    likely = get_close_matches(word, [*valid], n=1, cutoff=0.6)
    return f"Did you mean {likely[0]}? " if likely else ""


def near(word: str, valid: Iterable[str]) -> str:
    """The same question inside a sentence, with a space before it.

    Example:
        >>> near("randm", ["hebbian", "random"])
        ' (did you mean random?)'
    """
    asked = meant(word, valid).strip()
    return f" ({asked[:1].lower()}{asked[1:]})" if asked else ""


def no_toml(error: ValueError) -> str:
    """What is wrong with a file that cannot be read as TOML, which must be in UTF-8.

    Example:
        >>> no_toml(UnicodeDecodeError("utf-8", b"\\xe9", 0, 1, "invalid start byte"))
        "is not in UTF-8 ('utf-8' codec can't decode byte 0xe9 in position 0: invalid start byte). Save it as UTF-8"
    """
    if isinstance(error, UnicodeDecodeError):
        return f"is not in UTF-8 ({error}). Save it as UTF-8"
    return f"is not valid TOML: {error}"


def read(settings: type[T], table: Mapping[str, Any], known: tuple[str, ...] = ()) -> T:
    """Settings from a table.

    Args:
        settings: their class, a dataclass.
        table: by field.
        known: further keys that are valid in such a table.

    Raises:
        ValidationError: of pydantic, which `explain` puts into words.
    """
    from pydantic import TypeAdapter, ValidationError
    from pydantic_core import PydanticCustomError

    if unknown := _unknown_key(settings, table, known):
        key, valid = unknown
        error = PydanticCustomError("unknown_key", "unknown key", {"key": key, "valid": ", ".join(valid)})
        raise ValidationError.from_exception_data("", [{"type": error, "loc": (), "input": table}])
    check_numbers(get_type_hints(settings), table)
    found: T = TypeAdapter(settings).validate_python(table)
    return found


def _unknown_key(settings: Any, table: Mapping[str, Any], known: tuple[str, ...] = ()) -> tuple[str, list[str]] | None:
    """The first key that a table, or a table in it, does not know, and the keys that are valid there."""
    hints, valid = get_type_hints(settings), [*known, *(entry.name for entry in fields(settings))]
    for key, value in table.items():
        if key not in valid:
            return str(key), valid
        inner = hints.get(key)
        is_table = is_dataclass(inner) and fields(inner) and isinstance(value, Mapping)
        if is_table and (unknown := _unknown_key(inner, value)):
            return f"{key}.{unknown[0]}", unknown[1]
    return None


def check_numbers(hints: Mapping[str, Any], table: Mapping[str, Any]) -> None:
    """Check that no text and no truth value stands where a number is asked. pydantic would take "0" for 0, true for 1.

    Args:
        hints: the types of the table's values, by key.
        table: by key.

    Raises:
        ValidationError: of pydantic, which `explain` puts into words.
    """
    from pydantic import ValidationError
    from pydantic_core import InitErrorDetails, PydanticCustomError

    if wrong := [found for key in hints.keys() & table.keys() for found in _no_numbers(hints[key], table[key], (key,))]:
        errors = [
            InitErrorDetails(type=PydanticCustomError("no_number", "{said}", {"said": said}), loc=keys, input=value)
            for keys, value, said in wrong
        ]
        raise ValidationError.from_exception_data("", errors)


def _no_numbers(hint: Any, value: Any, keys: tuple[str | int, ...]) -> list[tuple[tuple[str | int, ...], Any, str]]:
    """Where text or a truth value stands in the place of a number: keys, value, and what must stand there."""
    choices = [*_choices(hint)]
    if isinstance(value, bool | str):
        if type(value) in choices or value in choices or not {int, float}.intersection(choices):
            return []
        number = f"must be a {'' if float in choices else 'whole '}number{' or text' if str in choices else ''}"
        return [(keys, value, f"{number}, not {'true or false' if isinstance(value, bool) else 'text'}")]
    found = [
        [wrong for key, inner, entry in entries for wrong in _no_numbers(inner, entry, (*keys, key))]
        for choice in choices
        if (entries := [*_entries(choice, value)])
    ]
    return found[0] if found and all(found) else []


def _choices(hint: Any) -> Iterator[Any]:
    """The types, and the single values, of which a value may be one."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin is Annotated:
        yield from _choices(inner[0])
    elif origin in (Union, UnionType):
        for each in inner:
            yield from _choices(each)
    elif origin is Literal:
        yield from inner
    else:
        yield hint


def _entries(choice: Any, value: Any) -> Iterator[tuple[str | int, Any, Any]]:
    """Key, type and value of what is in a value, if that is a list or a table as a type asks for."""
    origin, inner = get_origin(choice), get_args(choice)
    if isinstance(value, list | tuple) and origin in (tuple, list) and inner:
        hints = repeat(inner[0]) if origin is list or inner[-1] is Ellipsis else inner
        yield from ((key, hint, entry) for key, (hint, entry) in enumerate(zip(hints, value, strict=False)))
    elif isinstance(value, Mapping) and origin is dict:
        yield from ((key, inner[1], entry) for key, entry in value.items())
    elif isinstance(value, Mapping) and is_dataclass(choice):
        by_key = get_type_hints(choice)
        yield from ((key, by_key[key], entry) for key, entry in value.items() if key in by_key)


def explain(error: ValidationError, valid_keys: Callable[[Sequence[str]], Sequence[str]]) -> str:
    """All that is wrong, joined by semicolons.

    Args:
        error: what pydantic says of the table.
        valid_keys: the valid keys of the table that stands at some keys.
    """
    return "; ".join(dict.fromkeys(_explain(error, valid_keys)))


def _explain(error: ValidationError, valid_keys: Callable[[Sequence[str]], Sequence[str]]) -> Iterator[str]:
    for item in error.errors(include_url=False):
        keys = [str(part) for part in item["loc"] if not _is_member_of_union(part)]
        where, context = ".".join(keys), item.get("ctx", {})
        match item["type"]:
            case "extra_forbidden":
                valid = [*valid_keys(keys[:-1])]
                yield f"unknown key {where!r}; valid keys there: {', '.join(valid)}{near(keys[-1], valid)}"
            case "unknown_key":
                asked = near(context["key"].rpartition(".")[2], context["valid"].split(", "))
                unknown = ".".join([*keys, context["key"]])
                yield f"unknown key {unknown!r}; valid keys there: {context['valid']}{asked}"
            case "unknown_kind":
                yield f"{'.'.join([*keys, 'kind'])} = {context['name']!r} {context['said']}"
            case "missing" | "missing_argument" | "missing_keyword_only_argument":
                yield f"{where}: a value is missing"
            case "no_kind":
                yield f"{where} {item['msg']}"
            case "value_error":
                yield f"{where}: {context['error']}" if where else str(context["error"])
            case _ if item["loc"][-1:] != ("str",):  # of a union with text, the other member says what is wrong
                yield f"{where} = {_shown(item['input'])}: {_PLAIN.get(item['type']) or _in_words(item)}"


def _in_words(item: Any) -> str:
    """What is asked of a value, without the words of a library."""
    context = item.get("ctx", {})
    said = re.sub(r"^(Input|Tuple) should", "must", str(item["msg"])).replace(" after validation", "")
    choices = re.findall(r"'([^']*)'", str(context.get("expected", "")))
    return said + (near(item["input"], choices) if isinstance(item["input"], str) else "")


def _shown(value: Any) -> str:
    """A value as a file has it, or its first letters if it is long."""
    text = repr(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def _is_member_of_union(part: int | str) -> bool:
    """Whether a part of a location names the member of a union, which no file does."""
    return isinstance(part, str) and (part in ("str", "float", "int", "bool", "none") or bool(_MEMBER.match(part)))
