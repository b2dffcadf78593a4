"""Activation and the positive Hebbian rule."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from somatopy.links import NormalisedHebb, PositiveHebb, activation


@given(st.floats(0, 100), st.floats(0, 5))
def test_activation_is_equation_four(distance: float, slope: float) -> None:
    """1 / (1 + slope tanh d): 1 on a hit, never under 1 / (1 + slope), never rising with distance."""
    value = activation(distance, slope)
    assert value == pytest.approx(1 / (1 + slope * np.tanh(distance)), rel=1e-14)
    assert activation(0.0, slope) == 1.0
    assert activation(distance + 1.0, slope) <= value


@pytest.mark.parametrize("distance", [-0.1, float("nan")])
def test_activation_refuses_what_is_no_distance(distance: float) -> None:
    """The message has the value."""
    with pytest.raises(ValueError, match=f"distance must be a number from 0 up; got {distance}"):
        activation(distance)


@given(st.floats(0, 1), st.floats(0, 1), st.floats(1e-4, 1), st.integers(0, 4))
def test_positive_hebb_is_equation_three(product: float, target: float, rate: float, j: int) -> None:
    """The winner's link grows by eta A_i A_j f_c, the others stay."""
    row = np.linspace(0.0, 1.0, 5)
    before = row.copy()
    PositiveHebb(rate).update(row, j, product, target)
    before[j] += rate * product * target
    np.testing.assert_allclose(row, before, rtol=1e-15)


def test_a_miss_changes_nothing() -> None:
    """With target 0 the paper's rule leaves the row to the last bit."""
    row = np.random.default_rng(0).random(5)
    before = row.copy()
    PositiveHebb().update(row, 2, activation=0.9, target=0.0)
    np.testing.assert_array_equal(row, before)


@given(st.lists(st.tuples(st.integers(0, 4), st.floats(0.1, 1), st.floats(0, 1)), min_size=1, max_size=30))
def test_normalised_hebb_divides_what_the_papers_rule_gives_by_its_sum(
    happened: list[tuple[int, float, float]],
) -> None:
    """After each update the row is that of `PositiveHebb`, divided by its sum; a row of zeros stays one."""
    row = np.zeros(5)
    for j, product, target in happened:
        expected = row.copy()
        PositiveHebb(0.1).update(expected, j, product, target)
        NormalisedHebb(0.1).update(row, j, product, target)
        np.testing.assert_allclose(row, expected / expected.sum() if expected.any() else 0.0, rtol=1e-12)


@pytest.mark.parametrize(("j", "product", "target"), [(-1, 1, 1), (5, 1, 1), (0, np.nan, 1), (0, 1, np.inf)])
def test_positive_hebb_refuses_bad_input(j: int, product: float, target: float) -> None:
    """A bad index or value is named, and nothing is written, beside the row least of all."""
    row = np.zeros(5)
    with pytest.raises(ValueError, match="j must be an index from 0 to 4, activation and target finite; got j"):
        PositiveHebb().update(row, j, product, target)
    assert not row.any()


@pytest.mark.parametrize("rate", [0, -1.0, np.nan, np.inf])
def test_learning_rate_must_be_positive(rate: float) -> None:
    """The message has the value."""
    with pytest.raises(ValueError, match=f"learning_rate must be a finite number over 0; got {rate}"):
        PositiveHebb(rate)


def test_positive_hebb_remembers_nothing() -> None:
    """Its state is empty, and can be given back."""
    rule = PositiveHebb()
    assert rule.state() == {}
    rule.restore({})
