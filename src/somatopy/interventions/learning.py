"""Interventions on the learner: some of its parts stop learning, it starts anew, or its associations are shuffled."""

from __future__ import annotations

from typing import Annotated

from typing_extensions import Doc

from somatopy.contract import Shuffles, Stage
from somatopy.interventions.base import NoIntervention

__all__ = ["Afresh", "PlasticParts", "Shuffled"]


class PlasticParts(NoIntervention):
    """Lets only some parts of the learner learn.

    Args:
        parts: names of the parts that learn. If there are none, nothing learns.

    Raises:
        ValueError: on `check`, if the learner has no such part.
    """

    def __init__(self, parts: Annotated[tuple[str, ...], Doc("Parts of the learner that learn.")] = ()) -> None:
        self._parts = frozenset(parts)
        self._before: frozenset[str] = frozenset()

    def check(self, stage: Stage) -> None:
        """Check that the learner has these parts."""
        parts = stage.learner.parts
        if unknown := sorted(self._parts - parts):
            known = ", ".join(sorted(parts)) or "none, so leave plastic away"
            raise ValueError(f"the learner has no part {unknown[0]!r} that learns; valid parts: {known}")

    def hold(self, stage: Stage) -> None:
        """Say which parts learn."""
        learner = stage.learner
        self._before, learner.plastic = learner.plastic, self._parts

    def release(self, stage: Stage) -> None:
        """Let the parts learn again that learned before."""
        stage.learner.plastic = self._before


class Afresh(NoIntervention):
    """Replaces the learner by a fresh one, so that everything that it has learned is forgotten."""

    def begin(self, stage: Stage) -> None:
        """Put a fresh learner in its place."""
        stage.renew_learner()


class Shuffled(NoIntervention):
    """Shuffles what the learner has associated, so that it hits by chance only.

    Raises:
        ValueError: on `check`, if the learner has nothing to shuffle.
    """

    def check(self, stage: Stage) -> None:
        """Check that the learner has associations to shuffle."""
        if not isinstance(stage.learner, Shuffles):
            raise ValueError("the learner has no links to shuffle; choose continue or afresh")

    def begin(self, stage: Stage) -> None:
        """Shuffle, once."""
        if isinstance(stage.learner, Shuffles):
            stage.learner.shuffle(stage.rng)
