"""The kernels' winner search, distances and checks, against NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from sklearn.metrics.pairwise import nan_euclidean_distances

from somatopy.maps.kernels import (
    LARGEST,
    LARGEST_SINGLE,
    all_usable,
    first_least,
    least_and_greatest,
    nearest,
    padded_dims,
    read_sample,
    squared_distances,
    unit_at,
    winners,
)
from somatopy.maps.sheet import Sheet

PRECISIONS = ("float32", "float64")
LIMITS = {"float32": LARGEST_SINGLE, "float64": LARGEST}
sizes = st.integers(1, 40)
some_dims = st.sampled_from([1, 2, 3, 4, 5, 8, 11])
seeds = st.integers(0, 2**32)
either_precision = st.sampled_from(PRECISIONS)


@pytest.mark.parametrize(("dims", "padded"), [(1, 2), (2, 2), (3, 4), (4, 4), (5, 8), (8, 8), (9, 12)])
def test_dims_fill_whole_steps(dims: int, padded: int) -> None:
    """Kernels work through 2 dimensions, or 4 at a time."""
    assert padded_dims(dims) == padded


@pytest.mark.parametrize("dtype", PRECISIONS)
@pytest.mark.parametrize("factor", [np.nan, np.inf, -np.inf, 10, -10])
def test_unusable_values_are_found_anywhere(factor: float, dtype: str) -> None:
    """One bad value in any place is enough; the largest that is taken is not bad."""
    limit = LIMITS[dtype]
    for place in np.ndindex(3, 3):
        samples = np.zeros((3, 3), dtype)
        samples[place] = factor * limit
        missing_may_be = bool(np.isnan(factor))
        assert not all_usable(samples, False)
        assert all_usable(samples, True) == missing_may_be
    assert all_usable(np.full((3, 3), -limit, dtype), False)


@pytest.mark.parametrize("dtype", PRECISIONS)
def test_a_row_without_any_value_is_not_usable(dtype: str) -> None:
    """Where values may be missing, each row has to have one."""
    samples = np.array([[0.0, np.nan], [np.nan, 0.0]], dtype)
    assert all_usable(samples, True)
    samples[1, 1] = np.nan
    assert not all_usable(samples, True)


@settings(max_examples=60, deadline=None)
@given(sizes, sizes, some_dims, seeds, st.booleans(), either_precision)
def test_winner_is_the_first_of_the_nearest(
    rows: int, columns: int, dims: int, seed: int, coarse: bool, dtype: str
) -> None:
    """On every sheet and in every dimension the search agrees with NumPy's, ties (coarse codes) included."""
    rng = np.random.default_rng(seed)
    draw = (lambda *shape: rng.integers(0, 2, shape)) if coarse else (lambda *shape: rng.normal(size=shape))
    codebook, samples = draw(rows * columns, dims).astype(dtype), draw(3, dims).astype(dtype)
    sheet, found = Sheet.of(codebook, columns), np.empty(3, dtype=np.int64)
    distances = np.sqrt(((samples[:, None].astype(float) - codebook) ** 2).sum(axis=2))
    winners(sheet.codes, sheet.columns, samples, found)
    if coarse:
        np.testing.assert_array_equal(found, distances.argmin(axis=1))
    rounding = 20 * float(np.finfo(dtype).eps)
    np.testing.assert_allclose(distances[range(3), found], distances.min(axis=1), rtol=rounding)
    unit, distance = nearest(sheet.codes, sheet.columns, False, samples)
    assert unit == found[0]
    assert distance == pytest.approx(distances[0].min(), rel=rounding)


def sheet_distances(codebook: NDArray[np.float64], columns: int, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """What the kernel says of one input, unit by unit."""
    sheet = Sheet.of(codebook, columns)
    padded = np.zeros(len(sheet.codes), x.dtype)
    read_sample(x[None], 0, padded)
    squared_distances(sheet.codes.reshape(len(sheet.codes), -1), padded, len(x), sheet.work)
    lanes: NDArray[np.float64] = sheet.work.reshape(-1, sheet.codes.shape[2])[:, :columns].ravel()
    return np.sqrt(lanes)


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 20), sizes, some_dims, seeds, either_precision, st.data())
def test_distances_leave_out_what_is_missing(
    rows: int, columns: int, dims: int, seed: int, dtype: str, data: st.DataObject
) -> None:
    """They are those of scikit-learn, whatever coordinates are missing, as long as one was observed."""
    rng = np.random.default_rng(seed)
    codebook, x = rng.normal(size=(rows * columns, dims)).astype(dtype), rng.normal(size=dims).astype(dtype)
    absent = data.draw(st.sets(st.integers(0, dims - 1), max_size=dims - 1))
    x[list(absent)] = np.nan
    expected = nan_euclidean_distances(x[None].astype(float), codebook.astype(float))[0]
    atol = 1e-6 if dtype == "float64" else 1e-4  # scikit-learn subtracts squares, which costs half of the digits
    np.testing.assert_allclose(sheet_distances(codebook, columns, x), expected, atol=atol)


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 500), seeds, either_precision, st.booleans())
def test_least_and_greatest_are_found_by_their_bits(size: int, seed: int, dtype: str, coarse: bool) -> None:
    """The first of the least, and the greatest, of values of all sizes, 0 and infinity among them."""
    rng = np.random.default_rng(seed)
    values = rng.integers(0, 3, size) if coarse else 10.0 ** rng.uniform(-37, 37, size)
    values = values.astype(dtype)
    values[rng.random(size) < 0.1] = np.inf
    values[rng.random(size) < 0.1] = 0.0
    assert first_least(values) == values.argmin()
    assert least_and_greatest(values) == (values.argmin(), values.max())


def test_a_sample_that_is_read_ends_in_zeros() -> None:
    """It gets the dimensions that the codes have, and the samples stay as they are."""
    samples, x = np.ones((2, 5)), np.zeros(8)
    read_sample(samples, 1, x)
    np.testing.assert_array_equal(x, [1.0] * 5 + [0.0] * 3)
    x[:] = 9.0
    assert (samples == 1.0).all()


def test_lanes_are_counted_back_to_units() -> None:
    """In rows of 20 units and 32 lanes, the second unit of the third row is number 41."""
    assert unit_at(2 * 32 + 1, 32, 20) == 41


@pytest.mark.parametrize("dtype", PRECISIONS)
def test_an_unusable_input_has_no_winner(dtype: str) -> None:
    """The answer is unit -1."""
    sheet = Sheet.of(np.zeros((6, 2), dtype), 3)
    for missing, x in ((False, [0.0, np.nan]), (True, [np.nan, np.nan]), (True, [np.inf, np.nan])):
        assert nearest(sheet.codes, 3, missing, np.array([x], dtype)) == (-1, 0.0)
