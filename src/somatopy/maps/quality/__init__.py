"""How good a map is: how near its codes are to the inputs, how well neighbours stay neighbours, how units are used.

Every measure looks at the inputs some rows at a time: memory does not grow with their number. With missing="ignore"
distances are the map's own, those of the coordinates that were observed. The inputs should not be the ones that the map
has learned, if it is to be known how it does on others.
"""

from __future__ import annotations

from numpy.typing import ArrayLike

from somatopy.maps.base import Map
from somatopy.maps.quality.errors import (
    dead_units,
    distortion,
    entropy,
    mean_squared_error,
    quantisation_error,
    winner_counts,
)
from somatopy.maps.quality.history import History, follow
from somatopy.maps.quality.looking import tally
from somatopy.maps.quality.topography import topographic_error, topographic_product, trustworthiness

__all__ = [
    "History",
    "dead_units",
    "distortion",
    "entropy",
    "follow",
    "mean_squared_error",
    "quality",
    "quantisation_error",
    "topographic_error",
    "topographic_product",
    "trustworthiness",
    "winner_counts",
]


def quality(trained: Map, X: ArrayLike) -> dict[str, float]:
    """All measures that take nothing but a pass over the inputs.

    Args:
        trained: a map.
        X: inputs, shape (n, dims).

    Returns:
        "quantisation_error", "mean_squared_error", "dead_units" (their number), "entropy" and, if the map has a
        topology and more than one unit, "topographic_error". What takes a width, or time that grows with a square, is
        asked for by name: `distortion`, `topographic_product`, `trustworthiness`.

    Example:
        >>> from somatopy.maps import SOM
        >>> chain = SOM(shape=(3,), init=[[0.0], [1.0], [2.0]]).initialise(1)
        >>> for name, value in quality(chain, [[0.1], [0.2], [0.9], [1.2]]).items():
        ...     print(f"{name}: {value:.3f}")
        quantisation_error: 0.150
        mean_squared_error: 0.025
        dead_units: 1.000
        entropy: 1.000
        topographic_error: 0.000
    """
    seen = tally(trained, X)
    measures = {
        "quantisation_error": seen.distance / seen.inputs,
        "mean_squared_error": seen.squared / seen.inputs,
        "dead_units": float((seen.counts == 0).sum()),
        "entropy": seen.entropy,
    }
    if hasattr(trained, "topology_") and seen.counts.size > 1:
        measures["topographic_error"] = topographic_error(trained, X)
    return measures
