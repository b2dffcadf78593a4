"""What a description can say of learners: their kinds, the paper's values, and what is refused."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from somatopy.contract import same
from somatopy.learners import FixedGaze, HebbianLearner, Learner, NearestGaze, RandomGaze
from somatopy.learners.hebbian import Hebbian
from somatopy.links import NormalisedHebb
from somatopy.maps import SOM
from somatopy.percept import Camera, Floats, Percept, Robot, Sighting, Space
from somatopy.registry import LEARNERS, Kinds
from somatopy.validation import explain

ARM = np.array([[-2.0, 1.0], [-0.5, 1.5]])
HEAD = np.array([[-2.0, 2.0], [-0.6, 0.5]])
ROBOT = Robot(
    {"arm": Space(("shoulder", "elbow"), *ARM.T), "head": Space(("yaw", "pitch"), *HEAD.T)},
    ("head",),
    Camera("eye", 320, 240, fovy=0.83),
)
SMALL = {"shape": [4, 5]}


def said(kinds: Kinds, value: Any) -> str:
    """Why a value is refused, in the words that a user reads."""
    with pytest.raises(ValueError) as caught:
        kinds.validated(value)
    error = caught.value
    return explain(error, lambda keys: []) if isinstance(error, ValidationError) else str(error)


def described(**table: Any) -> Any:
    return LEARNERS.validated({"kind": "hebbian", **table})


def context(seed: int = 0, **more: Any) -> Any:
    """What an experiment hands over to a learner."""
    given = {"robot": ROBOT, "rng": np.random.default_rng(seed)} | more
    return SimpleNamespace(**given, told=lambda **told: SimpleNamespace(**given, **told))


def built(**table: Any) -> HebbianLearner:
    learner = described(**table).build(context())
    assert isinstance(learner, HebbianLearner)
    return learner


def live(learner: Learner, frames: int = 60) -> list[Any]:
    """What a learner shows of some frames."""
    rng, out = np.random.default_rng(5), []
    for k in range(frames):
        arm, head = rng.uniform(*ARM.T), rng.uniform(*HEAD.T)
        seen = Sighting((rng.uniform(0, 320), rng.uniform(0, 240)), 0, 400.0) if k % 2 else None
        percept = Percept(k / 15, arm, head, arm, head, seen)
        learner.observe(percept)
        out.append((learner.gaze(percept), dict(learner.probes())))
    return [*out, learner.state()]


# -- the paper's learner ---------------------------------------------------------------------------------------------


def test_without_settings_it_is_the_papers() -> None:
    """Two DSOMs of 30 x 30 units, learning rates and elasticities .1, eta .01, and no choice but the paper's."""
    settings = described()
    assert settings == Hebbian() == LEARNERS.validated("hebbian") and settings.kind == "hebbian"
    for chart in (settings.arm_map, settings.head_map):
        assert (chart.kind, tuple(chart.shape), chart.learning_rate, chart.elasticity) == ("dsom", (30, 30), 0.1, 0.1)
        assert (chart.preset, chart.lattice, chart.periodic) == ("rougier", "rectangular", False)
    assert (settings.rule.kind, settings.link_rate, settings.activation_slope) == ("positive", 0.01, 1.0)
    choices = (settings.units, settings.centring, settings.ties, settings.arm_codes)
    assert choices == ("unit", "linear", "redrawn", "uniform")


def test_without_settings_it_lives_as_python_makes_it() -> None:
    """To the last bit: start codes, gazes, probes and state."""
    assert same(live(built()), live(HebbianLearner(ROBOT, np.random.default_rng(0))))


@pytest.mark.parametrize(
    ("table", "given"),
    [
        ({"activation_slope": 2}, {"activation_slope": 2.0}),
        ({"units": "radian"}, {"units": "radian"}),
        ({"centring": "none"}, {"centring": "none"}),
        ({"ties": "held"}, {"ties": "held"}),
        ({"ties": "first"}, {"ties": "first"}),
        ({"rule": "normalised"}, {"rule": NormalisedHebb(0.01)}),
        ({"rule": {"kind": "normalised"}, "link_rate": 0.3}, {"rule": NormalisedHebb(0.3)}),
    ],
)
def test_each_setting_reaches_the_learner(table: dict[str, Any], given: dict[str, Any]) -> None:
    """What a table says lives as what Python is told, and otherwise than what neither is told."""
    settled = live(built(arm_map=SMALL, head_map=SMALL, **table))
    small = described(arm_map=SMALL).arm_map.build(context())
    told = HebbianLearner(ROBOT, np.random.default_rng(0), arm_map=small, head_map=small, **given)
    assert same(settled, live(told))
    assert not same(settled, live(built(arm_map=SMALL, head_map=SMALL)))


def test_maps_are_named_by_their_kind() -> None:
    """A name alone, or a table with its values; a table without a kind is a DSOM."""
    settings = described(arm_map={"kind": "som", "shape": [4, 6], "lattice": "hexagonal"}, head_map="som")
    assert (settings.arm_map.kind, settings.head_map.kind) == ("som", "som")
    assert described(arm_map=SMALL).arm_map.kind == "dsom"
    learner = settings.replaced(head_map=SMALL).build(context())
    assert isinstance(learner.arm_map, SOM) and learner.arm_map.topology_.hexagonal
    assert learner.maps()["arm_shape"].tolist() == [4, 6] and learner.maps()["head_shape"].tolist() == [4, 5]


def test_settings_give_a_learner_of_their_own_each_time() -> None:
    """Two built from one share nothing, as when a phase begins afresh."""
    settings = described(arm_map=SMALL, head_map=SMALL, rule="normalised")
    first = live(settings.build(context()))
    assert same(live(settings.build(context())), first)


@pytest.mark.parametrize("units", ["unit", "radian"])
def test_sampled_codes_are_babbled_postures(units: str) -> None:
    """One posture a unit, in what the map is given; the head's map is as without."""
    asked = []

    def babbled(count: int) -> Floats:
        asked.append(count)
        return np.random.default_rng(3).uniform(*ARM.T, (count, 2))

    settings = described(arm_map=SMALL, head_map=SMALL, arm_codes="sampled", units=units)
    learner = settings.build(context(babbled=babbled))
    assert asked == [20]
    expected = np.random.default_rng(3).uniform(*ARM.T, (20, 2))
    if units == "unit":
        expected = (expected - ARM[:, 0]) / np.ptp(ARM, axis=1)
    assert learner.arm_map.codebook_ == pytest.approx(expected, abs=1e-12)
    uniform = settings.replaced(arm_codes="uniform").build(context())
    assert np.array_equal(learner.head_map.codebook_, uniform.head_map.codebook_)


def test_replaced_is_a_copy_that_is_valid() -> None:
    """The rest stays, the original too; kinds within may be replaced by name, table or settings."""
    before = described(link_rate=0.2)
    after = before.replaced(ties="held", arm_map={"kind": "som", "shape": [3, 3]})
    assert (after.ties, after.arm_map.kind, after.link_rate) == ("held", "som", 0.2)
    assert before == described(link_rate=0.2)
    assert after.replaced(arm_map=before.arm_map, ties="redrawn") == before


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"link_rate": 0}, "link_rate.*greater than 0"),
        ({"link_rate": float("inf")}, "link_rate"),
        ({"activation_slope": -1}, "activation_slope.*greater than 0"),
        ({"units": "degree"}, "units.*'unit' or 'radian'"),
        ({"centring": "square"}, "centring.*'linear' or 'none'"),
        ({"ties": "last"}, "ties.*'redrawn', 'held' or 'first'"),
        ({"arm_codes": "drawn"}, "arm_codes.*'uniform' or 'sampled'"),
        ({"arm_map": {"kind": "smo"}}, r"arm_map\.kind = 'smo' is unknown; choose one of dsom, som, "),
        (
            {"arm_map": {"kind": "som", "elasticity": 1}},
            "unknown key 'arm_map.elasticity'; valid keys there: kind, shape, ",
        ),
        ({"head_map": {"shape": "big"}}, "head_map.*shape"),
        (
            {"rule": {"kind": "positive", "learning_rate": 1}},
            "unknown key 'rule.learning_rate'; valid keys there: kind",
        ),
    ],
)
def test_wrong_values_are_refused_at_their_key(table: dict[str, Any], message: str) -> None:
    """In a description, by `replaced`, and where settings were made without asking anybody."""
    assert re.match(message, said(LEARNERS, {"kind": "hebbian", **table}))
    assert re.match(message, said(LEARNERS, Hebbian(**table)))
    with pytest.raises(ValueError, match=f"^The changed hebbian: {message}"):
        Hebbian().replaced(**table)


def test_an_unknown_setting_is_refused_with_those_that_exist() -> None:
    """A table and `replaced` alike."""
    valid = "arm_map, head_map, rule, link_rate, activation_slope, units, centring, ties, arm_codes"
    expected = f"unknown key 'link_rat'; valid keys there: kind, {valid} (did you mean link_rate?)"
    assert said(LEARNERS, {"kind": "hebbian", "link_rat": 1}) == expected
    with pytest.raises(ValueError, match=f"^The changed hebbian: unknown key 'link_rat'; valid keys there: {valid}"):
        Hebbian().replaced(link_rat=1)


@pytest.mark.parametrize("part", ["arm_map", "head_map"])
def test_a_map_on_no_lattice_is_refused_when_it_is_built(part: str) -> None:
    """By name, with what fits there; for sampled codes too, before anything is babbled."""
    settings = described(**{part: "neural-gas"})
    with pytest.raises(ValueError, match=f"^{part} must be a map on a lattice, such as dsom or som; NeuralGas is none"):
        settings.build(context())
    sampled = described(arm_map="growing-neural-gas", arm_codes="sampled")
    with pytest.raises(ValueError, match=r"^arm_map must be a map on a lattice"):
        sampled.build(context(babbled=lambda count: pytest.fail("it babbled")))


# -- controls --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("kind", "part"), [("random", RandomGaze), ("nearest", NearestGaze)])
def test_controls_are_built_from_robot_and_generator(kind: str, part: Any) -> None:
    """To the last bit as Python makes them; they have no settings."""
    learner = LEARNERS.validated(kind).build(context())
    assert type(learner) is part
    assert same(live(learner), live(part(ROBOT, np.random.default_rng(0))))
    assert said(LEARNERS, {"kind": kind, "rate": 1}) == "unknown key 'rate'; valid keys there: kind"


def test_the_fixed_posture_is_that_of_the_table_or_the_best_one() -> None:
    """Without one the experiment is asked for the head posture that sees the hand most often."""
    best = np.array([0.25, 0.125])
    settings = LEARNERS.validated("fixed")
    learner = settings.build(context(best_fixed_head=lambda: best))
    assert isinstance(learner, FixedGaze) and learner.predict([0, 0]).tolist() == best.tolist()
    given = LEARNERS.validated({"kind": "fixed", "head": [1, -0.5]}).build(context())
    assert given.predict([0, 0]).tolist() == [1.0, -0.5]


@pytest.mark.parametrize(
    ("head", "message"),
    [
        ([0.1], "head has 1 angles; there are 2 joints: yaw, pitch"),
        ([0.1, 0.2, 0.3], "head has 3 angles; there are 2 joints: yaw, pitch"),
        ([0.1, 0.6], r"head: pitch = 0\.6 lies outside its limits \[-0\.6000, 0\.5000\] rad"),
        ([-2.1, 0.0], r"head: yaw = -2\.1 lies outside its limits \[-2\.0000, 2\.0000\] rad"),
    ],
)
def test_a_fixed_posture_that_does_not_fit_the_head_is_refused(head: list[float], message: str) -> None:
    """The joints, the value and its limits are named."""
    with pytest.raises(ValueError, match=f"^{message}$"):
        LEARNERS.validated({"kind": "fixed", "head": head}).build(context())


def test_limits_themselves_are_within_the_limits() -> None:
    """A posture at the stops is a posture."""
    for head in HEAD.T.tolist():
        assert LEARNERS.validated({"kind": "fixed", "head": head}).build(context()).predict([0, 0]).tolist() == head
