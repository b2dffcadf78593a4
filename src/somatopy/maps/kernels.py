"""Compiled kernels that all maps share: distances and winners, in single or double precision.

A codebook lies here as one array a dimension, (dims, rows, lanes). Lanes behind the last column are copies of it: they
tie with it and come later, so they never win, and whole vectors of lanes can be worked through without a remainder.
Dimensions of the codes are filled up with zeros, and each sample is copied to an array that is filled up likewise,
which leaves every distance as it is. `sheet.Sheet` makes and reads this layout. A value that is missing (NaN) is left
out of the distance, and the rest is scaled up to the full number of dimensions.

None of these functions draws random numbers.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from somatopy._jit import jit

__all__ = [
    "LANES",
    "LARGEST",
    "LARGEST_SINGLE",
    "all_usable",
    "first_least",
    "least_and_greatest",
    "nearest",
    "nearest_lane",
    "nearest_now",
    "padded_dims",
    "read_sample",
    "squared_distances",
    "squared_from_units",
    "unit_at",
    "winners",
]

Array = NDArray[Any]  # float32 or float64, one kind in all arguments of a call
Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

LANES = 16
LARGEST, LARGEST_SINGLE = 1e150, 1e15  # sums of squares of what is larger may leave the range of the precision
U = np.uint64  # unsigned indices spare the compiler Python's meaning of negative ones
BLOCK = U(96)


def padded_dims(dims: int) -> int:
    """The number of dimensions that the kernels work through: 2, or a multiple of 4."""
    return 2 if dims <= 2 else -(-dims // 4) * 4


@jit
def read_sample(samples: Array, t: int, x: Array) -> None:
    """Copy sample t to the start of x, whose other values are 0 and stay so."""
    for k in range(samples.shape[1]):
        x[k] = samples[t, k]


@jit
def all_usable(samples: Array, missing: bool) -> bool:
    """Whether all values are finite and not too large; where values may be missing, each row must have one."""
    limit, refused = LARGEST_SINGLE if samples.itemsize == 4 else LARGEST, 0
    for t in range(samples.shape[0]):
        absent = 0
        for k in range(samples.shape[1]):
            value = samples[t, k]
            absent += int(value != value)
            refused += int(abs(value) > limit)
        refused += int(absent == samples.shape[1] if missing else absent > 0)
    return refused == 0


@jit
def _two(a: Array, b: Array, x: Array, out: Array) -> None:
    x0, x1 = x[0], x[1]
    for i in range(out.size):
        d0, d1 = x0 - a[i], x1 - b[i]
        out[i] = d0 * d0 + d1 * d1


@jit
def _four(a: Array, b: Array, c: Array, d: Array, x: Array, out: Array) -> None:
    x0, x1, x2, x3 = x[0], x[1], x[2], x[3]
    for i in range(out.size):
        d0, d1, d2, d3 = x0 - a[i], x1 - b[i], x2 - c[i], x3 - d[i]
        out[i] = ((d0 * d0 + d1 * d1) + d2 * d2) + d3 * d3


@jit
def _four_more(a: Array, b: Array, c: Array, d: Array, x: Array, out: Array) -> None:
    x0, x1, x2, x3 = x[0], x[1], x[2], x[3]
    for i in range(out.size):
        d0, d1, d2, d3 = x0 - a[i], x1 - b[i], x2 - c[i], x3 - d[i]
        out[i] += ((d0 * d0 + d1 * d1) + d2 * d2) + d3 * d3


@jit
def _observed(codes: Array, x: Array, dims: int, out: Array) -> None:
    """Squared distances in the dimensions that were observed, scaled up to all of them."""
    out[:] = 0
    observed = 0
    for k in range(dims):
        target, code = x[k], codes[k]
        if target == target:
            observed += 1
            for i in range(out.size):
                out[i] += (target - code[i]) * (target - code[i])
    if observed < dims:
        out *= out.dtype.type(dims / observed)


@jit
def squared_distances(codes: Array, x: Array, dims: int, out: Array) -> None:
    """Write the squared distance of each lane of the flat codes (padded dims, lanes) from x to `out`."""
    absent = 0
    for k in range(dims):
        absent += int(x[k] != x[k])
    if absent:
        _observed(codes, x, dims, out)
    elif codes.shape[0] == 2:
        _two(codes[0], codes[1], x, out)
    else:
        _four(codes[0], codes[1], codes[2], codes[3], x, out)
        for k in range(4, codes.shape[0], 4):
            _four_more(codes[k], codes[k + 1], codes[k + 2], codes[k + 3], x[k : k + 4], out)


@jit
def _least_bits(bits: Array) -> int:
    """The least bit pattern.

    Patterns of non-negative floats have the order of the floats, and a compiler turns reductions of integers, but not
    those of floats, into vector instructions.
    """
    least = bits[0]
    for i in range(bits.size):
        least = min(least, bits[i])
    return int(least)


@jit
def _first_bits(bits: Array, pattern: int) -> int:
    size, start = U(bits.size), U(0)
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
def _extreme_bits(bits: Array) -> tuple[int, int]:
    """The least and the greatest bit pattern."""
    least = most = bits[0]
    for i in range(bits.size):
        least, most = min(least, bits[i]), max(most, bits[i])
    return least, most


@jit
def first_least(squared: Array) -> int:
    """The first place of the least of values that are not negative."""
    if squared.itemsize == 4:
        single = squared.view(np.int32)
        return _first_bits(single, _least_bits(single))
    double = squared.view(np.int64)
    return _first_bits(double, _least_bits(double))


@jit
def least_and_greatest(squared: Array) -> tuple[int, float]:
    """The first place of the least, and the greatest, of values that are not negative."""
    if squared.itemsize == 4:
        single = squared.view(np.int32)
        least, most = _extreme_bits(single)
        return _first_bits(single, least), float(np.int32(most).view(np.float32))
    double = squared.view(np.int64)
    least, most = _extreme_bits(double)
    return _first_bits(double, least), float(np.int64(most).view(np.float64))


@jit
def nearest_lane(codes: Array, x: Array, dims: int, squared: Array) -> int:
    """The lane of the unit nearest to `x`; all squared distances are left in `squared`."""
    squared_distances(codes, x, dims, squared)
    return first_least(squared)


@jit
def unit_at(lane: int, lanes: int, columns: int) -> int:
    """The number of the unit, row by row, that lies at a lane of the whole codebook."""
    return lane // lanes * columns + lane % lanes


@jit
def _scratch(codes: Array, columns: int) -> Array:
    """Room for the distance of each lane. Lanes behind the last column of a single row may hold anything: left out."""
    rows, lanes = codes.shape[1], codes.shape[2]
    return np.empty(columns if rows == 1 else rows * lanes, codes.dtype)


@jit
def nearest(codes: Array, columns: int, missing: bool, samples: Array) -> tuple[int, float]:
    """Unit nearest to the first sample (1, dims), and its Euclidean distance; unit -1 if the sample is not usable."""
    if not all_usable(samples, missing):
        return -1, 0.0
    padded, rows, lanes = codes.shape
    work, x = _scratch(codes, columns), np.zeros(padded, codes.dtype)
    read_sample(samples, 0, x)
    at = nearest_lane(codes.reshape(padded, rows * lanes), x, samples.shape[1], work)
    return unit_at(at, lanes, columns), float(sqrt(work[at]))


@jit
def nearest_now(codes: Array, columns: int, x: Array, dims: int, work: Array) -> tuple[int, float]:
    """What `nearest` gives for a padded sample that is known to be usable; `work` is scratch for all lanes."""
    padded, rows, lanes = codes.shape
    at = nearest_lane(codes.reshape(padded, rows * lanes), x, dims, work)
    return unit_at(at, lanes, columns), float(sqrt(work[at]))


@jit
def winners(codes: Array, columns: int, samples: Array, out: Integers) -> None:
    """Write the unit nearest to each sample (n, dims) to `out`."""
    padded, rows, lanes = codes.shape
    flat, work, x = codes.reshape(padded, rows * lanes), _scratch(codes, columns), np.zeros(padded, codes.dtype)
    for t in range(samples.shape[0]):
        read_sample(samples, t, x)
        out[t] = unit_at(nearest_lane(flat, x, samples.shape[1], work), lanes, columns)


@jit
def squared_from_units(codes: Array, columns: int, samples: Array, out: Floats) -> None:
    """Write the squared distance of each sample (n, dims) from each unit to `out`, (n, units)."""
    padded, rows, lanes = codes.shape
    flat, work, x = codes.reshape(padded, rows * lanes), _scratch(codes, columns), np.zeros(padded, codes.dtype)
    for t in range(samples.shape[0]):
        read_sample(samples, t, x)
        squared_distances(flat, x, samples.shape[1], work)
        for row in range(rows):
            for column in range(columns):
                out[t, row * columns + column] = work[row * lanes + column]
