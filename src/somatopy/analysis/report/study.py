"""The page of a study: its conditions over seeds. The template beside this file says how it looks."""

from __future__ import annotations

import base64
import json
import os
from collections.abc import Iterator, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

from somatopy.analysis.cells import StudyResult
from somatopy.analysis.comparison import Comparison, Course, compare, courses
from somatopy.analysis.comparison_table import csv_table, latex_table
from somatopy.analysis.described import leaves
from somatopy.analysis.figures.relearning import relearning_figure
from somatopy.analysis.phases import kind_name
from somatopy.analysis.relearning_table import relearning
from somatopy.analysis.report.rendering import embeddable, rendered
from somatopy.analysis.report.study_charts import PANELS, SHOWN, course_charts, courses_chart, rates_charts
from somatopy.analysis.report.study_tables import WORDS, differences, means, tables_to_copy
from somatopy.analysis.runs import writing
from somatopy.analysis.style import style
from somatopy.files import write_whole

__all__ = ["render_study", "write_study"]

BANDS = {
    "interval": "Bands are 95 % intervals of the mean (Student's t, each window by itself).",
    "range": "Bands reach from the lowest to the highest seed, because a condition has fewer than five seeds.",
}
HITS = (
    "Hits are frames in which the marker on the hand was detected. Lines are means over seeds, dots are single seeds. "
    "{} A window is drawn where it starts; it has 4,500 frames."
)
SMALL = " Across: robot time in windows of 5 minutes; up: hits per window. Dotted: the mean of {}. Green: phases begin."
RATES = "Dots are single seeds; rings and discs are means with 95 % intervals: rings damaged, discs intact."
CEILING = " The ceiling is the share of frames in which some head posture would have seen the hand, over all phases."


def write_study(result: StudyResult, out: str | os.PathLike[str] | None = None, against: str | None = None) -> Path:
    """Write the report of a study, and beside it the table as table.csv and table.tex.

    Args:
        result: an open study folder.
        out: the page; report.html in the study folder if None.
        against: the condition that all others are compared with; the first one if None.

    Returns:
        The page. Each file is replaced as a whole or not at all.

    Raises:
        RunFolderError: no such condition, or a file cannot be written.
    """
    page = Path(out) if out is not None else result.path / "report.html"
    comparison = compare(result, against)
    found = {
        page: render_study(result, comparison),
        page.with_name("table.csv"): csv_table(comparison),
        page.with_name("table.tex"): latex_table(comparison),
    }
    for path, text in found.items():
        with writing(path):
            write_whole(path, text)
    return page


def render_study(result: StudyResult, comparison: Comparison) -> str:
    """The page as text: everything in it, nothing to fetch.

    Args:
        result: an open study folder.
        comparison: of its conditions.
    """
    drawn, band = courses(result)
    drawn = [course for course in drawn if len(course.at) > len(course.borders)]
    panels = [*_panels(drawn)] if len(drawn) > PANELS else []
    rates = rates_charts(comparison)
    charts = dict(zip(("rates", "rates-more"), rates, strict=False))
    if drawn and not panels:
        charts["hits"] = courses_chart(drawn)
    hits = HITS.format(BANDS[band]) + (SMALL.format(drawn[0].condition) if panels else "")
    caption = RATES + (CEILING if _has_ceilings(comparison) else "")
    content = {
        "title": str(result.study.get("name") or result.path.resolve().name),
        "facts": " · ".join(_facts(result)),
        "lead": _lead(comparison),
        "words": WORDS,
        "plots": {name: embeddable(json.loads(chart.to_json())) for name, chart in charts.items()},
        "captions": {"rates": caption, "rates-more": caption, "hits": hits},
        "more_rates": len(rates[1].layout.yaxis.tickvals) if len(rates) > 1 else 0,
        "panels": panels[:SHOWN],
        "folded": panels[SHOWN:],
        "relearning": relearning(result),
        "relearning_picture": _picture(result),
        "means": means(comparison),
        "differences": differences(comparison),
        "tables": tables_to_copy(comparison),
        "failures": result.failures,
        "missing": _missing(result),
        "factors": _factors(result),
        "conditions": [_condition(result, name) for name in result.study.get("conditions", {})],
    }
    return rendered("study.html", content)


def _picture(result: StudyResult) -> str:
    """The figure of re-learning as an address that holds it; "" where there is none."""
    figure = relearning_figure(result)
    if figure is None:
        return ""
    with style(), BytesIO() as file:
        figure.savefig(file, format="svg", metadata={"Date": None})
        return f"data:image/svg+xml;base64,{base64.b64encode(file.getvalue()).decode('ascii')}"


def _panels(drawn: Sequence[Course]) -> Iterator[dict[str, Any]]:
    for k, (course, chart) in enumerate(zip(drawn, course_charts(drawn), strict=True)):
        yield {"key": f"hits-{k}", "condition": course.condition, "plot": embeddable(chart)}


def _has_ceilings(comparison: Comparison) -> bool:
    return any(row.measure.column == "ceiling" and row.interval.n for row in comparison.rows)


def _lead(comparison: Comparison) -> str:
    if not comparison.rows:
        return "No cell has finished yet."
    return f"Differences are to “{comparison.against}”, between runs of one seed, which meet the same arm movement."


def _facts(result: StudyResult) -> Iterator[str]:
    for column in ("eye", "motion"):
        kinds = [kind_name(kind) for kind in _kinds(result, column)]
        if kinds:
            yield f"{' and '.join(kinds)} {column}"
    planned = _planned(result)
    yield f"{len(planned)} condition{'s' * (len(planned) != 1)}"
    counts = sorted({len(seeds) for seeds in planned.values()})
    yield f"{' to '.join(map(str, {counts[0]: None, counts[-1]: None}))} seeds each" if counts else "no seeds"
    yield f"{len(_finished(result))} of {sum(map(len, planned.values()))} cells finished"


def _kinds(result: StudyResult, column: str, condition: str | None = None) -> list[str]:
    pairs = zip(result.table["condition"].to_pylist(), result.table[column].to_pylist(), strict=True)
    return sorted({kind for name, kind in pairs if kind and condition in (None, name)})


def _planned(result: StudyResult) -> dict[str, list[int]]:
    entries = result.study.get("conditions", {})
    return {name: list(entry.get("seeds", ())) for name, entry in entries.items()}


def _finished(result: StudyResult) -> set[tuple[str, int]]:
    return {*zip(result.table["condition"].to_pylist(), result.table["seed"].to_pylist(), strict=True)}


def _missing(result: StudyResult) -> str:
    """One sentence about cells that neither finished nor failed; "" where there are none."""
    failed = {(failure["condition"], failure["seed"]) for failure in result.failures}
    cells = {(name, seed) for name, seeds in _planned(result).items() for seed in seeds}
    open_cells = cells - _finished(result) - failed
    if not open_cells:
        return ""
    return f"Cells that have not ended yet: {len(open_cells)}. The command that began the study goes on with them."


def _factors(result: StudyResult) -> list[str]:
    entries = result.study.get("conditions", {}).values()
    return list(dict.fromkeys(name for entry in entries for name in entry.get("factors", {})))


def _condition(result: StudyResult, name: str) -> dict[str, Any]:
    entry = result.study["conditions"][name]
    return {
        "name": name,
        "factors": [entry.get("factors", {}).get(factor, "—") for factor in _factors(result)],
        "eye": ", ".join(map(kind_name, _kinds(result, "eye", name))) or "—",
        "motion": ", ".join(_kinds(result, "motion", name)) or "—",
        "seeds": ", ".join(map(str, entry.get("seeds", ()))),
        "settings": list(leaves(entry.get("experiment", {}))),
    }
