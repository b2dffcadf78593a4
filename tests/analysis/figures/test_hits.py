"""The paper's Figure 3 from a run."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib.colors import to_hex

from somatopy.analysis import summarise
from somatopy.analysis.figures import figure3, save
from somatopy.analysis.style import BORDER, HITS, PAPER, RUNNING, TREND


def lines_of(figure: Any, color: str) -> list[tuple[list[float], list[float]]]:
    """Coordinates of the lines of one colour."""
    (axes,) = figure.axes
    return [
        (list(map(float, line.get_xdata())), list(map(float, line.get_ydata())))
        for line in axes.get_lines()
        if to_hex(line.get_color()) == color
    ]


@pytest.fixture
def full_run(make_run: Any, hits_with_counts: Any) -> Any:
    """A run of the paper's length on straight lines."""
    intact = hits_with_counts(1000 + 45 * np.arange(39), rest=2323)
    damaged = hits_with_counts(np.r_[2250 - 45 * np.arange(7), np.full(14, 900)], rest=1549)
    return make_run(intact, damaged, part_frames=50_000)


def test_red_line_is_the_windows(full_run: Any) -> None:
    """Every full window is drawn where it starts, counted from the session's start."""
    (at1, hits1), (at2, hits2) = lines_of(figure3(full_run), HITS)
    first, second = summarise(full_run)["phases"]
    assert (hits1, hits2) == (first["hits_per_window"], second["hits_per_window"])
    assert at1 == list(range(39))
    assert at2 == pytest.approx(177_823 / 4500 + np.arange(21))


def test_blue_lines_are_the_trends(full_run: Any) -> None:
    """Each trend runs from its first window to its last, on its own line."""
    blue = lines_of(figure3(full_run), TREND)
    start = 177_823 / 4500
    assert [at for at, _ in blue] == [
        [0, 38],
        pytest.approx([start, start + 6]),
        pytest.approx([start + 7, start + 20]),
    ]
    ends = [[1000, 1000 + 45 * 38], [2250, 2250 - 45 * 6], [900, 900]]
    assert [hits for _, hits in blue] == [pytest.approx(pair) for pair in ends]


def test_green_lines_are_damage_and_readaptation(full_run: Any) -> None:
    """As in the paper: one at the damage, one where the recovery segment starts."""
    at = [at[0] for at, _ in lines_of(figure3(full_run), BORDER)]
    assert at == pytest.approx([177_823 / 4500, 177_823 / 4500 + 7])


def test_grey_lines_are_the_papers(full_run: Any) -> None:
    """The paper's regressions as printed: 2175.176 + 12.147 k, and so on, k from its segment's start."""
    grey = [hits for _, hits in lines_of(figure3(full_run), PAPER)]
    printed = [(12.147, 2175.176, 38), (-80.286, 2685.857, 6), (1.2154, 2255.264, 13)]
    assert grey == [pytest.approx([intercept, intercept + slope * k]) for slope, intercept, k in printed]


def test_a_summary_draws_the_same_as_its_run(full_run: Any) -> None:
    """All but the running minute, which it does not know."""
    figures = figure3(full_run), figure3(summarise(full_run))
    for color in (HITS, TREND, BORDER, PAPER):
        run, summary = (lines_of(figure, color) for figure in figures)
        assert run == [(pytest.approx(at), pytest.approx(hits)) for at, hits in summary]
    assert [len(lines_of(figure, RUNNING)) for figure in figures] == [1, 0]


def test_a_run_of_three_minutes_has_a_curve(make_run: Any) -> None:
    """The running minute, scaled to five minutes: half of the frames are 2,250 hits."""
    ((at, hits),) = lines_of(figure3(make_run(np.arange(2700) % 2 == 0)), RUNNING)
    assert len(at) == 13 + 1 and hits[:-1] == pytest.approx([2250] * 13)


def test_files_have_the_same_bytes_every_time(full_run: Any, tmp_path: Path) -> None:
    """PNG and SVG carry no date, and a user's own settings of matplotlib do not leak in."""
    first = save(figure3(full_run), tmp_path / "first", "figure3")
    with matplotlib.rc_context({"font.size": 30, "lines.linewidth": 9, "axes.facecolor": "black"}):
        second = save(figure3(full_run), tmp_path / "second", "figure3")
        assert matplotlib.rcParams["font.size"] == 30
    assert [path.name for path in first] == ["figure3.png", "figure3.svg"]
    assert [path.read_bytes() for path in first] == [path.read_bytes() for path in second]
    assert b"<dc:date>" not in first[1].read_bytes()


@pytest.mark.parametrize(
    ("frames", "note"),
    [
        ((0, 0), "0.0 minutes: too short for a 5-minute window"),
        ((900, 0), "1.0 minutes: too short for a 5-minute window"),
        ((4500, 0), "no trend: no segment has 3 windows"),
        ((9000, 9000), "no trend: no segment has 3 windows"),
        ((13_500, 9000), ""),
    ],
)
def test_short_runs_are_drawn_and_say_so(make_run: Any, tmp_path: Path, frames: tuple[int, int], note: str) -> None:
    """However few windows there are, there is a figure, and it says what is missing."""
    figure = figure3(make_run(*(np.ones(length) for length in frames)))
    save(figure, tmp_path, "figure3")
    (axes,) = figure.axes
    notes = [text.get_text() for text in axes.texts]
    assert note in notes if note else not any("no trend" in text for text in notes)


def test_the_paper_is_drawn_only_as_far_as_the_run_goes(make_run: Any) -> None:
    """A run of 4 and 2 windows has the paper's first two lines, 3 windows and 1 window long."""
    grey = lines_of(figure3(make_run(np.ones(18_000), np.ones(9_000))), PAPER)
    assert [at for at, _ in grey] == [[0, 3], [4, 5]]


def test_importing_the_package_loads_nothing_heavy() -> None:
    """The command line starts quickly: scipy, pyarrow and matplotlib wait until they are needed."""
    code = (
        "import sys, somatopy.analysis, somatopy.analysis.figures, somatopy.analysis.table, somatopy.analysis.report; "
        "print({'scipy', 'statsmodels', 'pandas', 'pyarrow', 'matplotlib', 'plotly', 'jinja2'} & set(sys.modules))"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert shown.stdout.strip() == "set()"
