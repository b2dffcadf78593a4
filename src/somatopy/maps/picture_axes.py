"""Axes of the pictures of maps: which are drawn in, how they are named, and where colour bars lie."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

from somatopy.maps.base import Map
from somatopy.maps.columns import column_names

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["Beside", "enough_axes", "labelled", "new_axes", "plane", "space"]


def plane(ax: Axes | None) -> Axes:
    """These axes, if they are plain ones, or new ones."""
    if ax is None:
        drawn: Axes = new_axes(1)[0]
        return drawn
    if ax.name == "3d":
        raise ValueError("two dimensions need plain axes, as figure.add_subplot() makes; these are 3-D")
    return ax


def space(ax: Axes | None) -> Axes:
    """These axes, if they are of three dimensions, or new ones."""
    if ax is None:
        drawn: Axes = new_axes(1, subplot_kw={"projection": "3d"})[0]
        return drawn
    if ax.name != "3d":
        raise ValueError('three dimensions need axes that figure.add_subplot(projection="3d") makes; these are plain')
    return ax


def new_axes(count: int, columns: int | None = None, **options: Any) -> NDArray[Any]:
    """Axes in a new figure, in as many columns as rows or one more."""
    from matplotlib import pyplot  # only here: it looks for a screen

    columns = columns or ceil(sqrt(count))
    rows = -(-count // columns)
    size = (5.0, 4.2) if count == 1 else (3.4 * columns, 2.8 * rows)
    figure = pyplot.figure(figsize=size, layout="constrained")
    grid: NDArray[Any] = figure.subplots(rows, columns, squeeze=False, **options).ravel()
    for spare in grid[count:]:
        spare.remove()
    return grid[:count]


def enough_axes(axes: Any, count: int, what: str) -> NDArray[Any]:
    """The first of the axes that are given, or new ones, so many of them."""
    drawn: NDArray[Any] = new_axes(count) if axes is None else np.array(axes, dtype=object).ravel()
    if len(drawn) < count:
        raise ValueError(f"{count} {what} need as many axes; got {len(drawn)}")
    return drawn[:count]


def labelled(axes: Any, trained: Map, dims: Sequence[int]) -> Axes:
    """Name the dimensions; what is equally far is drawn so, since that is how the map sees it."""
    names = column_names(trained)
    for axis, dim in zip("xyz", dims, strict=False):
        axes.set(**{f"{axis}label": names[dim]})
    axes.set_aspect("equal", adjustable="box")  # limits stay the caller's to set, and axes may share them
    named: Axes = axes
    return named


class Beside:
    """Keeps a colour bar as long as its axes, also where an equal aspect makes them smaller than their place."""

    def __init__(self, axes: Axes, bar: Axes) -> None:
        self.axes, self.bar = axes, bar

    def __call__(self, bar: Axes, renderer: Any) -> Bbox:
        place, box, own = self.axes.get_position(True), self.axes.get_position(), bar.get_position(True)
        # there is room for any thickness: the bar takes what goes with its length
        if own.x0 >= place.x1:
            return Bbox.from_bounds(own.x0, box.y0, place.width, box.height)
        return Bbox.from_bounds(box.x0, own.y1 - place.height, box.width, place.height)

    def get_subplotspec(self) -> Any:
        """What tight_layout asks a locator for."""
        return self.bar.get_subplotspec()
