"""Whether a study folder holds what today's code gives: stale cells, unfinished ones, a sample run again."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from somatopy.analysis.cells import CELLS
from somatopy.experiment import DescriptionError
from somatopy.studies import Condition, Study
from somatopy.studies.driver import perform
from somatopy.studies.recheck import SAMPLE, _apart, recheck


@pytest.fixture(scope="module")
def study(described: Callable[..., Any]) -> Study:
    """Four cells, of which two are short, and a name for one of them more."""
    short = described(minutes=0.4, damage_minutes=0.2)
    ones = {"long": described(), "short": short, "again": short}
    return Study("s", tuple(Condition(name, one, (0, 1)) for name, one in ones.items()), ceilings=False)


@pytest.fixture(scope="module")
def folder(study: Study, tmp_path_factory: pytest.TempPathFactory, in_process: Any) -> Path:
    """It has run, except for its long cell with seed 1."""
    path = tmp_path_factory.mktemp("recheck") / "s"
    partly = Study(
        "s", (Condition("long", study.conditions[0].experiment, (0,)), *study.conditions[1:]), ceilings=False
    )
    perform(partly, path, progress=False, backend=in_process)
    return path


@pytest.fixture(autouse=True)
def here(monkeypatch: pytest.MonkeyPatch, in_process: Any) -> None:
    """What runs again runs in this process."""
    monkeypatch.setattr("somatopy.studies.recheck.Local", in_process)


def digests(folder: Path) -> dict[str, str]:
    return {str(file): hashlib.sha256(file.read_bytes()).hexdigest() for file in folder.rglob("*") if file.is_file()}


def tampered(folder: Path, target: Path, edit: Callable[[dict[str, Any]], None]) -> Path:
    """A copy of the folder, some rows of whose table are edited."""
    target.mkdir()
    rows = pq.read_table(folder / CELLS).to_pylist()
    for row in rows:
        edit(row)
    pq.write_table(pa.Table.from_pylist(rows, pq.read_schema(folder / CELLS)), target / CELLS)
    return target


def test_the_same_code_gives_the_same(study: Study, folder: Path) -> None:
    """In one piece, too, what was forked from a shared phase; the shortest run again, once each."""
    before = digests(folder)
    found = recheck(study, folder)
    assert found.equal and found.stale == [] and found.unfinished == [("long", 1)]
    ran = [(rerun.condition, rerun.seed) for rerun in found.reruns]
    assert len(ran) == SAMPLE == 3 and {*ran[:2]} == {("again", 0), ("again", 1)} and ran[2] == ("long", 0)
    assert "unfinished: long, seed 1" in found.text() and "again, seed 0: equal bit for bit" in found.text()
    assert found.text().endswith("0 stale, 1 unfinished, 3 run again")
    assert digests(folder) == before and not (folder / "work").exists()


def test_stale_cells_come_first_and_differences_are_measured(study: Study, folder: Path, tmp_path: Path) -> None:
    """By the largest difference of each measure; what is no number on one side differs without bound."""

    def edit(row: dict[str, Any]) -> None:
        if row["condition"] == "long":
            row["key"], row["code"] = "0" * 16, "1" * 16
            if row["phase"] == 1:
                row["hits"] += 3
                row["rate"] = None

    found = recheck(study, tampered(folder, tmp_path / "t", edit))
    assert found.stale == [("long", 0)] and not found.equal
    assert (found.reruns[0].condition, found.reruns[1].equal, found.reruns[2].equal) == ("long", True, True)
    assert found.reruns[0].differs == {"hits": 3, "rate": float("inf")}
    assert "hits by up to 3" in found.text() and "stale: long, seed 0" in found.text()
    table = found.table()
    assert table["reruns"][0]["differs"] == {"hits": 3, "rate": None} and not table["equal"]
    assert table["stale"] == [{"condition": "long", "seed": 0}]


def test_older_code_that_gave_the_same(study: Study, folder: Path, tmp_path: Path) -> None:
    """Stale, and equal."""

    def edit(row: dict[str, Any]) -> None:
        row["key"], row["code"] = row["key"][::-1], "1" * 16

    found = recheck(study, tampered(folder, tmp_path / "t", edit))
    assert found.equal and len(found.stale) == 5 and len(found.reruns) == 3


def test_no_study_folder(study: Study, tmp_path: Path) -> None:
    """One sentence; the folder is not made."""
    with pytest.raises(DescriptionError, match=r"none is not the folder of a study that has run: it holds no cells"):
        recheck(study, tmp_path / "none")
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize(
    ("one", "other", "apart"),
    [
        *((1, 1, None), (1.5, 1, 0.5), ("a", "a", None), ("a", "b", float("inf")), (None, 1, float("inf"))),
        *(([1, 2], [1, 2], None), ([1, 2], [3, 1], 2), ([1], [1, 2], float("inf")), ([None, 1], [None, 3], 2)),
    ],
)
def test_how_far_values_are_apart(one: Any, other: Any, apart: float | None) -> None:
    """Either way round."""
    assert _apart(one, other) == _apart(other, one) == apart
