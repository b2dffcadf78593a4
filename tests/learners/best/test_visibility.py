"""From where the hand can be seen: docs/best.md, steps 4 to 6, written out for heads of one, two and three joints."""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np
import pytest
from scipy.interpolate import interpn
from tests.learners.best.world import HEAD, World, robot

from somatopy.learners import BestLearner
from somatopy.learners.best.directions import dual_of
from somatopy.learners.best.memory import TURNS, Memory, fresh
from somatopy.learners.best.visibility import evidence, fade, fit_sheet, in_reach, is_due, learn_visibility
from somatopy.percept import Floats, Ints, Space

HEADS = {
    "one": Space(("yaw",), [-1.5], [2.0]),
    "two": HEAD,
    "three": Space(("yaw", "pitch", "roll"), [-2.0, -0.7, -0.3], [2.0, 0.6, 0.4]),
}
every_head = pytest.mark.parametrize("head", HEADS.values(), ids=HEADS)


class Known(NamedTuple):
    """A memory that knows something, and what is active at a posture: two units, of which one has half forgotten."""

    memory: Memory
    phi: Floats
    dual: Floats
    index: Ints
    share: Floats
    voice: Floats

    def sheet(self, which: str, offset: Floats) -> float:
        """One of both sheets at an offset, read bilinearly."""
        axes = [np.linspace(-reach, reach, n) for reach, n in zip(self.memory.reach, self.memory.shape, strict=True)]
        cells = getattr(self.memory, which).reshape(tuple(self.memory.shape))
        return float(interpn(axes, cells, offset)[0])

    def psi(self, offset: Floats) -> Floats:
        """The monomials of an offset up to degree 2, in two thirds of the reach, .4 less for squares."""
        u = offset / (self.memory.reach * 2 / 3)
        pairs = [u[k] * u[other] for k, other in combinations(range(len(u)), 2)]
        return np.array([1.0, *u, *(u * u - 0.4), *pairs])

    def smooth(self, offset: Floats) -> float:
        return float(self.phi @ self.memory.common @ self.psi(offset))

    def own(self, share: Floats, offset: Floats) -> float:
        return float(share @ self.memory.fields[self.index] @ self.psi(offset))


def known(head: Space) -> Known:
    memory, rng = fresh(robot(2, head)), np.random.default_rng(0)
    for name in ("sheet", "recent", "common"):
        array = getattr(memory, name)
        array[:] = rng.normal(size=array.shape)
    memory.fields[:3] = rng.normal(size=(3, memory.fields.shape[1]))
    memory.reach[:] = rng.uniform(0.3, 0.6, len(head))
    memory.scale[:] = memory.reach * 2 / 3
    t = rng.uniform(-1, 1, 2)
    phi, dual = np.array([1.0, *t, t[0] ** 2, t[0] * t[1], t[1] ** 2]), np.empty(6)
    dual_of(memory, phi, dual)
    return Known(memory, phi, dual, np.array([2, 0]), np.array([0.7, 0.3]), np.array([0.35, 0.3]))


def learned(it: Known, offset: Floats, hit: bool, trust: float, fields: bool, recent: bool) -> None:
    learn_visibility(it.memory, offset, hit, trust, fields, recent, it.phi, it.dual, it.index, it.share, it.voice, 2)


@every_head
@pytest.mark.parametrize("hit", [True, False])
def test_sheet_smooth_part_and_units_take_their_parts_of_the_error(head: Space, hit: bool) -> None:
    """Where it looked, f goes by .1 delta, F by .3 and the units by .6, with delta = trust (hit - sigma(z)).

    z is what was believed there, less what units have forgotten.
    """
    it, trust = known(head), 0.7
    offset = np.array([0.37, -0.61, 0.12])[: len(head)] * it.memory.reach
    before = it.sheet("sheet", offset), it.smooth(offset), it.own(it.share, offset)
    z = before[0] + before[1] + it.own(it.voice, offset)
    delta = trust * (hit - 1 / (1 + np.exp(-z)))
    recent = it.memory.recent.copy()
    learned(it, offset, hit, trust, True, False)
    after = it.sheet("sheet", offset), it.smooth(offset), it.own(it.share, offset)
    np.testing.assert_allclose(np.subtract(after, before), delta * np.array([0.1, 0.3, 0.6]), atol=1e-12)
    np.testing.assert_array_equal(it.memory.recent, recent)


@every_head
def test_working_memory_gets_a_stroke_of_what_nobody_foresaw(head: Space) -> None:
    """3 (hit - sigma(z + E)) high and two cells wide, in all cells at most five away; nothing else learns."""
    it = known(head)
    offset = np.array([0.37, -0.9, 0.12])[: len(head)] * it.memory.reach
    z = it.sheet("sheet", offset) + it.smooth(offset) + it.own(it.voice, offset) + it.sheet("recent", offset)
    kept = {name: getattr(it.memory, name).copy() for name in ("recent", "sheet", "common", "fields")}
    learned(it, offset, True, 0.7, False, True)
    where = (offset / it.memory.reach + 1) / 2 * (it.memory.shape - 1)
    apart = np.indices(tuple(it.memory.shape)).reshape(len(head), -1).T - where
    near = (np.abs(apart + where - np.rint(where)) <= 5).all(axis=1)
    stroke = 3 * (1 - 1 / (1 + np.exp(-z))) * np.exp(-(apart**2).sum(axis=1) / 8) * near
    np.testing.assert_allclose(it.memory.recent - kept.pop("recent"), stroke, atol=1e-12)
    for name, array in kept.items():
        np.testing.assert_array_equal(getattr(it.memory, name), array)


def test_working_memory_fades_by_15_percent() -> None:
    """In each frame."""
    it = known(HEAD)
    before = it.memory.recent.copy()
    fade(it.memory)
    np.testing.assert_allclose(it.memory.recent, 0.85 * before)


@every_head
@pytest.mark.parametrize("recent", [True, False])
def test_evidence_is_z_at_every_cell(head: Space, recent: bool) -> None:
    """f + (F' phi + sum a w) . psi, and E if the last seconds count."""
    it = known(head)
    found = evidence(it.memory, recent, it.phi, it.index, it.voice, 2)
    grid = np.stack(np.unravel_index(np.arange(found.size), tuple(it.memory.shape)), axis=1)
    offsets = (2 * grid / (it.memory.shape - 1) - 1) * it.memory.reach
    expected = [it.smooth(offset) + it.own(it.voice, offset) for offset in offsets]
    np.testing.assert_allclose(found, expected + it.memory.sheet + recent * it.memory.recent, atol=1e-12)


@pytest.mark.parametrize("axis", [0, 1])
def test_what_is_far_beyond_the_sheet_teaches_nothing(axis: int) -> None:
    """Four cells beyond still do, on either side."""
    memory = fresh(robot(2))
    memory.reach[:] = 0.6, 0.3
    cell = 2 * memory.reach[axis] / 30
    for side in (-1, 1):
        for cells, taught in ((3.99, True), (4.01, False)):
            offset = np.zeros(2)
            offset[axis] = side * (memory.reach[axis] + cells * cell)
            assert in_reach(memory, offset) == taught


# -- a sheet that is fitted --------------------------------------------------------------------------------------------


def test_the_sheet_is_fitted_after_50_movements_and_whenever_these_have_doubled() -> None:
    """Up to 6,400."""
    assert [k for k in range(20_000) if is_due(float(k))] == [50, 100, 200, 400, 800, 1600, 3200, 6400]


def test_the_sheet_reaches_1_4_times_as_far_as_half_a_picture() -> None:
    """Half its width counts 1, half its height as much less as it is lower; both add up where the axes are askew."""
    memory = fresh(robot(2))
    memory.gain[:] = [[-0.6, 0.2], [0.1, -0.5]]
    fit_sheet(memory, 0.75)
    np.testing.assert_allclose(memory.reach, [1.4 * (0.6 + 0.75 * 0.2), 1.4 * (0.1 + 0.75 * 0.5)])
    np.testing.assert_allclose(memory.scale, memory.reach * 2 / 3)


@every_head
def test_what_was_just_seen_stays_where_it_was(head: Space) -> None:
    """The working memory is read from the old cells, at the same offsets; one that is linear stays so."""
    memory, m = fresh(robot(2, head)), len(head)
    slope = np.array([1.0, -2.0, 0.5])[:m]

    def linear() -> Floats:
        axes = [np.linspace(-reach, reach, n) for reach, n in zip(memory.reach, memory.shape, strict=True)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, m) @ slope

    memory.recent[:], before = linear(), memory.reach.copy()
    memory.gain[:] = 0.8 * memory.reach[0] / 1.4 * np.eye(m, 2)
    fit_sheet(memory, 1.0)
    assert (memory.reach < before).all()
    np.testing.assert_allclose(memory.recent, linear(), atol=1e-12)


@pytest.mark.parametrize("size", [(320, 240), (240, 320)])
def test_a_learner_fits_its_sheet_to_the_shape_of_its_picture(size: tuple[int, int]) -> None:
    """At its 50th movement, to the pixel gain that it then has; until then to half the smallest range of its head."""
    body = robot(4, HEAD, *size)
    learner, world = BestLearner(body, np.random.default_rng(0)), World(body)
    memory, first, command = learner._memory, np.full(2, 0.65), world.head
    while memory.numbers[TURNS] < 50:
        np.testing.assert_allclose(memory.reach, first)
        percept = world.percept(command)
        learner.observe(percept)
        command = learner.gaze(percept)
    reach = 1.4 * np.abs(memory.gain) @ [1.0, size[1] / size[0]]
    assert np.abs(reach / first - 1).min() > 0.02
    np.testing.assert_allclose(memory.reach, np.maximum(reach, reach.max() / 2))
