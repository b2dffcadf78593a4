"""Pictures of maps, for matplotlib: axes in, axes out. Without axes each function draws in a new figure.

Units on a lattice of one or two axes are drawn as cells, squares or hexagons, row 0 at the top as in an array; units
that are not on a lattice where their codes are.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Line3DCollection  # type: ignore[import-untyped]
from numpy.typing import ArrayLike, NDArray
from sklearn.exceptions import NotFittedError
from sklearn.utils.validation import check_consistent_length

from somatopy.maps.base import Map
from somatopy.maps.columns import chosen_columns, column_names
from somatopy.maps.lattice import ROW_HEIGHT, Lattice
from somatopy.maps.picture_axes import Beside, enough_axes, labelled, new_axes, plane, space
from somatopy.maps.quality import History, winner_counts
from somatopy.maps.quality.looking import codes_of, topology_of
from somatopy.maps.topology import Topology

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["codebook", "component_plane", "component_planes", "growth", "hit_map", "hit_maps", "u_matrix"]

Floats = NDArray[np.float64]

COLOURS = "cividis"  # reads the same without colour vision, and in grey
NONE, EDGE, INPUT, UNIT = "#dddddd", "#777777", "#b9c7d6", "#123a8c"
CORNERS = np.deg2rad(np.arange(30, 390, 60))
HEXAGON = np.stack([np.cos(CORNERS), np.sin(CORNERS)], axis=1) / np.sqrt(3)  # neighbours are 1 apart


def u_matrix(trained: Map, ax: Axes | None = None) -> Axes:
    """Draw how far neighbours' codes are apart: borders between clusters stand out.

    On a lattice each cell has the mean distance of its unit's code from those of its neighbours, the units one cell
    away (four on squares, six on hexagons, two on a strip). Of a graph each edge is drawn between its units' codes
    (the first two dimensions), and has their distance in all dimensions.

    Source: A. Ultsch, H. P. Siemon, Kohonen's self organizing feature maps for exploratory data analysis, INNC 1990.

    Raises:
        ValueError: if the map has no topology or no edges, its lattice has more than two axes, or it is a graph of
            codes of one dimension.

    Example:
        >>> from matplotlib.figure import Figure
        >>> from somatopy.maps import SOM
        >>> som = SOM(shape=(2, 2), init=[[0.0], [1.0], [2.0], [3.0]]).initialise(1)
        >>> u_matrix(som, Figure().subplots()).collections[0].get_array().data
        array([[1.5, 1.5],
               [1.5, 1.5]])
    """
    topology, codes = topology_of(trained, "U-matrix"), _codes(trained)
    edges, label = topology.edges, "distance to neighbours"
    if not len(edges):
        raise ValueError("a U-matrix shows distances between neighbours; no units of this map are neighbours")
    _check_drawable(topology, codes)
    lengths = np.linalg.norm(codes[edges[:, 0]] - codes[edges[:, 1]], axis=1)
    if not isinstance(topology, Lattice):
        return _coloured_edges(ax, trained, edges, lengths, label)
    degrees = np.bincount(edges.ravel(), minlength=len(codes))
    return _cells(ax, topology, np.bincount(edges.ravel(), np.repeat(lengths, 2), len(codes)) / degrees, label)


def component_plane(trained: Map, dim: int | str, ax: Axes | None = None) -> Axes:
    """Draw one dimension of all codes: where on the map it is large and where it is small.

    Args:
        trained: a map on a lattice of one or two axes; units that are not on a lattice are drawn at their codes.
        dim: the dimension, from 0, or the name of its column, where the map has learned a table with names.
        ax: where to draw.

    Raises:
        ValueError: if there is no such dimension, the lattice has more than two axes, or there is none and the codes
            have one dimension.
    """
    codes = _codes(trained)
    (chosen,) = chosen_columns(trained, (dim,))
    return _units(trained, ax, codes[:, chosen], column_names(trained)[chosen])


def component_planes(trained: Map, axes: Any = None) -> NDArray[Any]:
    """Draw every dimension of the codes; see `component_plane`.

    Args:
        trained: a map on a lattice of one or two axes.
        axes: as many axes as there are dimensions, in any array; None makes them.

    Returns:
        The axes, shape (dims,).

    Raises:
        ValueError: if there are fewer axes than dimensions; and as for `component_plane`.
    """
    codes = _codes(trained)
    _check_drawable(getattr(trained, "topology_", None), codes)
    dims = codes.shape[1]
    drawn = enough_axes(axes, dims, "dimensions")
    return np.array([component_plane(trained, dim, drawn[dim]) for dim in range(dims)], dtype=object)


def hit_map(trained: Map, X: ArrayLike, ax: Axes | None = None) -> Axes:
    """Draw how many of the inputs X (n, dims) each unit wins. Units that win none, the dead ones, are grey.

    Raises:
        ValueError: if the inputs do not fit, the lattice has more than two axes, or there is none and the codes have
            one dimension.
    """
    counts = winner_counts(trained, X)
    return _units(trained, ax, counts, "inputs won" if counts.all() else "inputs won (grey: none)", least=1)


def hit_maps(trained: Map, X: ArrayLike, y: ArrayLike, axes: Any = None) -> NDArray[Any]:
    """Draw, for each class, how many of its inputs each unit wins, in the same colours; units that win none are grey.

    Args:
        trained: a map, as for `hit_map`.
        X: inputs, shape (n, dims).
        y: the class of each, shape (n,).
        axes: as many axes as there are classes, in any array; None makes them.

    Returns:
        The axes, shape (classes,), in rising order of the classes, which are their titles.

    Raises:
        ValueError: if X and y are not equally long, or there are fewer axes than classes; and as for `hit_map`.
    """
    check_consistent_length(X, y)
    classes, which = np.unique(np.asarray(y), return_inverse=True)
    units, winners = len(_codes(trained)), trained.predict(X)
    _check_drawable(getattr(trained, "topology_", None), _codes(trained))
    drawn = enough_axes(axes, len(classes), "classes")
    counts = [np.bincount(winners[which == place], minlength=units) for place in range(len(classes))]
    most = max(int(count.max()) for count in counts)
    for panel, name, count in zip(drawn, classes, counts, strict=True):
        _units(trained, panel, count, "inputs won (grey: none)", least=1, most=most).set_title(str(name))
    return drawn


def codebook(
    trained: Map, ax: Axes | None = None, dims: Sequence[int | str] = (0, 1), X: ArrayLike | None = None
) -> Axes:
    """Draw the codes in input space, with the edges between neighbours if the map has a topology.

    Args:
        trained: a map of any kind.
        ax: where to draw; three dimensions need axes with projection="3d".
        dims: two or three dimensions of the input space, numbers from 0 or names of columns.
        X: inputs to draw beneath, shape (n, n_features_in_); those that miss a chosen dimension are left out.

    Raises:
        ValueError: if there are no such dimensions, the axes do not have as many, or X does not fit.
    """
    asked, codes = np.array(dims, dtype=object).ravel().tolist(), _codes(trained)
    if len(asked) not in (2, 3):
        raise ValueError(f"dims must be two or three dimensions; got {dims!r}")
    chosen = chosen_columns(trained, asked)
    inputs = np.asarray(codes[:0] if X is None else X, dtype=np.float64)
    if inputs.ndim != 2 or inputs.shape[1] != codes.shape[1]:
        raise ValueError(f"X must have shape (n, {codes.shape[1]}) for this map; got {inputs.shape}")
    axes: Any = plane(ax) if len(chosen) == 2 else space(ax)
    if len(inputs):
        axes.scatter(*inputs[:, chosen].T, s=_size(len(inputs)), color=INPUT, linewidths=0, rasterized=True, zorder=1)
    points = codes[:, chosen]
    if hasattr(trained, "topology_"):
        edges = _lines(points[trained.topology_.edges], linewidths=_width(len(points)), colors=EDGE, zorder=2)
        axes.add_collection(edges, autolim=False)  # the points at their ends set the limits, in space too
    axes.scatter(*points.T, s=_size(len(points)), color=UNIT, linewidths=0, rasterized=True, zorder=3)
    return labelled(axes, trained, chosen)


def growth(history: History, axes: Any = None) -> NDArray[Any]:
    """Draw what `follow` recorded: quantisation error above, number of units below.

    Args:
        history: inputs learned, units and errors.
        axes: two axes; None makes them.

    Returns:
        The two axes.

    Raises:
        ValueError: if the axes are not two.

    Example:
        >>> from matplotlib.figure import Figure
        >>> from somatopy.maps import SOM
        >>> from somatopy.maps.quality import follow
        >>> history = follow(SOM(shape=(4, 4)), np.random.default_rng(0).random((500, 2)), every=100)
        >>> error, units = growth(history, Figure().subplots(2))
        >>> units.get_ylabel()
        'units'
    """
    drawn = new_axes(2, columns=1, sharex=True) if axes is None else np.array(axes, dtype=object).ravel()
    if len(drawn) != 2:
        raise ValueError(f"growth needs two axes, for error and units; got {len(drawn)}")
    above, below = drawn
    above.plot(history.samples, history.error, color=UNIT)
    above.set_ylabel("quantisation error")
    below.step(history.samples, history.units, where="post", color=UNIT)
    below.set(xlabel="inputs learned", ylabel="units")
    below.yaxis.set_major_locator(MaxNLocator(integer=True))
    for panel in drawn:
        panel.set_ylim(0, auto=True)  # so that a second history drawn here has room
    return drawn


# Values as colours


def _units(
    trained: Map,
    ax: Axes | None,
    values: NDArray[Any],
    label: str,
    least: float = -np.inf,
    most: float | None = None,
) -> Axes:
    """Colour each unit by its value, grey below `least`: cells of a lattice, else points at the codes."""
    topology, places = getattr(trained, "topology_", None), _codes(trained)[:, :2]
    _check_drawable(topology, places)
    if isinstance(topology, Lattice):
        return _cells(ax, topology, values, label, least, most)
    axes, width, size = plane(ax), _width(len(places)), 4 * _size(len(places))
    if topology is not None:
        axes.add_collection(_lines(places[topology.edges], linewidths=width, colors=NONE, zorder=1), autolim=False)
    options = {"linewidths": 0, "rasterized": True, "zorder": 2, **_scale(values, least, most)}
    points = axes.scatter(places[:, 0], places[:, 1], size, values, **options)
    return labelled(_with_bar(axes, points, label), trained, (0, 1))


def _cells(
    ax: Axes | None,
    lattice: Lattice,
    values: NDArray[Any],
    label: str,
    least: float = -np.inf,
    most: float | None = None,
) -> Axes:
    """Colour each cell of a lattice by its value, grey below `least`."""
    axes, (rows, columns) = plane(ax), (1, *lattice.shape)[-2:]
    if lattice.hexagonal:
        cells: Any = _hexagons(axes, lattice, values, **_scale(values, least, most))
    else:
        borders = np.arange(columns + 1) - 0.5, np.arange(rows + 1) - 0.5
        cells = axes.pcolormesh(*borders, values.reshape(rows, columns), rasterized=True, **_scale(values, least, most))
    _numbered(axes, lattice, rows, columns)
    return _with_bar(axes, cells, label, "horizontal" if rows == 1 else "vertical")


def _hexagons(axes: Axes, lattice: Lattice, values: NDArray[Any], **colours: Any) -> PolyCollection:
    corners = lattice.positions[:, None, ::-1] + HEXAGON
    # edges of the cells' own colour: without them the background shines through where two cells meet
    cells = PolyCollection(corners, array=values, edgecolors="face", lw=0.5, rasterized=True, **colours)
    axes.add_collection(cells)
    axes.margins(0)
    axes.autoscale_view()
    return cells


def _numbered(axes: Axes, lattice: Lattice, rows: int, columns: int) -> None:
    """Rows and columns beside the cells, which need no frame, row 0 on top; a strip has units."""
    axes.grid(False)
    axes.spines[:].set_visible(False)
    axes.set_xticks(_ticks(columns))
    if rows == 1:
        axes.set(xlabel="unit", yticks=[])
        axes.set_box_aspect(0.12)
        return
    places = _ticks(rows)
    axes.set_yticks(places * (ROW_HEIGHT if lattice.hexagonal else 1.0), [str(row) for row in places])
    axes.set(xlabel="column", ylabel="row", aspect="equal")
    axes.yaxis.set_inverted(True)


def _ticks(count: int) -> NDArray[np.int64]:
    ticks = np.asarray(MaxNLocator(6, integer=True).tick_values(0, max(count - 1, 1)))
    return np.unique(ticks[(ticks >= 0) & (ticks < count)].astype(np.int64))


def _coloured_edges(ax: Axes | None, trained: Map, edges: NDArray[np.int64], lengths: Floats, label: str) -> Axes:
    """Draw edges at their units' codes, coloured by length."""
    codes = _codes(trained)
    width = 1.5 * _width(len(codes))
    axes, lines = plane(ax), _lines(codes[edges][:, :, :2], linewidths=width, array=lengths, **_scale(lengths))
    axes.add_collection(lines)
    axes.autoscale_view()
    return labelled(_with_bar(axes, lines, label), trained, (0, 1))


def _scale(values: NDArray[Any], least: float = -np.inf, most: float | None = None) -> dict[str, Any]:
    """Colours from the least value, `least` at least, to the greatest; from `least` to `most`, if that is given."""
    low, high = (max(values.min(), least), values.max()) if most is None else (least, most)
    return {"cmap": colormaps[COLOURS].with_extremes(under=NONE), "norm": Normalize(low, max(low, high))}


def _with_bar(axes: Axes, drawn: Any, label: str, orientation: str = "vertical") -> Axes:
    """Say beside the axes what the colours mean, in whole numbers if they count."""
    ticks = MaxNLocator("auto", steps=[1, 2, 5, 10], integer=drawn.get_array().dtype.kind == "i")
    bar: Any = axes.figure.colorbar(drawn, ax=axes, label=label, orientation=orientation, ticks=ticks)
    bar.outline.set_visible(False)
    bar.ax.set_axes_locator(Beside(axes, bar.ax))
    return axes


# Codes


def _codes(trained: Map) -> Floats:
    """The codes (units, dims), one at least."""
    codes = codes_of(trained)
    if not len(codes):
        raise NotFittedError(f"this {type(trained).__name__} has no units yet; let it learn an input first")
    return codes


def _check_drawable(topology: Topology | None, codes: Floats) -> None:
    """Units are drawn as cells of a lattice in a plane, else at the first two dimensions of their codes."""
    if isinstance(topology, Lattice):
        if len(topology.shape) > 2:
            raise ValueError(
                f"cells are drawn of lattices of one or two axes; this one has shape {topology.shape}. "
                "codebook draws its codes and edges"
            )
    elif codes.shape[1] < 2:
        raise ValueError(
            "units that are not on a lattice are drawn at dimensions 0 and 1 of their codes; these codes have one "
            "dimension"
        )


# Sizes


def _lines(segments: Floats, **options: Any) -> Any:
    """Edges (edges, 2, dims) in a plane or in space."""
    kind: Any = LineCollection if segments.shape[2] == 2 else Line3DCollection
    return kind(segments, rasterized=True, **options)


def _width(units: int) -> float:
    """Of edges between so many units, in points."""
    return float(np.clip(25 / sqrt(units), 0.2, 1.2))


def _size(count: int) -> float:
    """Area of one of so many points, in points squared."""
    return float(np.clip(4000 / max(count, 1), 0.5, 16))
