"""Finds the code that a cell depends on, from the cell's description alone, and makes a digest of it.

The modules are found by following the imports in their syntax trees, from the session and from the settings that the
description names. Of a package only the modules count that are used: `from somatopy.eyes import GeometricEye` leads to
the module of the geometric eye and to no other eye. So a new learner does not change the digests of cells with other
learners. Docstrings and comments do not count, and neither does the analysis, which only reads runs.
"""

from __future__ import annotations

import ast
import importlib.util
import sys
from collections.abc import Iterable, Iterator, Set
from functools import cache
from hashlib import sha256
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Any

from pydantic import BaseModel

import somatopy.bodies
from somatopy.experiment.description import Description
from somatopy.experiment.provenance import digest, meaning, versions
from somatopy.registry import Settings

__all__ = ["code_digest", "modules_of", "packages", "places"]

_ROOTS = tuple(f"somatopy.experiment.{name}" for name in ("session", "run_folder", "ceiling", "missed"))
_ABOVE = frozenset({"analysis", "api", "studies", "cli", "viewer", "envs"})
#: Modules below analysis that no cell runs: what starts a file from a preset, and what judges maps.
_OF_NO_CELL = ("somatopy.experiment.starting", "somatopy.maps.quality")
_INSTALLED = ("site-packages", "dist-packages")
_PACKAGES = ("numpy", "numba", "mujoco", "opencv-python-headless")


def code_digest(description: Description) -> str:
    """A digest of the code that runs a description, and of the versions of the packages that its frames depend on."""
    named = (value for value in vars(description.body).values() if isinstance(value, str | Path))
    return _digest(
        tuple(dict.fromkeys(places(description))), tuple(path for path in map(Path, named) if path.is_file())
    )


@cache
def _digest(modules: tuple[str, ...], robots: tuple[Path, ...]) -> str:
    """A digest for all descriptions whose settings stand in the same modules and whose robot has the same files."""
    sources = "".join(f"{name}\n{_meaning(path)}" for name, path in sorted(_modules(modules).items()))
    return digest(sources + _robots(robots) + repr([*packages().items()]))


def packages() -> dict[str, str]:
    """Versions of the packages that frames depend on."""
    there = versions()
    return {name: there[name] for name in _PACKAGES}


def modules_of(description: Description) -> dict[str, Path]:
    """The modules that a run of a description needs, without the analysis: somatopy's and those of your own parts.

    Returns:
        Files by dotted name, without packages that only collect names from their modules.
    """
    return _modules(dict.fromkeys(places(description)))


def _modules(named: Iterable[str]) -> dict[str, Path]:
    waiting = [*_ROOTS, *named]
    own = [name for name in waiting if not name.startswith("somatopy.")]
    tops, folders = {name.partition(".")[0] for name in own}, {folder for name in own if (folder := _home(name))}
    found: dict[str, Path] = {}
    while waiting:
        name = waiting.pop()
        path = _file(name) if name not in found and _is_ours(name, tops, folders) else None
        if path is not None:
            found[name] = path
            waiting += _needs(name, path)
    return {name: path for name, path in found.items() if not _only_gathers(path)}


def _robots(named: Iterable[Path]) -> str:
    """Digests of the robots that come with somatopy, and of those files that the body's settings name."""
    shipped = Path(somatopy.bodies.__file__).parent.rglob("*")
    files = [*sorted(file for file in shipped if file.suffix in (".xml", ".toml")), *named]
    return "".join(sha256(file.read_bytes()).hexdigest() for file in files)


def _is_ours(name: str, tops: Set[str], folders: Set[Path]) -> bool:
    """Whether a module is somatopy's, below analysis, or stands where a part of the description's own stands.

    Beside an own part that is installed stand all other packages: there only the part's own package counts.
    """
    first, _, behind = name.partition(".")
    if first == "somatopy":
        return behind.partition(".")[0] not in _ABOVE and not name.startswith(_OF_NO_CELL)
    home = None if first in sys.stdlib_module_names else _home(name)
    return home is not None and home in folders and (first in tops or home.name not in _INSTALLED)


def _home(name: str) -> Path | None:
    """The folder from which a module's package is imported."""
    top = name.partition(".")[0]
    path = _file(top)
    if path is None:
        return None
    return path.parent.parent if path.name == "__init__.py" else path.parent


@cache
def _file(name: str) -> Path | None:
    """The source of a module, which is not imported for that; None where there is none."""
    known = sys.modules.get(name)
    file = getattr(known, "__file__", None) if known else _origin(name)
    return Path(file) if file and file.endswith(".py") and Path(file).is_file() else None


def _origin(name: str) -> str | None:
    parent = name.rpartition(".")[0]
    package = _file(parent) if parent else None
    try:
        if not parent:
            spec = importlib.util.find_spec(name)
        elif package is not None and package.name == "__init__.py":
            spec = PathFinder.find_spec(name, [str(package.parent)])
        else:
            return None
    except (ImportError, ValueError):
        return None
    return spec.origin if spec else None


@cache
def _meaning(path: Path) -> str:
    return meaning(path)


@cache
def _tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def _only_gathers(path: Path) -> bool:
    """Whether a package defines nothing of its own."""
    defines = ast.FunctionDef | ast.ClassDef | ast.AsyncFunctionDef
    return path.name == "__init__.py" and not any(isinstance(node, defines) for node in _tree(path).body)


@cache
def _needs(name: str, path: Path) -> tuple[str, ...]:
    """The modules that a module needs by its imports; of a package that only gathers, none."""
    if _only_gathers(path):
        return ()
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    return tuple(dict.fromkeys(_resolved(*each) for each in _imports(_tree(path), package)))


def _imports(tree: ast.AST, package: str) -> Iterator[tuple[str, str]]:
    """Module and name of each import, outside of `if TYPE_CHECKING`; the name is "" for the whole module."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            continue
        if isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parts = package.split(".")
            above = parts[: len(parts) - node.level + 1] if node.level else []
            base = ".".join([*above, *filter(None, [node.module])])
            yield from ((base, alias.name) for alias in node.names)
        yield from _imports(node, package)


def _resolved(module: str, name: str) -> str:
    """The module in which an imported name is defined, as far as packages only pass it on."""
    path = _file(module)
    if not name or path is None or path.name != "__init__.py":
        return module
    if _file(f"{module}.{name}") is not None and not _passed_on(path, module, name):
        return f"{module}.{name}"
    source = _passed_on(path, module, name)
    return _resolved(*source) if source else module


def _passed_on(path: Path, package: str, name: str) -> tuple[str, str] | None:
    """Where a package has a name from."""
    for node in _tree(path).body:
        if isinstance(node, ast.ImportFrom):
            for alias in node.names:
                if (alias.asname or alias.name) == name:
                    base = node.module or ""
                    return (f"{package}.{base}".rstrip(".") if node.level else base), alias.name
    return None


def places(value: Any) -> Iterator[str]:
    """The modules of all settings in a description."""
    if isinstance(value, Settings):
        yield type(value).__module__
        inner: Iterable[Any] = vars(value).values()
    elif isinstance(value, BaseModel):
        inner = (entry for _, entry in value)
    else:
        inner = value if isinstance(value, tuple) else ()
    for entry in inner:
        yield from places(entry)
