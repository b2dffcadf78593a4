"""In fresh processes: what an import loads, the current folder, and entry points of installed packages."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

Write = Callable[[str], str]
Stand = Callable[..., str]
CONTEXT: Any = SimpleNamespace(robot="the robot", rng="the generator")


def fresh(code: str, folder: Path, *installed: Path) -> str:
    """What a fresh interpreter prints that runs in a folder which is not on its path, with packages installed there."""
    path = os.pathsep.join([*map(str, installed), *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, "-P", "-c", code],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_no_machinery_of_descriptions_is_loaded_before_one_is_read(tmp_path: Path) -> None:
    """Whoever uses a map or a learner alone waits for neither pydantic nor tyro; the first to load one is named."""
    code = """
import importlib, sys
for module in ("registry", "contract", "maps", "links", "learners", "babbling", "interventions"):
    importlib.import_module(f"somatopy.{module}")
    if loaded := {"pydantic", "tyro"} & sys.modules.keys():
        sys.exit(f"somatopy.{module} loads {loaded}")
"""
    assert fresh(code, tmp_path) == ""


def test_a_part_is_found_as_installed_and_then_in_the_current_folder(tmp_path: Path, source: str) -> None:
    """Of two modules of one name the installed one counts; what is not installed is found where the run began."""
    here, installed = tmp_path / "here", tmp_path / "installed"
    for folder, names in ((here, ("both", "only_here")), (installed, ("both",))):
        folder.mkdir()
        for name in names:
            (folder / f"{name}.py").write_text(f"WHERE = '{folder.name}'\n{source}")
    code = """
from somatopy.registry import LEARNERS
import sys
for name in ("only_here", "both"):
    print(LEARNERS.validated(f"{name}:Mine").kind, sys.modules[name].WHERE, end=" ")
"""
    assert fresh(code, here, installed) == "only_here:Mine here both:Mine installed"


def test_a_package_in_the_current_folder_may_import_its_own(tmp_path: Path, source: str) -> None:
    """A module of a package, which imports a neighbour; and what a neighbour lacks is what is named."""
    package = tmp_path / "parts"
    package.mkdir()
    (package / "base.py").write_text(source)
    (package / "mine.py").write_text("from parts.base import Mine\n")
    (package / "broken.py").write_text("import parts.nowhere\n")
    code = """
from somatopy.registry import LEARNERS, UnknownKind
print(LEARNERS.settings("parts.mine:Mine").__name__)
try:
    LEARNERS.settings("parts.broken:Mine")
except UnknownKind as error:
    print(error)
"""
    name, error = fresh(code, tmp_path).splitlines()
    assert name == "Mine" and error.startswith("cannot be imported (No module named 'parts.nowhere')")


def test_entry_points_of_installed_packages_are_kinds(tmp_path: Path, source: str) -> None:
    """Each in the group of its sort: listed after ours, read and built by name, unknown to the other sorts."""
    info = tmp_path / "own_parts-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: own-parts\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[somatopy.learners]\ngazer = gazing:Mine\n[somatopy.bodies]\ndevice = gazing:Mine\n"
    )
    (tmp_path / "gazing.py").write_text(source)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    code = """
import somatopy.learners
from somatopy.registry import BODIES, EYES, LEARNERS
from types import SimpleNamespace
settings = LEARNERS.validated({"kind": "gazer", "rate": 3})
learner = settings.build(SimpleNamespace(robot=1, rng=2))
print(list(LEARNERS), learner.rate, LEARNERS.validated(LEARNERS.dumped(settings)) == settings, "gazer" in EYES)
print("device" in BODIES)
"""
    expected = "['hebbian', 'best', 'random', 'fixed', 'nearest', 'gazer'] 3.0 True False\nTrue"
    assert fresh(code, elsewhere, tmp_path) == expected


def test_names_are_known_before_their_modules_are_imported(tmp_path: Path) -> None:
    """To list kinds costs no import of what they build: MuJoCo and OpenCV stay away until a part is asked for."""
    code = """
import sys, somatopy.interventions
from somatopy.registry import INTERVENTIONS
INTERVENTIONS.add("far", "no_such_module:Far")
print("far" in list(INTERVENTIONS), [name for name in ("mujoco", "cv2", "sklearn") if name in sys.modules])
"""
    assert fresh(code, tmp_path) == "True []"
