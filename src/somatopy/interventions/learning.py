"""What is done to the learner: some parts stop to learn, it begins afresh, or its associations are shuffled."""

from __future__ import annotations

from typing import Annotated

from typing_extensions import Doc

from somatopy.contract import Shuffles, Stage
from somatopy.interventions.base import NoIntervention

__all__ = ["Afresh", "PlasticParts", "Shuffled"]


class PlasticParts(NoIntervention):
    """Only some parts of the learner learn.

    Args:
        parts: names of those that do; none of them if empty.

    Raises:
        ValueError: on `check`, if the learner has no such part.
    """

    def __init__(self, parts: Annotated[tuple[str, ...], Doc("Parts of the learner that learn.")] = ()) -> None:
        self._parts = frozenset(parts)
        self._before: frozenset[str] = frozenset()

    def check(self, stage: Stage) -> None:
        """See that the learner has these parts."""
        parts = stage.learner.parts
        if unknown := sorted(self._parts - parts):
            known = ", ".join(sorted(parts)) or "none, so leave plastic away"
            raise ValueError(f"the learner has no part {unknown[0]!r} that learns; valid parts: {known}")

    def hold(self, stage: Stage) -> None:
        """Say which parts learn."""
        learner = stage.learner
        self._before, learner.plastic = learner.plastic, self._parts

    def release(self, stage: Stage) -> None:
        """Let learn again what did before."""
        stage.learner.plastic = self._before


class Afresh(NoIntervention):
    """The learner begins anew: all that it has learned is forgotten."""

    def begin(self, stage: Stage) -> None:
        """Put a fresh learner in its place."""
        stage.renew_learner()


class Shuffled(NoIntervention):
    """What the learner has associated is given to other inputs, so that what is still hit is hit by chance.

    Raises:
        ValueError: on `check`, if the learner has nothing to shuffle.
    """

    def check(self, stage: Stage) -> None:
        """See that the learner has something to shuffle."""
        if not isinstance(stage.learner, Shuffles):
            raise ValueError("the learner has no links to shuffle; choose continue or afresh")

    def begin(self, stage: Stage) -> None:
        """Shuffle, once."""
        if isinstance(stage.learner, Shuffles):
            stage.learner.shuffle(stage.rng)
