"""Recall: what was known before a surprise is kept, and comes back when it explains again what is seen."""

from __future__ import annotations

import math

import numpy as np

from somatopy._jit import jit, jit_inlined
from somatopy.learners.best.directions import NEAREST, active, direction, powers
from somatopy.learners.best.memory import (
    FAST_ERROR,
    FORGOTTEN,
    KEPT,
    KEPT_ERROR,
    KEPT_UNITS,
    KNOWN_ERROR,
    LASTING,
    MOST_UNITS,
    SLOW_ERROR,
    SURPRISE,
    TRIED,
    UNITS,
    Memory,
    write,
)
from somatopy.learners.best.schema import ERROR_MOST
from somatopy.percept import Floats

__all__ = ["recall"]

KEEP_ABOVE, OVER_BELOW = 0.2, 0.1
TRIED_LEAST, TRIED_RATE, BETTER = 30, 0.05, 0.5


@jit
def recall(memory: Memory, posture: Floats, head: Floats, pixel: Floats, error: Floats) -> bool:
    """After a hit: keep what is known if a surprise lasts, and exchange it for what is kept if that is twice as good.

    What is known is kept when lambda exceeds .2, once in a surprise; a surprise is over when lambda is below .1. While
    kappa is above 0, averages are taken of |e| and of the error that what is kept would have made. If after 30 hits or
    more the latter is less than half of the former, the two change places, and the surprise is over. This is the
    choice among paired models by their errors of Wolpert and Kawato (1998), between two of them.

    Args:
        memory: what the learner holds.
        posture: sensed arm posture in [0, 1] units, without c, shape (n,).
        head: y, shape (m,), rad.
        pixel: p, shape (2,).
        error: e, where the hand was less where it was expected, shape (m,), rad.

    Returns:
        Whether what was kept is known again.
    """
    numbers = memory.numbers
    if numbers[SURPRISE] == 0.0:
        numbers[TRIED] = 0.0
        if numbers[LASTING] < OVER_BELOW:
            _remember(memory)
    elif numbers[KEPT_UNITS] > 0.0:
        _try(memory, posture, head, pixel, error)
        if numbers[TRIED] >= TRIED_LEAST and numbers[KEPT_ERROR] < BETTER * numbers[KNOWN_ERROR]:
            _exchange(memory)
            return True
    if numbers[LASTING] < OVER_BELOW:
        numbers[KEPT] = 0.0
    elif numbers[LASTING] > KEEP_ABOVE and numbers[KEPT] == 0.0:
        _keep(memory)
    return False


@jit
def _remember(memory: Memory) -> None:
    """What all postures share, as it is in a calm hit; a surprise changes it before it is known to last."""
    at = _copy(memory.shift, memory.calm, 0)
    at = _copy(memory.plane.ravel(), memory.calm, at)
    at = _copy(memory.common.ravel(), memory.calm, at)
    at = _copy(memory.sway.ravel(), memory.calm, at)
    _copy(memory.gain.ravel(), memory.calm, at)


@jit_inlined
def _copy(part: Floats, into: Floats, at: int) -> int:
    """Copy a part, shape (k,), to a place on; the place after it."""
    write(part, into[at:])
    return at + int(part.size)


@jit
def _try(memory: Memory, posture: Floats, head: Floats, pixel: Floats, error: Floats) -> None:
    """One more hit in the averages of both errors."""
    numbers, first = memory.numbers, MOST_UNITS - int(memory.numbers[KEPT_UNITS])
    index, share = np.empty(NEAREST, np.int64), np.empty(NEAREST)
    n, phi, expected = posture.size, np.empty(memory.plane.shape[1]), np.empty(head.size)
    x, plane = posture + memory.kept[:n], memory.kept[n : n + memory.plane.size].reshape(memory.plane.shape)
    gain = memory.kept[memory.calm.size - memory.gain.size : memory.calm.size].reshape(memory.gain.shape)
    found = active(memory.units[first:], memory.extent, MOST_UNITS - first, x, index, share)
    powers(x, phi)
    direction(plane, memory.turns[first:], phi, index, share, found, expected)
    numbers[TRIED] += 1.0
    rate = max(TRIED_RATE, 1.0 / numbers[TRIED])
    numbers[KEPT_ERROR] += rate * (_size(head + gain @ pixel - expected) - numbers[KEPT_ERROR])
    numbers[KNOWN_ERROR] += rate * (_size(error) - numbers[KNOWN_ERROR])


@jit
def _size(error: Floats) -> float:
    return float(min(math.sqrt(np.sum(error**2)), ERROR_MOST))


@jit
def _keep(memory: Memory) -> None:
    """Copy what is known; units to the end of the map, the first of them last. There is no room if it is half full."""
    numbers, count = memory.numbers, int(memory.numbers[UNITS])
    numbers[KEPT], numbers[TRIED] = 1.0, 0.0
    numbers[KEPT_UNITS] = count if 2 * count <= MOST_UNITS else 0
    for unit in range(int(numbers[KEPT_UNITS])):
        place, voice = MOST_UNITS - 1 - unit, math.exp(memory.faded[unit] - numbers[FORGOTTEN])
        memory.used[place] = memory.used[unit]
        write(memory.units[unit], memory.units[place])
        write(voice * memory.turns[unit], memory.turns[place])
        write(voice * memory.fields[unit], memory.fields[place])
    _copy(memory.metric.ravel(), memory.kept, _copy(memory.calm, memory.kept, 0))


@jit
def _exchange(memory: Memory) -> None:
    """What is known and what is kept change places; the surprise, and what the last hits said, are over."""
    numbers = memory.numbers
    count, kept = numbers[UNITS], numbers[KEPT_UNITS]
    for unit in range(int(max(count, kept))):
        place = MOST_UNITS - 1 - unit
        voice = math.exp(memory.faded[unit] - numbers[FORGOTTEN])
        write(voice * memory.turns[unit], memory.turns[unit])
        write(voice * memory.fields[unit], memory.fields[unit])
        memory.faded[unit] = numbers[FORGOTTEN]
        memory.used[unit], memory.used[place] = memory.used[place], memory.used[unit]
        _swap(memory.units[unit], memory.units[place])
        _swap(memory.turns[unit], memory.turns[place])
        _swap(memory.fields[unit], memory.fields[place])
    numbers[UNITS], numbers[KEPT_UNITS] = kept, count
    _swap(memory.calm, memory.kept)
    at = memory.calm.size
    _swap(memory.metric.ravel(), memory.kept[at:])
    parts = (memory.gain.ravel(), memory.sway.ravel(), memory.common.ravel(), memory.plane.ravel(), memory.shift)
    for part in parts:
        at -= part.size
        write(memory.calm[at : at + part.size], part)
    memory.drift[:] = 0.0
    numbers[FAST_ERROR] = numbers[SLOW_ERROR]
    numbers[SURPRISE], numbers[LASTING], numbers[KEPT], numbers[TRIED] = 0.0, 0.0, 0.0, 0.0


@jit
def _swap(a: Floats, b: Floats) -> None:
    """Exchange what two arrays hold, shape (k,)."""
    for i in range(a.size):
        a[i], b[i] = b[i], a[i]
