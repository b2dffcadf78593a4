"""Tables of cells in which the paper's claims are true or false by as much as a test wants."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from somatopy.analysis.cells import StudyResult, to_table
from somatopy.analysis.table import PAPER_FRAMES, PAPER_HITS, PAPER_TRENDS

FIRST, SECOND, THIRD = PAPER_TRENDS
#: What the paper's one run would have; distortions, of which it gives no numbers, as Figures 4 and 5 show them.
PAPER: dict[str, Any] = {
    "rate": PAPER_HITS / PAPER_FRAMES[0],
    "slope": FIRST.slope,
    "drop": SECOND.slope,
    "rise": THIRD.slope,
    "line_end": FIRST.at(38) / 4500,
    "after": [*(SECOND.at(k) for k in range(7)), *(THIRD.at(k) for k in range(14))],
    "arm": [None, 0.4, 0.3, 0.2, 0.1, *[0.1] * 190],
    "arm_after": (0.15, 0.12),
    "head": 0.015,
    "head_peak": 0.015,
    "frames": PAPER_FRAMES,
}


def rows(seed: int, condition: str = "paper", **own: Any) -> list[dict[str, Any]]:
    """Both phases of a seed: the paper's, but for what is given."""
    it = {**PAPER, **own}
    known = [value for value in it["arm"] if value is not None]
    common = {"key": f"{condition}/{seed}", "condition": condition, "seed": seed}
    return [
        {
            **common,
            "phase": 0,
            "frames": it["frames"][0],
            "rate": it["rate"],
            "slopes": [it["slope"]],
            "line_ends": [it["line_end"]],
            "arm_distortion": it["arm"],
            "arm_distortion_start": known[0],
            "arm_distortion_end": known[-1],
            "head_distortion_end": it["head"],
        },
        {
            **common,
            "phase": 1,
            "frames": it["frames"][1],
            "slopes": [it["drop"], it["rise"]],
            "hits_per_window": [round(value) for value in it["after"]],
            "arm_distortion_peak": it["arm_after"][0],
            "arm_distortion_end": it["arm_after"][1],
            "head_distortion_peak": it["head_peak"],
        },
    ]


def study_of(seeds: int, draw: Callable[[int], Mapping[str, Any]] = lambda seed: {}) -> StudyResult:
    """A condition, "paper", of so many seeds; each is the paper's run, but for what `draw(seed)` gives."""
    found = [row for seed in range(seeds) for row in rows(seed, **draw(seed))]
    return StudyResult(Path(), to_table(found), [], {"order": ["paper"], "conditions": {"paper": {"factors": {}}}})


def noisy(seed: int) -> dict[str, Any]:
    """The paper's run under another seed: its lines with the spread that seeds have."""
    rng = np.random.default_rng(seed)
    curve = np.array([0.4, 0.3, 0.2, 0.1, *[0.1] * 190]) * (1 + 0.02 * rng.normal())
    curve[4:] *= 1 + 0.01 * rng.normal()
    return {
        "rate": PAPER["rate"] + 0.03 * rng.normal(),
        "slope": FIRST.slope + 4 * rng.normal(),
        "drop": SECOND.slope + 20 * rng.normal(),
        "rise": THIRD.slope + 0.5 * rng.normal(),
        "line_end": PAPER["line_end"] + 0.02 * rng.normal(),
        "arm": [None, *curve.tolist()],
        "arm_after": (0.15 + 0.01 * rng.normal(), 0.11 + 0.003 * rng.normal()),
        "head": 0.015 + 0.001 * rng.normal(),
        "head_peak": 0.0145 + 0.0001 * rng.normal(),
    }
