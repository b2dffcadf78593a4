"""What is given to others: the wheel holds the whole package and works anywhere; the archive holds all the rest."""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "somatopy"
#: Run outside of this folder, with the wheel alone on the path beside other people's packages.
TRIED = """
import somatopy
from importlib.metadata import version
from importlib.resources import files
from somatopy import HebbianLinks, SOM
print(somatopy.__file__, version("somatopy"), files("somatopy").joinpath("bodies/nao/nao.xml").is_file())
"""


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with wheel and source archive, as `make wheel` makes them."""
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "hatchling", "build", "--directory", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    return folder


def own_files(folder: Path) -> set[str]:
    return {
        file.relative_to(folder.parent).as_posix()
        for file in folder.rglob("*")
        if file.is_file() and "__pycache__" not in file.parts
    }


def test_the_wheel_holds_the_whole_package_and_nothing_else(built: Path) -> None:
    """Models, anatomies and templates too; no test, no example, no document."""
    (wheel,) = built.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        inside = {name for name in archive.namelist() if ".dist-info/" not in name}
        licences = [name for name in archive.namelist() if name.endswith("/LICENSE")]
    assert inside == own_files(PACKAGE) and len(licences) == 1


def test_it_works_where_the_repository_is_not(built: Path, tmp_path: Path) -> None:
    """Installed into an empty folder: imported from there, with its version and its models."""
    (wheel,) = built.glob("*.whl")
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--target", "there"]
    subprocess.run([*install, str(wheel)], cwd=tmp_path, check=True)
    env = {**os.environ, "PYTHONPATH": str(tmp_path / "there")}
    done = subprocess.run([sys.executable, "-c", TRIED], cwd=tmp_path, env=env, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    file, version, model = done.stdout.split()
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert file.startswith(str(tmp_path / "there")) and version == project["version"] and model == "True"


def test_the_archive_holds_what_tests_and_documents_need(built: Path) -> None:
    """From it the same can be built, tested and read."""
    (archive,) = built.glob("*.tar.gz")
    with tarfile.open(archive) as opened:
        inside = {name.partition("/")[2] for name in opened.getnames()}
    assert {f"src/{name}" for name in own_files(PACKAGE)} <= inside
    assert {"README.md", "LICENSE", "CITATION.cff", "Makefile", "mkdocs.yml", "scripts/setup.sh"} <= inside
    assert "tests/test_wheel.py" in inside and not any(
        name.startswith(("runs/", ".venv/", "build/")) for name in inside
    )
