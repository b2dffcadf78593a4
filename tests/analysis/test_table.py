"""The paper's numbers beside a run's."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from somatopy.analysis import summarise
from somatopy.analysis.table import Row, comparison, render

# As printed in section IV of the paper; the rates are the lines' values at the segments' ends, 39.516, 7 and 14.344
# windows after their starts.
PRINTED = ["177,823", "91,658 (51.5 %)", "+12.147", "2175.176", "-80.286", "2685.857", "2255.264", "96,049"]
RATES = ["48.3 % to 59.0 %", "59.7 % to 47.2 %", "50.1 % to 50.5 %"]


@pytest.fixture
def full_summary(make_run: Any, hits_with_counts: Any) -> dict[str, Any]:
    """Summary of a run of the paper's length on other lines than the paper's."""
    noise = np.tile([20, -20, 0], 13)
    intact = hits_with_counts(1000 + 45 * np.arange(39) + noise, rest=2323)
    damaged = hits_with_counts(np.r_[2250 - 45 * np.arange(7), np.full(14, 900)], rest=1549)
    probes = {"arm_distance": np.full(273_872, 0.25), "head_distance": np.full(273_872, 0.0125)}
    return summarise(make_run(intact, damaged, distances=probes, part_frames=50_000))


def test_the_papers_numbers_are_there(full_summary: dict[str, Any]) -> None:
    """Every number that the paper prints stands in its column, and its lines as rates."""
    paper = [row.texts()[0] for row in comparison(full_summary)]
    assert set(PRINTED + RATES) <= set(paper)


def test_a_run_on_the_papers_lines_gives_the_papers_rates(make_run: Any, hits_with_counts: Any) -> None:
    """Both columns mean the same: a run that is the paper's shows the paper's rates, windows and counts."""
    intact = hits_with_counts(2175.176 + 12.147 * np.arange(39), rest=2323)
    second = np.r_[2685.857 - 80.286 * np.arange(7), 2255.264 + 1.2154 * np.arange(14)]
    damaged = hits_with_counts(second, rest=1549)
    for row in comparison(summarise(make_run(intact, damaged, part_frames=90_000))):
        if row.quantity in ("frames", "5-minute windows", "fitted rate, start to end"):
            assert row.texts()[0] == row.texts()[1]


def test_the_runs_numbers_are_there(full_summary: dict[str, Any]) -> None:
    """Slopes come with their standard errors, rates at both ends, distortions with start, peak and end."""
    cells = {(row.part, row.quantity): row.texts()[1] for row in comparison(full_summary)}
    trend = full_summary["phases"][0]["trends"][0]
    slope = f"{trend['slope']:+.3f} ± {trend['slope_se']:.3f}"
    assert cells["phase 1, intact", "slope, hits per window, per window"] == slope
    assert cells["phase 2, degradation", "slope, hits per window, per window"] == "-45.000 ± 0.000"
    assert cells["phase 2, degradation", "fitted rate, start to end"] == "50.0 % to 43.0 %"
    assert cells["phase 2, re-adaptation", "fitted rate, start to end"] == "20.0 % to 20.0 %"
    assert cells["phase 2, maps", "arm distortion: start, peak, end"] == "0.2500, 0.2500, 0.2500"


def test_distortions_in_radians_say_so(full_summary: dict[str, Any]) -> None:
    """Numbers carry their unit; beside the paper's number in [0, 1] units it is said that they cannot be compared."""
    rows = {(row.part, row.quantity): row.texts()[1] for row in comparison(full_summary, {"arm": "1", "head": "rad"})}
    quantity = "{} distortion: start, peak, end"
    assert rows["phase 1, intact", quantity.format("arm")] == "0.2500, 0.2500, 0.2500"
    numbers = "0.0125, 0.0125, 0.0125 rad"
    assert rows["phase 2, maps", quantity.format("head")] == numbers
    why = "(cannot tell: the paper's is in [0, 1] units)"
    assert rows["phase 1, intact", quantity.format("head")] == f"{numbers} {why}"


def test_a_short_run_says_so(make_run: Any) -> None:
    """What a run is too short for reads n/a (too short), in the same rows."""
    short = comparison(summarise(make_run(np.ones(900), np.ones(0))))
    texts = [row.texts()[1] for row in short]
    assert texts[:3] == ["900", "900 (100.0 %)", "n/a (too short)"]
    assert texts.count("n/a (too short)") == len(texts) - 3
    assert "0" in texts


def test_other_reasons_for_nothing(make_run: Any) -> None:
    """A phase that does not exist, a trend that was not asked for and a learner without maps are told apart."""
    one = comparison(summarise(make_run(np.ones(5000))))
    assert {row.run for row in one if row.part.startswith("phase 2")} == {"n/a (no such phase)"}
    assert {row.run for row in one if "distortion" in row.quantity and "1" in row.part} == {"n/a (not recorded)"}
    unbroken = comparison(summarise(make_run(np.ones(5000), np.ones(15_000), breaks=(), folder="unbroken")))
    assert {row.run for row in unbroken if row.part.endswith("re-adaptation")} == {"n/a (no such trend)"}


def test_text_columns_line_up(full_summary: dict[str, Any]) -> None:
    """In the fixed-width form every cell of the run starts in the same column."""
    rows = comparison(full_summary)
    head, *body = render(rows).splitlines()
    column = head.index("this run")
    assert [line[column:] for line in body if len(line) > column] == [row.texts()[1] for row in rows]
    assert {line[column - 1] for line in body if len(line) > column} == {" "}


def test_markdown_is_one_table(full_summary: dict[str, Any]) -> None:
    """Each line has three cells, and each row is there."""
    rows = comparison(full_summary)
    lines = render(rows, "markdown").splitlines()
    assert {line.count("|") for line in lines} == {4}
    assert lines[1] == "|---|---|---|"
    assert len(lines) == 2 + len(rows) + len({row.part for row in rows})


def test_unknown_form_is_refused() -> None:
    """The forms there are, are listed."""
    with pytest.raises(ValueError, match=r"form = 'html' is unknown. Choose 'text' or 'markdown'"):
        render([Row("a", "b", "{}", "c", "d")], "html")  # type: ignore[arg-type]
