"""Windows over frames: hits per 5 minutes, and means over the last 2 minutes (section IV of the paper)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from somatopy.clock import DISTORTION_WIDTH, WINDOW
from somatopy.percept import Floats

__all__ = ["hits_per_window", "moving_mean"]


def hits_per_window(hits: ArrayLike, window: int = WINDOW) -> NDArray[np.int64]:
    """Count hits in consecutive full windows; frames after the last full window are left out.

    Args:
        hits: whether the hand was detected, one boolean a frame, shape (n,).
        window: frames in a window.

    Returns:
        Counts, shape (n // window,).

    Example:
        >>> hits_per_window([True, False, True, True, True], window=2)
        array([1, 2])
    """
    flags = np.asarray(hits, dtype=bool)
    _check_width("window", window)
    full = len(flags) // window
    counts: NDArray[np.int64] = flags[: full * window].reshape(full, window).sum(axis=1, dtype=np.int64)
    return counts


def moving_mean(values: ArrayLike, width: int = DISTORTION_WIDTH) -> Floats:
    """Mean over the last `width` values, the current one included.

    Differences of one cumulative sum: O(n) time and memory whatever the width. Rounding is at most
    2 n u sum|x| / width with u = 1.1e-16, and in practice far less: under 1e-12 for 300,000 values in [0, 1].

    Args:
        values: shape (n,). Where one is not finite, only the means that contain it are NaN.
        width: how many values a mean spans.

    Returns:
        Means aligned with the values, shape (n,); NaN where fewer than `width` values have come.

    Example:
        >>> moving_mean([1.0, 2.0, 4.0], width=2)
        array([nan, 1.5, 3. ])
    """
    x = np.asarray(values, dtype=np.float64)
    _check_width("width", width)
    means = np.full(len(x), np.nan)
    if len(x) >= width:
        finite = np.isfinite(x)
        complete = _sliding_sum(finite.astype(np.float64), width) == width
        means[width - 1 :] = np.where(complete, _sliding_sum(np.where(finite, x, 0.0), width) / width, np.nan)
    return means


def _sliding_sum(x: Floats, width: int) -> Floats:
    total = np.cumsum(x)
    total[width:] -= total[:-width].copy()
    return total[width - 1 :]


def _check_width(name: str, value: int) -> None:
    if value < 1:
        raise ValueError(f"{name} = {value} must be at least 1 frame.")
