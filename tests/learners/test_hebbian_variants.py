"""The paper's learner with other maps, rules, units and choices than the paper's."""

from __future__ import annotations

from dataclasses import replace
from math import hypot, tanh
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import chisquare

from somatopy.contract import same, stored
from somatopy.learners import HebbianLearner
from somatopy.links import NormalisedHebb, PositiveHebb
from somatopy.maps import DSOM, SOM, EvolvingSOM, GrowingNeuralGas, GrowWhenRequired, Map, NeuralGas
from somatopy.percept import Camera, Floats, Percept, Robot, Sighting, Space

GOLDEN = np.load(Path(__file__).parents[1] / "data" / "hebbian_schillaci2016.npz")
CENTRE = (159.5, 119.5)
ARM = np.array([[-2.0, 1.0], [-0.5, 1.5]])
HEAD = np.array([[-2.0, 2.0], [0.1, 0.6]])
LATTICES: dict[str, Map] = {
    "dsom": DSOM(shape=(12, 12), elasticity=1.5),
    "dsom of 2016": DSOM(shape=(12, 12), preset="schillaci2016"),
    "hexagonal som": SOM(shape=(12, 12), lattice="hexagonal", horizon=1000),
    "hexagonal torus": SOM(shape=(12, 12), lattice="hexagonal", periodic=True, horizon=1000),
    "torus": DSOM(shape=(10, 14), elasticity=1.0, periodic=True),
    "line": SOM(shape=(100,), horizon=1000),
    "block": SOM(shape=(5, 5, 5), horizon=1000),
}
VARIANTS: dict[str, dict[str, Any]] = {
    "paper": {},
    "hexagonal arm map": {"arm_map": SOM(shape=(6, 5), lattice="hexagonal", horizon=300)},
    "torus of the head": {"head_map": SOM(shape=(6, 6), periodic=True, horizon=300)},
    "normalised links": {"rule": NormalisedHebb(0.1)},
    "steep activation": {"activation_slope": 2.0},
    "radians": {"units": "radian"},
    "no centring": {"centring": "none"},
    "ties held": {"ties": "held"},
    "first of ties": {"ties": "first"},
}


def robot(arm: np.ndarray = ARM, head: np.ndarray = HEAD) -> Robot:
    """A robot with these limits."""
    senses = {"arm": Space("abcd"[: len(arm)], *arm.T), "head": Space("yz"[: len(head)], *head.T)}
    return Robot(senses, ("head",), Camera("eye", 320, 240, fovy=0.83))


def learner(seed: int = 0, **settings: Any) -> HebbianLearner:
    small = {name: DSOM(shape=(6, 6), elasticity=1.0) for name in ("arm_map", "head_map")}
    return HebbianLearner(robot(), np.random.default_rng(seed), **{**small, **settings})


def percepts(count: int, seed: int = 0, hits: float = 0.6) -> list[Percept]:
    """Random postures within the limits, the hand seen anywhere in that share of frames."""
    rng, found = np.random.default_rng(seed), []
    for k in range(count):
        arm, head = (rng.uniform(*limits.T) for limits in (ARM, HEAD))
        seen = Sighting((rng.uniform(0, 320), rng.uniform(0, 240)), 0, 400.0) if rng.random() < hits else None
        found.append(Percept(k / 15, arm, head, arm, head, seen))
    return found


def unit(angles: np.ndarray, limits: np.ndarray) -> Floats:
    return np.asarray((angles - limits[:, 0]) / np.ptp(limits, axis=1))


def matching_head(arm: np.ndarray) -> Floats:
    """The only head posture that sees the hand: the arm's, joint by joint, in shares of the ranges."""
    return np.asarray(HEAD[:, 0] + unit(arm, ARM) * np.ptp(HEAD, axis=1))


def mean_error(subject: HebbianLearner) -> float:
    """Mean distance of predictions from the head posture that sees the hand, in shares of the ranges."""
    errors = [
        np.abs(unit(subject.predict(arm), HEAD) - unit(arm, ARM)).mean()
        for arm in np.random.default_rng(9).uniform(*ARM.T, (200, 2))
    ]
    return float(np.mean(errors))


# -- maps ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("part", ["arm_map", "head_map"])
@pytest.mark.parametrize("name", LATTICES)
def test_any_lattice_learns_where_to_look(name: str, part: str) -> None:
    """Once maps and then links have learned from the one right head posture of each arm posture, it errs little."""
    subject = learner(**{part: LATTICES[name]})
    before = mean_error(subject)
    for parts in ({"arm_map", "head_map"}, {"links"}):
        subject.plastic = frozenset(parts)
        for percept in percepts(1500):
            subject.observe(replace(percept, head=matching_head(percept.arm), sighting=Sighting(CENTRE, 0, 400.0)))
    assert mean_error(subject) < 0.1 < 0.3 < before


@pytest.mark.parametrize("part", ["arm_map", "head_map"])
@pytest.mark.parametrize("name", LATTICES)
def test_what_is_kept_of_a_map_tells_its_lattice(name: str, part: str) -> None:
    """Shape and number of units are the lattice's, and start codes are uniform in the joints' ranges."""
    subject, lattice = learner(**{part: LATTICES[name]}), LATTICES[name].topology_
    kept, side = subject.maps(), part.removesuffix("_map")
    assert tuple(kept[f"{side}_shape"]) == lattice.shape  # type: ignore[attr-defined]
    codes = kept[f"{side}_codebook"]
    assert codes.shape == (np.prod(kept[f"{side}_shape"]), 2)
    assert codes.min() >= 0 and codes.max() <= 1
    assert codes.mean(axis=0) == pytest.approx([0.5, 0.5], abs=4 / np.sqrt(12 * len(codes)))


@pytest.mark.parametrize("part", ["arm_map", "head_map"])
@pytest.mark.parametrize("chart", [NeuralGas(), GrowingNeuralGas(), EvolvingSOM(), GrowWhenRequired()])
def test_a_map_on_no_lattice_is_refused_by_name(part: str, chart: Map) -> None:
    """The argument, what fits there and what was given are in the message."""
    kind = type(chart).__name__
    with pytest.raises(ValueError, match=rf"^{part} must be a map on a lattice, such as dsom or som; {kind} is none$"):
        learner(**{part: chart})


@pytest.mark.parametrize("part", ["arm_map", "head_map"])
@pytest.mark.parametrize(
    ("chart", "message"),
    [
        (DSOM(shape=(3, 3), elasticity=-1), "elasticity must be"),
        (SOM(shape=(0, 3)), "shape must be one to four whole numbers"),
        (DSOM(preset="paper"), "unknown preset 'paper'; valid presets: "),
        (
            SOM(shape=(3, 3), init=np.zeros((8, 2))),
            r"init must have shape \(units, dims\), \(9, 2\) here; got \(8, 2\)",
        ),
        (DSOM(shape=(4000, 4000)), r"has at most 1e\+07 units, not 1\.6e\+07\. Make it smaller"),
    ],
)
def test_a_map_that_cannot_be_made_is_named(part: str, chart: Map, message: str) -> None:
    """What the map says is wrong with it, after the name of the argument, before anything is made."""
    with pytest.raises(ValueError, match=rf"^{part}:? {message}"):
        learner(**{part: chart})


def test_maps_are_given_as_parameters_and_left_alone() -> None:
    """Two learners made from one map share nothing with it or with each other, and each draws its own start."""
    chart = SOM(shape=(6, 5))
    one, other = learner(1, arm_map=chart, head_map=chart), learner(2, arm_map=chart, head_map=chart)
    for percept in percepts(50):
        one.observe(percept)
    assert chart.get_params() == SOM(shape=(6, 5)).get_params() and not hasattr(chart, "n_features_in_")
    assert same(other.state(), learner(2, arm_map=chart, head_map=chart).state())
    assert not np.isin(one.arm_map.codebook_, other.arm_map.codebook_).any()


def test_start_codes_can_be_given() -> None:
    """What a map's `init` holds is where it begins, and the other map's start is not shifted by that."""
    codes = np.random.default_rng(4).random((30, 2))
    subject = learner(arm_map=SOM(shape=(6, 5), init=codes))
    assert np.array_equal(subject.arm_map.codebook_, codes)
    assert np.array_equal(subject.head_map.codebook_, learner().head_map.codebook_)


# -- links -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("rule", "name"), [(PositiveHebb, "links"), (NormalisedHebb, "links_row_normalised")])
def test_links_end_as_those_of_the_first_authors_program(rule: type[PositiveHebb], name: str) -> None:
    """300 recorded winners, distances and factors, lived through with slope 2, end at the recorded table.

    Codes lie far apart on a line, so that a posture has the recorded winner at the recorded distance; the hand is
    seen at the distance from the centre which has the recorded factor.
    """
    line, apart = np.array([[0.0, 1.0]]), 100.0
    chart = SOM(shape=(64,), init=apart * np.arange(64.0)[:, None])
    subject = HebbianLearner(
        robot(line, line),
        np.random.default_rng(0),
        arm_map=chart,
        head_map=chart,
        rule=rule(float(GOLDEN["learning_rate"])),
        activation_slope=2.0,
        plastic={"links"},
    )
    names = ("pre_winners", "post_winners", "pre_distances", "post_distances", "factors")
    for i, j, d_i, d_j, factor in zip(*(GOLDEN[name].tolist() for name in names), strict=True):
        arm, head = np.array([apart * i + d_i]), np.array([apart * j - d_j])
        seen = Sighting((CENTRE[0] + 200 * (1 - factor), CENTRE[1]), 0, 400.0)
        subject.observe(Percept(0.0, arm, head, arm, head, seen))
        assert subject.probes()["arm_winner"] == i and subject.probes()["head_winner"] == j
    np.testing.assert_allclose([subject.links.row(i) for i in range(64)], GOLDEN[name], rtol=0, atol=1e-6)


@pytest.mark.parametrize("slope", [0.5, 1.0, 2.0, 7.0])
def test_the_slope_is_that_of_the_activation(slope: float) -> None:
    """A link's first growth is eta f_c / ((1 + slope tanh d_i) (1 + slope tanh d_j))."""
    subject, percept = learner(rule=PositiveHebb(0.3), activation_slope=slope), percepts(1)[0]
    subject.observe(replace(percept, sighting=Sighting(CENTRE, 0, 400.0)))
    seen = subject.probes()
    growth = 0.3 / (1 + slope * tanh(seen["arm_distance"])) / (1 + slope * tanh(seen["head_distance"]))
    assert subject.links.used()[2] == pytest.approx([growth], rel=1e-12)


def test_normalised_links_sum_to_1_in_each_row_that_was_hit() -> None:
    """The rule that is given is the one that learns."""
    subject = learner(rule=NormalisedHebb())
    for percept in percepts(300):
        subject.observe(percept)
    sums = np.array([subject.links.row(i).sum() for i in range(subject.links.n_pre)])
    assert ((np.abs(sums - 1) < 1e-12) | (sums == 0)).all() and (sums > 0).sum() > 10


def test_without_centring_every_hit_counts_alike() -> None:
    """f_c is 1 wherever the hand is seen, in a corner or outside the picture, and 0 on a miss."""
    percept = percepts(1)[0]
    grown = []
    for pixel in (CENTRE, (0.0, 0.0), (319.0, 20.0), (-500.0, 900.0)):
        subject = learner(centring="none")
        subject.observe(replace(percept, sighting=Sighting(pixel, 0, 400.0)))
        grown.append(float(subject.links.used()[2][0]))
    assert len(set(grown)) == 1
    centred = learner()
    centred.observe(replace(percept, sighting=Sighting(CENTRE, 0, 400.0)))
    assert grown[0] == centred.links.used()[2][0]
    missed = learner(centring="none")
    missed.observe(replace(percept, sighting=None))
    assert len(missed.links.used()[2]) == 0


# -- units -----------------------------------------------------------------------------------------------------------


def test_in_radians_maps_are_given_the_postures_as_they_are() -> None:
    """Winners and distances are those of the angles, and links grow by activations of these distances."""
    subject = learner(units="radian", rule=PositiveHebb(0.01))
    for percept in percepts(200, hits=1.0):
        before = np.array([subject.links.row(i) for i in range(36)])
        subject.observe(percept)
        found = []
        for chart, angles, name in (
            (subject.arm_map, percept.arm, "arm"),
            (subject.head_map, percept.head, "head"),
        ):
            distances = np.linalg.norm(chart.codebook_ - angles, axis=1)
            assert subject.probes()[f"{name}_winner"] == distances.argmin()
            assert subject.probes()[f"{name}_distance"] == pytest.approx(distances.min(), abs=1e-12)
            found.append((int(distances.argmin()), 1 / (1 + tanh(distances.min()))))
        (i, a_i), (j, a_j) = found
        assert percept.sighting is not None
        u, v = percept.sighting.pixel
        grown = subject.links.row(i)[j] - before[i, j]
        assert grown == pytest.approx(0.01 * a_i * a_j * (1 - hypot(u - 159.5, v - 119.5) / 200), abs=1e-12)


def test_in_radians_codes_start_in_the_joints_ranges() -> None:
    """Uniform between each joint's limits: the same draws as in [0, 1] units, stretched to the ranges."""
    radians, units = learner(units="radian"), learner()
    for name, limits in (("arm_map", ARM), ("head_map", HEAD)):
        codes = getattr(radians, name).codebook_
        assert (limits[:, 0] <= codes).all() and (codes <= limits[:, 1]).all()
        assert (np.ptp(codes, axis=0) > 0.8 * np.ptp(limits, axis=1)).all()
        assert unit(codes, limits) == pytest.approx(getattr(units, name).codebook_, abs=1e-12)


@pytest.mark.parametrize(("units", "unit_of_distances"), [("unit", "1"), ("radian", "rad")])
def test_columns_say_in_which_unit_distances_are(units: str, unit_of_distances: str) -> None:
    """Winners are whole numbers without a unit; distances are floats in the unit of what the maps are given."""
    columns = {column.name: column for column in learner(units=units).columns}
    assert list(columns) == ["arm_winner", "head_winner", "arm_distance", "head_distance"]
    for side in ("arm", "head"):
        assert (columns[f"{side}_winner"].type, columns[f"{side}_winner"].unit) == ("int", "")
        assert (columns[f"{side}_distance"].type, columns[f"{side}_distance"].unit) == ("float", unit_of_distances)
        assert ("rad" in columns[f"{side}_distance"].meaning) == (units == "radian")
    assert {column.role for column in columns.values()} == {"probe"}


@pytest.mark.parametrize("units", ["unit", "radian"])
def test_what_is_kept_is_in_shares_of_the_ranges_whatever_maps_are_given(units: str) -> None:
    """From the codebooks, limits and links that `maps` keeps, what the learner predicts follows."""
    subject = learner(units=units)
    for percept in percepts(300):
        subject.observe(percept)
    kept = subject.maps()
    assert np.array_equal(kept["arm_limits"], ARM) and np.array_equal(kept["head_limits"], HEAD)
    for name in ("arm_codebook", "head_codebook"):
        assert kept[name].min() >= -1e-9 and kept[name].max() <= 1 + 1e-9 and np.ptp(kept[name]) > 0.7
    table = np.zeros((36, 36))
    table[kept["link_pre"], kept["link_post"]] = kept["link_weight"]
    scale = np.ptp(ARM, axis=1) if units == "radian" else np.ones(2)
    for percept in percepts(100, seed=1):
        apart = (kept["arm_codebook"] - unit(percept.arm, ARM)) * scale
        i = int(np.linalg.norm(apart, axis=1).argmin())
        expected = HEAD[:, 0] + kept["head_codebook"][int(table[i].argmax())] * np.ptp(HEAD, axis=1)
        assert subject.predict(percept.arm) == pytest.approx(expected, abs=1e-12)


# -- ties ------------------------------------------------------------------------------------------------------------


def nodes(subject: HebbianLearner, arms: list[Floats]) -> list[int]:
    """The head nodes looked at for these arm postures, one after the other; nothing is learned."""
    codes = subject.maps()["head_codebook"]
    zero = np.zeros(2)
    aims = [unit(subject.gaze(Percept(0.0, arm, zero, arm, zero)), HEAD) for arm in arms]
    return [int(np.linalg.norm(codes - aim, axis=1).argmin()) for aim in aims]


def apart(subject: HebbianLearner) -> tuple[Floats, Floats]:
    """Two arm postures with different winners."""
    one, other = (ARM[:, 0] + subject.maps()["arm_codebook"][k] * np.ptp(ARM, axis=1) for k in (0, 20))
    return one, other


def test_a_held_choice_stays_as_long_as_the_winner_is_the_same() -> None:
    """The same node for any posture of one winner; when it comes back after another winner, a new one is drawn."""
    subject = learner(ties="held")
    one, other = apart(subject)
    near = one + 1e-6
    looked = nodes(subject, [one, near, one, near] + 100 * [other, one, one])
    assert len(set(looked[:4])) == 1
    stays = np.array(looked[4:]).reshape(100, 3)
    assert (stays[:, 1] == stays[:, 2]).all()
    assert len(set(stays[:, 1])) > 15 and len(set(stays[:, 0])) > 15


def test_held_choices_are_uniform() -> None:
    """Each of equal links is held as often as any other (chi-squared)."""
    subject = learner(ties="held", head_map=DSOM(shape=(3, 3)))
    looked = nodes(subject, 4500 * list(apart(subject)))
    for found in (looked[::2], looked[1::2]):
        assert chisquare(np.bincount(found, minlength=9)).pvalue > 1e-3


@pytest.mark.parametrize("ties", ["redrawn", "held", "first"])
def test_the_strongest_link_is_followed_at_once(ties: str) -> None:
    """Equal links alone leave a choice: a link that becomes the strongest counts in the same frame."""
    subject = learner(ties=ties)
    one, _ = apart(subject)
    nodes(subject, [one])
    for strongest in (7, 30, 7):
        links = {"link_pre": np.array([0]), "link_post": np.array([strongest]), "link_weight": np.array([0.5])}
        subject.links.restore(links)
        assert nodes(subject, [one, one]) == [strongest, strongest]


def test_the_first_of_ties_is_the_prediction() -> None:
    """Nothing is drawn: gaze is what `predict` says in every frame, and the generator stays as it was."""
    subject = learner(ties="first")
    before = subject.state()["rng"]
    for percept in percepts(100):
        subject.observe(percept)
        assert np.array_equal(subject.gaze(percept), subject.predict(percept.arm))
    assert same(subject.state()["rng"], before)
    assert nodes(learner(ties="first"), list(apart(subject))) == [0, 0]


def test_redrawn_ties_change_in_the_next_frame() -> None:
    """What the paper says: with the same posture another of the equal links is looked at."""
    subject = learner()
    assert len(set(nodes(subject, 200 * [apart(subject)[0]]))) > 30


# -- state -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", VARIANTS)
def test_continues_bit_for_bit_from_a_checkpoint(name: str) -> None:
    """Gazes, predictions, probes, maps and state of one restored, whatever it was before, are those of the original."""
    original, other = learner(1, **VARIANTS[name]), learner(2, **VARIANTS[name])
    for subject, seed in ((original, 3), (other, 4)):
        for percept in percepts(150, seed):
            subject.observe(percept)
            subject.gaze(percept)
    state = stored(original.state())

    def future(subject: HebbianLearner) -> list[Any]:
        out: list[Any] = []
        for percept in percepts(150, seed=5):
            out.append((subject.gaze(percept), subject.predict(percept.arm[::-1])))
            subject.observe(percept)
            out.append((subject.gaze(percept), dict(subject.probes())))
        return [*out, subject.maps(), subject.state()]

    expected = future(original)
    other.restore(state)
    assert same(future(other), expected)


def test_a_held_choice_is_kept_by_the_state() -> None:
    """Restored while a choice is held, another learner looks at the same node in the next frame."""
    for seed in range(10):
        original, other = learner(1, ties="held"), learner(seed + 2, ties="held")
        one, _ = apart(original)
        (held,) = nodes(original, [one])
        nodes(other, [one])
        other.restore(stored(original.state()))
        assert nodes(other, [one]) == [held]


# -- what is refused -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("choice", "valid"),
    [("units", "unit, radian"), ("centring", "linear, none"), ("ties", "redrawn, held, first")],
)
def test_an_unknown_choice_is_refused(choice: str, valid: str) -> None:
    """The argument, its value and the valid ones are named; it does not count as one of them in silence."""
    with pytest.raises(ValueError, match=f"^{choice} must be one of {valid}; got 'degrees'$"):
        learner(**{choice: "degrees"})


@pytest.mark.parametrize("slope", [0.0, -1.0, np.nan, np.inf])
def test_a_slope_must_be_positive(slope: float) -> None:
    """With -1 an activation would be infinite far from a code."""
    with pytest.raises(ValueError, match=r"^activation_slope must be a finite number over 0; got "):
        learner(activation_slope=slope)
