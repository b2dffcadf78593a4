"""Series for plots."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from somatopy.analysis import summarise
from somatopy.analysis.series import borders, distortion, gaze_error, window_starts
from somatopy.analysis.windows import moving_mean


def test_distortion_is_thinned_not_coarsened(rich_run: Any) -> None:
    """Every point is the mean of all 1,800 inputs before it."""
    means = moving_mean(rich_run.frames(["arm_distance"])["arm_distance"].to_numpy())
    at, found = distortion(rich_run, "arm", every=250)
    frames = np.rint(at * 4500).astype(int) - 1
    assert (np.diff(frames) == 250).all() and frames[0] >= 1799
    np.testing.assert_array_equal(found, means[frames])


def test_gaze_error_is_in_degrees_by_stretches(make_run: Any) -> None:
    """Percentiles of each full stretch; frames where it is unknown do not count, stretches of such are left out."""
    angles = np.radians(np.r_[np.full(900, 10.0), np.full(900, np.nan), np.linspace(0, 100, 901)[:900], 5.0])
    angles[:100] = np.nan
    at, found = gaze_error(make_run(np.ones(2701), distances={"gaze_error_rad": angles}), minutes=1)
    assert at == pytest.approx([0, 0.4])
    assert found[0] == pytest.approx([10] * 4)
    assert found[1] == pytest.approx([25, 50, 75, 95], abs=0.2)


def test_what_was_not_recorded_is_empty(make_run: Any) -> None:
    """Learners without maps, bodies without a known hand."""
    run = make_run(np.ones(5000))
    assert distortion(run, "arm")[0].size == gaze_error(run)[0].size == 0


def test_borders_name_what_happens(make_run: Any) -> None:
    """Damage from the second phase on; a phase that was never reached has no border."""
    phases = summarise(make_run(np.ones(9000), np.ones(4500)))["phases"]
    assert borders(phases) == [(2.0, "damage")]
    assert window_starts(phases) == [[0, 1], [2]]
    undone = [*phases, {**phases[0], "damage": "none"}, {**phases[0], "damage": "none"}]
    assert [name for _, name in borders(undone)] == ["damage", "damage undone", "next phase"]
    idle = {**phases[1], "frames": 0}
    assert [name for _, name in borders([idle, phases[0], idle, phases[0], idle])] == ["next phase"]
    assert borders(summarise(make_run(np.ones(9), np.ones(9), recorded=9, folder="killed"))["phases"]) == []
