"""The interventions of a phase, each with its own random numbers and its access to body and learner."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from typing import Any, Protocol

import numpy as np

from somatopy.contract import Body, Intervention, Learner
from somatopy.percept import Floats, Percept

__all__ = ["PhaseInterventions", "Place"]


class _Owner(Protocol):
    """The session whose body and learner interventions change."""

    body: Body
    learner: Learner

    def renew_learner(self, name: str) -> None: ...


class Place:
    """An intervention within a session. It is also the `Stage` on which that intervention acts.

    Args:
        session: the session whose body and learner it may change.
        intervention: the intervention.
        rng: its random numbers.
        renewed: name of the random stream for a fresh learner, if the intervention replaces the learner.
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
        """Replace the learner by a fresh one that has learned nothing."""
        self._session.renew_learner(self._renewed)


class PhaseInterventions:
    """The interventions of one phase, in the order in which they apply.

    Attributes:
        interventions: see above.
        move_arm: whether one of them may change how the arm moves.
    """

    def __init__(self, places: list[Place]) -> None:
        self._places = places
        self.interventions = [place.intervention for place in places]
        self.move_arm = any(intervention.moves_arm for intervention in self.interventions)

    def begin(self) -> None:
        """Begin the phase."""
        for place in self._places:
            place.intervention.begin(place)

    def hold(self) -> None:
        """Put all of them into force, when the phase begins or a run is resumed. After an error, they are released."""
        with ExitStack() as undo:
            for place in self._places:
                place.intervention.hold(place)
                undo.callback(place.intervention.release, place)
            undo.pop_all()

    def release(self) -> None:
        """Release all of them at the end of the phase, in reverse order."""
        for place in reversed(self._places):
            place.intervention.release(place)

    def sense(self, percept: Percept) -> Percept:
        """The percept after all of them have changed it."""
        for place in self._places:
            percept = place.intervention.sense(percept, place.rng)
        return percept

    def feel(self, percepts: Sequence[Percept]) -> list[Percept]:
        """Percepts as they would change them. They themselves and their random numbers stay as they are."""
        state = self.state()
        try:
            return [self.sense(percept) for percept in percepts]
        finally:
            self.restore(state)

    def act(self, target: Floats, gaze: Floats) -> tuple[Floats, Floats]:
        """The commands after all of them have changed them."""
        for place in self._places:
            target, gaze = place.intervention.act(target, gaze, place.rng)
        return target, gaze

    def state(self) -> dict[str, Any]:
        """The state of each intervention and of its generator, by its index in the phase."""
        return {
            str(k): {"own": place.intervention.state(), "rng": place.rng.bit_generator.state}
            for k, place in enumerate(self._places)
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from `state`."""
        for k, place in enumerate(self._places):
            place.intervention.restore(state[str(k)]["own"])
            place.rng.bit_generator.state = state[str(k)]["rng"]
