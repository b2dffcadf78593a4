"""Compilation works, with and without a folder for the compiled code."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

import somatopy._jit as under_test
from somatopy._jit import jit

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


@jit
def total(values: np.ndarray) -> float:
    result = 0.0
    for value in values:
        result += value
    return result


def run(folder: Path, environment: dict[str, str]) -> str:
    """What PROGRAM prints as a file in `folder`."""
    script = folder / "program.py"
    script.write_text(PROGRAM)
    source = Path(under_test.__file__).parents[1]
    command = [sys.executable, str(script)]
    env = {**os.environ, "PYTHONPATH": str(source), **environment}
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=True)
    return done.stdout


def test_compiled_function_computes_what_the_source_says() -> None:
    """The decorator changes the speed of a function, not its result."""
    assert total(np.array([1.0, 2.0, 3.5])) == 6.5


def test_works_without_any_writable_cache_folder(tmp_path: Path) -> None:
    """Where numba finds no folder to write to (even for root: files stand where folders should), code still runs."""
    (tmp_path / "__pycache__").write_text("a file, not a folder")
    nowhere = {name: f"{os.devnull}/no" for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "HOME")}
    assert run(tmp_path, nowhere) == "nowhere to keep compiled code\n42\n"


def test_keeps_compiled_code_where_it_can(tmp_path: Path) -> None:
    """With a writable folder, the compiled code is there for the next process."""
    kept = tmp_path / "kept"
    assert run(tmp_path, {"NUMBA_CACHE_DIR": str(kept)}) == "42\n"
    assert list(kept.rglob("*.nbc"))
