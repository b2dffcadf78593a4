"""Start codes from a table."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from sklearn.decomposition import PCA

from somatopy.maps import SOM, Lattice, NeuralGas
from somatopy.maps.first_codes import filled, first_codes

RNG = np.random.default_rng(0)
TABLE = RNG.normal(size=(300, 5)) * [5.0, 3.0, 1.0, 0.5, 0.1] + 7.0
TABLE = TABLE @ np.linalg.qr(RNG.normal(size=(5, 5)))[0]


def codes(init: Any, units: Any, table: Any = TABLE, bounds: Any = None) -> Any:
    return first_codes(init, bounds, units, np.asarray(table), np.random.default_rng(1))


@pytest.mark.parametrize("shape", [(4, 6), (6, 4)])
@pytest.mark.parametrize("table", [TABLE, np.pad(TABLE, ((0, 0), (0, 600)))], ids=["exact", "wide"])
def test_pca_codes_are_a_lattice_in_the_plane_of_greatest_variance(shape: tuple[int, int], table: Any) -> None:
    """In scikit-learn's components: a standard deviation to both sides, the longer axis along the first."""
    pca = PCA(5).fit(table)
    along = pca.transform(codes("pca", Lattice(shape), table)) / np.sqrt(pca.explained_variance_ * 299 / 300)
    np.testing.assert_allclose(along[:, 2:], 0, atol=1e-3)
    np.testing.assert_allclose(np.abs(along[:, :2]).max(axis=0), 1, atol=1e-3)
    assert [len(np.unique(along[:, k].round(3))) for k in (0, 1)] == [6, 4]


def test_pca_codes_of_a_ring_are_a_ring() -> None:
    """An axis whose ends touch is a circle in the plane: each unit as far from the mean, neighbours as far apart."""
    pca = PCA(2).fit(TABLE)
    along = pca.transform(codes("pca", Lattice((12,), periodic=True))) / np.sqrt(pca.explained_variance_ * 299 / 300)
    np.testing.assert_allclose(np.linalg.norm(along, axis=1), 1)
    np.testing.assert_allclose(np.linalg.norm(along - np.roll(along, 1, axis=0), axis=1), 2 * np.sin(np.pi / 12))


@pytest.mark.parametrize(
    "lattice", [Lattice((3, 4)), Lattice((4, 4), "hexagonal", True), Lattice((1,)), Lattice((2, 1))]
)
@pytest.mark.parametrize("table", [np.ones((1, 3)), np.ones((9, 2)), np.arange(5.0)[:, None]])
def test_pca_codes_of_what_does_not_vary_in_a_plane_are_finite(lattice: Lattice, table: Any) -> None:
    """One row, equal rows and one column are laid out as far as they go."""
    found = codes("pca", lattice, table)
    assert found.shape == (lattice.units, table.shape[1]) and np.isfinite(found).all()
    assert (found >= table.min() - 1).all() and (found <= table.max() + 1).all()


@pytest.mark.parametrize("rows", [5, 50, 104, 150])
@pytest.mark.parametrize("shape", [(64,), (4, 6)])
def test_pca_codes_of_what_varies_alike_in_all_directions(rows: int, shape: tuple[int, ...]) -> None:
    """As one-hot columns do: any direction is one of greatest variance, and codes go a standard deviation along it."""
    table = np.eye(rows)
    found = codes("pca", Lattice(shape), table) - table.mean(axis=0)
    ends = np.sqrt(len(shape) / rows)  # of a line; of the corners of a square
    assert np.linalg.norm(found, axis=1).max() == pytest.approx(ends)
    np.testing.assert_allclose(found.sum(axis=1), 0, atol=1e-9)  # rows sum to 1, and so do codes


@pytest.mark.parametrize("units", [10, 300, 700])
def test_sampled_codes_are_rows_each_as_often(units: int) -> None:
    """No row twice before each has been taken."""
    rows, counts = np.unique(codes("sample", units), axis=0, return_counts=True)
    assert len(rows) == min(units, 300) and np.ptp(counts) <= 1
    assert (rows[:, None] == TABLE).all(axis=2).any(axis=1).all()


def test_uniform_codes_lie_in_the_ranges_of_the_table() -> None:
    """Or within bounds, if they are given; without a table from 0 to 1."""
    found = codes("uniform", 500)
    assert (found >= TABLE.min(axis=0)).all() and (found <= TABLE.max(axis=0)).all()
    np.testing.assert_allclose(np.ptp(found, axis=0), np.ptp(TABLE, axis=0), rtol=0.05)
    for table, bounds, low, high in ((TABLE, (-2, -1), -2, -1), (TABLE[:0], None, 0, 1)):
        found = codes("uniform", 500, table, bounds)
        assert low <= found.min() < low + 0.05 and high - 0.05 < found.max() <= high


def test_auto_knows_what_there_is() -> None:
    """A lattice and a table: pca; a table: sample; no table: uniform."""
    lattice = Lattice((3, 4))
    for meant, units, table in (("pca", lattice, TABLE), ("sample", 12, TABLE), ("uniform", lattice, TABLE[:0])):
        np.testing.assert_array_equal(codes("auto", units, table), codes(meant, units, table))


def test_what_is_missing_has_the_mean_of_its_column() -> None:
    """And a column of which nothing is known is 0."""
    np.testing.assert_array_equal(
        filled(np.array([[1.0, np.nan, 2.0], [3.0, np.nan, np.nan]])), [[1.0, 0.0, 2.0], [3.0, 0.0, 2.0]]
    )
    gappy = np.where(np.random.default_rng(2).random(TABLE.shape) < 0.1, np.nan, TABLE)
    assert np.isfinite(SOM(shape=(3, 3), missing="ignore", epochs=1).fit(gappy).codebook_).all()


@pytest.mark.parametrize("start", [lambda som: som.initialise(2), lambda som: som.learn_one([0.1, 0.2])])
@pytest.mark.parametrize("init", ["pca", "sample"])
def test_codes_of_a_table_need_a_table(start: Any, init: str) -> None:
    """The error says what to call, or how to make the map."""
    with pytest.raises(ValueError, match=rf"init='{init}' takes the start codes from a table.*Call fit\(X\) first, or"):
        start(SOM(shape=(2, 2), init=init))
    with pytest.raises(ValueError, match=r"init must be one of \['auto', 'sample', 'uniform'\].*got 'pca'"):
        NeuralGas(4, init="pca").fit(TABLE)
