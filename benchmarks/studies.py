"""How a study fills the cores: equal cells by one process and by two, in turns, and how long a hundred full runs take.

Each turn runs the same cells into a new folder; imports and the start of the processes count. The second table is told
from a part of the hundred runs unless --whole asks for all: 25 seeds of four learners, full length, kinematic motion,
geometric eye, ceilings included.

Example: python benchmarks/studies.py --minutes 60 --turns 3
"""

from __future__ import annotations

import argparse
import tempfile
from statistics import median
from time import perf_counter
from typing import Any

from somatopy.studies import planned
from somatopy.studies.driver import perform
from somatopy.studies.local import cores

CELLS = 8
LEARNERS = ("hebbian", "random", "fixed", "nearest")
GOAL_MINUTES = 20


def wall(table: dict[str, Any], processes: int) -> float:
    """Wall time of a study in a new folder, s."""
    with tempfile.TemporaryDirectory() as out:
        start = perf_counter()
        result = perform(planned(table), f"{out}/study", processes=processes, progress=False)
        if result.failures:
            raise SystemExit(f"cells failed: {result.failures}")
        return perf_counter() - start


def equal_cells(minutes: float) -> dict[str, Any]:
    """Eight cells of the same length and different seeds."""
    every = {"motion": "kinematic", "minutes": minutes, "damage_minutes": minutes / 2}
    return {"name": "equal", "seeds": CELLS, "ceilings": False, "every": every}


def learners(seeds: int) -> dict[str, Any]:
    """Full runs of four learners."""
    every = {"motion": "kinematic"}
    return {"name": "learners", "seeds": seeds, "every": every, "grid": {"learner": list(LEARNERS)}}


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=60.0, help="robot time of each equal cell's first phase")
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--seeds", type=int, default=2, help="seeds of the full runs")
    parser.add_argument("--whole", action="store_true", help="all 25 seeds of the full runs")
    args = parser.parse_args()
    many = cores()
    wall(equal_cells(1.0), many)  # compiles
    ratios = []
    for turn in range(args.turns):
        one, all_of_them = (wall(equal_cells(args.minutes), count) for count in (1, many))
        ratios.append(one / all_of_them)
        print(f"turn {turn}: {CELLS} cells by 1 process {one:.1f} s, by {many} {all_of_them:.1f} s: {ratios[-1]:.2f} x")
    print(f"{many} processes have {median(ratios):.2f} times the throughput of one (median; goal: 1.8 of two)")
    seeds = 25 if args.whole else args.seeds
    took = wall(learners(seeds), many) / 60
    print(
        f"{seeds * len(LEARNERS)} full runs, ceilings included, by {many} processes: {took:.1f} min; "
        f"100 runs: {took * 25 / seeds:.1f} min (goal: under {GOAL_MINUTES})"
    )


if __name__ == "__main__":
    main()
