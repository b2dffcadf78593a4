"""`python -m somatopy` is the command line."""

from __future__ import annotations

import subprocess
import sys

from somatopy.cli import USAGE


def test_the_package_runs_as_a_program() -> None:
    """With the same words and the same exit codes."""
    for args, code, said in (["--help"], 0, USAGE), (["nonsense"], 2, ""):
        done = subprocess.run([sys.executable, "-m", "somatopy", *args], capture_output=True, text=True, check=False)
        assert (done.returncode, done.stdout) == (code, said)
