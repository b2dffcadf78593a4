"""The dynamic self-organising map of Rougier and Boniface."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite, prod
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.utils.validation import check_is_fitted

from somatopy.maps.base import Map, as_sample, refuse, usable
from somatopy.maps.kernels import LARGEST, learn_dsom, nearest, winners
from somatopy.maps.lattice import Sheet, check_shape

__all__ = ["DSOM"]

Floats = NDArray[np.float64]

PRESETS = ("rougier",)


class DSOM(Map):
    r"""Dynamic self-organising map: a lattice that keeps learning, since nothing in its rule decays with time.

    For each input :math:`v`, with the winner :math:`s` the unit nearest to it, all codes move by

    .. math::
        \Delta w_i = \varepsilon \, \|v - w_i\|_\Omega \, h_\eta(i, s, v) \, (v - w_i)
        \qquad (1)

        h_\eta(i, s, v) = \exp\left(-\frac{1}{\eta^2} \frac{\|p_i - p_s\|^2}{\|v - w_s\|_\Omega^2}\right)
        \qquad (2)

    and none moves on an exact hit, :math:`v = w_s`. :math:`\|\cdot\|_\Omega` is the Euclidean distance divided by the
    greatest one met so far between any unit and any input; lattice positions :math:`p` run from 0 to 1 along each axis,
    divided by the square root of the number of axes longer than 1, so that opposite corners are 1 apart.

    Equation (2) divides by the *winner's* distance, as the map's authors compute it. Schillaci, Hafner and Lara (2014)
    print each unit's own distance :math:`\|v - w_i\|_\Omega` there; that widens the neighbourhood of far units and lets
    the map collapse.

    Sources: N. P. Rougier, Y. Boniface, Dynamic self-organising map, Neurocomputing 74(11), 2011; G. Schillaci,
    V. V. Hafner, B. Lara, Online learning of visuo-motor coordination in a humanoid robot, ICDL-EpiRob 2014, eq. 1, 2.

    Args:
        shape: units along each lattice axis, one or two numbers.
        learning_rate: :math:`\varepsilon`, in (0, 1].
        elasticity: :math:`\eta`, over 0: how strongly units are coupled. Large lattices need a small one.
        preset: how equations 1 and 2 are normalised. `rougier` is as above.
        bounds: range (low, high) of the start codes, for all dimensions or one pair for each, shape (dims, 2).
        init: "uniform" draws the start codes within `bounds`; an array (units, dims) gives them, units row by row.
        random_state: seed or NumPy Generator of the start codes.

    Example:
        >>> import numpy as np
        >>> inputs = np.random.default_rng(0).random((5000, 2))
        >>> dsom = DSOM(shape=(8, 8), elasticity=1.75, random_state=0)
        >>> winner = dsom.learn_one(inputs[0])
        >>> unit, distance = dsom.partial_fit(inputs[1:]).winner([0.5, 0.5])
        >>> distance < 0.1
        True
        >>> dsom.codebook_.shape
        (64, 2)
    """

    def __init__(
        self,
        shape: Sequence[int] = (30, 30),
        learning_rate: float = 0.1,
        elasticity: float = 0.1,
        preset: str = "rougier",
        bounds: ArrayLike = (0, 1),
        init: ArrayLike = "uniform",
        random_state: int | np.random.Generator | None = None,
    ) -> None:
        self.shape = shape
        self.learning_rate = learning_rate
        self.elasticity = elasticity
        self.preset = preset
        self.bounds = bounds
        self.init = init
        self.random_state = random_state

    @property
    def codebook_(self) -> Floats:
        """The codes, shape (units, dims); a copy."""
        check_is_fitted(self)
        return self._sheet.codebook

    def code(self, unit: int) -> Floats:
        """The code of one unit, shape (dims,), without copying all others; see `Map.code`."""
        check_is_fitted(self)
        return self._sheet.code(unit)

    def initialise(self, dims: int) -> Self:
        """Start anew for inputs of `dims` dimensions; see `Map.initialise`."""
        self._check_parameters()
        if dims < 1:
            raise ValueError(f"dims must be at least 1; got {dims!r}")
        self._begin(self._start_codes(dims), np.zeros(2))
        return self

    def learn_one(self, x: ArrayLike) -> int:
        """Learn one input (dims,) and return its winner; see `Map.learn_one`."""
        sample = np.asarray(x, dtype=np.float64)
        sheet = self.__dict__.get("_sheet") or self._first_sheet(sample)
        if sample.shape != (sheet.dims,):
            raise self._wrong_length(sample)
        sheet.slot[0, : sheet.dims] = sample
        unit = learn_dsom(
            sheet.codes, sheet.columns, self._memory, sheet.work, sheet.slot, self.learning_rate, self.elasticity
        )
        if unit < 0:
            raise refuse(sample)
        return unit

    def winner(self, x: ArrayLike) -> tuple[int, float]:
        """The unit nearest to `x` and its Euclidean distance; see `Map.winner`."""
        sample = np.asarray(x, dtype=np.float64)
        sheet = self.__dict__.get("_sheet") or check_is_fitted(self)
        if sample.shape != (sheet.dims,):
            raise self._wrong_length(sample)
        sheet.slot[0, : sheet.dims] = sample
        unit, distance = nearest(sheet.codes, sheet.columns, sheet.work, sheet.slot)
        if unit < 0:
            raise refuse(sample)
        return unit, distance

    def state(self) -> dict[str, NDArray[Any]]:
        """Arrays `codebook` (units, dims), `running_max_squared` and `samples_seen` (both of no dimension)."""
        check_is_fitted(self)
        running_max_squared, samples_seen = self._memory
        return {
            "codebook": self._sheet.codebook,
            "running_max_squared": np.array(running_max_squared),
            "samples_seen": np.array(int(samples_seen)),
        }

    def restore(self, state: Mapping[str, ArrayLike]) -> None:
        """Take over the state of a DSOM of the same shape; see `Map.restore`."""
        names = ("codebook", "running_max_squared", "samples_seen")
        if missing := [name for name in names if name not in state]:
            raise ValueError(f"the state of a DSOM lacks {missing}; it must have {list(names)}")
        self._check_parameters()
        codebook, *memory = (np.asarray(state[name], dtype=np.float64) for name in names)
        self._check_codes("the restored codebook", codebook, codebook.shape[-1] if codebook.ndim else 0)
        if any(value.ndim or not 0 <= value < np.inf for value in memory):
            raise ValueError(f"running_max_squared and samples_seen must be finite numbers from 0 up; got {memory}")
        self._begin(codebook, np.array(memory))

    def __sklearn_is_fitted__(self) -> bool:
        return hasattr(self, "_sheet")

    def _learn(self, samples: Floats) -> None:
        sheet = self._sheet
        learn_dsom(
            sheet.codes,
            sheet.columns,
            self._memory,
            sheet.work,
            sheet.padded(samples),
            self.learning_rate,
            self.elasticity,
        )

    def _winners(self, samples: Floats) -> NDArray[np.int64]:
        sheet, out = self._sheet, np.empty(len(samples), dtype=np.int64)
        winners(sheet.codes, sheet.columns, np.empty_like(sheet.work), sheet.padded(samples), out)
        return out

    def _begin(self, codebook: Floats, memory: Floats) -> None:
        self._sheet = Sheet.of(codebook, check_shape(self.shape))
        self._memory = memory
        self.n_features_in_ = codebook.shape[1]

    def _first_sheet(self, sample: Floats) -> Sheet:
        sample = as_sample(sample)
        if not usable(sample):
            raise refuse(sample)
        return self.initialise(sample.size)._sheet

    def _wrong_length(self, sample: Floats) -> ValueError:
        return ValueError(
            f"this map learns inputs of shape ({self.n_features_in_},); got shape {sample.shape}. "
            "Call initialise(dims) to start anew with another length"
        )

    def _check_parameters(self) -> None:
        check_shape(self.shape)
        if self.preset not in PRESETS:
            raise ValueError(f"unknown preset {self.preset!r}; valid presets: {list(PRESETS)}")
        if not 0 < self.learning_rate <= 1:
            raise ValueError(f"learning_rate must be over 0 and at most 1; got {self.learning_rate!r}")
        if not (self.elasticity > 0 and isfinite(self.elasticity)):
            raise ValueError(f"elasticity must be a finite number over 0; got {self.elasticity!r}")

    def _start_codes(self, dims: int) -> Floats:
        if isinstance(self.init, str):
            if self.init != "uniform":
                raise ValueError(f"init must be 'uniform' or an array (units, dims); got {self.init!r}")
            low, high = self._ranges(dims)
            units = prod(check_shape(self.shape))
            return np.random.default_rng(self.random_state).uniform(low, high, (units, dims))
        codes = np.asarray(self.init, dtype=np.float64)
        self._check_codes("init", codes, dims)
        return codes

    def _ranges(self, dims: int) -> tuple[Floats, Floats]:
        bounds = np.asarray(self.bounds, dtype=np.float64)
        fits = bounds.shape in ((2,), (dims, 2))
        if not fits or not usable(bounds) or not (bounds[..., 0] < bounds[..., 1]).all():
            raise ValueError(
                f"bounds must be finite (low, high) with low < high, or one such pair for each dimension, shape "
                f"({dims}, 2); got {self.bounds!r}"
            )
        return bounds[..., 0], bounds[..., 1]

    def _check_codes(self, name: str, codes: Floats, dims: int) -> None:
        expected = (prod(check_shape(self.shape)), dims)
        if codes.shape != expected or dims < 1:
            raise ValueError(
                f"{name} must have shape (units, dims), {expected} for the lattice {self.shape}; got {codes.shape}"
            )
        if not usable(codes):
            raise ValueError(f"{name} must be finite and at most {LARGEST:g} in size; it holds a value that is not")
