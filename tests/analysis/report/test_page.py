"""The report as a file: what stands in it."""

from __future__ import annotations

import html
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from somatopy.analysis.claims import judge
from somatopy.analysis.figures import FIGURES, save
from somatopy.analysis.report import Source, render_report, write_report
from somatopy.analysis.runs import RunFolderError
from somatopy.analysis.style import BEYOND, MISSES, NOTHING, TREND, run_look
from somatopy.analysis.table import comparison

SCRIPT = re.compile(r"<script[^>]*>.*?</script>", re.DOTALL)


def text_of(page: str) -> str:
    """The page's words, without scripts, styles, tags and doubled spaces."""
    bare = re.sub(r"<style>.*?</style>", " ", SCRIPT.sub(" ", page), flags=re.DOTALL)
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", bare)).replace("\u00a0", " ").split())


def plots_of(page: str) -> dict[str, Any]:
    found = re.findall(r'<script type="application/json" data-plot="plot-(\w+)">(.*?)</script>', page, re.DOTALL)
    return {name: json.loads(data) for name, data in found}


@pytest.fixture(scope="module")
def page(rich_folder: Path) -> str:
    """The report of the run with everything in it."""
    return render_report([Source.of(rich_folder)])


def test_every_claim_is_there_with_rule_and_verdict(page: str, rich_folder: Path) -> None:
    """As decided by code: words, the paper's side, ours, the rule, the verdict."""
    words = text_of(page)
    for claim, finding in judge(Source.of(rich_folder).summary):
        for part in (claim.text, claim.paper, claim.rule, finding.ours, finding.verdict):
            assert part in words


def test_numbers_stand_beside_the_papers(page: str, rich_folder: Path) -> None:
    """The whole table of the command line."""
    words = text_of(page)
    for row in comparison(Source.of(rich_folder).summary):
        assert all(text in words for text in (row.quantity, *row.texts()))


def test_it_says_what_was_run_and_what_to_cite(page: str) -> None:
    """Description, versions, seed, cost; texts of the description are shown, not interpreted."""
    words = text_of(page)
    damage = "phases.1.interventions.0.kind offset"
    for part in ("learner.kind hebbian", damage, "somatopy 1.2.3", "seed 7", "took 12 s"):
        assert part in words
    assert "A <paper> & co." in words and "<paper>" not in SCRIPT.sub("", page)


def test_the_headline_has_rates_efficiency_and_controls(page: str, rich_folder: Path) -> None:
    """One sentence each, from the summary."""
    first, second = Source.of(rich_folder).summary["phases"]
    words = text_of(page)
    assert (
        f"seen in {100 * first['rate']:.1f} % of 22,500 frames while intact and {100 * second['rate']:.1f} %" in words
    )
    assert f"that is {100 * first['rate'] / 0.5:.0f} % while intact" in words
    assert re.search(r"the controls saw it, while intact: frozen 4\d\.\d % and random \d\.\d %", words)


def test_it_is_one_file_that_fetches_nothing(page: str) -> None:
    """No link, source or import leads outside; the browser is told to allow none; plotly may not upload."""
    bare = SCRIPT.sub("", page)
    assert not re.search(r"""(?:src|href|url|@import|action)\s*[=(]\s*["']?(?:https?:)?//""", bare)
    assert "default-src 'none'" in page and "form-action 'none'" in page
    assert "showSendToCloud: false" in page
    assert len(page.encode()) < 8e6
    assert f"its {len(page.encode()) / 1e6:.1f} MB" in text_of(page)


def test_plots_carry_the_runs_numbers(page: str, rich_folder: Path) -> None:
    """Every plot is there; border, trends and hidden choices included."""
    plots = plots_of(page)
    knowledge = {"agreement", "missed_gazes", "missed_ages"}
    assert set(plots) == {"hits", "efficiency", "arm", "head", "gaze", "misses", *knowledge}
    names = [trace["name"] for trace in plots["efficiency"]["data"]]
    geometric = [f"{name} (geometric eye)" for name in ("this run", "frozen", "random")]
    assert names == ["ceiling", "reactive bound", "running minute", *geometric]
    assert len(plots["misses"]["data"]) == 6 * 2
    assert len(plots["misses"]["layout"]["updatemenus"][0]["buttons"]) == 6
    assert plots["hits"]["layout"]["shapes"][0]["x0"] == 5


def test_the_same_run_gives_the_same_bytes(page: str, rich_folder: Path) -> None:
    """Nothing of the day or of chance is in it."""
    assert render_report([Source.of(rich_folder)]) == page


def test_figures_are_carried_along(rich_copy: Any) -> None:
    """Those that were drawn, as pictures inside the page."""
    figure = FIGURES["figure4"](rich_copy)
    assert figure is not None
    save(figure, rich_copy.path / "figures", "figure4")
    page = write_report([rich_copy.path]).read_text(encoding="utf-8")
    assert page.count('<img src="data:image/webp;base64,') == 1
    assert "Figure 4: distortion of the arm map" in page


def test_it_is_written_into_the_run_folder(rich_copy: Any, tmp_path: Path) -> None:
    """report.html, or the file that was asked for; nothing is left beside it."""
    before = {path.name for path in rich_copy.path.iterdir()}
    assert write_report([rich_copy.path]) == rich_copy.path / "report.html"
    assert {path.name for path in rich_copy.path.iterdir()} == {*before, "report.html"}
    assert write_report([rich_copy.path], tmp_path / "mine.html").is_file()


def test_a_phase_of_no_frames_is_not_told(page: str, rich_folder: Path, idle_run: Any) -> None:
    """All is told as of the same frames without it, but for the numbers of phases, which are the description's.

    So it is where two runs are compared.
    """
    rich, idle = Source.of(rich_folder), Source.of(idle_run.path)
    idle_page = render_report([idle])
    (told, _, _), (words, _, described) = (text_of(found).rpartition("What was run") for found in (page, idle_page))
    words = words.replace("in phase 2, undamaged", "while intact")
    told, words = (re.sub(r"phase \d", "phase N", text) for text in (told, words))
    assert told and words == told
    assert "phases.2.interventions.0.kind my:Tremor" in described and "Tremor" not in words
    both = render_report([replace(rich, name="a"), replace(idle, name="b")])
    assert text_of(both).count("25.0 + 20.0") == 2 and "0.0 +" not in text_of(both)


def test_without_a_ceiling_the_page_says_why(twinless_run: Any, rich_folder: Path) -> None:
    """One sentence, alone and where runs are compared; nothing is said of what was possible."""
    sentence = "There is no ceiling, because the body has no model of itself."
    source = Source.of(twinless_run.path)
    words = text_of(render_report([source]))
    assert words.count(sentence) == 1 and "hebbian learner · geometric eye · seed 7" in words
    assert "Of what any gaze could have seen" not in words and "Beside what was possible" not in words
    assert "What the learner knows, and what it misses, is not shown, because the body has no model of itself." in words
    both = text_of(render_report([Source.of(rich_folder), source]))
    assert both.count(f"copy: {sentence}") == 1 == both.count(sentence)


def test_a_ceiling_without_a_reactive_bound_is_told_alone(rich_copy: Any) -> None:
    """Neither curve nor caption mentions what is unknown."""
    (rich_copy.path / "ceiling.json").write_text(json.dumps(rich_copy.ceiling | {"reactive": None}))
    page = render_report([Source.of(rich_copy.path)])
    assert "ceiling" in text_of(page) and "reactive bound" not in text_of(page)
    assert "reactive bound" not in [trace["name"] for trace in plots_of(page)["efficiency"]["data"]]


def test_maps_that_are_not_the_papers_are_left_out_with_a_word(other_maps: Any) -> None:
    """The page is whole but for the explorer, and says why."""
    page = render_report([Source.of(other_maps.path)])
    assert 'id="maps-data"' not in page and "Maps and links, window by window" not in page
    assert "This learner keeps arrays of its own in maps/." in text_of(page)


@pytest.mark.parametrize("unit", ["rad", "1"])
def test_distances_are_told_in_their_unit(make_run: Any, unit: str) -> None:
    """Axis, caption, verdict and table of a run in radians name them; those in [0, 1] units are the paper's."""
    columns = {f"{side}_distance": (np.full(9500, 0.015), {"unit": unit}) for side in ("arm", "head")}
    page = render_report([Source.of(make_run(np.ones(9500), distances=columns).path)])
    plots, words = plots_of(page), text_of(page)
    rad = unit == "rad"
    title = plots["head"]["layout"]["yaxis"]["title"]["text"]
    assert title == "distortion of the head map" + " (rad)" * rad
    assert ("the paper, after 10 min" in json.dumps(plots["head"])) != rad
    assert ("1 is a joint's whole range" in words) != rad
    assert ("0.0150 to 0.0150 rad; the paper's are in [0, 1] units" in words) == rad
    assert ("0.0150, 0.0150, 0.0150 rad (cannot tell: the paper's is in [0, 1] units)" in words) == rad


def test_runs_in_different_units_are_told_apart(make_run: Any) -> None:
    """Their curves carry the unit in their names."""
    runs = [
        make_run(np.ones(4500), distances={"arm_distance": (np.ones(4500), {"unit": unit})}, folder=folder)
        for unit, folder in (("rad", "a"), ("1", "b"))
    ]
    plot = plots_of(render_report([Source.of(run.path) for run in runs]))["arm"]
    assert [trace["name"] for trace in plot["data"]] == ["a, rad", "b, [0, 1]"]
    assert plot["layout"]["yaxis"]["title"]["text"] == "distortion of the arm map (in the unit named)"


def test_runs_side_by_side(rich_folder: Path, rich_copy: Any) -> None:
    """A row a run, the settings that differ, a verdict for each, and all in the same plots."""
    text = (rich_copy.path / "experiment.toml").read_text().replace("seed = 7", "seed = 8")
    (rich_copy.path / "experiment.toml").write_text(text)
    page = render_report([Source.of(rich_folder, "first"), Source.of(rich_copy.path, "second")])
    words = text_of(page)
    assert "2 runs compared" in words
    for part in ("seed 7 first 8 second", "phases.0.frames 22500 first 13500 second"):
        assert part in words
    assert "learner.kind hebbian hebbian" not in words
    assert words.count("cannot tell") >= 2
    for name in ("hits", "efficiency", "arm", "head", "gaze"):
        names = [trace.get("name") for trace in plots_of(page)[name]["data"]]
        assert "first" in names and "second" in names


def test_a_run_of_three_minutes_has_curves(make_run: Any) -> None:
    """Time is in minutes; hits and share are drawn, and what cannot be told is one line that says why."""
    page = render_report([Source.of(make_run(np.arange(2700) % 2 == 0).path)])
    plots, words = plots_of(page), text_of(page)
    for name in ("hits", "efficiency"):
        assert plots[name]["layout"]["xaxis"]["title"]["text"] == "robot time, in minutes"
        assert plots[name]["layout"]["xaxis"]["range"][1] == pytest.approx(3.03)
    assert [trace["name"] for trace in plots["hits"]["data"]] == ["running minute, × 5"]
    (line,) = re.findall(r"None of the 12 claims can be told from this run: [^.]*", words)
    assert "the run has no damaged phase (5)" in line and "the run is too short (3)" in line
    assert words.index("Over time") < words.index("The paper's claims")
    assert "This run lasted 3, so that there are none to show." in words


def test_many_runs_are_told_apart() -> None:
    """No two of 36 have the same colour and dashes."""
    assert len({run_look(k) for k in range(36)}) == 36


def test_nothing_known_has_a_colour_of_its_own() -> None:
    """What is beyond differs from all of the scale of beliefs, what is empty from all of that of misses (CIE Lab)."""
    from matplotlib import colormaps
    from matplotlib.colors import to_rgb

    def lab(colors: Any) -> np.ndarray:
        rgb = np.atleast_2d(colors)
        linear = np.where(rgb > 0.04045, ((rgb + 0.055) / 1.055) ** 2.4, rgb / 12.92)
        xyz = linear @ np.array([[0.4124, 0.2126, 0.0193], [0.3576, 0.7152, 0.1192], [0.1805, 0.0722, 0.9505]])
        f = np.cbrt(xyz / [0.9505, 1.0, 1.089])
        return np.column_stack([116 * f[:, 1] - 16, 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])])

    shares = np.linspace(0, 1, 50)
    beliefs = np.ones(3) + shares[:, None] * (np.array(to_rgb(TREND)) - 1)
    for color, scale in ((BEYOND, beliefs), (NOTHING, colormaps[MISSES](shares)[:, :3])):
        assert np.linalg.norm(lab(to_rgb(color)) - lab(scale), axis=1).min() > 20


def test_runs_of_one_name_are_told_apart(tmp_path: Path, make_run: Any) -> None:
    """By as much of their paths as it takes."""
    runs = [make_run([True] * 9, folder=f"{letter}/run") for letter in "ab"]
    words = text_of(write_report([run.path for run in runs], tmp_path / "page.html").read_text(encoding="utf-8"))
    assert "a/run" in words and "b/run" in words


@pytest.mark.parametrize("frames", [(0, 0), (9, 0), (4500, 9), (20_000,)])
def test_little_gives_a_page_as_well(make_run: Any, frames: tuple[int, ...]) -> None:
    """Runs killed at once, seconds long, of one phase, without maps, postures, ceiling: what is missing is said."""
    run = make_run(*([True] * n for n in frames), learner="random")
    words = text_of(write_report([run.path]).read_text(encoding="utf-8"))
    assert "cannot tell" in words and "There is no ceiling, because" in words and "No controls ran" in words
    assert ("No frame of this run was recorded." in words) == (sum(frames) == 0)


def test_wrong_folders_are_refused(tmp_path: Path) -> None:
    """None, or one that is no run."""
    with pytest.raises(ValueError, match="at least one run folder"):
        write_report([])
    with pytest.raises(RunFolderError, match=r"is not a run folder"):
        write_report([tmp_path])
