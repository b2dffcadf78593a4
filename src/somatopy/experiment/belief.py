"""Records what a learner believes about some arm postures: the file belief.npz of a run folder.

The learner is asked about a few arm postures at the end of each window and of each phase. It says where it would look.
If it is `Believing`, it also says from which gazes of a grid the hand can be seen, as it believes. Asking does not
change the learner.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from somatopy.contract import Believing, Modelled, Twin
from somatopy.experiment.ceiling import Vantages
from somatopy.experiment.context import Context, stream
from somatopy.experiment.session import Session
from somatopy.files import write_whole
from somatopy.percept import Floats

__all__ = ["BELIEF", "GRIDS", "POSTURES", "Beliefs", "coarse", "predicted"]

#: The file's name.
BELIEF = "belief.npz"
#: Arm postures that the learner is asked about.
POSTURES = 8
#: Head postures along each head joint, by their number: half as many as the ceiling tries, where it tries many.
GRIDS = {1: (97,), 2: (49, 15), 3: (25, 15, 9)}

_TRIED = 1000  # arm postures drawn before no more are looked for
_ONE = 255  # what stands for 1 in the file


class Beliefs:
    """Records what the learner of a session believes, and writes it to a file.

    The arm postures are drawn from the babbling range before the first frame. They are postures in which the robot can
    see its hand at that time.

    Args:
        session: the session whose learner is asked. Its body must have a model of itself, and no frame may have run
            yet.

    Attributes:
        arrays: the content of the file, by name:
            `arms`, the postures, shape (k, n_arm), rad; `heads`, the gazes of the grid that the head can take, shape
            (m, n_head), rad; `shape`, steps of the grid along each head joint; `cells`, where each gaze stands in it,
            shape (m,); `limits`, low and high of each head joint, shape (n_head, 2), rad;
            `frame`, frames done when the learner was asked, shape (t,); `phase`, the phase of the last of them, shape
            (t,); `gaze`, where it would look, shape (t, k, n_head), rad; `belief`, in 255ths and rounded down, shape
            (t, k, m), or (t, k, 0) where the learner says none.
    """

    def __init__(self, session: Session) -> None:
        assert isinstance(session.body, Twin)
        vantages = coarse(session.body)
        arms = _held_out(session, vantages)
        believed = len(vantages.heads) if isinstance(session.learner, Believing) else 0
        self.arrays: dict[str, NDArray[Any]] = {
            "arms": arms,
            "heads": vantages.heads,
            "shape": np.array(vantages.shape),
            "cells": vantages.cells,
            "limits": np.array(session.body.head.space.limits),
            "frame": np.empty(0, np.int64),
            "phase": np.empty(0, np.int64),
            "gaze": np.empty((0, len(arms), vantages.heads.shape[1])),
            "belief": np.empty((0, len(arms), believed), np.uint8),
        }

    @classmethod
    def of(cls, session: Session, since: Mapping[str, Any] | None) -> Self | None:
        """The record for a session that begins, or that continues from a checkpoint.

        Returns:
            None for a body without a model of itself, and for a run that has not recorded beliefs so far.
        """
        if since is None:
            body = session.body
            return cls(session) if isinstance(body, Twin) and len(body.head) in GRIDS else None
        if not since.get("beliefs"):
            return None
        beliefs = cls.__new__(cls)
        beliefs.arrays = {name: np.array(array) for name, array in since["beliefs"].items()}
        return beliefs

    def note(self, session: Session) -> None:
        """Ask the learner once. This must happen between two frames."""
        if session.done in self.arrays["frame"]:
            return
        learner, arms = session.learner, session.feel(self.arrays["arms"])
        gaze = [session.body.legal(predicted(session, arm)) for arm in arms]  # type: ignore[attr-defined]
        believed = np.zeros((len(arms), self.arrays["belief"].shape[2]), np.uint8)
        if isinstance(learner, Believing) and believed.size:
            believed[:] = _ONE * learner.belief(arms, self.arrays["heads"])
        noted = {"frame": session.done, "phase": session.reached, "gaze": gaze, "belief": believed}
        for name, value in noted.items():
            array = self.arrays[name]
            one = np.asarray(value, array.dtype).reshape(1, *array.shape[1:])
            self.arrays[name] = np.concatenate([array, one])

    def write(self, folder: Path) -> None:
        """Write the file, if the learner was asked anything."""
        if self.arrays["gaze"].size:
            write_whole(folder / BELIEF, lambda file: np.savez_compressed(file, allow_pickle=False, **self.arrays))


def predicted(session: Session, arm: Floats) -> Floats:
    """Where a session's learner would look for an arm posture, shape (n_head,), rad.

    Raises:
        ValueError: the learner gives something else.
    """
    head, gaze = session.body.head, np.asarray(session.learner.predict(arm), float)
    if gaze.shape != head.lower.shape:
        raise ValueError(
            f"predict() of the learner {session.description.learner.kind!r} gives the shape {gaze.shape}; it must give "
            f"{head.lower.shape}, an angle for each of {', '.join(head.names)}."
        )
    return gaze


def coarse(body: Modelled) -> Vantages:
    """The coarse grid of gazes about which a learner is asked, with what can be seen from each."""
    return Vantages.of(body, GRIDS[len(body.head)])


def _held_out(session: Session, vantages: Vantages) -> Floats:
    """Arm postures from the babbling range, uniform, that some gaze sees, shape (k, n_arm), rad."""
    description, rng = session.description, stream(session.description.seed, "held-out postures")
    low, high = Context(description, session.body).bounds().T
    found: list[Floats] = []
    for arm in rng.uniform(low, high, (_TRIED, len(low))):
        if vantages.seeing(arm).any():
            found.append(arm)
        if len(found) == POSTURES:
            break
    return np.array(found).reshape(len(found), len(low))
