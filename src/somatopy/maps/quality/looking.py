"""How the measures look at inputs: some rows at a time, so that memory does not grow with their number."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.utils.validation import check_is_fitted

from somatopy.maps.base import Map
from somatopy.maps.inputs import unmasked
from somatopy.maps.topology import Topology

__all__ = ["BLOCK", "Tally", "blocks", "codes_of", "pieces", "residuals", "tally", "topology_of"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

BLOCK = 2**18  # distances worked on at a time: they stay in the processor's cache
ROWS = 64  # inputs that are looked at together at least: a look may copy the codebook


@dataclass
class Tally:
    """Sums over inputs: how many each unit wins, distances from the winners, their squares."""

    counts: Integers
    distance: float = 0.0
    squared: float = 0.0

    @property
    def inputs(self) -> int:
        """Number of inputs."""
        return int(self.counts.sum())

    @property
    def entropy(self) -> float:
        """Entropy of the distribution of winners, in bits."""
        shares = self.counts[self.counts > 0] / self.inputs
        return float((shares * np.log2(1 / shares)).sum())


def tally(trained: Map, X: ArrayLike) -> Tally:
    """Look at all inputs once."""
    units = len(codes_of(trained))
    sums = Tally(np.zeros(units, dtype=np.int64))
    for winners, gaps, weights in residuals(trained, X):
        squared = (weights * gaps**2).sum(axis=1)
        sums.counts += np.bincount(winners, minlength=units)
        sums.distance += float(np.sqrt(squared).sum())
        sums.squared += float(squared.sum())
    return sums


def residuals(trained: Map, X: ArrayLike) -> Iterator[tuple[Integers, Floats, Floats]]:
    """Winners of some inputs, what the inputs are off their codes, and weights that make up for missing values."""
    codes = codes_of(trained)
    for block, winners in blocks(trained, X, trained.predict):
        gaps = np.asarray(block, dtype=np.float64) - codes[winners]
        known = ~np.isnan(gaps)
        gaps[~known] = 0.0
        yield winners, gaps, known * (gaps.shape[1] / known.sum(axis=1, keepdims=True))


def blocks(trained: Map, X: Any, look: Callable[[Any], NDArray[Any]]) -> Iterator[tuple[Any, NDArray[Any]]]:
    """Some rows of X at a time, and what the map sees in them."""
    units, dims = codes_of(trained).shape
    for start, block in pieces(X, max(ROWS, BLOCK // max(units, dims))):
        try:
            seen = look(block)
        except ValueError as error:
            error.add_note(f"rows are counted from X[{start}]")
            raise
        yield block, seen


def pieces(X: Any, step: int) -> Iterator[tuple[int, Any]]:
    """Some rows of X at a time, with the number of the first; all of an X that has none, for a map to refuse it."""
    table = X if hasattr(X, "iloc") else np.asarray(unmasked(X))
    rows = getattr(table, "iloc", table)  # a table with names of columns keeps them
    if table.ndim == 0 or not len(table):
        yield 0, table
    else:
        yield from ((start, rows[start : start + step]) for start in range(0, len(table), step))


def codes_of(trained: Map) -> Floats:
    """The codes (units, dims), in double precision."""
    return trained.codebook_.astype(np.float64)


def topology_of(trained: Map, measure: str) -> Topology:
    """Which units of the map are neighbours."""
    check_is_fitted(trained)
    try:
        return trained.topology_
    except AttributeError as error:
        raise ValueError(
            f"the {measure} needs to know which units are neighbours, and a {type(trained).__name__} has no topology; "
            "what needs none: quantisation_error, mean_squared_error, winner_counts, dead_units, entropy"
        ) from error
