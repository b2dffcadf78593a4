"""A comparison as the pages show it: tables of means and of differences, and tables to copy."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby
from typing import Any

from somatopy.analysis.comparison import Compared, Comparison, Measure
from somatopy.analysis.comparison_table import bounds_text, csv_table, latex_table, mean_text, p_text, reached

__all__ = ["WORDS", "differences", "means", "tables_to_copy"]

WORDS = {
    "means": "Numbers are means over seeds; in brackets stand 95 % intervals of the mean, Student's below 20 seeds and "
    "bootstrapped (BCa) from there on. One seed has no interval. A phase that is fitted in parts has a slope for "
    "each. Distortions are those of the last frame, in [0, 1] units of the joints' "
    "ranges where the learner measures in these.",
    "differences": "Differences are between runs of one seed; only shared seeds count. p is of Student's paired test; "
    "Holm's adjusts it for all differences in that measure; the rank test is Wilcoxon's. — stands where runs are "
    "equal, or fewer than two seeds are shared. The interval is not adjusted.",
    "copies": "CSV has one row for each condition, phase and measure, with all digits, as shares from 0 to 1; "
    "LaTeX is the table above, and needs the package booktabs.",
}
Group = dict[str, Any]


def means(comparison: Comparison) -> dict[str, Any]:
    """Heads, and a group of rows for each condition; measures of which nothing is known are left out."""
    measures = list(dict.fromkeys(row.measure for row in comparison.rows if row.interval.n))
    rows = [
        (name, {"phase": f"{phase + 1}, {state}", **_cells(comparison, name, phase, measures)})
        for name, phase, state in comparison.phases()
    ]
    return {"heads": [(measure.text, measure.unit) for measure in measures], "groups": _grouped(rows)}


def _cells(comparison: Comparison, condition: str, phase: int, measures: Sequence[Measure]) -> dict[str, Any]:
    rows = [reached(comparison.of(condition, phase, measure.column)) for measure in measures]
    n = max((row.interval.n for found in rows for row in found), default=0)
    return {"n": n, "cells": [[_mean(row, n) for row in found] for found in rows]}


def _mean(row: Compared, n: int) -> tuple[str, str, str]:
    """Mean, interval, and the number of seeds where it is not that of the row."""
    fewer = f"n = {row.interval.n}" if 0 < row.interval.n < n else ""
    return mean_text(row.measure, row.interval), bounds_text(row.measure, row.interval), fewer


def differences(comparison: Comparison) -> dict[str, Any]:
    """A table for each measure in which there are any."""
    tables = []
    for measure in dict.fromkeys(row.measure for row in comparison.rows):
        rows = [row for row in comparison.rows if row.measure == measure and row.condition != comparison.against]
        if any(row.difference for row in rows):
            known = [(row.condition, _difference(row, rows)) for row in rows if row.interval.n]
            tables.append({"text": measure.text.capitalize(), "unit": _points(measure), "groups": _grouped(known)})
    return {"against": comparison.against, "tables": tables}


def _points(measure: Measure) -> str:
    return "percentage points" if measure.unit == "%" else measure.unit


def _difference(row: Compared, rows: Sequence[Compared]) -> dict[str, Any]:
    parts = sum((other.condition, other.phase) == (row.condition, row.phase) for other in rows)
    part = f", part {row.segment + 1}" if row.segment is not None and parts > 1 else ""
    found: dict[str, Any] = {"phase": f"{row.phase + 1}, {row.state}{part}", "holm": p_text(row.p_holm)}
    if row.difference is None:
        return found | {"n": "", "mean": "—", "bounds": "", "p": "—", "rank": "—"}
    interval = row.difference.interval
    return found | {
        "n": interval.n,
        "mean": mean_text(row.measure, interval, sign=True),
        "bounds": bounds_text(row.measure, interval, sign=True),
        "p": p_text(row.difference.p),
        "rank": p_text(row.difference.p_rank),
    }


def _grouped(rows: Iterable[tuple[str, dict[str, Any]]]) -> list[Group]:
    return [
        {"condition": name, "rows": [row for _, row in found]} for name, found in groupby(rows, key=lambda row: row[0])
    ]


def tables_to_copy(comparison: Comparison) -> list[dict[str, str]]:
    """The comparison as CSV and as LaTeX, with the names of their files."""
    csv, tex = csv_table(comparison), latex_table(comparison)
    return [
        {"key": "csv", "name": "CSV", "file": "table.csv", "type": "text/csv", "text": csv},
        {"key": "tex", "name": "LaTeX", "file": "table.tex", "type": "application/x-tex", "text": tex},
    ]
