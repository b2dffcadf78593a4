"""The rows of a run in the table of cells: held against its summary, its frames and what is put in."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow
import pyarrow.parquet as pq
import pytest
import tomli_w

from somatopy.analysis.cells import (
    CELLS,
    COLUMNS,
    COSTS,
    FAILURES,
    JOURNAL,
    STUDY,
    load_study,
    measures,
    to_table,
)
from somatopy.analysis.runs import Run, RunFolderError
from somatopy.analysis.summary import summarise

MakeRun = Callable[..., Run]
Change = Callable[[pyarrow.Table], pyarrow.Table]
#: Columns that only a study can fill.
OF_A_STUDY = {"key", "description", "code", "condition"}


@pytest.fixture
def run(make_run: MakeRun, hits_with_counts: Callable[..., Any]) -> Run:
    """Hits on lines that are known: 1000, 1100, ... a window intact, then 900, 800, 700 and 300, 400, 500, 600."""
    intact = hits_with_counts([1000 + 100 * k for k in range(4)], rest=900)
    damaged = hits_with_counts([900, 800, 700, 300, 400, 500, 600])
    n = len(intact) + len(damaged)
    rng = np.random.default_rng(0)
    distances = {f"{side}_distance": rng.uniform(0, 0.1, n) for side in ("arm", "head")}
    errors = np.where(np.arange(n) < len(intact), 0.1, 0.3)
    errors[:5] = np.nan
    return make_run(intact, damaged, breaks=(3,), distances={**distances, "gaze_error_rad": errors})


def test_rows_agree_with_the_summary(run: Run) -> None:
    """Phase by phase, and every column is filled but those of the study."""
    rows, summary = measures(run), summarise(run)
    assert len(rows) == len(summary["phases"]) == 2
    for k, (row, phase) in enumerate(zip(rows, summary["phases"], strict=True)):
        assert {*row} == {column.name for column in COLUMNS} - OF_A_STUDY
        assert row["phase"] == k and row["seed"] == summary["seed"] and row["learner"] == summary["learner"]
        assert {name: row[name] for name in ("damage", "frames", "hits", "rate", "hits_per_window")} == {
            name: phase[name] for name in ("damage", "frames", "hits", "rate", "hits_per_window")
        }
        for side in ("arm", "head"):
            marks = phase[f"{side}_distortion"]
            assert {mark: row[f"{side}_distortion_{mark}"] for mark in marks} == marks
    assert [row["damage"] for row in rows] == ["none", "offset"]
    assert [row["ceiling"] for row in rows] == [None, None] == [row["efficiency"] for row in rows]


def test_lines_are_those_that_were_put_in(run: Run) -> None:
    """Slope and intercept in hits a window; start and end of each line as rates."""
    intact, damaged = measures(run)
    assert intact["slopes"] == pytest.approx([100]) and damaged["slopes"] == pytest.approx([-100, 100])
    assert intact["intercepts"] == pytest.approx([1000])
    assert intact["line_starts"] == pytest.approx([1000 / 4500])
    assert intact["line_ends"] == pytest.approx([1300 / 4500])
    assert damaged["line_starts"] == pytest.approx([900 / 4500, 300 / 4500])
    assert damaged["line_ends"] == pytest.approx([700 / 4500, 600 / 4500])


def test_curves_have_a_point_a_minute(run: Run) -> None:
    """The mean of the last 1,800 inputs at the end of each full minute; the last point is the value at the end."""
    distances = run.values("arm_distance")
    for row, start in zip(measures(run), (0, 18_900), strict=True):
        curve = row["arm_distortion"]
        assert len(curve) == row["frames"] // 900
        for minute, value in enumerate(curve):
            end = start + 900 * (minute + 1)
            expected = distances[end - 1800 : end].mean() if end >= 1800 else None
            assert value == (None if expected is None else pytest.approx(expected, rel=1e-6))
        assert curve[-1] == pytest.approx(row["arm_distortion_end"], rel=1e-6)


def test_angles_are_medians_of_what_is_known(run: Run, make_run: MakeRun) -> None:
    """In degrees; null where nothing is known."""
    assert [row["gaze_error_deg"] for row in measures(run)] == pytest.approx(np.degrees([0.1, 0.3]))
    (row,) = measures(make_run([True, False], folder="bare"))
    assert row["gaze_error_deg"] is None and row["arm_distortion"] == [] and row["arm_distortion_end"] is None
    assert row["slopes"] == [None] and row["line_ends"] == [None] and row["hits_per_window"] == []


def test_efficiency_is_rate_over_ceiling(rich_run: Run) -> None:
    """Where the ceiling is known, in each phase and window."""
    for row in measures(rich_run):
        assert row["ceiling"] == 0.5 and row["reactive"] == 0.45
        assert row["efficiency"] == pytest.approx(row["rate"] / 0.5)
        assert row["ceiling_per_window"] == [0.5] * (row["frames"] // 4500)


# -- the table ---------------------------------------------------------------------------------------------------------


def rows_of(run: Run, condition: str, seed: int) -> list[dict[str, Any]]:
    names = {"key": condition, "description": "d", "code": "c", "condition": condition}
    return [{"factor": 1.5, **names, **row, "seed": seed} for row in measures(run)]


@pytest.fixture
def folder(run: Run, tmp_path: Path) -> Path:
    """A study folder with two conditions and two seeds, written in no order."""
    path = tmp_path / "study"
    path.mkdir()
    rows = [row for name in ("b", "a") for seed in (2, 1) for row in rows_of(run, name, seed)]
    pq.write_table(to_table(rows), path / CELLS)
    conditions = {name: {"seeds": [1, 2], "factors": {"factor": 1.5}} for name in ("b", "a")}
    table = {"name": "s", "order": ["b", "a"], "conditions": conditions}
    (path / STUDY).write_text(tomli_w.dumps(table), encoding="utf-8")
    return path


def test_the_table_is_sorted_and_has_all_columns(folder: Path) -> None:
    """Columns of a study's own first; condition, seed and phase ascend."""
    table = load_study(folder).table
    assert table.column_names == ["factor", *(column.name for column in (*COLUMNS, *COSTS))]
    order = [(row["condition"], row["seed"], row["phase"]) for row in table.to_pylist()]
    assert order == sorted(order) and len(order) == 8
    assert to_table([]).column_names == table.column_names[1:]


def test_values_by_seed(folder: Path, run: Run) -> None:
    """A number, or an entry of a list; what is not known is left out."""
    result = load_study(folder)
    rate = measures(run)[1]["rate"]
    assert result.values("a", "rate", 1) == {1: rate, 2: rate}
    assert [*result.values("a", "rate")] == [1, 2] and result.values("a", "ceiling") == {}
    assert result.values("a", "slopes", 1, place=-1) == pytest.approx({1: 100, 2: 100})
    assert result.values("a", "slopes", 1, place=2) == {} == result.values("nobody", "rate")
    assert result.conditions == ["b", "a"] and result.factors == {"b": {"factor": 1.5}, "a": {"factor": 1.5}}
    with pytest.raises(RunFolderError, match=r"The table has no column 'speed'. Its columns: \['factor', 'key'"):
        result.values("a", "speed")


def without(name: str) -> Change:
    return lambda table: table.drop_columns([name])


def with_words(name: str) -> Change:
    return lambda table: table.set_column(
        table.column_names.index(name), name, pyarrow.array(["many"] * table.num_rows)
    )


ROW = {"key": "k", "condition": "a", "seed": 9, "phase": 0, "frames": 900}
#: What stands in a file of a study folder, and what is said of it.
BROKEN: list[tuple[str, bytes | Change, str]] = [
    (STUDY, b"=", "Restore it"),
    (STUDY, b"\xff", "Restore it"),
    (STUDY, b"", "does not name the conditions of a study, each with its factors"),
    (STUDY, b"[conditions.a]\nseeds = [0]", "does not name the conditions"),
    (STUDY, b"order = [1]\n[conditions]", "does not name the conditions"),
    (FAILURES, b"{", "Delete it"),
    (FAILURES, b"{}", "is no list of cells, each with its condition, seed, cause"),
    (FAILURES, b"[5]", "is no list of cells"),
    (CELLS, b"x", "move it away: the study then runs its cells again"),
    (CELLS, b"", "move it away"),
    *((CELLS, without(name), f"column '{name}' is missing") for name in ("key", "seed", "phase", "frames")),
    (CELLS, with_words("rate"), "column 'rate' holds string in place of double"),
    (CELLS, with_words("hits_per_minute"), "column 'hits_per_minute' holds string in place of list"),
    *((JOURNAL, line + b"\n", "line 1 holds no rows") for line in (b"5", b"[]", b"[5]", b'[{"condition": "a"}]', b"[")),
    (JOURNAL, json.dumps([ROW | {"hits": "many"}]).encode() + b"\n", "Delete the lines"),
]


@pytest.mark.parametrize(("name", "content", "told"), BROKEN)
def test_a_study_folder_that_cannot_be_read(folder: Path, name: str, content: bytes | Change, told: str) -> None:
    """One sentence, whichever file is broken: its name, what is wrong with it, and what to do."""
    file = folder / name
    if callable(content):
        pq.write_table(content(pq.read_table(file)), file)
    else:
        file.write_bytes(content)
    with pytest.raises(RunFolderError, match=told) as caught:
        load_study(folder)
    assert str(caught.value).startswith(f"{file} cannot be read (") and "\n" not in str(caught.value)


def test_folders_in_the_place_of_files_and_rows_that_stand_twice(folder: Path) -> None:
    """The first are named, the second count once."""
    table = load_study(folder).table
    pq.write_table(pyarrow.concat_tables([table, table]), folder / CELLS)
    (folder / JOURNAL).write_text(f"{json.dumps([ROW])}\n" * 2)
    rows = load_study(folder).table.to_pylist()
    assert len(rows) == table.num_rows + 1 and [row for row in rows if row["key"] != "k"] == table.to_pylist()
    for name in (CELLS, JOURNAL, FAILURES):
        (folder / name).unlink(missing_ok=True)
        (folder / name).mkdir()
        with pytest.raises(RunFolderError, match=rf"{name} cannot be read \(.*Is a directory"):
            load_study(folder)
        (folder / name).rmdir()
