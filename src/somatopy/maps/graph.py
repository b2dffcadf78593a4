"""Units joined by edges: the topology of maps that grow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components, dijkstra

from somatopy.maps.start import check_units

__all__ = ["Graph"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Graph:
    """Units, some of which are joined.

    Args:
        units: how many, at least 0.
        edges: pairs of units that are joined, shape (edges, 2), the lower number first, each pair once.

    Raises:
        ValueError: if the edges are not such pairs.

    Example:
        >>> ring = Graph(5, [(0, 1), (1, 2), (2, 3), (0, 3)])
        >>> ring.distances(0).tolist()
        [0.0, 1.0, 2.0, 1.0, inf]
        >>> ring.components, ring.loops
        (2, 1)
    """

    units: int
    edges: Integers

    def __post_init__(self) -> None:
        check_units("units", self.units, least=0)
        given = np.asarray(self.edges)
        if given.size and given.dtype.kind not in "iu":
            raise ValueError(f"edges must be pairs of whole numbers, the units; got {given.dtype}")
        edges = given.astype(np.int64)
        if edges.size == 0:
            edges = edges.reshape(0, 2)
        if edges.ndim != 2 or edges.shape[1] != 2:
            raise ValueError(f"edges must be pairs of units, shape (edges, 2); got shape {edges.shape}")
        wrong = (edges[:, 0] < 0) | (edges[:, 0] >= edges[:, 1]) | (edges[:, 1] >= self.units)
        if wrong.any():
            pair = edges[wrong.argmax()].tolist()
            raise ValueError(f"an edge joins two of {self.units} units, the lower number first, from 0; got {pair}")
        if len(np.unique(edges, axis=0)) < len(edges):
            raise ValueError("each pair of units has at most one edge; some have more")
        object.__setattr__(self, "edges", edges)

    def adjacent(self, a: ArrayLike, b: ArrayLike) -> NDArray[np.bool_]:
        """Whether an edge joins units a and b.

        Raises:
            IndexError: if there is no such unit.
        """
        one, other = np.asarray(a, dtype=np.int64), np.asarray(b, dtype=np.int64)
        if not all(((units >= 0) & (units < self.units)).all() for units in (one, other)):
            raise IndexError(f"units are 0 to {self.units - 1}; got {a!r} and {b!r}")
        pairs = np.minimum(one, other) * self.units + np.maximum(one, other)
        return np.isin(pairs, self.edges[:, 0] * self.units + self.edges[:, 1])

    def distances(self, unit: int) -> Floats:
        """Least number of edges from one unit to each, shape (units,); infinite where no edges lead."""
        hops: Floats = dijkstra(self._matrix(), directed=False, indices=unit, unweighted=True)
        return hops

    @property
    def components(self) -> int:
        """Number of parts that no edge joins."""
        return int(connected_components(self._matrix(), directed=False, return_labels=False)) if self.units else 0

    @property
    def loops(self) -> int:
        """Number of independent loops: edges that could go without a part falling apart."""
        return len(self.edges) - self.units + self.components

    def _matrix(self) -> coo_array:
        return coo_array((np.ones(len(self.edges)), tuple(self.edges.T)), shape=(self.units, self.units)).tocsr()
