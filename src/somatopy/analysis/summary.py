"""The measures of a run: what summary.json holds."""

from __future__ import annotations

import json
import os
from dataclasses import asdict
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from somatopy.analysis.bounds import ceiling_rates, ceiling_shares, efficiency, reactive_rate
from somatopy.analysis.runs import Run, RunFolderError
from somatopy.analysis.trends import fit_trends
from somatopy.analysis.windows import hits_per_window, moving_mean
from somatopy.percept import Floats

__all__ = ["summarise", "write_summary"]


def summarise(run: Run) -> dict[str, Any]:
    """Compute the measures of a run, finished or killed.

    Each phase of the description has its entry with the frames that are there. What a run is too short for, or its
    learner does not record, is None; `hits_per_window` is empty without a full window, `trends` has one entry a
    segment. Distortion is the mean winner distance of the last 1,800 inputs after the update, in [0, 1] units, running
    on across phase borders: at the phase's first frame with 1,800 inputs behind it, its maximum in the phase, and at
    the phase's last frame (the paper, section IV and Fig. 4). Efficiency, and both bounds, need ceiling.json.

    Args:
        run: an open run folder.

    Returns:
        Plain data, ready for JSON.

    Raises:
        RunFolderError: a damaged part, or a description that lacks a key needed here.
    """
    hits, phase_of_frame = (_column(run, name) for name in ("hit", "phase"))
    distortions = {side: _distortion(run, f"{side}_distance") for side in ("arm", "head")}
    phases = _setting(run, "phases")
    borders = np.searchsorted(phase_of_frame, np.arange(len(phases) + 1))
    shares = [*(ceiling_shares(run) or []), *[None] * len(phases)][: len(phases)]
    return {
        "seed": _setting(run, "seed"),
        "eye": _setting(run, "eye", "kind"),
        "motion": _setting(run, "body", "motion"),
        "learner": _setting(run, "learner", "kind"),
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
    aside = run.path / "summary.json.partial"
    aside.write_text(json.dumps(summary, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    os.replace(aside, run.path / "summary.json")
    return summary


def _phase(
    phase: dict[str, Any], hits: NDArray[np.bool_], distortions: dict[str, Floats], ceiling: list[float] | None
) -> dict[str, Any]:
    total, counts = int(hits.sum()), hits_per_window(hits)
    trends = fit_trends(counts, phase.get("trend_breaks", ()))
    return {
        "damage": phase.get("damage", {}).get("kind", "none"),
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
    return moving_mean(_column(run, name)) if name in run.columns else np.empty(0)


def _column(run: Run, name: str) -> NDArray[Any]:
    values: NDArray[Any] = run.frames([name])[name].to_numpy()
    return values.astype(bool) if name == "hit" else values


def _setting(run: Run, *keys: str) -> Any:
    value: Any = run.description
    for depth, key in enumerate(keys):
        if not isinstance(value, dict) or key not in value:
            where = f"[{'.'.join(keys[:depth])}] in " if depth else ""
            raise RunFolderError(f"{where}{run.path / 'experiment.toml'} lacks {key!r}: it does not describe a run.")
        value = value[key]
    return value
