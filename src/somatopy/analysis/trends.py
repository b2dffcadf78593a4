"""Linear trends of hits per window, fitted anew in each segment of a phase (section IV of the paper).

Windows that follow each other are alike, so that the textbook's standard error is too small. Here it is robust to
autocorrelation (Newey and West 1987, as statsmodels computes it): Bartlett weights up to lag
floor(4 (n / 100)^(2/9)), which is 3 for the 39 windows of the paper's first phase, and the small-sample factor
n / (n - 2). With few windows that estimate is itself unsure and more often too small than too large; so the larger of
it and the textbook's is taken, and intervals use Student's t with n - 2 degrees of freedom.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from somatopy.percept import Floats

__all__ = ["MIN_WINDOWS", "Trend", "fit_trend", "fit_trends", "lag_of", "mean_se", "newey_west", "quantile", "segments"]

MIN_WINDOWS = 3


@dataclass(frozen=True)
class Trend:
    """The regression line hits = intercept + slope * k over the windows `first` to `last` of a phase, k = 0 at `first`.

    Attributes:
        first: first window of the segment, counted inside its phase.
        last: last window of the segment, included.
        slope: change of hits per window from one window to the next.
        slope_se: standard error of the slope, see above.
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
    if np.ptp(values) == 0:  # spared the rounding, so that windows without scatter give a plain 0
        return Trend(first, last, 0.0, 0.0, float(values[0]))
    design = np.column_stack([np.ones(len(values)), np.arange(len(values), dtype=np.float64)])
    (intercept, slope), errors = _least_squares(design, values)
    return Trend(first, last, slope, errors[1], intercept)


def newey_west(design: Floats, residuals: Floats) -> Floats:
    """Autocorrelation-robust standard errors of the coefficients of a least-squares fit.

    Args:
        design: regressors, rows in the order of time, shape (n, p).
        residuals: shape (n,).

    Returns:
        Shape (p,).
    """
    from statsmodels.stats.sandwich_covariance import cov_hac

    covariance = cov_hac((design * residuals[:, None], np.linalg.inv(design.T @ design)), lag_of(len(design)))
    errors: Floats = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return errors


def lag_of(windows: int) -> int:
    """The longest lag that the standard errors of so many windows regard (Newey and West's rule of thumb).

    Example:
        >>> lag_of(39), lag_of(14), lag_of(7), lag_of(3)
        (3, 2, 2, 1)
    """
    return int(4 * (windows / 100) ** (2 / 9))


def quantile(windows: int, parameters: int = 2) -> float:
    """How many standard errors a 95 % interval reaches to each side, by Student's t.

    Example:
        >>> round(quantile(39), 3), round(quantile(7), 3)
        (2.026, 2.571)
    """
    from scipy.special import stdtrit

    return float(stdtrit(windows - parameters, 0.975))


def mean_se(counts: ArrayLike) -> float | None:
    """Standard error of the mean of successive counts, robust to their autocorrelation; None below three."""
    values = np.asarray(counts, dtype=np.float64)
    if len(values) < MIN_WINDOWS:
        return None
    return _least_squares(np.ones((len(values), 1)), values)[1][0] if np.ptp(values) else 0.0


def _least_squares(design: Floats, values: Floats) -> tuple[list[float], list[float]]:
    """Coefficients and the larger of their two standard errors."""
    coefficients = np.linalg.lstsq(design, values)[0]
    residuals = values - design @ coefficients
    variance = residuals @ residuals / (len(design) - design.shape[1])
    textbook = np.sqrt(variance * np.diag(np.linalg.inv(design.T @ design)))
    return coefficients.tolist(), np.maximum(textbook, newey_west(design, residuals)).tolist()


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
