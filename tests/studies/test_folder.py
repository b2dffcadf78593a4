"""The study folder: no finished cell is lost, whatever is torn, and nobody else's folder is touched."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from somatopy.analysis.cells import CELLS, COLUMNS, COSTS, load_study, to_table
from somatopy.analysis.runs import RunFolderError
from somatopy.experiment import DescriptionError
from somatopy.studies import Condition, Study
from somatopy.studies.folder import OTHERS, StudyFolder
from somatopy.studies.plan import Cell

#: A value for each type of column.
VALUES = {"string": "x", "int": 3, "float": 0.25, "list of int": [1, 2], "list of float": [0.5, None]}


def rows_of(cell: Cell) -> list[dict[str, Any]]:
    """Two phases, each with a value in every column that a worker fills."""
    ours = ("key", "description", "code", "condition")
    row = {column.name: VALUES[column.type] for column in (*COLUMNS, *COSTS) if column.name not in ours}
    return [{**row, "seed": cell.seed, "phase": phase} for phase in (0, 1)]


@pytest.fixture
def study(described: Any) -> Study:
    """Two conditions, of which one is described like the first, under two seeds."""
    one, other = described(), described(babbling__speed=0.5)
    factors = [{"speed": 1, "mixed": 0.5, "of": [8, 8]}, {"speed": 0.5, "mixed": "none", "of": [4, 4]}]
    conditions = (("a", one, factors[0]), ("b", other, factors[1]), ("a again", one, factors[0]))
    return Study("s", tuple(Condition(name, each, (0, 1), said) for name, each, said in conditions))


def fill(folder: Path, study: Study, cells: list[Cell]) -> None:
    opened = StudyFolder(folder, study.name)
    with opened.opened(study):
        for cell in cells:
            opened.append(cell, rows_of(cell))


def seen(folder: Path) -> set[tuple[str, int, int]]:
    table = load_study(folder).table.to_pylist()
    assert len({(row["condition"], row["seed"], row["phase"]) for row in table}) == len(table)
    return {(row["condition"], row["seed"], row["phase"]) for row in table}


def finished(folder: Path, study: Study) -> set[str]:
    with StudyFolder(folder, study.name).opened(study) as rows:
        assert all([row["phase"] for row in each] == [0, 1] for each in rows.values())
        return set(rows)


def test_rows_come_back_as_they_went(tmp_path: Path, study: Study) -> None:
    """Every column, under every name; factors with numbers and texts become text, lists JSON."""
    fill(tmp_path, study, study.cells()[:1])
    result = load_study(tmp_path)
    assert [row["condition"] for row in result.table.to_pylist()] == ["a", "a", "a again", "a again"]
    for row, expected in zip(result.table.to_pylist(), rows_of(study.cells()[0]), strict=False):
        assert {name: row[name] for name in expected} == expected
    fill(tmp_path, study, study.cells()[1:2])
    rows = load_study(tmp_path).table.to_pylist()
    said = {(row["condition"], row["speed"], row["mixed"], row["of"]) for row in rows if row["condition"] != "a again"}
    assert said == {("a", 1.0, "0.5", "[8, 8]"), ("b", 0.5, "none", "[4, 4]")}
    assert load_study(tmp_path).factors["b"]["mixed"] == "none" and result.conditions == ["a", "a again"]


def test_a_table_of_an_older_version_is_whole(tmp_path: Path, study: Study) -> None:
    """Columns that it does not have are null, and the cells in it are finished."""
    cell = study.cells()[0]
    fill(tmp_path, study, [cell])
    whole = load_study(tmp_path).table
    pq.write_table(pq.read_table(tmp_path / CELLS).drop_columns(["dip", "hits_per_minute"]), tmp_path / CELLS)
    older = load_study(tmp_path)
    assert {*older.table.column_names} == {*whole.column_names} and older.table.schema.field("dip").type == "double"
    assert older.values("a", "dip") == {} == older.values("a", "hits_per_minute", place=0)
    assert finished(tmp_path, study) == {cell.key} and load_study(tmp_path).table.column_names == whole.column_names


def test_table_and_journal_are_one(tmp_path: Path, study: Study) -> None:
    """What stood in either is finished; a line that was torn off is not."""
    first, second, third = list({cell.key: cell for cell in study.cells()}.values())[:3]
    fill(tmp_path, study, [first])
    opened = StudyFolder(tmp_path, study.name)
    with pytest.raises(OSError, match="gone"), opened.opened(study):
        opened.append(second, rows_of(second))
        opened.append(third, rows_of(third))
        kept = (tmp_path / "journal.jsonl").read_bytes()
        opened._write_tables = lambda study: (_ for _ in ()).throw(OSError("gone"))  # type: ignore[method-assign]
    assert (tmp_path / "journal.jsonl").read_bytes() == kept
    (tmp_path / "journal.jsonl").write_bytes(kept[:-20])
    assert finished(tmp_path, study) == {first.key, second.key}
    assert not (tmp_path / "journal.jsonl").exists()


def test_a_study_under_way_can_be_read(tmp_path: Path, study: Study) -> None:
    """Cells that have ended are in its table, with their names and factors, each once; also after a kill."""
    first, second = study.cells()[1], study.cells()[4]
    fill(tmp_path, study, [first])
    opened = StudyFolder(tmp_path, study.name)
    with opened.opened(study):
        opened.append(second, rows_of(second))
        under_way = seen(tmp_path)
        named = {(row["condition"], row["seed"], row["mixed"]) for row in load_study(tmp_path).table.to_pylist()}
        killed = (tmp_path / "journal.jsonl").read_bytes()
    assert under_way == seen(tmp_path) == {("b", seed, phase) for seed in (0, 1) for phase in (0, 1)}
    assert named == {("b", 0, "none"), ("b", 1, "none")}
    (tmp_path / "journal.jsonl").write_bytes(killed + b'[{"torn')
    assert seen(tmp_path) == under_way
    (tmp_path / "journal.jsonl").write_bytes(b"no json\n")
    with pytest.raises(RunFolderError, match="cannot be read"):
        load_study(tmp_path)


def test_rows_of_another_study_are_kept_apart(tmp_path: Path, study: Study, described: Any) -> None:
    """And come back with it; also if the process ends between the writing of two files."""
    cell, foreign = study.cells()[0], Study("t", (Condition("t", described(minutes=2), (0,)),))
    fill(tmp_path, study, [cell])
    for stop_at in (OTHERS, CELLS):
        opened = StudyFolder(tmp_path, foreign.name)
        write = opened._write

        def stopping(name: str, rows: Any, write: Any = write, stop_at: str = stop_at) -> None:
            write(name, rows)
            if name == stop_at:
                raise OSError("gone")

        opened._write = stopping  # type: ignore[method-assign]
        with pytest.raises(OSError, match="gone"), opened.opened(foreign):
            pass
        assert finished(tmp_path, foreign) == {cell.key}
    assert seen(tmp_path) == set() and pq.read_table(tmp_path / OTHERS).num_rows == 2
    assert finished(tmp_path, study) == {cell.key}
    assert ("a", 0, 1) in seen(tmp_path) and pq.read_table(tmp_path / OTHERS).num_rows == 0


def test_a_broken_table_is_one_sentence(tmp_path: Path, study: Study) -> None:
    """Nothing is overwritten."""
    fill(tmp_path, study, study.cells()[:1])
    for content in (b"no parquet", b""):
        (tmp_path / CELLS).write_bytes(content)
        with pytest.raises(DescriptionError) as caught:
            finished(tmp_path, study)
        assert str(caught.value).startswith(f"{tmp_path / CELLS} cannot be read (") and "\n" not in str(caught.value)
        assert str(caught.value).endswith("or move it away: the study then runs all its cells again.")
        assert (tmp_path / CELLS).read_bytes() == content
        with pytest.raises(RunFolderError, match="cannot be read"):
            load_study(tmp_path)
    pq.write_table(to_table([]).drop_columns(["hits"]), tmp_path / CELLS)
    pq.write_table(pq.read_table(tmp_path / CELLS).append_column("more", [[]]), tmp_path / CELLS)
    assert finished(tmp_path, study) == set()


def test_a_journal_with_a_broken_line_is_one_sentence(tmp_path: Path, study: Study) -> None:
    """A whole line that is no JSON was not torn: somebody wrote it."""
    fill(tmp_path, study, [])
    (tmp_path / "journal.jsonl").write_text("no json\n", encoding="utf-8")
    with pytest.raises(DescriptionError, match=r"journal.jsonl cannot be read \(line 1 .*delete that line: its cell"):
        finished(tmp_path, study)


def test_other_folders_are_refused(tmp_path: Path, study: Study) -> None:
    """One with something else in it, and a file."""
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "thesis.tex").touch()
    with pytest.raises(DescriptionError, match=r"full is not empty and holds no study. Name another with --out"):
        StudyFolder(tmp_path / "full", "s")
    with pytest.raises(DescriptionError, match=r"Cannot write to the study folder .*thesis.tex: File exists."):
        StudyFolder(tmp_path / "full" / "thesis.tex", "s")
    with pytest.raises(RunFolderError, match=r"full is not a study folder: it holds no study.toml."):
        load_study(tmp_path / "full")


@pytest.mark.parametrize(
    ("name", "said"),
    [("speeds", "speeds"), ("Größe/ü vergleich", "Größe-ü-vergleich"), ("../..", "study"), ("x" * 300, "x" * 100)],
)
def test_a_name_is_one_word_of_a_path(name: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No folders within each other, whatever a study is called."""
    monkeypatch.chdir(tmp_path)
    path = StudyFolder(None, name).path
    assert path.parent == Path("runs") and path.name.partition("_")[2] == said and path.is_dir()


def test_one_study_at_a_time(tmp_path: Path, study: Study) -> None:
    """The second one is refused and changes nothing; once the first has ended, it may."""
    with StudyFolder(tmp_path, "s").opened(study):
        with pytest.raises(DescriptionError, match=r"Another study is running in .* Wait for it, or end it."):
            finished(tmp_path, study)
        assert (tmp_path / "journal.jsonl").exists()
    assert finished(tmp_path, study) == set()


def test_failures_are_kept(tmp_path: Path, study: Study) -> None:
    """As they were said."""
    said = [{"condition": "a", "seed": 0, "key": "k", "cause": "c"}]
    folder = StudyFolder(tmp_path, "s")
    with folder.opened(study):
        folder.write_failures(said)
    assert load_study(tmp_path).failures == said == json.loads((tmp_path / "failures.json").read_text())
