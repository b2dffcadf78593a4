"""The task of running a cell, as plain data. This module imports nothing, to keep processes small."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from somatopy.studies.plan import Cell

__all__ = ["Task"]


class Task(NamedTuple):
    """What a process needs to know in order to run a cell: plain data.

    Attributes:
        key: of the cell.
        experiment: the description.
        training: the description of its first phase, if other cells share it; else None.
        trunk: the name under which that phase is kept.
        movement: the name of the arm's movement, if other cells share it; else None.
        ceiling: whether the ceiling is computed.
        keep: whether the run folder stays.
        every: the ceiling looks at one frame out of so many.
    """

    key: str
    experiment: dict[str, Any]
    training: dict[str, Any] | None
    trunk: str
    movement: str | None
    ceiling: bool
    keep: bool
    every: int

    @classmethod
    def of(cls, cell: Cell, shares_training: bool, shares_movement: bool, keep: bool = False) -> Task:
        """The task of a cell."""
        training = cell.training if shares_training else None
        return cls(
            cell.key,
            cell.experiment.model_dump(mode="json"),
            training.model_dump(mode="json") if training else None,
            cell.trunk,
            cell.movement if shares_movement else None,
            cell.ceiling,
            keep,
            cell.every,
        )
