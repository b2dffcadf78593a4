"""How often the hand is missed, by arm posture: counts in cells over pairs of arm joints."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from somatopy.analysis.runs import Run
from somatopy.percept import Floats

__all__ = ["FEW", "Regions", "arm_regions"]

CELLS = 24
#: Cells with fewer frames (two seconds) tell nothing.
FEW = 30


@dataclass(frozen=True)
class Regions:
    """Frames and misses of one phase in cells over every pair of arm joints.

    Attributes:
        joints: names of the arm joints.
        edges: borders of the cells along each joint, shape (n_arm, cells + 1), rad; the same for all phases.
        frames: per pair (a, b) with a < b, shape (cells along a, cells along b).
        misses: likewise.

    Example:
        >>> edges = np.array([[0.0, 1.0], [0.0, 1.0]])
        >>> Regions(("a", "b"), edges, {(0, 1): np.array([[40]])}, {(0, 1): np.array([[10]])}).share(0, 1)
        array([[0.25]])
    """

    joints: tuple[str, ...]
    edges: Floats
    frames: dict[tuple[int, int], NDArray[np.int64]]
    misses: dict[tuple[int, int], NDArray[np.int64]]

    def share(self, a: int, b: int) -> Floats:
        """Share of frames with the hand missed in each cell; NaN where there are fewer than `FEW` frames."""
        frames = self.frames[a, b]
        return np.where(frames >= FEW, self.misses[a, b] / np.maximum(frames, 1), np.nan)

    def along(self, joint: int) -> Floats:
        """The same over one joint, whatever the others do, shape (cells,)."""
        other = 1 if joint == 0 else 0
        axis, pair = (1, (joint, other)) if joint < other else (0, (other, joint))
        frames = self.frames[pair].sum(axis=axis)
        return np.where(frames >= FEW, self.misses[pair].sum(axis=axis) / np.maximum(frames, 1), np.nan)


def arm_regions(run: Run, cells: int = CELLS) -> dict[int, Regions]:
    """Count frames and misses by the true (undamaged) arm posture, for each phase that has frames.

    Args:
        run: an open run folder.
        cells: along each joint, between the smallest and largest angle of the run.

    Returns:
        By index of the phase; empty where the run has no frames, or fewer than two arm joints.
    """
    names = [n for n in run.columns if n.startswith("arm_") and n.endswith("_rad") and not n.startswith("arm_command")]
    if len(names) < 2:
        return {}
    table = run.frames([*names, "hit", "phase"])
    arm = np.column_stack([table[name].to_numpy() for name in names])
    if not len(arm):
        return {}
    missed, phase = ~table["hit"].to_numpy().astype(bool), table["phase"].to_numpy()
    low, high = arm.min(axis=0), arm.max(axis=0)
    edges = np.linspace(low, np.where(high > low, high, low + 1.0), cells + 1, axis=1)
    cell = np.stack([np.searchsorted(edges[k, 1:-1], arm[:, k], side="right") for k in range(len(names))])
    joints = tuple(name.removeprefix("arm_").removesuffix("_rad") for name in names)
    return {int(p): _count(joints, edges, cell[:, phase == p], missed[phase == p]) for p in np.unique(phase)}


def _count(joints: tuple[str, ...], edges: Floats, cell: NDArray[np.int64], missed: NDArray[np.bool_]) -> Regions:
    cells = edges.shape[1] - 1
    pairs = list(combinations(range(len(joints)), 2))
    flat = {(a, b): cell[a] * cells + cell[b] for a, b in pairs}

    def counts(where: NDArray[np.bool_] | slice) -> dict[tuple[int, int], NDArray[np.int64]]:
        return {pair: np.bincount(flat[pair][where], minlength=cells**2).reshape(cells, cells) for pair in pairs}

    return Regions(joints, edges, counts(slice(None)), counts(missed))
