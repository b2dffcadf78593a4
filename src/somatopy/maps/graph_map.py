"""What the maps that grow share: units and edges in tables that are given room as they need it."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from sklearn.utils.validation import check_is_fitted

from somatopy.maps.compiled import CompiledMap
from somatopy.maps.graph import Graph
from somatopy.maps.graph_kernels import LEAST_FADE, SEEN, UNITS, WIDEST, Net
from somatopy.maps.kernels import LANES, nearest, padded_dims

__all__ = ["GraphMap"]

Array = NDArray[Any]
Integers = NDArray[np.int64]

WIDTH = 8  # edges that each unit has room for at first
STEP = 4  # and how many more there is room for where one unit has more: few units ever have many
RANGES = {"ages": (0, 2**30), "fade": (LEAST_FADE, 1.0)}  # what is restored beside codes; ages are counted in 32 bits


class GraphMap(CompiledMap):
    """A compiled map of units that come and go, joined by edges, in a `Net`.

    A concrete map gives `_start_from` and `_learn_from`, and names in `VALUES` what a unit remembers beside its code.
    Where a unit is removed, the last one takes its number.
    """

    VALUES: ClassVar[tuple[str, ...]] = ()
    AGED: ClassVar[bool] = True  # whether its edges have ages
    FADES: ClassVar[bool] = False  # whether its values fade
    LEAST: ClassVar[int] = 0  # units
    max_units: int
    _net: Net

    @abstractmethod
    def _learn_from(self, samples: Array, start: int) -> tuple[int, int]:
        """Let the kernel learn samples (n, dims) in their order, from the place `start` on, as far as there is room.

        Returns:
            The place of the first sample that it has not learned, and the winner of the last one that it has, before
            its update; -1 and -1, and nothing has changed, if any sample is not usable.
        """

    @property
    def topology_(self) -> Graph:
        """The edges."""
        check_is_fitted(self)
        return Graph(self._units(), _edges_and_ages(self._net)[0])

    def _run(self, samples: Array, find: bool) -> tuple[int, int, float]:
        stopped, winner = self._learn_from(samples, 0)
        while 0 <= stopped < len(samples):
            self._net = _with_more_room(self._net)
            stopped, winner = self._learn_from(samples, stopped)
        if winner < 0 or not find:
            return winner, -1, 0.0
        return winner, *nearest(*self._laid_out(), self._allows_missing(), samples[-1:])

    def _laid_out(self) -> tuple[Array, int]:
        return self._net.codes[:, None], int(self._net.counts[UNITS])  # one row, with more lanes than units

    def _take_over(self, arrays: dict[str, Array]) -> None:
        self._net = _net_of(arrays, [arrays[name] for name in self.VALUES])
        super()._take_over(arrays)

    def _state_arrays(self) -> dict[str, Array]:
        net, (edges, ages) = self._net, _edges_and_ages(self._net)
        values = {name: net.values[i, : self._units()] for i, name in enumerate(self.VALUES)}
        aged = {"ages": ages} if self.AGED else {}
        faded = {"fade": net.fade.reshape(())} if self.FADES else {}
        seen = {"samples_seen": net.counts[SEEN].reshape(())}
        return {"codebook": self._codes(), "edges": edges, **aged, **values, **faded, **seen}

    def _edgeless(self, codebook: Array) -> dict[str, Array]:
        """The state of units that have no edges."""
        aged = {"ages": np.empty(0, dtype=np.int64)} if self.AGED else {}
        values = {name: np.zeros(len(codebook)) for name in self.VALUES}
        faded = {"fade": np.array(1.0)} if self.FADES else {}
        return {"codebook": codebook, "edges": np.empty((0, 2), dtype=np.int64), **aged, **values, **faded}

    def _check_state(self, arrays: dict[str, Array], expected: dict[str, Array]) -> None:
        units, edges = len(arrays["codebook"]), arrays["edges"]
        if not self.LEAST <= units <= self.max_units:
            raise ValueError(f"this {type(self).__name__} has {self.LEAST} to {self.max_units} units; got {units}")
        try:
            Graph(units, edges)
        except ValueError as error:
            raise ValueError(f"the restored edges do not fit: {error}") from error
        shapes = {"samples_seen": (), "fade": (), "ages": (len(edges),)} | {name: (units,) for name in self.VALUES}
        for name in arrays.keys() & shapes.keys():
            if arrays[name].shape != shapes[name]:
                raise ValueError(
                    f"the restored {name} must have shape {shapes[name]} for this state; got {arrays[name].shape}"
                )
            least, most = RANGES.get(name, (0, np.inf))
            if ((arrays[name] < least) | (arrays[name] > most)).any():
                raise ValueError(f"the restored {name} must be from {least} to {most}; got {arrays[name].tolist()}")

    def _codes(self) -> Array:
        return np.ascontiguousarray(self._net.codes[: self.n_features_in_, : self._units()].T)


def _net_of(arrays: dict[str, Array], values: list[Array]) -> Net:
    """Lay out a state in tables."""
    codebook, edges = arrays["codebook"], arrays["edges"].reshape(-1, 2)
    (units, dims), ages = codebook.shape, arrays.get("ages", np.zeros(len(edges), dtype=np.int64))
    ends = np.concatenate([edges, edges[:, ::-1]])
    order = np.lexsort(ends.T[::-1])
    ends, both_ages = ends[order], np.concatenate([ages, ages])[order]
    degrees = np.bincount(ends[:, 0], minlength=units)
    widest = int(degrees.max(initial=0))
    capacity, width = -(-max(units + 1, 4 * LANES) // LANES) * LANES, max(widest + 2, WIDTH)
    net = _empty_net(padded_dims(dims), len(values), capacity, width, codebook.dtype)
    places = np.arange(len(ends)) - np.repeat(np.cumsum(degrees) - degrees, degrees)
    net.links[ends[:, 0], places], net.ages[ends[:, 0], places] = ends[:, 1], both_ages
    net.codes[:dims, :units], net.degrees[:units] = codebook.T, degrees
    net.counts[:], net.fade[:] = (units, int(arrays["samples_seen"]), widest), arrays.get("fade", 1.0)
    for row, value in zip(net.values, values, strict=True):
        row[:units] = value
    return net


def _empty_net(padded: int, kinds: int, capacity: int, width: int, precision: np.dtype[Any]) -> Net:
    return Net(
        codes=np.zeros((padded, capacity), precision),
        values=np.zeros((kinds, capacity)),
        fade=np.ones(1),
        links=np.zeros((capacity, width), dtype=np.int32),
        ages=np.zeros((capacity, width), dtype=np.int32),
        degrees=np.zeros(capacity, dtype=np.int32),
        counts=np.zeros(3, dtype=np.int64),
        work=np.zeros(capacity, precision),
    )


def _with_more_room(net: Net) -> Net:
    """The same net with room for twice as many units, or a few more edges, whichever has run out."""
    (padded, capacity), width = net.codes.shape, net.links.shape[1]
    more = capacity * 2 if net.counts[UNITS] >= capacity else capacity
    wider = width + STEP if net.counts[WIDEST] + 2 > width else width
    roomy = _empty_net(padded, len(net.values), more, wider, net.codes.dtype)
    roomy.codes[:, :capacity], roomy.values[:, :capacity] = net.codes, net.values
    roomy.links[:capacity, :width], roomy.ages[:capacity, :width] = net.links, net.ages
    roomy.degrees[:capacity], roomy.counts[:], roomy.fade[:] = net.degrees, net.counts, net.fade
    return roomy


def _edges_and_ages(net: Net) -> tuple[Integers, Integers]:
    """The edges (edges, 2) of a net in rising order, and their ages."""
    units, places = np.nonzero(np.arange(net.links.shape[1]) < net.degrees[: net.counts[UNITS], None])
    others = net.links[units, places].astype(np.int64)
    once = units < others
    edges = np.stack([units[once], others[once]], axis=1)
    return edges, net.ages[units[once], places[once]].astype(np.int64)
