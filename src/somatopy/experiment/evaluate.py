"""What a run has learned, asked of arm postures that it never met, with learning off."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from somatopy.experiment.build import babbling_range, stream
from somatopy.experiment.ceiling import Vantages, reachable
from somatopy.experiment.checkpoint import FILE
from somatopy.experiment.description import DescriptionError, load_description
from somatopy.experiment.loop import Experiment, MakeLearner
from somatopy.percept import Percept

__all__ = ["evaluate"]


def evaluate(folder: str | Path, postures: int = 2000, learner: MakeLearner | None = None) -> dict[str, Any]:
    """Show the learner of a run uniform arm postures from its babbling range, and see where it looks.

    The damage of the phase that the run has reached is in force. Body and learner stand still: each posture is judged
    by the geometric eye with the head where the learner says, clipped to the limits.

    Args:
        folder: a run folder with a checkpoint.
        postures: how many to draw, from a random stream that no run uses.
        learner: the learner of your own that the run began with, if it did.

    Returns:
        `eye`, `postures`, `reachable` (share that any head posture sees), `rate` (share seen), `efficiency` (seen of
        those reachable), `gaze_error_deg` with `median` and `p95` between the optical axis and the hand.

    Raises:
        DescriptionError: no run folder, or it has no checkpoint.
    """
    folder = Path(folder)
    description = load_description(folder / "experiment.toml")
    if postures < 1:
        raise DescriptionError(f"At least one posture is needed, not {postures}.")
    experiment = Experiment(description.replaced(eye={"kind": "geometric"}), learner)
    experiment.restore_from(folder / FILE)
    body, damage = experiment.body, experiment.damage
    damage.injure(body)
    vantages = Vantages.of(body)
    rng = stream(description.seed, "evaluation")
    low, high = babbling_range(description, body).T
    arms = rng.uniform(low, high, (postures, len(body.arm)))
    seen, errors = np.zeros(postures, bool), np.zeros(postures)
    for k, arm in enumerate(arms):
        percept = damage.sense(Percept(0.0, arm, body.head.lower, arm, body.head.lower), rng)
        view = body.view(arm, body.legal(experiment.learner.predict(percept.arm)))
        seen[k], errors[k] = vantages.eye.find(view) is not None, np.rad2deg(view.gaze_error)
    possible = reachable(vantages, arms) | seen
    body.close()
    return {
        "eye": "geometric",
        "postures": postures,
        "reachable": float(possible.mean()),
        "rate": float(seen.mean()),
        "efficiency": float(seen.sum() / possible.sum()) if possible.any() else None,
        "gaze_error_deg": {"median": float(np.median(errors)), "p95": float(np.percentile(errors, 95))},
    }
