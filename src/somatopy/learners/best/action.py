"""Where to look: of all gazes around the hand, the one from which it is most surely seen."""

from __future__ import annotations

import math

import numpy as np

from somatopy._jit import jit, jit_inlined
from somatopy.learners.best.calibration import bin_of
from somatopy.learners.best.memory import Memory, write
from somatopy.learners.best.visibility import corners, next_row
from somatopy.percept import Floats, Ints

__all__ = ["best_gaze", "chances"]

_TOLERANCE = 1e-6


@jit
def best_gaze(memory: Memory, centre: Floats, field: Floats, out: Floats) -> None:
    """The head posture, less the bias, with the most evidence among the cells of the sheet around a direction.

    Each candidate is clipped to what the head can do, as far as the body has shown it, and the sheet is read where it
    then lies; candidates that leave the sheet are dropped. The first of equals is taken. If none is left, the direction
    itself is, clipped to the head's limits.

    Args:
        memory: what the learner holds.
        centre: where the hand is expected, shape (m,), rad.
        field: evidence on the sheet, shape (s,).
        out: overwritten by the command, shape (m,), rad.
    """
    m, last = centre.size, centre.size - 1
    own, lowest, highest = _axes(memory, centre)
    gaze, at, plain, best = np.empty(m), np.zeros(m, np.int64), True, -np.inf
    place, weight = np.empty(8, np.int64), np.empty(8)
    for first in range(0, field.size, memory.shape[last]):
        repeated, plain = not plain, True
        for k in range(last):
            angle = _cut(memory, k, min(max(own[k, at[k]], lowest[k]), highest[k]), gaze)
            plain &= angle == own[k, at[k]]
            repeated &= angle == gaze[k]
            gaze[k] = angle
        if plain or not repeated:  # rows that are clipped to where the row before was have its candidates
            low, high = _cut(memory, last, lowest[last], gaze), _cut(memory, last, highest[last], gaze)
            before, chosen = np.nan, np.nan
            for i in range(memory.shape[last]):
                angle = min(max(own[last, i], low), high)
                if plain and angle == own[last, i]:
                    value = field[first + i]
                elif angle == before:
                    continue
                else:
                    before = gaze[last] = angle
                    value = _value(memory, field, gaze, centre, place, weight)
                if value > best:
                    best, chosen = value, angle
            if not math.isnan(chosen):
                gaze[last] = chosen
                write(gaze, out)
        next_row(at, memory.shape)
    if best == -np.inf:
        for k in range(m):
            out[k] = min(max(centre[k], memory.limits[k, 0]), memory.limits[k, 1])
    for k in range(m):
        out[k] = min(max(out[k] - memory.bias[k], memory.limits[k, 0]), memory.limits[k, 1])


@jit
def chances(memory: Memory, centre: Floats, field: Floats, gazes: Floats, out: Floats) -> None:
    """sigma of the evidence at commands around a direction, read bilinearly; 0 beyond the sheet.

    Args:
        memory: what the learner holds.
        centre: where the hand is expected, shape (m,), rad.
        field: evidence on the sheet, shape (s,).
        gazes: commands, shape (k, m), rad.
        out: overwritten, shape (k,).
    """
    place, weight = np.empty(8, np.int64), np.empty(8)
    for k in range(len(gazes)):
        out[k] = 1.0 / (1.0 + math.exp(-_value(memory, field, gazes[k] + memory.bias, centre, place, weight)))


@jit
def _axes(memory: Memory, centre: Floats) -> tuple[Floats, Floats, Floats]:
    """Head angles at the cells along each axis of the sheet, shape (m, cells), and the limits of each, (m,), rad."""
    own = np.zeros((centre.size, memory.shape.max()))
    for k in range(centre.size):
        for i in range(memory.shape[k]):
            own[k, i] = centre[k] + (2.0 * i / (memory.shape[k] - 1) - 1.0) * memory.reach[k]
    return own, memory.limits[:, 0] + memory.bias, memory.limits[:, 1] + memory.bias


@jit_inlined
def _cut(memory: Memory, joint: int, angle: float, gaze: Floats) -> float:
    """An angle of a joint as the body would cut it where the joint before it is at `gaze`."""
    if joint == 0:
        return angle
    place = bin_of(memory, joint - 1, gaze[joint - 1] - memory.bias[joint - 1])
    low, high = memory.ends[joint, 0, place] + memory.bias[joint], memory.ends[joint, 1, place] + memory.bias[joint]
    return float(min(max(angle, low), high))


@jit_inlined
def _value(memory: Memory, field: Floats, gaze: Floats, centre: Floats, place: Ints, weight: Floats) -> float:
    """Evidence at a gaze, shape (m,), rad, read bilinearly; -inf beyond the sheet."""
    for k in range(gaze.size):
        if abs(gaze[k] - centre[k]) > memory.reach[k] + _TOLERANCE:
            return -np.inf
    total = 0.0
    for c in range(corners(memory, gaze, centre, place, weight)):
        total += weight[c] * field[place[c]]
    return total
