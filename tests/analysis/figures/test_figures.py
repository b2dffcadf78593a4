"""All figures of a run: what they show, and that they are the same every time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure

from somatopy.analysis.bounds import ceiling_shares
from somatopy.analysis.figures import FIGURES, Shot, filmstrip, filmstrip_frames, save, save_figures
from somatopy.analysis.runs import load_run
from somatopy.analysis.series import distortion
from somatopy.analysis.snapshots import load_snapshot
from somatopy.analysis.style import CEILING, CONTROLS, HITS, RUNS, TREND, style

SOURCE = "hebbian learner, geometric eye, kinematic motion, seed 7"


def words(figure: Any) -> str:
    """Everything written in a figure."""
    return "\n".join(text.get_text() for text in figure.findobj(matplotlib.text.Text))


def curves(axes: Any) -> dict[str, np.ndarray]:
    return {str(line.get_label()): np.array(line.get_ydata(), dtype=float) for line in axes.get_lines()}


@pytest.mark.parametrize("name", FIGURES)
def test_figures_name_their_run_and_repeat_to_the_byte(rich_run: Any, tmp_path: Path, name: str) -> None:
    """Learner, eye, motion and seed stand in each; a user's settings and the time of day do not matter."""
    first, second = FIGURES[name](rich_run), FIGURES[name](rich_run)
    assert first is not None and second is not None
    assert SOURCE in words(first)
    files = save(first, tmp_path / "first", name)
    with matplotlib.rc_context({"font.size": 30, "lines.linewidth": 9, "axes.facecolor": "black"}):
        again = save(second, tmp_path / "second", name)
    assert [path.read_bytes() for path in files] == [path.read_bytes() for path in again]
    assert b"<dc:date>" not in files[1].read_bytes()


@pytest.mark.parametrize("name", FIGURES)
def test_a_phase_of_no_frames_is_not_drawn(rich_run: Any, idle_run: Any, tmp_path: Path, name: str) -> None:
    """Figures of the same frames have the same bytes, whatever stands in phases that never ran."""
    figures = [FIGURES[name](run) for run in (rich_run, idle_run)]
    files = [save(figure, tmp_path / str(k), name) for k, figure in enumerate(figures) if figure]
    assert files[0][1].read_bytes() == files[1][1].read_bytes()


@pytest.mark.parametrize("name", FIGURES)
def test_runs_with_next_to_nothing_are_drawn_or_left_out(make_run: Any, tmp_path: Path, name: str) -> None:
    """Killed at once, seconds long, without maps or postures: a figure or None, never an error."""
    for folder, phases in (("empty", ([], [])), ("short", (np.ones(30), [])), ("window", (np.ones(4500), np.ones(9)))):
        figure = FIGURES[name](make_run(*phases, folder=folder))
        assert figure is None or save(figure, tmp_path, name)[0].stat().st_size
    assert (name == "figure3") == (FIGURES[name](load_run(tmp_path / "empty")) is not None)


def test_everything_is_saved_that_there_is(rich_copy: Any) -> None:
    """One PNG and one SVG each, in figures/; pictures make a filmstrip."""
    shots = [Shot(900, np.zeros((24, 32, 3), np.uint8))]
    files = save_figures(rich_copy, shots)
    assert set(files) == {*FIGURES, "filmstrip"}
    names = {path.name for path in (rich_copy.path / "figures").iterdir()}
    assert names == {f"{name}.{kind}" for name in files for kind in ("png", "svg")}


def test_a_figure_that_is_broken_off_leaves_the_old_one(rich_run: Any, tmp_path: Path, monkeypatch: Any) -> None:
    """Whole or not at all: an error in mid-file keeps the bytes that were there, and nothing else is left."""
    figure = FIGURES["figure4"](rich_run)
    assert figure is not None
    old = save(figure, tmp_path, "figure4")[0].read_bytes()

    def half(target: Any, **_: Any) -> None:
        with target if hasattr(target, "write") else Path(target).open("wb") as file:
            file.write(b"half")
            raise RuntimeError("out of ink")

    monkeypatch.setattr(figure, "savefig", half)
    with pytest.raises(RuntimeError, match="out of ink"):
        save(figure, tmp_path, "figure4")
    assert (tmp_path / "figure4.png").read_bytes() == old
    assert {path.name for path in tmp_path.iterdir()} == {"figure4.png", "figure4.svg"}


def test_distortion_curves_are_the_series(rich_run: Any) -> None:
    """Figures 4 and 5 draw the moving means of their own map."""
    for name, side in (("figure4", "arm"), ("figure5", "head")):
        figure = FIGURES[name](rich_run)
        assert figure is not None
        drawn = figure.axes[0].get_lines()[0]
        at, means = distortion(rich_run, side, every=60)
        np.testing.assert_allclose(drawn.get_xydata(), np.column_stack([at, means]))
        assert "damage" in words(figure)


def test_efficiency_stands_between_controls_and_ceiling(rich_run: Any) -> None:
    """Above: shares of frames of the run, its bounds and its controls. Below: the same by the ceiling."""
    figure = FIGURES["efficiency"](rich_run)
    assert figure is not None
    top, bottom = figure.axes
    share, relative = curves(top), curves(bottom)
    shares = ceiling_shares(rich_run)
    assert shares is not None
    limit = [100 * value for phase in shares for value in [*phase, np.nan]]
    np.testing.assert_allclose(share["ceiling"], limit)
    np.testing.assert_allclose(share["reactive bound"], 0.9 * np.array(limit))
    for name in ("this run (geometric eye)", "frozen (geometric eye)", "random (geometric eye)"):
        np.testing.assert_allclose(relative[name] * limit / 100, share[name])
    assert share["this run (geometric eye)"].shape == (5 + 1 + 4 + 1,)


def test_without_a_ceiling_the_figure_says_why(twinless_run: Any) -> None:
    """Shares of frames stand alone, with the reason; a motion that the body does not have is not named."""
    figure = FIGURES["efficiency"](twinless_run)
    assert figure is not None
    (axes,) = figure.axes
    assert set(curves(axes)) >= {"this run (geometric eye)", "frozen (geometric eye)"} and "ceiling" not in curves(axes)
    text = words(figure)
    assert "There is no ceiling, because the body has no model of itself." in text
    assert "hebbian learner, geometric eye, seed 7" in text and "possible" not in text


@pytest.mark.parametrize(("unit", "label"), [("rad", "(rad)"), ("1", "(1 = a joint’s whole range)")])
def test_distortion_is_labelled_in_its_unit(make_run: Any, unit: str, label: str) -> None:
    """The axis names it; the paper's band is drawn only where it means the same."""
    columns = {f"{side}_distance": (np.full(5000, 0.02), {"unit": unit}) for side in ("arm", "head")}
    run = make_run(np.ones(5000), distances=columns)
    for name in ("figure4", "figure5"):
        figure = FIGURES[name](run)
        assert figure is not None and figure.axes[0].get_ylabel().endswith(label)
        assert ("the paper's run" in words(figure)) == (unit == "1" and name == "figure5")


def test_maps_that_are_not_the_papers_are_left_out(other_maps: Any) -> None:
    """No Figure 2, and no error."""
    assert FIGURES["figure2"](other_maps) is None


def test_maps_show_every_unit_and_the_strongest_links(rich_run: Any) -> None:
    """Figure 2: all units of both maps in lattice space, and one line for each arm unit that has links."""
    figure = FIGURES["figure2"](rich_run)
    assert figure is not None
    lattice = figure.subfigs[0].axes[0]
    units = [len(found.get_offsets()) for found in lattice.collections if hasattr(found, "get_sizes")]
    pre, *_ = load_snapshot(rich_run.snapshots[4]).gaze_links()
    assert sorted(n for n in units if n) == sorted(n for n in (20 - len(pre), len(pre), 12) if n)
    assert len(lattice.collections[-1].get_segments()) == len(pre)
    assert "after 25 min" in words(figure)


def test_colours_stay_apart_in_grey() -> None:
    """Lines that share a plot differ by a tenth in lightness, or in dashes."""

    def grey(color: str) -> float:
        return float(np.dot(to_rgb(color), (0.2126, 0.7152, 0.0722)))

    assert abs(grey(HITS) - grey(TREND)) > 0.1 and abs(grey(HITS) - grey(CEILING)) > 0.1
    for looks in ([dashes for _, dashes, _ in CONTROLS], [dashes for _, dashes in RUNS]):
        assert len(set(looks)) == len(looks)
    assert len({to_hex(color) for color, *_ in (*CONTROLS, *RUNS)}) >= 9


def test_filmstrip_takes_times_from_the_clock(rich_run: Any, make_run: Any) -> None:
    """Rows in the middle of the first and last five minutes of each phase; a short phase has one; none overshoots."""
    rows = filmstrip_frames(rich_run, columns=3, every=10)
    assert [row[0] for row in rows] == [2250, 22_500 - 2250, 22_500 + 2250, 40_500 - 2250]
    assert all(np.diff(row).tolist() == [10, 10] for row in rows)
    assert filmstrip_frames(make_run(np.ones(100), []), columns=9, every=10) == [[50, 60, 70, 80, 90]]


def test_a_phase_of_no_frames_is_not_filmed(rich_run: Any, idle_run: Any) -> None:
    """The same frames are chosen, and their rows are named the same."""
    assert filmstrip_frames(idle_run) == filmstrip_frames(rich_run)
    shots = [Shot(frame, np.zeros((24, 32, 3), np.uint8)) for frame in (90, 22_499, 22_500, 40_000)]
    assert words(filmstrip(idle_run, shots)) == words(filmstrip(rich_run, shots))


def test_filmstrip_shows_what_was_seen(rich_run: Any) -> None:
    """One picture a shot, in rows; each says seen or missed; tags are outlined, the hand is marked."""
    square = np.array([[[5, 5], [9, 5], [9, 9], [5, 9]]], dtype=float)
    picture = np.zeros((24, 32, 3), np.uint8)
    shots = [Shot(90, picture), Shot(98, picture, (7.0, 7.0), square), Shot(30_000, picture)]
    figure = filmstrip(rich_run, shots)
    drawn = [axes for axes in figure.axes if axes.get_images()]
    assert [len(axes.get_lines()) for axes in drawn] == [0, 2, 0]
    text = words(figure)
    assert text.count("missed") == 2 and text.count("seen") == 1
    assert "intact, 0 min 06.0 s" in text and "damaged, 33 min 20.0 s" in text
    with pytest.raises(ValueError, match="at least one picture"):
        filmstrip(rich_run, [])


def test_a_name_is_no_formula(tmp_path: Path) -> None:
    """A phase or a robot may be called what would be a broken one; it is drawn as it is."""
    name = r"$\frac{a$"
    with style():
        figure = Figure(figsize=(2, 1))
        figure.suptitle(name)
    png, svg = save(figure, tmp_path, "named")
    assert png.stat().st_size > 0 and f"<!-- {name} -->" in svg.read_text(encoding="utf-8")
