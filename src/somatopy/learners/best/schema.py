"""The body schema: how the felt posture is to be understood once the body has changed; how fast directions learn."""

from __future__ import annotations

import math

import numpy as np

from somatopy._jit import jit
from somatopy.learners.best.directions import powers_turned, width_of
from somatopy.learners.best.memory import (
    CALM,
    FAST_ERROR,
    FAST_SIGHT,
    FRAMES,
    HITS,
    LASTING,
    SLOW_ERROR,
    SLOW_SIGHT,
    SURPRISE,
    Memory,
)
from somatopy.percept import Floats, Ints

__all__ = ["count_sight", "is_lost", "move_schema", "pace_of", "pull_schema", "surprise", "trust_of"]

ERROR_MOST, FAST, SLOW, CALM_HITS = 1.0, 0.01, 0.0005, 4000
PATIENCE = 0.005
PACE_AGE, PACE_LEAST, REJUVENATION = 4000.0, 0.2, 0.01
FAST_SEEN, SLOW_SEEN, KNOWN_FRAMES, LOST_SHARE = 0.0033, 0.0002, 5000, 0.25
STEP, STEP_MOST, DAMPING = 0.1, 0.05, 0.05
PULL, HOME_RATE = 0.005, 0.0005


@jit
def surprise(numbers: Floats, error: Floats) -> None:
    """kappa_e = clip(2 (n_f - 2 n_s) / n_f, 0, 1), of a fast and a slow average of |e| on hits, and its own average.

    They count from the next frame on. In the first 4,000 hits, while errors are still those of a beginner, the slow
    average is never below the fast one, and nothing is a surprise.

    Args:
        numbers: those of the memory.
        error: e, where the hand was less where it was expected, shape (m,), rad.
    """
    square = 0.0
    for k in range(error.size):
        square += error[k] ** 2
    size = min(math.sqrt(square), ERROR_MOST)
    numbers[FAST_ERROR] += FAST * (size - numbers[FAST_ERROR])
    numbers[SLOW_ERROR] += SLOW * (size - numbers[SLOW_ERROR])
    numbers[HITS] += 1.0
    if numbers[HITS] <= CALM_HITS:
        numbers[SLOW_ERROR] = max(numbers[SLOW_ERROR], numbers[FAST_ERROR])
    fast, slow = numbers[FAST_ERROR], numbers[SLOW_ERROR]
    numbers[SURPRISE] = min(max(2.0 * (fast - 2.0 * slow) / fast, 0.0), 1.0) if fast > 0.0 else 0.0
    numbers[LASTING] += PATIENCE * (numbers[SURPRISE] - numbers[LASTING])
    if numbers[HITS] > CALM_HITS:
        numbers[CALM] = (numbers[CALM] + 1.0) * (1.0 - REJUVENATION * numbers[SURPRISE])


@jit
def trust_of(numbers: Floats) -> float:
    """How far directions and visibility learn, 1 - kappa (1 - lambda^2): not while the schema may explain a surprise.

    It does not explain one that lasts, so that lambda, the average of kappa, comes near 1; then they must learn.
    """
    return float(1.0 - numbers[SURPRISE] * (1.0 - numbers[LASTING] ** 2))


@jit
def pace_of(numbers: Floats) -> float:
    """How fast directions learn: 1 / (1 + h / 4,000), and .2 at least, after h hits beyond the first 4,000.

    In a surprise each hit takes the share .01 kappa of h away. What is left of the errors after many hits is what no
    learning takes away, and a direction is better if it is the mean over them.
    """
    return float(max(PACE_LEAST, 1.0 / (1.0 + numbers[CALM] / PACE_AGE)))


@jit
def count_sight(numbers: Floats, hit: bool) -> None:
    """One more frame, and a fast and a slow average of hits; the slow one is a plain mean for the first 5,000."""
    numbers[FRAMES] += 1.0
    numbers[FAST_SIGHT] += FAST_SEEN * (hit - numbers[FAST_SIGHT])
    slow = 1.0 / numbers[FRAMES] if numbers[FRAMES] <= KNOWN_FRAMES else SLOW_SEEN
    numbers[SLOW_SIGHT] += slow * (hit - numbers[SLOW_SIGHT])


@jit
def is_lost(numbers: Floats) -> bool:
    """Whether the hand is seen less than a quarter as often as it used to be."""
    return bool(numbers[FRAMES] > KNOWN_FRAMES and numbers[FAST_SIGHT] < LOST_SHARE * numbers[SLOW_SIGHT])


@jit
def move_schema(
    memory: Memory, x: Floats, error: Floats, kappa: float, index: Ints, share: Floats, found: int
) -> Floats:
    """The step of c that explains the error: clip(.1 kappa J' (J J' + .05 I)^-1 e, +-.05), shape (n,).

    J is the slope of the direction at x: that of the polynomial, and the covariance of the active units' directions
    with their positions.

    Args:
        memory: what the learner holds.
        x: x~, shape (n,).
        error: e, shape (m,), rad.
        kappa: kappa_e.
        index: the active units.
        share: their shares.
        found: how many they are.
    """
    n, m = x.size, error.size
    slope = memory.plane @ powers_turned(x)
    middle, turn = np.zeros(n), np.zeros(m)
    for a in range(found):
        middle += share[a] * memory.units[index[a]]
        turn += share[a] * memory.turns[index[a]]
    for a in range(found):
        for k in range(m):
            for j in range(n):
                apart = (memory.turns[index[a], k] - turn[k]) * (memory.units[index[a], j] - middle[j])
                slope[k, j] += share[a] * apart / (width_of(n) * memory.extent[j]) ** 2
    step: Floats = slope.T @ np.linalg.solve(slope @ slope.T + DAMPING * np.eye(m), error)
    for j in range(n):
        step[j] = min(max(STEP * kappa * step[j], -STEP_MOST), STEP_MOST)
    return step


@jit
def pull_schema(memory: Memory, x: Floats, kappa: float) -> None:
    """While something is wrong, c += .005 kappa (mu - x~): babbling keeps its mean; else mu += .0005 (x~ - mu)."""
    for j in range(x.size):
        if kappa > 0.0:
            memory.shift[j] += PULL * kappa * (memory.home[j] - x[j])
        else:
            memory.home[j] += HOME_RATE * (x[j] - memory.home[j])
