"""Damaged runs beside their undamaged forks: the same learner and seed with the same arm movement, but no damage.

A fork is a row of the same seed and phase in the condition that differs in nothing but damage = "none". So its share
tells what the damage costs and nothing else: lucky and unlucky arm postures are the same in both.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from somatopy.analysis.cells import CellColumn, StudyResult
from somatopy.analysis.relearning import BACK, STAYING, Curve, lasting
from somatopy.clock import FRAMES_PER_MINUTE, WINDOW

__all__ = ["AGAINST_FORK", "against_forks", "forks"]

#: What a row says of itself beside its fork; null without a fork, and in phases before the damage.
AGAINST_FORK = (
    CellColumn("fork_1", "float", "efficiency in the first window of the phase, share of the fork's"),
    CellColumn("fork_2", "float", "the same in the second window"),
    CellColumn("fork_3", "float", "the same in the third window"),
    CellColumn("fork_4_to_6", "float", "the same in windows 4 to 6, pooled; below 0.9 a learner is lost"),
    CellColumn(
        "fork_minutes_back", "float", "minutes until five running minutes have 95 % of the fork's; null if never"
    ),
    CellColumn("fork_deficit_minutes", "float", "minutes of full sight lost in the phase against the fork"),
)
_WINDOWS = {"fork_1": (0, 1), "fork_2": (1, 2), "fork_3": (2, 3), "fork_4_to_6": (3, 6)}
Row = Mapping[str, Any]


def forks(result: StudyResult) -> dict[str, str]:
    """The undamaged condition that belongs to each damaged one: all its factors are the same but `damage`."""
    by_factors = {_but_damage(factors): name for name, factors in result.factors.items() if _damage(factors) == "none"}
    found = {name: by_factors.get(_but_damage(factors)) for name, factors in result.factors.items()}
    return {name: fork for name, fork in found.items() if fork is not None and fork != name}


def against_forks(result: StudyResult) -> StudyResult:
    """A study whose table has the columns `AGAINST_FORK`, too."""
    import pyarrow as pa

    rows, of = result.table.to_pylist(), forks(result)
    places = {(row["condition"], row["seed"], row["phase"]): row for row in rows}
    said = [beside(row, places.get((of.get(row["condition"], ""), row["seed"], row["phase"]))) for row in rows]
    table = result.table
    for column in AGAINST_FORK:
        table = table.append_column(column.name, pa.array([each[column.name] for each in said], pa.float64()))
    return replace(result, table=table)


def beside(row: Row, fork: Row | None) -> dict[str, float | None]:
    """The measures `AGAINST_FORK` of a row of the table of cells beside that of its fork."""
    if fork is None or row["phase"] == 0:
        return dict.fromkeys(column.name for column in AGAINST_FORK)
    own, other = _curve(row, "window", WINDOW), _curve(fork, "window", WINDOW)
    shares = {
        name: _by(own.level(a, b), other.level(a, b)) if len(own.hits) >= b <= len(other.hits) else None
        for name, (a, b) in _WINDOWS.items()
    }
    return {**shares, "fork_minutes_back": _minutes_back(row, fork), "fork_deficit_minutes": _deficit(row, fork)}


def _minutes_back(row: Row, fork: Row) -> float | None:
    """Minutes until five minutes have 95 % of the fork's in the same five, and all later ones, too."""
    own, other = (_curve(each, "minute", FRAMES_PER_MINUTE).running(STAYING) for each in (row, fork))
    n = min(len(own), len(other))
    return lasting(np.asarray(~(own[:n] < BACK * other[:n])), 1.0) if n else None


def _deficit(row: Row, fork: Row) -> float | None:
    if row["efficiency"] is None or fork["efficiency"] is None:
        return None
    return float((fork["efficiency"] - row["efficiency"]) * row["frames"] / FRAMES_PER_MINUTE)


def _curve(row: Row, step: str, frames: int) -> Curve:
    hits, shares = row[f"hits_per_{step}"] or (), row[f"ceiling_per_{step}"] or ()
    return Curve.of(hits, shares, frames, frames / FRAMES_PER_MINUTE)


def _by(own: float | None, other: float | None) -> float | None:
    return own / other if own is not None and other else None


def _damage(factors: Row) -> Any:
    return factors.get("damage")


def _but_damage(factors: Row) -> str:
    return repr(sorted((key, repr(value)) for key, value in factors.items() if key != "damage"))
