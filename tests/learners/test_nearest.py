"""The nearest remembered hit, against a search through all of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import kstest

from somatopy.contract import same
from somatopy.learners import Learner, NearestGaze
from somatopy.percept import Camera, Percept, Robot, Sighting, Space

ARM = np.array([[-2.0857, 2.0857], [-0.3142, 1.3265], [-2.0857, 2.0857], [-1.5446, -0.0349]])
HEAD = np.array([[-2.0857, 2.0857], [-0.6720, 0.5149]])


def robot(arm: np.ndarray) -> Robot:
    """A robot whose arm has these limits."""
    senses = {"arm": Space("abcd"[: len(arm)], *arm.T), "head": Space(("yaw", "pitch"), *HEAD.T)}
    return Robot(senses, ("head",), Camera("eye", 320, 240, fovy=0.83))


def control(seed: int = 0) -> NearestGaze:
    return NearestGaze(robot(ARM), np.random.default_rng(seed))


def percepts(count: int, seed: int = 0, hit_rate: float = 0.6) -> Iterator[Percept]:
    """Random frames, in the limits and a little beyond."""
    rng = np.random.default_rng(seed)
    for k in range(count):
        arm, head = (
            limits[:, 0] + rng.uniform(-0.2, 1.2, len(limits)) * np.ptp(limits, axis=1) for limits in (ARM, HEAD)
        )
        sighting = Sighting((100.0, 100.0), 0, 400.0) if rng.random() < hit_rate else None
        yield Percept(k / 15, arm, head, rng.random(4), rng.random(2), sighting)


def test_it_is_a_learner() -> None:
    """It has all that the contract names."""
    assert isinstance(control(), Learner)


def test_it_agrees_with_a_search_through_all_hits() -> None:
    """4,000 percepts, 2,400 hits, distances in shares of the ranges: gaze and prediction are the nearest hit's head."""
    subject, arms, heads = control(), [], []
    for percept in percepts(4000):
        subject.observe(percept)
        if percept.sighting is not None:
            arms.append((percept.arm - ARM[:, 0]) / np.ptp(ARM, axis=1))
            heads.append(percept.head)
        if arms:
            asked = percept.arm if percept.sighting is None else percept.arm[::-1]
            distances = np.linalg.norm(arms - (asked - ARM[:, 0]) / np.ptp(ARM, axis=1), axis=1)
            expected = heads[int(distances.argmin())]
            assert np.array_equal(subject.predict(asked), expected)
            assert np.array_equal(subject.gaze(replace(percept, arm=asked)), expected)
    assert len(arms) > 2000


def test_nearness_is_measured_in_shares_of_each_joints_range() -> None:
    """A joint of a wide range counts less an angle: half of a narrow range is farther than a quarter of a wide one."""
    subject = NearestGaze(robot(np.array([[-2, 2], [0, 0.2]])), np.random.default_rng(0))
    seen = Percept(0.0, *map(np.array, ([1.0, 0.0], [0.1, 0.1], [0, 0], [0, 0])), Sighting((0, 0), 0, 1.0))  # type: ignore[arg-type]
    subject.observe(seen)
    subject.observe(replace(seen, arm=np.array([0.0, 0.1]), head=np.array([0.2, 0.2])))
    assert subject.predict([0.0, 0.0]).tolist() == [0.1, 0.1]


def test_the_posture_is_remembered_as_it_was() -> None:
    """Arrays that callers change later, those it was given and those it gives, are not its memory."""
    subject, percept = control(), next(percepts(1, hit_rate=1.0))
    arm, head = percept.arm.copy(), percept.head.copy()
    subject.observe(percept)
    percept.arm[:], percept.head[:] = 9, 9
    subject.predict(arm)[:] = 9
    subject.gaze(percept)[:] = 9
    assert np.array_equal(subject.predict(arm), head)


def test_a_miss_is_forgotten() -> None:
    """Only what was seen counts."""
    subject, silent = control(), control()
    for percept in percepts(50, hit_rate=1.0):
        subject.observe(percept)
        silent.observe(percept)
    for percept in percepts(500, seed=1, hit_rate=0.0):
        subject.observe(percept)
    assert same(subject.state(), silent.state())


def test_before_the_first_hit_it_looks_at_random() -> None:
    """Uniform in the head's limits, drawn anew each frame; the prediction is the middle, and draws nothing."""
    subject, silent = control(), control()
    gazes = []
    for percept in percepts(2000, hit_rate=0.0):
        subject.observe(percept)
        assert np.allclose(subject.predict(percept.arm), HEAD.mean(axis=1))
        gazes.append(subject.gaze(percept))
        assert np.array_equal(gazes[-1], silent.gaze(percept))
    for k, (low, high) in enumerate(HEAD):
        assert kstest(np.array(gazes)[:, k], "uniform", (low, high - low)).pvalue > 1e-3


def test_what_is_not_plastic_remembers_nothing() -> None:
    """Its memory is its one plastic part; taken away in mid-life, what it knows stays and nothing is added."""
    subject = control()
    assert subject.plastic == {"memory"}
    for percept in percepts(100):
        subject.observe(percept)
    before = subject.state()
    subject.plastic = frozenset()
    for percept in percepts(100, seed=1):
        subject.observe(percept)
    assert same(subject.state(), before)
    subject.plastic = frozenset({"memory"})
    for percept in percepts(100, seed=1):
        subject.observe(percept)
    assert len(subject.state()["arms"]) > len(before["arms"])


@pytest.mark.parametrize("frames", [0, 1, 255, 257, 600, 2000])
def test_continues_bit_for_bit_from_a_state(frames: int) -> None:
    """state and restore at any size of memory, into a fresh one and into one that has other memories."""
    original = control(1)
    for percept in percepts(frames, hit_rate=1.0 if frames else 0.0):
        original.observe(percept)
        original.gaze(percept)
    state = original.state()

    def future(subject: NearestGaze) -> list[Any]:
        gazes = []
        for percept in percepts(700, seed=5):
            gazes.append((subject.gaze(percept).tolist(), subject.predict(percept.arm[::-1]).tolist()))
            subject.observe(percept)
        return [*gazes, subject.state()]

    expected = future(original)
    other, used = control(2), control(3)
    for percept in percepts(400, seed=7):
        used.observe(percept)
    for subject in (other, used):
        subject.restore(state)
        for one, another in zip(future(subject), expected, strict=True):
            assert same(one, another)


def test_nothing_to_record() -> None:
    """No probes, no maps."""
    assert control().probes() == {} == control().maps()
