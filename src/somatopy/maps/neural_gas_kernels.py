"""Compiled kernels of the neural gas: which units are nearest, in order, and how they move.

Layout and conventions as in `kernels`.
"""

from __future__ import annotations

from math import ceil, exp
from typing import Any

import numpy as np
from numpy.typing import NDArray

from somatopy._jit import jit
from somatopy.maps.kernels import all_usable, squared_distances
from somatopy.maps.start import NEGLIGIBLE, faded

__all__ = ["learn_neural_gas"]

Array = NDArray[Any]
Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

U = np.uint64  # unsigned indices spare the compiler Python's meaning of negative ones
BLOCK = U(96)


@jit
def _farther(squared: Array, a: int, b: int) -> bool:
    """Whether unit a ranks behind unit b: by distance, equal ones by number."""
    return bool(squared[a] > squared[b] or (squared[a] == squared[b] and a > b))


@jit
def _sink(heap: Integers, size: int, squared: Array) -> None:
    """Put the first of a heap, of which the farthest unit comes first, into its place."""
    place = 0
    while 2 * place + 1 < size:
        child = 2 * place + 1
        if child + 1 < size and _farther(squared, heap[child + 1], heap[child]):
            child += 1
        if not _farther(squared, heap[child], heap[place]):
            return
        heap[place], heap[child] = heap[child], heap[place]
        place = child


@jit
def _rise(heap: Integers, place: int, squared: Array) -> None:
    while place > 0 and _farther(squared, heap[place], heap[(place - 1) // 2]):
        heap[place], heap[(place - 1) // 2] = heap[(place - 1) // 2], heap[place]
        place = (place - 1) // 2


@jit
def _gather(squared: Array, units: int, count: int, heap: Integers) -> None:
    """Fill the heap with the `count` nearest of the units.

    Once it is full, most blocks of units hold none that is nearer than its farthest, which vectors tell at once.
    """
    for unit in range(count):
        heap[unit] = unit
        _rise(heap, unit, squared)
    start, end = U(count), U(units)
    while start < end:
        stop, nearer, limit = min(start + BLOCK, end), np.int64(0), squared[heap[0]]
        for unit in range(start, stop):
            nearer |= np.int64(squared[unit] < limit)
        if nearer:
            for unit in range(np.int64(start), np.int64(stop)):
                if squared[unit] < squared[heap[0]]:
                    heap[0] = unit
                    _sink(heap, count, squared)
        start = stop


@jit
def _pull(codes: Array, x: Array, unit: int, gain: float) -> None:
    for k in range(codes.shape[0]):
        if x[k] == x[k]:
            codes[k, unit] += gain * (x[k] - codes[k, unit])


@jit
def learn_neural_gas(
    codes: Array,
    units: int,
    dims: int,
    missing: bool,
    memory: Floats,
    work: Array,
    samples: Array,
    schedule: Floats,
) -> int:
    """Learn the samples in their order (the equation of `NeuralGas`).

    Args:
        codes: the codebook, (padded dims, 1, lanes); changed.
        units: how many; lanes behind them are copies of the last.
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
    flat, heap, winner = codes[:, 0], np.empty(units, np.int64), 0
    for t in range(samples.shape[0]):
        rate = faded(schedule[0], schedule[1], memory[0], schedule[4])
        width = faded(schedule[2], schedule[3], memory[0], schedule[4])
        memory[0] += 1.0
        squared_distances(flat, samples[t], dims, work)
        count = int(min(ceil(NEGLIGIBLE * width), units))
        _gather(work, units, count, heap)
        for rank in range(count - 1, -1, -1):  # the farthest leaves the heap first
            winner = heap[0]
            _pull(flat, samples[t], winner, rate * exp(-rank / width))
            heap[0] = heap[rank]
            _sink(heap, rank, work)
        flat[:, units:] = flat[:, units - 1 : units]
    return winner
