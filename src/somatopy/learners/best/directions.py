"""Where the hand is: the head posture that would centre it, as a polynomial of the felt posture and a map of units."""

from __future__ import annotations

import math

import numpy as np

from somatopy._jit import jit, jit_inlined
from somatopy.learners.best.memory import (
    FORGOTTEN,
    FRAMES,
    KEPT_UNITS,
    METRIC_MOST,
    MOST_UNITS,
    UNITS,
    UNUSED,
    Memory,
    spacing,
    write,
)
from somatopy.percept import Floats, Ints

__all__ = [
    "NEAREST",
    "active",
    "direction",
    "dual_of",
    "find_or_add",
    "learn_direction",
    "learn_extent",
    "powers",
    "powers_turned",
]

NEAREST = 16  # units that may be active
PLANE_RATE, TURN_RATE, DRIFT_RATE, DRIFT_KEPT = 0.2, 0.5, 0.5, 0.9
METRIC_KEPT = 0.9995
EXTENT, EXTENT_LEAST, EXTENT_FRAMES, EXTENT_AGE = 6.0, 0.05, 5000, 300.0


@jit_inlined
def width_of(joints: int) -> float:
    """Width of the units' neighbourhood, in units of `extent`."""
    return spacing(joints) * 0.15 / 0.22


@jit
def active(units: Floats, extent: Floats, count: int, x: Floats, index: Ints, share: Floats) -> int:
    """The nearest units, and their shares a in what the map says at x: Gaussian in the distance, relative to the least.

    Args:
        units: positions, shape (U, n).
        extent: r, units of distance, shape (n,).
        count: how many of them are in use, one at least.
        x: felt posture, shape (n,).
        index: overwritten by the units' indices, the nearest first, shape (16,).
        share: overwritten by their shares, which sum to 1, shape (16,).

    Returns:
        How many units are active.
    """
    found, farthest, scale = 0, np.inf, 1.0 / extent
    for unit in range(count):
        square = 0.0
        for k in range(x.size):
            square += ((units[unit, k] - x[k]) * scale[k]) ** 2
        if square >= farthest:
            continue
        found = min(found + 1, NEAREST)
        place = found - 1
        while place > 0 and share[place - 1] > square:
            index[place], share[place] = index[place - 1], share[place - 1]
            place -= 1
        index[place], share[place] = unit, square
        if found == NEAREST:
            farthest = share[found - 1]
    variance, least, total, kept = width_of(x.size) ** 2, share[0], 0.0, 0
    while kept < found and share[kept] <= least + 6.0 * variance:
        share[kept] = math.exp(-(share[kept] - least) / (2.0 * variance))
        total += share[kept]
        kept += 1
    for place in range(kept):
        share[place] /= total
    return kept


@jit
def learn_extent(memory: Memory, x: Floats) -> None:
    """r = 6 times the mean of |x~ - its mean|, from .05 to 1, over the first 5,000 frames: how far the arm moves.

    It is 1, the whole range of a joint, at first, and this first guess counts as much as 300 frames. So the map begins
    coarse, and an arm that moves in a small part of its range gets as many units as one that moves in all of it.

    Args:
        memory: what the learner holds.
        x: x~, shape (n,).
    """
    frames = memory.numbers[FRAMES]
    if frames <= EXTENT_FRAMES:
        for k in range(x.size):
            memory.middle[k] += (x[k] - memory.middle[k]) / frames
            memory.apart[k] += (abs(x[k] - memory.middle[k]) - memory.apart[k]) / (EXTENT_AGE + frames)
            memory.extent[k] = min(max(EXTENT * memory.apart[k], EXTENT_LEAST), 1.0)


@jit
def find_or_add(memory: Memory, x: Floats, may_add: bool, index: Ints, share: Floats) -> int:
    """The active units at x; far from all there is a new one there first, if there may be, which says nothing yet."""
    numbers = memory.numbers
    count = int(numbers[UNITS])
    found = active(memory.units, memory.extent, count, x, index, share) if count else 0
    if may_add and (found == 0 or _distance(memory.units[index[0]], x, memory.extent) > spacing(x.size)):
        place = count if count < MOST_UNITS else _longest_unused(memory)
        if place >= 0:
            write(x, memory.units[place])
            memory.turns[place], memory.fields[place] = 0.0, 0.0
            memory.faded[place] = numbers[FORGOTTEN]
            numbers[UNITS] = max(count, place + 1)
            if 2 * numbers[UNITS] > MOST_UNITS:  # it takes the place of what is kept
                numbers[KEPT_UNITS] = 0.0
            found = active(memory.units, memory.extent, int(numbers[UNITS]), x, index, share)
    if found:
        memory.used[index[0]] = int(numbers[FRAMES])
    return found


@jit
def _longest_unused(memory: Memory) -> int:
    """The unit that was nearest longest ago, or -1 if that is not long."""
    place = int(np.argmin(memory.used))
    return place if memory.numbers[FRAMES] - memory.used[place] > UNUSED else -1


@jit_inlined
def _distance(a: Floats, b: Floats, extent: Floats) -> float:
    square = 0.0
    for k in range(b.size):
        square += ((a[k] - b[k]) / extent[k]) ** 2
    return math.sqrt(square)


@jit
def powers(x: Floats, out: Floats) -> None:
    """phi: the monomials of 2 x - 1 up to degree 2, shape ((n + 1)(n + 2) / 2,)."""
    n = x.size
    out[0] = 1.0
    place = n + 1
    for i in range(n):
        out[1 + i] = 2.0 * x[i] - 1.0
        for j in range(i, n):
            out[place] = (2.0 * x[i] - 1.0) * (2.0 * x[j] - 1.0)
            place += 1


@jit
def powers_turned(x: Floats) -> Floats:
    """Derivative of phi by x, shape ((n + 1)(n + 2) / 2, n)."""
    n = x.size
    slopes = np.zeros(((n + 1) * (n + 2) // 2, n))
    place = n + 1
    for i in range(n):
        slopes[1 + i, i] = 2.0
        for j in range(i, n):
            slopes[place, i] += 2.0 * (2.0 * x[j] - 1.0)
            slopes[place, j] += 2.0 * (2.0 * x[i] - 1.0)
            place += 1
    return slopes


@jit
def dual_of(memory: Memory, phi: Floats, out: Floats) -> float:
    """q = M phi / (phi' M phi): the change of a polynomial that adds 1 to it at this posture, and little elsewhere.

    Args:
        memory: what the learner holds.
        phi: monomials of the felt posture, shape (Q,).
        out: overwritten by q, shape (Q,).

    Returns:
        phi' M phi, how little is known so far of postures like this one.
    """
    length = 0.0
    for i in range(phi.size):
        out[i] = 0.0
        for j in range(phi.size):
            out[i] += memory.metric[i, j] * phi[j]
        length += out[i] * phi[i]
    for i in range(phi.size):
        out[i] /= length
    return length


@jit
def _learn_metric(memory: Memory, dual: Floats, length: float) -> None:
    """M = (M - M phi phi' M / (mu + phi' M phi)) / mu, the inverse of what recent postures' monomials have in common.

    This is the gain of recursive least squares (Haykin, Adaptive Filter Theory). M begins as .003 times the unit
    matrix, and forgets by mu = .9995 only while its trace is below that. So monomials that babbling hardly moves
    never learn much faster than others, which would make directions wild at postures that were not met.
    """
    size, trace = dual.size, 0.0
    for i in range(size):
        trace += memory.metric[i, i]
    kept = METRIC_KEPT if trace < METRIC_MOST * size else 1.0
    for i in range(size):
        for j in range(size):
            change = dual[i] * dual[j] * length**2 / (kept + length)
            memory.metric[i, j] = (memory.metric[i, j] - change) / kept


@jit
def direction(plane: Floats, turns: Floats, phi: Floats, index: Ints, share: Floats, found: int, out: Floats) -> None:
    """g = B phi + sum a_i b_i, shape (m,), rad."""
    for k in range(out.size):
        total = 0.0
        for q in range(phi.size):
            total += plane[k, q] * phi[q]
        for place in range(found):
            total += share[place] * turns[index[place], k]
        out[k] = total


@jit
def learn_direction(
    memory: Memory, error: Floats, trust: float, dual: Floats, length: float, index: Ints, share: Floats, found: int
) -> None:
    """Normalised delta rule for the polynomial and the active units: B += .2 e q', b_i += .5 e a_i / |a|^2. M learns.

    Args:
        memory: what the learner holds.
        error: e, where the hand was less where it was expected, shape (m,), rad.
        trust: factor of both rates, see `trust_of` and `pace_of`.
        dual: q, see `dual_of`, shape (Q,).
        length: phi' M phi, what `dual_of` returned.
        index: the active units.
        share: their shares.
        found: how many they are.
    """
    shares = 0.0
    for place in range(found):
        shares += share[place] ** 2
    for k in range(error.size):
        for q in range(dual.size):
            memory.plane[k, q] += PLANE_RATE * trust * error[k] * dual[q]
        for place in range(found):
            memory.turns[index[place], k] += TURN_RATE * trust * error[k] * share[place] / shares
    _learn_metric(memory, dual, length)
