"""What the learner holds: one named tuple of arrays that all kernels share, and how large each is."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from somatopy._jit import jit, jit_inlined
from somatopy.clock import FRAMES_PER_MINUTE
from somatopy.percept import Floats, Ints, Robot

__all__ = ["Memory", "fresh", "opened", "packed", "spacing", "write"]

#: Units that the map has room for, and frames after which one that was never nearest may be replaced.
MOST_UNITS, UNUSED = 1000, 5 * FRAMES_PER_MINUTE
#: Cells of the sheet along each axis, by the number of head joints: at most 31 along one and 1,200 in all.
CELLS = {1: (31,), 2: (31, 31), 3: (11, 11, 9)}

#: What the metric begins with on its diagonal, and is in the mean at most.
METRIC_MOST = 0.003
#: What the doubt about G and C begins with on its diagonal, and is in the mean at most.
DOUBT_MOST = 1000.0
#: The sheet reaches so many times as far as psi's unit.
REACH_IN_SCALES = 1.5
#: Width of a bin of commands, rad.
BIN = 0.1

#: Where single numbers stand in `Memory.numbers`: units in use; frames and hits so far; kappa_e; fast and slow average
#: of the error of direction; fast and slow average of hits; movements from which the pixel gain learned; lambda, the
#: average of kappa_e; how much has been forgotten in all; h, the hits beyond the first 4,000, of which a surprise takes
#: a share away; units that are kept; whether something was kept in this surprise; and for how many hits of it what is
#: kept has been tried, with the average errors of what is kept and of what is known.
UNITS, FRAMES, HITS, SURPRISE, FAST_ERROR, SLOW_ERROR, FAST_SIGHT, SLOW_SIGHT, TURNS, LASTING, FORGOTTEN, CALM = range(
    12
)
KEPT_UNITS, KEPT, TRIED, KEPT_ERROR, KNOWN_ERROR = range(12, 17)
NUMBERS = 17


class Memory(NamedTuple):
    """All that the learner holds, for n arm joints and m head joints. A felt posture is in [0, 1] units by the limits.

    Attributes:
        numbers: counts and averages: `UNITS`, `FRAMES` and so on say which stands where.
        shift: c, what the schema adds to a felt posture, shape (n,).
        home: mu, the mean felt posture, shape (n,).
        middle: the mean felt posture of the first minutes, shape (n,).
        apart: mean distance from it in the first minutes, shape (n,).
        extent: r, in which units the map measures distances of felt postures, shape (n,).
        speed: v, speed of each arm joint, shape (n,), units a frame.
        felt: x~ and x~* of this frame, shape (2, n).
        head: y of this frame, shape (m,), rad.
        pixel: p of this frame, shape (2,), in halves of the picture's width; NaN on a miss.
        bias: beta, sensed head posture less command, shape (m,), rad.
        stride: the longest way that each head joint was seen to go in a frame, shape (m,), rad.
        gain: G, head movement that a movement in the picture is worth, shape (m, 2), rad.
        sway: C, head movement that a movement of the arm is worth, by the monomials but the constant one, shape
            (m, Q - 1), rad.
        doubt: P, how little is known of G and C, shape (Q + 1, Q + 1).
        drift: eps, what the last hits say beyond the map, shape (m,), rad.
        plane: B, of the polynomial part of the direction, shape (m, Q), rad.
        metric: M, by which the polynomial's monomials learn equally fast, shape (Q, Q).
        calm: c, B, F, C and G, one after the other, as they were in the last calm hit, shape (K,).
        kept: the same of what is kept, then M, shape (K + Q^2,).
        units: where units stand among felt postures, shape (U, n). Units that are kept stand at the end.
        turns: b, of the units' part of the direction, shape (U, m), rad.
        fields: w, what of visibility is each unit's own, shape (U, P).
        common: F, what of visibility changes smoothly with the posture, shape (Q, P).
        faded: how much had been forgotten in all when b and w of each unit were put right for it, shape (U,).
        used: frame in which each unit was nearest for the last time, shape (U,).
        sheet: f, what of visibility all postures share, shape (s,), the cells of `shape` row by row.
        recent: E, what was just seen and missed, shape (s,).
        shape: cells along each axis of the sheet, shape (m,).
        reach: where the sheet ends on each axis, shape (m,), rad.
        scale: psi's unit on each axis, shape (m,), rad.
        asked: the command before the body clipped it, shape (m,), rad; NaN before the first.
        ends: the lowest and highest angle that the body left each head joint at a command of its partner, by bins of
            that command, shape (m, 2, bins), rad.
        limits: low and high of each head joint, shape (m, 2), rad.
        low: lower limit of each arm joint, shape (n,), rad.
        span: range of each arm joint, shape (n,), rad.
    """

    numbers: Floats
    shift: Floats
    home: Floats
    middle: Floats
    apart: Floats
    extent: Floats
    speed: Floats
    felt: Floats
    head: Floats
    pixel: Floats
    bias: Floats
    stride: Floats
    gain: Floats
    sway: Floats
    doubt: Floats
    drift: Floats
    plane: Floats
    metric: Floats
    calm: Floats
    kept: Floats
    units: Floats
    turns: Floats
    fields: Floats
    common: Floats
    faded: Floats
    used: Ints
    sheet: Floats
    recent: Floats
    shape: Ints
    reach: Floats
    scale: Floats
    asked: Floats
    ends: Floats
    limits: Floats
    low: Floats
    span: Floats


@jit
def spacing(joints: int) -> float:
    """How far from all units a felt posture gets one of its own, in units of `extent`.

    It is .22 for four joints; some 400 units then fill a cube whose sides are `extent`. It grows with the number of
    joints, and beyond four it grows faster, so that maps of one to eight joints stay below 1,000 units.
    """
    return 0.055 * joints if joints <= 4 else 0.22 + 0.095 * (joints - 4)


def fresh(robot: Robot) -> Memory:
    """What a learner holds before its first frame.

    Args:
        robot: names and limits of arm and head joints, and the camera.
    """
    n, m, limits = len(robot.arm), len(robot.head), robot.head.limits
    shape, reach = CELLS[m], np.full(m, 0.5 * np.ptp(limits, axis=1).min())  # until the pixel gain is known
    first, last = np.rint(limits / BIN).astype(np.int64).T
    ends = np.empty((m, 2, int((last - first).max()) + 1))
    ends[:, 0], ends[:, 1] = -np.inf, np.inf
    numbers = np.zeros(NUMBERS)
    numbers[[FAST_ERROR, SLOW_ERROR]] = 1.0
    return Memory(
        numbers=numbers,
        shift=np.zeros(n),
        home=np.full(n, 0.5),
        middle=np.full(n, 0.5),
        apart=np.full(n, 0.25),
        extent=np.ones(n),
        speed=np.zeros(n),
        felt=np.zeros((2, n)),
        head=np.zeros(m),
        pixel=np.full(2, np.nan),
        bias=np.zeros(m),
        stride=np.zeros(m),
        gain=np.zeros((m, 2)),
        sway=np.zeros((m, _monomials(n) - 1)),
        doubt=DOUBT_MOST * np.eye(_monomials(n) + 1),
        drift=np.zeros(m),
        plane=np.zeros((m, _monomials(n))),
        metric=METRIC_MOST * np.eye(_monomials(n)),
        calm=np.zeros(_shared(n, m)),
        kept=np.zeros(_shared(n, m) + _monomials(n) ** 2),
        units=np.zeros((MOST_UNITS, n)),
        turns=np.zeros((MOST_UNITS, m)),
        fields=np.zeros((MOST_UNITS, _monomials(m))),
        common=np.zeros((_monomials(n), _monomials(m))),
        faded=np.zeros(MOST_UNITS),
        used=np.zeros(MOST_UNITS, np.int64),
        sheet=np.zeros(int(np.prod(shape))),
        recent=np.zeros(int(np.prod(shape))),
        shape=np.array(shape, np.int64),
        reach=reach,
        scale=reach / REACH_IN_SCALES,
        asked=np.full(m, np.nan),
        ends=ends,
        limits=limits,
        low=robot.arm.lower.copy(),
        span=robot.arm.upper - robot.arm.lower,
    )


def packed(memory: Memory) -> tuple[Floats, Ints]:
    """All floats and all integers of a memory, each in one array: two are handed to a kernel sooner than 35.

    Returns:
        The arrays of floats in the order of `Memory`; n, m, the bins of `ends`, then `shape` and `used`.
    """
    floats = [array.ravel() for array in memory if array.dtype == np.float64]
    sizes = np.array([memory.low.size, memory.head.size, memory.ends.shape[2]], np.int64)
    return np.concatenate(floats), np.concatenate([sizes, memory.shape, memory.used])


@jit_inlined
def write(values: Floats, into: Floats) -> None:
    """Copy values, shape (k,), to the first k places: into[:k] = values, which numba takes far longer to compile."""
    for i in range(values.size):
        into[i] = values[i]


@jit
def opened(floats: Floats, ints: Ints) -> Memory:
    """The memory by names: views of what `packed` made, so that who writes into one writes into the other."""
    n, m, bins = int(ints[0]), int(ints[1]), int(ints[2])
    shape, used = ints[3 : 3 + m], ints[3 + m :]
    cells = 1
    for k in range(m):
        cells *= int(shape[k])
    terms, monomials = _monomials(n), _monomials(m)
    numbers, at = _next(floats, 0, NUMBERS)
    shift, at = _next(floats, at, n)
    home, at = _next(floats, at, n)
    middle, at = _next(floats, at, n)
    apart, at = _next(floats, at, n)
    extent, at = _next(floats, at, n)
    speed, at = _next(floats, at, n)
    felt, at = _next(floats, at, 2 * n)
    head, at = _next(floats, at, m)
    pixel, at = _next(floats, at, 2)
    bias, at = _next(floats, at, m)
    stride, at = _next(floats, at, m)
    gain, at = _next(floats, at, 2 * m)
    sway, at = _next(floats, at, m * (terms - 1))
    doubt, at = _next(floats, at, (terms + 1) ** 2)
    drift, at = _next(floats, at, m)
    plane, at = _next(floats, at, m * terms)
    metric, at = _next(floats, at, terms * terms)
    calm, at = _next(floats, at, _shared(n, m))
    kept, at = _next(floats, at, _shared(n, m) + terms * terms)
    units, at = _next(floats, at, MOST_UNITS * n)
    turns, at = _next(floats, at, MOST_UNITS * m)
    fields, at = _next(floats, at, MOST_UNITS * monomials)
    common, at = _next(floats, at, terms * monomials)
    faded, at = _next(floats, at, MOST_UNITS)
    sheet, at = _next(floats, at, cells)
    recent, at = _next(floats, at, cells)
    reach, at = _next(floats, at, m)
    scale, at = _next(floats, at, m)
    asked, at = _next(floats, at, m)
    ends, at = _next(floats, at, 2 * m * bins)
    limits, at = _next(floats, at, 2 * m)
    low, at = _next(floats, at, n)
    span, at = _next(floats, at, n)
    return Memory(
        numbers,
        shift,
        home,
        middle,
        apart,
        extent,
        speed,
        felt.reshape(2, n),
        head,
        pixel,
        bias,
        stride,
        gain.reshape(m, 2),
        sway.reshape(m, terms - 1),
        doubt.reshape(terms + 1, terms + 1),
        drift,
        plane.reshape(m, terms),
        metric.reshape(terms, terms),
        calm,
        kept,
        units.reshape(MOST_UNITS, n),
        turns.reshape(MOST_UNITS, m),
        fields.reshape(MOST_UNITS, monomials),
        common.reshape(terms, monomials),
        faded,
        used,
        sheet,
        recent,
        shape,
        reach,
        scale,
        asked,
        ends.reshape(m, 2, bins),
        limits.reshape(m, 2),
        low,
        span,
    )


@jit_inlined
def _next(floats: Floats, at: int, count: int) -> tuple[Floats, int]:
    """So many of the floats from a place on, and the place after them."""
    return floats[at : at + count], at + count


@jit_inlined
def _monomials(variables: int) -> int:
    """How many monomials of degree 0 to 2 there are."""
    return (variables + 1) * (variables + 2) // 2


@jit_inlined
def _shared(n: int, m: int) -> int:
    """How many numbers c, B, F, C and G are together."""
    return n + m * _monomials(n) + _monomials(n) * _monomials(m) + m * (_monomials(n) + 1)
