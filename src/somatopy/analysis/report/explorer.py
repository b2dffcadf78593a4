"""Data of the report's map explorer: maps and strongest links at window ends, packed for the page's script."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from somatopy.analysis.columns import readable
from somatopy.analysis.figures.maps import joint_pairs
from somatopy.analysis.runs import Run
from somatopy.analysis.snapshots import Snapshot, paper_snapshot
from somatopy.clock import FRAMES_PER_MINUTE

__all__ = ["explorer"]

#: The page shows no more windows than this, spread evenly, so that its size stays bounded.
WINDOWS = 60
LINKS = 100
#: Postures are packed as whole steps, so many to a degree or a metre, and shown with so many decimals.
STEPS = {"°": (100, 0)}
OTHER_STEPS = (10_000, 3)


def explorer(run: Run) -> dict[str, Any] | None:
    """Everything the page needs to draw the maps of any window.

    Args:
        run: an open run folder.

    Returns:
        Plain data for JSON; arrays are base64 of 16-bit integers. None where the run has no snapshots, or those of a
        learner whose maps are not the paper's.
    """
    paths = run.snapshots
    chosen = np.unique(np.linspace(0, len(paths) - 1, min(WINDOWS, len(paths))).round().astype(int))
    snapshots = [maps for index in chosen if (maps := paper_snapshot(run, paths[index])) is not None]
    if not snapshots:
        return None
    first = snapshots[0]
    arm, head = (_side(run, side) for side in ("arm", "head"))
    factor, sign = readable(run.units("head")[0])
    return {
        "arm": {**arm, "shape": first.arm_shape},
        "head": {**head, "shape": first.head_shape},
        "yaw": (factor * first.head_limits[0]).round(1 if sign == "°" else 4).tolist(),
        "windows": [_packed(snapshot, _scale(run, "arm"), _scale(run, "head")) for snapshot in snapshots],
    }


def _side(run: Run, side: str) -> dict[str, Any]:
    """Names of the joints, in which pairs they are shown, and how their values are packed and written."""
    joints, signs = run.joints(side), [readable(unit)[1] for unit in run.units(side)]
    steps, decimals = zip(*(STEPS.get(sign, OTHER_STEPS) for sign in signs), strict=True)
    return {"joints": joints, "pairs": joint_pairs(len(joints)), "signs": signs, "steps": steps, "decimals": decimals}


def _scale(run: Run, side: str) -> NDArray[Any]:
    """By what each joint's values are multiplied to be packed."""
    shown = [readable(unit) for unit in run.units(side)]
    return np.array([factor * STEPS.get(sign, OTHER_STEPS)[0] for factor, sign in shown])


def _packed(maps: Snapshot, arm: NDArray[Any], head: NDArray[Any]) -> dict[str, Any]:
    pre, post, weight = maps.gaze_links()
    leads = np.full(len(maps.arm_codebook), -1)
    leads[pre] = post
    return {
        "minutes": round(maps.frame / FRAMES_PER_MINUTE, 1),
        "arm": _base64(maps.arm_postures() * arm),
        "head": _base64(maps.head_postures() * head),
        "leads": _base64(leads),
        "pre": _base64(pre[:LINKS]),
        "strength": _base64(1000 * weight[:LINKS] / weight.max() if len(weight) else []),
        "links": len(maps.link_weight),
        "linked": len(pre),
    }


def _base64(values: ArrayLike) -> str:
    whole = np.clip(np.rint(np.asarray(values, dtype=np.float64)), -(2**15), 2**15 - 1)
    return base64.b64encode(whole.astype("<i2").tobytes()).decode("ascii")
