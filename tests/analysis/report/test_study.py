"""The report of a study as a file: what stands in it, and beside it."""

from __future__ import annotations

import html
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from somatopy.analysis.comparison import compare
from somatopy.analysis.comparison_table import csv_table, latex_table
from somatopy.analysis.report import render_study, write_study
from somatopy.analysis.runs import RunFolderError

SCRIPT = re.compile(r"<script[^>]*>.*?</script>", re.DOTALL)
PLASTIC = {0: [0.50, 0.40], 1: [0.54, 0.42], 2: [0.58, 0.44]}
FROZEN = {0: [0.40, 0.20], 1: [0.42, 0.22], 2: [0.47, 0.21]}
DAMAGES = ("none", "offset")
FAILURE = {"condition": "frozen", "seed": 3, "key": "k", "cause": "Diverged: <b>the elbow</b> left its range."}


def text_of(page: str) -> str:
    """The page's words, without scripts, styles, tags and doubled spaces."""
    bare = re.sub(r"<style>.*?</style>", " ", SCRIPT.sub(" ", page), flags=re.DOTALL)
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", bare)).replace("\u00a0", " ").split())


def plots_of(page: str) -> dict[str, Any]:
    found = re.findall(r'<script type="application/json" data-plot="plot-([\w-]+)">(.*?)</script>', page, re.DOTALL)
    return {name: json.loads(data) for name, data in found}


@pytest.fixture
def study(make_study: Any) -> Any:
    """Two conditions in two phases under three seeds; one more cell failed, and one has not ended."""
    return make_study({"plastic": PLASTIC, "frozen": FROZEN}, DAMAGES, failures=[FAILURE])


def test_means_stand_with_their_intervals(study: Any) -> None:
    """Every measure of every condition and phase; by hand: .54 ± 4.303 · .04 / √3."""
    words = text_of(render_study(study, compare(study)))
    assert "plastic 1, intact 3 54.0 [44.1, 63.9] 67.5 [55.1, 79.9] 80.0 [80.0, 80.0] +9.00" in words
    assert "2, offset 3 42.0 [37.0, 47.0] 52.5" in words
    for head in ("hand seen %", "of what was possible %", "ceiling %", "slope hits per window", "arm distortion"):
        assert head in words


def test_it_says_eye_motion_and_how_far_it_is(study: Any) -> None:
    """And which cells failed, why, and how many have not ended."""
    words = text_of(render_study(study, compare(study)))
    assert "geometric eye · kinematic motion · 2 conditions · 4 seeds each · 6 of 8 cells finished" in words
    assert "frozen 3 Diverged: <b>the elbow</b> left its range." in words
    assert "Cells that have not ended yet: 1." in words


def test_differences_are_to_the_condition_that_was_chosen(study: Any) -> None:
    """The first one, or another; with p, alone and adjusted."""
    words = text_of(render_study(study, compare(study)))
    assert "frozen 1, intact 3 −11.0 [−13.5, −8.5] .003 .005 .250" in words
    other = text_of(render_study(study, compare(study, "frozen")))
    assert "plastic 1, intact 3 +11.0 [+8.5, +13.5] .003 .005 .250" in other
    assert "Differences are to “frozen”" in other


def test_plots_carry_means_bands_and_seeds(study: Any) -> None:
    """A line, a band and dots for each condition; the range of few seeds is said to be one."""
    page = render_study(study, compare(study))
    plots = plots_of(page)
    assert set(plots) == {"rates", "hits"}
    lines = [trace for trace in plots["hits"]["data"] if trace.get("name")]
    assert [line["name"] for line in lines] == ["plastic", "frozen"]
    assert [trace.get("fill") for trace in plots["hits"]["data"]].count("toself") == 2
    assert [shape["x0"] for shape in plots["hits"]["layout"]["shapes"]] == [2.0]
    assert [mark["text"] for mark in plots["hits"]["layout"]["annotations"]] == ["damage"]
    assert "Bands reach from the lowest to the highest seed" in text_of(page)


def test_many_conditions_have_a_plot_each(make_study: Any) -> None:
    """On equal axes, in the order of the study, with the first one's mean behind; bands of five seeds are intervals.

    After the twelfth they are folded, in the chart of rates as well.
    """
    drawn = np.random.default_rng(0).uniform(0.1, 0.6, (20, 5, 1)).tolist()
    rates = {f"condition {k}": dict(enumerate(found)) for k, found in enumerate(drawn)}
    study = make_study(rates)
    page = render_study(study, compare(study))
    drawn_at_once, folded = (plots_of(page)[name]["layout"] for name in ("rates", "rates-more"))
    assert drawn_at_once["yaxis"]["ticktext"] == [*rates][:12] and folded["yaxis"]["ticktext"] == [*rates][12:]
    assert drawn_at_once["xaxis"] == folded["xaxis"] and drawn_at_once["height"] > folded["height"]
    plots = {name: plot for name, plot in plots_of(page).items() if name.startswith("hits")}
    assert [*plots] == [f"hits-{k}" for k in range(20)]
    assert len({json.dumps(plot["layout"]["yaxis"]["range"]) for plot in plots.values()}) == 1
    assert [len(plot["data"]) for plot in plots.values()] == [3] + 19 * [4]
    for last, first in (("rates", "rates-more"), ("hits-11", "hits-12")):
        between = page[page.index(f'id="plot-{last}"') : page.index(f'id="plot-{first}"')]
        assert '<details class="more"><summary>8 more conditions</summary>' in between
    words = text_of(page)
    assert "Bands are 95 % intervals of the mean" in words and "Dotted: the mean of condition 0" in words
    assert words.index("condition 9 1, intact") < words.index("condition 10 1, intact")


def test_tables_can_be_taken_away(study: Any) -> None:
    """In the page as they are written beside it."""
    page = write_study(study)
    assert page == study.path / "report.html"
    csv, tex = ((study.path / name).read_text(encoding="utf-8") for name in ("table.csv", "table.tex"))
    assert (csv, tex) == (csv_table(compare(study)), latex_table(compare(study)))
    found = re.findall(r"<textarea[^>]*>(.*?)</textarea>", page.read_text(encoding="utf-8"), re.DOTALL)
    assert [html.unescape(text) for text in found] == [csv, tex]


def test_another_page_may_be_asked_for(study: Any, tmp_path: Path) -> None:
    """Its tables stand beside it; nothing is written for a condition that is not there."""
    assert write_study(study, tmp_path / "mine.html", "frozen").is_file() and (tmp_path / "table.tex").is_file()
    with pytest.raises(RunFolderError, match="no condition 'x'"):
        write_study(study, against="x")
    assert not (study.path / "report.html").exists()


def test_names_are_shown_and_not_interpreted(make_study: Any) -> None:
    """Neither by the page nor by plots, which read some tags."""
    name = "<b>bold</b> & <script>"
    study = make_study({name: PLASTIC}, DAMAGES)
    page = render_study(study, compare(study))
    assert name in text_of(page) and "<b>bold" not in page
    assert "&lt;b>bold&lt;/b>" in plots_of(page)["rates"]["layout"]["yaxis"]["ticktext"][0]


def test_it_is_one_file_that_fetches_nothing(study: Any) -> None:
    """No link, source or import leads outside; the same study gives the same bytes."""
    page = render_study(study, compare(study))
    assert not re.search(r"""(?:src|href|url|@import|action)\s*[=(]\s*["']?(?:https?:)?//""", SCRIPT.sub("", page))
    assert "default-src 'none'" in page and page == render_study(study, compare(study))


@pytest.mark.parametrize("rates", [{}, {"a": {0: [0.5]}}, {"a": {0: [0.5], 1: [0.4]}, "b": {7: [0.5]}}])
def test_little_gives_a_page_as_well(make_study: Any, rates: Any) -> None:
    """No finished cell, one run, no shared seed, runs shorter than a window: nothing to compare, and nothing breaks."""
    study = make_study(rates, order=["a", "b"], hits_per_window=[[]], slopes=[[]], ceiling=[None], efficiency=[None])
    words = text_of(render_study(study, compare(study)))
    assert ("No cell has finished yet." in words) == (not rates)
    assert "No run is as long as one window of five minutes." in words and "percentage points" not in words


def test_a_study_of_damages_begins_with_learning_and_relearning(make_study: Any) -> None:
    """Its table and picture, in the page itself; a study without damages among its factors has neither."""
    rates = {"hebbian, none": {0: [0.4, 0.4]}, "hebbian, gain": {0: [0.4, 0.2]}}
    curves = {"hits_per_minute": [[360] * 10] * 2, "ceiling_per_minute": [[0.8] * 10] * 2, "plateau": [0.5, 0.25]}
    plain = make_study(rates, ("none", "gain"), **curves)
    assert "re-learning" not in text_of(render_study(plain, compare(plain)))
    for name, entry in plain.study["conditions"].items():
        entry["factors"] = dict(zip(("learner", "damage"), name.split(", "), strict=True))
    page = render_study(plain, compare(plain))
    words = text_of(page)
    assert "Learning and re-learning Efficiency around each damage" in words and "50.0" in words and "25.0" in words
    assert 'src="data:image/svg+xml;base64,' in page
