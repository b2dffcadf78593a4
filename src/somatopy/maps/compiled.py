"""What the maps with compiled kernels share: one call of a kernel for each call of a method."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.utils.validation import check_is_fitted

from somatopy.maps.base import Map
from somatopy.maps.inputs import real
from somatopy.maps.kernels import nearest, squared_from_units, winners

__all__ = ["CompiledMap"]

Array = NDArray[Any]
Integers = NDArray[np.int64]
Floats = NDArray[np.float64]


class CompiledMap(Map):
    """A map whose kernels learn, look, and check on the way whether inputs are usable.

    What keeps the codes, a `SheetMap` or a `GraphMap`, gives `_laid_out`; a concrete map gives `_start_from` and what
    calls its kernel.
    """

    _input_dtype: np.dtype[Any]

    @abstractmethod
    def _run(self, samples: Array, find: bool) -> tuple[int, int, float]:
        """Let the kernel learn samples (n, dims) in their order.

        Returns:
            The winner of the last sample before its update; -1, and nothing has changed, if a sample is not usable.
            Then the winner of the last sample after its update, and its distance, if `find` asks for them.
        """

    @abstractmethod
    def _start_from(self, samples: Array, rng: np.random.Generator) -> dict[str, Array]:
        """The state before the first input; see `Map`."""

    def _start(self, dims: int, rng: np.random.Generator) -> dict[str, Array]:
        return self._start_from(np.empty((0, dims)), rng)

    @abstractmethod
    def _laid_out(self) -> tuple[Array, int]:
        """The codes as kernels take them, (padded dims, rows, lanes), and the units in a row."""

    def learn_one(self, x: ArrayLike) -> int:
        """Learn one input (dims,) and return its winner; see `Map.learn_one`."""
        if "_input_dtype" not in self.__dict__:
            return super().learn_one(x)
        samples = self._kernel_input(x)
        winner, _, _ = self._run(samples, False)
        if winner < 0:
            raise self._refusal(samples[0])
        return winner

    def learn_and_find(self, x: ArrayLike) -> tuple[int, float]:
        """Learn one input (dims,), then find the unit nearest to it and its distance; see `Map.learn_and_find`."""
        if "_input_dtype" not in self.__dict__:
            return super().learn_and_find(x)
        samples = self._kernel_input(x)
        winner, unit, distance = self._run(samples, True)
        if winner < 0:
            raise self._refusal(samples[0])
        return unit, distance

    def winner(self, x: ArrayLike) -> tuple[int, float]:
        """The unit nearest to `x` and its Euclidean distance; see `Map.winner`."""
        if "_input_dtype" not in self.__dict__:
            check_is_fitted(self)  # raises; to ask it each time would take longer than all the rest
        samples, (codes, columns) = self._kernel_input(x), self._laid_out_units()
        unit, distance = nearest(codes, columns, self._allows_missing(), samples)
        if unit < 0:
            raise self._refusal(samples[0])
        return unit, distance

    def code(self, unit: int) -> Array:
        """The code of one unit, shape (dims,), without copying all others; see `Map.code`."""
        if "_input_dtype" not in self.__dict__:
            check_is_fitted(self)
        codes, columns = self._laid_out()
        try:
            row, column = divmod(unit, columns)
            code: Array = codes[: self.n_features_in_, row, column].copy()
        except (IndexError, ZeroDivisionError):
            raise IndexError(f"this map has units 0 to {self._units() - 1}; got {unit}") from None
        return code

    def _kernel_input(self, x: ArrayLike) -> Array:
        """One input as the kernels take it, shape (1, dims): a copy, whose values they check."""
        given = np.asanyarray(x)
        if given.dtype is not self._input_dtype or type(given) is not np.ndarray:  # most often there is nothing to ask
            given = real(given)
        if given.shape != (self.n_features_in_,):
            raise self._wrong_length(given)
        samples: Array = given.astype(self._input_dtype)[None]
        return samples

    def _step(self, x: Array) -> int:
        return self._learn(x[None])

    def _learn(self, samples: Array) -> int:
        return self._run(np.array(samples, order="C"), False)[0]

    def _winners(self, samples: Array) -> Integers:
        codes, columns = self._laid_out_units()
        out = np.empty(len(samples), dtype=np.int64)
        winners(codes, columns, np.array(samples, order="C"), out)
        return out

    def _squared(self, samples: Array) -> Floats:
        codes, columns = self._laid_out_units()
        out = np.empty((len(samples), codes.shape[1] * columns))
        squared_from_units(codes, columns, np.array(samples, order="C"), out)
        return out

    def _laid_out_units(self) -> tuple[Array, int]:
        """What `_laid_out` gives, if there are units."""
        codes, columns = self._laid_out()
        if not columns:
            raise self._without_units()
        return codes, columns

    def _units(self) -> int:
        codes, columns = self._laid_out()
        return int(codes.shape[1]) * columns

    def _take_over(self, arrays: dict[str, Array]) -> None:
        """Make these arrays what the map has learned; from then on the map has started."""
        self._input_dtype = arrays["codebook"].dtype

    def __sklearn_is_fitted__(self) -> bool:
        return "_input_dtype" in self.__dict__
