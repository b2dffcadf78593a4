"""Rows of the table of cells with efficiencies that are put in: learners a and b, with and without a damage."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from somatopy.analysis.cells import StudyResult, to_table


def row(condition: str, shares: list[float], phase: int = 1, seed: int = 0, ceiling: float = 0.5) -> dict[str, Any]:
    """A row whose efficiency in each minute is given, under a ceiling that is the same in each."""
    hits = [round(900 * ceiling * share) for share in shares]
    windows = [sum(hits[k : k + 5]) for k in range(0, len(hits) - 4, 5)]
    return {
        **{"condition": condition, "key": condition, "seed": seed, "phase": phase, "frames": 900 * len(shares)},
        **{"hits_per_minute": hits, "ceiling_per_minute": [ceiling] * len(hits)},
        **{"hits_per_window": windows, "ceiling_per_window": [ceiling] * len(windows)},
        "efficiency": sum(hits) / (900 * ceiling * len(hits)),
    }


def study(rows: list[dict[str, Any]], factors: dict[str, dict[str, Any]]) -> StudyResult:
    conditions = {name: {"factors": each} for name, each in factors.items()}
    return StudyResult(Path("study"), to_table(rows), [], {"conditions": conditions, "order": [*factors]})


FACTORS = {
    f"{learner}, {damage}": {"learner": learner, "damage": damage}
    for learner in ("a", "b")
    for damage in ("none", "gain")
}
