"""How often the hand is missed, by arm posture: counts in cells over pairs of arm joints."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from somatopy.analysis.columns import readable
from somatopy.analysis.runs import Run
from somatopy.clock import FRAMES_PER_SECOND
from somatopy.percept import Floats

__all__ = ["FEW", "Regions", "arm_regions"]

#: Along each joint, at most and at least.
CELLS, FEWEST = 24, 6
#: Cells with fewer frames than two seconds have tell nothing.
FEW = 2 * FRAMES_PER_SECOND


@dataclass(frozen=True)
class Regions:
    """Frames and misses of one phase in cells over every pair of arm joints; over the joint where there is only one.

    Attributes:
        joints: names of the arm joints.
        edges: borders of the cells along each joint, shape (n_arm, cells + 1), in its unit; the same for all phases.
        frames: per pair (a, b) with a < b, shape (cells along a, cells along b); of a single joint for the pair (0, 0),
            of which only the diagonal counts.
        misses: likewise.
        units: unit of each joint's values in `edges`; angles have "rad".

    Example:
        >>> edges = np.array([[0.0, 1.0], [0.0, 1.0]])
        >>> regions = Regions(("a", "b"), edges, {(0, 1): np.array([[40]])}, {(0, 1): np.array([[10]])}, ("rad", "m"))
        >>> regions.share(0, 1), regions.axis(0), regions.axis(1)
        (array([[0.25]]), 'a (°)', 'b (m)')
    """

    joints: tuple[str, ...]
    edges: Floats
    frames: dict[tuple[int, int], NDArray[np.int64]]
    misses: dict[tuple[int, int], NDArray[np.int64]]
    units: tuple[str, ...]

    def axis(self, joint: int) -> str:
        """A joint's name, with the unit in which `borders` gives its cells."""
        sign = readable(self.units[joint])[1]
        return f"{self.joints[joint]} ({sign})" if sign else self.joints[joint]

    def borders(self, joint: int) -> Floats:
        """Borders of the cells along a joint as a reader is shown them: degrees for angles, shape (cells + 1,)."""
        borders: Floats = readable(self.units[joint])[0] * self.edges[joint]
        return borders

    def share(self, a: int, b: int) -> Floats:
        """Share of frames with the hand missed in each cell; NaN where there are fewer than `FEW` frames."""
        frames = self.frames[a, b]
        return np.where(frames >= FEW, self.misses[a, b] / np.maximum(frames, 1), np.nan)

    def along(self, joint: int) -> Floats:
        """The same over one joint, whatever the others do, shape (cells,)."""
        other = 0 if joint or len(self.joints) == 1 else 1
        axis, pair = (1, (joint, other)) if joint <= other else (0, (other, joint))
        frames = self.frames[pair].sum(axis=axis)
        return np.where(frames >= FEW, self.misses[pair].sum(axis=axis) / np.maximum(frames, 1), np.nan)


def arm_regions(run: Run, cells: int | None = None) -> dict[int, Regions]:
    """Count frames and misses by the true (undamaged) arm posture, for each phase that has frames.

    Args:
        run: an open run folder.
        cells: along each joint, between the smallest and largest angle of the run; if None 24, and fewer in short runs,
            so that a cell has twice `FEW` frames on average in the longest phase.

    Returns:
        By index of the phase; empty where the run has no frames, or no arm joints.
    """
    joints = run.joints("arm")
    if not joints:
        return {}
    arm = run.postures("arm")
    if not len(arm):
        return {}
    missed, phase = ~run.values("hit").astype(bool), run.values("phase")
    longest = int(np.unique(phase, return_counts=True)[1].max())
    cells = cells or int(np.clip(np.sqrt(longest / (2 * FEW)), FEWEST, CELLS))
    low, high = arm.min(axis=0), arm.max(axis=0)
    edges = np.linspace(low, np.where(high > low, high, low + 1.0), cells + 1, axis=1)
    cell = np.stack([np.searchsorted(edges[k, 1:-1], arm[:, k], side="right") for k in range(len(joints))])
    units = run.units("arm")
    return {
        int(p): Regions(joints, edges, *_count(cell[:, phase == p], missed[phase == p], cells), units)
        for p in np.unique(phase)
    }


Counts = dict[tuple[int, int], NDArray[np.int64]]


def _count(cell: NDArray[np.int64], missed: NDArray[np.bool_], cells: int) -> tuple[Counts, Counts]:
    """Frames and misses over every pair of joints."""
    pairs = list(combinations(range(len(cell)), 2)) or [(0, 0)]
    flat = {(a, b): cell[a] * cells + cell[b] for a, b in pairs}

    def counts(where: NDArray[np.bool_] | slice) -> Counts:
        return {pair: np.bincount(flat[pair][where], minlength=cells**2).reshape(cells, cells) for pair in pairs}

    return counts(slice(None)), counts(missed)
