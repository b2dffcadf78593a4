"""The kernels' layout of a codebook."""

from __future__ import annotations

import numpy as np
import pytest

from somatopy.maps import DSOM, SOM, NeuralGas
from somatopy.maps.kernels import LANES, padded_dims
from somatopy.maps.sheet import Sheet


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize(
    ("rows", "columns"), [(30, 30), (3, 17), (1, 5), (5, 1), (1, 1), (4, LANES), (2, LANES + 1), (24, 4)]
)
@pytest.mark.parametrize("dims", [1, 2, 3, 4, 6])
def test_layout_gives_the_codebook_back(rows: int, columns: int, dims: int, dtype: str) -> None:
    """Laying out and reading back are inverse, unit by unit; dimensions and lanes fill whole steps."""
    codebook = np.random.default_rng(0).random((rows * columns, dims)).astype(dtype)
    sheet = Sheet.of(codebook, columns)
    np.testing.assert_array_equal(sheet.codebook, codebook)
    assert sheet.codebook.dtype == sheet.codes.dtype == dtype
    assert sheet.codes.shape[:2] == (padded_dims(dims), rows)
    assert sheet.codes.shape[2] % LANES == 0


@pytest.mark.parametrize("columns", [3, LANES, LANES + 5])
def test_spare_lanes_are_copies_of_the_last_column_and_spare_dims_are_0(columns: int) -> None:
    """So that the spare lanes tie with a unit that comes before them, and no distance is another."""
    sheet = Sheet.of(np.random.default_rng(0).random((2 * columns, 3)), columns)
    assert (sheet.codes[:, :, columns:] == sheet.codes[:, :, columns - 1 : columns]).all()
    assert not sheet.codes[3:].any()


def test_the_codebook_of_a_sheet_is_a_copy() -> None:
    """Reading codes does not let a caller reach into the map."""
    sheet = Sheet.of(np.zeros((6, 2)), 3)
    sheet.codebook[:] = 9.0
    assert not sheet.codebook.any()


@pytest.mark.parametrize("make", [SOM, DSOM])
@pytest.mark.parametrize("shape", [(3, 20), (4, 5), (7,), (6, 1), (2, 3, 4), (2, 3, 1, 2)])
def test_units_have_the_numbers_of_their_lattice(make: type[SOM | DSOM], shape: tuple[int, ...]) -> None:
    """Codes that are places on the lattice: the unit that wins a place is the unit there."""
    places = np.argwhere(np.ones(shape)).astype(float)
    trained = make(shape=shape, init=places).initialise(len(shape))
    np.testing.assert_array_equal(trained.topology_.places, places)
    np.testing.assert_array_equal(trained.predict(places), np.arange(len(places)))
    for unit, place in enumerate(places):
        assert trained.winner(place) == (unit, 0.0)
        np.testing.assert_array_equal(trained.code(unit), place)


@pytest.mark.parametrize("counter", ["samples_seen"])
def test_counters_of_a_restored_state_are_numbers_from_0_up(counter: str) -> None:
    """A state that was tampered with is refused by name."""
    gas = NeuralGas(units=4, random_state=0).initialise(2)
    with pytest.raises(ValueError, match="counters of a NeuralGas are numbers from 0 up; got"):
        gas.restore(gas.state() | {counter: -1})


def test_the_lattice_is_known_before_learning() -> None:
    """It follows from the parameters."""
    assert SOM(shape=[4, 3], lattice="hexagonal").topology_.units == 12
