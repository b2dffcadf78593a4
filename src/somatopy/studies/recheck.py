"""Checks whether today's code gives the results in a study folder: lists stale cells, and runs a sample again."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from somatopy.analysis.cells import CELLS, COLUMNS
from somatopy.experiment.description import DescriptionError
from somatopy.studies.folder import StudyFolder
from somatopy.studies.local import Local
from somatopy.studies.plan import Cell, Study
from somatopy.studies.work import Task

__all__ = ["Check", "Rerun", "recheck"]

#: How many cells run again.
SAMPLE = 3
#: What a row says by the name of its study or its code; all other columns are measures.
_NAMES = ("key", "description", "code", "condition")
_MEASURES = tuple(column.name for column in COLUMNS if column.name not in _NAMES)

Rows = list[dict[str, Any]]


@dataclass(frozen=True)
class Rerun:
    """The result of running a cell again.

    Attributes:
        condition: name of its condition.
        seed: its seed.
        differs: for each measure that is not the same to the last bit, the largest difference, in its unit; infinite if
            one of the two values is no number.
        cause: why it failed; "" if it did not.
    """

    condition: str
    seed: int
    differs: Mapping[str, float]
    cause: str = ""

    @property
    def equal(self) -> bool:
        """Whether all measures are the same to the last bit."""
        return not self.differs and not self.cause

    def table(self) -> dict[str, Any]:
        """Plain data; a difference that is infinite is None."""
        amounts = {name: amount if isfinite(amount) else None for name, amount in self.differs.items()}
        return {**vars(self), "differs": amounts, "equal": self.equal}

    def text(self) -> str:
        """In words."""
        said = ", ".join(f"{name} by up to {amount:.3g}" for name, amount in self.differs.items())
        outcome = f"failed: {self.cause}" if self.cause else f"differs: {said}" if said else "equal bit for bit"
        return f"{self.condition}, seed {self.seed}: {outcome}"


@dataclass(frozen=True)
class Check:
    """The result of `recheck`.

    Attributes:
        stale: cells whose rows were made by other code than today's, by condition and seed.
        unfinished: cells without rows.
        reruns: the cells of the sample.
    """

    stale: list[tuple[str, int]]
    unfinished: list[tuple[str, int]]
    reruns: list[Rerun]

    @property
    def equal(self) -> bool:
        """Whether each cell of the sample gave the same measures to the last bit."""
        return all(rerun.equal for rerun in self.reruns)

    def table(self) -> dict[str, Any]:
        """Plain data; a difference that is infinite is None."""
        listed = {"stale": self.stale, "unfinished": self.unfinished}
        return {
            "equal": self.equal,
            **{name: [{"condition": c, "seed": s} for c, s in cells] for name, cells in listed.items()},
            "reruns": [rerun.table() for rerun in self.reruns],
        }

    def text(self) -> str:
        """In words, one cell a line."""
        listed = [
            f"{name}: {condition}, seed {seed}"
            for name in ("stale", "unfinished")
            for condition, seed in getattr(self, name)
        ]
        counts = f"{len(self.stale)} stale, {len(self.unfinished)} unfinished, {len(self.reruns)} run again"
        return "\n".join([*listed, *(rerun.text() for rerun in self.reruns), counts])


def recheck(study: Study, folder: str | Path, processes: int | None = None) -> Check:
    """List the cells of a study that are unfinished or were run by other code, and run a sample of cells again.

    The sample consists of the cells with the fewest frames, stale ones first. Each is run as a whole and shares nothing
    with other cells. Nothing is written into the study folder.

    Args:
        study: the study, as today's study file describes it.
        folder: its folder.
        processes: number of processes; as many as there are cores if None.

    Raises:
        DescriptionError: no study folder, or its table cannot be read.
    """
    kept = _kept(Path(folder))
    cells = list({(cell.condition, cell.seed): cell for cell in study.cells()}.values())
    stale = [cell for cell in cells if cell.description in kept and cell.key not in kept[cell.description]]
    unfinished = [cell for cell in cells if cell.description not in kept]
    sample = _sample(cells, {cell.description for cell in stale}, kept)
    return Check(_named(stale), _named(unfinished), _run_again(sample, kept, processes))


def _named(cells: Iterable[Cell]) -> list[tuple[str, int]]:
    return [(cell.condition, cell.seed) for cell in cells]


def _kept(folder: Path) -> dict[str, dict[str, Rows]]:
    """The rows in a study folder, by description, then by key; the newest last."""
    if not (folder / CELLS).is_file():
        raise DescriptionError(f"{folder} is not the folder of a study that has run: it holds no {CELLS}.")
    found: dict[str, dict[str, Rows]] = {}
    for key, rows in StudyFolder(folder, "").kept().items():
        found.setdefault(rows[0]["description"], {})[key] = rows
    return found


def _sample(cells: Iterable[Cell], stale: set[str], kept: Mapping[str, Any]) -> list[Cell]:
    ran = {cell.description: cell for cell in cells if cell.description in kept}.values()
    order = sorted(ran, key=lambda c: (c.description not in stale, c.experiment.frames, c.description))
    return order[:SAMPLE]


def _run_again(sample: list[Cell], kept: Mapping[str, dict[str, Rows]], processes: int | None) -> list[Rerun]:
    by_key, found = {cell.key: cell for cell in sample}, {}
    waiting = list(sample)
    with TemporaryDirectory() as scratch:
        local = Local(Path(scratch), min(processes or len(sample) or 1, len(sample) or 1))
        try:
            for ended in range(len(sample)):
                while waiting and len(sample) - len(waiting) - ended < local.capacity:
                    local.submit(Task.of(waiting.pop(0), shares_training=False, shares_movement=False))
                key, rows, cause = local.next()
                cell = by_key[key]
                differs = _differences(_before(kept[cell.description], key), rows) if rows is not None else {}
                found[key] = Rerun(cell.condition, cell.seed, differs, cause)
        finally:
            local.close()
    return [found[cell.key] for cell in sample]


def _before(rows: Mapping[str, Rows], key: str) -> Rows:
    """The rows of the same code, or else the newest."""
    return rows[key] if key in rows else max(rows.values(), key=lambda each: str(each[0]["finished"]))


def _differences(before: Rows, after: Rows) -> dict[str, float]:
    """By measure, by how much two sets of rows differ at most."""
    if len(before) != len(after):
        return {"phase": float("inf")}
    found: dict[str, float] = {}
    for one, other in zip(sorted(before, key=_phase), sorted(after, key=_phase), strict=True):
        for name in (name for name in _MEASURES if name in one):  # tables of older versions lack some
            if (amount := _apart(one[name], other[name])) is not None:
                found[name] = max(amount, found.get(name, 0.0))
    return found


def _phase(row: Mapping[str, Any]) -> int:
    return int(row["phase"])


def _apart(one: Any, other: Any) -> float | None:
    """How far two values are from each other; None if they are the same."""
    if one == other:
        return None
    if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        return max(amount for pair in zip(one, other, strict=True) if (amount := _apart(*pair)) is not None)
    numbers = isinstance(one, int | float) and isinstance(other, int | float)
    return abs(one - other) if numbers else float("inf")
