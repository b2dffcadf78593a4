"""What was possible: ceiling.json of a run folder, read with care.

The ceiling is the share of frames in which some head posture sees the hand, by the geometric eye; the reactive bound
is what perfect knowledge of the present, without look-ahead, makes of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest

from somatopy.analysis.runs import Run, RunFolderError
from somatopy.analysis.windows import WINDOW

__all__ = ["ceiling_rates", "ceiling_shares", "efficiency", "reactive_efficiency", "reactive_rate"]

Shares = list[float]


def ceiling_shares(run: Run) -> list[Shares] | None:
    """The share of frames in which the hand could be seen, per full window of each phase; None without a ceiling."""
    if run.ceiling is None:
        return None
    try:
        return [[float(share) for share in phase["per_window"]] for phase in run.ceiling["phases"]]
    except (KeyError, TypeError, ValueError) as error:
        raise _unusable(run, error) from error


def ceiling_rates(run: Run) -> tuple[float | None, list[float | None]]:
    """The same over all frames, and over those of each phase; None, and no phases, without a ceiling."""
    if run.ceiling is None:
        return None, []
    try:
        return run.ceiling["rate"], [phase["rate"] for phase in run.ceiling["phases"]]
    except (KeyError, TypeError) as error:
        raise _unusable(run, error) from error


def reactive_rate(run: Run) -> float | None:
    """The share of the sampled frames that perfect knowledge without look-ahead hits; None without any."""
    found = _reactive(run)
    return found and found[0]


def reactive_efficiency(run: Run) -> float | None:
    """The share of the ceiling, on the same sampled frames, that perfect knowledge without look-ahead reaches."""
    found = _reactive(run)
    return found[0] / found[1] if found and found[1] else None


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
        return (float(found["rate"]), float(found["ceiling_rate"])) if found and found["frames"] else None
    except (KeyError, TypeError, ValueError) as error:
        raise _unusable(run, error) from error


def _unusable(run: Run, error: Exception) -> RunFolderError:
    what = f"lacks {error}" if isinstance(error, KeyError) else f"cannot be used ({error})"
    return RunFolderError(f"{run.path / 'ceiling.json'} {what}. Delete it, and compute the ceiling again.")
