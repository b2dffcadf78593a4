"""The work of a cell: begun, taken up where it was left, or begun again."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import somatopy
from somatopy.analysis.cells import COSTS as TABLE_COSTS
from somatopy.api import Interrupted
from somatopy.experiment import DescriptionError, Session
from somatopy.studies.plan import Cell
from somatopy.studies.work import Task, trim, work

COSTS = {column.name for column in TABLE_COSTS}


def measured(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    assert all(row.keys() >= COSTS for row in rows)
    return [{key: value for key, value in row.items() if key not in COSTS} for row in rows]


@pytest.fixture
def cell(described: Callable[..., Any]) -> Cell:
    """One that shares its first phase."""
    return Cell("a", {}, described(), ceiling=False)


@pytest.fixture
def expected(cell: Cell, tmp_path: Path) -> list[dict[str, Any]]:
    """Its rows, run in one piece."""
    rows = work(Task.of(cell, shares_training=False, shares_movement=False), tmp_path / "alone")
    assert not list((tmp_path / "alone").iterdir())
    return measured(rows)


def stopped(task: Task, scratch: Path, at: int) -> None:
    """Begin a cell, and be interrupted in some frame of whatever runs."""
    step = Session.__next__

    def stopping(session: Session) -> Any:
        if session.done == at:
            raise KeyboardInterrupt
        return step(session)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Session, "__next__", stopping)
        with pytest.raises(Interrupted):
            work(task, scratch)


@pytest.mark.parametrize("shares", [True, False])
def test_a_cell_goes_on_wherever_it_was_stopped(shares: bool, cell: Cell, expected: list[Any], tmp_path: Path) -> None:
    """In the first phase, in the second one, and after its end: no frame runs twice, and the rows are the same."""
    task, scratch = Task.of(cell, shares, shares_movement=False, keep=True), tmp_path / "scratch"
    stopped(task, scratch, 500)
    stopped(task, scratch, 1100)
    frames: list[int] = []
    count = Session._count

    def counting(session: Session, frame: Any) -> None:
        frames.append(frame.number)
        count(session, frame)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Session, "_count", counting)
        assert measured(work(task, scratch)) == expected
        assert frames == [*range(1100, 1350)]
        assert measured(work(task, scratch)) == expected
        assert len(frames) == 250
    assert (scratch / task.key / "summary.json").exists()


@pytest.mark.parametrize("broken", ["cell", "training"])
def test_what_cannot_be_gone_on_with_is_begun_again(
    broken: str, cell: Cell, expected: list[Any], tmp_path: Path
) -> None:
    """A checkpoint that is no checkpoint, of the cell or of the first phase that it shares."""
    task, scratch = Task.of(cell, True, shares_movement=False), tmp_path / "scratch"
    stopped(task, scratch, 1100 if broken == "cell" else 500)
    folder = scratch / (task.key if broken == "cell" else f"training-{task.trunk}")
    (folder / "checkpoint.npz").write_bytes(b"broken")
    assert measured(work(task, scratch)) == expected


def test_a_first_phase_of_other_code_is_done_without(
    cell: Cell, expected: list[Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Code has changed that the cell does not need: its run folders say so, and its key does not."""
    task, scratch = Task.of(cell, True, shares_movement=False), tmp_path / "scratch"
    stopped(task, scratch, 1100)
    monkeypatch.setattr("somatopy.experiment.provenance._own_code", lambda: "edited")
    assert measured(work(task, scratch)) == expected


def test_what_is_wrong_with_a_cell_is_said(cell: Cell, tmp_path: Path) -> None:
    """By whatever finds it."""
    one = somatopy.experiment.changes.changed(cell.experiment, {"damage": "offset:1,2"})
    with pytest.raises(DescriptionError, match="offset"):
        work(Task.of(Cell("a", {}, one, False), True, False), tmp_path)


def test_the_cache_of_movements_is_kept_small(tmp_path: Path) -> None:
    """What was read least lately goes first; what fits stays, and a folder that is not there is no error."""
    for age, name in enumerate(("new", "old", "older")):
        (tmp_path / name).write_bytes(bytes(10))
        os.utime(tmp_path / name, (1000 - age, 1000 - age))
    trim(tmp_path, most=25)
    assert {file.name for file in tmp_path.iterdir()} == {"new", "old"}
    trim(tmp_path / "nowhere")
    trim(None)
