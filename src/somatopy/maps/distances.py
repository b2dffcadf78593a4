"""Distances where values may be missing."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

__all__ = ["squared_distances"]


def squared_distances(a: NDArray[Any], b: NDArray[Any]) -> NDArray[np.float64]:
    """Squared Euclidean distances of the rows of a (n, dims) from those of b (m, dims), shape (n, m).

    Where values are missing (NaN), the distance in the coordinates that are known of both, scaled up to all of them;
    NaN where there is none. (`sklearn.metrics.pairwise.nan_euclidean_distances` is the same, but multiplies out the
    square, which leaves nothing of distances that are small beside the values.)
    """
    squared: NDArray[np.float64] = cdist(a, b, "sqeuclidean")
    gappy = np.isnan(a).any(axis=1) | np.isnan(b).any()
    for row in np.flatnonzero(gappy):
        gaps = a[row].astype(np.float64) - b
        known = ~np.isnan(gaps)
        gaps[~known] = 0.0
        with np.errstate(divide="ignore", invalid="ignore"):
            squared[row] = (gaps**2).sum(axis=1) * (gaps.shape[1] / known.sum(axis=1))
    return squared
