"""The paper's learner, held against its equations and against a slow, independent account of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from math import hypot, tanh
from typing import Any

import numpy as np
import pytest
from scipy.stats import chisquare

from somatopy.learners import HebbianLearner, centring
from somatopy.links import PositiveHebb
from somatopy.maps import DSOM
from somatopy.percept import Camera, Percept, Robot, Sighting, Space

ARM = np.array([[-2.0857, 2.0857], [-0.3142, 1.3265], [-2.0857, 2.0857], [-1.5446, -0.0349]])
HEAD = np.array([[-2.0857, 2.0857], [-0.6720, 0.5149]])
SIZE = (320, 240)
ROBOT = Robot({"arm": Space("abcd", *ARM.T), "head": Space("yp", *HEAD.T)}, ("head",), Camera("eye", *SIZE, fovy=0.83))
OFFSET = np.array([0.1265, 1.1411, 1.2295, -0.2242])
ELASTICITY, RATE, LINK_RATE = 0.2, 0.1, 0.01


def learner(seed: int = 0, arm: int = 10, head: int = 8, **settings: Any) -> HebbianLearner:
    maps = {
        name: DSOM(shape=(n, n), learning_rate=RATE, elasticity=ELASTICITY)
        for name, n in (("arm_map", arm), ("head_map", head))
    }
    return HebbianLearner(ROBOT, np.random.default_rng(seed), **{**maps, "rule": PositiveHebb(LINK_RATE)} | settings)


def percepts(count: int, seed: int = 0, hit_rate: float = 0.6, offset: np.ndarray | None = None) -> Iterator[Percept]:
    """Random frames; `offset` shifts the arm vectors of the second half, far out of the limits."""
    rng = np.random.default_rng(seed)
    for k in range(count):
        arm, head = (limits[:, 0] + rng.random(len(limits)) * np.ptp(limits, axis=1) for limits in (ARM, HEAD))
        if offset is not None and k >= count // 2:
            arm = arm + offset
        pixel = float(rng.uniform(0, 320)), float(rng.uniform(0, 240))
        sighting = Sighting(pixel, 0, 400.0) if rng.random() < hit_rate else None
        yield Percept(k / 15, arm, head, rng.random(4), rng.random(2), sighting)


def unit(angles: np.ndarray, limits: np.ndarray) -> np.ndarray:
    return (angles - limits[:, 0]) / (limits[:, 1] - limits[:, 0])


def same(a: Any, b: Any) -> bool:
    """Whether two states are equal to the last bit."""
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    return np.array_equal(a, b, equal_nan=np.asarray(a).dtype.kind == "f")


def table_of(subject: HebbianLearner) -> np.ndarray:
    """All links, a row for each arm node."""
    return np.array([subject.links.row(i) for i in range(subject.links.n_pre)])


class PlainMap:
    """Equations 1 and 2, unit by unit, with distances divided by the greatest one so far."""

    def __init__(self, codes: np.ndarray, side: int) -> None:
        self.codes = codes.copy()
        self.places = np.array([[r, c] for r in range(side) for c in range(side)]) / (side - 1) / np.sqrt(2)
        self.greatest = 0.0

    def nearest(self, v: np.ndarray) -> tuple[int, float]:
        distances = [float(np.linalg.norm(v - code)) for code in self.codes]
        return int(np.argmin(distances)), min(distances)

    def learn(self, v: np.ndarray) -> None:
        distances = np.linalg.norm(v - self.codes, axis=1)
        self.greatest = max(self.greatest, distances.max())
        s = int(np.argmin(distances))
        if distances[s] == 0:
            return
        omega = distances / self.greatest
        apart = ((self.places - self.places[s]) ** 2).sum(axis=1)
        h = np.exp(-apart / omega[s] ** 2 / ELASTICITY**2)
        self.codes += (RATE * omega * h)[:, None] * (v - self.codes)


# -- f_c -------------------------------------------------------------------------------------------------------------


def test_centring_falls_linearly_from_the_centre_to_the_corner() -> None:
    """1 at (159.5, 119.5), 0.5 at 100 px from it in any direction, 0 at 200 px and beyond, 0 on a miss."""

    def at(u: float, v: float) -> float:
        return centring(Sighting((u, v), 0, 1.0), SIZE)

    assert at(159.5, 119.5) == 1.0
    assert [at(159.5 + 100, 119.5), at(159.5, 119.5 - 100), at(159.5 + 60, 119.5 + 80)] == pytest.approx([0.5] * 3)
    assert at(159.5 + 160, 119.5 + 120) == pytest.approx(0.0, abs=1e-12)
    assert at(1000, 1000) == at(-5000, 0) == 0.0
    assert centring(None, SIZE) == 0.0


# -- the order of a frame --------------------------------------------------------------------------------------------


def test_maps_learn_before_winners_and_winners_come_before_links(monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps 5, 6 and 7: each map learns before its winner is found, both before the links learn, all of it once."""
    subject, calls = learner(), []

    def spy(part: Any, method: str, *names: str) -> None:
        real: Callable[..., Any] = getattr(part, method)

        def called(*args: Any) -> Any:
            calls.extend(names)
            return real(*args)

        monkeypatch.setattr(part, method, called)

    for name in ("arm_map", "head_map"):
        spy(getattr(subject, name), "learn_one", f"learn {name}")
        spy(getattr(subject, name), "winner", f"winner {name}")
        spy(getattr(subject, name), "learn_and_find", f"learn {name}", f"winner {name}")
    spy(subject.links, "update", "links")
    subject.observe(next(percepts(1, hit_rate=1.0)))
    assert sorted(calls) == ["learn arm_map", "learn head_map", "links", "winner arm_map", "winner head_map"]
    assert [call for call in calls if "arm_map" in call] == ["learn arm_map", "winner arm_map"]
    assert [call for call in calls if "head_map" in call] == ["learn head_map", "winner head_map"]
    assert calls[-1] == "links"


def test_distortion_is_measured_after_the_update() -> None:
    """The probes hold the winners and distances of the changed maps, in [0, 1] units; they differ from those before."""
    subject = learner()
    for percept in percepts(200):
        x, y = unit(percept.arm, ARM), unit(percept.head, HEAD)
        before = subject.arm_map.winner(x)[1]
        subject.observe(percept)
        probes = subject.probes()
        assert (probes["arm_winner"], probes["arm_distance"]) == subject.arm_map.winner(x)
        assert (probes["head_winner"], probes["head_distance"]) == subject.head_map.winner(y)
        nearest = np.linalg.norm(subject.arm_map.codebook_ - x, axis=1).min()
        assert probes["arm_distance"] == pytest.approx(nearest, rel=1e-12)
        assert probes["arm_distance"] < before


def test_a_link_grows_by_equations_3_and_4() -> None:
    """On a hit w_ij grows by eta A(d_i) A(d_j) f_c, all other links stay; computed from the codebooks."""
    subject = learner()
    for percept in percepts(300, hit_rate=1.0):
        before = table_of(subject)
        subject.observe(percept)
        growth = table_of(subject) - before
        expected, activations = np.zeros_like(growth), []
        for codes, v in (
            (subject.arm_map.codebook_, unit(percept.arm, ARM)),
            (subject.head_map.codebook_, unit(percept.head, HEAD)),
        ):
            distances = np.sqrt(((codes - v) ** 2).sum(axis=1))
            activations.append((int(distances.argmin()), 1 / (1 + tanh(distances.min()))))
        (i, a_i), (j, a_j) = activations
        assert percept.sighting is not None
        u, v_ = percept.sighting.pixel
        expected[i, j] = LINK_RATE * a_i * a_j * max(0.0, 1 - hypot(u - 159.5, v_ - 119.5) / 200)
        assert np.abs(growth - expected).max() < 1e-15


def test_a_miss_changes_no_link_but_teaches_the_maps() -> None:
    """Without a sighting the links stay to the bit, and both maps learn."""
    subject = learner()
    for percept in percepts(50, hit_rate=1.0):
        subject.observe(percept)
    before = subject.state()
    for percept in percepts(50, seed=1, hit_rate=0.0):
        subject.observe(percept)
    after = subject.state()
    assert same(before["links"], after["links"])
    assert not same(before["arm_map"], after["arm_map"]) and not same(before["head_map"], after["head_map"])


def test_only_plastic_parts_learn() -> None:
    """Each named part can be frozen by itself, at any time; the others go on."""
    parts = {"arm_map", "head_map", "links"}
    for frozen in parts:
        subject = learner()
        subject.plastic = frozenset(parts - {frozen})
        before = subject.state()
        for percept in percepts(20, hit_rate=1.0):
            subject.observe(percept)
        after = subject.state()
        assert {part for part in parts if not same(before[part], after[part])} == parts - {frozen}


def test_start() -> None:
    """All links are 0, codes are uniform in [0, 1], and the two maps do not share their numbers."""
    subject = learner(arm=20, head=20)
    assert not table_of(subject).any()
    for codes in (subject.arm_map.codebook_, subject.head_map.codebook_):
        assert codes.min() >= 0 and codes.max() <= 1
        assert codes.mean(axis=0) == pytest.approx(np.full(codes.shape[1], 0.5), abs=4 / np.sqrt(12 * 400))
    assert not np.isin(subject.arm_map.codebook_, subject.head_map.codebook_).any()


def test_each_part_has_random_numbers_of_its_own() -> None:
    """Another size of one map shifts neither the other map's start codes nor what gaze draws."""
    usual, other_arm, other_head = learner(), learner(arm=5), learner(head=5)
    assert np.array_equal(usual.head_map.codebook_, other_arm.head_map.codebook_)
    assert np.array_equal(usual.arm_map.codebook_, other_head.arm_map.codebook_)
    assert usual.state()["rng"] == other_arm.state()["rng"] == other_head.state()["rng"]


def test_a_part_that_is_not_there_cannot_be_plastic() -> None:
    """The part and the valid ones are named; what was plastic stays."""
    subject = learner(plastic={"links"})
    with pytest.raises(ValueError, match=r"no part 'lynx' .*arm_map.*head_map.*links"):
        subject.plastic = frozenset({"links", "lynx"})
    assert subject.plastic == {"links"}
    with pytest.raises(ValueError, match="no part 'memory'"):
        learner(plastic=["memory"])


def test_probes_tell_of_frames_in_which_nothing_learns() -> None:
    """Winners and distances are those of maps and percept, frozen or not; a frozen map's winner is the nearest code."""
    subject = learner(plastic=())
    codes = subject.arm_map.codebook_
    for percept in percepts(50):
        subject.observe(percept)
        distances = np.linalg.norm(codes - unit(percept.arm, ARM), axis=1)
        assert subject.probes()["arm_winner"] == distances.argmin()
        assert subject.probes()["arm_distance"] == pytest.approx(distances.min())


def test_shuffling_moves_whole_rows_of_links() -> None:
    """Each row is somewhere, most are elsewhere; maps, gaze's random numbers and another learner are not touched."""
    subject, silent = learner(), learner()
    for percept in percepts(1000, hit_rate=1.0):
        subject.observe(percept)
        silent.observe(percept)
    before, rows = subject.state(), table_of(subject)
    subject.shuffle(np.random.default_rng(1))
    after, moved = subject.state(), table_of(subject)
    assert sorted(map(bytes, rows)) == sorted(map(bytes, moved))
    known = rows.any(axis=1)
    assert known.sum() > 50 and (rows != moved).any(axis=1)[known].mean() > 0.9
    for part in ("arm_map", "head_map", "rng", "probes"):
        assert same(before[part], after[part])
    assert same(silent.state(), before)
    subject.links.restore(before["links"])
    subject.shuffle(np.random.default_rng(1))
    assert np.array_equal(table_of(subject), moved)
    subject.links.restore(before["links"])
    subject.shuffle(np.random.default_rng(2))
    assert not np.array_equal(table_of(subject), moved)


def test_maps_hold_all_that_was_learned() -> None:
    """Codebooks, lattices, limits in rad, and the links that are not 0: what the learner predicts follows from them."""
    subject = learner()
    assert len(subject.maps()["link_weight"]) == 0
    for percept in percepts(500, offset=OFFSET):
        subject.observe(percept)
    kept = subject.maps()
    assert set(kept) == {
        *["arm_codebook", "head_codebook", "arm_shape", "head_shape", "arm_limits", "head_limits"],
        *["link_pre", "link_post", "link_weight"],
    }
    assert (kept["arm_shape"].tolist(), kept["head_shape"].tolist()) == ([10, 10], [8, 8])
    assert np.allclose(kept["arm_limits"], ARM) and np.allclose(kept["head_limits"], HEAD)
    assert (kept["link_weight"] != 0).all() and len(kept["link_weight"]) > 100
    table = np.zeros((100, 64))
    table[kept["link_pre"], kept["link_post"]] = kept["link_weight"]
    for percept in percepts(100, seed=1):
        i = int(np.linalg.norm(kept["arm_codebook"] - unit(percept.arm, kept["arm_limits"]), axis=1).argmin())
        low, span = kept["head_limits"][:, 0], np.ptp(kept["head_limits"], axis=1)
        expected = low + kept["head_codebook"][int(table[i].argmax())] * span
        assert np.allclose(subject.predict(percept.arm), expected, rtol=0, atol=1e-12)


def test_maps_are_copies() -> None:
    """Who changes what was kept does not change the learner."""
    subject = learner()
    for percept in percepts(100):
        subject.observe(percept)
    before = subject.state()
    for array in subject.maps().values():
        array[...] = 0
    assert same(subject.state(), before)


# -- the whole against a slow account --------------------------------------------------------------------------------


def test_agrees_with_a_plain_account_of_the_science() -> None:
    """2,000 random frames, damaged in the second half: same winners, links, codes, and gaze where nothing ties."""
    subject = learner(seed=7, arm=10, head=8)
    arm, head = PlainMap(subject.arm_map.codebook_, 10), PlainMap(subject.head_map.codebook_, 8)
    links, compared = np.zeros((100, 64)), 0
    for percept in percepts(2000, seed=3, offset=OFFSET):
        x, y = unit(percept.arm, ARM), unit(percept.head, HEAD)
        arm.learn(x)
        head.learn(y)
        (i, d_i), (j, d_j) = arm.nearest(x), head.nearest(y)
        if percept.sighting is not None:
            r = hypot(percept.sighting.pixel[0] - 159.5, percept.sighting.pixel[1] - 119.5)
            links[i, j] += LINK_RATE / (1 + tanh(d_i)) / (1 + tanh(d_j)) * max(0.0, 1 - r / 200)
        subject.observe(percept)
        gaze = subject.gaze(percept)

        probes = subject.probes()
        assert (probes["arm_winner"], probes["head_winner"]) == (i, j)
        assert (probes["arm_distance"], probes["head_distance"]) == pytest.approx((d_i, d_j), abs=1e-9)
        strongest = np.flatnonzero(links[i] == links[i].max())
        if len(strongest) == 1:
            target = HEAD[:, 0] + head.codes[strongest[0]] * np.ptp(HEAD, axis=1)
            assert gaze == pytest.approx(target, abs=1e-8)
            compared += 1
    assert compared > 1000
    assert np.abs(table_of(subject) - links).max() < 1e-10
    assert np.abs(subject.arm_map.codebook_ - arm.codes).max() < 1e-9
    assert np.abs(subject.head_map.codebook_ - head.codes).max() < 1e-9


def test_a_damaged_vector_is_not_clipped() -> None:
    """An arm vector beyond the limits pulls codes out of [0, 1], where the shifted postures are."""
    subject = learner()
    for percept in percepts(2000, offset=OFFSET * 2):
        subject.observe(percept)
    assert subject.arm_map.codebook_[:, 1].max() > 1.2


def test_the_efference_copy_is_ignored() -> None:
    """Other commands in the percepts change nothing at all, neither state nor gaze."""
    one, two = learner(), learner()
    for percept in percepts(200):
        other = replace(percept, arm_command=np.full(4, np.nan), head_command=np.full(2, np.nan))
        one.observe(percept)
        two.observe(other)
        assert np.array_equal(one.gaze(percept), two.gaze(other))
    assert same(one.state(), two.state())


# -- gaze ------------------------------------------------------------------------------------------------------------


def nodes_looked_at(subject: HebbianLearner, percept: Percept, frames: int) -> np.ndarray:
    """Index of the head node that each of some frames' gaze aims at."""
    codes = subject.head_map.codebook_
    aims = np.array([unit(subject.gaze(percept), HEAD) for _ in range(frames)])
    distances = np.linalg.norm(aims[:, None] - codes, axis=2)
    assert distances.min(axis=1).max() < 1e-12
    return distances.argmin(axis=1)


def test_with_no_link_all_head_nodes_are_equally_likely_and_drawn_anew_each_frame() -> None:
    """An all-zero row: uniform over head nodes (chi-squared), and independent from frame to frame."""
    subject, percept = learner(head=3), next(percepts(1))
    nodes = nodes_looked_at(subject, percept, 9000)
    assert chisquare(np.bincount(nodes, minlength=9)).pvalue > 1e-3
    pairs = np.bincount(nodes[:-1] * 9 + nodes[1:], minlength=81)
    assert chisquare(pairs).pvalue > 1e-3


def test_equal_strongest_links_share_the_gaze() -> None:
    """Only the tied maxima are looked at, each as often; a single maximum always."""
    subject, percept = learner(head=3), next(percepts(1))
    i, _ = subject.arm_map.winner(unit(percept.arm, ARM))
    for strongest in ([2, 5, 7], [4]):
        row = np.full(9, 0.25)
        row[strongest] = 0.5
        subject.links.restore({"link_pre": np.full(9, i), "link_post": np.arange(9), "link_weight": row})
        seen = np.bincount(nodes_looked_at(subject, percept, 3000), minlength=9)
        assert np.flatnonzero(seen).tolist() == strongest
        assert len(strongest) == 1 or chisquare(seen[strongest]).pvalue > 1e-3


def test_prediction_is_pure() -> None:
    """predict twice gives the same, leaves the state alone, and the gaze that follows is that of a silent twin."""
    asked, silent = learner(), learner()
    stream = list(percepts(100))
    for percept in stream:
        asked.observe(percept)
        silent.observe(percept)
    before = asked.state()
    for percept in percepts(50, seed=9):
        assert np.array_equal(asked.predict(percept.arm), asked.predict(percept.arm))
    assert same(asked.state(), before)
    for percept in percepts(100, seed=10):
        assert np.array_equal(asked.gaze(percept), silent.gaze(percept))


def test_prediction_is_the_gaze_where_nothing_ties() -> None:
    """For a row with one strongest link, predict and gaze agree."""
    subject = learner()
    for percept in percepts(500, hit_rate=1.0):
        subject.observe(percept)
        assert np.array_equal(subject.predict(percept.arm), subject.gaze(percept))


# -- state -----------------------------------------------------------------------------------------------------------


def test_continues_bit_for_bit_from_a_state() -> None:
    """state and restore: gaze, probes and state go on as if nothing had happened, in another learner too."""
    original, other = learner(1), learner(2)
    for percept in percepts(200):
        original.observe(percept)
        original.gaze(percept)
    state = original.state()

    def future(subject: HebbianLearner) -> list[Any]:
        out = []
        for percept in percepts(200, seed=5):
            subject.observe(percept)
            out.append((subject.gaze(percept).tolist(), subject.probes()))
        return [*out, table_of(subject).tolist()]

    expected = future(original)
    other.restore(state)
    assert other.probes() == {**state["probes"]}
    assert future(other) == expected


def test_one_seed_one_life_and_two_seeds_differ() -> None:
    """The start codes are a function of the seed."""
    assert same(learner(3).state(), learner(3).state())
    assert not same(learner(3).state()["arm_map"], learner(4).state()["arm_map"])


def test_probes_keep_keys_and_types() -> None:
    """The recorder fixes its columns before the first frame: keys and kinds of numbers never change."""
    subject = learner()
    before = {key: isinstance(value, int) for key, value in subject.probes().items()}
    subject.observe(next(percepts(1)))
    assert {key: isinstance(value, int) for key, value in subject.probes().items()} == before


@pytest.mark.parametrize(("arm", "head"), [(1, 2), (5, 2), (4, 1), (4, 3)])
def test_postures_of_wrong_length_teach_nothing(arm: int, head: int) -> None:
    """Neither map has moved, and no number is taken for that of every joint."""
    subject = learner()
    before = subject.state()
    with pytest.raises(ValueError, match="joints is needed"):
        subject.observe(Percept(0.0, np.zeros(arm), np.zeros(head), np.zeros(4), np.zeros(2)))
    assert same(subject.state(), before)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_percept_that_is_not_finite_is_refused(bad: float) -> None:
    """NaN and infinities never reach the maps."""
    subject, percept = learner(), next(percepts(1))
    before = subject.state()
    with pytest.raises(ValueError, match="finite"):
        subject.observe(replace(percept, arm=np.array([0.0, bad, 0.0, -0.5])))
    assert same(before, subject.state())


def test_belief_is_the_links_as_shares_of_the_strongest() -> None:
    """Of the arm's winner, at the head unit nearest to each gaze: 1 where it would look, 0 where no link grew."""
    subject, frames = learner(arm=3), list(percepts(30, hit_rate=1.0))
    arms, gazes = np.array([frame.arm for frame in frames]), np.array([frame.head for frame in frames])
    assert not subject.belief(arms, gazes).any()
    for frame in frames:
        subject.observe(frame)
    units = subject.head_map.codebook_ * np.ptp(HEAD, axis=1) + HEAD[:, 0]
    for arm, believed in zip(arms, subject.belief(arms, gazes), strict=True):
        row = subject.links.row(subject.arm_map.winner((arm - ARM[:, 0]) / np.ptp(ARM, axis=1))[0])
        assert subject.belief([arm], [subject.predict(arm)])[0, 0] == float(row.any())
        nearest = [np.linalg.norm((units - gaze) / np.ptp(HEAD, axis=1), axis=1).argmin() for gaze in gazes]
        np.testing.assert_allclose(believed * row.max(), row[nearest])
