"""Processes of this machine, and the order in which cells are given to them."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

from somatopy.studies.driver import Queue
from somatopy.studies.local import Local
from somatopy.studies.plan import Cell
from somatopy.studies.work import Task


def cells(described: Callable[..., Any], **how: Any) -> list[Cell]:
    """Two damages under two seeds."""
    ones = [described(damage=damage, **how) for damage in ("none", "paper")]
    return [Cell("", {}, one.replaced(seed=seed)) for seed in (0, 1) for one in ones]


def test_cells_that_need_not_wait_come_first(described: Callable[..., Any]) -> None:
    """One of each seed, so that nobody waits for the other's first phase; then what is left."""
    one, other, third, fourth = cells(described)
    queue = Queue([one, other, third, fourth])
    taken = [queue.take() for _ in range(4)]
    assert [task.key for task in taken] == [one.key, third.key, other.key, fourth.key]
    assert all(task.training is not None for task in taken) and taken[0].trunk == taken[2].trunk
    assert queue.no_longer_shared(queue.ended(one.key)) == []
    assert queue.no_longer_shared(queue.ended(other.key)) == [one.trunk]
    assert queue and {cell.key for cell in queue.under_way.values()} == {third.key, fourth.key}


def test_the_last_of_some_cells_takes_up_what_the_others_had(described: Callable[..., Any]) -> None:
    """After a study was stopped: the first phase that they shared is there still."""
    one, other, *_ = cells(described)
    assert Queue([other]).take().training is None
    assert Queue([other], whole=[one, other]).take().training is not None


def test_arms_are_stored_where_it_pays(described: Callable[..., Any]) -> None:
    """For physics, and for more than one cell."""
    assert all(Queue(cells(described)).take().movement is None for _ in range(1))
    one, other, *_ = cells(described, motion="dynamic")
    assert Queue([one, other]).take().movement == one.movement == other.movement
    assert Queue([one]).take().movement is None


def test_a_process_that_has_ended_between_cells_takes_no_cell_with_it(
    own: Path, described: Callable[..., Any], tmp_path: Path
) -> None:
    """Another is started; no two of them have ever the same log."""
    frames = itertools.count(3)
    one = described(learner=f"{own.stem}:Counted", minutes=0, damage_minutes=0)
    (tmp_path / "scratch").mkdir()
    local = Local(tmp_path / "scratch", processes=1)

    def outcome() -> Any:
        phases = [one.phases[0].replaced(frames=next(frames))]
        local.submit(Task.of(Cell("", {}, one.replaced(phases=phases), ceiling=False), False, False))
        return local.next()

    try:
        assert outcome().rows[0]["frames"] == 3
        (process,) = local._processes
        process.popen.kill()
        process.popen.wait()
        assert outcome().rows[0]["frames"] == 4
        assert len({each.log for each in local._processes}) == len(local._processes) == 2
    finally:
        local.close()
    assert not local._processes
