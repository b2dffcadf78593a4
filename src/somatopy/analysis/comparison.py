"""Conditions of a study beside each other: means over seeds with intervals, and paired differences.

The seed is the unit: one number of each run. Differences are between runs of one seed, which meet the same movement of
the arm. Here are numbers alone; `comparison_table` makes words of them, the report pictures.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from somatopy.analysis.cells import StudyResult
from somatopy.analysis.phases import kind_name
from somatopy.analysis.runs import RunFolderError
from somatopy.analysis.series import border_name
from somatopy.analysis.statistics import Difference, Interval, holm, mean_interval, paired
from somatopy.clock import WINDOW
from somatopy.percept import Floats

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["MEASURES", "MIN_BAND", "Compared", "Comparison", "Course", "Measure", "compare", "courses"]

#: Seeds from which on a band shows the interval of the mean. Of fewer, Student's interval is wider than all they say.
MIN_BAND = 5

Values = dict[int, float]
Items = tuple[tuple[int, float], ...]
Cells = dict[tuple[str, int], list[dict[str, Any]]]


class Measure(NamedTuple):
    """What is compared.

    Attributes:
        column: of the table of cells; where its entries are lists, each place is compared for itself.
        text: what readers are told that it is.
        unit: the unit that readers are told.
        scale: by what to multiply for that unit.
        form: format of a number.
    """

    column: str
    text: str
    unit: str
    scale: float
    form: str


#: In the order of tables.
MEASURES = (
    Measure("rate", "hand seen", "%", 100.0, ".1f"),
    Measure("efficiency", "of what was possible", "%", 100.0, ".1f"),
    Measure("ceiling", "ceiling", "%", 100.0, ".1f"),
    Measure("slopes", "slope", "hits per window, per window", 1.0, "+.2f"),
    Measure("arm_distortion_end", "arm distortion", "at the end", 1.0, ".4f"),
    Measure("head_distortion_end", "head distortion", "at the end", 1.0, ".4f"),
)


@dataclass(frozen=True)
class Compared:
    """A measure of a condition in a phase, over seeds. All numbers are in the table's own unit, not yet scaled.

    Attributes:
        condition: name of the condition.
        phase: index of the phase.
        state: "intact", or its damage.
        measure: what is measured.
        segment: which trend segment of the phase, from 0; None for measures that are no lists.
        values: by seed; seeds for which it is not known are left out.
        interval: their mean, with its 95 % interval.
        difference: to the condition that all are compared with, over shared seeds; None for that condition itself, and
            where fewer than two seeds are shared.
        p_holm: p of the difference, adjusted for all differences in this measure, of all conditions, phases, segments.
    """

    condition: str
    phase: int
    state: str
    measure: Measure
    segment: int | None
    values: Mapping[int, float]
    interval: Interval
    difference: Difference | None = None
    p_holm: float | None = None


@dataclass(frozen=True)
class Comparison:
    """All that is compared.

    Attributes:
        against: the condition that the others are compared with; "" where no cell has finished.
        rows: by condition, in the order of the study, then by phase, measure and segment.
    """

    against: str
    rows: tuple[Compared, ...]

    def of(self, condition: str, phase: int, column: str) -> list[Compared]:
        """The rows of a condition in a phase for one measure: several where its entries are lists, or none."""
        wanted = (condition, phase, column)
        return [row for row in self.rows if (row.condition, row.phase, row.measure.column) == wanted]

    def phases(self) -> list[tuple[str, int, str]]:
        """Condition, index and state of every phase, in order."""
        return list(dict.fromkeys((row.condition, row.phase, row.state) for row in self.rows))


def compare(result: StudyResult, against: str | None = None, measures: Sequence[Measure] = MEASURES) -> Comparison:
    """Compare the conditions of a study, phase by phase.

    Phases in which no run has frames are left out.

    Args:
        result: an open study folder.
        against: the condition that all others are compared with; the first one if None.
        measures: what is compared.

    Raises:
        RunFolderError: no finished cell belongs to a condition of this name.

    Example:
        >>> from pathlib import Path
        >>> from somatopy.analysis.cells import to_table
        >>> rates = {"hebbian": (0.42, 0.45, 0.44), "random": (0.10, 0.09, 0.11)}
        >>> cells = [
        ...     {"condition": name, "seed": seed, "key": "", "phase": 0, "damage": "none", "frames": 900, "rate": rate}
        ...     for name, found in rates.items()
        ...     for seed, rate in enumerate(found)
        ... ]
        >>> comparison = compare(StudyResult(Path("study"), to_table(cells), [], {}), measures=MEASURES[:1])
        >>> [(row.condition, round(row.interval.mean, 3)) for row in comparison.rows]
        [('hebbian', 0.437), ('random', 0.1)]
        >>> round(comparison.rows[1].difference.interval.mean, 3), comparison.rows[1].difference.p < 0.01
        (-0.337, True)
    """
    names = result.conditions
    if against is not None and against not in names:
        known = ", ".join(map(repr, names)) or "none has finished cells"
        raise RunFolderError(f"The study has no condition {against!r} to compare with; there are: {known}.")
    first = against or next(iter(names), "")
    cells = _cells(result.table, [measure.column for measure in measures])
    rows = [
        _compared(name, phase, measure, place, cells, first)
        for name in names
        for phase in sorted(phase for condition, phase in cells if condition == name)
        for measure in measures
        for place in _places(cells[name, phase], measure.column)
    ]
    return Comparison(first, tuple(_adjusted(rows)))


def _cells(table: pa.Table, columns: Sequence[str]) -> Cells:
    """Rows by condition and phase, seeds in order; phases without frames are left out."""
    found: Cells = {}
    for row in table.select(["condition", "phase", "seed", "damage", "frames", *columns]).to_pylist():
        found.setdefault((row["condition"], row["phase"]), []).append(row)
    played = {key: rows for key, rows in found.items() if any(row["frames"] for row in rows)}
    return {key: sorted(rows, key=lambda row: int(row["seed"])) for key, rows in played.items()}


def _compared(name: str, phase: int, measure: Measure, place: int | None, cells: Cells, against: str) -> Compared:
    rows = cells[name, phase]
    values = _values(rows, measure.column, place)
    theirs = _values(cells.get((against, phase), []), measure.column, place)
    shared = name != against and len(values.keys() & theirs.keys()) > 1
    difference = _difference((*values.items(),), (*theirs.items(),)) if shared else None
    interval = _interval((*values.values(),))
    return Compared(name, phase, _state(rows), measure, place, values, interval, difference)


# Conditions often have phases and ceilings in common, and a bootstrap takes a twentieth of a second.
@lru_cache(maxsize=4096)
def _interval(values: tuple[float, ...]) -> Interval:
    return mean_interval(values, iqm=False)


@lru_cache(maxsize=4096)
def _difference(values: Items, theirs: Items) -> Difference:
    return paired(dict(values), dict(theirs), iqm=False)


def _values(rows: Sequence[Mapping[str, Any]], column: str, place: int | None) -> Values:
    found = {}
    for row in rows:
        value = row[column]
        if place is not None:
            value = value[place] if value is not None and place < len(value) else None
        if value is not None:
            found[int(row["seed"])] = float(value)
    return found


def _places(rows: Sequence[Mapping[str, Any]], column: str) -> Sequence[int | None]:
    """Which entries of a measure are compared: None for one that is no list."""
    lengths = [len(row[column]) for row in rows if isinstance(row[column], list)]
    return range(max(lengths)) if lengths else [None]


def _state(rows: Sequence[Mapping[str, Any]]) -> str:
    damage = str(rows[0]["damage"] or "none")
    return "intact" if damage == "none" else "+".join(kind_name(kind) for kind in damage.split("+"))


def _adjusted(rows: Sequence[Compared]) -> list[Compared]:
    """Rows with p values adjusted, measure by measure."""
    found = list(rows)
    for measure in dict.fromkeys(row.measure for row in rows):
        tests = {str(k): row.difference.p for k, row in enumerate(rows) if row.measure == measure and row.difference}
        for k, p in holm(tests).items():
            found[int(k)] = replace(found[int(k)], p_holm=p)
    return found


# -- over time ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Course:
    """Hits per full window of a condition over time; NaN between phases, where a line is to be broken.

    Attributes:
        condition: name of the condition.
        at: where each window starts, in windows from the start of the run, shape (n,).
        seeds: hits by seed, each of shape (n,); NaN in windows that a run does not have.
        mean: mean over the seeds that have the window, shape (n,).
        low: lower end of the band, shape (n,).
        high: upper end of the band, shape (n,).
        borders: where a phase begins that follows another, in windows, and what happens there.
        end: where the last phase ends, in windows.
    """

    condition: str
    at: Floats
    seeds: Mapping[int, Floats]
    mean: Floats
    low: Floats
    high: Floats
    borders: tuple[tuple[float, str], ...]
    end: float


def courses(result: StudyResult) -> tuple[list[Course], Literal["interval", "range"]]:
    """Hits over time of all conditions, with bands over seeds.

    Returns:
        One course a condition, in the order of the study; and what the bands are: the 95 % interval of the mean, by
        Student's t for each window by itself, where each condition has `MIN_BAND` seeds or more, or else the range from
        the lowest to the highest seed.
    """
    cells = _cells(result.table, ["hits_per_window"])
    there = [name for name in result.conditions if any(name == condition for condition, _ in cells)]
    lines = {name: _lines(name, cells) for name in there}
    few = any(len(seeds) < MIN_BAND for _, seeds in lines.values())
    band: Literal["interval", "range"] = "range" if few else "interval"
    return [_course(name, *lines[name], band, cells) for name in there], band


def _phases(name: str, cells: Cells) -> list[list[dict[str, Any]]]:
    return [cells[key] for key in sorted(key for key in cells if key[0] == name)]


def _starts(phases: Sequence[Sequence[Mapping[str, Any]]]) -> list[float]:
    """Where each phase starts, and where the last one ends, in windows."""
    lengths = [max(row["frames"] for row in rows) / WINDOW for rows in phases]
    return [sum(lengths[:k]) for k in range(len(lengths) + 1)]


def _lines(name: str, cells: Cells) -> tuple[Floats, dict[int, Floats]]:
    """Where windows start, and the hits there by seed; phase after phase, with a gap between."""
    phases = _phases(name, cells)
    seeds = sorted({int(row["seed"]) for rows in phases for row in rows})
    at: list[Floats] = []
    hits: dict[int, list[Floats]] = {seed: [] for seed in seeds}
    for start, rows in zip(_starts(phases), phases, strict=False):
        counts = {int(row["seed"]): np.asarray(row["hits_per_window"] or (), dtype=np.float64) for row in rows}
        n = max(map(len, counts.values()))
        at.append(np.append(start + np.arange(n), np.nan))
        for seed in seeds:
            found = counts.get(seed, np.empty(0))
            hits[seed].append(np.append(found, np.full(n + 1 - len(found), np.nan)))
    return np.concatenate(at)[:-1], {seed: np.concatenate(found)[:-1] for seed, found in hits.items()}


def _course(name: str, at: Floats, seeds: Mapping[int, Floats], band: str, cells: Cells) -> Course:
    phases = _phases(name, cells)
    starts = _starts(phases)
    damages = [_state(rows).replace("intact", "none") for rows in phases]
    borders = [(starts[k], border_name(damages[k - 1], damages[k])) for k in range(1, len(phases))]
    return Course(name, at, seeds, *_band(np.array([*seeds.values()]), band), tuple(borders), starts[-1])


def _band(counts: Floats, band: str) -> tuple[Floats, Floats, Floats]:
    """Mean, lower and upper end over seeds, shape (seeds, windows) to (windows,) each; NaN where it is not defined."""
    from scipy.special import stdtrit

    known = np.ma.masked_invalid(counts)
    mean = known.mean(axis=0)
    if band == "range":
        return _filled(mean), _filled(known.min(axis=0)), _filled(known.max(axis=0))
    n = np.ma.masked_less(known.count(axis=0), 2)
    half = known.std(axis=0, ddof=1) * stdtrit(n - 1, 0.975) / np.ma.sqrt(n)
    return _filled(mean), _filled(mean - half), _filled(mean + half)


def _filled(values: Any) -> Floats:
    filled: Floats = np.ma.filled(np.ma.asarray(values, dtype=np.float64), np.nan)
    return filled
