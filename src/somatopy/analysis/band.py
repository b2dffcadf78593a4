"""The band of a run: the same experiment under more seeds, from the study folder inside the run folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from somatopy.analysis.cells import StudyResult, load_study
from somatopy.analysis.comparison import courses
from somatopy.analysis.described import on_papers_robot
from somatopy.analysis.runs import Run
from somatopy.analysis.verdicts import Judged, judge_over_seeds
from somatopy.percept import Floats

__all__ = ["Spread", "render_verdicts", "seeds_of", "spread_of", "verdict_rows", "verdicts_of"]


class Spread(NamedTuple):
    """Hits per window over the seeds of a band; NaN between phases, where a line is to be broken.

    Attributes:
        seeds: how many seeds.
        at: where each window starts, in windows from the start of the run, shape (n,).
        mean: mean over seeds, shape (n,).
        low: the lowest seed, shape (n,).
        high: the highest seed, shape (n,).
    """

    seeds: int
    at: Floats
    mean: Floats
    low: Floats
    high: Floats


def spread_of(run: Run) -> Spread | None:
    """The band of a run, or None where it has none, or none with a full window."""
    result = _opened(run)
    if result is None:
        return None
    (course, *_), _ = courses(result)
    if not np.isfinite(course.at).any():
        return None
    hits = np.ma.masked_invalid(np.array([*course.seeds.values()]))
    low, high = (np.ma.filled(ends, np.nan) for ends in (hits.min(axis=0), hits.max(axis=0)))
    return Spread(len(course.seeds), course.at, course.mean, low, high)


def verdicts_of(run: Run) -> list[Judged]:
    """What the seeds of a run's band say to the paper's claims; empty where it has none, or of another robot."""
    result = _opened(run) if on_papers_robot(run) else None
    return judge_over_seeds(result, result.conditions[0]) if result is not None else []


def seeds_of(run: Run) -> int:
    """How many seeds the band of a run has; 0 where it has none."""
    result = _opened(run)
    return 0 if result is None else len(set(result.table["seed"].to_pylist()))


def _opened(run: Run) -> StudyResult | None:
    result = load_study(run.band) if run.band is not None else None
    return result if result is not None and len(result.table) else None


def verdict_rows(judged: Sequence[Judged]) -> list[Mapping[str, str]]:
    """Verdicts as text: claim, mean with its interval, the paper's number, seeds that show it and chance, verdict."""
    return [
        {
            "claim": one.claim.text,
            "ours": _interval(one),
            "paper": _paper(one),
            "shown": _shown(one),
            "verdict": one.verdict,
        }
        for one in judged
    ]


def render_verdicts(judged: Sequence[Judged], seeds: int | None = None) -> str:
    """The same as fixed-width text.

    Args:
        judged: the verdicts.
        seeds: how many seeds there are; as many as the longest claim has if None.
    """
    seeds = max((one.interval.n for one in judged), default=0) if seeds is None else seeds
    lines = [(f"over {seeds} seeds, geometric eye", "mean [95 %]", "seeds", "verdict")]
    for one, row in zip(judged, verdict_rows(judged), strict=True):
        lines.append((one.claim.key, row["ours"], row["shown"], row["verdict"]))
    widths = [max(len(line[k]) for line in lines) for k in range(4)]
    return "\n".join("  ".join(cell.ljust(w) for cell, w in zip(line, widths, strict=True)).rstrip() for line in lines)


def _interval(one: Judged) -> str:
    form, found = one.claim.form, one.interval
    if found.mean is None:
        return "too short"
    said = form.format(found.mean)
    if found.low is not None and found.high is not None:
        said += f" [{form.format(found.low)}, {form.format(found.high)}]"
    return f"{said} {one.claim.unit}".strip()


def _shown(one: Judged) -> str:
    """How many seeds show the claim by themselves, and how many would by chance."""
    if one.shown is None:
        return ""
    return f"{one.shown.count} of {one.shown.n} (chance {one.shown.chance * one.shown.n:.3g})"


def _paper(one: Judged) -> str:
    if one.claim.paper is None:
        return ""
    where = {True: ", inside the spread of seeds", False: ", outside the spread of seeds", None: ""}
    return one.claim.form.format(one.claim.paper) + where[one.paper_is_inside]
