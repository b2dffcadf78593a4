"""Linear trends of hits per window, fitted anew in each segment of a phase (section IV of the paper)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

__all__ = ["MIN_WINDOWS", "Trend", "fit_trend", "fit_trends", "segments"]

MIN_WINDOWS = 3


@dataclass(frozen=True)
class Trend:
    """The regression line hits = intercept + slope * k over the windows `first` to `last` of a phase, k = 0 at `first`.

    Attributes:
        first: first window of the segment, counted inside its phase.
        last: last window of the segment, included.
        slope: change of hits per window from one window to the next.
        slope_se: standard error of the slope, as if the residuals were independent.
        intercept: hits in a window at k = 0.

    Example:
        >>> trend = fit_trend([10, 13, 16, 19], first=7)
        >>> trend.first, trend.last, round(trend.slope, 9), round(trend.at(2), 9)
        (7, 10, 3.0, 16.0)
    """

    first: int
    last: int
    slope: float
    slope_se: float
    intercept: float

    def at(self, k: float) -> float:
        """Hits per window on the line, `k` windows after the segment's start."""
        return self.intercept + self.slope * k


def fit_trend(counts: ArrayLike, first: int = 0) -> Trend | None:
    """Fit counts against k = 0, 1, ... by ordinary least squares.

    Args:
        counts: hits of full windows, shape (n,).
        first: which window of the phase the first count belongs to.

    Returns:
        The trend, or None for fewer than three windows, where a slope has no standard error.
    """
    values = np.asarray(counts, dtype=np.float64)
    if len(values) < MIN_WINDOWS:
        return None
    last = first + len(values) - 1
    if np.ptp(values) == 0:  # without scatter linregress gives no standard error
        return Trend(first, last, 0.0, 0.0, float(values[0]))
    from scipy.stats import linregress

    fit = linregress(np.arange(len(values)), values)
    return Trend(first, last, float(fit.slope), float(fit.stderr), float(fit.intercept))


def segments(windows: int, breaks: Sequence[int] = ()) -> list[range]:
    """Cut `windows` windows where new trends start.

    Args:
        windows: full windows in the phase.
        breaks: windows, counted inside the phase, at which a new segment starts; the paper's phase 2: [7].

    Returns:
        The windows of each segment, always one segment more than breaks; those a short phase did not reach are empty.

    Raises:
        ValueError: breaks are not positive and increasing.

    Example:
        >>> segments(21, [7])
        [range(0, 7), range(7, 21)]
    """
    if any(after <= before for before, after in pairwise((0, *breaks))):
        raise ValueError(f"trend_breaks = {list(breaks)} must be positive and increasing window indices, such as [7].")
    edges = [min(edge, windows) for edge in (0, *breaks, windows)]
    return [range(start, stop) for start, stop in pairwise(edges)]


def fit_trends(counts: ArrayLike, breaks: Sequence[int] = ()) -> list[Trend | None]:
    """Fit one trend a segment; None where a segment has fewer than three windows.

    Args:
        counts: hits per full window of one phase, shape (n,).
        breaks: see `segments`.
    """
    values = np.asarray(counts)
    return [fit_trend(values[cut.start : cut.stop], cut.start) for cut in segments(len(values), breaks)]
