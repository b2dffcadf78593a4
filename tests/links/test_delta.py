"""The delta rule: where its links go, and what the paper's rule cannot do."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from somatopy.links import DeltaRule, HebbianLinks, PositiveHebb


@given(st.floats(0, 1), st.floats(0, 1), st.floats(1e-4, 1), st.integers(0, 4))
def test_the_distance_to_the_target_shrinks_by_a_factor(product: float, target: float, rate: float, j: int) -> None:
    """w - t becomes (1 - eta A_i A_j) (w - t) for the winner's link, and the others stay."""
    row = np.linspace(0.0, 1.0, 5)
    expected = row.copy()
    expected[j] = target + (1 - rate * product) * (row[j] - target)
    DeltaRule(rate).update(row, j, product, target)
    np.testing.assert_allclose(row, expected, atol=1e-15)


@given(st.lists(st.tuples(st.floats(0, 1), st.booleans()), max_size=60), st.floats(1e-3, 1))
def test_links_stay_between_miss_and_hit(happened: list[tuple[float, bool]], rate: float) -> None:
    """Whatever follows, a link is a chance: within [0, 1]."""
    rule, row = DeltaRule(rate), np.zeros(1)
    for product, hit in happened:
        rule.update(row, 0, product, float(hit))
        assert 0.0 <= row[0] <= 1.0


def test_a_link_estimates_how_often_the_hand_is_seen() -> None:
    """Seven times in ten: .7, with the deviation sqrt(p (1 - p) eta / (2 - eta)) of an exponential mean."""
    rule, row, rng, found = DeltaRule(0.1), np.zeros(1), np.random.default_rng(0), []
    for _ in range(20_000):
        rule.update(row, 0, 1.0, float(rng.random() < 0.7))
        found.append(row[0])
    assert np.mean(found[100:]) == pytest.approx(0.7, abs=0.02)
    assert np.std(found[100:]) == pytest.approx(np.sqrt(0.7 * 0.3 * 0.1 / 1.9), rel=0.1)


def test_what_was_good_once_is_left_when_it_fails() -> None:
    """After a hundred hits at one node and then misses there, a single hit elsewhere wins; not by the paper's rule."""
    for rule, expected in ((DeltaRule(0.3), 1), (PositiveHebb(0.3), 0)):
        links = HebbianLinks(1, 2, rule)
        for j, target in [(0, 1.0)] * 100 + [(0, 0.0)] * 10 + [(1, 1.0)]:
            links.update(0, j, activation=0.8, target=target)
        assert links.strongest(0, u=0.0) == expected


@pytest.mark.parametrize("rate", [0.0, -0.1, 1.5, float("nan"), float("inf")])
def test_a_rate_that_overshoots_is_refused(rate: float) -> None:
    """The message has the value."""
    with pytest.raises(ValueError, match=f"over 0 and at most 1; got {rate}"):
        DeltaRule(rate)
