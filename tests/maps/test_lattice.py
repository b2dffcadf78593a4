"""Lattice shapes and the kernels' layout of a codebook."""

from __future__ import annotations

import numpy as np
import pytest

from somatopy.maps import DSOM
from somatopy.maps.kernels import LANES
from somatopy.maps.lattice import Sheet, check_shape


@pytest.mark.parametrize("shape", [(30, 30), [8, 5], (7,), (7, 1), (1, 7), np.array([4, 4])])
def test_shapes_of_one_and_two_axes_are_taken(shape: object) -> None:
    """Any sequence of one or two whole numbers is a lattice."""
    assert check_shape(shape) == tuple(shape)  # type: ignore[arg-type, call-overload]


@pytest.mark.parametrize("shape", [(), (0, 3), (3, -1), (2, 2, 2), (2.5, 2), 9, "ab", None])
def test_other_shapes_are_refused_by_name(shape: object) -> None:
    """The message repeats the shape and gives a valid one."""
    with pytest.raises(ValueError, match=r"shape must be one or two whole numbers.*such as \(30, 30\)"):
        check_shape(shape)  # type: ignore[arg-type]


@pytest.mark.parametrize("shape", [(30, 30), (3, 17), (5,), (5, 1), (1, 5), (1, 1), (4, LANES)])
@pytest.mark.parametrize("dims", [1, 2, 3, 4, 6])
def test_layout_gives_the_codebook_back(shape: tuple[int, ...], dims: int) -> None:
    """Laying out and reading back are inverse, unit by unit."""
    codebook = np.random.default_rng(0).random((int(np.prod(shape)), dims))
    sheet = Sheet.of(codebook, shape)
    np.testing.assert_array_equal(sheet.codebook, codebook)
    assert sheet.codes.shape[2] % LANES == 0


def test_codebook_and_padded_samples_are_copies() -> None:
    """Neither reading the codes nor padding inputs lets a caller reach into the map."""
    sheet = Sheet.of(np.zeros((6, 2)), (2, 3))
    samples = np.ones((4, 2))
    sheet.codebook[:] = 9.0
    sheet.padded(samples)[:] = 9.0
    assert not sheet.codebook.any()
    assert (samples == 1.0).all()


@pytest.mark.parametrize("shape", [(3, 20), (4, 5), (7,), (6, 1)])
def test_the_code_of_a_unit_is_its_row_of_the_codebook_and_a_copy(shape: tuple[int, ...]) -> None:
    """Reading one code and reading all agree, and writing to what was read changes nothing."""
    dsom = DSOM(shape=shape, random_state=0).initialise(3)
    codebook = dsom.codebook_
    for unit in range(len(codebook)):
        code = dsom.code(unit)
        assert (code == codebook[unit]).all()
        code[:] = 9.0
    assert (dsom.codebook_ == codebook).all()
