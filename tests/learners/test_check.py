"""The laws of learners: ours keep them, and a learner that breaks one is told which."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest

from somatopy.contract import ContractError
from somatopy.learners import BestLearner, FixedGaze, HebbianLearner, NearestGaze, RandomGaze, check_learner
from somatopy.links import NormalisedHebb
from somatopy.maps import DSOM, SOM
from somatopy.percept import Column, Percept, Robot


def test_the_papers_learner_keeps_them() -> None:
    """With maps of the paper's size, and with small ones; each frame brings one link of 16 bytes at most."""
    check_learner(HebbianLearner, growth=200 * 16)
    small = DSOM(shape=(4, 5))
    check_learner(lambda *given: HebbianLearner(*given, arm_map=small, head_map=small), growth=200 * 16)


MAPS = {
    "hexagonal som": SOM(shape=(4, 5), lattice="hexagonal", horizon=100),
    "torus": SOM(shape=(4, 6), lattice="hexagonal", periodic=True, horizon=100),
    "line": SOM(shape=(7,), horizon=100),
    "block of the 2016 library": DSOM(shape=(2, 3, 4), preset="schillaci2016"),
    "single precision": DSOM(shape=(4, 5), elasticity=1.0, dtype="float32"),
}
VARIANTS: dict[str, dict[str, Any]] = {
    "normalised links": {"rule": NormalisedHebb},
    "radians": {"units": "radian"},
    "no centring": {"centring": "none"},
    "ties held": {"ties": "held"},
    "first of ties": {"ties": "first"},
    "all of 2016": {"rule": NormalisedHebb, "activation_slope": 2.0, "units": "radian", "centring": "none"},
}


@pytest.mark.parametrize("name", MAPS)
def test_the_papers_learner_keeps_them_with_other_maps(name: str) -> None:
    """Any map on a lattice will do for the arm, beside a DSOM for the head, and the other way round."""
    own, usual = MAPS[name], DSOM(shape=(4, 5))
    for arm_map, head_map in ((own, usual), (usual, own)):
        check_learner(partial(HebbianLearner, arm_map=arm_map, head_map=head_map), growth=200 * 16)


@pytest.mark.parametrize("name", VARIANTS)
def test_the_papers_learner_keeps_them_in_each_variant(name: str) -> None:
    """Each choice that the paper leaves open, and all of them as in the first author's library."""
    small, variant = DSOM(shape=(4, 5)), VARIANTS[name]

    def make(robot: Robot, rng: np.random.Generator) -> HebbianLearner:
        fresh = {key: value() if key == "rule" else value for key, value in variant.items()}
        return HebbianLearner(robot, rng, arm_map=small, head_map=small, **fresh)

    check_learner(make, growth=200 * 16)


def test_controls_keep_them() -> None:
    """Random and fixed head postures."""
    check_learner(RandomGaze)
    check_learner(lambda robot, rng: FixedGaze(robot.head.limits.mean(axis=1)))


def test_the_best_learner_keeps_them() -> None:
    """It holds what it is made with, and never more."""
    check_learner(BestLearner)


def test_the_nearest_hit_keeps_them() -> None:
    """Its memory is as long as its life."""
    check_learner(NearestGaze, growth=None)


class Mean:
    """A sound learner: looks around the mean head posture of its hits."""

    parts: Any = frozenset({"mean", "spread"})
    columns: Any = (
        Column("hits", "int", "hits so far"),
        Column("error", "float", "distance from the mean, rad", "rad"),
    )

    def __init__(self, robot: Robot, rng: np.random.Generator) -> None:
        self.arm, self.head, self.rng = robot.arm.limits, robot.head.limits, rng
        self.mean, self.hits, self.error = self.head.mean(axis=1), 0, np.nan
        self._plastic = self.parts

    @property
    def plastic(self) -> Any:
        return self._plastic

    @plastic.setter
    def plastic(self, parts: Any) -> None:
        if parts - self.parts:
            raise ValueError(f"parts: {sorted(self.parts)}")
        self._plastic = parts

    def observe(self, percept: Percept) -> None:
        self.error = float(np.abs(percept.head - self.mean).max())
        if percept.sighting is not None and "mean" in self.plastic:
            self.hits += 1
            self.learn(percept)

    def learn(self, percept: Percept) -> None:
        self.mean += (percept.head - self.mean) / self.hits

    def gaze(self, percept: Percept) -> Any:
        return self.clip(self.predict(percept.arm) + self.rng.normal(0, 0.1, len(self.head)))

    def clip(self, gaze: Any) -> Any:
        return np.clip(gaze, *self.head.T)

    def predict(self, arm: Any) -> Any:
        return self.clip(self.mean)

    def probes(self) -> dict[str, float]:
        return {"hits": self.hits, "error": self.error}

    def maps(self) -> dict[str, Any]:
        return {"mean": self.mean.copy()}

    def state(self) -> dict[str, Any]:
        rng = self.rng.bit_generator.state
        return {"mean": self.mean.copy(), "hits": self.hits, "error": self.error, "rng": rng}

    def restore(self, state: dict[str, Any]) -> None:
        self.mean, self.hits, self.error = state["mean"].copy(), state["hits"], state["error"]
        self.rng.bit_generator.state = state["rng"]


class Silent:
    def __init__(self, *given: Any) -> None: ...

    def observe(self, percept: Percept) -> None: ...


class TwoJoints(Mean):
    def __init__(self, robot: Robot, rng: np.random.Generator) -> None:
        _, _ = robot.head.names
        super().__init__(robot, rng)


class Padded(Mean):
    def predict(self, arm: Any) -> Any:
        return np.append(super().predict(arm), 0.0)


class Whole(Mean):
    def predict(self, arm: Any) -> Any:
        return np.zeros(len(self.head), int)


class NoMiss(Mean):
    def gaze(self, percept: Percept) -> Any:
        return super().gaze(percept) + 0 * percept.sighting.pixel[0]  # type: ignore[union-attr]


class NoHitYet(Mean):
    def predict(self, arm: Any) -> Any:
        return super().predict(arm) * (np.float64(self.hits) / self.hits)


class Inside(Mean):
    def gaze(self, percept: Percept) -> Any:
        units = (percept.arm - self.arm[:, 0]) / (self.arm[:, 1] - self.arm[:, 0])
        return super().gaze(percept) + 0 * np.arccos(2 * units[0] - 1)


class Sprawling(Mean):
    def gaze(self, percept: Percept) -> Any:
        return self.predict(percept.arm) + self.rng.normal(0, 9, len(self.head))


class Drawing(Mean):
    def predict(self, arm: Any) -> Any:
        return (
            self.gaze(Percept(0.0, arm, arm, arm, arm)) if self.hits < 0 else self.clip(self.mean + self.rng.random())
        )


class Counting(Mean):
    def predict(self, arm: Any) -> Any:
        self.hits += 1
        return super().predict(arm)


class Secretive(Mean):
    asked = 0

    def predict(self, arm: Any) -> Any:
        self.asked += 1
        return super().predict(arm)

    def gaze(self, percept: Percept) -> Any:
        return self.clip(super().gaze(percept) + 0.01 * (self.asked % 3))


class ArraysOnly(Mean):
    def predict(self, arm: Any) -> Any:
        return super().predict(arm) + 0 * arm.mean()


class InPlace(Mean):
    def observe(self, percept: Percept) -> None:
        super().observe(percept)
        percept.arm[:] -= self.arm[:, 0]


class Keeping(Mean):
    def learn(self, percept: Percept) -> None:
        self.mean = percept.head


class Lending(Mean):
    def predict(self, arm: Any) -> Any:
        return self.mean


class Reusing(Mean):
    sheet = np.zeros(3)

    def gaze(self, percept: Percept) -> Any:
        sheet = self.sheet[: len(percept.head)]
        sheet[:] = super().gaze(percept)
        return sheet


class Unseeded(Mean):
    def gaze(self, percept: Percept) -> Any:
        return self.clip(self.mean + np.random.default_rng().normal(0, 0.1, len(self.head)))


class EarlyProbes(Mean):
    def probes(self) -> dict[str, float]:
        return {} if self.hits else super().probes()


class LateProbes(Mean):
    def probes(self) -> dict[str, float]:
        return super().probes() if self.hits else {}


class Undeclared(Mean):
    columns = Mean.columns[:1]


class Misdeclared(Mean):
    columns = (Mean.columns[0], Column("error", "int", "distance from the mean, rad", "rad"))


class Twice(Mean):
    columns = (*Mean.columns, Mean.columns[0])


class Yes(Mean):
    columns = (Column("seen", "int", "whether the hand was ever seen"),)

    def probes(self) -> dict[str, float]:
        return {"seen": self.hits > 0}


class ShiftyProbes(Mean):
    columns = (Column("error", "int", "distance from the mean, rad", "rad"),)

    def probes(self) -> dict[str, float]:
        return {"error": self.error if self.hits else 0}


class WordyProbes(Mean):
    columns = (Column("error", "float", "distance from the mean, rad", "rad"),)

    def probes(self) -> Any:
        return {"error": "none"}


class LentMaps(Mean):
    def maps(self) -> dict[str, Any]:
        return {"mean": self.mean}


class ListedMaps(Mean):
    def maps(self) -> dict[str, Any]:
        return {"mean": self.mean.tolist()}


class Restless(Mean):
    def learn(self, percept: Percept) -> None:
        super().learn(percept)

    def observe(self, percept: Percept) -> None:
        super().observe(percept)
        if not self.plastic:
            self.mean += 0.001 * (percept.head - self.mean)


class Listed(Mean):
    parts = ("mean",)


class Numbered(Mean):
    parts = frozenset({1})


class Asleep(Mean):
    def __init__(self, robot: Robot, rng: np.random.Generator) -> None:
        super().__init__(robot, rng)
        self._plastic = frozenset({"mean"})


class Inseparable(Mean):
    def observe(self, percept: Percept) -> None:
        super().observe(percept)
        if len(self.plastic) == 1:
            raise KeyError("spread")


class Permissive(Mean):
    @property
    def plastic(self) -> Any:
        return self._plastic

    @plastic.setter
    def plastic(self, parts: Any) -> None:
        self._plastic = parts


class Forgetful(Mean):
    def restore(self, state: dict[str, Any]) -> None:
        super().restore(state | {"hits": 1})


class Opaque(Mean):
    def state(self) -> dict[str, Any]:
        return super().state() | {"generator": self.rng}


class Remembering(Mean):
    def __init__(self, robot: Robot, rng: np.random.Generator) -> None:
        super().__init__(robot, rng)
        self.past = np.empty((0, len(self.head)))

    def learn(self, percept: Percept) -> None:
        super().learn(percept)
        self.past = np.vstack([self.past, percept.head])

    def state(self) -> dict[str, Any]:
        return super().state() | {"past": self.past.copy()}

    def restore(self, state: dict[str, Any]) -> None:
        super().restore(state)
        self.past = state["past"].copy()


class Sure(Mean):
    """Believes the more in a gaze the nearer it is to the one that it would choose."""

    def belief(self, arms: Any, gazes: Any) -> Any:
        apart = np.abs(np.asarray(gazes) - self.clip(self.mean)).max(axis=1)
        return np.tile(np.exp(-apart), (len(arms), 1))


class OneBelief(Sure):
    def belief(self, arms: Any, gazes: Any) -> Any:
        return super().belief(arms, gazes)[0]


class Overconfident(Sure):
    def belief(self, arms: Any, gazes: Any) -> Any:
        return 1.5 * super().belief(arms, gazes)


class Unsure(Sure):
    def belief(self, arms: Any, gazes: Any) -> Any:
        return super().belief(arms, gazes) * (np.float64(self.hits) / self.hits)


class Wavering(Sure):
    def belief(self, arms: Any, gazes: Any) -> Any:
        return super().belief(arms, gazes) * self.rng.random()


class Convinced(Sure):
    def belief(self, arms: Any, gazes: Any) -> Any:
        self.hits += 1
        return super().belief(arms, gazes)


class Together(Sure):
    def belief(self, arms: Any, gazes: Any) -> Any:
        return super().belief(arms, gazes) / len(arms)


class Shifting(Sure):
    def belief(self, arms: Any, gazes: Any) -> Any:
        gazes = np.asarray(gazes)
        gazes -= self.mean
        return np.tile(np.exp(-np.abs(gazes).max(axis=1)), (len(arms), 1))


def test_another_sound_learner_passes() -> None:
    """One without maps; one that leaves clipping to the body, one whose memory grows, if that is said."""
    check_learner(Mean)
    check_learner(Sure)
    check_learner(Sprawling, body_clips=True)
    check_learner(Remembering, growth=None)
    check_learner(Remembering, growth=200 * 3 * 8)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            Silent,
            "all members of Learner.*Silent lacks columns, gaze, maps, parts, plastic, predict, probes, restore, state",
        ),
        (TwoJoints, "it can be made for 2 arm and 1 head joints.*ValueError"),
        (Padded, r"finite head postures \(2,\) with the hand never seen"),
        (Whole, "finite head postures.*Seen: array"),
        (NoMiss, "finite head postures .* with the hand never seen.*AttributeError"),
        (NoHitYet, "finite head postures .* with the hand never seen"),
        (Inside, "finite head postures .* seen and postures outside the limits"),
        (Sprawling, r"inside the head's limits.*say check_learner\(..., body_clips=True\)"),
        (Drawing, "predict is pure.*and then"),
        (Counting, r"predict is pure.*state\(\) is another"),
        (Secretive, "predict is pure.*a twin that never predicted"),
        (ArraysOnly, "predict is pure.*AttributeError"),
        (OneBelief, r"belief gives an array \(5, 80\) of values from 0 to 1"),
        (Overconfident, "belief gives an array .* of values from 0 to 1"),
        (Unsure, "belief gives an array .* of values from 0 to 1.*nan"),
        (Wavering, r"belief is pure: it draws nothing.* at first, then .* alone"),
        (Convinced, r"belief is pure.*state\(\) is another after belief"),
        (Together, "belief is pure.* at first, then .* alone and from lists"),
        (Shifting, "belief is pure.*the postures that it was given became others"),
        (InPlace, "observe and gaze leave the percept alone"),
        (Keeping, "arrays taken and given stay the caller's"),
        (Lending, "arrays taken and given stay the caller's"),
        (Reusing, "arrays taken and given stay the caller's.*when later frames passed"),
        (LateProbes, r"probes have the names.* of columns.*Seen: \{\} for the columns \{'hits'"),
        (EarlyProbes, r"in every frame.*\{'hits'.* at first, then \{\}"),
        (
            Undeclared,
            r"names .* of columns.*Seen: \{'hits': 'int', 'error': 'float'\} for the columns \{'hits': 'int'\}",
        ),
        (Misdeclared, "types of columns.*'error': 'float'.* for the columns .*'error': 'int'"),
        (Twice, r"names and types of columns.*Seen: one name for two columns: \['hits', 'error', 'hits'\]"),
        (Yes, r"types of columns.*Seen: \{'seen': 'bool'\} for the columns \{'seen': 'int'\}"),
        (ShiftyProbes, "the names and types of columns, int or float.*'int'.* at first, then .*'float'"),
        (WordyProbes, "probes.*the probe 'none' is no number"),
        (LentMaps, r"maps\(\) are arrays that later frames leave alone.*they changed"),
        (ListedMaps, r"maps\(\) are arrays"),
        (Listed, r"parts is a frozenset of names.*Seen: \('mean',\)"),
        (Numbered, r"parts is a frozenset of names.*Seen: frozenset\(\{1\}\)"),
        (Asleep, r"all of them are plastic at first.*Seen: frozenset\(\{'mean'\}\) are plastic, of frozenset"),
        (Inseparable, "each part may learn alone.*KeyError: 'spread'"),
        (Restless, "with plastic empty nothing is learned"),
        (Permissive, "an unknown part is refused.*beside .'mean', 'spread'."),
        (Unseeded, "one seed, one behaviour"),
        (Forgetful, r"restore\(state\) continues bit for bit"),
        (Opaque, r"state\(\) is plain data.*'generator'"),
        (Remembering, r"memory is bounded: the state grows by at most 0 bytes.*Seen: \d+ bytes more"),
    ],
)
def test_each_law_is_held(make: Any, message: str) -> None:
    """One learner that breaks each."""
    with pytest.raises(ContractError, match=message), np.errstate(all="ignore"):
        check_learner(make)
