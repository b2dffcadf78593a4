"""Codebooks laid out for the kernels, and the maps that keep theirs so."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from somatopy.maps.compiled import CompiledMap
from somatopy.maps.kernels import LANES, padded_dims
from somatopy.maps.lattice import Lattice, check_shape

__all__ = ["FadingMap", "LatticeMap", "Sheet", "SheetMap"]

Array = NDArray[Any]


@dataclass
class Sheet:
    """The codes of a map in the kernels' layout, with scratch space.

    Attributes:
        codes: shape (padded dims, rows, lanes); see `kernels`.
        columns: units in a row; lanes beyond them are copies of the last.
        dims: dimensions of the inputs.
        work: scratch of the kernels that learn, shape (rows * lanes,).
    """

    codes: Array
    columns: int
    dims: int
    work: Array = field(repr=False)

    @classmethod
    def of(cls, codebook: Array, columns: int) -> Sheet:
        """Lay out a codebook (units, dims) in rows of `columns` units."""
        units, dims = codebook.shape
        rows, lanes = units // columns, -(-columns // LANES) * LANES
        codes = np.zeros((padded_dims(dims), rows, lanes), dtype=codebook.dtype)
        codes[:dims, :, :columns] = codebook.T.reshape(dims, rows, columns)
        codes[:, :, columns:] = codes[:, :, columns - 1 : columns]
        return cls(codes, columns, dims, np.empty(rows * lanes, codebook.dtype))

    @property
    def codebook(self) -> Array:
        """A copy of the codes, shape (units, dims)."""
        return np.ascontiguousarray(self.codes[: self.dims, :, : self.columns].reshape(self.dims, -1).T)


class SheetMap(CompiledMap):
    """A compiled map whose number of units never changes; its codes lie in a `Sheet`.

    A concrete map gives `_start_from`, `_units_in_a_row` and `_run`, and names in `COUNTERS` what its kernel remembers
    between inputs; these numbers are `self._memory`, in that order.
    """

    COUNTERS: ClassVar[tuple[str, ...]] = ("samples_seen",)
    _sheet: Sheet
    _memory: NDArray[np.float64]

    @abstractmethod
    def _units_in_a_row(self, units: int) -> int:
        """Units in a row of the sheet."""

    def _laid_out(self) -> tuple[Array, int]:
        return self._sheet.codes, self._sheet.columns

    def _take_over(self, arrays: dict[str, Array]) -> None:
        codebook = arrays["codebook"]
        memory = np.array([float(arrays[name]) for name in self.COUNTERS])
        self._sheet, self._memory = Sheet.of(codebook, self._units_in_a_row(len(codebook))), memory
        super()._take_over(arrays)

    def _state_arrays(self) -> dict[str, Array]:
        counters = {name: np.array(value) for name, value in zip(self.COUNTERS, self._memory, strict=True)}
        return {"codebook": self._codes(), **counters, "samples_seen": counters["samples_seen"].astype(np.int64)}

    def _check_state(self, arrays: dict[str, Array], expected: dict[str, Array]) -> None:
        super()._check_state(arrays, expected)
        if negative := {name: arrays[name] for name in self.COUNTERS if arrays[name] < 0}:
            raise ValueError(f"counters of a {type(self).__name__} are numbers from 0 up; got {negative}")

    def _codes(self) -> Array:
        return self._sheet.codebook


class FadingMap(SheetMap):
    """A map with a learning rate and a width that fade: over its parameter `horizon`, or over what `fit` learns.

    The latter is kept as "horizon" in the state; it is 0 where the parameter counts.
    """

    COUNTERS = ("samples_seen", "horizon")
    horizon: float

    def _planned(self, samples: Array, rng: np.random.Generator) -> int:
        passes = super()._planned(samples, rng)
        self._memory[1] = passes * len(samples)
        return passes

    @property
    def _fades_over(self) -> float:
        return float(self._memory[1]) or self.horizon


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
        return self._lattice if self.__sklearn_is_fitted__() else self._lattice_of_parameters()

    def _lattice_of_parameters(self) -> Lattice:
        """The lattice of the parameters, for the next start."""
        return Lattice(check_shape(self.shape), self.lattice, self.periodic)

    def _units_in_a_row(self, units: int) -> int:
        return int(self._geometry[-1, 0])

    def _take_over(self, arrays: dict[str, Array]) -> None:
        fixed = self._fixed
        self._lattice = Lattice(check_shape(fixed["shape"]), fixed["lattice"], fixed["periodic"])
        self._geometry = self._kernel_geometry(self._lattice)
        super()._take_over(arrays)

    def _kernel_geometry(self, lattice: Lattice) -> NDArray[np.float64]:
        """The lattice as the kernel has to measure it."""
        return lattice.geometry()
