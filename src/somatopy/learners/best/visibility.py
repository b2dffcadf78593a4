"""From where the hand can be seen: one logistic layer over the gaze's offset from the hand, and a memory of seconds."""

from __future__ import annotations

import math

import numpy as np

from somatopy._jit import jit, jit_inlined
from somatopy.learners.best.memory import REACH_IN_SCALES, Memory, write
from somatopy.percept import Floats, Ints

__all__ = ["corners", "evidence", "fade", "fit_sheet", "in_reach", "is_due", "learn_visibility", "next_row"]

SHEET_RATE, COMMON_RATE, FIELD_RATE = 0.1, 0.3, 0.6
KEPT, STROKE, STROKE_WIDTH, STROKE_CELLS = 0.85, 3.0, 2.0, 5  # of the working memory, in cells
SETTLING, PICTURES = 50, 1.4  # movements after which the sheet is first fitted; its reach in halves of a picture
NARROWEST = 0.5  # reach of any axis, in that of the widest, at least
BEYOND = 4  # cells beyond the sheet at which an offset still teaches


@jit_inlined
def _cell(memory: Memory, axis: int, offset: float) -> float:
    """Where an offset (rad) lies on an axis, in cells from the first; not clipped."""
    return float((offset / memory.reach[axis] + 1.0) * 0.5 * (memory.shape[axis] - 1))


@jit
def in_reach(memory: Memory, offset: Floats) -> bool:
    """Whether an offset, shape (m,), rad, is on the sheet or at most four cells beyond."""
    for k in range(offset.size):
        cell = 2.0 * memory.reach[k] / (memory.shape[k] - 1)
        if abs(offset[k]) > memory.reach[k] + BEYOND * cell:
            return False
    return True


@jit_inlined
def corners(memory: Memory, gaze: Floats, centre: Floats, place: Ints, weight: Floats) -> int:
    """The cells around a gaze and their tent weights; a gaze beyond the sheet is clipped to it.

    Args:
        memory: what the learner holds.
        gaze: shape (m,), rad.
        centre: where the middle of the sheet is, shape (m,), rad.
        place: overwritten by the cells, shape (8,).
        weight: overwritten by their weights, which sum to 1, shape (8,).

    Returns:
        How many cells there are, 2^m.
    """
    count = 1
    place[0], weight[0] = 0, 1.0
    for k in range(gaze.size):
        size = memory.shape[k]
        for c in range(count):
            place[c] *= size
        at = min(max(_cell(memory, k, gaze[k] - centre[k]), 0.0), size - 1.0)
        first = min(int(at), size - 2)
        share = at - first
        for c in range(count):
            place[count + c], weight[count + c] = place[c] + first + 1, weight[c] * share
            place[c], weight[c] = place[c] + first, weight[c] * (1.0 - share)
        count *= 2
    return count


@jit
def _psi(memory: Memory, offset: Floats, out: Floats) -> None:
    """1, u_k, u_k^2 - .4 and u_k u_l of the offset clipped to the sheet, in units of `scale`; shape (P,)."""
    m = offset.size
    out[0] = 1.0
    place = 2 * m + 1
    for k in range(m):
        u = min(max(offset[k], -memory.reach[k]), memory.reach[k]) / memory.scale[k]
        out[1 + k], out[1 + m + k] = u, u * u - 0.4
    for k in range(m):
        for other in range(k + 1, m):
            out[place] = out[1 + k] * out[1 + other]
            place += 1


@jit_inlined
def _sigmoid(z: float) -> float:
    return 1.0 / (1.0 + math.exp(-z))


@jit
def fade(memory: Memory) -> None:
    """E *= .85, once a frame."""
    for cell in range(memory.recent.size):
        memory.recent[cell] *= KEPT


@jit_inlined
def _field(memory: Memory, phi: Floats, index: Ints, share: Floats, found: int, out: Floats) -> None:
    """F' phi + sum a_i w_i: what visibility is at a posture, beside the sheet that all share; shape (P,)."""
    for q in range(out.size):
        total = 0.0
        for r in range(phi.size):
            total += phi[r] * memory.common[r, q]
        for a in range(found):
            total += share[a] * memory.fields[index[a], q]
        out[q] = total


@jit
def learn_visibility(
    memory: Memory,
    offset: Floats,
    hit: bool,
    trust: float,
    fields: bool,
    recent: bool,
    phi: Floats,
    dual: Floats,
    index: Ints,
    share: Floats,
    voice: Floats,
    found: int,
) -> None:
    """Delta rule on sigma(z): what was seen, or missed, at an offset of the gaze from the hand.

    z(o) = f(o) + (F' phi + sum a_i w_i) . psi(o) learns slowly; the working memory gets a stroke around o by what z
    and itself did not foresee.

    Args:
        memory: what the learner holds.
        offset: o, gaze less where the hand is, shape (m,), rad.
        hit: whether the hand was seen.
        trust: factor of the rates, see `trust_of`.
        fields: whether f, F and w learn.
        recent: whether the working memory does.
        phi: monomials of the felt posture, shape (Q,).
        dual: q, see `dual_of`, shape (Q,).
        index: the active units.
        share: their shares.
        voice: the same less what they have forgotten, see `voices`.
        found: how many they are.
    """
    place, weight, psi = np.empty(8, np.int64), np.empty(8), np.empty(memory.fields.shape[1])
    field = np.empty(psi.size)
    count = corners(memory, offset, np.zeros(offset.size), place, weight)
    _psi(memory, offset, psi)
    _field(memory, phi, index, voice, found, field)
    z, just, tents, shares, square = 0.0, 0.0, 0.0, 0.0, 0.0
    for c in range(count):
        z += weight[c] * memory.sheet[place[c]]
        just += weight[c] * memory.recent[place[c]]
        tents += weight[c] ** 2
    for a in range(found):
        shares += share[a] ** 2
    for q in range(psi.size):
        z += field[q] * psi[q]
        square += psi[q] ** 2
    if fields:
        delta = trust * (hit - _sigmoid(z))
        for c in range(count):
            memory.sheet[place[c]] += SHEET_RATE * delta * weight[c] / tents
        for r in range(dual.size):
            for q in range(psi.size):
                memory.common[r, q] += COMMON_RATE * delta * dual[r] * psi[q] / square
        for a in range(found):
            for q in range(psi.size):
                memory.fields[index[a], q] += FIELD_RATE * delta * share[a] * psi[q] / (shares * square)
    if recent:
        _stroke(memory, offset, STROKE * (hit - _sigmoid(z + just)))


@jit
def _stroke(memory: Memory, offset: Floats, height: float) -> None:
    """E += height exp(-|cells from the offset|^2 / (2 * 2^2)), in the cells at most five away."""
    m, last = offset.size, offset.size - 1
    first, count, at = np.zeros(m, np.int64), np.zeros(m, np.int64), np.zeros(m, np.int64)
    along = np.empty((m, 2 * STROKE_CELLS + 1))
    rows = 1
    for k in range(m):
        where = _cell(memory, k, offset[k])
        first[k] = max(round(where) - STROKE_CELLS, 0)
        count[k] = max(min(round(where) + STROKE_CELLS + 1, memory.shape[k]) - first[k], 0)
        for i in range(count[k]):
            along[k, i] = math.exp(-((first[k] + i - where) ** 2) / (2.0 * STROKE_WIDTH**2))
        if k < last:
            rows *= count[k]
    for _ in range(rows):
        cell, weight = 0, height
        for k in range(last):
            cell = (cell + first[k] + at[k]) * memory.shape[k + 1]
            weight *= along[k, at[k]]
        for i in range(count[last]):
            memory.recent[cell + first[last] + i] += weight * along[last, i]
        next_row(at, count)


@jit
def evidence(memory: Memory, recent: bool, phi: Floats, index: Ints, share: Floats, found: int) -> Floats:
    """z over the whole sheet, the working memory included or not; shape (s,)."""
    m, last = memory.head.size, memory.head.size - 1
    field = np.empty(memory.fields.shape[1])
    _field(memory, phi, index, share, found, field)
    u, along = np.zeros((m, memory.shape.max())), np.zeros((m, memory.shape.max()))
    for k in range(m):
        for i in range(memory.shape[k]):
            u[k, i] = (2.0 * i / (memory.shape[k] - 1) - 1.0) * memory.reach[k] / memory.scale[k]
            along[k, i] = field[1 + k] * u[k, i] + field[1 + m + k] * (u[k, i] ** 2 - 0.4)
    z, at, wide, tilt = memory.sheet.copy(), np.zeros(m, np.int64), along[last], u[last]
    for first in range(0, z.size, memory.shape[last]):
        level, slope = field[0], 0.0
        pair = 2 * m + 1
        for k in range(last):
            level += along[k, at[k]]
            for other in range(k + 1, m):
                if other < last:
                    level += field[pair] * u[k, at[k]] * u[other, at[other]]
                else:
                    slope += field[pair] * u[k, at[k]]
                pair += 1
        row = z[first : first + memory.shape[last]]  # indices that cannot be negative, so that it is vectorised
        for i in range(row.size):
            row[i] += level + wide[i] + slope * tilt[i]
        next_row(at, memory.shape)
    if recent:
        z += memory.recent
    return z


@jit_inlined
def next_row(at: Ints, shape: Ints) -> None:
    """Go on to the next row of a grid: all axes but the last count up like digits."""
    for k in range(shape.size - 2, -1, -1):
        at[k] += 1
        if at[k] < shape[k]:
            return
        at[k] = 0


@jit
def is_due(movements: float) -> bool:
    """Whether the sheet is fitted now: after 50 movements, and whenever their number has doubled, up to 6,400."""
    due = SETTLING
    while due < movements:
        due *= 2
    return bool(due == movements and due <= 128 * SETTLING)


@jit
def fit_sheet(memory: Memory, aspect: float) -> None:
    """Let the sheet reach 1.4 times as far as half a picture, by the pixel gain; what it says of an offset stays.

    No axis reaches less than half as far as the widest. A head that looks about in a narrow sheet hardly turns that
    joint, and would never find out that its gain is larger.

    Args:
        memory: what the learner holds.
        aspect: height of the picture by its width.
    """
    m = memory.head.size
    ratio, offset, at = np.empty(m), np.empty(m), np.zeros(m, np.int64)
    new = np.empty(m)
    for k in range(m):
        new[k] = PICTURES * (abs(memory.gain[k, 0]) + abs(memory.gain[k, 1]) * aspect)
    widest = new.max()
    for k in range(m):
        new[k] = max(new[k], NARROWEST * widest)
        ratio[k] = new[k] / memory.reach[k]
    sheet, recent, none = np.empty_like(memory.sheet), np.empty_like(memory.recent), np.zeros(m)
    place, weight = np.empty(8, np.int64), np.empty(8)
    last = m - 1
    for first in range(0, sheet.size, memory.shape[last]):
        for i in range(memory.shape[last]):
            at[last] = i
            for k in range(m):
                offset[k] = (2.0 * at[k] / (memory.shape[k] - 1) - 1.0) * new[k]
            sheet[first + i], recent[first + i] = 0.0, 0.0
            for c in range(corners(memory, offset, none, place, weight)):
                sheet[first + i] += weight[c] * memory.sheet[place[c]]
                recent[first + i] += weight[c] * memory.recent[place[c]]
        next_row(at, memory.shape)
    write(sheet, memory.sheet)
    write(recent, memory.recent)
    _stretch_fields(memory.fields, ratio)
    _stretch_fields(memory.common, ratio)
    write(new, memory.reach)
    write(new / REACH_IN_SCALES, memory.scale)


@jit
def _stretch_fields(fields: Floats, ratio: Floats) -> None:
    """Say the same in units of psi that are `ratio` times as large, shape (m,)."""
    m = ratio.size
    for field in fields:
        pair = 2 * m + 1
        for k in range(m):
            field[0] += 0.4 * (ratio[k] ** 2 - 1.0) * field[1 + m + k]
            field[1 + k] *= ratio[k]
            field[1 + m + k] *= ratio[k] ** 2
            for other in range(k + 1, m):
                field[pair] *= ratio[k] * ratio[other]
                pair += 1
