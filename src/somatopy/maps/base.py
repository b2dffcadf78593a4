"""The contract that every self-organising map keeps, and what the maps share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.distance import cdist
from sklearn.base import BaseEstimator, ClassNamePrefixFeaturesOutMixin, TransformerMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from somatopy.maps.kernels import LARGEST

__all__ = ["Map", "as_sample", "refuse", "usable"]

Floats = NDArray[np.float64]


def as_sample(x: ArrayLike) -> Floats:
    """One input as an array of doubles.

    Raises:
        ValueError: if `x` is not a vector of numbers.
    """
    sample = np.asarray(x, dtype=np.float64)
    if sample.ndim != 1 or sample.size == 0:
        raise ValueError(f"an input must be one vector, shape (dims,); got shape {sample.shape}")
    return sample


def usable(values: Floats) -> bool:
    """Whether no value is NaN, infinite or so large that its square would be."""
    return bool((np.abs(values) <= LARGEST).all())


def refuse(samples: Floats) -> ValueError:
    """The error for samples that hold a value no map can learn, naming the first such value."""
    bad = np.argwhere(~(np.abs(samples) <= LARGEST))[0]
    place = ", ".join(str(i) for i in bad)
    return ValueError(
        f"input[{place}] is {samples[tuple(bad)]}: inputs must be finite and at most {LARGEST:g} in size; "
        "nothing has been learned from this call"
    )


class Map(ClassNamePrefixFeaturesOutMixin, TransformerMixin, BaseEstimator, ABC):  # type: ignore[misc]
    """A self-organising map that learns one input at a time: arrays in, arrays out.

    A concrete map gives the abstract methods; learning in batches, prediction and scikit-learn's conventions are
    here. `learn_one` and `partial_fit` go through the same kernel and agree to the last bit.

    Attributes:
        codebook_: the codes, shape (units, dims); a copy.
        n_features_in_: dims, once the map has been initialised.
    """

    n_features_in_: int

    @property
    @abstractmethod
    def codebook_(self) -> Floats:
        """The codes, shape (units, dims); a copy."""

    def code(self, unit: int) -> Floats:
        """The code of one unit, shape (dims,); a copy."""
        code: Floats = self.codebook_[unit]
        return code

    @abstractmethod
    def initialise(self, dims: int) -> Self:
        """Start anew: check the parameters, set the first codes, forget what was learned. Drawn codes are drawn here.

        Learning calls it on its first input where the caller has not.

        Raises:
            ValueError: if a parameter is not valid, or does not fit `dims`.
        """

    @abstractmethod
    def learn_one(self, x: ArrayLike) -> int:
        """Learn one input (dims,) and return its winner: the nearest unit before the update.

        Raises:
            ValueError: if the length is wrong or a value is not finite; then nothing has changed.
        """

    @abstractmethod
    def winner(self, x: ArrayLike) -> tuple[int, float]:
        """The unit nearest to `x` (the first of equals) and its Euclidean distance. Changes nothing.

        Raises:
            sklearn.exceptions.NotFittedError: before `initialise` or the first input; a ValueError.
            ValueError: if the length is wrong or a value is not finite.
        """

    @abstractmethod
    def state(self) -> dict[str, NDArray[Any]]:
        """All that learning has changed, as arrays (copies)."""

    @abstractmethod
    def restore(self, state: Mapping[str, ArrayLike]) -> None:
        """Take over the state of a map of the same parameters; learning then goes on bit for bit.

        Raises:
            ValueError: if arrays are missing or do not fit this map.
        """

    @abstractmethod
    def _learn(self, samples: Floats) -> None:
        """Learn usable samples (n, dims) in their order."""

    @abstractmethod
    def _winners(self, samples: Floats) -> NDArray[np.int64]:
        """The winner of each usable sample (n, dims)."""

    def partial_fit(self, X: ArrayLike, y: object = None) -> Self:
        """Learn the rows of X (n, dims) in their order, from where learning stands.

        Raises:
            ValueError: if X has not two axes and `n_features_in_` columns, or holds NaN or infinities; then nothing
                has changed.
        """
        fresh = not self.__sklearn_is_fitted__()
        samples = self._validated(X, reset=fresh)
        if fresh:
            self.initialise(samples.shape[1])
        self._learn(samples)
        return self

    def fit(self, X: ArrayLike, y: object = None) -> Self:
        """Start anew and learn the rows of X (n, dims) once, in their order.

        Raises:
            ValueError: if X has not two axes, or holds NaN or infinities, or a parameter is not valid.
        """
        samples = self._validated(X, reset=True)
        self.initialise(samples.shape[1])
        self._learn(samples)
        return self

    def predict(self, X: ArrayLike) -> NDArray[np.int64]:
        """The winner of each row of X (n, dims), shape (n,). Changes nothing."""
        check_is_fitted(self)
        return self._winners(self._validated(X, reset=False))

    def transform(self, X: ArrayLike) -> Floats:
        """Euclidean distance of each row of X (n, dims) to each unit, shape (n, units). Changes nothing."""
        check_is_fitted(self)
        distances: Floats = cdist(self._validated(X, reset=False), self.codebook_)
        return distances

    def _validated(self, X: ArrayLike, *, reset: bool) -> Floats:
        samples: Floats = validate_data(self, X, reset=reset, dtype=np.float64)
        if not usable(samples):
            raise refuse(samples)
        return samples

    @property
    def _n_features_out(self) -> int:
        return len(self.codebook_)

    @abstractmethod
    def __sklearn_is_fitted__(self) -> bool: ...
