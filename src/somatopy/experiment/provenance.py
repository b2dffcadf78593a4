"""Records which versions, code, commit and machine wrote a run, and finds differences between such records."""

from __future__ import annotations

import ast
import hashlib
import inspect
import platform
import subprocess
import sys
import sysconfig
import traceback
from collections.abc import Iterable, Iterator
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from somatopy.registry import HANDED_OVER, Settings

__all__ = [
    *("CITE", "OWN_CODE", "author_of", "code_of", "differences", "digest", "line_of", "meaning", "versions"),
    "written_by",
]

CITE = (
    "G. Schillaci, V. V. Hafner, B. Lara: Online Learning of Visuo-Motor Coordination in a Humanoid Robot. "
    "A Biologically Inspired Model. IEEE ICDL-EpiRob, 2014.",
    "N. Rougier, Y. Boniface: Dynamic self-organising map. Neurocomputing 74(11), 1840-1847, 2011.",
)
#: Under this and its name stands the digest of a module of parts that are not somatopy's.
OWN_CODE = "code of "
_PACKAGES = ("somatopy", "numpy", "numba", "mujoco", "opencv-python-headless", "pyarrow")
_HOME = Path(__file__).parents[1]
#: What no frame depends on: these only read run folders, or show what happens.
_LOOKING_ON = frozenset({"analysis", "studies", "cli", "api.py", "__init__.py"})


def versions() -> dict[str, str]:
    """Versions of somatopy and of the packages that frames depend on."""
    return {name: _version(name) for name in _PACKAGES}


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def written_by(parts: Iterable[object]) -> dict[str, str]:
    """A table of code, commit (if there is one), Python and platform.

    Args:
        parts: the parts of the experiment and their settings. Each module among theirs that does not belong to
            somatopy gets a digest of its own. Its key is `OWN_CODE` and the name of the module.
    """
    commit = _commit()
    own = {type(part).__module__: file for part in parts if (file := _file_of(part)) is not None}
    return {
        "code": code_of(()),
        **{f"{OWN_CODE}{module}": digest(meaning(own[module])) for module in sorted(own)},
        **({"commit": commit} if commit else {}),
        "python": platform.python_version(),
        "platform": f"{sys.platform} {platform.machine()}",
    }


def author_of(parts: Iterable[object], description: BaseModel) -> dict[str, Any]:
    """Versions, code, commit, Python and platform of what runs an experiment.

    Args:
        parts: the parts of the experiment.
        description: its description. Modules that it names count as those of the parts do.
    """
    return {"versions": versions(), **written_by([*parts, *_named(description)])}


def _named(value: Any) -> Iterator[Settings]:
    """All settings in a description whose part is named and not handed over: the module that is named counts, too."""
    if isinstance(value, Settings) and not value.kind.startswith(HANDED_OVER):
        yield value
    if isinstance(value, Settings):
        inner: Iterable[Any] = vars(value).values()
    elif isinstance(value, BaseModel):
        inner = (entry for _, entry in value)
    else:
        inner = value if isinstance(value, tuple) else ()
    for entry in inner:
        yield from _named(entry)


def code_of(parts: Iterable[object]) -> str:
    """A digest of all code that the frames depend on. Docstrings and comments do not count.

    Args:
        parts: the parts of the experiment.
    """
    files = {file for part in parts if (file := _file_of(part)) is not None}
    return digest(_own_code() + "".join(map(meaning, sorted(files))))


def digest(text: str) -> str:
    """Sixteen hexadecimal digits that stand for a text."""
    return hashlib.sha256(text.encode()).hexdigest()[:16]


@cache
def _own_code() -> str:
    digest = hashlib.sha256()
    for file in sorted(_HOME.rglob("*.py")):
        if file.relative_to(_HOME).parts[0] not in _LOOKING_ON:
            digest.update(meaning(file).encode())
    return digest.hexdigest()


def meaning(file: Path) -> str:
    """The syntax tree of a file without its docstrings, as text."""
    tree = ast.parse(file.read_bytes())  # in whatever encoding it says that it has
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            first = node.body[0] if node.body else None
            if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
                node.body = node.body[1:]
    return ast.dump(tree)


def _file_of(part: object) -> Path | None:
    """The file of a part's class, where it is not somatopy's."""
    if type(part).__module__.partition(".")[0] == "somatopy":
        return None
    try:
        file = Path(inspect.getfile(type(part)))
    except (OSError, TypeError):  # a class without a file, as of an interactive session
        return None
    return file if file.suffix == ".py" and file.is_file() else None


def line_of(error: BaseException) -> str:
    """The innermost line of somebody's own code that an error came through, such as ", in line 12 of my_file.py".

    Nothing where it came through no code but that of somatopy, Python and installed packages.
    """
    known = [_HOME, *map(Path, {sysconfig.get_path(name) for name in ("stdlib", "purelib", "platlib")})]
    for step in reversed(traceback.extract_tb(error.__traceback__)):
        file = Path(step.filename)
        if file.is_file() and not any(file.is_relative_to(folder) for folder in known):
            return f", in line {step.lineno} of {file.name}"
    return ""


@cache
def _commit() -> str | None:
    """The commit of somatopy's sources, if they stand in a repository, and whether they were changed since."""
    where = ["git", "-C", str(_HOME)]
    try:
        subprocess.run([*where, "ls-files", "--error-unmatch", "__init__.py"], check=True, capture_output=True)
        said = subprocess.run(
            [*where, "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"],
            check=True,
            capture_output=True,
            text=True,
        )
    except (OSError, subprocess.CalledProcessError):
        return None
    return said.stdout.strip()


def differences(before: Any, after: Any, prefix: str = "") -> list[str]:
    """Dotted keys in which two tables of plain data differ.

    Example:
        >>> differences({"a": 1, "b": {"c": [1, 2]}}, {"a": 1, "b": {"c": [1, 3]}, "d": 4})
        ['b.c', 'd']
    """
    if isinstance(before, dict) and isinstance(after, dict):
        keys = list(dict.fromkeys([*before, *after]))
        return [key for name in keys for key in differences(before.get(name), after.get(name), f"{prefix}{name}.")]
    if _are_tables(before) and _are_tables(after):
        both = {str(k): v for k, v in enumerate(before)}, {str(k): v for k, v in enumerate(after)}
        return differences(*both, prefix)
    return [] if before == after else [prefix.removesuffix(".")]


def _are_tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(entry, dict) for entry in value)
