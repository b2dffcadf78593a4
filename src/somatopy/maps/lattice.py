"""Where the units of a map lie: lattices of one to four axes, rectangular or hexagonal, with or without borders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from math import prod, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["KINDS", "Lattice", "check_shape"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

KINDS = ("rectangular", "hexagonal")
ROW_HEIGHT = sqrt(3) / 2  # of a hexagonal lattice whose neighbours are 1 apart


def check_shape(shape: Sequence[int]) -> tuple[int, ...]:
    """The lattice shape as a tuple of ints.

    Raises:
        ValueError: if it is not one to four whole numbers, each at least 1.
    """
    try:
        axes = tuple(shape)
        valid = 1 <= len(axes) <= 4 and all(isinstance(n, (int, np.integer)) and n >= 1 for n in axes)
    except TypeError:
        valid = False
    if not valid:
        raise ValueError(f"shape must be one to four whole numbers, each at least 1, such as (30, 30); got {shape!r}")
    return tuple(int(n) for n in axes)


@dataclass(frozen=True)
class Lattice:
    """Units in rows, numbered row by row (the last axis fastest), neighbours one cell apart.

    On a hexagonal lattice every second row is shifted by half a cell and rows are the square root of 3/4 apart, so
    that each unit inside has six neighbours at distance 1.

    Args:
        shape: units along each axis, one to four numbers; two on a hexagonal lattice.
        kind: "rectangular" or "hexagonal".
        periodic: whether opposite borders touch (a ring, a torus). Hexagonal lattices then need an even number of rows.

    Raises:
        ValueError: if these do not fit together.

    Example:
        >>> lattice = Lattice((3, 4), "hexagonal")
        >>> lattice.units, lattice.distances(0)[:8].round(2).tolist()
        (12, [0.0, 1.0, 2.0, 3.0, 1.0, 1.73, 2.65, 3.61])
    """

    shape: tuple[int, ...]
    kind: str = "rectangular"
    periodic: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "shape", check_shape(self.shape))
        if self.kind not in KINDS:
            raise ValueError(f"unknown lattice {self.kind!r}; valid lattices: {list(KINDS)}")
        if not isinstance(self.periodic, (bool, np.bool_)):
            raise ValueError(f"periodic must be True or False; got {self.periodic!r}")
        if self.hexagonal and len(self.shape) != 2:
            raise ValueError(f"a hexagonal lattice has two axes; got shape {self.shape}")
        if self.hexagonal and self.periodic and self.shape[0] % 2:
            raise ValueError(f"a periodic hexagonal lattice needs an even number of rows; got shape {self.shape}")

    @property
    def hexagonal(self) -> bool:
        """Whether it is hexagonal."""
        return self.kind == "hexagonal"

    @property
    def units(self) -> int:
        """Number of units."""
        return prod(self.shape)

    @cached_property
    def places(self) -> Integers:
        """Indices of each unit along the axes, shape (units, axes)."""
        return np.indices(self.shape).reshape(len(self.shape), -1).T

    @cached_property
    def positions(self) -> Floats:
        """Coordinates of each unit in cells, shape (units, axes)."""
        positions = self.places.astype(np.float64)
        if self.hexagonal:
            positions[:, 1] += 0.5 * (self.places[:, 0] % 2)
            positions[:, 0] *= ROW_HEIGHT
        return positions

    @cached_property
    def edges(self) -> Integers:
        """Pairs of units one cell apart, shape (edges, 2), the lower number first, each pair once."""
        if self.hexagonal:
            steps = [(0, (0, 1)), (0, (1, 0)), (0, (1, -1)), (1, (0, 1)), (1, (1, 0)), (1, (1, 1))]
            pairs = [self._pairs(np.array(step), self.places[:, 0] % 2 == parity) for parity, step in steps]
        else:
            everywhere = np.ones(self.units, dtype=bool)
            pairs = [self._pairs(step, everywhere) for step in np.eye(len(self.shape), dtype=np.int64)]
        found = np.sort(np.concatenate(pairs), axis=1)
        return np.unique(found[found[:, 0] != found[:, 1]], axis=0)

    def _pairs(self, step: Integers, start: NDArray[np.bool_]) -> Integers:
        """Units and what lies one step from them, where that is on the lattice."""
        units = np.flatnonzero(start)
        ends = self.places[units] + step
        if self.periodic:
            ends %= self.shape
        inside = ((ends >= 0) & (ends < self.shape)).all(axis=1)
        return np.stack([units[inside], np.ravel_multi_index(tuple(ends[inside].T), self.shape)], axis=1)

    def adjacent(self, a: ArrayLike, b: ArrayLike) -> NDArray[np.bool_]:
        """Whether units are neighbours: the six on a hexagonal lattice; on others all that touch, corners too."""
        one, other = np.asarray(a), np.asarray(b)
        if self.hexagonal:
            return np.abs(self._apart(one, other) - 1.0) < 1e-9
        steps = np.abs(self.places[one] - self.places[other])
        if self.periodic:
            steps = np.minimum(steps, np.array(self.shape) - steps)
        adjacent: NDArray[np.bool_] = steps.max(axis=-1) == 1
        return adjacent

    def distances(self, unit: int) -> Floats:
        """Euclidean distance of every unit from one, in cells, shape (units,)."""
        return self._apart(np.asarray(unit), np.arange(self.units))

    def _apart(self, a: Integers, b: Integers) -> Floats:
        steps = np.abs(self.positions[a] - self.positions[b])
        if self.periodic:
            steps = np.minimum(steps, np.array(self.shape) * self.cell - steps)
        apart: Floats = np.sqrt((steps**2).sum(axis=-1))
        return apart

    @property
    def cell(self) -> Floats:
        """Distance between rows of units along each axis, shape (axes,)."""
        return np.array([ROW_HEIGHT, 1.0]) if self.hexagonal else np.ones(len(self.shape))

    def geometry(self, *, normalised: bool = False) -> Floats:
        """What the kernels know of the lattice: a row (units, spacing, periodic, shift of odd rows) an axis.

        Axes of a single unit are left out.

        Args:
            normalised: in units where the farthest two units are 1 apart, each axis of a rectangular lattice counting
                alike; cells otherwise.
        """
        kept = np.ones(2, dtype=bool) if self.hexagonal else np.array(self.shape) > 1
        spacing = self.cell
        if normalised and self.hexagonal:
            spacing = spacing / max(self._diameter, 1.0)
        elif normalised:
            farthest = [n // 2 if self.periodic else n - 1 for n in self.shape]
            spacing = spacing / np.maximum(farthest, 1) / sqrt(max(kept.sum(), 1))
        shift = np.array([0.0] * (len(self.shape) - 1) + [0.5 * self.hexagonal])
        rows = np.stack([np.array(self.shape, float), spacing, np.full(len(self.shape), float(self.periodic)), shift])
        return np.ascontiguousarray(rows.T[kept]) if kept.any() else np.array([[1.0, 1.0, 0.0, 0.0]])

    @property
    def _diameter(self) -> float:
        rows, columns = self.shape
        corners = product({0, min(1, rows - 1), max(rows - 2, 0), rows - 1}, {0, columns - 1})
        return max(float(self.distances(row * columns + column).max()) for row, column in corners)
