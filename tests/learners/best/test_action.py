"""Where to look: against a search through all candidates, one by one (docs/best.md, step 9)."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator
from tests.learners.best.test_visibility import every_head
from tests.learners.best.world import robot

from somatopy.learners.best.action import best_gaze, chances
from somatopy.learners.best.memory import Memory, fresh
from somatopy.percept import Floats, Space

BIN = 0.1  # rad


def knowing(head: Space, seed: int) -> tuple[Memory, Floats, Floats]:
    """A head with a bias that was cut at all commands, a hand near the end of its first joint, and some evidence.

    By odd seeds evidence grows to the lower end of the last joint, by even ones to the upper end.
    """
    memory, rng = fresh(robot(2, head)), np.random.default_rng(seed)
    memory.bias[:] = rng.uniform(-0.1, 0.1, len(head))
    memory.reach[:] = rng.uniform(0.3, 0.8, len(head))
    memory.ends[1:, 0] = rng.uniform(-0.4, 0.0, memory.ends[1:, 0].shape)
    memory.ends[1:, 1] = rng.uniform(0.05, 0.3, memory.ends[1:, 1].shape)
    centre = rng.uniform(-0.15, 0.15, len(head))
    centre[0] += head.upper[0]
    slope = 4 * (-1) ** seed * np.linspace(-1, 1, int(memory.shape[-1]))
    return memory, centre, np.resize(slope, memory.sheet.size) + rng.normal(size=memory.sheet.size)


def by_body(memory: Memory, command: Floats) -> Floats:
    """A command as the body cuts it: to its limits, and each joint to what it may at the command of the one before."""
    cut = np.clip(command, *memory.limits.T)
    for k in range(1, len(cut)):
        place = np.clip(np.rint(cut[k - 1] / BIN) - np.rint(memory.limits[k - 1, 0] / BIN), 0, memory.ends.shape[2] - 1)
        cut[k] = np.clip(cut[k], *memory.ends[k, :, int(place)])
    return cut


def read(memory: Memory, field: Floats, offset: Floats) -> float:
    """Evidence at an offset, bilinearly; none beyond the sheet."""
    axes = [np.linspace(-reach, reach, n) for reach, n in zip(memory.reach, memory.shape, strict=True)]
    offset = np.where(np.abs(np.abs(offset) - memory.reach) < 1e-9, np.sign(offset) * memory.reach, offset)
    inside = RegularGridInterpolator(axes, field.reshape(tuple(memory.shape)), bounds_error=False, fill_value=-np.inf)
    return float(inside(offset)[0])


@every_head
@pytest.mark.parametrize("seed", range(4))
def test_no_cell_of_the_sheet_is_better_than_the_gaze_that_is_taken(head: Space, seed: int) -> None:
    """Each is a candidate: cut as the body cuts it, with the bias between command and posture, and read where it lies.

    What is asked for is what the body will do.
    """
    memory, centre, field = knowing(head, seed)
    command = np.empty(len(head))
    best_gaze(memory, centre, field, command)
    steps = [2 * np.arange(n) / (n - 1) - 1 for n in memory.shape]
    cells = centre + np.array([*product(*steps)]) * memory.reach
    best = max(read(memory, field, by_body(memory, cell - memory.bias) + memory.bias - centre) for cell in cells)
    assert np.isfinite(best)
    assert read(memory, field, command + memory.bias - centre) == pytest.approx(best)
    np.testing.assert_allclose(by_body(memory, command), command)


@every_head
def test_where_no_gaze_is_on_the_sheet_it_looks_at_the_hand(head: Space) -> None:
    """As far as the head goes."""
    memory, centre, field = knowing(head, 0)
    memory.reach[:], memory.ends[:, 0], memory.ends[:, 1] = 0.1, -np.inf, np.inf
    centre[:] = head.upper + 1.0
    command = np.empty(len(head))
    best_gaze(memory, centre, field, command)
    np.testing.assert_allclose(command, np.minimum(head.upper, head.upper - memory.bias))


@every_head
def test_a_chance_is_the_sigmoid_of_the_evidence_where_the_head_will_be(head: Space) -> None:
    """Which is the command and the bias; beyond the sheet there is none."""
    memory, centre, field = knowing(head, 1)
    rng, found = np.random.default_rng(2), np.empty(40)
    gazes = centre + rng.uniform(-1.1, 1.1, (40, len(head))) * memory.reach - memory.bias
    chances(memory, centre, field, gazes, found)
    expected = [1 / (1 + np.exp(-read(memory, field, gaze + memory.bias - centre))) for gaze in gazes]
    np.testing.assert_allclose(found, expected, atol=1e-12)
    assert 0 < (found > 0).sum() < 40 or len(head) == 1
