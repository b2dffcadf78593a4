"""Broken folders, where what is wrong is named in one line; and strange ones, which are reported all the same."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from somatopy.analysis.figures import FIGURES, save
from somatopy.analysis.report import write_report
from somatopy.analysis.runs import RunFolderError, load_run
from somatopy.analysis.summary import write_summary

Break = Callable[[Path], Any]


def report(folder: Path) -> str:
    """Everything that is made of a folder: summary, figures, page. To save time only one figure is written."""
    run = load_run(folder)
    write_summary(run)
    figures = {name: draw(run) for name, draw in FIGURES.items()}
    assert figures["figure3"] is not None
    save(figures["figure3"], folder / "figures", "figure3")
    return write_report([folder]).read_text(encoding="utf-8")


def described(old: str, new: str) -> Break:
    """Another description."""

    def edit(folder: Path) -> None:
        text = (folder / "experiment.toml").read_text(encoding="utf-8")
        assert old in text
        (folder / "experiment.toml").write_text(text.replace(old, new), encoding="utf-8")

    return edit


def column(name: str, make: Callable[[int], Any] | None, part: int | None = None) -> Break:
    """Other values in a column, new or old, or none; in every part of frames/, or in one."""

    def edit(folder: Path) -> None:
        for path in sorted((folder / "frames").glob("*.parquet"))[slice(part, part and part + 1)]:
            table = pq.read_table(path)
            if name in table.column_names:
                table = table.drop_columns([name])
            pq.write_table(table.append_column(name, make(table.num_rows)) if make else table, path)

    return edit


def written(name: str, content: Any) -> Break:
    """A file with other content."""
    text = content if isinstance(content, str) else json.dumps(content)

    def edit(folder: Path) -> None:
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")

    return edit


def ceiling(**changed: Any) -> Break:
    def edit(folder: Path) -> None:
        table = json.loads((folder / "ceiling.json").read_text(encoding="utf-8"))
        (folder / "ceiling.json").write_text(json.dumps(table | changed), encoding="utf-8")

    return edit


def words(n: int) -> Any:
    return pa.array(["x"] * n)


def full(value: float) -> Callable[[int], Any]:
    return lambda n: pa.array(np.full(n, value))


def arrays(name: str, **changed: Any) -> Break:
    """Arrays of a file, others than before; None takes one away."""

    def change(folder: Path) -> None:
        with np.load(folder / name) as file:
            kept = {key: value for key, value in {**file, **changed}.items() if value is not None}
        np.savez(folder / name, **kept)

    return change


def torn(name: str) -> Break:
    """The same arrays, compressed as a run writes them, and the first of them so that it cannot be unpacked."""

    def change(folder: Path) -> None:
        with np.load(folder / name) as file:
            np.savez_compressed(folder / name, **file)
        content = bytearray((folder / name).read_bytes())
        content[30 + int.from_bytes(content[26:28], "little") + int.from_bytes(content[28:30], "little")] = 0xFF
        (folder / name).write_bytes(content)

    return change


BROKEN: dict[str, tuple[Break, str]] = {
    "phases are no tables": (described("[[phases]]", "[[stages]]\n[[phases.old]]"), "phases in .* must be a list"),
    "breaks in disorder": (described("[1]", "[3, 1]"), r"phases\.1\.trend_breaks = \[3, 1\] in .* must be"),
    "breaks are words": (described("[1]", '["a"]'), r"phases\.1\.trend_breaks = \['a'\] in .* must be"),
    "frames are a word": (described("frames = 13500", 'frames = "many"'), r"phases\.0\.frames = 'many' in .* must be"),
    "an eye of no kind": (described('"geometric"', "3"), r"eye\.kind = 3 in .* must be a text"),
    "a body of no kind": (described('kind = "mujoco"\n', ""), r"\[body\] in .* lacks 'kind'"),
    "no seed": (described("seed = 7\n", ""), "experiment.toml lacks 'seed'"),
    "hits are words": (column("hit", words), "The column 'hit' in .* must hold a number in every frame"),
    "hits are missing": (column("hit", lambda n: pa.nulls(n, pa.bool_())), "The column 'hit' in .* must hold a number"),
    "distances are words": (column("arm_distance", words), "The column 'arm_distance' in .* must hold a number"),
    "no column of hits": (column("hit", None), r"part-00000\.parquet has no column 'hit'"),
    "parts of two runs": (column("arm_distance", words, part=2), "do not belong to one run"),
    "frames of a phase unknown": (column("phase", full(9)), r"have the phases \[9.*\], and .* describes 2"),
    "phases in disorder": (column("phase", lambda n: pa.array(np.arange(n) % 2)), "which follow each other from 0"),
    "a ceiling that is a list": (written("ceiling.json", [1]), "ceiling.json holds no JSON object. Delete it"),
    "a cost that is a number": (written("cost.json", 3), "cost.json holds no JSON object. Delete it"),
    "a ceiling in words": (ceiling(rate="high"), "ceiling.json cannot be used .*'high' is no share of frames"),
    "a ceiling above all": (ceiling(rate=1.5), "ceiling.json cannot be used .*1.5 is no share of frames"),
    "a ceiling that is not a number": (ceiling(rate=float("nan")), "ceiling.json cannot be used .*nan is no share"),
    "a bound in words": (ceiling(reactive=[1]), "ceiling.json cannot be used"),
    "a ceiling in words over time": (
        ceiling(phases=[{"rate": 0.5, "per_window": [], "per_ten_seconds": ["high"]}] * 2),
        "ceiling.json cannot be used .*'high' is no share of frames",
    ),
    "half a map": (written("maps/window-00002.npz", "PK"), r"window-00002\.npz is damaged .*Delete it"),
    "half a belief": (written("belief.npz", "PK"), r"belief\.npz is damaged .*Delete it"),
    "a belief with a bit that was flipped": (torn("belief.npz"), r"belief\.npz is damaged .*Delete it"),
    "a map with a bit that was flipped": (torn("maps/window-00002.npz"), r"window-00002\.npz is damaged .*Delete it"),
    "beliefs of other postures": (arrays("belief.npz", arms=np.zeros((3, 4))), r"belief\.npz cannot be used .*not fit"),
    "beliefs of no time": (arrays("belief.npz", frame=None), r"belief\.npz lacks 'frame'"),
    "beliefs in a phase unknown": (arrays("belief.npz", phase=np.full(6, 9)), r"belief\.npz cannot be used"),
    "half a sight": (written("sight.npz", "PK"), r"sight\.npz is damaged .*Delete it"),
    "sights of another run": (arrays("sight.npz", frame=np.full(1800, 10**6)), r"sight\.npz .*tells of frame 1000000"),
    "sights of no gazes": (arrays("sight.npz", gazes=None), r"sight\.npz lacks 'gazes'"),
    "half a picture": (written("figures/filmstrip.png", "half"), r"filmstrip\.png is no whole picture .*Delete it"),
    "a file in the place of figures": (written("figures", ""), "figures cannot be written"),
    "a folder in the place of the page": (lambda f: (f / "report.html").mkdir(), r"report\.html cannot be written"),
    "a folder in the place of the summary": (lambda f: (f / "summary.json").mkdir(), "summary.json cannot be written"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_what_is_wrong_is_named(rich_copy: Any, name: str) -> None:
    """One line that names the file, column or key; never an error of some inner part."""
    damage, told = BROKEN[name]
    damage(rich_copy.path)
    with pytest.raises(RunFolderError, match=told) as caught:
        report(rich_copy.path)
    assert "\n" not in str(caught.value)


STRANGE: dict[str, Break] = {
    "a learner without probes": lambda f: [column(f"{side}_distance", None)(f) for side in ("arm", "head")],
    "probes of its own": lambda f: [column(n, lambda k: pa.array(np.arange(k) % 3))(f) for n in ("surprise", "<b> &")],
    "truth values for distances": column("arm_distance", lambda n: pa.array(np.arange(n) % 2 == 0)),
    "whole numbers for distances": column("head_distance", lambda n: pa.array(np.arange(n))),
    "distances that were never known": column("arm_distance", full(np.nan)),
    "distances without end": column("head_distance", full(np.inf)),
    "distances of nothing": column("head_distance", lambda n: pa.nulls(n, pa.float64())),
    "distances below 0": column("arm_distance", full(-1.0)),
    "a hand that nobody knows": column("gaze_error_rad", full(np.nan)),
    "a joint that was never sensed": column("arm.ElbowYaw", full(np.nan)),
    "one joint": lambda f: [column(f"arm.{name}", None)(f) for name in ("ShoulderRoll", "ElbowYaw", "ElbowRoll")],
    "no postures of the arm": lambda f: [
        column(f"arm.{name}", None)(f) for name in ("ShoulderPitch", "ShoulderRoll", "ElbowYaw", "ElbowRoll")
    ],
    "nothing was possible": ceiling(rate=0, phases=[{"rate": 0.0, "per_window": [0.0] * 3}] * 2),
    "fewer windows under the ceiling": ceiling(phases=[{"rate": 0.5, "per_window": [0.5]}]),
    "costs in words": written("cost.json", {"wall_s": "long", "frames": None}),
    "one thing to cite": described('["A <paper> & co."]', '"a paper"'),
    "versions in words": described('[versions]\nsomatopy = "1.2.3"\n', ""),
    "a control of fewer phases": lambda f: _shorten(f / "controls" / "random"),
}


def _shorten(control: Path) -> None:
    first, phase, _ = (control / "experiment.toml").read_text(encoding="utf-8").split("[[phases]]")
    (control / "experiment.toml").write_text(f"{first}[[phases]]{phase}", encoding="utf-8")
    column("phase", full(0))(control)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", STRANGE)
def test_what_is_only_strange_is_reported(rich_copy: Any, name: str) -> None:
    """Summary, figures and page are made, without a warning; verdicts are there."""
    STRANGE[name](rich_copy.path)
    page = report(rich_copy.path)
    assert "cannot tell" in page and (rich_copy.path / "figures" / "figure3.png").is_file()


def test_who_wrote_a_run_is_told_apart_from_what_was_run(rich_copy: Any) -> None:
    """Versions, commit, Python and platform, of whoever began and of whoever went on; not among the settings."""
    author = '[written_by]\ncommit = "abc"\n[[resumed]]\nframe = 4500\n[resumed.versions]\nsomatopy = "1.3"\n'
    with (rich_copy.path / "experiment.toml").open("a", encoding="utf-8") as file:
        file.write(author)
    page = report(rich_copy.path)
    assert "Written by: somatopy 1.2.3, commit abc." in page
    assert "Written by: from frame 4500 on, somatopy 1.3." in page
    assert "<code>written_by" not in page and "<code>resumed" not in page and "<code>format" not in page
