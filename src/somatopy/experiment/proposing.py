"""Proposes an anatomy for a model without one, and narrows its babbling range to where the hand can be seen."""

from __future__ import annotations

import tomllib
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from somatopy.bodies import Anatomy, BodyError, MujocoBody
from somatopy.bodies.anatomy_text import anatomy_text
from somatopy.bodies.proposal import Proposal, propose
from somatopy.bodies.servos import proposed_servos
from somatopy.bodies.survey import read_model, survey
from somatopy.experiment.ceiling import Vantages
from somatopy.experiment.look import confined
from somatopy.percept import Floats

__all__ = ["Proposed", "proposed"]

_GRID = {1: (33,), 2: (25, 9), 3: (13, 9, 5)}


@dataclass(frozen=True)
class Proposed:
    """An anatomy that was proposed.

    Attributes:
        proposal: its content.
        text: the text of its file.
        anatomy: the anatomy, read from that text.
    """

    proposal: Proposal
    text: str
    anatomy: Anatomy


def proposed(path: str | Path) -> Proposed:
    """Propose an anatomy for an MJCF or URDF file, with a babbling range in which the hand can mostly be seen.

    Args:
        path: path of the model. The text of the anatomy has it as it is written here.

    Raises:
        BodyError: the model cannot be read, or has nothing that could be an arm.
    """
    model = read_model(path)
    found = survey(model)
    best = _written(propose(model, found, path), path)
    seen = _confined(best.anatomy)
    if seen is None and best.proposal.neck is None:
        other = _written(propose(model, found, path, neck=True), path)
        if (seen := _confined(other.anatomy)) is not None:
            best = other
    return best if seen is None else _written(_narrowed(best.proposal, seen), path)


def _written(proposal: Proposal, path: str | Path) -> Proposed:
    text = anatomy_text(proposal)
    if proposal.servos:
        gains = proposed_servos(_read(text, path))
        servos = {name: gains[name].model_dump(exclude_none=True) for name in proposal.servos}
        text = anatomy_text(proposal, servos)
    return Proposed(proposal, text, _read(text, path))


def _read(text: str, path: str | Path) -> Anatomy:
    """An anatomy as `Anatomy.load` reads it from a file in the current folder."""
    return Anatomy.model_validate(tomllib.loads(text)).model_copy(update={"model": Path(path)})


def _confined(anatomy: Anatomy) -> Floats | None:
    try:
        body = MujocoBody(anatomy, motion="kinematic")
    except BodyError:
        return None
    with closing(body):
        return confined(Vantages.of(body, _GRID.get(len(body.head))))


def _narrowed(proposal: Proposal, seen: Floats) -> Proposal:
    """The proposal with that babbling range, whose middle is where the robot starts if it has no keyframe."""
    scale = 10.0 ** np.maximum(3, np.ceil(2 - np.log10(np.ptp(seen, axis=1))))  # a hundredth of it at most is lost
    low, high = np.ceil(seen[:, 0] * scale) / scale, np.floor(seen[:, 1] * scale) / scale
    ranges = {"confined": tuple(zip(low.tolist(), high.tolist(), strict=True))}
    middle = dict(zip(proposal.arm.joints, (np.round(0.5 * (low + high) * scale) / scale).tolist(), strict=True))
    return replace(proposal, ranges=ranges, posture={} if proposal.home else middle)
