"""How near the codes are to the inputs, and how the units are used."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array

from somatopy.maps.base import Map
from somatopy.maps.quality.looking import codes_of, residuals, tally, topology_of
from somatopy.maps.start import check_number

__all__ = [
    "dead_units",
    "distortion",
    "entropy",
    "mean_squared_error",
    "quantisation_error",
    "winner_counts",
]

Integers = NDArray[np.int64]


def quantisation_error(trained: Map, X: ArrayLike) -> float:
    """Mean Euclidean distance of the inputs X (n, dims) from their winners, in their unit.

    Source: T. Kohonen, Self-Organizing Maps, 3rd edition, Springer, 2001.
    """
    seen = tally(trained, X)
    return seen.distance / seen.inputs


def mean_squared_error(trained: Map, X: ArrayLike) -> float:
    """Mean squared Euclidean distance of the inputs X (n, dims) from their winners, in their unit squared."""
    seen = tally(trained, X)
    return seen.squared / seen.inputs


def winner_counts(trained: Map, X: ArrayLike) -> Integers:
    """How many of the inputs X (n, dims) each unit wins, shape (units,)."""
    return tally(trained, X).counts


def dead_units(trained: Map, X: ArrayLike) -> Integers:
    """The units that win none of the inputs X (n, dims), in ascending order."""
    return np.flatnonzero(winner_counts(trained, X) == 0)


def entropy(trained: Map, X: ArrayLike) -> float:
    """Entropy of the distribution of winners of the inputs X (n, dims), in bits.

    It is 0 if one unit wins all, and log2(units), the greatest possible, if all units win equally often.
    """
    return tally(trained, X).entropy


def distortion(trained: Map, X: ArrayLike, width: float) -> float:
    r"""Kohonen's distortion: what a SOM of one width, which does not fade, makes small.

    .. math::
        \frac{1}{n} \sum_x \sum_i \exp\left(-\frac{d(i, s(x))^2}{2 \sigma^2}\right) \|x - w_i\|^2

    with the winner :math:`s(x)` and the distance :math:`d` within the map: of a lattice, that of `SOM`. As
    :math:`\sigma` goes to 0 it becomes the mean squared error. (What papers on robots call distortion is often the
    quantisation error.)

    Sources: T. Kohonen, Self-Organizing Maps, 3rd edition, Springer, 2001; for finite data J. Lampinen, E. Oja,
    Clustering properties of hierarchical self-organizing maps, Journal of Mathematical Imaging and Vision 2, 1992,
    whose decomposition by winners is computed here, in exact form: it takes one look at the data.

    Args:
        trained: a map with a topology.
        X: inputs, shape (n, dims).
        width: :math:`\sigma`, over 0, in the unit of the map's distances: cells of a lattice.

    Raises:
        ValueError: if the map has no topology or the width is not a finite number over 0.
    """
    check_number("width", width)
    topology, codes = topology_of(trained, "distortion"), codes_of(trained)
    weight, pull, spread = np.zeros_like(codes), np.zeros_like(codes), np.zeros(len(codes))
    inputs, total = 0, 0.0
    for winners, gaps, weights in residuals(trained, X):
        cells = csr_array((np.ones(len(gaps)), (winners, np.arange(len(gaps)))), shape=(len(codes), len(gaps)))
        weight += cells @ weights
        pull += cells @ (weights * gaps)
        spread += cells @ (weights * gaps**2).sum(axis=1)
        inputs += len(gaps)
    for unit in np.flatnonzero(weight.any(axis=1)):
        shifts = codes - codes[unit]
        squared = spread[unit] - 2 * shifts @ pull[unit] + shifts**2 @ weight[unit]
        total += float(np.exp(-0.5 * (topology.distances(int(unit)) / width) ** 2) @ squared)
    return total / inputs
