"""The intervention that does nothing: what others derive from."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from somatopy.interventions import Intervention, NoIntervention
from somatopy.percept import Percept

PERCEPT = Percept(1.0, np.ones(4), np.zeros(2), np.ones(4), np.zeros(2))


def test_it_keeps_the_contract() -> None:
    """It is an Intervention, which touches neither the arm nor what the body could see, and has no columns."""
    nothing = NoIntervention()
    assert isinstance(nothing, Intervention)
    assert not nothing.alters_ceiling and not nothing.moves_arm
    assert tuple(nothing.columns) == () and nothing.probes() == {}


def test_percept_and_commands_are_handed_on_as_they_are() -> None:
    """The very same objects, and no random number is drawn."""
    nothing, rng, target, gaze = NoIntervention(), np.random.default_rng(1), np.ones(4), np.zeros(2)
    assert nothing.sense(PERCEPT, rng) is PERCEPT
    acted = nothing.act(target, gaze, rng)
    assert acted[0] is target and acted[1] is gaze
    assert rng.random() == np.random.default_rng(1).random()


def test_it_touches_nothing_on_its_stage() -> None:
    """A stage that has neither body nor learner is enough for all that it does in a phase."""
    nothing, empty = NoIntervention(), SimpleNamespace()
    for step in (nothing.check, nothing.begin, nothing.hold, nothing.release):
        assert step(empty) is None  # type: ignore[func-returns-value, arg-type]
    assert vars(empty) == {}


def test_it_has_no_state() -> None:
    """Nothing to keep, and nothing to restore."""
    nothing = NoIntervention()
    nothing.restore(nothing.state())
    assert nothing.state() == {}
