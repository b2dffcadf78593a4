"""Compiled kernels that the maps on lattices share: which units are in reach of the winner, and how they move.

Layout and conventions as in `kernels`; `geometry` is what `Lattice.geometry` gives.
"""

from __future__ import annotations

from math import ceil, exp, floor, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from somatopy._jit import jit, jit_inlined
from somatopy.maps.kernels import LANES
from somatopy.maps.start import NEGLIGIBLE

__all__ = ["GAINS", "LEAST", "TABLES", "columns_in_reach", "pull_by_gaussian", "pull_row", "rows_in_reach"]

Array = NDArray[Any]
Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

LEAST = 1e-300  # what is divided by stays above 0

# Rows of the scratch tables, of which each has a value a lane: squared distances from the winner along its row, their
# Gaussians, the least of these distances in each block of lanes, and the gains of one row. The same follows for rows
# that are shifted against the winner's.
APART, GAUSS, BLOCKS, GAINS, BESIDE = range(5)
TABLES = 2 * BESIDE
U = np.uint64  # unsigned indices spare the compiler Python's meaning of negative ones


@jit_inlined
def _places_in_reach(place: int, count: int, reach: float, wraps: bool) -> tuple[int, int]:
    """First place, and number of places, within `reach` places along an axis; places wrap round its end if it does."""
    steps = int(min(reach, float(count)))
    if not wraps:
        low = max(place - steps, 0)
        return low, min(place + steps, count - 1) - low + 1
    if 2 * steps + 1 >= count:
        return 0, count
    return (place - steps) % count, 2 * steps + 1


@jit_inlined
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
                other = start + j
                if other >= count:
                    other -= count
                steps = abs(other - place)
                if wraps:
                    steps = min(steps, count - steps)
                rows[i * span + j] = rows[i] * count + other
                apart[i * span + j] = apart[i] + (steps * spacing) ** 2
        found *= span
    return found


@jit_inlined
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


@jit_inlined
def _pull_lanes(code: Array, target: float, start: int, stop: int, gains: Array) -> None:
    for lane in range(U(start), U(stop)):
        code[lane] += gains[lane] * (target - code[lane])


@jit_inlined
def pull_row(codes: Array, x: Array, row: int, start: int, stop: int, gains: Array) -> None:
    """Move the lanes from start to stop of a row towards x by their gains, in the coordinates of x that are known."""
    for k in range(codes.shape[0]):
        if x[k] == x[k]:
            _pull_lanes(codes[k, row], x[k], start, stop, gains)


@jit_inlined
def _tabulate(geometry: Floats, centre: float, limit: float, scale: float, tables: Array) -> tuple[int, int]:
    """Fill the tables for a row whose winner lies, or would lie, at `centre`; the range of lanes written."""
    apart, gauss, blocks, twice = tables[APART], tables[GAUSS], tables[BLOCKS], int(2.0 * centre)
    start, stop = columns_in_reach(geometry, centre, limit, apart)
    for lane in range(start, stop):
        mirrored = twice - lane
        if apart[lane] == np.inf:
            gauss[lane] = 0.0
        elif start <= mirrored < lane and apart[mirrored] == apart[lane]:
            gauss[lane] = gauss[mirrored]
        else:
            gauss[lane] = exp(-apart[lane] / scale)
    for block in range(start // LANES, stop // LANES):
        blocks[block] = apart[block * LANES : (block + 1) * LANES].min()
    return start, stop


@jit_inlined
def _across(tables: Array, left: int, right: int, start: int, stop: int, apart: float, scale: float) -> float:
    """exp(-apart / scale), read from the tables where the left or the right of two lanes is exactly as far."""
    if start <= left and tables[APART, left] == apart:
        return float(tables[GAUSS, left])
    if right < stop and tables[APART, right] == apart:
        return float(tables[GAUSS, right])
    return exp(-apart / scale)


@jit_inlined
def _lanes_within(blocks: Array, start: int, stop: int, left: float) -> tuple[int, int]:
    """What is left of a range of lanes without the blocks at its ends that are farther than a squared distance."""
    first, last = start // LANES, stop // LANES
    while first < last and blocks[first] > left:
        first += 1
    while last > first and blocks[last - 1] > left:
        last -= 1
    return first * LANES, last * LANES


@jit_inlined
def _row_gains(
    distances: Array, along: Array, start: int, stop: int, factor: float, by_distance: bool, gains: Array
) -> None:
    """The gain of each lane of a row: factor * its Gaussian along the row, times its distance from x if so."""
    f = gains.dtype.type(factor)
    if by_distance:
        for lane in range(U(start), U(stop)):
            gains[lane] = np.sqrt(distances[lane]) * f * along[lane]
    else:
        for lane in range(U(start), U(stop)):
            gains[lane] = f * along[lane]


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

    The Gaussian is the product of one along the row and one across the rows, so that few exponentials are needed, and
    only the lanes within reach are worked on, in whole blocks.
    """
    lanes = codes.shape[2]
    row, column, limit, shift = at // lanes, at % lanes, NEGLIGIBLE * scale, geometry[-1, 3]
    found, own, beside = rows_in_reach(geometry, row, limit, rows, apart), tables[:BESIDE], tables[BESIDE:]
    start, stop = _tabulate(geometry, float(column), limit, scale, own)
    start_beside, stop_beside = start, stop
    if shift > 0.0:  # rows of the other parity lie half a cell beside
        centre = column + (shift if row % 2 else -shift)
        start_beside, stop_beside = _tabulate(geometry, centre, limit, scale, beside)
    for i in range(found):
        other = rows[i]
        steps = abs(other - row)
        factor = rate * _across(own, column - steps, column + steps, start, stop, apart[i], scale)
        if shift > 0.0 and steps % 2 != 0:
            table, first, last = beside, start_beside, stop_beside
        else:
            table, first, last = own, start, stop
        first, last = _lanes_within(table[BLOCKS], first, last, limit - apart[i])
        distances, gains = squared[other * lanes : (other + 1) * lanes], own[GAINS]
        _row_gains(distances, table[GAUSS], first, last, factor, by_distance, gains)
        pull_row(codes, x, other, first, last, gains)
