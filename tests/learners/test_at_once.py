"""Both maps in one call: a learner whose maps are DSOMs lives as one whose maps go part by part, to the last bit."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from somatopy.learners import HebbianLearner, hebbian
from somatopy.links import NormalisedHebb, PositiveHebb
from somatopy.maps import DSOM
from somatopy.percept import Camera, Percept, Robot, Sighting, Space

ARM = np.array([[-2.0857, 2.0857], [-0.3142, 1.3265], [-2.0857, 2.0857], [-1.5446, -0.0349]])
HEAD = np.array([[-2.0857, 2.0857], [-0.6720, 0.5149]])
ROBOT = Robot({"arm": Space("abcd", *ARM.T), "head": Space("yp", *HEAD.T)}, ("head",), Camera("eye", 320, 240, 0.83))
FRAMES = 1200


class Other(DSOM):
    """A DSOM of another class: what learns it cannot know that it learns as a DSOM does."""


def pair(settings: dict[str, Any], chart: dict[str, Any]) -> tuple[HebbianLearner, HebbianLearner]:
    """A learner whose maps learn at once, and one whose maps do not."""
    made = []
    for kind in (DSOM, Other):
        maps = {name: kind(**({"shape": (12, 10), "elasticity": 0.4} | chart)) for name in ("arm_map", "head_map")}
        made.append(HebbianLearner(ROBOT, np.random.default_rng(3), **maps, **settings))
    return made[0], made[1]


def percepts(count: int, seed: int = 0) -> list[Percept]:
    """Random frames, half of them hits; arms move out of the limits by and by."""
    rng, found = np.random.default_rng(seed), []
    for k in range(count):
        arm, head = (limits[:, 0] + rng.random(len(limits)) * np.ptp(limits, axis=1) for limits in (ARM, HEAD))
        pixel = float(rng.uniform(0, 320)), float(rng.uniform(0, 240))
        sighting = Sighting(pixel, 0, 400.0) if rng.random() < 0.5 else None
        found.append(Percept(k / 15, arm + k / count, head, arm, head, sighting))
    return found


def bits(value: Any) -> Any:
    """A state as bytes."""
    if isinstance(value, dict):
        return {key: bits(part) for key, part in value.items()}
    return np.asarray(value).tobytes() if isinstance(value, (np.ndarray, float)) else value


def lives_alike(one: HebbianLearner, other: HebbianLearner, frames: list[Percept]) -> None:
    for percept in frames:
        for subject in (one, other):
            subject.observe(percept)
        assert one.gaze(percept).tobytes() == other.gaze(percept).tobytes()
        assert bits(one.probes()) == bits(other.probes())
    assert bits(one.state()) == bits(other.state())
    assert all(one.predict(p.arm).tobytes() == other.predict(p.arm).tobytes() for p in frames[:50])


@pytest.mark.parametrize(
    ("settings", "chart"),
    [
        ({}, {}),
        ({"ties": "held", "activation_slope": 2.0, "centring": "none"}, {}),
        ({"units": "radian", "rule": PositiveHebb(0.3)}, {"preset": "schillaci2016"}),
        ({"rule": NormalisedHebb(0.1)}, {"preset": "printed"}),
        ({"ties": "first"}, {"lattice": "hexagonal", "periodic": True}),
        ({}, {"shape": (3, 4, 5)}),
        ({}, {"missing": "ignore"}),
        ({}, {"dtype": "float32"}),
    ],
)
def test_both_ways_give_the_same_bits(settings: dict[str, Any], chart: dict[str, Any]) -> None:
    """Gaze, probes, predictions and the whole state, also after parts have stopped to learn and a state came back."""
    one, other = pair(settings, chart)
    frames = percepts(FRAMES)
    lives_alike(one, other, frames[:500])
    kept = one.state(), other.state()
    for plastic in ({"links"}, {"arm_map", "head_map"}, {"arm_map", "links"}):
        one.plastic = other.plastic = frozenset(plastic)
        lives_alike(one, other, frames[500:600])
    one.plastic = other.plastic = HebbianLearner.parts
    one.restore(kept[0]), other.restore(kept[1])
    for subject in (one, other):
        subject.arm_map.set_params(learning_rate=0.03)
    lives_alike(one, other, frames[600:])


def test_links_of_which_only_some_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """As those of large maps."""
    monkeypatch.setattr("somatopy.links.table.MOST_DENSE", 0)
    lives_alike(*pair({}, {}), percepts(300))


def test_postures_in_any_array_teach_the_same() -> None:
    """Every second value of an array, one that cannot be written, single precision, whole numbers."""

    def locked(x: Any) -> Any:
        x = x.copy()
        x.flags.writeable = False
        return x

    given = [lambda x: np.repeat(x, 2)[::2], locked, np.float32, np.round, lambda x: np.round(x).astype(int)]
    one, other = pair({}, {})
    for change in given:
        frames = [replace(p, arm=change(p.arm), head=change(p.head)) for p in percepts(50)]
        lives_alike(one, other, frames)


def test_observed_arms_with_missing_values_are_learned() -> None:
    """Where the maps allow it."""
    frames = percepts(200)
    for percept in frames[::3]:
        percept.arm[1] = np.nan
    lives_alike(*pair({}, {"missing": "ignore"}), frames)


@pytest.mark.parametrize("arm", [[np.nan] * 4, [1e200, 0, 0, 0], [0.0] * 3, [0.0], [[0.0] * 4]])
@pytest.mark.parametrize("head", [[0.0, 0.0], [np.inf, 0.0], [1e200, 0.0], [0.0], [0.0] * 3])
def test_what_is_refused_is_refused_in_the_same_words(arm: Any, head: Any) -> None:
    """And leaves the same state."""
    one, other = pair({}, {})
    lives_alike(one, other, percepts(5))
    said = []
    for subject in (one, other):
        with pytest.raises(ValueError) as refused:
            subject.observe(replace(percepts(1)[0], arm=np.array(arm), head=np.array(head)))
        said.append(str(refused.value))
    assert said[0] == said[1] and bits(one.state()) == bits(other.state())


def test_the_papers_learner_takes_the_short_way(monkeypatch: pytest.MonkeyPatch) -> None:
    """And others do not: a part that does not learn, a map of another class, one whose method was replaced."""
    calls = []

    def counted(*args: Any) -> Any:
        calls.append(1)
        return real(*args)

    real = hebbian.learn_both
    monkeypatch.setattr(hebbian, "learn_both", counted)
    [percept] = percepts(1)
    one, other = pair({}, {})
    one.observe(percept)
    assert len(calls) == 1
    other.observe(percept)
    one.plastic = frozenset({"arm_map"})
    one.observe(percept)
    one.plastic = one.parts
    one.head_map.learn_and_find = one.head_map.learn_and_find
    one.observe(percept)
    assert len(calls) == 1
