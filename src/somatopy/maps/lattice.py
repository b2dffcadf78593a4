"""Codebooks on one- and two-dimensional lattices, laid out for the kernels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import prod

import numpy as np
from numpy.typing import NDArray

from somatopy.maps.kernels import LANES, padded_dims, work_size

__all__ = ["Sheet", "check_shape"]

Floats = NDArray[np.float64]


def check_shape(shape: Sequence[int]) -> tuple[int, ...]:
    """The lattice shape as a tuple of ints.

    Raises:
        ValueError: if it is not one or two whole numbers, each at least 1.
    """
    try:
        axes = tuple(shape)
        valid = len(axes) in (1, 2) and all(isinstance(n, (int, np.integer)) and n >= 1 for n in axes)
    except TypeError:
        valid = False
    if not valid:
        raise ValueError(f"shape must be one or two whole numbers, each at least 1, such as (30, 30); got {shape!r}")
    return tuple(int(n) for n in axes)


@dataclass
class Sheet:
    """The codes of a lattice map in the kernels' layout, with the scratch space and the slot of one input.

    Attributes:
        codes: shape (padded dims, rows, lanes); see `kernels`.
        columns: columns of the lattice; lanes beyond them are copies of the last.
        dims: dimensions of the inputs.
        work: scratch of the kernels.
        slot: room for one input, shape (1, padded dims).
    """

    codes: Floats
    columns: int
    dims: int
    work: Floats = field(repr=False)
    slot: Floats = field(repr=False)

    @classmethod
    def of(cls, codebook: Floats, shape: tuple[int, ...]) -> Sheet:
        """Lay out a codebook (units, dims), its units row by row over a lattice of one or two axes."""
        rows, columns = (1, prod(shape)) if shape[-1] == 1 or len(shape) == 1 else shape
        dims, lanes = codebook.shape[1], -(-columns // LANES) * LANES
        codes = np.zeros((padded_dims(dims), rows, lanes))
        codes[:dims, :, :columns] = codebook.T.reshape(dims, rows, columns)
        codes[:, :, columns:] = codes[:, :, columns - 1 : columns]
        return cls(codes, columns, dims, np.empty(work_size(rows, lanes)), np.zeros((1, len(codes))))

    @property
    def codebook(self) -> Floats:
        """A copy of the codes, shape (units, dims)."""
        return np.ascontiguousarray(self.codes[: self.dims, :, : self.columns].reshape(self.dims, -1).T)

    def code(self, unit: int) -> Floats:
        """A copy of one unit's code, shape (dims,)."""
        row, column = divmod(unit, self.columns)
        return self.codes[: self.dims, row, column].copy()

    def padded(self, samples: Floats) -> Floats:
        """A copy of the samples (n, dims) with the kernels' number of dimensions."""
        out = np.zeros((len(samples), len(self.codes)))
        out[:, : self.dims] = samples
        return out
