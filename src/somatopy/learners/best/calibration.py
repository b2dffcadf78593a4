"""What the learner finds out about its head and eye: sensed angle against command, and pixels against angles."""

from __future__ import annotations

import math

from somatopy._jit import jit
from somatopy.learners.best.memory import BIN, SURPRISE, TURNS, Memory
from somatopy.learners.best.schema import is_lost
from somatopy.percept import Floats

__all__ = ["bin_of", "learn_bias", "learn_ends", "learn_gain", "learn_speed"]

BIAS_RATE, BIAS_MOST, STRIDE_SHARE = 0.05, 0.3, 0.8
GAIN_RATE, GAIN_AGE, GAIN_LEAST = 0.05, 5.0, 0.05 / 2.56
TURN_LEAST, TURN_SHARE = 0.05, 0.4
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
def learn_gain(memory: Memory, head: Floats, pixel: Floats) -> bool:
    """G += eta e d2p' / (|d2p|^2 + .02) with e = -d2y - G d2p: what a turn of its own head does to the picture.

    d2y and d2p are how much the head's movement dy and the hand's slip dp in the picture differ from those one frame
    ago. A hand that moves evenly has no part in them. It has one in dp, by which a head that follows a hand seems to
    turn without effect. Only d2y count that are longer than .05 rad, or than .4 of the longest way that the head was
    seen to go in a frame, if that is less. eta is 1 / (1 + k / 5) at the k-th of them, counted from 0, and .05 once
    that is less.

    While there is a surprise, kappa > 0, or the hand is hardly seen any more, dy and dp themselves take the place of
    d2y and d2p. If the gain is what has become wrong, as in a mirrored picture, the hand is hardly ever seen in three
    frames on end, but often in two.

    Args:
        memory: what the learner holds.
        head: y, shape (m,), rad.
        pixel: p, shape (2,); NaN on a miss.

    Returns:
        Whether it learned.
    """
    du, dv, turn = pixel[0] - memory.pixel[0], pixel[1] - memory.pixel[1], head - memory.head
    if memory.numbers[SURPRISE] == 0.0 and not is_lost(memory.numbers):
        du, dv, turn = du - memory.slip[0], dv - memory.slip[1], turn - memory.moved
    length = 0.0
    for k in range(head.size):
        length += turn[k] ** 2
    if math.isnan(du) or math.sqrt(length) <= min(TURN_LEAST, TURN_SHARE * memory.stride.max()):
        return False
    rate = max(GAIN_RATE, 1.0 / (1.0 + memory.numbers[TURNS] / GAIN_AGE))
    scale = rate / (du * du + dv * dv + GAIN_LEAST)
    for k in range(head.size):
        error = -turn[k] - memory.gain[k, 0] * du - memory.gain[k, 1] * dv
        memory.gain[k, 0] += scale * error * du
        memory.gain[k, 1] += scale * error * dv
    memory.numbers[TURNS] += 1.0
    return True
