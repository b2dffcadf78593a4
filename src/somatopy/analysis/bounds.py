"""What was possible: ceiling.json of a run folder, read with care.

The ceiling is the share of frames in which some head posture sees the hand, by the geometric eye; the reactive bound
is what perfect knowledge of the present, without look-ahead, makes of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import zip_longest
from typing import Any

from somatopy.analysis.described import kind_of, phases_of
from somatopy.analysis.runs import Run, RunFolderError
from somatopy.clock import WINDOW

__all__ = [
    "ceiling_rates",
    "ceiling_shares",
    "ceilings_in_time",
    "efficiency",
    "miss_distances",
    "reactive_efficiency",
    "reactive_rate",
    "why_no_ceiling",
]

Shares = list[float]


def ceiling_shares(run: Run) -> list[Shares] | None:
    """The share of frames in which the hand could be seen, per full window of each phase; None without a ceiling."""
    table = run.ceiling
    if table is None:
        return None
    try:
        return [[_share(share) for share in phase["per_window"]] for phase in table["phases"]]
    except (KeyError, TypeError, ValueError) as error:
        raise _unusable(run, error) from error


def ceiling_rates(run: Run) -> tuple[float | None, list[float | None]]:
    """The same over all frames, and over those of each phase; None, and no phases, without a ceiling."""
    table = run.ceiling
    if table is None:
        return None, []
    try:
        first, *rates = [table["rate"], *(phase["rate"] for phase in table["phases"])]
        return _known(first), [_known(rate) for rate in rates]
    except (KeyError, TypeError, ValueError) as error:
        raise _unusable(run, error) from error


def ceilings_in_time(run: Run) -> list[list[float | None]]:
    """The ceiling in each full stretch of ten seconds of each phase that the run describes; none without a ceiling."""
    try:
        return [[_known(share) for share in phase.get("per_ten_seconds", ())] for phase in _phases(run)]
    except (AttributeError, TypeError, ValueError) as error:
        raise _unusable(run, error) from error


def miss_distances(run: Run) -> list[float | None]:
    """How far a head that misses is from one that would see, rad, in each phase; None where that is not known."""
    try:
        found = [phase.get("miss_distance_rad") for phase in _phases(run)]
        return [None if distance is None else float(distance) for distance in found]
    except (AttributeError, TypeError, ValueError) as error:
        raise _unusable(run, error) from error


def _phases(run: Run) -> list[Mapping[str, Any]]:
    """What ceiling.json says of each phase that the run describes; nothing where it says nothing."""
    said = (run.ceiling or {}).get("phases", ())
    n = len(phases_of(run))
    return [*said, *[{}] * n][:n]


def reactive_rate(run: Run) -> float | None:
    """The share of the sampled frames that perfect knowledge without look-ahead hits; None without any."""
    found = _reactive(run)
    return found and found[0]


def reactive_efficiency(run: Run) -> float | None:
    """The share of the ceiling, on the same sampled frames, that perfect knowledge without look-ahead reaches."""
    found = _reactive(run)
    return found[0] / found[1] if found and found[1] else None


def why_no_ceiling(run: Run, summary: Mapping[str, Any]) -> str:
    """One sentence that says why a run has no ceiling; "" where it has one.

    Args:
        run: an open run folder.
        summary: its summary.
    """
    if run.ceiling is not None:
        return ""
    described = sum(phase.get("frames", 0) for phase in phases_of(run))
    if sum(phase["frames"] for phase in summary["phases"]) < described:
        return "There is no ceiling yet, because the run has not ended."
    if kind_of(run, "body") == "mujoco":
        return "There is no ceiling, because ceiling.json is missing; somatopy resume computes it."
    return "There is no ceiling, because the body has no model of itself."


def efficiency(hits: Sequence[int], shares: Sequence[float], window: int = WINDOW) -> list[float | None]:
    """Hits relative to the frames that could have been hits, per window.

    Args:
        hits: per full window, shape (n,).
        shares: of the frames in each window that are under the ceiling; windows beyond them have none.
        window: frames in a window.

    Returns:
        Shape (n,); None where there is no ceiling, or where it is 0. More than 1 is possible: the ceiling looks at a
        sample of the frames, and through the geometric eye.

    Example:
        >>> efficiency([1125, 900, 5], [0.5, 0.0])
        [0.5, None, None]
    """
    pairs = list(zip_longest(hits, shares[: len(hits)]))
    return [count / (share * window) if share else None for count, share in pairs]


def _reactive(run: Run) -> tuple[float, float] | None:
    found = (run.ceiling or {}).get("reactive")
    try:
        return (_share(found["rate"]), _share(found["ceiling_rate"])) if found and found["frames"] else None
    except (KeyError, TypeError, ValueError) as error:
        raise _unusable(run, error) from error


def _share(value: Any) -> float:
    if not isinstance(value, int | float) or not 0 <= value <= 1:
        raise ValueError(f"{value!r} is no share of frames")
    return float(value)


def _known(value: Any) -> float | None:
    """A share, or None where there were no frames."""
    return None if value is None else _share(value)


def _unusable(run: Run, error: Exception) -> RunFolderError:
    what = f"lacks {error}" if isinstance(error, KeyError) else f"cannot be used ({error})"
    return RunFolderError(f"{run.path / 'ceiling.json'} {what}. Delete it, and compute the ceiling again.")
