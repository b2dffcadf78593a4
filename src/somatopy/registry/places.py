"""Finds parts by their place, `module:Name`, by the name of a kind, or by an entry point."""

from __future__ import annotations

import importlib
import re
import sys
from collections.abc import Callable
from contextlib import redirect_stdout
from functools import cache
from importlib.metadata import entry_points
from operator import attrgetter
from pathlib import Path
from typing import Any

__all__ = [
    "HANDED_OVER",
    "NAMES",
    "NOT_BY_PLACE",
    "UnknownKind",
    "entry_points_of",
    "found",
    "is_importable",
    "place_of",
    "said",
]

#: Leads the kind of a part that was handed over and cannot be imported.
HANDED_OVER = "handed over:"
#: What the names of parts have in them that no import can reach: local functions and classes, and instances.
NOT_BY_PLACE = re.compile(rf"<\w+>|^{HANDED_OVER}")
#: The names of kinds by the places of their settings or parts.
NAMES: dict[str, str] = {}


class UnknownKind(ValueError):
    """A kind that cannot be found. The message lists the known ones, and says how to name one of your own."""


def _group_of(sort: str) -> str:
    """The group of entry points for a sort of parts."""
    return "somatopy.bodies" if sort == "body" else f"somatopy.{sort}s"


@cache
def entry_points_of(sort: str) -> dict[str, str]:
    """Kinds that installed packages offer, as places by name."""
    return {entry.name: entry.value for entry in entry_points(group=_group_of(sort))}


def is_importable(module: str, attribute: str) -> bool:
    return all(name.isidentifier() for name in [*module.split("."), *attribute.split(".")])


def said(kind: Any) -> str:
    """What to call a kind in an error."""
    return kind if isinstance(kind, str) else str(getattr(kind, "__qualname__", kind))


def place_of(part: Callable[..., Any]) -> str:
    """`module:Name` of a class or function; a text that is no place if it cannot be imported, as for a partial one."""
    named = part if hasattr(part, "__qualname__") else type(part)
    module, names = getattr(named, "__module__", None) or "", str(named.__qualname__)
    if module == "__main__" or NOT_BY_PLACE.search(names):
        return f"{module}:{names}"
    try:
        stands_there = attrgetter(names)(sys.modules.get(module)) is part
    except AttributeError:
        stands_there = False
    return f"{module}:{names}" if stands_there else f"{HANDED_OVER}{module}.{names}"


def found(module: str, attribute: str) -> Any:
    """The object at a place, in an installed module or else in one of the current folder."""
    here = str(Path.cwd())
    try:
        with redirect_stdout(sys.stderr):  # what a module says when it is imported is no command's result
            found = _imported(module, here)
    except ModuleNotFoundError as error:
        raise UnknownKind(f"cannot be imported ({error}). {_sought(module, error.name or '', here)}") from error
    except (Exception, SystemExit) as error:  # a script without `if __name__ == "__main__"` may exit
        raise UnknownKind(f"cannot be imported: {module} fails with {type(error).__name__}: {error}") from error
    thing: Any = found
    for name in attribute.split("."):
        if not hasattr(thing, name):
            inside = getattr(thing, "__dict__", {})
            there = [key for key, value in inside.items() if getattr(value, "__module__", None) == module]
            raise UnknownKind(f"does not exist: {module} has no {name}; it has {', '.join(there) or 'nothing'}")
        thing = getattr(thing, name)
    return thing


def _imported(module: str, here: str) -> Any:
    """A module that is installed, or else in the current folder `here`."""
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name is None or not f"{module}.".startswith(f"{error.name}.") or here in sys.path:
            raise
    sys.path.append(here)
    importlib.invalidate_caches()
    return importlib.import_module(module)


def _sought(module: str, missing: str, here: str) -> str:
    """Where a module was looked for, and how to put it there.

    Args:
        module: the module of a part.
        missing: what was not found: that module, a package around it, or something that it imports.
        here: the current folder.
    """
    package, _, name = missing.rpartition(".")
    if not missing or not f"{module}.".startswith(f"{missing}."):
        return f"{module} was found, but it imports something that was not: install that, or add it to PYTHONPATH"
    if package:
        return f"{package} was found, {_file_of(package)}, and has no module {name}"
    return (
        "It was looked for among the installed packages, in the folders of PYTHONPATH, and in the current folder "
        f"{here}. Change to the folder that holds {name}.py or the package {name}, or name that folder: "
        "PYTHONPATH=path/to/folder somatopy ..."
    )


def _file_of(package: str) -> str:
    """The folder of a package, or the file of a module that is none."""
    thing = sys.modules[package]
    return str(next(iter(getattr(thing, "__path__", [thing.__file__]))))
