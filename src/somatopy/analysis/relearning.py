"""How fast a learner learns, what a damage costs it, and how it comes back: measures of one learning curve.

A curve is efficiency over time: hits among the frames in which the hand could be seen. Means over a stretch are pooled,
all its hits by all its visible frames. Minutes are counted from the start of the phase to the start of the stretch that
first does it, so that a learner that is good at once needs 0.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from somatopy.analysis.windows import hits_per_window
from somatopy.clock import FRAMES_PER_MINUTE, TEN_SECONDS
from somatopy.percept import Floats

__all__ = [
    "BACK",
    "Curve",
    "deficit",
    "dip",
    "lasting",
    "minutes_back",
    "minutes_to",
    "of_phase",
    "plateau",
    "retention",
]

Bools = NDArray[np.bool_]

#: The share of a level at which a learner counts as back.
BACK = 0.95
#: Minutes over which the running efficiency is taken, and over which the slower one that must stay.
RUNNING, STAYING = 1.0, 5.0
#: Minutes after a damage in which its dip is looked for.
_DIP = 5.0
#: Sums of shares that were written down with seven digits.
_ROUNDING = 1e-6


@dataclass(frozen=True)
class Curve:
    """Hits over time, and what was possible.

    Attributes:
        hits: in consecutive steps, shape (n,).
        visible: frames of each step in which the hand could be seen, shape (n,); NaN where that is not known.
        minutes: length of a step.

    Example:
        >>> curve = Curve(np.array([0.0, 300.0, 450.0]), np.array([450.0, 450.0, 450.0]), minutes=1.0)
        >>> curve.efficiency().round(2)
        array([0.  , 0.67, 1.  ])
        >>> curve.running(2.0).round(2)
        array([0.33, 0.83])
    """

    hits: Floats
    visible: Floats
    minutes: float

    @classmethod
    def of(cls, hits: Sequence[float], shares: Sequence[float | None], frames: int, minutes: float) -> Curve:
        """From hits and the ceiling in each step of so many frames; steps beyond the ceiling's end are left out."""
        n = min(len(hits), len(shares))
        visible = np.array(shares[:n], dtype=np.float64) * frames
        return cls(np.array(hits[:n], dtype=np.float64), visible, minutes)

    def efficiency(self) -> Floats:
        """Hits by visible frames in each step, shape (n,); NaN where nothing could be seen."""
        return _ratio(self.hits, self.visible)

    def running(self, minutes: float) -> Floats:
        """Efficiency of the stretch of so many minutes that begins with each step.

        Returns:
            Shape (n - k + 1,) for stretches of k steps; empty where the curve is shorter than one.
        """
        k = max(1, round(minutes / self.minutes))
        if len(self.hits) < k:
            return np.empty(0)
        ones = np.ones(k)
        return _ratio(np.convolve(self.hits, ones, "valid"), np.convolve(self.visible, ones, "valid"))

    def level(self, first: int = 0, last: int | None = None) -> float | None:
        """Efficiency of the steps from `first` to before `last`, pooled; None where nothing could be seen."""
        hits, visible = self.hits[first:last].sum(), self.visible[first:last].sum()
        return float(hits / visible) if visible > 0 else None


def _ratio(hits: Floats, visible: Floats) -> Floats:
    shares: Floats = np.full(len(hits), np.nan)
    np.divide(hits, visible, out=shares, where=visible > 0)
    return shares


def plateau(curve: Curve) -> float | None:
    """Where learning has come to: the efficiency of the last third of the curve, pooled.

    A third is long enough that minutes of lucky or unlucky arm postures average out, and late enough that a learner
    which settles within the first half has settled. A learner that still improves has no plateau yet: this is then the
    level that it had on its way.

    Returns:
        None for a curve of fewer than three steps, or where nothing could be seen.
    """
    third = len(curve.hits) // 3
    return curve.level(len(curve.hits) - third) if third else None


def minutes_to(curve: Curve, level: float | None) -> float | None:
    """Minutes until the running one-minute efficiency first reaches a level.

    Single minutes scatter: the first one at 95 % of a plateau comes before the mean of many is there.

    Returns:
        None where it never does, or where the level is not known or 0.

    Example:
        >>> step = Curve(np.repeat([0.0, 450.0], [4, 6]), np.full(10, 450.0), minutes=1.0)
        >>> minutes_to(step, 0.95 * plateau(step))
        4.0
    """
    reached = _at_least(curve.running(RUNNING), level or np.inf)
    return float(reached.argmax() * curve.minutes) if reached.any() else None


def minutes_back(curve: Curve, level: float | None) -> float | None:
    """Minutes until the running five-minute efficiency is back at 95 % of a level, and stays there to the curve's end.

    Returns:
        None where it is not back at the end, or where the level is not known or 0.
    """
    running = curve.running(STAYING)
    return lasting(_at_least(running, BACK * level), curve.minutes) if level and len(running) else None


def lasting(good: Bools, minutes: float) -> float | None:
    """Minutes until a condition holds that holds from then on; None where it does not hold at the end."""
    bad = np.flatnonzero(~good)
    start = bad[-1] + 1 if len(bad) else 0
    return float(start * minutes) if start < len(good) else None


def dip(curve: Curve, level: float | None) -> float | None:
    """The lowest running one-minute efficiency of the first five minutes, as a share of a level."""
    steps = round((_DIP - RUNNING) / curve.minutes) + 1
    first = curve.running(RUNNING)[:steps]
    known = first[np.isfinite(first)]
    return float(known.min() / level) if level and len(known) else None


def deficit(curve: Curve, level: float | None) -> float | None:
    """What is missing against a level, in minutes in which the hand is seen whenever it can be.

    The level less the efficiency of the whole curve, times its minutes; negative where the learner does better.
    """
    found = curve.level()
    return None if level is None or found is None else (level - found) * len(curve.hits) * curve.minutes


def retention(curve: Curve, level: float | None) -> float | None:
    """The efficiency of the first minute as a share of a level."""
    first = curve.level(0, round(RUNNING / curve.minutes))
    return first / level if level and first is not None else None


def _at_least(values: Floats, level: float) -> Bools:
    return np.asarray(values >= level - _ROUNDING)


# -- what the table of cells says of a phase ---------------------------------------------------------------------------


def of_phase(
    hits: Bools, shares: Sequence[float | None], damage: str, before: Sequence[Mapping[str, Any]]
) -> dict[str, Any]:
    """The measures of a phase, by column of the table of cells; None where one is not known.

    Args:
        hits: whether the hand was seen in each frame of the phase, shape (n,).
        shares: the ceiling in each full stretch of ten seconds; empty if it was not computed.
        damage: what is damaged in the phase, or "none".
        before: the rows of the phases before, with their "frames", "damage" and "plateau".
    """
    curve = Curve.of(hits_per_window(hits, TEN_SECONDS).tolist(), shares, TEN_SECONDS, TEN_SECONDS / FRAMES_PER_MINUTE)
    steps, whole = FRAMES_PER_MINUTE // TEN_SECONDS, len(hits) // FRAMES_PER_MINUTE
    minutes = curve.visible[: len(curve.visible) // steps * steps].reshape(-1, steps).sum(axis=1) / FRAMES_PER_MINUTE
    reached = plateau(curve)
    played = [row for row in before if row["frames"]]
    level = next((row["plateau"] for row in reversed(played) if row["damage"] == "none"), None)
    undone = damage == "none" and bool(played) and played[-1]["damage"] != "none"
    return {
        "hits_per_minute": hits_per_window(hits, FRAMES_PER_MINUTE).tolist(),
        "ceiling_per_minute": [float(np.float32(share)) if np.isfinite(share) else None for share in minutes[:whole]],
        "plateau": reached,
        **{f"minutes_to_{part}": minutes_to(curve, _share(reached, part / 100)) for part in (50, 90, 95)},
        "level_before": level,
        "dip": dip(curve, level),
        "minutes_back": minutes_back(curve, level),
        "deficit_minutes": deficit(curve, level),
        "retention": retention(curve, level) if undone else None,
        "retention_minutes": minutes_to(curve, _share(level, BACK)) if undone else None,
    }


def _share(level: float | None, part: float) -> float | None:
    return None if level is None else part * level
