"""Trends are ordinary least squares, anew in each segment."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from somatopy.analysis.trends import fit_trend, fit_trends, segments

COUNTS = st.lists(st.integers(0, 4500), min_size=3, max_size=60)
BREAKS = st.lists(st.integers(1, 40), unique=True, max_size=4).map(sorted)


@given(COUNTS)
def test_agrees_with_polyfit(counts: list[int]) -> None:
    """Slope and intercept are those of numpy's own least squares."""
    trend = fit_trend(counts)
    assert trend is not None
    slope, intercept = np.polyfit(np.arange(len(counts)), counts, 1)
    assert trend.slope == pytest.approx(slope, abs=1e-7)
    assert trend.intercept == pytest.approx(intercept, abs=1e-7)


@given(COUNTS)
def test_standard_error_is_the_textbook_formula(counts: list[int]) -> None:
    """se^2 = residual sum of squares / (n - 2) / sum of squared deviations of k."""
    trend = fit_trend(counts)
    assert trend is not None
    k = np.arange(len(counts))
    residuals = np.asarray(counts) - trend.intercept - trend.slope * k
    variance = (residuals**2).sum() / (len(k) - 2) / ((k - k.mean()) ** 2).sum()
    assert trend.slope_se == pytest.approx(np.sqrt(variance), abs=1e-4)


@given(st.floats(-90, 90), st.floats(0, 3000), st.integers(3, 60))
def test_exact_lines_are_recovered(slope: float, intercept: float, windows: int) -> None:
    """Points on a line give that line, with an error of nothing."""
    trend = fit_trend(intercept + slope * np.arange(windows))
    assert trend is not None
    assert (trend.slope, trend.intercept) == pytest.approx((slope, intercept), abs=1e-8)
    assert trend.slope_se == pytest.approx(0, abs=1e-4)
    assert trend.at(windows - 1) == pytest.approx(intercept + slope * (windows - 1), abs=1e-7)


@pytest.mark.parametrize("windows", [0, 1, 2])
def test_fewer_than_three_windows_have_no_trend(windows: int) -> None:
    """Two points always lie on a line: that is no trend."""
    assert fit_trend(np.arange(windows)) is None


@given(st.integers(0, 60), BREAKS)
def test_segments_partition_the_windows(windows: int, breaks: list[int]) -> None:
    """Segments follow each other without gap or overlap, one more than breaks, each starting at its break."""
    cuts = segments(windows, breaks)
    assert [window for cut in cuts for window in cut] == list(range(windows))
    assert len(cuts) == len(breaks) + 1
    assert all(cut.start == start for cut, start in zip(cuts[1:], breaks, strict=True) if cut)


@pytest.mark.parametrize("breaks", [[0], [-1], [7, 7], [7, 3]])
def test_breaks_must_increase(breaks: list[int]) -> None:
    """Breaks that no segment could lie between are refused."""
    with pytest.raises(ValueError, match=r"trend_breaks = .* must be positive and increasing window indices"):
        segments(21, breaks)


def test_each_segment_counts_from_its_own_start() -> None:
    """The second segment's intercept is its value at its first window, not at the phase's."""
    first, second = fit_trends([9, 8, 7, 20, 22, 24, 26], breaks=[3])
    assert first is not None and second is not None
    assert (first.first, first.last, second.first, second.last) == (0, 2, 3, 6)
    assert (first.slope, first.intercept) == pytest.approx((-1, 9))
    assert (second.slope, second.intercept) == pytest.approx((2, 20))


def test_a_short_segment_leaves_the_others_alone() -> None:
    """Each segment is judged by its own length; an unreached one is None as well."""
    trends = fit_trends([5, 6, 1, 2, 3], breaks=[2, 9])
    assert [trend is None for trend in trends] == [True, False, True]
