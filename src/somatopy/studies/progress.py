"""The progress bar of a study: finished cells, time left, failures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from somatopy.studies.local import Outcome
from somatopy.studies.plan import Cell

__all__ = ["StudyProgress"]


class StudyProgress:
    """A progress bar on standard error, shown while the context lasts.

    Args:
        cells: all cells of the study.
        waiting: those that have not ended yet.
    """

    def __init__(self, cells: Sequence[Cell], waiting: Sequence[Cell]) -> None:
        self._failed = 0
        self._bar = Progress(
            TextColumn("cells"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[said]}"),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=Console(stderr=True),
            speed_estimate_period=3600,
        )
        self._task = self._bar.add_task("", total=len(cells), completed=len(cells) - len(waiting), said="")

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def ended(self, cell: Cell, outcome: Outcome) -> None:
        """A cell has ended, well or not."""
        if outcome.rows is None:
            self._failed += 1
            self._bar.console.print(
                f"failed: {cell.condition}, seed {cell.seed}: {outcome.cause}", markup=False, soft_wrap=True
            )
        said = f"{self._failed} failed" if self._failed else ""
        self._bar.update(self._task, advance=1, said=said)
