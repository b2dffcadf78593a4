"""Series for plots."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from somatopy.analysis import summarise
from somatopy.analysis.series import borders, distortion, gaze_error, levels, running_rate, window_starts
from somatopy.analysis.windows import moving_mean


def test_distortion_is_thinned_not_coarsened(rich_run: Any) -> None:
    """Every point is the mean of all 1,800 inputs before it."""
    means = moving_mean(rich_run.frames(["arm_distance"])["arm_distance"].to_numpy())
    at, found = distortion(rich_run, "arm", every=250)
    known = np.isfinite(at)
    frames = np.rint(at[known] * 4500).astype(int) - 1
    assert (np.diff(frames) == 250).all() and frames[0] >= 1799
    np.testing.assert_array_equal(found[known], means[frames])


def test_gaze_error_is_in_degrees_by_stretches(make_run: Any) -> None:
    """Percentiles of each full stretch; frames where it is unknown do not count, stretches of such are left out."""
    angles = np.radians(np.r_[np.full(900, 10.0), np.full(900, np.nan), np.linspace(0, 100, 901)[:900], 5.0])
    angles[:100] = np.nan
    at, found = gaze_error(make_run(np.ones(2701), distances={"gaze_error_rad": angles}), minutes=1)
    assert at == pytest.approx([0, 0.4])
    assert found[0] == pytest.approx([10] * 4)
    assert found[1] == pytest.approx([25, 50, 75, 95], abs=0.2)


def test_lines_break_where_a_phase_ends(rich_run: Any) -> None:
    """Distortion, gaze error and running minute have one gap, at the damage after 5 of 9 windows."""
    for at, values in (distortion(rich_run, "head"), gaze_error(rich_run), running_rate(rich_run)):
        (gap, *_) = np.flatnonzero(np.isnan(at))
        assert np.isnan(values[gap]).all() and np.isnan(at[:-1]).sum() == 1
        assert at[gap - 1] <= 5 <= at[gap + 1]


def test_stretches_of_gaze_error_keep_to_their_phase(make_run: Any) -> None:
    """Of 90 s and 90 s each has one minute; the third would mix them."""
    angles = np.radians(np.r_[np.full(1350, 10.0), np.full(1350, 50.0)])
    run = make_run(np.ones(1350), np.ones(1350), distances={"gaze_error_rad": angles})
    at, found = gaze_error(run)
    assert at[[0, 2]] == pytest.approx([0, 0.3]) and found[[0, 2], 1] == pytest.approx([10, 50])


def test_the_running_minute_is_the_mean_of_its_frames(make_run: Any) -> None:
    """Every ten seconds, phase by phase; a phase of less than a minute has one point, its mean."""
    hits = np.random.default_rng(3).random(2700) < 0.4
    at, percent = running_rate(make_run(hits[:2000], hits[2000:]))
    starts = np.rint(4500 * at[np.isfinite(at)]).astype(int)
    assert starts.tolist() == [*range(0, 2000 - 899, 150), 2000]
    expected = [hits[k : k + 900].mean() for k in starts[:-1]] + [hits[2000:].mean()]
    assert percent[np.isfinite(percent)] == pytest.approx(100 * np.array(expected))


def test_short_phases_are_level(make_run: Any) -> None:
    """Under two windows: the mean from start to end. From two on: a point a window."""
    phases = summarise(make_run(np.ones(4600), np.ones(9000)))["phases"]
    at, percent = levels([[0.5], [0.2, 0.4]], [0.45, 0.3], phases)
    assert at[~np.isnan(at)] == pytest.approx([0, 4600 / 4500, 4600 / 4500, 4600 / 4500 + 1])
    assert percent[~np.isnan(at)] == pytest.approx([45, 45, 20, 40]) and np.isnan(at[2])


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
