"""Distances from a head that misses to one that would see: geometry that is known without the code."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from somatopy.bodies import MujocoBody
from somatopy.experiment.ceiling import Vantages
from somatopy.experiment.missed import miss_distance, miss_distances

FRONT = np.array([0.4, 0.0, -1.0, -0.9])
BEHIND = np.array([2.0, 1.3, 0.0, -0.1])


@pytest.fixture(scope="module")
def body() -> Iterator[MujocoBody]:
    body = MujocoBody("nao", "kinematic")
    yield body
    body.close()


@pytest.fixture(scope="module")
def vantages(body: MujocoBody) -> Vantages:
    return Vantages.of(body, (25, 9))


def test_it_is_the_distance_to_the_nearest_that_sees(vantages: Vantages) -> None:
    """Zero on one that sees; so far as a head was moved away from all of them; the mean over frames."""
    seeing = vantages.heads[vantages.seeing(FRONT)]
    left = seeing[seeing[:, 0].argmin()]
    assert miss_distance(vantages, FRONT[None], seeing[:1]) == 0.0
    away = left - [0.3, 0.0]
    assert miss_distance(vantages, FRONT[None], away[None]) == pytest.approx(0.3)
    both = miss_distance(vantages, np.stack([FRONT, FRONT]), np.stack([away, left]))
    assert both == pytest.approx(0.15)


def test_frames_without_any_that_sees_do_not_count(vantages: Vantages) -> None:
    """A hand behind the back is no miss of the head."""
    assert not vantages.seeing(BEHIND).any()
    head = vantages.heads[:1]
    assert miss_distance(vantages, BEHIND[None], head) is None
    with_front = miss_distance(vantages, np.stack([FRONT, BEHIND]), np.concatenate([head, head]))
    assert with_front == miss_distance(vantages, FRONT[None], head)


def test_hits_do_not_count_and_phases_are_apart(body: MujocoBody) -> None:
    """Without a miss, or without frames, nothing is told."""
    heads = np.array([[-1.0, 0.0], [1.0, 0.0]])
    arms = np.stack([FRONT, FRONT])
    every, missed = np.array([True, True]), np.array([True, False])
    found = miss_distances([body] * 3, [arms, arms, arms[:0]], [heads, heads, heads[:0]], [every, missed, every[:0]])
    assert found == [None, miss_distance(Vantages.of(body), arms[1:], heads[1:]), None]
    assert found[1] is not None and found[1] > 0


def test_of_many_misses_some_are_looked_at_evenly(body: MujocoBody, monkeypatch: pytest.MonkeyPatch) -> None:
    """From the first to the last of them."""
    monkeypatch.setattr("somatopy.experiment.missed._MOST", 3)
    heads, arms = np.linspace([-1.0, 0.0], [0.2, 0.0], 8), np.tile(FRONT, (8, 1))
    hits = np.arange(8) == 2
    found = miss_distances([body], [arms], [heads], [hits])
    assert found == [miss_distance(Vantages.of(body), arms[:3], heads[[0, 4, 7]])]
