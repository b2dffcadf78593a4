"""What a map was like while it learned."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.exceptions import NotFittedError

from somatopy.maps.base import Map
from somatopy.maps.quality.errors import quantisation_error
from somatopy.maps.quality.looking import pieces
from somatopy.maps.start import check_units

__all__ = ["History", "follow"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class History(NamedTuple):
    """What `follow` recorded, arrays of one length.

    Attributes:
        samples: inputs learned so far.
        units: units the map then had.
        error: mean distance of the last inputs from their winners, just before the map learned these inputs; NaN where
            it had no units yet.
    """

    samples: Integers
    units: Integers
    error: Floats


def follow(trained: Map, X: ArrayLike, every: int = 100) -> History:
    """Let a map learn the rows of X (n, dims), and record after every few of them how it was doing.

    Raises:
        ValueError: if an input is refused. Those in the pieces before its own have been learned.

    Example:
        >>> from somatopy.maps import SOM
        >>> inputs = np.random.default_rng(0).random((1000, 2))
        >>> history = follow(SOM(shape=(8, 8), horizon=1000, random_state=0), inputs, every=250)
        >>> history.samples, history.units
        (array([ 250,  500,  750, 1000]), array([64, 64, 64, 64]))
        >>> history.error.round(2)
        array([ nan, 0.15, 0.1 , 0.08])
    """
    check_units("every", every)
    records = [_observed(trained, rows) for _, rows in pieces(X, every)]
    samples, units, error = zip(*records, strict=True)
    return History(np.array(samples), np.array(units), np.array(error))


def _observed(trained: Map, rows: Any) -> tuple[int, int, float]:
    """Learn some rows; inputs so far, units, and the rows' error before."""
    try:
        error = quantisation_error(trained, rows)
    except NotFittedError:
        error = np.nan
    trained.partial_fit(rows)
    return trained.samples_seen_, len(trained.codebook_), error
