"""The contract of what tells which units of a map are neighbours."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["Topology"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class Topology(Protocol):
    """Which units are neighbours."""

    @property
    def edges(self) -> Integers:
        """Pairs of units that are joined, shape (edges, 2), the lower number first, each pair once."""
        ...

    def adjacent(self, a: ArrayLike, b: ArrayLike) -> NDArray[np.bool_]:
        """Whether units a and b are neighbours."""
        ...

    def distances(self, unit: int) -> Floats:
        """Distance of every unit from one, within the map, shape (units,); infinite where nothing joins them."""
        ...
