"""Compiled kernels of the maps on lattices: which units are in reach of the winner, and how they move.

Layout and conventions as in `kernels`; `geometry` is what `Lattice.geometry` gives.
"""

from __future__ import annotations

from math import ceil, exp, floor, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from somatopy._jit import jit
from somatopy.maps.kernels import LANES, all_usable, greatest, nearest_lane, unit_at
from somatopy.maps.start import NEGLIGIBLE, faded

__all__ = ["DSOM_PRESETS", "learn_dsom", "learn_som"]

Array = NDArray[Any]
Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

DSOM_PRESETS = ("rougier", "schillaci2016", "printed")
ROUGIER, SCHILLACI, PRINTED = range(3)  # places in the presets
LEAST = 1e-300  # what is divided by stays above 0
U = np.uint64


@jit
def _span(place: int, count: int, reach: float, wraps: bool) -> tuple[int, int]:
    """First place, and number of places, within `reach` places along an axis; places wrap round its end if it does."""
    steps = int(min(reach, float(count)))
    if not wraps:
        low = max(place - steps, 0)
        return low, min(place + steps, count - 1) - low + 1
    if 2 * steps + 1 >= count:
        return 0, count
    return (place - steps) % count, 2 * steps + 1


@jit
def _rows_in_reach(geometry: Floats, row: int, limit: float, rows: Integers, apart: Floats) -> int:
    """Write rows whose squared distance from `row` is at most about `limit`, and those distances; return how many."""
    rows[0], apart[0], found, before = 0, 0.0, 1, 1
    for axis in range(geometry.shape[0] - 1):
        before *= int(geometry[axis, 0])
    for axis in range(geometry.shape[0] - 1):
        count, spacing, wraps = int(geometry[axis, 0]), geometry[axis, 1], geometry[axis, 2] > 0
        before //= count
        place = row // before % count
        start, span = _span(place, count, sqrt(limit) / spacing, wraps)
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
def _columns_in_reach(geometry: Floats, centre: float, limit: float, apart: Array) -> tuple[int, int]:
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
def _pull(codes: Array, x: Array, row: int, start: int, stop: int, gains: Array) -> None:
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
def _pull_by_gaussian(
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
    found, shift = _rows_in_reach(geometry, row, limit, rows, apart), geometry[-1, 3]
    start, stop = _columns_in_reach(geometry, float(column), limit, tables[0])
    _gaussians(tables[0], start, stop, scale)
    start_odd, stop_odd = start, stop
    if shift > 0.0:  # rows of the other parity lie half a cell beside
        centre = column + (shift if row % 2 else -shift)
        start_odd, stop_odd = _columns_in_reach(geometry, centre, limit, tables[1])
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
        _pull(codes, x, other, first, end, tables[2])


@jit
def _pull_each(
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
    own: bool,
) -> None:
    """Pull the codes around lane `at` by rate * their distance * exp(-lattice distance / scale).

    By their `own` distance the exponential is exp(-lattice distance^2 / (scale * their distance^2)), of all codes.
    """
    lanes = codes.shape[2]
    row, column, limit = at // lanes, at % lanes, np.inf if own else (NEGLIGIBLE * scale) ** 2
    found, shift = _rows_in_reach(geometry, row, limit, rows, apart), geometry[-1, 3]
    for i in range(found):
        other = rows[i]
        centre = column + (shift * ((row % 2) - (other % 2)) if shift > 0.0 else 0.0)
        start, stop = _columns_in_reach(geometry, centre, limit, tables[0])
        for lane in range(start, stop):
            away, distance = apart[i] + tables[0, lane], squared[other * lanes + lane]
            decay = away / max(scale * distance, LEAST) if own else sqrt(away) / scale
            tables[2, lane] = min(sqrt(distance) * rate * exp(-decay), 1.0)
        _pull(codes, x, other, start, stop, tables[2])


@jit
def learn_dsom(
    codes: Array,
    geometry: Floats,
    dims: int,
    missing: bool,
    memory: Floats,
    work: Array,
    samples: Array,
    rate: float,
    elasticity: float,
    preset: int,
) -> int:
    """Learn the samples in their order (equations 1 and 2, as `DSOM` states them).

    Args:
        codes: the codebook, (padded dims, rows, lanes); changed.
        geometry: of the lattice; normalised unless the preset counts in cells.
        dims: dimensions of the samples.
        missing: whether values of the samples may be missing.
        memory: greatest squared distance between any unit and any input so far, and number of inputs; changed.
        work: scratch.
        samples: shape (n, padded dims), n at least 1.
        rate: learning rate.
        elasticity: elasticity.
        preset: place of the preset in `DSOM_PRESETS`.

    Returns:
        The winner of the last sample before its update; -1, and nothing has changed, if a value is not usable.
    """
    if not all_usable(samples, dims, missing):
        return -1
    padded, rows, lanes = codes.shape
    flat, at = codes.reshape(padded, rows * lanes), 0
    found, apart, tables = np.empty(rows, np.int64), np.empty(rows), np.empty((3, lanes), codes.dtype)
    for t in range(samples.shape[0]):
        x = samples[t]
        at = nearest_lane(flat, x, dims, work)
        memory[0] = max(memory[0], greatest(work))
        memory[1] += 1.0
        nearest = float(work[at])
        if nearest == 0.0:
            continue
        pace, squared_elasticity = rate / sqrt(memory[0]), elasticity * elasticity
        if preset == ROUGIER:
            scale = max(squared_elasticity * (nearest / memory[0]), LEAST)
            _pull_by_gaussian(codes, geometry, x, work, at, found, apart, tables, pace, scale, True)
        else:
            own = preset == PRINTED
            scale = squared_elasticity / memory[0] if own else max(squared_elasticity * sqrt(nearest), LEAST)
            _pull_each(codes, geometry, x, work, at, found, apart, tables, pace if own else rate, scale, own)
    return unit_at(at, lanes, int(geometry[-1, 0]))


@jit
def learn_som(
    codes: Array,
    geometry: Floats,
    dims: int,
    missing: bool,
    memory: Floats,
    work: Array,
    samples: Array,
    schedule: Floats,
) -> int:
    """Learn the samples in their order (the equation of `SOM`).

    Args:
        codes: the codebook, (padded dims, rows, lanes); changed.
        geometry: of the lattice, in cells.
        dims: dimensions of the samples.
        missing: whether values of the samples may be missing.
        memory: number of inputs so far; changed.
        work: scratch.
        samples: shape (n, padded dims), n at least 1.
        schedule: first and last learning rate, first and last width, horizon.

    Returns:
        The winner of the last sample before its update; -1, and nothing has changed, if a value is not usable.
    """
    if not all_usable(samples, dims, missing):
        return -1
    padded, rows, lanes = codes.shape
    flat, at = codes.reshape(padded, rows * lanes), 0
    found, apart, tables = np.empty(rows, np.int64), np.empty(rows), np.empty((3, lanes), codes.dtype)
    for t in range(samples.shape[0]):
        at = nearest_lane(flat, samples[t], dims, work)
        rate = faded(schedule[0], schedule[1], memory[0], schedule[4])
        width = faded(schedule[2], schedule[3], memory[0], schedule[4])
        memory[0] += 1.0
        _pull_by_gaussian(
            codes, geometry, samples[t], work, at, found, apart, tables, rate, max(2.0 * width * width, LEAST), False
        )
    return unit_at(at, lanes, int(geometry[-1, 0]))
