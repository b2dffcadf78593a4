"""Series for plots: distortion and gaze error over time, thinned to what a picture can show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from somatopy.analysis.phases import played
from somatopy.analysis.runs import Run
from somatopy.analysis.windows import moving_mean
from somatopy.clock import FRAMES_PER_MINUTE, WINDOW
from somatopy.percept import Floats

__all__ = [
    "border_name",
    "borders",
    "distance_units",
    "distortion",
    "gaze_error",
    "in_shares",
    "phase_starts",
    "window_starts",
]


def distortion(run: Run, side: str, every: int = 300) -> tuple[Floats, Floats]:
    """The moving mean of winner distances over 1,800 inputs (the paper's Figures 4 and 5).

    Args:
        run: an open run folder.
        side: "arm" or "head".
        every: frames from one point to the next; the means themselves take every frame.

    Returns:
        Time in windows, and the means there, in the unit that `distance_units` tells; empty where the learner records
        none or the run is too short.
    """
    name = f"{side}_distance"
    if name not in run.columns:
        return np.empty(0), np.empty(0)
    means = moving_mean(run.values(name))[every - 1 :: every]
    at = (1 + np.arange(len(means))) * every / WINDOW
    known = np.isfinite(means)
    return at[known], means[known]


def distance_units(run: Run) -> dict[str, str]:
    """The units in which a run has the distances from arm and head to their winners: see `in_shares`."""
    return {side: run.unit(f"{side}_distance") for side in ("arm", "head")}


def in_shares(unit: str) -> bool:
    """Whether a distance of this unit is one in [0, 1] units, of which 1 is a joint's whole range, as the paper's are.

    Example:
        >>> in_shares("1"), in_shares("rad")
        (True, False)
    """
    return unit in ("", "1")


def gaze_error(run: Run, minutes: float = 5.0) -> tuple[Floats, Floats]:
    """How far the optical axis points past the hand: quartiles and 95th percentile of consecutive stretches.

    Args:
        run: an open run folder.
        minutes: length of a stretch; a shorter rest at the end is left out.

    Returns:
        Where each stretch starts, in windows, shape (n,); the 25th, 50th, 75th and 95th percentiles of the angle,
        degrees, shape (n, 4). Empty where the angle was not recorded.
    """
    size = round(minutes * FRAMES_PER_MINUTE)
    angles = run.values("gaze_error_rad") if "gaze_error_rad" in run.columns else np.empty(0)
    full = len(angles) // size
    stretches = np.degrees(np.asarray(angles[: full * size], dtype=np.float64)).reshape(full, size)
    known = np.isfinite(stretches).any(axis=1)
    at = np.flatnonzero(known) * size / WINDOW
    return at, np.nanpercentile(stretches[known], [25, 50, 75, 95], axis=1).T.reshape(-1, 4)


def phase_starts(phases: Sequence[Mapping[str, Any]]) -> list[float]:
    """Where each phase of a summary starts, and where the last one ends, in windows."""
    starts = [0.0]
    for phase in phases:
        starts.append(starts[-1] + phase["frames"] / WINDOW)
    return starts


def window_starts(phases: Sequence[Mapping[str, Any]]) -> list[list[float]]:
    """Where each full window of each phase starts, in windows from the run's start."""
    counts = [len(phase["hits_per_window"]) for phase in phases]
    return [[start + k for k in range(n)] for start, n in zip(phase_starts(phases), counts, strict=False)]


def borders(phases: Sequence[Mapping[str, Any]]) -> list[tuple[float, str]]:
    """Where a phase begins that follows another, in windows, and what happens there; phases without frames are none."""
    starts = phase_starts(phases)
    return [
        (starts[after], border_name(phases[before]["damage"], phases[after]["damage"]))
        for before, after in pairwise(played(phases))
    ]


def border_name(before: str, after: str) -> str:
    """What to call the border between phases with these damages."""
    if after != "none":
        return "damage"
    return "damage undone" if before != "none" else "next phase"
