"""Misses by arm region."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
import pytest

from somatopy.analysis.regions import FEW, arm_regions


def test_cells_hold_every_frame_and_every_miss(rich_run: Any) -> None:
    """Over each pair of joints, phase by phase, the counts are all frames and all misses."""
    hit, phase = (rich_run.frames([name])[name].to_numpy() for name in ("hit", "phase"))
    found = arm_regions(rich_run)
    assert list(found) == [0, 1]
    for index, regions in found.items():
        assert regions.joints == ("ShoulderPitch", "ShoulderRoll", "ElbowYaw", "ElbowRoll")
        assert list(regions.frames) == list(combinations(range(4), 2))
        assert {int(cells.sum()) for cells in regions.frames.values()} == {int((phase == index).sum())}
        assert {int(cells.sum()) for cells in regions.misses.values()} == {int((~hit[phase == index]).sum())}


def test_cells_are_those_of_a_histogram(rich_run: Any) -> None:
    """NumPy counts the same, with the same edges."""
    hit, phase = (rich_run.frames([name])[name].to_numpy() for name in ("hit", "phase"))
    pitch, _, yaw, _ = rich_run.postures("arm").T
    regions = arm_regions(rich_run, cells=7)[0]
    where = (phase == 0) & ~hit
    expected = np.histogram2d(pitch[where], yaw[where], [regions.edges[0], regions.edges[2]])[0]
    np.testing.assert_array_equal(regions.misses[0, 2], expected)


def test_angles_on_a_border_belong_to_the_cell_above(make_run: Any, vector_columns: Any) -> None:
    """As in NumPy's histogram, where cells hold their lower border and the last one its upper one too."""
    a, b = (part.ravel() for part in np.mgrid[0.0:5.0, 0.0:5.0])
    columns = vector_columns("arm", "ab", np.column_stack([a, b]))
    regions = arm_regions(make_run(np.zeros(25), distances=columns), cells=4)[0]
    assert regions.edges.tolist() == [[0, 1, 2, 3, 4]] * 2
    assert regions.frames[0, 1].tolist() == np.outer([1, 1, 1, 2], [1, 1, 1, 2]).tolist()


def test_shares_show_where_the_hand_is_seen(rich_run: Any) -> None:
    """The run sees half of the frames with the shoulder pitched above 0, and a tenth of the others."""
    regions = arm_regions(rich_run, cells=4)[0]
    for joint_share in (regions.along(0), regions.share(0, 3).mean(axis=1), regions.share(0, 1).mean(axis=1)):
        assert joint_share == pytest.approx([0.9, 0.9, 0.5, 0.5], abs=0.04)
    assert regions.along(3) == pytest.approx([0.7] * 4, abs=0.03)


def test_few_frames_tell_nothing(make_run: Any, vector_columns: Any) -> None:
    """Cells with fewer than two seconds are NaN, also the empty ones."""
    columns = vector_columns("arm", "ab", np.column_stack([np.r_[np.zeros(FEW), 1.0], np.zeros(FEW + 1)]))
    regions = arm_regions(make_run(np.zeros(FEW + 1), distances=columns), cells=2)[0]
    share = regions.share(0, 1)
    assert share[0, 0] == 1.0 and np.isnan(share).sum() == 3


@pytest.mark.parametrize(("frames", "cells"), [(100, 6), (6000, 10), (40_000, 24)])
def test_longer_runs_have_finer_cells(make_run: Any, vector_columns: Any, frames: int, cells: int) -> None:
    """Of twice as many frames as tell something, which is two seconds, in the mean: from 6 to 24 along a joint."""
    columns = vector_columns("arm", "ab", np.random.default_rng(0).random((frames, 2)))
    regions = arm_regions(make_run(np.zeros(frames), distances=columns))[0]
    assert regions.frames[0, 1].shape == (cells, cells)
    assert FEW == 2 * 15


def test_ways_are_not_shown_as_angles(make_run: Any, vector_columns: Any) -> None:
    """Borders come in degrees for a hinge and as they are for a slide, and the axis names the unit."""
    values = np.column_stack([np.linspace(0, np.pi, 9), np.linspace(0, 0.2, 9)])
    columns = vector_columns("arm", ["hinge"], values[:, :1])
    columns |= vector_columns("arm", ["slide"], values[:, 1:], unit="m")
    regions = arm_regions(make_run(np.zeros(9), distances=columns), cells=2)[0]
    assert regions.borders(0) == pytest.approx([0, 90, 180]) and regions.borders(1) == pytest.approx([0, 0.1, 0.2])
    assert (regions.axis(0), regions.axis(1)) == ("hinge (°)", "slide (m)")


def test_runs_without_arm_postures_have_no_regions(make_run: Any) -> None:
    """Nothing recorded, no region."""
    assert arm_regions(make_run([True])) == {}


def test_an_arm_of_one_joint_has_regions_too(make_run: Any, vector_columns: Any) -> None:
    """Along that joint every frame and every miss is counted once."""
    angle = np.linspace(0.0, 1.0, 200)
    hits = angle > 0.5
    regions = arm_regions(make_run(hits, distances=vector_columns("arm", "a", angle[:, None], unit="m")), cells=4)[0]
    assert regions.along(0).tolist() == [1.0, 1.0, 0.0, 0.0] and regions.axis(0) == "a (m)"
