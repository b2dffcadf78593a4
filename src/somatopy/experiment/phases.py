"""The interventions of a phase, each with its own random numbers, and what they may touch."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from typing import Any, Protocol

import numpy as np

from somatopy.contract import Body, Intervention, Learner
from somatopy.percept import Floats, Percept

__all__ = ["PhaseInterventions", "Place"]


class _Owner(Protocol):
    """Whose body and learner are touched: the session."""

    body: Body
    learner: Learner

    def renew_learner(self, name: str) -> None: ...


class Place:
    """An intervention in its place; it is also the `Stage` on which that intervention acts.

    Args:
        session: whose body and learner may be touched.
        intervention: what is done.
        rng: its random numbers.
        renewed: name of the random stream of a learner that it puts in the place of the one that is there.
    """

    def __init__(self, session: _Owner, intervention: Intervention, rng: np.random.Generator, renewed: str) -> None:
        self._session, self._renewed = session, renewed
        self.intervention = intervention
        self.rng = rng

    @property
    def body(self) -> Body:
        """The robot."""
        return self._session.body

    @property
    def learner(self) -> Learner:
        """What moves the head."""
        return self._session.learner

    def renew_learner(self) -> None:
        """Put a learner that has learned nothing in the place of the one that is there."""
        self._session.renew_learner(self._renewed)


class PhaseInterventions:
    """The interventions of one phase, in the order of their application.

    Attributes:
        interventions: see above.
        move_arm: whether one of them may change how the arm moves.
    """

    def __init__(self, places: list[Place]) -> None:
        self._places = places
        self.interventions = [place.intervention for place in places]
        self.move_arm = any(intervention.moves_arm for intervention in self.interventions)

    def begin(self) -> None:
        """The phase begins."""
        for place in self._places:
            place.intervention.begin(place)

    def hold(self) -> None:
        """The phase has begun, or a run is resumed within it; after an error, what was held is released."""
        with ExitStack() as undo:
            for place in self._places:
                place.intervention.hold(place)
                undo.callback(place.intervention.release, place)
            undo.pop_all()

    def release(self) -> None:
        """The phase has ended; the last is undone first."""
        for place in reversed(self._places):
            place.intervention.release(place)

    def sense(self, percept: Percept) -> Percept:
        """What they make of what is sensed."""
        for place in self._places:
            percept = place.intervention.sense(percept, place.rng)
        return percept

    def feel(self, percepts: Sequence[Percept]) -> list[Percept]:
        """What they would make of each of some percepts; afterwards they stand, random numbers too, as before."""
        state = self.state()
        try:
            return [self.sense(percept) for percept in percepts]
        finally:
            self.restore(state)

    def act(self, target: Floats, gaze: Floats) -> tuple[Floats, Floats]:
        """What they make of what is commanded."""
        for place in self._places:
            target, gaze = place.intervention.act(target, gaze, place.rng)
        return target, gaze

    def state(self) -> dict[str, Any]:
        """The state of each, with its generator, by its place."""
        return {
            str(k): {"own": place.intervention.state(), "rng": place.rng.bit_generator.state}
            for k, place in enumerate(self._places)
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from `state`."""
        for k, place in enumerate(self._places):
            place.intervention.restore(state[str(k)]["own"])
            place.rng.bit_generator.state = state[str(k)]["rng"]
