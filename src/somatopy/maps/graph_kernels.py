"""Compiled kernels that the maps that grow share: nearest units, edges, and units that come and go.

A `Net` has room for more than it holds: `counts[UNITS]` units of `codes.shape[1]`, and up to `links.shape[1]` edges a
unit. Kernels that learn stop where the next input might need more room, and go on once `graph_map.GraphMap` has made
it. Neighbours of a unit are listed in rising order, so that equal graphs are equal tables. Codes lie as one array a
dimension, as in `kernels`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from somatopy._jit import jit
from somatopy.maps.kernels import first_least, squared_distances

__all__ = [
    "LEAST_FADE",
    "NEW",
    "SEEN",
    "UNITS",
    "WIDEST",
    "Net",
    "add_unit",
    "drop_older",
    "fade",
    "grow_older",
    "join",
    "move",
    "nearest_of",
    "nearest_two",
    "neighbour",
    "part",
    "remove_lonely",
    "remove_unit",
    "room",
]

Array = NDArray[Any]
Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Short = NDArray[np.int32]

LEAST_FADE = 1e-3  # values to be multiplied by less are multiplied, so that sums of the largest inputs stay finite
NEW: Any = np.int64(0)  # the age of a new edge; it has a type because kernels are compiled anew for each literal number
UNITS, SEEN, WIDEST = range(3)  # places in the counts: units, inputs learned, most neighbours that a unit ever had


class Net(NamedTuple):
    """Units and edges in tables.

    Attributes:
        codes: shape (padded dims, capacity).
        values: what else a unit remembers, shape (kinds, capacity).
        fade: what the values are yet to be multiplied by, shape (1,).
        links: neighbours of each unit in rising order, shape (capacity, width).
        ages: age of the edge to each, the same shape.
        degrees: neighbours that each unit has, shape (capacity,).
        counts: see `UNITS`, `SEEN` and `WIDEST`.
        work: scratch, shape (capacity,).
    """

    codes: Array
    values: Floats
    fade: Floats
    links: Short
    ages: Short
    degrees: Short
    counts: Integers
    work: Array


@jit
def room(net: Net, most: int) -> bool:
    """Whether one more unit, if there may be any, and two more edges at any unit find room."""
    units = net.counts[UNITS]
    return bool((units < net.codes.shape[1] or units >= most) and net.counts[WIDEST] + 2 <= net.links.shape[1])


@jit
def nearest_of(net: Net, x: Array, dims: int) -> int:
    """The unit nearest to x, the first of equals; squared distances are left in `net.work`."""
    squared = net.work[: net.counts[UNITS]]
    squared_distances(net.codes, x, dims, squared)
    return first_least(squared)


@jit
def nearest_two(net: Net, x: Array, dims: int) -> tuple[int, int]:
    """The two of at least two units that are nearest to x; squared distances are left in `net.work`."""
    first = nearest_of(net, x, dims)
    squared = net.work[: net.counts[UNITS]]
    kept = squared[first]
    squared[first] = np.inf
    second = first_least(squared)
    squared[first] = kept
    if second == first:  # all others are infinitely far
        second = 0 if first else 1
    return first, second


@jit
def neighbour(net: Net, unit: int, place: int) -> int:
    """The neighbour of a unit at a place in its list; in one type of integer, so that all is compiled once."""
    return int(np.int64(net.links[unit, place]))


@jit
def move(net: Net, unit: int, x: Array, gain: float) -> None:
    """Move a unit towards x, in the coordinates of x that are known."""
    codes, share = net.codes, net.work.dtype.type(gain)
    for k in range(codes.shape[0]):
        if x[k] == x[k]:
            codes[k, unit] += share * (x[k] - codes[k, unit])


@jit
def _place_of(net: Net, unit: int, other: int) -> int:
    """Where `other` stands, or would stand, among the neighbours of a unit."""
    place = 0
    while place < net.degrees[unit] and net.links[unit, place] < other:
        place += 1
    return place


@jit
def _list_neighbour(net: Net, unit: int, other: int, age: int) -> None:
    """Put `other` among the neighbours of a unit, or only give the edge its new age."""
    place, degree = _place_of(net, unit, other), np.int64(net.degrees[unit])
    if place == degree or net.links[unit, place] != other:
        for i in range(degree, place, -1):
            net.links[unit, i] = net.links[unit, i - 1]
            net.ages[unit, i] = net.ages[unit, i - 1]
        net.links[unit, place] = other
        net.degrees[unit] = degree + 1
        net.counts[WIDEST] = max(net.counts[WIDEST], degree + 1)
    net.ages[unit, place] = age


@jit
def _unlist_neighbour(net: Net, unit: int, other: int) -> None:
    """Take `other` from the neighbours of a unit, if it is one."""
    place, degree = _place_of(net, unit, other), np.int64(net.degrees[unit])
    if place == degree or net.links[unit, place] != other:
        return
    for i in range(place, degree - 1):
        net.links[unit, i] = net.links[unit, i + 1]
        net.ages[unit, i] = net.ages[unit, i + 1]
    net.degrees[unit] = degree - 1


@jit
def join(net: Net, a: int, b: int, age: int) -> None:
    """Join two units by an edge of this age; if they are joined, the edge takes this age."""
    _list_neighbour(net, a, b, age)
    _list_neighbour(net, b, a, age)


@jit
def part(net: Net, a: int, b: int) -> None:
    """Remove the edge between two units, if there is one."""
    _unlist_neighbour(net, a, b)
    _unlist_neighbour(net, b, a)


@jit
def add_unit(net: Net, nearest: int, x: Array, share: float) -> int:
    """A new unit without edges, `share` of the way from the nearest to x, for the caller to set its values.

    Where x is not known it has the code of the nearest; 0 where there is none (-1), which puts it at x elsewhere.
    """
    unit, weight = int(net.counts[UNITS]), net.work.dtype.type(share)
    for k in range(net.codes.shape[0]):
        known = x[k] == x[k]
        if nearest < 0:
            net.codes[k, unit] = x[k] if known else weight * 0
        else:
            code = net.codes[k, nearest]
            net.codes[k, unit] = (1 - weight) * code + weight * x[k] if known else code
    net.counts[UNITS] = unit + 1
    net.degrees[unit] = 0
    return unit


@jit
def remove_unit(net: Net, unit: int) -> None:
    """Remove a unit with its edges; the last unit takes its number."""
    while net.degrees[unit]:
        part(net, unit, neighbour(net, unit, int(net.degrees[unit]) - 1))
    last = int(net.counts[UNITS] - 1)
    if unit < last:
        for k in range(net.codes.shape[0]):  # loops: slices of columns take long to compile
            net.codes[k, unit] = net.codes[k, last]
        for kind in range(net.values.shape[0]):
            net.values[kind, unit] = net.values[kind, last]
        while net.degrees[last]:
            place = int(net.degrees[last]) - 1
            other, age = neighbour(net, last, place), int(np.int64(net.ages[last, place]))
            part(net, last, other)
            join(net, unit, other, age)
    net.counts[UNITS] = last


@jit
def remove_lonely(net: Net) -> None:
    """Remove units without edges, as long as two remain."""
    for unit in range(net.counts[UNITS] - 1, -1, -1):  # from the back: what takes the number of another has an edge
        if net.degrees[unit] == 0 and net.counts[UNITS] > 2:
            remove_unit(net, unit)


@jit
def grow_older(net: Net, unit: int) -> None:
    """Make all edges of a unit one input older."""
    for i in range(net.degrees[unit]):
        other = neighbour(net, unit, i)
        net.ages[unit, i] += 1
        net.ages[other, _place_of(net, other, unit)] += 1


@jit
def fade(net: Net, decay: float) -> None:
    """Multiply all values by `decay`: one number for all, which they take over when it gets too small."""
    net.fade[0] *= decay
    if net.fade[0] < LEAST_FADE:
        for kind in range(net.values.shape[0]):
            for unit in range(net.counts[UNITS]):
                net.values[kind, unit] *= net.fade[0]
        net.fade[0] = 1.0


@jit
def drop_older(net: Net, unit: int, most: int) -> None:
    """Remove the edges of a unit that are older than `most` inputs, and units that lose their last edge by it."""
    lonely = False
    for i in range(net.degrees[unit] - 1, -1, -1):
        if net.ages[unit, i] > most:
            other = neighbour(net, unit, i)
            part(net, unit, other)
            lonely |= net.degrees[other] == 0
    if lonely or net.degrees[unit] == 0:
        remove_lonely(net)
