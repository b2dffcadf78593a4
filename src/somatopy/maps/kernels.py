"""Compiled kernels of the maps on lattices, in double precision.

A codebook lies here as one array a dimension, (dims, rows, lanes). Lanes behind the last column are copies of it: they
tie with it and come later, so they never win, and whole vectors of lanes can be worked through without a remainder.
Dimensions are filled up with zeros, in the codes and in the samples alike, which leaves every distance as it is.
`lattice.Sheet` makes and reads this layout.

None of these functions allocates or draws random numbers; `work` (of `work_size`) is where they keep what they need.
"""

from __future__ import annotations

from math import exp, sqrt

import numpy as np
from numpy.typing import NDArray

from somatopy._jit import jit

__all__ = ["LANES", "LARGEST", "all_usable", "learn_dsom", "nearest", "padded_dims", "winners", "work_size"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

LANES = 16
LARGEST = 1e150  # squares of what is larger leave the range of a double
NEGLIGIBLE = 37.0  # exp(-37) is under 1e-16: what moves less than that does not move
U = np.uint64  # unsigned indices spare the compiler Python's meaning of negative ones
BLOCK = U(96)


def padded_dims(dims: int) -> int:
    """The number of dimensions that the kernels work through: 2, or a multiple of 4."""
    return 2 if dims <= 2 else -(-dims // 4) * 4


def work_size(rows: int, lanes: int) -> int:
    """Length of the scratch array: a distance a unit, gains and column factors a lane, row factors."""
    return rows * lanes + 2 * lanes + rows


@jit
def all_usable(samples: Floats) -> bool:
    """Whether no value is NaN, infinite or so large that its square would be."""
    refused = 0
    for value in samples.flat:
        refused += int(not abs(value) <= LARGEST)
    return refused == 0


@jit
def _two(a: Floats, b: Floats, x: Floats, out: Floats) -> None:
    x0, x1 = x[0], x[1]
    for i in range(out.size):
        d0, d1 = x0 - a[i], x1 - b[i]
        out[i] = d0 * d0 + d1 * d1


@jit
def _four(a: Floats, b: Floats, c: Floats, d: Floats, x: Floats, out: Floats) -> None:
    x0, x1, x2, x3 = x[0], x[1], x[2], x[3]
    for i in range(out.size):
        d0, d1, d2, d3 = x0 - a[i], x1 - b[i], x2 - c[i], x3 - d[i]
        out[i] = ((d0 * d0 + d1 * d1) + d2 * d2) + d3 * d3


@jit
def _four_more(a: Floats, b: Floats, c: Floats, d: Floats, x: Floats, out: Floats) -> None:
    x0, x1, x2, x3 = x[0], x[1], x[2], x[3]
    for i in range(out.size):
        d0, d1, d2, d3 = x0 - a[i], x1 - b[i], x2 - c[i], x3 - d[i]
        out[i] += ((d0 * d0 + d1 * d1) + d2 * d2) + d3 * d3


@jit
def _squared_distances(codes: Floats, x: Floats, out: Floats) -> None:
    if codes.shape[0] == 2:
        _two(codes[0], codes[1], x, out)
        return
    _four(codes[0], codes[1], codes[2], codes[3], x, out)
    for k in range(4, codes.shape[0], 4):
        _four_more(codes[k], codes[k + 1], codes[k + 2], codes[k + 3], x[k : k + 4], out)


@jit
def _extremes(squared: Floats) -> tuple[int, int]:
    """The bit patterns of the least and the greatest distance.

    Patterns of non-negative doubles have the order of the doubles, and a compiler turns reductions of integers, but
    not those of doubles, into vector instructions.
    """
    bits = squared.view(np.int64)
    least = greatest = bits[0]
    for i in range(bits.size):
        least = min(least, bits[i])
        greatest = max(greatest, bits[i])
    return least, greatest


@jit
def _first(squared: Floats, pattern: int) -> int:
    bits, size = squared.view(np.int64), U(squared.size)
    start = U(0)
    while start < size:
        found = np.int64(0)
        for i in range(start, min(start + BLOCK, size)):
            found |= np.int64(bits[i] == pattern)
        if found:
            break
        start += BLOCK
    while bits[start] != pattern:
        start += U(1)
    return int(np.int64(start))


@jit
def _nearest(codes: Floats, x: Floats, squared: Floats) -> tuple[int, float]:
    """The lane of the unit nearest to `x`, and the greatest squared distance of all units."""
    _squared_distances(codes, x, squared)
    least, greatest = _extremes(squared)
    return _first(squared, least), np.int64(greatest).view(np.float64)


@jit
def _unit(lane: int, lanes: int, columns: int) -> int:
    """The number of the unit, row by row, that lies at a lane of the whole codebook."""
    return lane // lanes * columns + lane % lanes


@jit
def nearest(codes: Floats, columns: int, work: Floats, samples: Floats) -> tuple[int, float]:
    """Unit nearest to the first sample, and its Euclidean distance; unit -1 if the sample is not usable."""
    if not all_usable(samples):
        return -1, 0.0
    dims, rows, lanes = codes.shape
    squared = work[: rows * lanes]
    at, _ = _nearest(codes.reshape(dims, rows * lanes), samples[0], squared)
    return _unit(at, lanes, columns), sqrt(squared[at])


@jit
def winners(codes: Floats, columns: int, work: Floats, samples: Floats, out: Integers) -> None:
    """Write the unit nearest to each sample to `out`."""
    dims, rows, lanes = codes.shape
    flat, squared = codes.reshape(dims, rows * lanes), work[: rows * lanes]
    for t in range(samples.shape[0]):
        at, _ = _nearest(flat, samples[t], squared)
        out[t] = _unit(at, lanes, columns)


@jit
def _falloff(factors: Floats, centre: int, count: int, spacing: float, scale: float) -> tuple[int, int]:
    """Fill one axis' factors of the Gaussian exp(-distance^2 / scale) where they matter; return that range."""
    reach = 0
    if count > 1:
        reach = int(min(sqrt(NEGLIGIBLE * scale) / spacing, count - 1.0))
    low, high = max(centre - reach, 0), min(centre + reach, count - 1)
    factors[centre] = 1.0
    for step in range(1, reach + 1):
        factor = exp(-((step * spacing) ** 2) / scale)
        if centre - step >= low:
            factors[centre - step] = factor
        if centre + step <= high:
            factors[centre + step] = factor
    return low, high + 1


@jit
def _whole_lanes(factors: Floats, low: int, high: int, columns: int) -> tuple[int, int]:
    """Widen a range of columns to whole vectors: nothing moves beside it, copies of the last column move like it."""
    start, stop = low // LANES * LANES, (high + LANES - 1) // LANES * LANES
    factors[start:low] = 0.0
    factors[high:stop] = factors[columns - 1] if high == columns else 0.0
    return start, stop


@jit
def _pull(codes: Floats, x: Floats, row: int, start: int, stop: int, gains: Floats) -> None:
    for k in range(codes.shape[0]):
        target, code = x[k], codes[k, row]
        for lane in range(U(start), U(stop)):
            code[lane] += gains[lane] * (target - code[lane])


@jit
def _move(
    codes: Floats, columns: int, x: Floats, squared: Floats, at: int, tables: Floats, rate: float, scale: float
) -> None:
    """Pull the codes around lane `at` towards x by rate * their distance * the Gaussian of their lattice distance."""
    _, rows, lanes = codes.shape
    gains, across, down = tables[:lanes], tables[lanes : 2 * lanes], tables[2 * lanes :]
    axes = sqrt(float((rows > 1) + (columns > 1)))
    low, high = _falloff(across, at % lanes, columns, 1.0 / (max(columns - 1, 1) * axes), scale)
    start, stop = _whole_lanes(across, low, high, columns)
    top, bottom = _falloff(down, at // lanes, rows, 1.0 / (max(rows - 1, 1) * axes), scale)
    for row in range(top, bottom):
        distances, factor = squared[row * lanes : (row + 1) * lanes], rate * down[row]
        for lane in range(U(start), U(stop)):
            gains[lane] = sqrt(distances[lane]) * factor * across[lane]
        _pull(codes, x, row, start, stop, gains)


@jit
def learn_dsom(
    codes: Floats, columns: int, memory: Floats, work: Floats, samples: Floats, rate: float, elasticity: float
) -> int:
    """Learn the samples in their order (equations 1 and 2, as `DSOM` states them).

    Args:
        codes: the codebook, (dims, rows, lanes); changed.
        columns: columns of the lattice.
        memory: greatest squared distance between any unit and any input so far, and number of inputs; changed.
        work: scratch, of `work_size`.
        samples: shape (n, dims), n at least 1.
        rate: learning rate.
        elasticity: elasticity.

    Returns:
        The winner of the last sample before its update; -1, and nothing has changed, if a value is not usable.
    """
    if not all_usable(samples):
        return -1
    dims, rows, lanes = codes.shape
    flat, squared, tables = codes.reshape(dims, rows * lanes), work[: rows * lanes], work[rows * lanes :]
    at = 0
    for t in range(samples.shape[0]):
        at, farthest = _nearest(flat, samples[t], squared)
        memory[0] = max(memory[0], farthest)
        memory[1] += 1.0
        if squared[at] > 0.0:
            scale = elasticity * elasticity * (squared[at] / memory[0])
            _move(codes, columns, samples[t], squared, at, tables, rate / sqrt(memory[0]), scale)
    return _unit(at, lanes, columns)
