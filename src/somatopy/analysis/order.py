"""Whether the maps of a run are ordered: the topographic error of their snapshots on what they had learned last."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from somatopy.analysis.columns import Role
from somatopy.analysis.phases import phase_title, played
from somatopy.analysis.runs import Run
from somatopy.analysis.series import distance_units, in_shares
from somatopy.analysis.snapshots import Snapshot, paper_snapshot
from somatopy.clock import DISTORTION_WIDTH, FRAMES_PER_MINUTE, WINDOW
from somatopy.percept import Floats

__all__ = ["ORDERED", "Order", "by_chance", "order_of", "orders", "topographic_error"]

#: Inputs of the last two minutes that are asked, at most.
INPUTS = 600
#: A map is ordered if its error is at most this, and not ordered if it is above the second; between, it is in part.
ORDERED = (0.25, 0.75)
#: What a map learned, and the beginning of its columns: what was perceived, or else what was sensed.
ROLES: tuple[tuple[Role, str], ...] = (("percept", "_percept"), ("sensed", ""))


class Order(NamedTuple):
    """How far a map is ordered.

    Attributes:
        side: "arm" or "head".
        error: the topographic error, from 0 to 1; None where the postures were not recorded.
        chance: that of a map whose units lie anywhere.
    """

    side: str
    error: float | None
    chance: float

    @property
    def word(self) -> str:
        """What to say of it."""
        if self.error is None:
            return "not known"
        return (
            "ordered" if self.error <= ORDERED[0] else "ordered in part" if self.error <= ORDERED[1] else "not ordered"
        )


def topographic_error(codes: Floats, shape: tuple[int, int], inputs: Floats) -> float:
    """Share of inputs whose two nearest units do not touch on a rectangular lattice, corners included (Kiviluoto 1996).

    Args:
        codes: (units, dims), row after row.
        shape: rows and columns; two units or more.
        inputs: (n, dims).

    Example:
        >>> line = np.array([[0.0], [1.0], [2.0], [3.0]])
        >>> topographic_error(line, (1, 4), np.array([[0.2], [2.9]]))
        0.0
        >>> topographic_error(line[[0, 2, 1, 3]], (1, 4), np.array([[0.2], [1.4]]))
        0.5
    """
    square = (inputs**2).sum(axis=1)[:, None] - 2 * inputs @ codes.T + (codes**2).sum(axis=1)
    nearest = np.argsort(square, axis=1, kind="stable")[:, :2]
    places = np.stack(np.unravel_index(nearest, shape))
    return float((np.abs(np.diff(places, axis=2)).max(axis=0) > 1).mean())


def by_chance(shape: tuple[int, int]) -> float:
    """The topographic error to be expected where the order of units means nothing.

    Example:
        >>> by_chance((2, 2)), round(by_chance((30, 30)), 3)
        (0.0, 0.992)
    """
    rows, columns = shape
    units = rows * columns
    touching = 2 * (rows * (columns - 1) + columns * (rows - 1) + 2 * (rows - 1) * (columns - 1))
    return 1 - touching / (units * (units - 1)) if units > 1 else 0.0


def order_of(run: Run, maps: Snapshot) -> tuple[Order, Order]:
    """How far both maps of a snapshot are ordered, by the inputs of the two minutes before it."""
    arm = _error(run, maps.frame, "arm", maps.arm_codebook, maps.arm_shape, maps.arm_limits)
    head = _error(run, maps.frame, "head", maps.head_codebook, maps.head_shape, maps.head_limits)
    return Order("arm", arm, by_chance(maps.arm_shape)), Order("head", head, by_chance(maps.head_shape))


def _error(run: Run, frame: int, side: str, codes: Floats, shape: tuple[int, int], limits: Floats) -> float | None:
    there = [role for role in ROLES if any(column.startswith(f"{side}{role[1]}.") for column in run.columns)]
    if not there or len(codes) < 2:
        return None
    inputs = run.postures(side, role=there[0][0], start=max(0, frame - DISTORTION_WIDTH), stop=frame)
    if not len(inputs):
        return None
    ranges = limits[:, 1] - limits[:, 0]
    thinned = (inputs[:: -(-len(inputs) // INPUTS)] - limits[:, 0]) / ranges
    scale = 1.0 if in_shares(distance_units(run)[side]) else ranges  # in the unit in which winners were found
    return topographic_error(codes * scale, shape, thinned * scale)


def orders(run: Run, summary: Mapping[str, Any]) -> list[tuple[str, tuple[Order, Order]]]:
    """How far the maps are ordered at the last snapshot of each phase, with words for when; empty without maps."""
    found = []
    ends = np.cumsum([phase["frames"] for phase in summary["phases"]])
    snapshots = [maps for path in _last_ones(run, ends.tolist()) if (maps := paper_snapshot(run, path)) is not None]
    for maps in snapshots:
        phase = next(index for index in played(summary["phases"]) if maps.frame <= ends[index])
        when = f"after {maps.frame / FRAMES_PER_MINUTE:.4g} min, {phase_title(summary, phase)}"
        found.append((when, order_of(run, maps)))
    return found


def _last_ones(run: Run, ends: Sequence[int]) -> list[Path]:
    """The last snapshot that stands in each phase; snapshot k is of the end of window k."""
    numbers = {int(path.stem.rpartition("-")[2]): path for path in run.snapshots}
    last: list[Path] = []
    for start, stop in zip([0, *ends], ends, strict=False):
        inside = [k for k in sorted(numbers) if start < (k + 1) * WINDOW <= stop]
        last += [numbers[inside[-1]]] if inside else []
    return last
