"""Compilation: exact, working without a writable folder, and never with code that an edit has made stale."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from time import sleep

import numpy as np
import pytest

import somatopy._jit as under_test
from somatopy._jit import jit, jit_inlined, source_digest

PACKAGE = Path(under_test.__file__).parent

PROGRAM = """
from numba import njit
from somatopy._jit import jit

def twice(x):
    return 2 * x

try:
    njit(cache=True)(twice)
except RuntimeError:
    print("nowhere to keep compiled code")
print(jit(twice)(21))
"""

CALLEE = "from somatopy._jit import jit\n\n@jit\ndef scaled(x):\n    return {} * x\n"
CALLER = """
from numba import njit
from somatopy._jit import jit
from somatopy.callee import scaled

@jit
def kernel(x):
    return scaled(x) + 1

@njit(cache=True)
def foreign(x):
    return 10 * x
"""
USE = """
from somatopy.caller import foreign, kernel
print(kernel(5), foreign(5), sum(kernel.stats.cache_hits.values()), sum(foreign.stats.cache_hits.values()))
"""


@jit
def total(values: np.ndarray) -> float:
    result = 0.0
    for value in values:
        result += value
    return result


def command(program: str, path: Path, **environment: str) -> subprocess.Popen[str]:
    """A fresh process that runs a program, with a folder first on its path."""
    env = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    env |= {"PYTHONPATH": str(path), "PYTHONDONTWRITEBYTECODE": "1", **environment}
    return subprocess.Popen([sys.executable, "-c", program], env=env, stdout=subprocess.PIPE, text=True)


def answer(program: str, path: Path, **environment: str) -> list[int]:
    """The numbers that a program prints."""
    process = command(program, path, **environment)
    printed, _ = process.communicate()
    assert process.returncode == 0
    return [int(word) for word in printed.split()]


def run(folder: Path, environment: dict[str, str]) -> str:
    """What PROGRAM prints as a file in `folder`."""
    script = folder / "program.py"
    script.write_text(PROGRAM)
    env = {**os.environ, "PYTHONPATH": str(PACKAGE.parent), **environment}
    done = subprocess.run([sys.executable, str(script)], env=env, capture_output=True, text=True, check=True)
    return done.stdout


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A small package somatopy of two kernels, of which one calls the other, and one that numba keeps by itself."""
    package = tmp_path / "sources" / "somatopy"
    package.mkdir(parents=True)
    shutil.copy(under_test.__file__, package)
    (package / "__init__.py").touch()
    (package / "callee.py").write_text(CALLEE.format(2))
    (package / "caller.py").write_text(CALLER)
    return package


def folders(place: Path) -> list[Path]:
    """Our folders of compiled code, wherever they are."""
    return [folder for folder in place.rglob("somatopy-*") if folder.is_dir()]


def test_compiled_function_computes_what_the_source_says() -> None:
    """The decorator changes the speed of a function, not its result."""
    assert total(np.array([1.0, 2.0, 3.5])) == 6.5


@jit_inlined
def doubled(x: float) -> float:
    return 2.0 * x


def test_an_inlined_function_computes_the_same_alone_and_in_another() -> None:
    """It may be called from Python and from kernels."""

    @jit
    def sum_of_doubles(values: np.ndarray) -> float:
        result = 0.0
        for value in values:
            result += doubled(value)
        return result

    assert doubled(3.0) == 6.0
    assert sum_of_doubles(np.array([1.0, 2.0])) == 6.0


def test_works_without_any_writable_cache_folder(tmp_path: Path) -> None:
    """Where numba finds no folder to write to (even for root: files stand where folders should), code still runs."""
    (tmp_path / "__pycache__").write_text("a file, not a folder")
    nowhere = {name: f"{os.devnull}/no" for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "HOME")}
    assert run(tmp_path, nowhere) == "nowhere to keep compiled code\n42\n"


def test_works_where_the_folder_of_the_digest_cannot_be_made(package: Path) -> None:
    """A file in the place of our folder keeps nothing from running, now or in the next process."""
    answer(USE, package.parent)
    (ours,) = folders(package)
    shutil.rmtree(ours)
    ours.write_text("a file, not a folder")
    assert [answer(USE, package.parent)[0] for _ in range(2)] == [11, 11]


def test_keeps_compiled_code_where_it_can(tmp_path: Path) -> None:
    """With a writable folder, the compiled code is there for the next process."""
    kept = tmp_path / "kept"
    assert run(tmp_path, {"NUMBA_CACHE_DIR": str(kept)}) == "42\n"
    assert list(kept.rglob("*.nbc"))


@pytest.mark.parametrize("chosen", [False, True], ids=["beside the sources", "NUMBA_CACHE_DIR"])
def test_an_edit_in_a_called_file_is_seen_and_older_code_removed(package: Path, tmp_path: Path, chosen: bool) -> None:
    """The next process takes kept code where nothing was edited, and none where a file of a called kernel was.

    The folder of the older digest is gone then. What numba keeps by itself, as for other packages, is still there.
    """
    place, kept = package.parent, {"NUMBA_CACHE_DIR": str(tmp_path / "kept")} if chosen else {}
    assert answer(USE, place, **kept) == [11, 50, 0, 0]
    assert answer(USE, place, **kept) == [11, 50, 1, 1]
    (before,) = folders(tmp_path)
    (package / "callee.py").write_text(CALLEE.format(3))
    assert answer(USE, place, **kept) == [16, 50, 0, 1]
    (after,) = folders(tmp_path)
    assert after.name != before.name and list(after.glob("*.nbc"))
    assert answer(USE, place, **kept) == [16, 50, 1, 1]


def test_a_process_that_outlives_an_edit_keeps_nothing(package: Path) -> None:
    """Code that was compiled after an edit is not there once the edit is undone, whichever sources it came from."""
    edit = f"""
from pathlib import Path
import somatopy._jit
somatopy._jit.digest_at_start()
Path({str(package / "callee.py")!r}).write_text({CALLEE.format(3)!r})
{USE}"""
    assert answer(edit, package.parent)[0] == 16
    (package / "callee.py").write_text(CALLEE.format(2))
    assert answer(USE, package.parent)[0] == 11


def test_processes_that_start_at_once_keep_all_that_each_compiles(package: Path, tmp_path: Path) -> None:
    """Each compiles the kernel for another type at one moment; the next process finds all of it, and it is right."""
    types, go = ("int32", "float32", "float64", "complex128"), tmp_path / "go"
    program = f"""
import time, numpy
from pathlib import Path
from somatopy.caller import kernel
Path({str(tmp_path)!r}, "{{0}}.ready").touch()
while not Path({str(go)!r}).exists(): time.sleep(0.001)
print(int(kernel(numpy.{{0}}(5)).real))
"""
    processes = [command(program.format(kind), package.parent) for kind in types]
    while len(list(tmp_path.glob("*.ready"))) < len(types) and all(process.poll() is None for process in processes):
        sleep(0.001)
    go.touch()
    assert [process.communicate()[0] for process in processes] == ["11\n"] * len(types)
    calls = "".join(program.format(kind) for kind in types)
    hits = "print(sum(kernel.stats.cache_hits.values()))"
    assert answer(calls + hits, package.parent) == [11] * len(types) + [len(types)]


def test_unreadable_kept_code_is_compiled_anew(package: Path) -> None:
    """An empty file, as a power failure leaves it, costs a compilation and nothing else."""
    answer(USE, package.parent)
    kept = [file for folder in folders(package) for file in folder.glob("*.nbc")]
    for file in kept:
        file.write_bytes(b"")
    assert answer(USE, package.parent)[:3] == [11, 50, 0]
    assert answer(USE, package.parent)[:3] == [11, 50, 1]


def kernels(tree: ast.Module) -> Iterator[ast.FunctionDef]:
    """The compiled functions of a file."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and any(
            ast.unparse(one) in under_test.__all__ for one in node.decorator_list
        ):
            yield node


def test_whatever_kernels_take_from_other_files_is_in_the_digest(monkeypatch: pytest.MonkeyPatch) -> None:
    """An edit in any file from which a kernel's body takes a name changes the digest: nothing goes stale unseen."""
    taken = set()
    for file in PACKAGE.rglob("*.py"):
        tree = ast.parse(file.read_text(encoding="utf-8"))
        used = {
            node.id
            for kernel in kernels(tree)
            for statement in kernel.body
            for node in ast.walk(statement)
            if isinstance(node, ast.Name)
        }
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("somatopy."):
                source = PACKAGE.joinpath(*str(node.module).split(".")[1:]).with_suffix(".py")
                if used & {alias.asname or alias.name for alias in node.names}:
                    assert source.is_file(), f"{file} takes a name for its kernels from a package"
                    taken.add(source)
    before, read = source_digest(), Path.read_bytes
    assert len(taken) > 3
    for source in taken:
        edited = lambda path, source=source: read(path) + b"#" * (path == source)  # noqa: E731
        monkeypatch.setattr(Path, "read_bytes", edited)
        assert source_digest() != before, f"{source} is not in the digest"
