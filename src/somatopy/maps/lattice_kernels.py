"""Compiled kernels that the maps on lattices share: which units are in reach of the winner, and how they move.

Layout and conventions as in `kernels`; `geometry` is what `Lattice.geometry` gives.
"""

from __future__ import annotations

from math import ceil, exp, floor, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from somatopy._jit import jit
from somatopy.maps.kernels import LANES
from somatopy.maps.start import NEGLIGIBLE

__all__ = ["LEAST", "columns_in_reach", "pull_by_gaussian", "pull_row", "rows_in_reach"]

Array = NDArray[Any]
Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

LEAST = 1e-300  # what is divided by stays above 0
U = np.uint64


@jit
def _places_in_reach(place: int, count: int, reach: float, wraps: bool) -> tuple[int, int]:
    """First place, and number of places, within `reach` places along an axis; places wrap round its end if it does."""
    steps = int(min(reach, float(count)))
    if not wraps:
        low = max(place - steps, 0)
        return low, min(place + steps, count - 1) - low + 1
    if 2 * steps + 1 >= count:
        return 0, count
    return (place - steps) % count, 2 * steps + 1


@jit
def rows_in_reach(geometry: Floats, row: int, limit: float, rows: Integers, apart: Floats) -> int:
    """Write rows whose squared distance from `row` is at most about `limit`, and those distances; return how many."""
    rows[0], apart[0], found, before = 0, 0.0, 1, 1
    for axis in range(geometry.shape[0] - 1):
        before *= int(geometry[axis, 0])
    for axis in range(geometry.shape[0] - 1):
        count, spacing, wraps = int(geometry[axis, 0]), geometry[axis, 1], geometry[axis, 2] > 0
        before //= count
        place = row // before % count
        start, span = _places_in_reach(place, count, sqrt(limit) / spacing, wraps)
        for i in range(found - 1, -1, -1):  # from the back: each entry is read before its room is written
            for j in range(span - 1, -1, -1):
                other = (start + j) % count
                steps = abs(other - place)
                if wraps:
                    steps = min(steps, count - steps)
                rows[i * span + j] = rows[i] * count + other
                apart[i * span + j] = apart[i] + (steps * spacing) ** 2
        found *= span
    return found


@jit
def columns_in_reach(geometry: Floats, centre: float, limit: float, apart: Array) -> tuple[int, int]:
    """Write the squared distance along a row from `centre` where it is at most about `limit`, infinity beside it.

    Returns:
        The range of lanes written: whole vectors, the copies behind the last column like that column.
    """
    last = geometry.shape[0] - 1
    count, spacing, wraps = int(geometry[last, 0]), geometry[last, 1], geometry[last, 2] > 0
    reach = sqrt(limit) / spacing
    low, high = ceil(max(centre - reach, -1.0)), floor(min(centre + reach, float(count)))
    if wraps and (low < 0 or high >= count or 2 * reach + 1 >= count):
        low, high = 0, count - 1
    low, high = max(low, 0), min(high, count - 1)
    start, stop = low // LANES * LANES, (high + LANES) // LANES * LANES
    apart[start:low] = np.inf
    for column in range(low, high + 1):
        steps = abs(column - centre)
        if wraps:
            steps = min(steps, count - steps)
        apart[column] = (steps * spacing) ** 2
    apart[high + 1 : stop] = apart[count - 1] if high == count - 1 else np.inf
    return start, stop


@jit
def pull_row(codes: Array, x: Array, row: int, start: int, stop: int, gains: Array) -> None:
    """Move the lanes from start to stop of a row towards x by their gains, in the coordinates of x that are known."""
    for k in range(codes.shape[0]):
        target, code = x[k], codes[k, row]
        if target == target:
            for lane in range(U(start), U(stop)):
                code[lane] += gains[lane] * (target - code[lane])


@jit
def _gaussians(apart: Array, start: int, stop: int, scale: float) -> None:
    """Turn squared distances into exp(-distance^2 / scale)."""
    for lane in range(start, stop):
        apart[lane] = exp(-apart[lane] / scale)


@jit
def _row_gains(distances: Array, across: Array, factor: float, by_distance: bool, gains: Array) -> None:
    """The gain of each lane of a row: factor * its Gaussian along the row, times its distance from x if so."""
    f = gains.dtype.type(factor)
    if by_distance:
        for lane in range(gains.size):
            gains[lane] = np.sqrt(distances[lane]) * f * across[lane]
    else:
        for lane in range(gains.size):
            gains[lane] = f * across[lane]


@jit
def pull_by_gaussian(
    codes: Array,
    geometry: Floats,
    x: Array,
    squared: Array,
    at: int,
    rows: Integers,
    apart: Floats,
    tables: Array,
    rate: float,
    scale: float,
    by_distance: bool,
) -> None:
    """Pull the codes around lane `at` by rate * exp(-lattice distance^2 / scale), times their distance if so.

    The Gaussian is the product of one along the row and one across the rows, so that few exponentials are needed.
    """
    lanes = codes.shape[2]
    row, column, limit = at // lanes, at % lanes, NEGLIGIBLE * scale
    found, shift = rows_in_reach(geometry, row, limit, rows, apart), geometry[-1, 3]
    start, stop = columns_in_reach(geometry, float(column), limit, tables[0])
    _gaussians(tables[0], start, stop, scale)
    start_odd, stop_odd = start, stop
    if shift > 0.0:  # rows of the other parity lie half a cell beside
        centre = column + (shift if row % 2 else -shift)
        start_odd, stop_odd = columns_in_reach(geometry, centre, limit, tables[1])
        _gaussians(tables[1], start_odd, stop_odd, scale)
    for i in range(found):
        if apart[i] > limit:
            continue
        other = rows[i]
        beside = int(shift > 0.0 and (other - row) % 2 != 0)
        first, end = (start_odd, stop_odd) if beside else (start, stop)
        distances = squared[other * lanes + first : other * lanes + end]
        gains = tables[2, first:end]
        _row_gains(distances, tables[beside, first:end], rate * exp(-apart[i] / scale), by_distance, gains)
        pull_row(codes, x, other, first, end, tables[2])
