"""Write three_runs.npz anew: the values that tests/experiment/test_values_kept.py holds three short runs to.

    python tests/data/make_three_runs.py

Legitimate only where values are meant to change: a commit that changes physics, drawing, a kernel's rounding or the
order of random numbers on purpose, and says so in its message and in CHANGELOG.md; or a new version of MuJoCo, NumPy,
Numba or OpenCV, by itself. Never in a commit that moves or renames code: there a value that differs is a fault of the
change. The runs and what is kept of them are defined in the test.
"""

from __future__ import annotations

import runpy
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

HERE = Path(__file__).parent


def main() -> None:
    """Run all three and overwrite the file."""
    test = runpy.run_path(str(HERE.parent / "experiment" / "test_values_kept.py"))
    with TemporaryDirectory() as folder:
        kept = {
            f"{make.__name__}.{name}": array
            for make in (test["kinematic"], test["rendered"], test["forked"])
            for name, array in test["values_of"](make(Path(folder))).items()
        }
    np.savez_compressed(test["DATA"], allow_pickle=False, made_with=np.array(test["made_with"]()), **kept)


if __name__ == "__main__":
    main()
