"""The kernels' sizes and their winner search."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from somatopy.maps.kernels import LANES, LARGEST, all_usable, nearest, padded_dims, winners, work_size
from somatopy.maps.lattice import Sheet


@pytest.mark.parametrize(("dims", "padded"), [(1, 2), (2, 2), (3, 4), (4, 4), (5, 8), (8, 8), (9, 12)])
def test_dims_fill_whole_steps(dims: int, padded: int) -> None:
    """Kernels work through 2 dimensions, or 4 at a time."""
    assert padded_dims(dims) == padded


def test_work_holds_every_part() -> None:
    """Distances of all lanes, two rows of lanes and one value a row find room."""
    assert work_size(3, LANES) == 3 * LANES + 2 * LANES + 3


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 10 * LARGEST])
def test_unusable_values_are_found_anywhere(value: float) -> None:
    """One bad value in any place is enough."""
    for place in np.ndindex(3, 2):
        samples = np.zeros((3, 2))
        samples[place] = value
        assert not all_usable(samples)
    assert all_usable(np.full((3, 2), -LARGEST))


@given(
    st.integers(1, 40),
    st.integers(1, 40),
    st.sampled_from([1, 2, 3, 4, 5, 8, 11]),
    st.integers(0, 2**32),
    st.booleans(),
)
def test_winner_is_the_first_of_the_nearest(rows: int, columns: int, dims: int, seed: int, coarse: bool) -> None:
    """On every lattice and in every dimension the search agrees with NumPy's, ties (coarse codes) included."""
    rng = np.random.default_rng(seed)
    codebook = rng.integers(0, 2, (rows * columns, dims)) / 1.0 if coarse else rng.normal(size=(rows * columns, dims))
    samples = rng.integers(0, 2, (3, dims)) / 1.0 if coarse else rng.normal(size=(3, dims))
    sheet = Sheet.of(codebook, (rows, columns))
    distances = np.sqrt(((samples[:, None] - codebook) ** 2).sum(axis=2))
    found = np.empty(3, dtype=np.int64)
    winners(sheet.codes, sheet.columns, sheet.work, sheet.padded(samples), found)
    unit, distance = nearest(sheet.codes, sheet.columns, sheet.work, sheet.padded(samples))
    assert unit == found[0]
    assert distance == pytest.approx(distances[0].min(), rel=1e-14)
    np.testing.assert_array_equal(found, distances.argmin(axis=1))
