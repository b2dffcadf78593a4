"""Settings from a table, and what is wrong with it in a sentence: key as a file writes it, value, valid choices."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any, TypeVar, get_type_hints

if TYPE_CHECKING:
    from pydantic import ValidationError

__all__ = ["explain", "meant", "near", "read"]

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
