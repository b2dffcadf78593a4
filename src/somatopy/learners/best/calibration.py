"""What the learner finds out about its head and eye: sensed angle against command, and pixels against angles."""

from __future__ import annotations

import math

import numpy as np

from somatopy._jit import jit
from somatopy.learners.best.directions import powers
from somatopy.learners.best.memory import BIN, DOUBT_MOST, TURNS, Memory, write
from somatopy.percept import Floats

__all__ = ["bin_of", "learn_bias", "learn_ends", "learn_gain", "learn_speed"]

BIAS_RATE, BIAS_MOST, STRIDE_SHARE = 0.05, 0.3, 0.8
GAIN_KEPT = 0.997
SPEED_RATE, WAY_LEAST = 0.02, 0.05


@jit
def learn_bias(memory: Memory, head: Floats, command: Floats) -> None:
    """beta += .05 (y - command - beta), where the head had the time to get there.

    A move that was longer than the head is quick leaves the head on its way, which is no bias. So only moves count that
    are shorter than the longest way that the joint has been seen to go in one frame.

    Args:
        memory: what the learner holds.
        head: y, sensed head posture, shape (m,), rad.
        command: the last command as the body clipped it, shape (m,), rad.
    """
    for k in range(head.size):
        before = memory.head[k]
        memory.stride[k] = max(memory.stride[k], abs(head[k] - before))
        rest = head[k] - command[k] - memory.bias[k]
        quick = abs(command[k] + memory.bias[k] - before) <= STRIDE_SHARE * memory.stride[k]
        if quick and abs(rest) < BIAS_MOST:
            memory.bias[k] += BIAS_RATE * rest


@jit
def learn_ends(memory: Memory, command: Floats) -> None:
    """Remember to which angle the body cut what was asked of a joint, at this command of the joint before it.

    Args:
        memory: what the learner holds.
        command: the last command as the body clipped it, shape (m,), rad.
    """
    for k in range(1, command.size):
        if abs(command[k] - memory.asked[k]) > 1e-4:
            place = bin_of(memory, k - 1, command[k - 1])
            memory.ends[k, int(command[k] < memory.asked[k]), place] = command[k]


@jit
def bin_of(memory: Memory, joint: int, command: float) -> int:
    """In which bin of a joint's commands one lies, rad."""
    place = round(command / BIN) - round(memory.limits[joint, 0] / BIN)
    return int(min(max(place, 0), memory.ends.shape[2] - 1))


@jit
def learn_speed(memory: Memory, felt: Floats) -> None:
    """v += .02 ((x~ - old x~) sign(d) - v), for each arm joint on a way of d that is longer than .05.

    Args:
        memory: what the learner holds.
        felt: x~ of this frame, shape (n,).
    """
    for k in range(felt.size):
        way = memory.felt[1, k] - memory.felt[0, k]
        if abs(way) > WAY_LEAST:
            went = (felt[k] - memory.felt[0, k]) * (1.0 if way > 0.0 else -1.0)
            memory.speed[k] += SPEED_RATE * (went - memory.speed[k])


@jit
def learn_gain(memory: Memory, x: Floats, head: Floats, pixel: Floats) -> bool:
    """G and C by recursive least squares of dy + G dp = C dphi: a turn of the head, or the arm, moves the hand's image.

    y + G p is where the hand is. From one frame to the next it changes only if the arm moves, by C dphi. Both are
    learned together from each frame in which the head moved, if the hand is seen and was seen before. So a head that
    follows the hand is not mistaken for one that turns without effect. With z = (dp, -dphi) and
    k = P z / (mu + z' P z), (G, C) += (-dy - (G, C) z) k' and P = (P - k z' P) / mu (Haykin, Adaptive Filter Theory);
    mu is .997, or 1 where the trace of P is not below its first value.

    Args:
        memory: what the learner holds.
        x: x~, shape (n,).
        head: y, shape (m,), rad.
        pixel: p, shape (2,); NaN on a miss.

    Returns:
        Whether it learned.
    """
    moved, turn = 0.0, head - memory.head
    for k in range(head.size):
        moved = max(moved, abs(turn[k]))
    if moved == 0.0 or math.isnan(pixel[0] - memory.pixel[0]):
        return False
    terms = memory.plane.shape[1]
    before, now, z = np.empty(terms), np.empty(terms), np.empty(terms + 1)
    powers(memory.felt[0], before)
    powers(x, now)
    write(pixel - memory.pixel, z)
    write(before[1:] - now[1:], z[2:])
    step, length, trace = np.zeros(z.size), 0.0, 0.0
    for i in range(z.size):
        for j in range(z.size):
            step[i] += memory.doubt[i, j] * z[j]
        length += step[i] * z[i]
        trace += memory.doubt[i, i]
    kept = GAIN_KEPT if trace < DOUBT_MOST * z.size else 1.0
    share, grown = 1.0 / (kept + length), 1.0 / kept
    for k in range(head.size):
        error = -turn[k] - memory.gain[k, 0] * z[0] - memory.gain[k, 1] * z[1]
        for q in range(terms - 1):
            error -= memory.sway[k, q] * z[2 + q]
        for i in range(2):
            memory.gain[k, i] += error * share * step[i]
        for q in range(terms - 1):
            memory.sway[k, q] += error * share * step[2 + q]
    for i in range(z.size):
        for j in range(z.size):  # the same product for i, j as for j, i: whatever asymmetry P had would grow by 1 / mu
            memory.doubt[i, j] = (memory.doubt[i, j] - step[i] * step[j] * share) * grown
    memory.numbers[TURNS] += 1.0
    return True
