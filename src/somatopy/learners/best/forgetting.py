"""Forgetting: a surprise that lasts is one that the schema does not explain, and what was learned before it fades."""

from __future__ import annotations

import math

from somatopy._jit import jit
from somatopy.learners.best.memory import FORGOTTEN, LASTING, METRIC_MOST, SURPRISE, Memory
from somatopy.percept import Floats, Ints

__all__ = ["forget", "voices"]

FORGETTING = 0.01


@jit
def forget(memory: Memory, index: Ints, found: int) -> None:
    """While a surprise lasts, F, b, w go to 0 and M to its first value, by .01 kappa lambda^2 of the way a frame.

    So that a frame touches active units alone, one number sums up what has been forgotten. Each unit knows the sum up
    to which its b and w have faded, and they fade by the rest when it is active.

    Args:
        memory: what the learner holds.
        index: the active units.
        found: how many they are.
    """
    numbers = memory.numbers
    rate = FORGETTING * numbers[SURPRISE] * numbers[LASTING] ** 2
    if rate > 0.0:
        numbers[FORGOTTEN] += rate
        kept = math.exp(-rate)
        for q in range(memory.metric.shape[0]):
            for k in range(memory.common.shape[1]):
                memory.common[q, k] *= kept
            for other in range(memory.metric.shape[1]):
                memory.metric[q, other] *= kept
            memory.metric[q, q] += (1.0 - kept) * METRIC_MOST
    for place in range(found):
        unit = index[place]
        if memory.faded[unit] < numbers[FORGOTTEN]:
            kept = math.exp(memory.faded[unit] - numbers[FORGOTTEN])
            for k in range(memory.turns.shape[1]):
                memory.turns[unit, k] *= kept
            for q in range(memory.fields.shape[1]):
                memory.fields[unit, q] *= kept
            memory.faded[unit] = numbers[FORGOTTEN]


@jit
def voices(memory: Memory, index: Ints, share: Floats, found: int) -> Floats:
    """Shares of the active units in what the map says: their b and w as they are held, less what is forgotten of them.

    Args:
        memory: what the learner holds.
        index: the active units.
        share: their shares.
        found: how many they are.
    """
    voice = share.copy()
    for place in range(found):
        rest = memory.numbers[FORGOTTEN] - memory.faded[index[place]]
        if rest > 0.0:
            voice[place] *= math.exp(-rest)
    return voice
