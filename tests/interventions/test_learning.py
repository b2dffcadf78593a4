"""What is done to the learner: parts that stop to learn, a fresh start, associations given to other inputs."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from somatopy.contract import same
from somatopy.interventions import Afresh, Intervention, PlasticParts, Shuffled
from somatopy.learners import FixedGaze, HebbianLearner, RandomGaze
from somatopy.maps import DSOM
from somatopy.percept import Camera, Percept, Robot, Sighting, Space
from somatopy.registry import INTERVENTIONS

ROBOT = Robot(
    {"arm": Space("ab", [-1, -1], [1, 1]), "head": Space("yp", [-1, -1], [1, 1])},
    ("head",),
    Camera("eye", 320, 240, fovy=0.83),
)
PARTS = {"arm_map", "head_map", "links"}


def learner() -> HebbianLearner:
    small = DSOM(shape=(5, 5), elasticity=1.0)
    return HebbianLearner(ROBOT, np.random.default_rng(0), arm_map=small, head_map=small)


class Stage:
    """A stage with a learner on it, and no body: an intervention of the learner needs none."""

    def __init__(self, subject: Any, seed: int = 0) -> None:
        self.learner, self.rng, self.renewed = subject, np.random.default_rng(seed), 0

    @property
    def body(self) -> Any:
        raise AssertionError("the body was touched")

    def renew_learner(self) -> None:
        self.renewed += 1
        self.learner = learner()


def percepts(count: int, seed: int = 0) -> Iterator[Percept]:
    rng = np.random.default_rng(seed)
    for k in range(count):
        arm, head = rng.uniform(-1, 1, 2), rng.uniform(-1, 1, 2)
        yield Percept(k / 15, arm, head, arm, head, Sighting((159.5, 119.5), 0, 400.0))


def changed_parts(subject: HebbianLearner) -> set[str]:
    """The parts that learn from 20 frames."""
    before = subject.state()
    for percept in percepts(20):
        subject.observe(percept)
    after = subject.state()
    return {part for part in PARTS if not same(before[part], after[part])}


@pytest.mark.parametrize("intervention", [PlasticParts(("links",)), Afresh(), Shuffled()])
def test_they_keep_the_contract_and_touch_the_learner_alone(intervention: Intervention) -> None:
    """Neither what the body could see nor how the arm moves is changed; percept and commands pass as they are."""
    assert isinstance(intervention, Intervention)
    assert not intervention.alters_ceiling and not intervention.moves_arm
    (percept,), target, gaze = percepts(1), np.ones(2), np.zeros(2)
    assert intervention.sense(percept, np.random.default_rng()) is percept
    acted = intervention.act(target, gaze, np.random.default_rng())
    assert acted[0] is target and acted[1] is gaze


# -- plastic ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("parts", [(), ("links",), ("arm_map", "head_map"), ("head_map", "links", "arm_map")])
def test_only_the_named_parts_learn_while_it_holds(parts: tuple[str, ...]) -> None:
    """The others stay to the bit; released, all that learned before learn again."""
    stage, intervention = Stage(learner()), PlasticParts(parts)
    intervention.check(stage)
    intervention.begin(stage)
    assert stage.learner.plastic == PARTS
    intervention.hold(stage)
    assert changed_parts(stage.learner) == set(parts)
    intervention.release(stage)
    assert changed_parts(stage.learner) == PARTS


def test_released_what_learned_before_learns_and_no_more() -> None:
    """A learner of which only the links learned goes on like that, in each phase that it is done to."""
    stage, intervention = Stage(learner()), PlasticParts(("arm_map",))
    for before in ({"links"}, {"links", "head_map"}):
        stage.learner.plastic = before
        intervention.hold(stage)
        assert stage.learner.plastic == {"arm_map"}
        intervention.release(stage)
        assert stage.learner.plastic == before


def test_two_that_hold_are_undone_in_turn() -> None:
    """The later one counts while both hold; undone from the last to the first, everything is as before."""
    stage, first, second = Stage(learner()), PlasticParts(("arm_map", "links")), PlasticParts(("links",))
    first.hold(stage)
    second.hold(stage)
    assert stage.learner.plastic == {"links"}
    second.release(stage)
    assert stage.learner.plastic == {"arm_map", "links"}
    first.release(stage)
    assert stage.learner.plastic == PARTS


@pytest.mark.parametrize(
    ("subject", "message"),
    [
        (learner(), "the learner has no part 'lynx' that learns; valid parts: arm_map, head_map, links"),
        (FixedGaze([0, 0]), "the learner has no part 'lynx' that learns; valid parts: none, so leave plastic away"),
    ],
)
def test_a_part_that_the_learner_has_not_is_named(subject: Any, message: str) -> None:
    """Before anything runs, with the parts that there are, and nothing is changed."""
    stage, before = Stage(subject), subject.plastic
    with pytest.raises(ValueError, match=f"^{message}$"):
        PlasticParts(("lynx",)).check(stage)
    assert subject.plastic == before


def test_to_freeze_a_learner_that_learns_nothing_is_allowed() -> None:
    """No part is named, so none is missing."""
    stage, intervention = Stage(FixedGaze([0, 0])), PlasticParts()
    for step in (intervention.check, intervention.hold, intervention.release):
        step(stage)
    assert stage.learner.plastic == frozenset()


# -- afresh ----------------------------------------------------------------------------------------------------------


def test_a_learner_begins_anew_once() -> None:
    """When the phase begins, and not again when a run is resumed within it or the phase ends."""
    stage, intervention = Stage(learner()), Afresh()
    changed_parts(stage.learner)
    trained = stage.learner
    intervention.check(stage)
    assert stage.learner is trained
    intervention.begin(stage)
    assert stage.renewed == 1 and same(stage.learner.state(), learner().state())
    renewed = stage.learner
    for step in (intervention.hold, intervention.release, intervention.hold):
        step(stage)
    assert stage.renewed == 1 and stage.learner is renewed


# -- shuffled --------------------------------------------------------------------------------------------------------


def test_links_are_shuffled_once() -> None:
    """When the phase begins, by the intervention's own random numbers; not again when a run is resumed within it."""
    stage, twin, intervention = Stage(learner(), seed=5), learner(), Shuffled()
    for subject in (stage.learner, twin):
        changed_parts(subject)
    intervention.check(stage)
    assert same(stage.learner.state(), twin.state())
    intervention.begin(stage)
    assert not same(stage.learner.state()["links"], twin.state()["links"])
    twin.shuffle(np.random.default_rng(5))
    assert same(stage.learner.state(), twin.state())
    for step in (intervention.hold, intervention.release, intervention.hold):
        step(stage)
    assert same(stage.learner.state(), twin.state())


@pytest.mark.parametrize("subject", [FixedGaze([0, 0]), RandomGaze(ROBOT, np.random.default_rng(0))])
def test_a_learner_without_links_is_refused(subject: Any) -> None:
    """Before anything runs, with what to choose instead."""
    with pytest.raises(ValueError, match="the learner has no links to shuffle; choose continue or afresh"):
        Shuffled().check(Stage(subject))


def test_any_learner_that_can_shuffle_will_do() -> None:
    """It is asked for by what it can do, not by its class."""
    calls: list[Any] = []
    stage = Stage(SimpleNamespace(shuffle=calls.append))
    Shuffled().check(stage)
    Shuffled().begin(stage)
    assert calls == [stage.rng]


# -- settings --------------------------------------------------------------------------------------------------------


def test_kinds_build_them() -> None:
    """Each by its name, and the parts of `plastic` are those of its table."""
    assert isinstance(INTERVENTIONS.validated("afresh").build(SimpleNamespace()), Afresh)
    assert isinstance(INTERVENTIONS.validated("shuffled").build(SimpleNamespace()), Shuffled)
    stage = Stage(learner())
    INTERVENTIONS.validated({"kind": "plastic", "parts": ["links"]}).build(SimpleNamespace()).hold(stage)
    assert stage.learner.plastic == {"links"}
    INTERVENTIONS.validated("plastic").build(SimpleNamespace()).hold(stage)
    assert stage.learner.plastic == frozenset()


@pytest.mark.parametrize("parts", ["links", 3, [3], {"links": True}])
def test_parts_that_are_no_list_of_names_are_refused(parts: object) -> None:
    """Text alone too, which is a sequence of letters."""
    with pytest.raises(ValueError, match="parts"):
        INTERVENTIONS.validated({"kind": "plastic", "parts": parts})
