"""How far a study is, and what it would need."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from somatopy.studies import Condition, Study
from somatopy.studies.estimate import estimate
from somatopy.studies.local import Outcome
from somatopy.studies.plan import Cell
from somatopy.studies.progress import StudyProgress


def test_the_bar_counts_cells_and_failures(described: Callable[..., Any], capsys: pytest.CaptureFixture[str]) -> None:
    """From what had ended before; failures with condition, seed and cause, on standard error."""
    cells = [Cell("a [b]", {}, described().replaced(seed=seed)) for seed in range(4)]
    with StudyProgress(cells, cells[1:]) as bar:
        bar.ended(cells[1], Outcome("k", []))
        bar.ended(cells[2], Outcome("k", None, "ValueError: [no]"))
    printed = capsys.readouterr()
    assert printed.out == ""
    assert "failed: a [b], seed 2: ValueError: [no]" in printed.err
    assert "3/4" in printed.err and "1 failed" in printed.err


def test_at_the_end_nothing_is_left(described: Callable[..., Any], capsys: pytest.CaptureFixture[str]) -> None:
    """The time that has gone by stands once; what a cell failed of is one line, however long."""
    cell = Cell("a", {}, described())
    with StudyProgress([cell], [cell]) as bar:
        bar.ended(cell, Outcome("k", None, "no " * 100 + "end"))
    lines = capsys.readouterr().err.splitlines()
    assert any(line.startswith("failed: ") and line.endswith(" end") for line in lines)
    assert lines[-1].endswith("left 0:00:00")


def test_what_is_shared_counts_once(described: Callable[..., Any]) -> None:
    """First phases of cells that have them in common, and cells that are described alike."""
    ones = {"a": described(), "again": described(), "none": described(damage="none")}
    found = estimate(Study("s", tuple(Condition(name, one, (0, 1)) for name, one in ones.items())), processes=3)
    assert (found.cells, found.frames, found.processes) == (4, 2 * (900 + 2 * 450), 3)
    assert found.cpu_hours > 0 and found.wall_hours == pytest.approx(found.cpu_hours / 3)
    assert found.memory_bytes > 3e8 and found.disk_bytes > 0
    small = replace(found, cpu_hours=0.00123, wall_hours=1234.567, disk_bytes=2e6, processes=1).text()
    assert "CPU hours    0.001, by" in small and "wall hours   1,234.57 with 1 process\n" in small
    assert small.endswith("disk         0.002 GB")
    assert found.table()["cells"] == 4 and found.text().startswith("cells        4\nframes       3,600\nCPU hours")
