"""A comparison of conditions as tables: text for a terminal, CSV, LaTeX, and the words that all of them share."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Sequence
from typing import Any

from somatopy.analysis.comparison import Compared, Comparison, Measure
from somatopy.analysis.statistics import Interval

__all__ = [
    "NONE",
    "both_text",
    "bounds_text",
    "csv_rows",
    "csv_table",
    "latex_table",
    "mean_text",
    "number",
    "p_text",
    "reached",
    "text_table",
]

#: What stands where nothing is known.
NONE = "—"
_SPECIAL = {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
_SPECIAL |= {sign: f"\\{sign}" for sign in "&%$#_{}"} | {"−": "$-$", "—": "---", "[": "{[}"}
_HEADS = {"rate": "seen (\\%)", "efficiency": "of possible (\\%)", "ceiling": "ceiling (\\%)", "slopes": "slope"}
_HEADS |= {f"{side}_distortion_end": f"{side} distortion" for side in ("arm", "head")}


def number(measure: Measure, value: float | None, sign: bool = False) -> str:
    """A number in the unit that readers are told.

    Args:
        measure: what it measures.
        value: in the table's own unit; None where it is not known.
        sign: whether + is written, too, as for differences.

    Example:
        >>> from somatopy.analysis.comparison import MEASURES
        >>> number(MEASURES[0], 0.4311), number(MEASURES[0], -0.02, sign=True), number(MEASURES[0], None)
        ('43.1', '−2.0', '—')
    """
    if value is None:
        return NONE
    form = f"{'+' * sign}{measure.form.lstrip('+')}" if sign else measure.form
    text = format(measure.scale * value, form)
    if not text.strip("+-0."):  # no sign before what is rounded to nothing
        text = text.lstrip("+-")
    return text.replace("-", "−")


def mean_text(measure: Measure, interval: Interval, sign: bool = False) -> str:
    """The mean alone."""
    return number(measure, interval.mean, sign)


def bounds_text(measure: Measure, interval: Interval, sign: bool = False) -> str:
    """The interval alone, in brackets; "" where there is none."""
    if interval.low is None:
        return ""
    return f"[{number(measure, interval.low, sign)}, {number(measure, interval.high, sign)}]"


def p_text(p: float | None) -> str:
    """A p value.

    Example:
        >>> p_text(0.0213), p_text(0.00002), p_text(1.0), p_text(None)
        ('.021', '< .001', '1', '—')
    """
    if p is None:
        return NONE
    if p < 0.001:
        return "< .001"
    return "1" if p > 0.9995 else f"{p:.3f}".lstrip("0")


def both_text(measure: Measure, interval: Interval | None, sign: bool = False) -> str:
    """Mean and interval."""
    if interval is None:
        return NONE
    return f"{mean_text(measure, interval, sign)} {bounds_text(measure, interval, sign)}".rstrip()


def reached(rows: Sequence[Compared]) -> Sequence[Compared]:
    """The segments of a phase that some seed was long enough for; the first one in any case."""
    last = max((k for k, row in enumerate(rows) if row.interval.n), default=0)
    return rows[: last + 1]


# -- text --------------------------------------------------------------------------------------------------------------


def text_table(comparison: Comparison) -> str:
    """Rate, efficiency and difference in rate as fixed-width text: conditions as headings, a line for each phase.

    Example:
        >>> from pathlib import Path
        >>> from somatopy.analysis.cells import StudyResult, to_table
        >>> from somatopy.analysis.comparison import compare
        >>> rates = {"hebbian": (0.42, 0.45, 0.44), "random": (0.10, 0.09, 0.11)}
        >>> cells = [
        ...     {"condition": name, "seed": seed, "key": "", "phase": 0, "damage": "none", "frames": 900, "rate": rate}
        ...     for name, found in rates.items()
        ...     for seed, rate in enumerate(found)
        ... ]
        >>> print(text_table(compare(StudyResult(Path("study"), to_table(cells), [], {}))))
                    seeds  hand seen, %       of possible  difference            p
        hebbian
          1 intact  3      43.7 [39.9, 47.5]  —
        random
          1 intact  3      10.0 [7.5, 12.5]   —            −33.7 [−38.8, −28.5]  .001
        <BLANKLINE>
        [ ]: 95 % interval of the mean over seeds. Differences in hand seen are paired
        by seed, and their p adjusted for their number (Holm).
        Differences are to: hebbian
    """
    if not comparison.rows:
        return "No cell has finished: there is nothing to compare."
    lines = [("", "seeds", "hand seen, %", "of possible", "difference", "p")]
    last = ""
    for condition, phase, state in comparison.phases():
        if condition != last:
            lines.append((condition, "", "", "", "", ""))
        last = condition
        lines.append((f"  {phase + 1} {state}", *_text_cells(comparison, condition, phase)))
    return f"{_laid_out(lines)}\n\n{_NOTE.format(comparison.against)}"


_NOTE = """[ ]: 95 % interval of the mean over seeds. Differences in hand seen are paired
by seed, and their p adjusted for their number (Holm).
Differences are to: {}"""


def _text_cells(comparison: Comparison, condition: str, phase: int) -> tuple[str, str, str, str, str]:
    (rate,) = comparison.of(condition, phase, "rate")
    (share,) = comparison.of(condition, phase, "efficiency")
    seen, possible = both_text(rate.measure, rate.interval), mean_text(share.measure, share.interval)
    counted = (str(rate.interval.n), seen, f"{possible} %" if possible != NONE else NONE)
    return *counted, *_difference_texts(rate, comparison.against)


def _difference_texts(row: Compared, against: str) -> tuple[str, str]:
    """Difference and adjusted p; nothing for the condition that the others are compared with."""
    if row.condition == against:
        return "", ""
    between = None if row.difference is None else row.difference.interval
    return both_text(row.measure, between, sign=True), p_text(row.p_holm)


def _laid_out(lines: Sequence[tuple[str, ...]]) -> str:
    """Columns side by side; a line of one cell is a heading, and may be as wide as it likes."""
    columns = range(len(lines[0]))
    widths = [max(len(line[k]) for line in lines if any(line[1:])) for k in columns]
    return "\n".join("  ".join(cell.ljust(w) for cell, w in zip(line, widths, strict=True)).rstrip() for line in lines)


# -- CSV ---------------------------------------------------------------------------------------------------------------


def csv_rows(comparison: Comparison) -> list[dict[str, Any]]:
    """Rows of numbers as tables.csv has them, in the units of the table of cells: shares from 0 to 1, not percent.

    Phases and segments are counted from 0, as in the table of cells. `n` counts seeds, `pairs` those that the condition
    shares with the one it is compared with; what is not known is None.
    """
    return [_csv_row(row, comparison.against) for row in comparison.rows]


def _csv_row(row: Compared, against: str) -> dict[str, Any]:
    own, difference = row.interval, row.difference
    between = difference and difference.interval
    return {
        "condition": row.condition,
        "phase": row.phase,
        "state": row.state,
        "measure": row.measure.column,
        "segment": row.segment,
        "n": own.n,
        "mean": own.mean,
        "sd": own.sd,
        "low": own.low,
        "high": own.high,
        "interval": own.method,
        "against": None if row.condition == against else against,
        "pairs": difference and len(difference.seeds),
        "difference": between and between.mean,
        "difference_low": between and between.low,
        "difference_high": between and between.high,
        "p": difference and difference.p,
        "p_holm": row.p_holm,
        "p_rank": difference and difference.p_rank,
    }


def csv_table(comparison: Comparison) -> str:
    """The rows of `csv_rows` as comma-separated values, in full precision, with a head; what is unknown is empty."""
    rows = csv_rows(comparison)
    if not rows:
        return ""
    text = io.StringIO()
    writer = csv.DictWriter(text, [*rows[0]], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


# -- LaTeX -------------------------------------------------------------------------------------------------------------


def latex_table(comparison: Comparison) -> str:
    r"""A table for a paper: one line for each condition and phase, with a difference in rate. It needs booktabs."""
    columns = list(dict.fromkeys(row.measure.column for row in comparison.rows))
    heads = ["condition", "phase", "seeds", *(_HEADS[name] for name in columns), "difference (\\%)", "$p$"]
    body = [
        " & ".join([*map(_escaped, (name, f"{phase + 1}, {state}")), *_latex_cells(comparison, name, phase, columns)])
        for name, phase, state in comparison.phases()
    ]
    lines = [
        "% Needs the package booktabs. Means over seeds [95 % intervals]. Differences in seen are paired by seed,",
        "% and their p adjusted for their number (Holm). Differences are to: " + " ".join(comparison.against.split()),
        rf"\begin{{tabular}}{{ll{'r' * (len(heads) - 2)}}}",
        r"\toprule",
        " & ".join(heads) + r" \\",
        r"\midrule",
        *(line + r" \\" for line in body),
        r"\bottomrule",
        r"\end{tabular}",
    ]
    return "\n".join(lines) + "\n"


def _latex_cells(comparison: Comparison, condition: str, phase: int, columns: Sequence[str]) -> Iterator[str]:
    (rate,) = comparison.of(condition, phase, "rate")
    yield str(rate.interval.n)
    for column in columns:
        found = [both_text(row.measure, row.interval) for row in reached(comparison.of(condition, phase, column))]
        yield _escaped("; ".join(found) or NONE)
    between, p = _difference_texts(rate, comparison.against)
    yield _escaped(between)
    yield p.replace("< ", "$<$ ").replace(NONE, "---")


def _escaped(text: str) -> str:
    """Text as LaTeX shows it; a line that begins with [ would be read as an argument of the line before."""
    return re.sub(r"[\\~^&%$#_{}−—]|^\[", lambda found: _SPECIAL[found[0]], text)
