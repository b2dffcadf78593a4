"""Settings for a part without a class of settings, derived from the signature of its class or function."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Collection, Hashable, Iterable, Sequence
from copy import deepcopy
from dataclasses import field, fields, make_dataclass
from functools import cache, reduce
from operator import or_
from types import GenericAlias, UnionType
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

from somatopy.registry.places import UnknownKind
from somatopy.registry.settings import BuildContext, Settings

__all__ = ["derived"]


@cache
def derived(
    part: Callable[..., Any],
    name: str,
    sort: str,
    made_from: tuple[str, ...] = (),
    kept: frozenset[str] = frozenset(),
) -> type[Settings]:
    """Settings whose fields are the arguments of a class or function that come after those it must take.

    Args:
        part: the class or function.
        name: what a description calls it.
        sort: what it makes, such as "learner".
        made_from: what each part of this sort is made from; its first arguments.
        kept: further arguments that are not settings.

    Raises:
        UnknownKind: the part cannot be made from these arguments.
    """
    try:
        signature = inspect.signature(part)
        taken = set(signature.bind_partial(*made_from).arguments) | kept
    except (TypeError, ValueError) as error:
        needs = ", ".join(made_from) or "nothing"
        raise UnknownKind(f"cannot be made: a {sort} is made from ({needs}), but {error}") from error
    hints = _hints(part)
    free = [
        (key, hints.get(key, tuple[Any, ...] if isinstance(parameter.default, tuple) else Any), _default(parameter))
        for key, parameter in signature.parameters.items()
        if key not in taken and parameter.kind not in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD)
    ]

    def build(self: Any, context: BuildContext) -> Any:
        given = [getattr(context, argument) for argument in made_from]
        return part(*given, **{entry.name: _own(getattr(self, entry.name)) for entry in fields(self)})

    if reserved := [key for key, *_ in free if hasattr(Settings, key)]:
        raise UnknownKind(
            f"cannot be set: an argument may not be called {reserved[0]}, which is a member of all settings; rename it"
        )
    body = {"build": build, "own_kind": name, "__doc__": inspect.getdoc(part) or f"A {sort} of your own."}
    body["__pydantic_config__"] = {**Settings.__pydantic_config__, "arbitrary_types_allowed": True}
    made = make_dataclass(
        getattr(part, "__name__", sort), free, bases=(Settings,), namespace=body, frozen=True, kw_only=True
    )
    made.__module__ = getattr(part, "__module__", __name__)
    return made


def _default(parameter: inspect.Parameter) -> Any:
    value: Any = parameter.default
    if value is parameter.empty:
        return field()
    return field(default=value) if isinstance(value, Hashable) else field(default_factory=lambda: _own(value))


def _own(value: Any) -> Any:
    """The value, or a copy if it can be changed."""
    return value if isinstance(value, Hashable) else deepcopy(value)


def _hints(part: Callable[..., Any]) -> dict[str, Any]:
    """Types of a part's arguments, as far as they can be found out."""
    try:
        made_by: Any = part.__init__ if isinstance(part, type) else part  # type: ignore[misc]
        hints = get_type_hints(made_by, include_extras=True)
    except (NameError, TypeError, AttributeError):
        return {}
    return {key: _plain(hint) for key, hint in hints.items()}


def _plain(hint: Any) -> Any:
    """The type as a setting has it.

    A sequence is kept as a tuple, which can neither be changed nor differ from another with the same values. What
    nobody can check, such as the members of a Protocol, is anything.
    """
    from pydantic import PydanticUserError, TypeAdapter

    if getattr(hint, "_is_protocol", False):
        return Any
    origin, arguments = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return Annotated[(_plain(arguments[0]), *arguments[1:])]
    if origin in (Sequence, Iterable, Collection):
        return GenericAlias(tuple, (_plain(arguments[0]), ...))
    if origin in (Union, UnionType):
        return reduce(or_, map(_plain, arguments))
    if isinstance(hint, type) and origin is None:
        return hint
    try:
        TypeAdapter(hint, config={"arbitrary_types_allowed": True})
    except PydanticUserError:
        return Any
    return hint
