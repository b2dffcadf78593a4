"""Estimates the processor time, memory and disk that a study needs, from a short trial of each sort of run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from time import process_time
from typing import Any

from somatopy.clock import WINDOW
from somatopy.experiment import Description, Session
from somatopy.experiment.ceiling import EVERY
from somatopy.studies.local import cores
from somatopy.studies.plan import Cell, Study

__all__ = ["Estimate", "estimate"]

_TRIAL = 300
#: Processor time of ceiling and reactive bound by frame, s: 3.9 s for the 273,872 frames of the paper's protocol.
_CEILING_S = 15e-6
#: Measured sizes, bytes: a process at work, a window of recorded frames, the rows of a cell.
_MEMORY, _WINDOW_BYTES, _ROW_BYTES = 450e6, 450e3, 6e3


@dataclass(frozen=True)
class Estimate:
    """What a study would need on this machine.

    Attributes:
        cells: number of cells.
        frames: number of frames. Frames that several cells share are counted once.
        cpu_hours: processor time.
        wall_hours: time with this number of processes.
        processes: number of processes.
        memory_bytes: memory of all processes together.
        disk_bytes: size of the study folder while the study runs.
    """

    cells: int
    frames: int
    cpu_hours: float
    wall_hours: float
    processes: int
    memory_bytes: float
    disk_bytes: float

    def table(self) -> Mapping[str, Any]:
        """The estimate as plain data."""
        return dict(vars(self))

    def text(self) -> str:
        """The estimate as text, one number a line."""
        return (
            f"cells        {self.cells:,}\n"
            f"frames       {self.frames:,}\n"
            f"CPU hours    {_said(self.cpu_hours)}, by a trial of {_TRIAL} frames of each sort of run\n"
            f"wall hours   {_said(self.wall_hours)} with {self.processes} process{'es' * (self.processes != 1)}\n"
            f"memory       {self.memory_bytes / 1e9:.1f} GB\n"
            f"disk         {_said(self.disk_bytes / 1e9)} GB"
        )


def _said(amount: float) -> str:
    """Two decimals, or what is no more than a tenth by its first digit: no amount becomes 0."""
    return f"{amount:,.2f}" if amount > 0.1 else f"{float(f'{amount:.1g}'):f}".rstrip("0")


def estimate(study: Study, processes: int | None = None) -> Estimate:
    """Estimate what a study would need.

    Args:
        study: the study.
        processes: number of processes; as many as there are cores if None.
    """
    cells = list({cell.key: cell for cell in study.cells()}.values())
    workers = min(processes or cores(), len(cells))
    frames = _frames(cells)
    speeds: dict[tuple[str, ...], float] = {}
    seconds = 0.0
    for cell, count in zip(cells, frames, strict=True):
        sort = _sort(cell.experiment)
        speeds.setdefault(sort, 0.0) or speeds.update({sort: _seconds_a_frame(cell.experiment)})
        seconds += count * speeds[sort]
    ceilings = {(cell.movement, cell.experiment.frames, EVERY / cell.every) for cell in cells if cell.ceiling}
    seconds += sum(length * _CEILING_S * looks for _, length, looks in ceilings)
    windows = max(cell.experiment.frames for cell in cells) / WINDOW
    kept = len(cells) if study.keep_frames else 2 * workers
    return Estimate(
        cells=len(cells),
        frames=sum(frames),
        cpu_hours=seconds / 3600,
        wall_hours=seconds / 3600 / workers,
        processes=workers,
        memory_bytes=workers * _MEMORY,
        disk_bytes=kept * windows * _WINDOW_BYTES + len(cells) * _ROW_BYTES,
    )


def _frames(cells: list[Cell]) -> list[int]:
    """Frames that each cell adds: a first phase counts once for all cells that share it."""
    sharing, seen, found = Counter(cell.trunk for cell in cells), set(), []
    for cell in cells:
        shared = cell.experiment.phases[0].frames if sharing[cell.trunk] > 1 and cell.trunk in seen else 0
        seen.add(cell.trunk)
        found.append(cell.experiment.frames - shared)
    return found


def _sort(experiment: Description) -> tuple[str, ...]:
    motion = str(getattr(experiment.body, "motion", ""))
    return experiment.body.kind, motion, experiment.eye.kind, experiment.learner.kind


def _seconds_a_frame(experiment: Description) -> float:
    """By a short trial; the first frames, which compile, do not count."""
    with Session(experiment) as session:
        began, counted = process_time(), 0
        for frame in session:
            if frame.number == _TRIAL // 3:
                began = process_time()
            counted = frame.number - _TRIAL // 3
            if frame.number == _TRIAL:
                break
        return (process_time() - began) / counted if counted > 0 else 0.0
