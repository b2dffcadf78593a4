"""The cells of the studies of docs/learners.md, and what they say as text. docs/make_learners.py writes the page."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from statistics import fmean
from typing import Any

from somatopy.analysis.cells import StudyResult, load_study
from somatopy.analysis.forks import against_forks
from somatopy.analysis.statistics import mean_interval
from somatopy.clock import WINDOW

STUDIES = Path(__file__).parents[1] / "studies"
BOUNDS = STUDIES / "learners-bounds.json"
#: In the order in which they run.
NAMES = (
    "learners",
    *(f"learners-{name}" for name in ("damages", "moved", "ranges", "slow", "full", "rendered", "lost", "healed")),
)
BEST, PAPERS, WIDE = "best", "hebbian", "paper-wide"
BySeed = dict[int, float]
#: Range, learner and damage of a condition.
Place = tuple[str, str, str]


class Cells:
    """A study's cells, found by range, learner and damage."""

    def __init__(self, result: StudyResult) -> None:
        self.result = result

    @cached_property
    def places(self) -> dict[Place, str]:
        """The condition at each place that has cells."""
        every = self.result.factors
        return {place(every[name]): name for name in self.result.conditions}

    @cached_property
    def rows(self) -> dict[tuple[str, int], list[dict[str, Any]]]:
        """Rows with what they say beside their forks, by condition and phase."""
        found: dict[tuple[str, int], list[dict[str, Any]]] = {}
        for row in against_forks(self.result).table.to_pylist():
            found.setdefault((row["condition"], row["phase"]), []).append(row)
        return found

    def at(self, where: Place, phase: int) -> list[dict[str, Any]]:
        """The rows of a phase, by seed; the first phase is the same whatever damage comes after it."""
        names = [
            name for found, name in self.places.items() if found == where or (phase == 0 and found[:2] == where[:2])
        ]
        there = {row["seed"]: row for name in names for row in self.rows.get((name, phase), ())}
        return [row for _, row in sorted(there.items())]

    def values(self, where: Place, phase: int, value: Callable[[Mapping[str, Any]], float | None]) -> BySeed:
        """What each row of a phase says, by seed; those that say nothing are left out."""
        said = {row["seed"]: value(row) for row in self.at(where, phase)}
        return {seed: each for seed, each in said.items() if each is not None}

    def damages(self, where: str = WIDE, learner: str = BEST) -> list[str]:
        """Damages that have cells, without "none"."""
        return [damage for one, other, damage in self.places if (one, other) == (where, learner) and damage != "none"]


def place(factors: Mapping[str, Any]) -> Place:
    """Range, learner and damage; what a study does not say is the same in all its conditions."""
    learner = factors.get("learner", factors.get("control", BEST))
    return str(factors.get("babbling.range", WIDE)), str(learner), str(factors.get("damage", "paper"))


def windows(first: int, last: int | None) -> Callable[[Mapping[str, Any]], float | None]:
    """Efficiency in the windows from `first` to before `last` of a row, percent, pooled."""

    def pooled(row: Mapping[str, Any]) -> float | None:
        hits, shares = row["hits_per_window"][first:last], (row["ceiling_per_window"] or ())[first:last]
        enough = len(hits) == len(shares) >= (last - first if last and last > first else 1)
        return 100 * sum(hits) / (WINDOW * sum(shares)) if enough and sum(shares) else None

    return pooled


def column(name: str, scale: float = 1.0) -> Callable[[Mapping[str, Any]], float | None]:
    """A column of a row, times something."""
    return lambda row: None if row[name] is None else scale * row[name]


SECOND, LAST, LATE = windows(1, 2), windows(-3, None), windows(3, 6)
FORK_SECOND = column("fork_2", 100)


def tables() -> dict[str, StudyResult]:
    """The studies that have finished cells, by name."""
    found = {name: load_study(STUDIES / name) for name in NAMES if (STUDIES / name / "study.toml").exists()}
    return {name: result for name, result in found.items() if len(result.table)}


def bounds() -> dict[str, Any]:
    """What docs/measure_learners.py measured; empty if it has not."""
    return dict(json.loads(BOUNDS.read_text(encoding="utf-8"))) if BOUNDS.exists() else {}


def cells_of(name: str) -> int:
    """How many cells a study file asks for."""
    plan = tomllib.loads((STUDIES / f"{name}.toml").read_text(encoding="utf-8"))
    conditions = math.prod(len(values) for values in plan.get("grid", {}).values())
    return int(conditions * len(plan.get("conditions", [{}])) * plan["seeds"])


def ended(result: StudyResult) -> int:
    """How many cells have ended."""
    return len(set(zip(result.table["condition"].to_pylist(), result.table["seed"].to_pylist(), strict=True)))


# -- numbers as text ---------------------------------------------------------------------------------------------------


def interval(values: BySeed, form: str = ".1f") -> str:
    """Mean and 95 % interval."""
    found = mean_interval(list(values.values()))
    if found.mean is None:
        return ""
    ends = "" if found.low is None or found.high is None else f" [{found.low:{form}}, {found.high:{form}}]"
    return f"{found.mean:{form}}{ends}"


def mean(values: BySeed, unit: str = " %") -> str:
    """A mean in prose, in bold."""
    return f"**{fmean(values.values()):.1f}{unit}**" if values else "(not run yet)"


def seeds(every: Iterable[BySeed]) -> str:
    """How many seeds some numbers have."""
    counts = sorted({len(values) for values in every if values})
    return "" if not counts else f"{counts[0]}" if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"


def of_seeds(every: Iterable[BySeed]) -> str:
    """How many seeds some numbers in prose have, in brackets."""
    count = seeds(every)
    return f" ({count} {'seed' if count == '1' else 'seeds'})" if count else ""


def rows(head: Sequence[str], body: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    return "\n".join(f"| {' | '.join(line)} |" for line in (head, ["---"] * len(head), *body))


def listed(names: Sequence[str]) -> str:
    return ", ".join(names[:-1]) + " and " + names[-1] if len(names) > 1 else "".join(names)
