"""The kinds of each sort of part."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import MISSING, fields
from typing import Any

from somatopy.registry.derived import derived
from somatopy.registry.places import (
    HANDED_OVER,
    NAMES,
    NOT_BY_PLACE,
    UnknownKind,
    entry_points_of,
    found,
    is_importable,
    place_of,
    said,
)
from somatopy.registry.settings import Settings, table_of
from somatopy.validation import near, read

__all__ = [
    "BABBLERS",
    "BODIES",
    "EYES",
    "INTERVENTIONS",
    "LEARNERS",
    "MAPS",
    "RULES",
    "SORTS",
    "Kinds",
    "handed_over",
]


class Kinds:
    """The kinds of one sort of part, by name. `Annotated[Settings, LEARNERS]` tells pydantic which settings are valid.

    Args:
        sort: the sort of part, such as "learner".
        made_from: what each part of this sort is made from, by the names of the context's attributes. A class of your
            own takes these as its first arguments.
        default: the kind of a table that does not name one; None if every table must.
        kept: further arguments that are not settings, because the user of the part gives them.
    """

    def __init__(
        self,
        sort: str,
        made_from: tuple[str, ...] = (),
        default: str | None = None,
        kept: frozenset[str] = frozenset(),
    ) -> None:
        self.sort = sort
        self.made_from = made_from
        self.default = default
        self.kept = kept
        self._again = "interventions={PHASE: [...]}" if sort == "intervention" else f"{sort}=..."
        self._places: dict[str, str] = {}

    def add(self, name: str, place: str) -> None:
        """Name a kind; `place` is `module:Class` of its settings, or of the part itself."""
        self._places[name] = place
        NAMES[place] = name

    def remove(self, name: str) -> None:
        """Remove a kind. Tests use this."""
        NAMES.pop(self._places.pop(name), None)

    def __iter__(self) -> Iterator[str]:
        """Names of all kinds that are installed: somatopy's and those of entry points."""
        return iter(dict.fromkeys([*self._places, *entry_points_of(self.sort)]))

    def settings(self, name: str) -> type[Settings]:
        """The settings of a kind, by its name or place.

        Raises:
            UnknownKind: there is no such kind, or the object at that place is none.
        """
        place = self._places.get(name) or entry_points_of(self.sort).get(name) or name
        module, colon, attribute = place.partition(":")
        if not colon:
            raise UnknownKind(
                f"is unknown; choose one of {', '.join(self)}{near(name, self)}, or name one of your own by its place: "
                f"my_package.my_file:My{self.sort.title()}"
            )
        if module == "__main__" or NOT_BY_PLACE.search(place):
            raise UnknownKind(
                f"was handed over when the run began and cannot be imported; hand it over again: {self._again}"
            )
        if not is_importable(module, attribute):
            raise UnknownKind(f"is not the place of a part; write it as my_package.my_file:My{self.sort.title()}")
        return self.of(found(module, attribute), NAMES.get(place, place))

    def of(self, part: Any, name: str | None = None) -> type[Settings]:
        """The settings of a part: a class of settings, or a class or function that makes the part.

        Args:
            part: settings, class or function.
            name: its name in a description; its place if None.
        """
        if isinstance(part, type) and issubclass(part, Settings):
            return _whole(part)
        if not callable(part):
            raise UnknownKind(f"is no {self.sort}: it is {part!r}, which is neither a part nor makes one")
        place = place_of(part)
        return derived(part, name or NAMES.get(place, place), self.sort, self.made_from, self.kept)

    # -- pydantic: what may stand where a kind is asked for ---------------------------------------------------------

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        from pydantic_core import core_schema

        dump = core_schema.plain_serializer_function_ser_schema(self.dumped)
        return core_schema.no_info_plain_validator_function(self.validated, serialization=dump)

    def validated(self, value: Any) -> Settings:
        """Settings from a value of a description: a table with its `kind`, a name, settings, or a part."""
        from pydantic_core import PydanticCustomError

        kinds = {"kinds": ", ".join(self)}
        if isinstance(value, Settings):
            value = table_of(value) | {"kind": type(value)}
        elif isinstance(value, str | type) or callable(value):
            value = {"kind": value}
        if not isinstance(value, Mapping):
            raise PydanticCustomError("no_table", "must be a table with its kind; choose one of {kinds}", kinds)
        table = {key: entry for key, entry in value.items() if key != "kind"}
        kind = value.get("kind", self.default)
        if kind is None:
            raise PydanticCustomError("no_kind", "lacks its kind; choose one of {kinds}", kinds)
        try:
            settings = self.settings(kind) if isinstance(kind, str) else self.of(kind)
        except UnknownKind as error:
            raise PydanticCustomError(
                "unknown_kind", "kind = '{name}' {said}", {"said": str(error), "name": said(kind)}
            ) from error
        return read(settings, table, ("kind",))

    def dumped(self, settings: Settings) -> dict[str, Any]:
        """Settings as plain data, with their `kind`."""
        from pydantic import TypeAdapter

        table: dict[str, Any] = TypeAdapter(type(settings)).dump_python(settings)
        return {"kind": settings.kind, **table}


BODIES = Kinds("body", default="mujoco")
EYES = Kinds("eye", ("body",))
BABBLERS = Kinds("babbler", ("arm", "start", "rng"), default="uniform")
LEARNERS = Kinds("learner", ("robot", "rng"))
MAPS = Kinds("map", default="dsom", kept=frozenset({"bounds", "init", "epochs", "dtype", "missing", "random_state"}))
RULES = Kinds("rule", ("learning_rate",), default="positive")
INTERVENTIONS = Kinds("intervention")
#: All sorts of parts, by name.
SORTS = {kinds.sort: kinds for kinds in (BODIES, EYES, BABBLERS, LEARNERS, MAPS, RULES, INTERVENTIONS)}


def _whole(settings: type[Settings]) -> type[Settings]:
    """Settings whose annotated names are their fields."""
    own = [key for key in vars(settings).get("__annotations__", {}) if not key.startswith("_")]
    if own and "__dataclass_fields__" not in vars(settings):
        raise UnknownKind(
            f"has settings that nobody can set ({', '.join(own)}): put @dataclass(frozen=True) over "
            f"{settings.__qualname__}"
        )
    return settings


def handed_over(kinds: Kinds, part: Any) -> Settings:
    """Settings that stand for a part given in Python: a class, a function that makes the part, or the part itself."""
    if isinstance(part, type) or not hasattr(part, _CONTRACT_OF[kinds.sort]):
        return part if isinstance(part, Settings) else _all_defaults(kinds.of(part))
    kind = type(part)
    return derived(lambda: part, f"{HANDED_OVER}{kind.__module__}.{kind.__qualname__}", kinds.sort)()


def _all_defaults(settings: type[Settings]) -> Settings:
    if needed := [entry.name for entry in fields(settings) if entry.default is entry.default_factory is MISSING]:
        raise UnknownKind(
            f"needs a value for {', '.join(needed)}; hand over functools.partial({settings.__name__}, {needed[0]}=...)"
        )
    return settings()


#: A member by which an instance of each sort of part is told from a function that makes one.
_CONTRACT_OF = {"body": "step", "eye": "look", "babbler": "command", "learner": "observe", "intervention": "sense"}
