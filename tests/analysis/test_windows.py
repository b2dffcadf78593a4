"""Windows and moving means."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from somatopy.analysis.windows import hits_per_window, moving_mean

VALUES = arrays(np.float64, st.integers(0, 60), elements=st.floats(0, 1))


@given(st.lists(st.booleans(), max_size=100), st.integers(1, 30))
def test_windows_count_what_a_loop_counts(hits: list[bool], window: int) -> None:
    """Each full window holds the hits of its own frames, and the partial one at the end is dropped."""
    expected = [sum(hits[start : start + window]) for start in range(0, len(hits) - window + 1, window)]
    assert hits_per_window(hits, window).tolist() == expected


@given(st.lists(st.booleans(), max_size=100), st.integers(1, 30))
def test_windows_never_hold_more_than_all_hits(hits: list[bool], window: int) -> None:
    """The windows' sum is at most the number of hits, and equal to it when no frame is left over."""
    total = int(hits_per_window(hits, window).sum())
    assert total <= sum(hits)
    assert total == sum(hits) or len(hits) % window


@given(VALUES, st.integers(1, 20))
def test_moving_mean_equals_brute_force(values: np.ndarray, width: int) -> None:
    """Every mean is the mean of its own slice; before the first full slice there is none."""
    means = moving_mean(values, width)
    assert len(means) == len(values)
    assert np.isnan(means[: width - 1]).all()
    for end in range(width, len(values) + 1):
        assert means[end - 1] == pytest.approx(values[end - width : end].mean(), abs=1e-13)


def test_moving_mean_is_exact_enough_on_long_series() -> None:
    """The stated rounding, 1e-12 for 300,000 values in [0, 1], holds at the end, where errors have piled up."""
    values = np.random.default_rng(0).random(300_000)
    means = moving_mean(values, 1800)
    ends = np.arange(290_000, 300_000, 97)
    exact = [values[end - 1799 : end + 1].mean() for end in ends]
    np.testing.assert_allclose(means[ends], exact, rtol=0, atol=1e-12)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_bad_value_spoils_only_its_own_means(bad: float) -> None:
    """A value that is not finite leaves all means without it as they were."""
    values = np.arange(20.0)
    spoilt = values.copy()
    spoilt[8] = bad
    means = moving_mean(spoilt, 3)
    assert np.isnan(means[8:11]).all()
    clean = np.r_[2:8, 11:20]
    np.testing.assert_allclose(means[clean], moving_mean(values, 3)[clean])


def test_the_values_are_left_alone() -> None:
    """The caller's array is not written to."""
    values = np.arange(6.0)
    moving_mean(values, 2)
    assert values.tolist() == [0, 1, 2, 3, 4, 5]


def test_empty_windows_are_refused() -> None:
    """A window holds at least one frame."""
    with pytest.raises(ValueError, match=r"window = 0 must be at least 1 frame"):
        hits_per_window([True], 0)
    with pytest.raises(ValueError, match=r"width = 0 must be at least 1 frame"):
        moving_mean([1.0], 0)
