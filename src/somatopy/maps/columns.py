"""Names of the columns that a map has learned, for whoever draws them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from somatopy.maps.base import Map

__all__ = ["chosen_columns", "column_names"]


def column_names(trained: Map) -> list[str]:
    """A name for each dimension of the codes: that of its column, where the inputs came in a table that has names."""
    given = getattr(trained, "feature_names_in_", None)
    if given is not None:
        return [str(name) for name in given]
    return [f"dimension {dim}" for dim in range(trained.codebook_.shape[1])]


def chosen_columns(trained: Map, chosen: Sequence[Any]) -> list[int]:
    """The dimensions that are meant by numbers from 0 or by names of columns.

    Raises:
        ValueError: if there is no such dimension.
    """
    named = [str(name) for name in getattr(trained, "feature_names_in_", [])]
    valid = range(trained.codebook_.shape[1])
    found = []
    for dim in chosen:
        place = named.index(dim) if isinstance(dim, str) and dim in named else dim
        if isinstance(place, bool) or not isinstance(place, (int, np.integer)) or place not in valid:
            names = f", named {named}" if named else ""
            raise ValueError(f"there is no dimension {dim!r}: the codes have dimensions 0 to {valid[-1]}{names}")
        found.append(int(place))
    return found
