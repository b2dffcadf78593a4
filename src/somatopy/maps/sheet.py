"""Codebooks laid out for the kernels, and the maps that keep theirs so."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.utils.validation import check_is_fitted

from somatopy.maps.base import Map
from somatopy.maps.inputs import real
from somatopy.maps.kernels import LANES, nearest, padded_dims, squared_from_units, winners
from somatopy.maps.lattice import Lattice, check_shape

__all__ = ["LatticeMap", "Sheet", "SheetMap"]

Array = NDArray[Any]


@dataclass
class Sheet:
    """The codes of a map in the kernels' layout, with scratch space.

    Attributes:
        codes: shape (padded dims, rows, lanes); see `kernels`.
        columns: units in a row; lanes beyond them are copies of the last.
        dims: dimensions of the inputs.
        work: scratch of the kernels that learn, shape (rows * lanes,).
        blank: one input of zeros, shape (1, padded dims), to be copied.
    """

    codes: Array
    columns: int
    dims: int
    work: Array = field(repr=False)
    blank: Array = field(repr=False)

    @classmethod
    def of(cls, codebook: Array, columns: int) -> Sheet:
        """Lay out a codebook (units, dims) in rows of `columns` units."""
        units, dims = codebook.shape
        rows, lanes = units // columns, -(-columns // LANES) * LANES
        codes = np.zeros((padded_dims(dims), rows, lanes), dtype=codebook.dtype)
        codes[:dims, :, :columns] = codebook.T.reshape(dims, rows, columns)
        codes[:, :, columns:] = codes[:, :, columns - 1 : columns]
        work, blank = np.empty(rows * lanes, codebook.dtype), np.zeros((1, len(codes)), codebook.dtype)
        return cls(codes, columns, dims, work, blank)

    @property
    def codebook(self) -> Array:
        """A copy of the codes, shape (units, dims)."""
        return np.ascontiguousarray(self.codes[: self.dims, :, : self.columns].reshape(self.dims, -1).T)

    def code(self, unit: int) -> Array:
        """A copy of one unit's code, shape (dims,)."""
        units = self.codes.shape[1] * self.columns
        if not -units <= unit < units:
            raise IndexError(f"this map has units 0 to {units - 1}; got {unit}")
        row, column = divmod(unit, self.columns)
        return self.codes[: self.dims, row, column].copy()

    def padded(self, samples: Array) -> Array:
        """A copy of the samples (n, dims) with the kernels' number of dimensions."""
        out = np.zeros((len(samples), len(self.codes)), self.codes.dtype)
        out[:, : self.dims] = samples
        return out


class SheetMap(Map):
    """A map of as many units for ever, whose compiled kernels work on a `Sheet`.

    A concrete map gives `_start`, `_columns` and `_run`, and names in `COUNTERS` what its kernel remembers between
    inputs; these numbers are `self._memory`, in that order.
    """

    COUNTERS: ClassVar[tuple[str, ...]] = ("samples_seen",)
    _sheet: Sheet
    _memory: NDArray[np.float64]

    @abstractmethod
    def _columns(self, units: int) -> int:
        """Units in a row of the sheet."""

    @abstractmethod
    def _run(self, samples: Array) -> int:
        """Let the kernel learn samples (n, padded dims): the last winner, or -1 and nothing, if any is not usable."""

    def learn_one(self, x: ArrayLike) -> int:
        """Learn one input (dims,) and return its winner; see `Map.learn_one`."""
        if "_sheet" not in self.__dict__:
            return super().learn_one(x)
        samples = self._one(x)
        unit = self._run(samples)
        if unit < 0:
            raise self._refusal(samples[0, : self._sheet.dims])
        return unit

    def winner(self, x: ArrayLike) -> tuple[int, float]:
        """The unit nearest to `x` and its Euclidean distance; see `Map.winner`."""
        sheet = self.__dict__.get("_sheet") or check_is_fitted(self)
        samples = self._one(x)
        unit, distance = nearest(sheet.codes, sheet.columns, sheet.dims, self._ruled()[0], samples)
        if unit < 0:
            raise self._refusal(samples[0, : sheet.dims])
        return unit, distance

    def code(self, unit: int) -> Array:
        """The code of one unit, shape (dims,), without copying all others; see `Map.code`."""
        sheet = self.__dict__.get("_sheet") or check_is_fitted(self)  # which takes longer than all the rest
        code: Array = sheet.code(unit)
        return code

    def _one(self, x: ArrayLike) -> Array:
        """One input as the kernels take it, not checked yet."""
        sample, sheet = real(x), self._sheet
        if sample.shape != (sheet.dims,):
            raise self._wrong_length(sample)
        samples = sheet.blank.copy()
        samples[0, : sheet.dims] = sample
        return samples

    def _step(self, x: Array) -> int:
        return self._learn(x[None])

    def _learn(self, samples: Array) -> int:
        return self._run(self._sheet.padded(samples))

    def _winners(self, samples: Array) -> NDArray[np.int64]:
        sheet, out = self._sheet, np.empty(len(samples), dtype=np.int64)
        winners(sheet.codes, sheet.columns, sheet.dims, sheet.padded(samples), out)
        return out

    def _squared(self, samples: Array) -> NDArray[np.float64]:
        sheet, out = self._sheet, np.empty((len(samples), self._units()))
        squared_from_units(sheet.codes, sheet.columns, sheet.dims, sheet.padded(samples), out)
        return out

    def _adopt(self, arrays: dict[str, Array]) -> None:
        codebook = arrays["codebook"]
        memory = np.array([float(arrays[name]) for name in self.COUNTERS])
        self._sheet, self._memory = Sheet.of(codebook, self._columns(len(codebook))), memory

    def _arrays(self) -> dict[str, Array]:
        counters = {name: np.array(value) for name, value in zip(self.COUNTERS, self._memory, strict=True)}
        return {"codebook": self._codes(), **counters, "samples_seen": counters["samples_seen"].astype(np.int64)}

    def _check_state(self, arrays: dict[str, Array], expected: dict[str, Array]) -> None:
        super()._check_state(arrays, expected)
        if negative := {name: arrays[name] for name in self.COUNTERS if arrays[name] < 0}:
            raise ValueError(f"counters of a {type(self).__name__} are numbers from 0 up; got {negative}")

    def _codes(self) -> Array:
        return self._sheet.codebook

    def _units(self) -> int:
        return int(self._sheet.codes.shape[1]) * self._sheet.columns

    def __sklearn_is_fitted__(self) -> bool:
        return hasattr(self, "_sheet")


class LatticeMap(SheetMap):
    """A map whose units lie on a lattice. It has the parameters `shape`, `lattice` and `periodic` of `Lattice`."""

    FIXED: ClassVar[tuple[str, ...]] = ("dtype", "shape", "lattice", "periodic")
    shape: Sequence[int]
    lattice: str
    periodic: bool
    _lattice: Lattice
    _geometry: NDArray[np.float64]

    @property
    def topology_(self) -> Lattice:
        """The lattice; before the map has started, the one that it will have."""
        return self._lattice if self.__sklearn_is_fitted__() else self._asked_lattice()

    def _asked_lattice(self) -> Lattice:
        """The lattice of the parameters, for the next start."""
        return Lattice(check_shape(self.shape), self.lattice, self.periodic)

    def _columns(self, units: int) -> int:
        return int(self._geometry[-1, 0])

    def _adopt(self, arrays: dict[str, Array]) -> None:
        fixed = self._fixed
        self._lattice = Lattice(check_shape(fixed["shape"]), fixed["lattice"], fixed["periodic"])
        self._geometry = self._measured(self._lattice)
        super()._adopt(arrays)

    def _measured(self, lattice: Lattice) -> NDArray[np.float64]:
        """The lattice as the kernel has to measure it."""
        return lattice.geometry()
