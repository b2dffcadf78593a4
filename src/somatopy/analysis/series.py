"""Series for plots: rates, distortion and gaze error over time, thinned to what a picture can show.

NaN breaks a line where a phase ends.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from somatopy.analysis.bounds import ceiling_rates, ceiling_shares, ceilings_in_time
from somatopy.analysis.phases import played
from somatopy.analysis.runs import Run
from somatopy.analysis.windows import hits_per_window, moving_mean
from somatopy.clock import FRAMES_PER_MINUTE, TEN_SECONDS, WINDOW
from somatopy.percept import Floats, Ints

__all__ = [
    "border_name",
    "borders",
    "ceiling_line",
    "distance_units",
    "distortion",
    "gaze_error",
    "gaze_stretch",
    "in_minutes",
    "in_shares",
    "levels",
    "line",
    "lone",
    "phase_starts",
    "running_ceiling",
    "running_rate",
    "window_starts",
]

Phases = Sequence[Mapping[str, Any]]
Line = tuple[Floats, Floats]
#: Stretches of ten seconds in a minute.
TENS = FRAMES_PER_MINUTE // TEN_SECONDS
#: A run of up to so many windows is drawn over minutes, and its gaze over stretches of one minute.
SHORT = 6


def in_minutes(end: float) -> bool:
    """Whether a run that ends after so many windows is short, so that its time is told in minutes.

    Example:
        >>> in_minutes(0.6), in_minutes(60.8)
        (True, False)
    """
    return end <= SHORT


def lone(values: Floats) -> Ints:
    """Which points of a line have no neighbour, so that nobody would see them without a mark; indices.

    Example:
        >>> lone(np.array([1.0, 2.0, np.nan, 3.0, np.nan])).tolist()
        [3]
    """
    known = np.pad(np.isfinite(values), 1)
    return np.flatnonzero(known[1:-1] & ~known[:-2] & ~known[2:])


def line(values: Sequence[Sequence[float | None]], phases: Phases) -> Line:
    """Values per full window of each phase as one line over the run, in percent, broken between phases."""
    return _line([[*zip(starts, found, strict=False)] for starts, found in _beside(values, phases)], phases)


def levels(values: Sequence[Sequence[float | None]], means: Sequence[float | None], phases: Phases) -> Line:
    """The same, but a phase of less than two full windows is level at its mean, from its start to its end.

    Args:
        values: shares per full window of each phase.
        means: share over each whole phase.
        phases: of the summary.
    """
    parts = [[*zip(starts, found, strict=False)] for starts, found in _beside(values, phases)]
    ends = [*pairwise(phase_starts(phases))]
    for index, (part, mean) in enumerate(zip(parts, means, strict=False)):
        if len(part) < 2:
            parts[index] = [(at, mean) for at in ends[index]]
    return _line(parts, phases)


def _beside(values: Sequence[Sequence[float | None]], phases: Phases) -> list[tuple[Any, Any]]:
    """Where windows start, and the values there, phase by phase."""
    return [*zip(window_starts(phases), [*values, *[()] * len(phases)], strict=False)]


def _line(parts: Sequence[Sequence[tuple[float, float | None]]], phases: Phases) -> Line:
    at: list[float] = []
    shown: list[float] = []
    for index in played(phases):
        at += [*(start for start, _ in parts[index]), np.nan]
        shown += [*(np.nan if value is None else 100 * value for _, value in parts[index]), np.nan]
    return np.array(at), np.array(shown)


def running_rate(run: Run) -> Line:
    """Share of frames with the hand in view over a running minute.

    Returns:
        Where each minute starts, in windows, every ten seconds; the share, percent. A phase shorter than a minute has
        one point, its own share.
    """
    hits, phase = run.values("hit").astype(bool), run.values("phase")
    parts = [hits[phase == index] for index in np.unique(phase)]
    shares = [hits_per_window(part, TEN_SECONDS) / TEN_SECONDS for part in parts]
    return _running(shares, [part.mean() for part in parts], [len(part) / WINDOW for part in parts])


def running_ceiling(run: Run, phases: Phases) -> Line:
    """The ceiling over a running minute, as `running_rate` gives the run's; empty where it was not noted."""
    found = ceilings_in_time(run)
    kept = [index for index in played(phases) if index < len(found)]
    shares = [np.array([np.nan if share is None else share for share in found[index]]) for index in kept]
    if not any(map(len, shares)):
        return np.empty(0), np.empty(0)
    lengths = [phases[index]["frames"] / WINDOW for index in kept]
    return _running(shares, [np.nan] * len(shares), lengths)


def ceiling_line(run: Run, phases: Phases) -> Line:
    """The ceiling as it is drawn beside the run: see `levels`."""
    return levels(ceiling_shares(run) or [], ceiling_rates(run)[1], phases)


def _running(shares: Sequence[Floats], means: Sequence[float], lengths: Sequence[float]) -> Line:
    at: list[float] = []
    shown: list[float] = []
    start = 0.0
    for share, mean, length in zip(shares, means, lengths, strict=True):
        minutes = moving_mean(share, TENS)[TENS - 1 :] if len(share) >= TENS else np.array([mean])
        at += [*(start + np.arange(len(minutes)) * TEN_SECONDS / WINDOW), np.nan]
        shown += [*(100 * minutes), np.nan]
        start += length
    return np.array(at), np.array(shown)


def distortion(run: Run, side: str, every: int = 300) -> Line:
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
    phase = run.values("phase")[every - 1 :: every]
    cuts = np.flatnonzero(np.diff(phase[known])) + 1
    return np.insert(at[known], cuts, np.nan), np.insert(means[known], cuts, np.nan)


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


def gaze_stretch(run: Run) -> int:
    """Over how many minutes the gaze error of a run is told: five, of short runs one."""
    return 1 if in_minutes(len(run.values("phase")) / WINDOW) else 5


def gaze_error(run: Run, minutes: int | None = None) -> Line:
    """How far the optical axis points past the hand: quartiles and 95th percentile of consecutive stretches.

    Args:
        run: an open run folder.
        minutes: length of a stretch, `gaze_stretch` if None; a shorter rest at the end of a phase is left out.

    Returns:
        Where each stretch starts, in windows, shape (n,); the 25th, 50th, 75th and 95th percentiles of the angle,
        degrees, shape (n, 4). Empty where the angle was not recorded.
    """
    size = round((minutes or gaze_stretch(run)) * FRAMES_PER_MINUTE)
    angles = run.values("gaze_error_rad") if "gaze_error_rad" in run.columns else np.empty(0)
    phase = run.values("phase")[: len(angles)]
    at, found = [np.empty(0)], [np.empty((0, 4))]
    for start, stop in pairwise([0, *(np.flatnonzero(np.diff(phase)) + 1), len(angles)]):
        full = (stop - start) // size
        stretches = np.degrees(np.asarray(angles[start : start + full * size], dtype=np.float64)).reshape(full, size)
        known = np.isfinite(stretches).any(axis=1)
        if known.any():
            gap = int(len(at) > 1)
            at += [np.full(gap, np.nan), (start + np.flatnonzero(known) * size) / WINDOW]
            found += [
                np.full((gap, 4), np.nan),
                np.nanpercentile(stretches[known], [25, 50, 75, 95], axis=1).T.reshape(-1, 4),
            ]
    return np.concatenate(at), np.concatenate(found)


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
