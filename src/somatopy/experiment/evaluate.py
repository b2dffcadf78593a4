"""Tests what a run has learned on arm postures that it has never met, without learning."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from somatopy.contract import Modelled, Twin
from somatopy.experiment.belief import predicted
from somatopy.experiment.ceiling import Vantages, reachable
from somatopy.experiment.context import Context, stream
from somatopy.experiment.description import DescriptionError
from somatopy.experiment.run_folder import RunFolder
from somatopy.experiment.session import Session
from somatopy.percept import Percept

__all__ = ["evaluate"]


def evaluate(folder: str | Path, postures: int = 2000, *, anyway: bool = False, **parts: Any) -> dict[str, Any]:
    """Ask the learner of a run where to look for arm postures, drawn uniformly from its babbling range.

    The interventions of the phase that the run has reached are in force: they change body, learner and percepts as in
    the run. Changes of commands have no effect, since no command is given. The body does not move, and the learner does
    not learn. For each posture the head is put where the learner predicts, clipped to the limits. The geometric eye
    then decides whether the hand would be seen.

    Args:
        folder: a run folder with a checkpoint.
        postures: number of postures. They are drawn from a random stream that no run uses.
        anyway: whether to go on even if versions or code differ from those that wrote the folder.
        parts: parts of your own that the run began with and that cannot be imported; see `Session`.

    Returns:
        Plain data, by key. `eye` is the eye that decided. `damage` is that of the phase which the run has reached:
        "none" before the first frame. `postures` is their number. `reachable` is the share of postures in which some
        head posture sees the hand. `rate` is the share in which the predicted one does. `efficiency` is `rate` divided
        by `reachable`, or None if the hand can never be seen. `gaze_error_deg` has `median` and `p95`, the 95th
        percentile, of the angle between the optical axis and the hand, degrees.

    Raises:
        DescriptionError: the folder is no run folder or has no checkpoint, or the body has no model of itself.
    """
    if postures < 1:
        raise DescriptionError(f"At least one posture is needed, not {postures}.")
    source = RunFolder(folder)
    description = source.description(**parts)
    with _Still(description) as session:
        if not isinstance(session.body, Twin):
            raise DescriptionError(
                f"The body of {folder} has no model of itself, which evaluate needs to compute what the robot would "
                "see in other postures."
            )
        source.restore(session, anyway=anyway)
        if not session.done:  # no phase has begun
            return {"eye": "geometric", "damage": "none", **_asked(session, session.body, postures)}
        with session.holding(session.reached):
            damage = session.description.phases[session.reached].damage
            return {"eye": "geometric", "damage": damage, **_asked(session, session.body, postures)}


class _Still(Session):
    """A session from which no frame is taken, so that it also works where nothing can be drawn."""

    def _try_drawing(self) -> None:
        pass


def _asked(session: Session, body: Modelled, postures: int) -> dict[str, Any]:
    vantages, rng = Vantages.of(body), stream(session.description.seed, "evaluation")
    low, high = Context(session.description, body).bounds().T
    arms = rng.uniform(low, high, (postures, len(body.arm)))
    seen, errors = np.zeros(postures, bool), np.zeros(postures)
    for k, arm in enumerate(arms):
        percept = session.sense(Percept(0.0, arm, body.head.lower, arm, body.head.lower))
        gaze = predicted(session, percept.arm)
        if not np.isfinite(gaze).all():
            raise DescriptionError(
                f"The learner {session.description.learner.kind!r} looks at {gaze.tolist()} for the arm posture "
                f"{percept.arm.tolist()}: its predict() must give finite angles."
            )
        view = body.view(arm, body.legal(gaze))
        seen[k], errors[k] = vantages.eye.find(view) is not None, np.rad2deg(view.gaze_error)
    possible = reachable(vantages, arms) | seen
    return {
        "postures": postures,
        "reachable": float(possible.mean()),
        "rate": float(seen.mean()),
        "efficiency": float(seen.sum() / possible.sum()) if possible.any() else None,
        "gaze_error_deg": {"median": float(np.median(errors)), "p95": float(np.percentile(errors, 95))},
    }
