"""What notebooks show of a run, and its frames in pandas."""

from __future__ import annotations

from collections.abc import Callable
from html.parser import HTMLParser

import numpy as np
import pytest

from somatopy.analysis.run_html import run_html
from somatopy.analysis.runs import Run


class Cells(HTMLParser):
    """The rows of a table, and whether every tag was closed in its order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.rows: list[list[str]] = []
        self.open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag != "br":
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] in ("td", "th"):
            self.rows[-1][-1] += data


DESCRIBED = {
    "name": "a <b>",
    "seed": 3,
    "learner": {"kind": "best"},
    "phases": [{"name": "intact & well", "frames": 9000}, {"name": "damaged", "frames": 450}],
}
SUMMARY = {
    "phases": [
        {"damage": "none", "rate": 0.5, "efficiency_per_window": [0.5, 0.7]},
        {"damage": "offset", "rate": None, "efficiency_per_window": None},
    ]
}


def test_a_row_for_each_phase() -> None:
    """Minutes, damage, the share seen, and the mean share of what was possible; what is unknown is blank."""
    cells = Cells(run_html("runs/x", DESCRIBED, SUMMARY))
    assert cells.rows[1:] == [["intact & well", "none", "10", "50.0%", "60.0%"], ["damaged", "offset", "0.5", "", ""]]
    assert cells.open == []


def test_names_cannot_become_markup() -> None:
    """Whatever a run, a phase or a folder is called."""
    text = run_html("<script>", DESCRIBED, None)
    assert "<script>" not in text and "a <b>" not in text and "a &lt;b&gt;" in text
    assert "No summary yet" in text and Cells(text).open == []


def test_a_folder_shows_itself(make_run: Callable[..., Run]) -> None:
    """Whether it has a summary or not, and whatever its description lacks."""
    run = make_run([True, False], [True])
    shown = Cells(run._repr_html_())
    assert len(shown.rows) == 1 + len(run.description["phases"]) and shown.open == []
    assert Cells(Run(run.path, {})._repr_html_()).open == []


@pytest.mark.parametrize(("start", "stop"), [(0, None), (1, 3), (2, 2)])
def test_pandas_has_the_same_frames(make_run: Callable[..., Run], start: int, stop: int | None) -> None:
    """The values, labels and units are those of the record; a part has the labels of its frames."""
    run = make_run([True, False, True], [True])
    table = run.to_pandas(["hit", "frame"], start, stop)
    assert list(table.columns) == ["hit", "frame"]
    assert np.array_equal(table["hit"], run.values("hit")[start:stop])
    assert np.array_equal(table.index, table["frame"])
    assert table.attrs["units"] == {"hit": run.unit("hit"), "frame": run.unit("frame")}
