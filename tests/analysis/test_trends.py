"""Trends are ordinary least squares, anew in each segment."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from somatopy.analysis.trends import fit_trend, fit_trends, lag_of, mean_se, newey_west, segments

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


def textbook(counts: np.ndarray) -> float:
    """Standard error of the slope if residuals were independent: RSS / (n - 2) over squared deviations of k."""
    k = np.arange(len(counts))
    residuals = counts - np.polyval(np.polyfit(k, counts, 1), k)
    return float(np.sqrt((residuals**2).sum() / (len(k) - 2) / ((k - k.mean()) ** 2).sum()))


def robust(counts: np.ndarray, lag: int) -> float:
    """Newey and West (1987), term by term: Bartlett weights 1 - l / (lag + 1), small-sample factor n / (n - 2)."""
    n = len(counts)
    x = np.column_stack([np.ones(n), np.arange(n)])
    residuals = counts - x @ np.linalg.solve(x.T @ x, x.T @ counts)
    meat = np.zeros((2, 2))
    for s in range(n):
        for t in range(n):
            if abs(s - t) <= lag:
                meat += (1 - abs(s - t) / (lag + 1)) * residuals[s] * residuals[t] * np.outer(x[s], x[t])
    bread = np.linalg.inv(x.T @ x)
    return float(np.sqrt(n / (n - 2) * (bread @ meat @ bread)[1, 1]))


@given(COUNTS)
def test_standard_error_is_the_larger_of_textbook_and_newey_west(counts: list[int]) -> None:
    """Autocorrelation widens it; with few windows it never falls below the textbook's."""
    trend, values = fit_trend(counts), np.asarray(counts, dtype=float)
    assert trend is not None
    expected = max(textbook(values), robust(values, lag_of(len(values))))
    assert trend.slope_se == pytest.approx(expected, rel=1e-6, abs=1e-4)


def test_newey_west_on_an_example() -> None:
    """What the library gives is the formula written out, and the trend takes it where residuals follow each other."""
    k = np.arange(39)
    counts = 2000 + 12 * k + 150 * np.sin(k / 3)
    x = np.column_stack([np.ones(39), k])
    residuals = counts - x @ np.linalg.lstsq(x, counts)[0]
    expected = robust(counts, 3)
    assert newey_west(x, residuals)[1] == pytest.approx(expected)
    trend = fit_trend(counts)
    assert trend is not None and trend.slope_se == pytest.approx(expected)
    assert expected > 1.3 * textbook(counts)


def test_lag_is_newey_and_wests_rule() -> None:
    """The greatest whole L with L <= 4 (n / 100)^(2/9), in whole numbers: 10^4 L^9 <= 4^9 n^2."""
    for n in range(3, 3000):
        assert lag_of(n) == max(lag for lag in range(12) if 10**4 * lag**9 <= 4**9 * n**2)


def test_newey_west_covers_where_the_textbook_does_not() -> None:
    """Over 400 flat series with autocorrelated noise, 95 % intervals hold 0 more often than the textbook's."""
    rng = np.random.default_rng(0)
    noise = rng.normal(size=(400, 60))
    for t in range(1, 60):
        noise[:, t] += 0.6 * noise[:, t - 1]
    ours = theirs = 0
    for series in noise[:, 21:]:
        trend = fit_trend(series)
        assert trend is not None
        ours += abs(trend.slope) <= 2.026 * trend.slope_se
        theirs += abs(trend.slope) <= 2.026 * textbook(series)
    assert theirs < 0.80 * 400 < ours


def test_error_of_a_mean() -> None:
    """Independent windows: about s / sqrt(n). Windows without scatter: 0. Fewer than three: none."""
    values = np.random.default_rng(1).normal(size=4000)
    error = mean_se(values)
    assert error == pytest.approx(1 / np.sqrt(4000), rel=0.1)
    assert mean_se([5, 5, 5]) == 0.0 and mean_se([5, 6]) is None


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
