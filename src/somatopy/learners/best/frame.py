"""One frame of the learner in its order: what is felt and seen teaches each part, then the next gaze is chosen."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from somatopy._jit import jit
from somatopy.learners.best.action import best_gaze, chances
from somatopy.learners.best.calibration import learn_bias, learn_ends, learn_gain, learn_speed
from somatopy.learners.best.directions import (
    DRIFT_KEPT,
    DRIFT_RATE,
    NEAREST,
    active,
    direction,
    dual_of,
    find_or_add,
    learn_direction,
    learn_extent,
    powers,
)
from somatopy.learners.best.forgetting import forget, voices
from somatopy.learners.best.memory import HITS, SURPRISE, TURNS, UNITS, Memory, opened, write
from somatopy.learners.best.recall import recall
from somatopy.learners.best.schema import count_sight, is_lost, move_schema, pace_of, pull_schema, surprise, trust_of
from somatopy.learners.best.visibility import evidence, fade, fit_sheet, in_reach, is_due, learn_visibility
from somatopy.percept import Floats, Ints

__all__ = ["PARTS", "believe", "choose", "expect", "live", "live_and_choose"]

#: Parts that may learn, in the order of `live`'s flags.
PARTS = ("schema", "calibration", "directions", "visibility", "memory")
SCHEMA, CALIBRATION, DIRECTIONS, VISIBILITY, MEMORY = range(5)


@jit
def live(
    memory: Memory,
    arm: Floats,
    target: Floats,
    head: Floats,
    command: Floats,
    pixel: Floats,
    aspect: float,
    learns: NDArray[np.bool_],
) -> float:
    """One frame: all parts that may learn from it do.

    Args:
        memory: what the learner holds.
        arm: sensed arm posture, shape (n,), rad.
        target: the arm's target, shape (n,), rad.
        head: y, sensed head posture, shape (m,), rad.
        command: the last command as the body clipped it, shape (m,), rad.
        pixel: p, where the hand is seen from the picture's centre, in halves of its width, shape (2,); NaN on a miss.
        aspect: height of the picture by its width.
        learns: which parts learn, shape (5,).

    Returns:
        The error |e| of the direction, rad; NaN on a miss.
    """
    numbers, n, m = memory.numbers, arm.size, head.size
    hit = not math.isnan(pixel[0])
    posture, x, goal = np.empty(n), np.empty(n), np.empty(n)
    for j in range(n):
        posture[j] = (arm[j] - memory.low[j]) / memory.span[j]
        x[j] = posture[j] + memory.shift[j]
        goal[j] = (target[j] - memory.low[j]) / memory.span[j] + memory.shift[j]
    if learns[CALIBRATION]:
        _calibrate(memory, x, head, command, pixel, aspect)
    kappa = numbers[SURPRISE]
    trust = trust_of(numbers)
    index, share = np.empty(NEAREST, np.int64), np.empty(NEAREST)
    found = find_or_add(memory, x, learns[DIRECTIONS] and trust > 0.5, index, share)
    if learns[DIRECTIONS] and learns[VISIBILITY]:
        forget(memory, index, found)
    voice = voices(memory, index, share, found)
    phi, expected = np.empty(memory.plane.shape[1]), np.empty(m)
    powers(x, phi)
    dual = np.empty(phi.size)
    length = dual_of(memory, phi, dual)
    direction(memory.plane, memory.turns, phi, index, voice, found, expected)
    count_sight(numbers, hit)
    wrong = 1.0 if is_lost(numbers) else kappa
    offset, error, step = head - expected - memory.drift, np.full(m, np.nan), np.zeros(n)
    if hit:
        for k in range(m):
            way = memory.gain[k, 0] * pixel[0] + memory.gain[k, 1] * pixel[1]
            error[k], offset[k] = head[k] + way - expected[k], -way
        surprise(numbers, error)
        if kappa > 0.0 and learns[SCHEMA]:
            step = move_schema(memory, x, error, kappa, index, share, found)
        if learns[DIRECTIONS]:
            learn_direction(memory, error, trust * pace_of(numbers), dual, length, index, share, found)
        if learns[MEMORY]:
            for k in range(m):
                memory.drift[k] += DRIFT_RATE * (error[k] - memory.drift[k])
    else:
        for k in range(m):
            memory.drift[k] *= DRIFT_KEPT
    if learns[SCHEMA]:
        pull_schema(memory, x, wrong)
        for j in range(n):
            memory.shift[j] += step[j]
    fade(memory)
    if numbers[HITS] > 0.0 and in_reach(memory, offset):
        flags = learns[VISIBILITY], learns[MEMORY]
        learn_visibility(memory, offset, hit, trust, *flags, phi, dual, index, share, voice, found)
    if learns[DIRECTIONS]:
        learn_extent(memory, x)
    if hit and learns.all() and recall(memory, posture, head, pixel, error):
        for j in range(n):
            goal[j] += posture[j] + memory.shift[j] - x[j]
            x[j] = posture[j] + memory.shift[j]
    write(x, memory.felt[0])
    write(goal, memory.felt[1])
    write(head, memory.head)
    write(pixel, memory.pixel)
    size = 0.0
    for k in range(m):
        size += error[k] ** 2
    return math.sqrt(size)


@jit
def _calibrate(memory: Memory, x: Floats, head: Floats, command: Floats, pixel: Floats, aspect: float) -> None:
    """Steps before the map: bias and ends of the head, speed of the arm, pixel gain."""
    learn_bias(memory, head, command)
    learn_ends(memory, command)
    learn_speed(memory, x)
    if learn_gain(memory, x, head, pixel) and is_due(memory.numbers[TURNS]):
        fit_sheet(memory, aspect)


@jit
def live_and_choose(floats: Floats, ints: Ints, told: Floats, aspect: float, learns: NDArray[np.bool_]) -> float:
    """`live`, then `choose` where the hand was ever seen, in one call of few arrays, which are handed over quickly.

    Args:
        floats: what the learner holds, see `packed`.
        ints: likewise.
        told: the vectors that `live` takes, one after the other, shape (2 n + 2 m + 2,).
        aspect: height of the picture by its width.
        learns: which parts learn, shape (5,).

    Returns:
        What `live` does; -1, and nothing has changed, if a posture is not finite.
    """
    memory = opened(floats, ints)
    n, m = memory.low.size, memory.head.size
    postures, pixel = told[: 2 * (n + m)], told[2 * (n + m) :]
    for k in range(postures.size):
        if not math.isfinite(postures[k]):
            return -1.0
    arm, target, head, command = told[:n], told[n : 2 * n], told[2 * n : 2 * n + m], postures[2 * n + m :]
    error = live(memory, arm, target, head, command, pixel, aspect, learns)
    if memory.numbers[HITS] > 0.0:
        choose(memory, learns[MEMORY])
    return error


@jit
def choose(memory: Memory, recent: bool) -> None:
    """Ask for the best gaze at the posture one frame ahead, as far as the arm's speed is known: it stands in `asked`.

    Args:
        memory: what the learner holds, after `live`.
        recent: whether working memory and drift count.
    """
    x = np.empty(memory.shift.size)
    for j in range(x.size):
        most = max(memory.speed[j], 0.0)
        x[j] = memory.felt[0, j] + min(max(memory.felt[1, j] - memory.felt[0, j], -most), most)
    _expect(memory, x, recent, recent, memory.asked)


@jit
def expect(memory: Memory, arm: Floats, drift: bool) -> Floats:
    """The command for a sensed arm posture, shape (m,), rad, without working memory; nothing changes.

    Args:
        memory: what the learner holds.
        arm: sensed arm posture, shape (n,), rad.
        drift: whether eps counts.
    """
    command = np.empty(memory.head.size)
    _expect(memory, (arm - memory.low) / memory.span + memory.shift, False, drift, command)
    return command


@jit
def believe(memory: Memory, arm: Floats, gazes: Floats, drift: bool, out: Floats) -> None:
    """The chance of commands to see the hand at a sensed arm posture, without working memory; nothing changes.

    Args:
        memory: what the learner holds.
        arm: sensed arm posture, shape (n,), rad.
        gazes: commands, shape (k, m), rad.
        drift: whether eps counts.
        out: overwritten by the chances, shape (k,).
    """
    centre = np.empty(memory.head.size)
    field = _expected(memory, (arm - memory.low) / memory.span + memory.shift, False, drift, centre)
    chances(memory, centre, field, gazes, out)


@jit
def _expect(memory: Memory, x: Floats, recent: bool, drift: bool, command: Floats) -> None:
    """The command for a felt posture."""
    centre = np.empty(memory.head.size)
    field = _expected(memory, x, recent, drift, centre)
    best_gaze(memory, centre, field, command)


@jit
def _expected(memory: Memory, x: Floats, recent: bool, drift: bool, centre: Floats) -> Floats:
    """Where the hand is expected at a felt posture, (m,) rad, in `centre`; the evidence around there, shape (s,)."""
    index, share = np.empty(NEAREST, np.int64), np.empty(NEAREST)
    count = int(memory.numbers[UNITS])
    found = active(memory.units, memory.extent, count, x, index, share) if count else 0
    share = voices(memory, index, share, found)
    phi = np.empty(memory.plane.shape[1])
    powers(x, phi)
    direction(memory.plane, memory.turns, phi, index, share, found, centre)
    if drift:
        centre += memory.drift
    return evidence(memory, recent, phi, index, share, found)
