"""Pictures of maps: the numbers that are drawn and where, not how they look."""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Callable, Generator
from functools import cache
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib import pyplot
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.path import Path
from mpl_toolkits.mplot3d import proj3d  # type: ignore[import-untyped]
from numpy.typing import NDArray
from sklearn.exceptions import NotFittedError

from somatopy.maps import DSOM, SOM, EvolvingSOM, Graph, GrowingNeuralGas, GrowWhenRequired, Lattice, Map, NeuralGas
from somatopy.maps.pictures import (
    NONE,
    codebook,
    component_plane,
    component_planes,
    growth,
    hit_map,
    hit_maps,
    u_matrix,
)
from somatopy.maps.quality import History, follow, winner_counts

Floats = NDArray[np.float64]
INPUTS = np.random.default_rng(7).random((600, 3))
ROW = np.sqrt(3) / 2


class Joined(Map):
    """A map that does not learn: codes and edges as given."""

    def __init__(self, codes: Any, edges: Any) -> None:
        self.codes, self.edges = codes, edges
        self.dtype, self.missing, self.random_state = "float64", "error", None

    @property
    def topology_(self) -> Graph:
        return Graph(len(self.codes), self.edges)

    def _start(self, dims: int, rng: np.random.Generator) -> dict[str, Any]:
        return {"codebook": np.array(self.codes, dtype=float)}

    def _step(self, x: Any) -> int:
        return int(self._distances(x[None]).argmin())


def still(codes: Any, shape: tuple[int, ...], lattice: str = "rectangular", periodic: bool = False) -> SOM:
    """A SOM that has learned nothing: codes as given."""
    codes = np.array(codes, dtype=float).reshape(int(np.prod(shape)), -1)
    som: SOM = SOM(shape=shape, lattice=lattice, periodic=periodic, init=codes).initialise(codes.shape[1])
    return som


def unjoined(codes: Any) -> NeuralGas:
    codes = np.array(codes, dtype=float)
    gas: NeuralGas = NeuralGas(units=len(codes), init=codes).initialise(codes.shape[1])
    return gas


def joined(codes: Any, edges: Any) -> Joined:
    made: Joined = Joined(codes, edges).initialise(np.shape(codes)[1])
    return made


def plane() -> Any:
    return Figure().add_subplot()


def space() -> Any:
    return Figure().add_subplot(projection="3d")


def drawn(axes: Any) -> Any:
    """What was drawn last."""
    return axes.collections[-1]


def values(axes: Any) -> Floats:
    return np.asarray(drawn(axes).get_array())


def lines(axes: Any) -> list[Any]:
    return [found for found in axes.collections if isinstance(found, LineCollection)]


def finished(axes: Any) -> Any:
    """The axes as they are in the finished picture."""
    axes.figure.draw_without_rendering()
    return axes


def ordered(rows: Any) -> Floats:
    """Rows in an order that does not depend on the one they had; in space matplotlib sorts by depth."""
    table = np.asarray(rows, dtype=float).round(9).reshape(len(rows), -1)
    return table[np.lexsort(table.T)]


@pytest.fixture(autouse=True)
def every_warning_is_an_error() -> Generator[None, None, None]:
    """And what pyplot opened is closed."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield
    pyplot.close("all")


SHAPES = [
    ((5,), "rectangular", False),
    ((5,), "rectangular", True),
    ((1, 4), "rectangular", False),
    ((4, 1), "rectangular", False),
    ((3, 4), "rectangular", False),
    ((2, 3), "rectangular", True),
    ((4, 5), "rectangular", True),
    ((5, 4), "hexagonal", False),
    ((4, 3), "hexagonal", True),
]
every_shape = pytest.mark.parametrize(("shape", "kind", "periodic"), SHAPES)
GRIDS = [(shape, kind) for shape, kind, _ in SHAPES if min(len(shape), *shape) > 1]
every_grid = pytest.mark.parametrize(("shape", "kind"), [*dict.fromkeys(GRIDS)])

KINDS: dict[str, Callable[[], Map]] = {
    "SOM": lambda: SOM(shape=(4, 5), random_state=0),
    "hexagons": lambda: SOM(shape=(4, 5), lattice="hexagonal", random_state=0),
    "torus": lambda: SOM(shape=(4, 5), periodic=True, random_state=0),
    "chain": lambda: SOM(shape=(9,), random_state=0),
    "cube": lambda: SOM(shape=(2, 3, 4), random_state=0),
    "DSOM": lambda: DSOM(shape=(4, 5), elasticity=1.5, random_state=0),
    "single": lambda: SOM(shape=(4, 5), dtype="float32", missing="ignore", random_state=0),
    "GrowingNeuralGas": lambda: GrowingNeuralGas(max_units=30, insert_every=20, random_state=0),
    "GrowWhenRequired": lambda: GrowWhenRequired(max_units=30, random_state=0),
    "EvolvingSOM": lambda: EvolvingSOM(threshold=0.3),
    "NeuralGas": lambda: NeuralGas(units=20, random_state=0),
}
every_kind = pytest.mark.parametrize("kind", KINDS)


@cache
def learned(kind: str) -> Any:
    """One for all tests: no picture changes a map, as one of them shows."""
    return KINDS[kind]().partial_fit(INPUTS)


# U-matrix


@pytest.mark.parametrize(
    ("codes", "shape", "kind", "periodic", "expected"),
    [
        ([0, 1, 3, 7], (4,), "rectangular", False, [[1, 3 / 2, 6 / 2, 4]]),
        ([0, 1, 3, 7], (4,), "rectangular", True, [[8 / 2, 3 / 2, 6 / 2, 11 / 2]]),
        (
            [0, 1, 3, 10, 14, 20],
            (2, 3),
            "rectangular",
            False,
            [[(1 + 10) / 2, (1 + 2 + 13) / 3, (2 + 17) / 2], [(10 + 4) / 2, (4 + 13 + 6) / 3, (6 + 17) / 2]],
        ),
        # 0 1    each touches the one beside it; the second row is shifted to the right,
        #  2 3   so that 1 and 2 touch, 0 and 3 do not
        ([0, 1, 3, 7], (2, 2), "hexagonal", False, [(1 + 3) / 2, (1 + 2 + 6) / 3, (3 + 2 + 4) / 3, (4 + 6) / 2]),
    ],
)
def test_u_matrix_worked_out_by_hand(codes: Any, shape: Any, kind: str, periodic: bool, expected: Any) -> None:
    """Each cell has the mean distance from its neighbours' codes: on a strip, a ring, squares and hexagons."""
    assert values(u_matrix(still(codes, shape, kind, periodic), plane())) == pytest.approx(np.array(expected))


@every_shape
def test_u_matrix_is_the_mean_over_units_one_cell_away(shape: Any, kind: str, periodic: bool) -> None:
    """In three dimensions, on all lattices, without asking them for their edges."""
    lattice = Lattice(shape, kind, periodic)
    codes = np.random.default_rng(0).random((lattice.units, 3))
    near = [np.abs(lattice.distances(unit) - 1) < 1e-9 for unit in range(lattice.units)]
    means = [np.linalg.norm(codes[near[unit]] - codes[unit], axis=1).mean() for unit in range(lattice.units)]
    assert values(u_matrix(still(codes, shape, kind, periodic), plane())).ravel() == pytest.approx(np.array(means))


def test_u_matrix_of_a_graph_has_an_edges_length_in_all_dimensions() -> None:
    """Each edge lies between its units' first two dimensions; its colour is the distance in three."""
    codes, edges = [[0, 0, 0], [3, 4, 12], [0, 4, 0], [9, 9, 9]], [(0, 1), (0, 2)]
    (found,) = lines(u_matrix(joined(codes, edges), plane()))
    assert np.array(found.get_segments()).tolist() == [[[0, 0], [3, 4]], [[0, 0], [0, 4]]]
    assert found.get_array().tolist() == [13, 4]


def test_no_edge_of_a_u_matrix_is_cut_off() -> None:
    """All ends are within the limits."""
    axes = u_matrix(joined([[5, 5], [9, 7]], [(0, 1)]), plane())
    assert axes.get_xlim()[0] <= 5 < 9 <= axes.get_xlim()[1]
    assert axes.get_ylim()[0] <= 5 < 7 <= axes.get_ylim()[1]


# Component planes


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_a_component_plane_is_one_dimension_in_rows_and_columns(precision: str) -> None:
    """On squares the values are the array that the codes are when reshaped."""
    som = SOM(shape=(4, 5), dtype=precision, random_state=0).partial_fit(INPUTS)
    for dim, axes in enumerate(component_planes(som, Figure().subplots(1, 3))):
        assert (values(axes) == som.codebook_.reshape(4, 5, 3)[:, :, dim]).all()


@every_kind
def test_a_component_plane_has_a_value_for_each_unit(kind: str) -> None:
    """In the order of the units: cells row by row, points as they are numbered."""
    if kind != "cube":
        trained = learned(kind)
        for dim in (0, *np.array([2])):
            assert (values(component_plane(trained, dim, plane())).ravel() == trained.codebook_[:, dim]).all()


def test_component_planes_come_in_the_order_of_the_dimensions() -> None:
    """As many as there are, in the axes that were given, in any array; what is over stays empty."""
    axes = Figure().subplots(2, 2)
    planes = component_planes(learned("SOM"), axes)
    assert planes.shape == (3,)
    assert [*planes] == [*axes.flat[:3]]
    assert [bar.get_ylabel() for bar in axes[0, 0].figure.axes[4:]] == ["dimension 0", "dimension 1", "dimension 2"]
    assert not axes[1, 1].has_data()


def test_the_greatest_value_is_the_brightest() -> None:
    """Brightness grows with the value, from the least to the greatest, so that it is read in grey too."""
    axes = component_plane(still([3, -1, 0, 8, 2], (5,)), 0, plane())
    assert (drawn(axes).norm.vmin, drawn(axes).norm.vmax) == (-1, 8)
    brightness = drawn(axes).to_rgba(values(axes).ravel())[:, :3] @ [0.2126, 0.7152, 0.0722]
    assert (np.argsort(brightness) == np.argsort(values(axes).ravel())).all()


def test_codes_that_are_all_alike_can_be_drawn() -> None:
    """There is then one colour, and no warning."""
    same = still(np.ones((6, 2)), (2, 3))
    for axes in (component_plane(same, 1, plane()), u_matrix(same, plane())):
        colours = drawn(finished(axes)).to_rgba(values(axes)).reshape(6, 4)
        assert (colours == colours[0]).all()


# Hit maps


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "cube"])
def test_a_hit_map_has_the_winners_counts(kind: str) -> None:
    """Cells and points alike; all inputs are counted."""
    trained = learned(kind)
    found = values(hit_map(trained, INPUTS[:40], plane())).ravel()
    assert (found == winner_counts(trained, INPUTS[:40])).all()
    assert found.sum() == 40


@pytest.mark.parametrize("kind", ["SOM", "hexagons", "chain", "NeuralGas", "GrowingNeuralGas"])
def test_only_dead_units_are_grey(kind: str) -> None:
    """They have the colour of what is under the scale, and the label says so; none of the others has it."""
    axes = hit_map(learned(kind), INPUTS[:10], plane())
    grey = (drawn(axes).to_rgba(values(axes)).reshape(-1, 4) == to_rgba(NONE)).all(axis=1)
    assert (grey == (values(axes).ravel() == 0)).all()
    assert grey.any() and not grey.all()
    bar = drawn(axes).colorbar
    assert "inputs won (grey: none)" in (bar.ax.get_ylabel(), bar.ax.get_xlabel())


def test_units_that_all_win_alike_are_not_grey() -> None:
    """One input each: no unit is dead, and nothing is said of grey."""
    axes = hit_map(still([0, 1, 2], (3,)), [[0.0], [1.0], [2.0]], plane())
    assert not (drawn(axes).to_rgba(values(axes)) == to_rgba(NONE)).all(axis=-1).any()
    assert drawn(axes).colorbar.ax.get_xlabel() == "inputs won"


def test_inputs_are_counted_in_whole_numbers() -> None:
    """No mark on the bar says that half an input was won."""
    axes = hit_map(still([0, 1, 2], (3,)), [[0.0], [1.0], [1.0], [1.1]], plane())
    assert all(tick == round(tick) for tick in drawn(axes).colorbar.get_ticks())


def test_units_without_a_place_are_drawn_at_their_codes() -> None:
    """At the first two dimensions of them, edges beneath if there are any."""
    gas, graph = learned("NeuralGas"), learned("GrowingNeuralGas")
    for trained in (gas, graph):
        for axes in (hit_map(trained, INPUTS, plane()), component_plane(trained, 2, plane())):
            assert np.asarray(drawn(axes).get_offsets()) == pytest.approx(trained.codebook_[:, :2])
            assert len(lines(axes)) == (trained is graph)
    (edges,) = lines(hit_map(graph, INPUTS, plane()))
    assert np.array(edges.get_segments()) == pytest.approx(graph.codebook_[graph.topology_.edges][:, :, :2])
    assert edges.get_zorder() < drawn(hit_map(graph, INPUTS, plane())).get_zorder()


# Cells


def cells(shape: tuple[int, ...], kind: str) -> tuple[Any, Lattice, list[Path]]:
    """Axes with one value for each unit, its number, and the outline of each cell."""
    lattice = Lattice(shape, kind)
    axes = component_plane(still(np.arange(lattice.units), shape, kind), 0, plane())
    if kind == "hexagonal":
        return axes, lattice, drawn(axes).get_paths()
    corners = drawn(axes).get_coordinates()
    around = [corners[:-1, :-1], corners[:-1, 1:], corners[1:, 1:], corners[1:, :-1], corners[:-1, :-1]]
    outlines = np.stack(around, axis=2).reshape(-1, 5, 2)
    return axes, lattice, [Path(outline, closed=True) for outline in outlines]


def corners_of(cell: Path) -> Floats:
    return np.unique(np.asarray(cell.vertices).round(9), axis=0)


def area(cell: Path) -> float:
    x, y = np.asarray(cell.vertices).T
    return abs(float(x[:-1] @ y[1:] - x[1:] @ y[:-1])) / 2


@every_grid
def test_cells_lie_where_the_units_do(shape: tuple[int, ...], kind: str) -> None:
    """Their centres are the positions on the lattice, columns to the right and rows along y."""
    _, lattice, found = cells(shape, kind)
    centres = np.array([corners_of(cell).mean(axis=0) for cell in found])
    assert centres == pytest.approx(lattice.positions[:, ::-1])


@every_grid
def test_cells_leave_no_gap_and_do_not_overlap(shape: tuple[int, ...], kind: str) -> None:
    """Each point between the units is in one cell; neighbours' cells share two corners, and areas fit the lattice."""
    _, lattice, found = cells(shape, kind)
    low, high = lattice.positions.min(axis=0) + 0.25, lattice.positions.max(axis=0) - 0.25
    points = np.random.default_rng(0).uniform(low, high, (2000, 2))[:, ::-1]
    assert (np.sum([cell.contains_points(points) for cell in found], axis=0) == 1).all()
    for one, other in lattice.edges:
        gaps = corners_of(found[one])[:, None] - corners_of(found[other])
        assert (np.abs(gaps).max(axis=2) < 1e-6).sum() == 2
    assert [area(cell) for cell in found] == pytest.approx([ROW if kind == "hexagonal" else 1.0] * len(found))


@every_grid
def test_all_cells_are_seen_whole(shape: tuple[int, ...], kind: str) -> None:
    """The limits are those of the outermost cells."""
    axes, _, found = cells(shape, kind)
    corners = np.concatenate([corners_of(cell) for cell in found])
    assert [*axes.get_xlim()] == pytest.approx([corners[:, 0].min(), corners[:, 0].max()])
    assert [*axes.get_ylim()] == pytest.approx([corners[:, 1].max(), corners[:, 1].min()])


@every_grid
def test_row_0_is_on_top(shape: tuple[int, ...], kind: str) -> None:
    """As in an array; drawing twice, or in axes that share theirs, does not turn it over."""
    upper, lower = Figure().subplots(2, sharey=True)
    som = still(np.arange(np.prod(shape)), shape, kind)
    for axes in (upper, lower, lower):
        component_plane(som, 0, axes)
        first, last = axes.transData.transform(Lattice(shape, kind).positions[[0, -1], ::-1])
        assert first[1] > last[1] and first[0] < last[0] + 1


def test_numbers_beside_the_cells_are_rows_and_columns() -> None:
    """Also on hexagons, whose rows are nearer than columns; they start at 0 and end on the lattice."""
    axes = component_plane(still(np.arange(60), (6, 10), "hexagonal"), 0, plane())
    rows = {
        int(label.get_text()): place for label, place in zip(axes.get_yticklabels(), axes.get_yticks(), strict=True)
    }
    assert rows == pytest.approx({row: row * ROW for row in rows})
    assert min(rows) == 0 and max(rows) <= 5
    assert min(axes.get_xticks()) == 0 and max(axes.get_xticks()) <= 9
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("column", "row")


@pytest.mark.parametrize("shape", [(7,), (1, 7)])
def test_a_strip_has_units_side_by_side(shape: tuple[int, ...]) -> None:
    """One row, as wide as the axes, with the units' numbers beneath and nothing to the left."""
    axes = component_plane(still(np.arange(7), shape), 0, plane())
    assert values(axes).tolist() == [[0, 1, 2, 3, 4, 5, 6]]
    assert axes.get_xlabel() == "unit"
    assert len(axes.get_yticks()) == 0
    assert axes.get_xlim() == (-0.5, 6.5)


@every_shape
def test_cells_have_no_frame(shape: Any, kind: str, periodic: bool) -> None:
    """Nor a grid over them, whatever the style says."""
    som = still(np.arange(np.prod(shape)), shape, kind, periodic)
    with pyplot.rc_context({"axes.grid": True}):
        axes = u_matrix(som, plane())
    assert not any(spine.get_visible() for spine in axes.spines.values())
    assert not any(line.get_visible() for line in [*axes.get_xgridlines(), *axes.get_ygridlines()])


# Colour bars


@pytest.mark.parametrize("layout", [None, "constrained", "tight"])
@pytest.mark.parametrize(("kind", "size"), [("hexagons", (9, 2)), ("NeuralGas", (3, 6))])
def test_a_colour_bar_is_as_long_as_what_it_explains(kind: str, layout: Any, size: tuple[int, int]) -> None:
    """And beside it, in wide and in narrow figures of all layouts, also after the caller set other limits."""
    axes = component_plane(learned(kind), 0, Figure(figsize=size, layout=layout).add_subplot())
    for change in ({}, {"xlim": (0, 1), "ylim": (0, 3)}):
        axes.set(**change)
        picture, bar = (box.get_position() for box in (finished(axes), drawn(axes).colorbar.ax))
        assert [*bar.intervaly] == pytest.approx([*picture.intervaly], abs=1e-6)
        assert 0 < (bar.x0 - picture.x1) * size[0] < 1  # inches


@pytest.mark.parametrize("layout", [None, "constrained", "tight"])
def test_the_colour_bar_of_a_strip_is_beneath_it(layout: Any) -> None:
    """And as long."""
    axes = component_plane(learned("chain"), 0, Figure(layout=layout).add_subplot())
    strip, bar = (box.get_position() for box in (finished(axes), drawn(axes).colorbar.ax))
    assert [*bar.intervalx] == pytest.approx([*strip.intervalx])
    assert bar.y1 < strip.y0


def test_a_figure_with_colour_bars_can_be_kept() -> None:
    """By pickle, as matplotlib's figures can."""
    figure = u_matrix(learned("SOM"), plane()).figure
    assert len(pickle.loads(pickle.dumps(figure)).axes) == 2


# Codebooks


def expected_lines(trained: Map, dims: tuple[int, ...]) -> Floats:
    return trained.codebook_.astype(float)[:, list(dims)][trained.topology_.edges]


@every_kind
@pytest.mark.parametrize("dims", [(0, 1), (2, 0)])
def test_a_codebook_in_a_plane_has_points_at_codes_and_lines_for_edges(kind: str, dims: tuple[int, int]) -> None:
    """One point for each unit, one line for each edge between its units' codes; without a topology no lines."""
    trained = learned(kind)
    axes = codebook(trained, plane(), dims=dims)
    assert np.asarray(drawn(axes).get_offsets()) == pytest.approx(trained.codebook_[:, dims])
    if kind == "NeuralGas":
        assert not lines(axes)
    else:
        (found,) = lines(axes)
        assert np.array(found.get_segments()) == pytest.approx(expected_lines(trained, dims))
    assert (axes.get_xlabel(), axes.get_ylabel()) == (f"dimension {dims[0]}", f"dimension {dims[1]}")


@every_kind
def test_a_codebook_in_space_is_seen_where_it_is(kind: str) -> None:
    """In the finished picture points are where the camera sees the codes, lines where it sees both ends."""
    trained, dims = learned(kind), (2, 0, 1)
    axes = finished(codebook(trained, space(), dims=dims))

    def seen(places: Floats) -> Floats:
        x, y, _ = proj3d.proj_transform(*places.reshape(-1, 3).T, axes.get_proj())
        return np.stack([x, y], axis=1).reshape(*places.shape[:-1], 2)

    codes = trained.codebook_.astype(float)[:, dims]
    assert ordered(drawn(axes).get_offsets()) == pytest.approx(ordered(seen(codes)), abs=1e-8)
    if kind == "NeuralGas":
        assert not lines(axes)
    else:
        (found,) = lines(axes)
        assert ordered(found.get_segments()) == pytest.approx(ordered(seen(expected_lines(trained, dims))), abs=1e-8)
    assert axes.get_zlabel() == f"dimension {dims[2]}"


def test_a_graph_without_edges_can_be_drawn() -> None:
    """In a plane and in space: two units, no line."""
    for axes, codes in ((plane(), [[0, 0], [1, 2]]), (space(), [[0, 0, 0], [1, 2, 3]])):
        apart = joined(codes, [])
        finished(codebook(apart, axes, dims=range(len(codes[0]))))
        assert [len(found.get_segments()) for found in lines(axes)] == [0]
        assert (values(hit_map(apart, codes, plane())) == 1).all()


def test_inputs_lie_beneath_the_codes() -> None:
    """In the chosen dimensions; of those with missing values, the ones that have these."""
    holed = INPUTS.copy()
    holed[::2, 0], holed[::3, 1] = np.nan, np.nan
    som = SOM(shape=(4, 4), missing="ignore", random_state=0).partial_fit(holed)
    for dims, axes in (((0, 2), plane()), ((1, 2), plane()), ((2, 1, 0), space())):
        finished(codebook(som, axes, dims=dims, X=holed))
        known = ~np.isnan(holed[:, dims]).any(axis=1)
        inputs = axes.collections[0]
        offsets = np.ma.filled(np.ma.masked_invalid(inputs.get_offsets()), np.nan)
        shown = ~np.isnan(offsets).any(axis=1)
        assert shown.sum() == known.sum()
        if len(dims) == 2:
            assert offsets[shown] == pytest.approx(holed[known][:, dims])
        assert inputs.get_zorder() < lines(axes)[0].get_zorder() < drawn(axes).get_zorder() or len(dims) == 3


def test_what_is_equally_far_is_drawn_so() -> None:
    """In a plane, one unit is as many pixels along y as along x, also once the caller has set limits, and in axes that
    share theirs; nothing is said against it."""
    alone, (left, right) = Figure(figsize=(9, 3)).add_subplot(), Figure().subplots(1, 2, sharex=True, sharey=True)
    for axes in (alone, left, right):
        codebook(learned("SOM"), axes)
        for change in ({}, {"xlim": (0, 5), "ylim": (0, 1), "aspect": "equal"}):
            axes.set(**change)
            origin, right_of, above = finished(axes).transData.transform([(0, 0), (1, 0), (0, 1)])
            assert above[1] - origin[1] == pytest.approx(right_of[0] - origin[0])
    assert alone.get_xlim() == (0, 5) and alone.get_ylim() == (0, 1)


def test_space_is_filled_and_equally_scaled() -> None:
    """A flat map in space: each dimension fills its side of the box, and the sides are as long as they should be."""
    codes = np.random.default_rng(0).random((20, 3)) * [4.0, 2.0, 1.0]
    axes: Any = codebook(still(codes, (4, 5)), space(), dims=(0, 1, 2))
    limits = np.array([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()])
    assert (np.ptp(codes, axis=0) > 0.8 * np.ptp(limits, axis=1)).all()
    axes.set_proj_type("ortho")
    for view, across, up in (((0, -90), 0, 2), ((90, -90), 0, 1), ((0, 0), 1, 2)):
        axes.view_init(*view)
        camera = finished(axes).get_proj()
        seen = [proj3d.proj_transform(*corner, camera) for corner in (np.zeros(3), *np.eye(3))]
        steps = np.array(seen)[1:] - seen[0]
        assert abs(steps[across, 0]) == pytest.approx(abs(steps[up, 1]))


# Growth


def test_growth_draws_what_was_recorded() -> None:
    """Errors above, units below, by inputs; where there was no error yet, nothing."""
    history = follow(GrowingNeuralGas(max_units=20, random_state=0), INPUTS, every=100)
    above, below = growth(history, Figure().subplots(2))
    assert np.array_equal(
        above.lines[0].get_xydata(), np.stack([history.samples, history.error], axis=1), equal_nan=True
    )
    assert (below.lines[0].get_xydata() == np.stack([history.samples, history.units], axis=1)).all()
    assert below.lines[0].get_drawstyle() == "steps-post"
    assert above.get_ylim()[0] == below.get_ylim()[0] == 0
    assert all(tick == round(tick) for tick in below.get_yticks())


def test_error_and_units_have_the_same_inputs_beneath() -> None:
    """In a new figure they share their axis, though there is no error before the first inputs."""
    above, below = growth(follow(SOM(shape=(3, 3), random_state=0), INPUTS, every=200))
    assert above.get_xlim() == below.get_xlim()


def test_a_second_history_has_room_beside_the_first() -> None:
    """Both are seen whole, from 0."""
    axes = Figure().subplots(2)
    for scale in (1, 5):
        growth(History(np.arange(4), scale * np.arange(4), scale * np.linspace(1.0, 0.5, 4)), axes)
    assert axes[0].get_ylim()[0] == axes[1].get_ylim()[0] == 0
    assert axes[0].get_ylim()[1] >= 5 and axes[1].get_ylim()[1] >= 15


# Axes in, axes out

PICTURES: dict[str, Callable[[Any], Any]] = {
    "u_matrix": lambda ax: u_matrix(learned("hexagons"), ax),
    "u_matrix of a graph": lambda ax: u_matrix(learned("GrowingNeuralGas"), ax),
    "component_plane": lambda ax: component_plane(learned("SOM"), 0, ax),
    "hit_map": lambda ax: hit_map(learned("chain"), INPUTS, ax),
    "hit_map of points": lambda ax: hit_map(learned("NeuralGas"), INPUTS, ax),
    "codebook": lambda ax: codebook(learned("SOM"), ax, X=INPUTS),
}
every_picture = pytest.mark.parametrize("picture", PICTURES)


@every_picture
def test_the_axes_given_come_back_and_no_others_are_drawn_in(picture: str) -> None:
    """The very same object; its neighbour stays empty, and pyplot opens no figure."""
    given, other = Figure().subplots(1, 2)
    assert PICTURES[picture](given) is given
    assert given.has_data() and not other.has_data()
    assert {axes.figure for axes in given.figure.axes} == {given.figure}
    assert not pyplot.get_fignums()


@every_picture
def test_without_axes_there_is_a_new_figure(picture: str) -> None:
    """Each time, so that no picture is drawn over another."""
    first, second = PICTURES[picture](None), PICTURES[picture](None)
    assert first.figure is not second.figure
    assert len(pyplot.get_fignums()) == 2
    finished(first)


def test_pictures_of_several_axes_return_those_they_were_given() -> None:
    """Component planes and growth, whatever the axes come in, and codebooks in space."""
    som, history = learned("SOM"), follow(SOM(shape=(2, 2)), INPUTS, every=200)
    ways: list[tuple[int, Callable[[Any], Any]]]
    ways = [(3, lambda axes: component_planes(som, axes)), (2, lambda axes: growth(history, axes))]
    for count, draw in ways:
        given = Figure().subplots(1, count)
        assert [*draw(given)] == [*draw(tuple(given))] == [*given]
    deep = space()
    assert codebook(som, deep, dims=(0, 1, 2)) is deep
    assert not pyplot.get_fignums()


def test_new_figures_have_as_many_axes_as_there_are_pictures() -> None:
    """Three planes and their bars, two curves, one view of space."""
    assert len(component_planes(learned("SOM"))[0].figure.axes) == 6
    assert len(growth(follow(SOM(shape=(2, 2)), INPUTS, every=200))[0].figure.axes) == 2
    assert codebook(learned("SOM"), dims=(0, 1, 2)).name == "3d"


@pytest.mark.parametrize("kind", ["hexagons", "single", "GrowingNeuralGas", "NeuralGas"])
def test_no_picture_changes_the_map(kind: str) -> None:
    """What was learned is bit for bit what it was."""
    trained = learned(kind)
    before = trained.state()
    codebook(trained, plane(), X=INPUTS)
    component_planes(trained, Figure().subplots(1, 3))
    hit_map(trained, INPUTS, plane())
    assert all((trained.state()[name] == before[name]).all() for name in before)


def test_missing_values_in_single_precision() -> None:
    """Winners are those of the coordinates that were observed; the other pictures know nothing of inputs."""
    holed = INPUTS.astype(np.float32)
    holed[::2, 1] = np.nan
    som = SOM(shape=(4, 5), dtype="float32", missing="ignore", random_state=0).partial_fit(holed)
    assert (values(hit_map(som, holed, plane())).ravel() == winner_counts(som, holed)).all()
    assert np.isfinite(values(u_matrix(som, plane()))).all()
    finished(codebook(som, space(), dims=(0, 1, 2), X=holed))


# Errors

CELLS = (
    "cells are drawn of lattices of one or two axes; this one has shape (2, 3, 4). codebook draws its codes and edges"
)
NO_TOPOLOGY = (
    "the U-matrix needs to know which units are neighbours, and a NeuralGas has no topology; what needs none: "
    "quantisation_error, mean_squared_error, winner_counts, dead_units, entropy"
)
NO_EDGES = "a U-matrix shows distances between neighbours; no units of this map are neighbours"
NO_PLACE = (
    "units that are not on a lattice are drawn at dimensions 0 and 1 of their codes; these codes have one dimension"
)
PLAIN = 'three dimensions need axes that figure.add_subplot(projection="3d") makes; these are plain'
DEEP = "two dimensions need plain axes, as figure.add_subplot() makes; these are 3-D"
LINE = [[0.0], [1.0], [2.0]]

ERRORS: list[tuple[Callable[[], Any], str]] = [
    (lambda: u_matrix(learned("NeuralGas")), NO_TOPOLOGY),
    (lambda: u_matrix(still([1], (1,))), NO_EDGES),
    (lambda: u_matrix(joined([[0, 0], [1, 1]], [])), NO_EDGES),
    (lambda: u_matrix(learned("cube")), CELLS),
    (lambda: u_matrix(joined(LINE, [(0, 1)])), NO_PLACE),
    (lambda: u_matrix(learned("SOM"), space()), DEEP),
    (lambda: u_matrix(learned("GrowingNeuralGas"), space()), DEEP),
    (lambda: component_plane(learned("cube"), 0), CELLS),
    (lambda: component_plane(unjoined(LINE), 0), NO_PLACE),
    (lambda: component_plane(learned("SOM"), 3), "there is no dimension 3: the codes have dimensions 0 to 2"),
    (lambda: component_plane(learned("SOM"), -1), "there is no dimension -1: the codes have dimensions 0 to 2"),
    (lambda: component_plane(learned("SOM"), True), "there is no dimension True: the codes have dimensions 0 to 2"),
    (
        lambda: component_plane(learned("SOM"), 1.0),  # type: ignore[arg-type]
        "there is no dimension 1.0: the codes have dimensions 0 to 2",
    ),
    (
        lambda: component_plane(learned("SOM"), "x"),  # type: ignore[arg-type]
        "there is no dimension 'x': the codes have dimensions 0 to 2",
    ),
    (lambda: component_plane(learned("hexagons"), 0, space()), DEEP),
    (lambda: component_plane(learned("NeuralGas"), 0, space()), DEEP),
    (lambda: component_planes(learned("cube")), CELLS),
    (lambda: component_planes(learned("SOM"), Figure().subplots(2)), "3 dimensions need as many axes; got 2"),
    (lambda: component_planes(learned("SOM"), plane()), "3 dimensions need as many axes; got 1"),
    (lambda: hit_map(learned("cube"), INPUTS), CELLS),
    (lambda: hit_map(unjoined(LINE), LINE), NO_PLACE),
    (
        lambda: hit_map(learned("SOM"), INPUTS[:, :2]),
        "X has 2 features, but SOM is expecting 3 features as input.",
    ),
    (lambda: codebook(learned("SOM"), dims=(0,)), "dims must be two or three dimensions; got (0,)"),
    (lambda: codebook(learned("SOM"), dims=(0, 1, 2, 0)), "dims must be two or three dimensions; got (0, 1, 2, 0)"),
    (
        lambda: codebook(learned("SOM"), dims=1),  # type: ignore[arg-type]
        "dims must be two or three dimensions; got 1",
    ),
    (lambda: codebook(learned("SOM"), dims=(0, 3)), "there is no dimension 3: the codes have dimensions 0 to 2"),
    (lambda: codebook(learned("SOM"), dims=(0, 1, -1)), "there is no dimension -1: the codes have dimensions 0 to 2"),
    (lambda: codebook(still([0, 1], (2,))), "there is no dimension 1: the codes have dimensions 0 to 0"),
    (lambda: codebook(learned("SOM"), X=INPUTS[:, :2]), "X must have shape (n, 3) for this map; got (600, 2)"),
    (lambda: codebook(learned("SOM"), X=INPUTS[0]), "X must have shape (n, 3) for this map; got (3,)"),
    (lambda: codebook(learned("SOM"), space()), DEEP),
    (lambda: codebook(learned("SOM"), plane(), dims=(0, 1, 2)), PLAIN),
    (lambda: growth(History(*np.ones((3, 1))), plane()), "growth needs two axes, for error and units; got 1"),
    (
        lambda: growth(History(*np.ones((3, 1))), Figure().subplots(3)),
        "growth needs two axes, for error and units; got 3",
    ),
]


@pytest.mark.parametrize(("wrong", "message"), ERRORS)
def test_errors_say_what_is_wrong_and_what_would_do(wrong: Callable[[], Any], message: str) -> None:
    """In full; and they come before pyplot has opened a figure that stays empty."""
    with pytest.raises(ValueError) as caught:
        wrong()
    assert str(caught.value) == message
    assert not pyplot.get_fignums()


@pytest.mark.parametrize(
    "draw",
    [u_matrix, codebook, component_planes, lambda trained: component_plane(trained, 0)],
    ids=["u_matrix", "codebook", "component_planes", "component_plane"],
)
def test_a_map_without_units_cannot_be_drawn(draw: Callable[[Map], Any]) -> None:
    """One that has not started, and one that has and waits for its first input: both errors say so."""
    with pytest.raises(NotFittedError, match=r"^This EvolvingSOM instance is not fitted yet"):
        draw(EvolvingSOM(threshold=0.3))
    with pytest.raises(NotFittedError, match=r"^this EvolvingSOM has no units yet; let it learn an input first$"):
        draw(EvolvingSOM(threshold=0.3).initialise(3))
    assert not pyplot.get_fignums()


# Tables with names, and classes


def tabled() -> SOM:
    som: SOM = SOM(shape=(3, 4), epochs=1, random_state=0).fit(pd.DataFrame(INPUTS, columns=["red", "green", "blue"]))
    return som


def test_pictures_name_the_columns_of_a_table() -> None:
    """Bars, axes and planes have the names, and a name chooses the dimension that has it."""
    som = tabled()
    planes = component_planes(som, Figure().subplots(1, 3))
    assert [bar.get_ylabel() for bar in planes[0].figure.axes[3:]] == ["red", "green", "blue"]
    by_name, by_number = (component_plane(som, dim, Figure().subplots()) for dim in ("blue", 2))
    values = [axes.collections[0].get_array() for axes in (by_name, by_number)]
    np.testing.assert_array_equal(values[0].ravel(), som.codebook_[:, 2])
    np.testing.assert_array_equal(*values)
    axes: Any = codebook(som, Figure().subplots(), dims=("green", 0), X=INPUTS)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("green", "red")
    np.testing.assert_array_equal(axes.collections[-1].get_offsets(), som.codebook_[:, [1, 0]])
    gas = NeuralGas(5, epochs=1).fit(pd.DataFrame(INPUTS, columns=["red", "green", "blue"]))
    drawn = hit_map(gas, pd.DataFrame(INPUTS, columns=["red", "green", "blue"]), Figure().subplots())
    assert (drawn.get_xlabel(), drawn.get_ylabel()) == ("red", "green")


def test_a_name_that_is_no_column_is_refused_with_those_that_are() -> None:
    """The message has the numbers and the names."""
    with pytest.raises(ValueError, match=r"no dimension 'rde': the codes have dimensions 0 to 2, named \['red', 'gr"):
        component_plane(tabled(), "rde", Figure().subplots())


@pytest.mark.parametrize("kind", [lambda: SOM(shape=(3, 4), epochs=1), lambda: NeuralGas(12, epochs=1)])
def test_hit_maps_share_the_hits_among_the_classes(kind: Callable[[], Map]) -> None:
    """Their sum is the hit map; titles are the classes; one colour means one number in all of them."""
    chart, y = kind().fit(INPUTS), np.where(INPUTS[:, 0] < 0.2, "low", "high")
    drawn = hit_maps(chart, INPUTS, y, Figure().subplots(1, 2))
    assert [axes.get_title() for axes in drawn] == ["high", "low"]
    cells = [axes.collections[-1] for axes in drawn]
    counts = [np.asarray(one.get_array()).ravel() for one in cells]
    np.testing.assert_array_equal(counts[0] + counts[1], winner_counts(chart, INPUTS))
    assert counts[1].sum() == (y == "low").sum()
    assert cells[0].norm.vmin == cells[1].norm.vmin == 1
    assert cells[0].norm.vmax == cells[1].norm.vmax == max(count.max() for count in counts)


def test_hit_maps_need_a_class_for_each_row_and_axes_for_each_class() -> None:
    """The messages count them."""
    with pytest.raises(ValueError, match="inconsistent numbers of samples"):
        hit_maps(tabled(), INPUTS, [1, 2])
    table = pd.DataFrame(INPUTS, columns=["red", "green", "blue"])
    with pytest.raises(ValueError, match="3 classes need as many axes; got 2"):
        hit_maps(tabled(), table, np.arange(600) % 3, Figure().subplots(1, 2))
