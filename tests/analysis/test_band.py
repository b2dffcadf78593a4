"""The band behind a run: its spread, its verdicts as text, in the report and in Figure 3."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_hex
from tests.analysis.conftest import cell_rows, write_study

from somatopy.analysis.band import render_verdicts, spread_of, verdict_rows, verdicts_of
from somatopy.analysis.figures import FIGURES
from somatopy.analysis.report import Source, render_report
from somatopy.analysis.runs import Run, load_run
from somatopy.analysis.style import BAND


@pytest.fixture
def run(rich_copy: Run) -> Run:
    """A run of three windows intact and three damaged, with a band of three seeds whose hits are known."""
    rows: list[dict[str, Any]] = []
    for seed in range(3):
        counts = ([1000 + 100 * seed, 1100, 1200 - 100 * seed], [500 + seed, 400, 300])
        rows += cell_rows("paper", seed, [0.25, 0.1], ["none", "offset"], hits_per_window=counts, frames=[13500, 13500])
    write_study(rich_copy.path / "band", rows, ["paper"])
    return load_run(rich_copy.path)


def test_the_spread_reaches_from_the_lowest_to_the_highest_seed(run: Run) -> None:
    """Window by window, with a gap between the phases."""
    spread = spread_of(run)
    assert spread is not None and spread.seeds == 3
    nan = float("nan")
    np.testing.assert_array_equal(spread.at, [0, 1, 2, nan, 3, 4, 5])
    np.testing.assert_array_equal(spread.low, [1000, 1100, 1000, nan, 500, 400, 300])
    np.testing.assert_array_equal(spread.high, [1200, 1100, 1200, nan, 502, 400, 300])
    np.testing.assert_allclose(spread.mean, [1100, 1100, 1100, nan, 501, 400, 300])


def test_without_a_band_there_is_none(rich_run: Run, run: Run) -> None:
    """Nor of a band whose cells are shorter than a window, or have not ended."""
    assert spread_of(rich_run) is None and verdicts_of(rich_run) == []
    short = cell_rows("paper", 0, [0.25], ["none"], hits_per_window=[[]], frames=[180])
    for rows in (short, []):
        write_study(run.path / "band", rows, ["paper"])
        assert spread_of(run) is None


def test_verdicts_as_text(run: Run) -> None:
    """What is too short is said to be; numbers carry their interval, unit and the seeds that show it."""
    rows = {one.claim.key: row for one, row in zip(verdicts_of(run), verdict_rows(verdicts_of(run)), strict=True)}
    assert rows["learns"]["ours"] == "+9.0 [+9.0, +9.0] hits per window, per window"
    assert (rows["learns"]["shown"], rows["learns"]["verdict"]) == ("3 of 3 (chance 1.5)", "holds")
    assert rows["learns"]["paper"] == "+12.1, outside the spread of seeds"
    assert (rows["costs"]["ours"], rows["costs"]["verdict"]) == ("too short", "cannot tell")
    lines = render_verdicts(verdicts_of(run)).splitlines()
    assert lines[0].startswith("over 3 seeds, geometric eye") and len(lines) == len(rows) + 1


def test_it_stands_in_the_report(run: Run, rich_folder: Path) -> None:
    """A table of every claim, and a band in the plot that is filled with its own colour; without one, neither."""
    page = render_report([Source.of(run.path)])
    table = re.search(r'<div id="over-seeds">.*?</div>', page, re.DOTALL)
    assert table is not None
    for row in verdict_rows(verdicts_of(run)):
        assert all(text in html.unescape(table[0]) for text in (row["claim"], row["ours"], row["verdict"]))
    bands = [trace for trace in hits_of(page) if trace["name"] == "3 seeds, geometric eye"]
    assert [trace.get("fill") for trace in bands] == [None, "tonexty"] * 2
    assert {trace["fillcolor"] for trace in bands if "fill" in trace} == {BAND}
    assert [bool(trace.get("showlegend")) for trace in bands] == [False, True, False, False]
    without = render_report([Source.of(rich_folder)])
    assert 'id="over-seeds"' not in without and not [t for t in hits_of(without) if "seeds" in t["name"]]


def hits_of(page: str) -> list[dict[str, Any]]:
    found = re.search(r'data-plot="plot-hits">(.*?)</script>', page, re.DOTALL)
    assert found is not None
    traces: list[dict[str, Any]] = json.loads(found[1])["data"]
    return traces


def test_it_lies_behind_figure_3(run: Run, rich_run: Run) -> None:
    """Named in the legend; a run without a band has neither."""
    draw: Callable[[Run], Any] = FIGURES["figure3"]
    colours = [to_hex(each.get_facecolor()[0]) for each in draw(run).axes[0].collections if len(each.get_facecolor())]
    assert BAND in colours
    legends = [[text.get_text() for text in draw(one).legends[0].get_texts()] for one in (run, rich_run)]
    assert "other seeds, geometric eye" in legends[0] and "other seeds, geometric eye" not in legends[1]
