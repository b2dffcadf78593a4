"""Lattices against plain geometry: positions, images of periodic ones, and edges counted by formula."""

from __future__ import annotations

from itertools import product
from math import prod, sqrt
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from somatopy.maps import Lattice
from somatopy.maps.lattice import check_shape

Floats = NDArray[np.float64]

SHAPES = [(7,), (1,), (2,), (6, 5), (1, 9), (9, 1), (2, 2), (3, 4, 5), (4, 1, 3), (2, 3, 3, 4)]
RECTANGULAR = [Lattice(shape, periodic=periodic) for shape in SHAPES for periodic in (False, True)]
HEXAGONAL = [
    *(Lattice(shape, "hexagonal") for shape in [(6, 5), (5, 6), (1, 6), (7, 1), (2, 2), (1, 1), (3, 9)]),
    *(Lattice(shape, "hexagonal", periodic=True) for shape in [(6, 5), (4, 4), (2, 5), (8, 3), (2, 2), (4, 1)]),
]
LATTICES = [*RECTANGULAR, *HEXAGONAL]
every_lattice = pytest.mark.parametrize("lattice", LATTICES, ids=str)


def measured(lattice: Lattice) -> Floats:
    """Distance between any two units: the least to any image of the other, a lattice's length away along each axis."""
    row_height = sqrt(3) / 2 if lattice.kind == "hexagonal" else 1.0
    places = np.array(list(product(*map(range, lattice.shape))), dtype=float)
    if lattice.kind == "hexagonal":
        places = np.array([(row * row_height, column + row % 2 / 2) for row, column in places])
    lengths = np.array([lattice.shape[0] * row_height, *lattice.shape[1:]])
    turns = product((-1, 0, 1), repeat=len(lattice.shape)) if lattice.periodic else [(0,) * len(lattice.shape)]
    images = [np.linalg.norm(places[:, None] - places - np.array(turn) * lengths, axis=2) for turn in turns]
    least: Floats = np.min(images, axis=0)
    return least


def distances(lattice: Lattice) -> Floats:
    """The same, as the lattice tells it."""
    return np.array([lattice.distances(unit) for unit in range(lattice.units)])


@every_lattice
def test_distances_are_those_to_the_nearest_image(lattice: Lattice) -> None:
    """Euclidean, in cells, over borders that touch."""
    np.testing.assert_allclose(distances(lattice), measured(lattice), atol=1e-12)


@every_lattice
def test_units_are_numbered_row_by_row(lattice: Lattice) -> None:
    """The last axis runs fastest; places and positions are in that order."""
    assert lattice.units == prod(lattice.shape)
    assert lattice.places.tolist() == [list(place) for place in np.ndindex(*lattice.shape)]
    if lattice.kind == "rectangular":
        np.testing.assert_array_equal(lattice.positions, lattice.places)


def test_odd_rows_of_a_hexagonal_lattice_are_shifted_by_half_a_cell() -> None:
    """Rows are the square root of 3/4 apart."""
    expected = [(0, 0), (0, 1), (sqrt(0.75), 0.5), (sqrt(0.75), 1.5), (2 * sqrt(0.75), 0), (2 * sqrt(0.75), 1)]
    np.testing.assert_allclose(Lattice((3, 2), "hexagonal").positions, expected)


@every_lattice
def test_edges_join_exactly_the_units_one_cell_apart(lattice: Lattice) -> None:
    """Each pair once, the lower number first."""
    near = np.argwhere(np.triu(np.abs(measured(lattice) - 1) < 1e-9))
    np.testing.assert_array_equal(lattice.edges, near)


@pytest.mark.parametrize("shape", SHAPES)
def test_rectangular_edges_are_counted_by_formula(shape: tuple[int, ...]) -> None:
    """Open, an axis of n units has n - 1 edges in each of its lines; closed it has n, of 2 units 1, of 1 unit 0."""
    lines = [prod(shape) // n for n in shape]
    assert len(Lattice(shape).edges) == sum(line * (n - 1) for line, n in zip(lines, shape, strict=True))
    closed = sum(line * (n if n > 2 else n - 1) for line, n in zip(lines, shape, strict=True))
    assert len(Lattice(shape, periodic=True).edges) == closed


@pytest.mark.parametrize(("rows", "columns"), [(6, 5), (5, 6), (3, 9), (2, 3), (10, 4)])
def test_hexagonal_edges_are_counted_by_formula(rows: int, columns: int) -> None:
    """Open, rows hold columns - 1 edges, and 2 columns - 1 lie between two rows; closed, each unit has six."""
    open_edges = rows * (columns - 1) + (rows - 1) * (2 * columns - 1)
    assert len(Lattice((rows, columns), "hexagonal").edges) == open_edges
    if rows % 2 == 0 and rows > 2:
        assert len(Lattice((rows, columns), "hexagonal", periodic=True).edges) == 3 * rows * columns


@pytest.mark.parametrize("lattice", [lattice for lattice in HEXAGONAL if min(lattice.shape) > 2], ids=str)
def test_a_hexagonal_unit_inside_has_six_neighbours_at_distance_1(lattice: Lattice) -> None:
    """All six directions are 60 degrees apart; without borders each unit is inside."""
    inside = np.ones(lattice.units, dtype=bool)
    if not lattice.periodic:
        inside = ((lattice.places > 0) & (lattice.places < np.array(lattice.shape) - 1)).all(axis=1)
    for unit in np.flatnonzero(inside):
        neighbours = np.flatnonzero(lattice.adjacent(unit, np.arange(lattice.units)))
        assert len(neighbours) == 6
        np.testing.assert_allclose(lattice.distances(unit)[neighbours], 1.0)
        if not lattice.periodic:
            away = lattice.positions[neighbours] - lattice.positions[unit]
            angles = np.sort(np.degrees(np.arctan2(*away.T)))
            np.testing.assert_allclose(np.diff(angles), 60.0)


@every_lattice
def test_adjacent_units_touch(lattice: Lattice) -> None:
    """The six of a hexagonal lattice; corners too on a rectangular one: no axis more than one step away."""
    pairs = np.array(list(product(range(lattice.units), repeat=2))).T
    adjacent = lattice.adjacent(*pairs)
    if lattice.kind == "hexagonal":
        expected = np.abs(measured(lattice)[tuple(pairs)] - 1) < 1e-9
    else:
        wrap = [(-n, 0, n) if lattice.periodic else (0,) for n in lattice.shape]
        steps = lattice.places[pairs[0]] - lattice.places[pairs[1]]
        farthest = np.min([np.abs(steps + turn).max(axis=1) for turn in np.array(list(product(*wrap)))], axis=0)
        expected = farthest == 1
    np.testing.assert_array_equal(adjacent, expected)
    assert lattice.adjacent(*lattice.edges.T).all()


def by_geometry(lattice: Lattice, normalised: bool) -> Floats:
    """Distances between any two units, from what the kernels are given."""
    geometry = lattice.geometry(normalised=normalised)
    counts = geometry[:, 0].astype(int)
    places = np.indices(counts).reshape(len(counts), -1).T.astype(float)
    places[:, -1] += geometry[-1, 3] * (places[:, 0] % 2)
    steps = np.abs(places[:, None] - places)
    steps = np.where(geometry[:, 2] > 0, np.minimum(steps, geometry[:, 0] - steps), steps)
    apart: Floats = np.linalg.norm(steps * geometry[:, 1], axis=2)
    return apart


@every_lattice
def test_geometry_reproduces_distances_and_numbers(lattice: Lattice) -> None:
    """The kernels measure what the lattice does, unit by unit."""
    np.testing.assert_allclose(by_geometry(lattice, False), distances(lattice), atol=1e-12)


@every_lattice
def test_normalised_the_farthest_units_are_1_apart(lattice: Lattice) -> None:
    """A hexagonal lattice keeps its shape; each axis of a rectangular one counts alike."""
    normalised = by_geometry(lattice, True)
    if lattice.units > 1:
        assert normalised.max() == pytest.approx(1.0)
    if lattice.kind == "hexagonal":
        np.testing.assert_allclose(normalised * max(distances(lattice).max(), 1.0), distances(lattice), atol=1e-12)
    else:
        along = [
            normalised[0, [np.ravel_multi_index(place, lattice.shape) for place in line]].max()
            for line in lines_from_the_first_unit(lattice.shape)
        ]
        np.testing.assert_allclose(along, 1 / sqrt(max(len(along), 1)))


def lines_from_the_first_unit(shape: tuple[int, ...]) -> list[list[tuple[int, ...]]]:
    """Places along each axis of more than one unit."""
    return [
        [tuple(i if k == axis else 0 for k in range(len(shape))) for i in range(n)]
        for axis, n in enumerate(shape)
        if n > 1
    ]


@pytest.mark.parametrize("shape", [(30, 30), [8, 5], (7,), (7, 1), np.array([4, 4]), (2, 3, 4), (2, 2, 2, 2)])
def test_shapes_of_one_to_four_axes_are_taken(shape: Any) -> None:
    """Any sequence of whole numbers is made a tuple of ints."""
    assert check_shape(shape) == tuple(shape) == Lattice(shape).shape
    assert all(type(n) is int for n in Lattice(shape).shape)


@pytest.mark.parametrize("shape", [(), (0, 3), (3, -1), (2,) * 5, (2.5, 2), 9, "ab", None, ((2, 2), 2), np.eye(2)])
def test_other_shapes_are_refused_by_name(shape: Any) -> None:
    """The message repeats the shape and gives a valid one."""
    with pytest.raises(ValueError, match=r"shape must be one to four whole numbers.*such as \(30, 30\); got "):
        Lattice(shape)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (((3, 3), "hex"), r"unknown lattice 'hex'; valid lattices: \['rectangular', 'hexagonal'\]"),
        (((3, 3), "rectangular", 1), "periodic must be True or False; got 1"),
        (((9,), "hexagonal"), r"a hexagonal lattice has two axes; got shape \(9,\)"),
        (((3, 3, 3), "hexagonal"), r"a hexagonal lattice has two axes; got shape \(3, 3, 3\)"),
        (((3, 4), "hexagonal", True), r"needs an even number of rows; got shape \(3, 4\)"),
    ],
)
def test_what_does_not_fit_is_refused_by_name(arguments: tuple[Any, ...], message: str) -> None:
    """The message has the value and what is valid."""
    with pytest.raises(ValueError, match=message):
        Lattice(*arguments)
