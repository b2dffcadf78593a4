"""Measure what docs/learners.md says of bounds and misses: studies/learners-bounds.json. Ten minutes on one core.

python docs/measure_learners.py     from kinematic runs without damage, an hour and a half each

For each babbling range and two seeds it holds what a gaze without memory reaches where a damage takes information away.
For the first seed it also holds what a finer grid of gazes would add to the ceiling, and where the misses are. Only the
misses depend on the learner: take them out of the file where it has changed.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from somatopy import run
from somatopy.analysis.runs import Run
from somatopy.analysis.sight import AGES, GAZES, sight_of
from somatopy.bodies import MujocoBody
from somatopy.clock import WINDOW
from somatopy.experiment.ceiling import GRIDS, Vantages, reachable
from somatopy.experiment.changes import changed
from somatopy.experiment.presets import PRESETS
from somatopy.experiment.reference import Alike, blurred, memoryless, unfelt
from somatopy.files import write_whole
from somatopy.percept import Floats

FILE = Path(__file__).parents[1] / "studies" / "learners-bounds.json"
RANGES, SEEDS = ("paper-wide", "mechanical", "confined"), (4000, 4001)
FINER = (193, 57)
#: Arm postures of the reference, of what babbling may have led to, that feel alike, and of the comparison of grids.
POSTURES, BABBLED, ALIKE, GRID_POSTURES = 400, 5000, 48, 2000
#: Frames after the damage of windows 4 to 6.
LATE = slice(3 * WINDOW, 6 * WINDOW)


def main() -> None:
    """Measure what is not in the file yet; it is written after each run."""
    found: dict[str, dict[str, Any]] = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    body = MujocoBody("nao", motion="kinematic")
    coarse, fine = Vantages.of(body), Vantages.of(body, FINER)
    for seed in SEEDS:
        for name in RANGES:
            of_range = found.setdefault(name, {"references": {}})
            first = seed == SEEDS[0]
            if str(seed) in of_range["references"] and ("misses" in of_range or not first):
                continue
            with TemporaryDirectory() as folder:
                one = lived(name, seed, Path(folder) / "run")
                before, after = (one.postures("arm")[one.values("phase") == k] for k in (0, 1))
                if first:
                    of_range["misses"] = misses(one)
                if first and "grids" not in of_range:
                    of_range["grids"] = grids(coarse, fine, before)
                if str(seed) not in of_range["references"]:
                    of_range["references"][str(seed)] = references(coarse, before, after[LATE])
            write_whole(FILE, json.dumps(found, indent=1) + "\n")
            print(name, seed, of_range["references"][str(seed)], file=sys.stderr)
    body.close()


def lived(name: str, seed: int, folder: Path) -> Run:
    """An hour and a half without damage."""
    learner = "best" if seed == SEEDS[0] else "random"  # of the others only the arm counts, which is the same
    changes = {"motion": "kinematic", "eye": "geometric", "learner": learner, "seed": seed}
    changes |= {"minutes": 60, "damage_minutes": 30, "damage": "none"}
    if name != "paper-wide":  # which is that of the preset, and has no name of its own
        changes["babbling.range"] = name
    whole = seed == SEEDS[0]
    return run(changed(PRESETS["paper-wide"](), changes), folder, progress=False, ceiling=whole, maps=whole)


def references(vantages: Vantages, before: Floats, after: Floats) -> Mapping[str, float]:
    """What the oracle without memory sees of what could be seen, by name of the damage."""
    arms, babbled = spread(after, POSTURES), spread(before, BABBLED)
    feels: dict[str, Alike] = {
        "dead-joint-1": unfelt([1], babbled, ALIKE),
        "dead-joint-2": unfelt([2], babbled, ALIKE),
        "noise": blurred(0.05, babbled, np.random.default_rng(2), ALIKE),
    }
    visible = float(reachable(vantages, arms).mean())
    return {damage: float(memoryless(vantages, arms, alike).mean()) / visible for damage, alike in feels.items()}


def grids(coarse: Vantages, fine: Vantages, arms: Floats) -> Mapping[str, Any]:
    """The ceiling with the grid in use and with a finer one, and how much of it is seen from fewer than five gazes."""
    some = spread(arms, GRID_POSTURES)
    gazes = np.array([int(coarse.seeing(arm).sum()) for arm in some])
    return {
        "postures": len(some),
        "grid": [*GRIDS[2]],
        "finer": [*FINER],
        "ceiling": float((gazes > 0).mean()),
        "ceiling_finer": float(reachable(fine, some).mean()),
        "slivers": float(((gazes > 0) & (gazes < 5)).sum() / (gazes > 0).sum()),
    }


def misses(one: Run) -> Mapping[str, Any]:
    """Misses of the first phase by seeing gazes and by age, in the classes of `somatopy.analysis.sight`."""
    sight = sight_of(one)
    assert sight is not None
    shares, frames = sight.by_age(0)
    return {
        "gazes": [*GAZES],
        "by_gazes": sight.by_gazes(0).tolist(),
        "grid": sight.grid,
        "frames": int(((sight.phase == 0) & (sight.gazes > 0)).sum()),
        "ages": [*AGES],
        "missed_by_age": [None if np.isnan(share) else float(share) for share in shares],
        "frames_by_age": frames.tolist(),
    }


def spread(arms: Floats, count: int) -> Floats:
    """So many of them, evenly spread."""
    return arms[np.linspace(0, len(arms) - 1, min(count, len(arms))).astype(int)]


if __name__ == "__main__":
    main()
