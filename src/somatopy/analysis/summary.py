"""The measures of a run: what summary.json holds."""

from __future__ import annotations

from dataclasses import asdict
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from somatopy.analysis.bounds import ceiling_rates, ceiling_shares, efficiency, reactive_rate
from somatopy.analysis.described import kind_of, phases_of, setting
from somatopy.analysis.phases import damage_text
from somatopy.analysis.runs import Run, RunFolderError, writing
from somatopy.analysis.trends import fit_trends
from somatopy.analysis.windows import hits_per_window, moving_mean
from somatopy.files import write_json
from somatopy.percept import Floats

__all__ = ["summarise", "write_summary"]


def summarise(run: Run) -> dict[str, Any]:
    """Compute the measures of a run, finished or killed.

    Each phase of the description has its entry with the frames that are there; its damage is the kinds of its
    interventions in one text. What a run is too short for, or its learner does not record, is None; `hits_per_window`
    is empty without a full window, `trends` has one entry a segment. Distortion is the mean winner distance of the last
    1,800 inputs after the update, in the unit of its column (see `distance_units`), running on across phase borders: at
    the phase's first frame with 1,800 inputs behind it, its maximum in the phase, and at the phase's last frame (the
    paper, section IV and Fig. 4). Efficiency, and both bounds, need ceiling.json. `motion` is None for a body that
    offers no choice of it.

    Args:
        run: an open run folder.

    Returns:
        Plain data, ready for JSON.

    Raises:
        RunFolderError: a damaged part, a description that lacks a key needed here, or a folder in another format.
    """
    run.check_format()
    phases, kinds = phases_of(run), {part: kind_of(run, part) for part in ("body", "eye", "learner")}
    hits, borders = run.values("hit").astype(bool), _borders(run, len(phases))
    distortions = {side: _distortion(run, f"{side}_distance") for side in ("arm", "head")}
    shares = [*(ceiling_shares(run) or []), *[None] * len(phases)][: len(phases)]
    return {
        "seed": setting(run, "seed"),
        "eye": kinds["eye"],
        "motion": setting(run, "body").get("motion"),
        "learner": kinds["learner"],
        "ceiling_rate": ceiling_rates(run)[0],
        "reactive_rate": reactive_rate(run),
        "phases": [
            _phase(phase, hits[start:stop], {side: mean[start:stop] for side, mean in distortions.items()}, ceiling)
            for phase, (start, stop), ceiling in zip(phases, pairwise(borders), shares, strict=True)
        ],
    }


def write_summary(run: Run) -> dict[str, Any]:
    """Summarise a run and write its summary.json: same frames, same bytes; replaced as a whole or not at all.

    Returns:
        The summary.
    """
    summary = summarise(run)
    with writing(run.path / "summary.json") as path:
        write_json(path, summary)
    return summary


def _borders(run: Run, phases: int) -> NDArray[np.int64]:
    """Where each phase begins, and the last one ends, in frames."""
    found = run.values("phase")
    inside = all(index in range(phases) for index in (*found[:1], *found[-1:]))
    if len(found) and not (inside and (np.diff(found) >= 0).all()):
        raise RunFolderError(
            f"The frames in {run.path / 'frames'} have the phases {np.unique(found).tolist()}, and experiment.toml "
            f"describes {phases}, which follow each other from 0: restore the file that belongs to these frames."
        )
    return np.searchsorted(found, np.arange(phases + 1))


def _phase(
    phase: dict[str, Any], hits: NDArray[np.bool_], distortions: dict[str, Floats], ceiling: list[float] | None
) -> dict[str, Any]:
    total, counts = int(hits.sum()), hits_per_window(hits)
    trends = fit_trends(counts, phase.get("trend_breaks", ()))
    return {
        "damage": damage_text(phase.get("interventions", ())),
        "frames": len(hits),
        "hits": total,
        "rate": total / len(hits) if len(hits) else None,
        "hits_per_window": counts.tolist(),
        "efficiency_per_window": None if ceiling is None else efficiency(counts.tolist(), ceiling),
        "trends": [None if trend is None else asdict(trend) for trend in trends],
        "arm_distortion": _landmarks(distortions["arm"]),
        "head_distortion": _landmarks(distortions["head"]),
    }


def _landmarks(means: Floats) -> dict[str, float | None]:
    known = means[np.isfinite(means)]
    if not len(known):
        return {"start": None, "peak": None, "end": None}
    end = float(means[-1]) if np.isfinite(means[-1]) else None
    return {"start": float(known[0]), "peak": float(known.max()), "end": end}


def _distortion(run: Run, name: str) -> Floats:
    return moving_mean(run.values(name)) if name in run.columns else np.empty(0)
