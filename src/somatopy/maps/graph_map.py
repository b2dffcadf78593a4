"""What the maps that grow share: units and edges in tables that are given room as they need it."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.utils.validation import check_is_fitted

from somatopy.maps.base import Map
from somatopy.maps.graph import Graph
from somatopy.maps.graph_kernels import LEAST_FADE, SEEN, UNITS, WIDEST, Net
from somatopy.maps.inputs import real
from somatopy.maps.kernels import LANES, nearest, padded_dims, squared_from_units, winners

__all__ = ["GraphMap"]

Array = NDArray[Any]
Integers = NDArray[np.int64]

WIDTH = 8  # edges that each unit has room for at first
STEP = 4  # and how many more there is room for where one unit has more: few units ever have many
RANGES = {"ages": (0, 2**30), "fade": (LEAST_FADE, 1.0)}  # what is restored beside codes; ages are counted in 32 bits


class GraphMap(Map):
    """A map of units that come and go, joined by edges; its compiled kernels work on a `Net`.

    A concrete map gives `_start` and `_taught`, and names in `VALUES` what a unit remembers beside its code. Where a
    unit is removed, the last one takes its number.
    """

    VALUES: ClassVar[tuple[str, ...]] = ()
    AGED: ClassVar[bool] = True  # whether its edges have ages
    FADES: ClassVar[bool] = False  # whether its values fade
    LEAST: ClassVar[int] = 0  # units
    max_units: int
    _net: Net
    _blank: Array  # one input of zeros, to be copied

    @abstractmethod
    def _taught(self, samples: Array, start: int) -> tuple[int, int]:
        """Let the kernel learn samples (n, padded dims) from `start` on: where it stopped, and the last winner."""

    @property
    def topology_(self) -> Graph:
        """The edges."""
        check_is_fitted(self)
        return Graph(self._units(), _listed(self._net)[0])

    def learn_one(self, x: ArrayLike) -> int:
        """Learn one input (dims,) and return its winner; see `Map.learn_one`."""
        if "_net" not in self.__dict__:
            return super().learn_one(x)
        samples = self._one(x)
        unit = self._run(samples)
        if unit < 0:
            raise self._refusal(samples[0, : self.n_features_in_])
        return unit

    def winner(self, x: ArrayLike) -> tuple[int, float]:
        """The unit nearest to `x` and its Euclidean distance; see `Map.winner`."""
        if "_net" not in self.__dict__:
            check_is_fitted(self)  # takes longer than all the rest
        samples = self._one(x)
        self._check_units()
        unit, distance = nearest(self._sheet(), self._units(), self.n_features_in_, self._ruled()[0], samples)
        if unit < 0:
            raise self._refusal(samples[0, : self.n_features_in_])
        return unit, distance

    def code(self, unit: int) -> Array:
        """The code of one unit, shape (dims,), without copying all others; see `Map.code`."""
        check_is_fitted(self)
        code: Array = self._lanes()[:, unit].copy()
        return code

    def _units(self) -> int:
        return int(self._net.counts[UNITS])

    def _one(self, x: ArrayLike) -> Array:
        """One input as the kernels take it, not checked yet."""
        sample = real(x)
        if sample.shape != (self.n_features_in_,):
            raise self._wrong_length(sample)
        samples = self._blank.copy()
        samples[0, : sample.size] = sample
        return samples

    def _padded(self, samples: Array) -> Array:
        out = np.zeros((len(samples), len(self._net.codes)), self._net.codes.dtype)
        out[:, : samples.shape[1]] = samples
        return out

    def _run(self, samples: Array) -> int:
        """Learn samples (n, padded dims): the last winner, or -1 and nothing, if any is not usable."""
        start, unit = self._taught(samples, 0)
        while 0 <= start < len(samples):
            self._net = _roomier(self._net)
            start, unit = self._taught(samples, start)
        return unit

    def _step(self, x: Array) -> int:
        return self._learn(x[None])

    def _learn(self, samples: Array) -> int:
        return self._run(self._padded(samples))

    def _winners(self, samples: Array) -> Integers:
        self._check_units()
        out = np.empty(len(samples), dtype=np.int64)
        winners(self._sheet(), self._units(), self.n_features_in_, self._padded(samples), out)
        return out

    def _squared(self, samples: Array) -> NDArray[np.float64]:
        self._check_units()
        out = np.empty((len(samples), self._units()))
        squared_from_units(self._sheet(), self._units(), self.n_features_in_, self._padded(samples), out)
        return out

    def _sheet(self) -> Array:
        """The codes as a single row, in which there may be more lanes than units."""
        return self._net.codes[:, None]

    def _adopt(self, arrays: dict[str, Array]) -> None:
        self._net = _net(arrays, [arrays[name] for name in self.VALUES])
        self._blank = np.zeros((1, len(self._net.codes)), self._net.codes.dtype)

    def _arrays(self) -> dict[str, Array]:
        net, (edges, ages) = self._net, _listed(self._net)
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

    def _lanes(self) -> Array:
        return self._net.codes[: self.n_features_in_, : self._units()]

    def _codes(self) -> Array:
        return np.ascontiguousarray(self._lanes().T)

    def __sklearn_is_fitted__(self) -> bool:
        return hasattr(self, "_net")


def _net(arrays: dict[str, Array], values: list[Array]) -> Net:
    """Lay out a state in tables."""
    codebook, edges = arrays["codebook"], arrays["edges"].reshape(-1, 2)
    (units, dims), ages = codebook.shape, arrays.get("ages", np.zeros(len(edges), dtype=np.int64))
    ends = np.concatenate([edges, edges[:, ::-1]])
    order = np.lexsort(ends.T[::-1])
    ends, both_ages = ends[order], np.concatenate([ages, ages])[order]
    degrees = np.bincount(ends[:, 0], minlength=units)
    widest = int(degrees.max(initial=0))
    capacity, width = -(-max(units + 1, 4 * LANES) // LANES) * LANES, max(widest + 2, WIDTH)
    net = _empty(padded_dims(dims), len(values), capacity, width, codebook.dtype)
    places = np.arange(len(ends)) - np.repeat(np.cumsum(degrees) - degrees, degrees)
    net.links[ends[:, 0], places], net.ages[ends[:, 0], places] = ends[:, 1], both_ages
    net.codes[:dims, :units], net.degrees[:units] = codebook.T, degrees
    net.counts[:], net.fade[:] = (units, int(arrays["samples_seen"]), widest), arrays.get("fade", 1.0)
    for row, value in zip(net.values, values, strict=True):
        row[:units] = value
    return net


def _empty(padded: int, kinds: int, capacity: int, width: int, precision: np.dtype[Any]) -> Net:
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


def _roomier(net: Net) -> Net:
    """The same net with room for twice as many units, or a few more edges, whichever has run out."""
    (padded, capacity), width = net.codes.shape, net.links.shape[1]
    more = capacity * 2 if net.counts[UNITS] >= capacity else capacity
    wider = width + STEP if net.counts[WIDEST] + 2 > width else width
    roomy = _empty(padded, len(net.values), more, wider, net.codes.dtype)
    roomy.codes[:, :capacity], roomy.values[:, :capacity] = net.codes, net.values
    roomy.links[:capacity, :width], roomy.ages[:capacity, :width] = net.links, net.ages
    roomy.degrees[:capacity], roomy.counts[:], roomy.fade[:] = net.degrees, net.counts, net.fade
    return roomy


def _listed(net: Net) -> tuple[Integers, Integers]:
    """The edges (edges, 2) of a net in rising order, and their ages."""
    units, places = np.nonzero(np.arange(net.links.shape[1]) < net.degrees[: net.counts[UNITS], None])
    others = net.links[units, places].astype(np.int64)
    once = units < others
    edges = np.stack([units[once], others[once]], axis=1)
    return edges, net.ages[units[once], places[once]].astype(np.int64)
