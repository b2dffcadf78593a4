"""The architecture, held: imports point down only, and no file is tied to one machine or package index."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "somatopy"

# Highest first. A part imports itself and the layers under its own: neither a neighbour nor anything above.
# "somatopy" is the package's own __init__, which gathers the public names.
LAYERS = (
    ("somatopy", "__main__"),
    ("cli",),
    ("studies", "viewer", "envs"),
    ("api",),
    ("analysis",),
    ("experiment",),
    ("learners", "babbling", "bodies", "eyes", "interventions"),
    ("links", "maps"),
    ("registry",),
    ("contract", "files", "validation"),
    ("percept",),
    ("_jit", "clock", "posix"),
)
DEPTH = {part: depth for depth, layer in enumerate(LAYERS) for part in layer}

TEXT = {".cff", ".html", ".json", ".md", ".py", ".sh", ".toml", ".xml"}
FOLDERS = ("src", "tests", "scripts", "examples", "docs", "benchmarks", ".ci")
# Letters in brackets, so that this file does not name what it forbids.
PACKAGE_INDEX = re.compile(
    r"py[p]i\.(org|python)|python[h]osted|ana[c]onda\.(org|com)|(extra-)?index-[u]rl|INDEX_[U]RL"
)
MACHINE_PATH = re.compile(r"(?<![\w.~)}])/(roo[t]|hom[e]|wor[k]|tm[p])(?![\w-])")


def part_of(module: str) -> str:
    """The part of somatopy that a dotted module name belongs to: maps, for somatopy.maps.dsom."""
    names = module.split(".")
    return names[1] if len(names) > 1 else names[0]


def module_name(file: Path, package: Path) -> str:
    parts = file.relative_to(package.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def absolute(node: ast.ImportFrom, file: Path, package: Path) -> str:
    """The module that a `from` import names, with leading dots resolved."""
    if not node.level:
        return node.module or ""
    folder = file.relative_to(package.parent).parts[: -node.level]
    return ".".join([*folder, *filter(None, [node.module])])


def imported(file: Path, package: Path) -> Iterator[tuple[int, str]]:
    """Line and part of every import of somatopy in a file, at whatever depth of the code it stands."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            origin = absolute(node, file, package)
            names = [
                f"{origin}.{alias.name}" if origin == "somatopy" and alias.name in DEPTH else origin
                for alias in node.names
            ]
        else:
            continue
        yield from ((node.lineno, part_of(name)) for name in names if name.split(".")[0] == "somatopy")


def violations(package: Path) -> list[str]:
    """Every import that does not point down, and every part that the table does not know."""
    found = []
    for file in sorted(package.rglob("*.py")):
        part = part_of(module_name(file, package))
        if part not in DEPTH:
            found.append(
                f"{file.relative_to(package)}: {part} stands in no layer; give it its place in {Path(__file__).name}"
            )
            continue
        for line, target in imported(file, package):
            if target != part and DEPTH.get(target, -1) <= DEPTH[part]:
                found.append(f"{file.relative_to(package)}:{line}: {part} must not import {target}")
    return found


def test_imports_point_down() -> None:
    """No module of somatopy imports a neighbour or what stands above it."""
    assert violations(PACKAGE) == []


@pytest.mark.parametrize(
    ("file", "source", "expected"),
    [
        ("maps/dsom.py", "import somatopy.learners.base", "maps must not import learners"),
        ("maps/dsom.py", "from somatopy.links import hebbian", "maps must not import links"),
        ("bodies/nao.py", "from somatopy import eyes", "bodies must not import eyes"),
        ("bodies/nao/model.py", "from ...eyes.base import Eye", "bodies must not import eyes"),
        ("eyes/__init__.py", "from ..bodies import base", "eyes must not import bodies"),
        ("learners/base.py", "from somatopy import DSOM", "learners must not import somatopy"),
        ("percept.py", "from .contract import law", "percept must not import contract"),
        ("_jit.py", "from somatopy.percept import Floats", "_jit must not import percept"),
        ("analysis/report.py", "def f():\n    from somatopy.studies import grid", "analysis must not import studies"),
        ("studies/grid.py", "from somatopy import envs", "studies must not import envs"),
        ("maps/a.py", "from somatopy import percept, DSOM", "maps must not import somatopy"),
        ("links/a.py", "if TYPE_CHECKING:\n    from somatopy.bodies import Body", "links must not import bodies"),
        (
            "interventions/a.py",
            "from somatopy.learners import HebbianLearner",
            "interventions must not import learners",
        ),
        ("interventions/a.py", "from somatopy.bodies import MujocoBody", "interventions must not import bodies"),
        ("learners/a.py", "from somatopy.interventions import Stage", "learners must not import interventions"),
        ("learners/a.py", "from somatopy.experiment import Description", "learners must not import experiment"),
        ("registry.py", "def f():\n    import somatopy.maps", "registry must not import maps"),
        ("contract/parts.py", "from somatopy.registry import Settings", "contract must not import registry"),
        ("contract/laws.py", "from somatopy.files import write_whole", "contract must not import files"),
        ("percept.py", "from somatopy.registry import Settings", "percept must not import registry"),
        ("clock.py", "from somatopy.percept import Floats", "clock must not import percept"),
        ("helpers.py", "import somatopy.maps", "helpers stands in no layer"),
    ],
)
def test_wrong_import_is_caught(tmp_path: Path, file: str, source: str, expected: str) -> None:
    """Imports up or sideways are found, absolute or relative, at the top, in a function or for types only."""
    assert [expected in found for found in violations(write(tmp_path, file, source))] == [True]


@pytest.mark.parametrize(
    ("file", "source"),
    [
        ("cli/run.py", "def main():\n    from somatopy.studies import grid\n    from ..experiment import loop"),
        (
            "maps/dsom.py",
            "import numpy\nfrom somatopy import _jit\nfrom .base import Map\nfrom ..percept import Floats",
        ),
        ("__init__.py", "from .maps import DSOM\ndef f():\n    from . import envs"),
        ("analysis/windows.py", "import somatopy.experiment.recorder"),
        ("interventions/base.py", "from somatopy import clock\nfrom somatopy.contract import Stage"),
        ("maps/__init__.py", "from somatopy.registry import MAPS\nfrom ..files import write_whole"),
        ("registry.py", "from somatopy.contract import Body\nfrom somatopy.percept import Robot"),
        ("contract/parts.py", "from somatopy.percept import Percept\nfrom .laws import law"),
    ],
)
def test_import_downwards_is_allowed(tmp_path: Path, file: str, source: str) -> None:
    """A part may import itself, everything under it, and other people's packages."""
    assert violations(write(tmp_path, file, source)) == []


def write(folder: Path, file: str, source: str) -> Path:
    package = folder / "somatopy"
    (package / file).parent.mkdir(parents=True, exist_ok=True)
    (package / file).write_text(source, encoding="utf-8")
    return package


def portable_violations(root: Path) -> list[str]:
    """Every line of our own text files that names a package index or an absolute path of a machine."""
    inside = (
        path for folder in FOLDERS for path in (root / folder).rglob("*") if path.suffix in TEXT or path.name == "run"
    )
    on_top = (path for path in root.glob("*") if path.suffix in TEXT or path.name == "Makefile")
    return [
        f"{file.relative_to(root)}:{number}: {line.strip()}"
        for file in sorted([*inside, *on_top])
        if file.is_file()
        for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), start=1)
        if PACKAGE_INDEX.search(line) or MACHINE_PATH.search(line)
    ]


def test_no_file_is_tied_to_a_machine() -> None:
    """The repository works on any machine, with any package index."""
    assert portable_violations(ROOT) == []


@pytest.mark.parametrize(
    "line", ["https://py{}pi.org/simple", "pip --index-{}url x", "'/{}root/x'", "cd /{}tmp", "/{}home/me/x"]
)
def test_what_ties_to_a_machine_is_caught(tmp_path: Path, line: str) -> None:
    """Hosts and paths are found, also in a script."""
    (tmp_path / "scripts").mkdir()
    (tmp_path / "scripts" / "get.sh").write_text(line.replace("{}", ""), encoding="utf-8")
    assert len(portable_violations(tmp_path)) == 1


def test_every_part_has_a_layer_and_every_layer_a_part() -> None:
    """The table and the source agree, but for the rooms that are kept free for parts to come."""
    there = {part_of(module_name(file, PACKAGE)) for file in PACKAGE.rglob("*.py")}
    assert there <= set(DEPTH)
    assert set(DEPTH) - there <= {"studies", "viewer", "envs", "__main__"}
