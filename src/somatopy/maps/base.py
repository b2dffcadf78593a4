"""The contract that every self-organising map keeps, and what the maps share."""

from __future__ import annotations

import os
from abc import abstractmethod
from collections.abc import Iterator, Mapping
from copy import deepcopy
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, ClassNamePrefixFeaturesOutMixin, TransformerMixin
from sklearn.exceptions import NotFittedError
from sklearn.utils.validation import check_is_fitted, validate_data

from somatopy.maps.distances import squared_distances
from somatopy.maps.fitting import LearnsTables
from somatopy.maps.inputs import LIMITS, MISSING, no_numbers, real, refusal, restored, unmasked, unusable
from somatopy.maps.start import check_units
from somatopy.maps.topology import Topology

__all__ = ["Map"]

Array = NDArray[Any]
Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

CHUNK = 2**22  # distances worked on at a time


class Map(LearnsTables, ClassNamePrefixFeaturesOutMixin, TransformerMixin, BaseEstimator):  # type: ignore[misc]
    """A self-organising map that learns one input at a time: arrays in, arrays out.

    A concrete map gives `_start` and `_step`; a map with compiled kernels overrides what it can do faster. Everything
    that learning changes is an array in the dictionary `_learned`, so that any map can be saved and continued. Beside
    its own parameters a map has these:

    Args:
        dtype: precision of codes and computation, "float64" or "float32".
        missing: what to do where an input has NaN: "error" refuses it; "ignore" learns from, and compares, the
            coordinates that were observed (distances are scaled up to all dimensions, as in
            `sklearn.metrics.pairwise.nan_euclidean_distances`). What a masked array of NumPy hides counts as NaN.
        random_state: seed or NumPy Generator of the start codes.

    Attributes:
        codebook_: the codes, shape (units, dims); a copy.
        topology_: which units are neighbours; a `Topology`.
        samples_seen_: inputs learned so far.
        n_features_in_: dims, once the map has been initialised.
        feature_names_in_: names of the columns, where the inputs came in a table that has them.
        labels_: the winner of each row that `fit` learned, once it had ended, shape (n,).
        n_iter_: how many times `fit` went through the rows.
    """

    dtype: str
    missing: str
    random_state: int | np.random.Generator | None
    n_features_in_: int
    #: Parameters that hold from one start to the next: setting them while the map learns changes nothing until then.
    FIXED: ClassVar[tuple[str, ...]] = ("dtype",)
    _fixed: dict[str, Any]
    _learned: dict[str, Array]

    # What a concrete map gives

    @abstractmethod
    def _start(self, dims: int, rng: np.random.Generator) -> dict[str, Array]:
        """The state before the first input: "codebook" (units, dims), and all else that learning changes.

        Raises:
            ValueError: if a parameter of the map is not valid, or does not fit `dims`.
        """

    def _start_from(self, samples: Array, rng: np.random.Generator) -> dict[str, Array]:
        """The same for a map that will learn these samples (n, dims); n is 0 where learning starts without data."""
        return self._start(samples.shape[1], rng)

    @abstractmethod
    def _step(self, x: Array) -> int:
        """Learn one usable input (dims,) by changing `self._learned`; return its winner before the update."""

    @property
    def topology_(self) -> Topology:
        """Which units are neighbours.

        Raises:
            AttributeError: if the map has no such thing.
        """
        raise AttributeError(f"a {type(self).__name__} has no topology: none of its units are neighbours")

    # Learning

    def initialise(self, dims: int) -> Self:
        """Start anew: check the parameters, set the first codes, forget what was learned. Drawn codes are drawn here.

        Learning calls it on its first input where the caller has not.

        Raises:
            ValueError: if a parameter is not valid, or does not fit `dims`.
        """
        check_units("dims", dims)
        self._go_on_from(self._fresh_arrays(np.empty((0, int(dims))), np.random.default_rng(self.random_state)))
        self.__dict__.pop("feature_names_in_", None)
        return self

    def learn_one(self, x: ArrayLike) -> int:
        """Learn one input (dims,) and return its winner: the nearest unit before the update.

        Raises:
            ValueError: if the length is wrong or a value is not finite; then nothing has changed.
        """
        sample = self._usable_input(x)
        if not self.__sklearn_is_fitted__():
            self.initialise(sample.size)
        return self._learn(sample[None])

    def partial_fit(self, X: ArrayLike, y: object = None) -> Self:
        """Learn the rows of X (n, dims) in their order, from where learning stands: no schedule starts again.

        Raises:
            ValueError: if X has not two axes and `n_features_in_` columns, or holds NaN or infinities; then nothing
                has changed.
        """
        if self.__sklearn_is_fitted__():
            self._learn(self._usable_inputs(X, reset=False))
            return self
        with self._unchanged_if_refused():
            samples = self._usable_inputs(X, reset=True)
            self._go_on_from(self._fresh_arrays(samples[:0], np.random.default_rng(self.random_state)))
            self._learn(samples)
        return self

    def learn_and_find(self, x: ArrayLike) -> tuple[int, float]:
        """Learn one input (dims,), then find the unit that is nearest to it after the update, and its distance.

        The same as `learn_one` and then `winner`, to the last bit; compiled maps do both in one call.

        Raises:
            ValueError: if the length is wrong or a value is not finite; then nothing has changed.
        """
        self.learn_one(x)
        return self.winner(x)

    # Looking

    @property
    def codebook_(self) -> Array:
        """The codes, shape (units, dims); a copy."""
        check_is_fitted(self)
        return self._codes().copy()

    @property
    def samples_seen_(self) -> int:
        """Inputs learned so far."""
        check_is_fitted(self)
        return int(self._state_arrays()["samples_seen"])

    def code(self, unit: int) -> Array:
        """The code of one unit, shape (dims,); a copy."""
        check_is_fitted(self)
        code: Array = self._codes()[unit].copy()
        return code

    def winner(self, x: ArrayLike) -> tuple[int, float]:
        """The unit nearest to `x` (the first of equals) and its Euclidean distance. Changes nothing.

        Raises:
            sklearn.exceptions.NotFittedError: before `initialise` or the first input; a ValueError.
            ValueError: if the length is wrong or a value is not finite.
        """
        units, distances = self.winners(x, 1)
        return int(units[0]), float(distances[0])

    def winners(self, x: ArrayLike, k: int = 2) -> tuple[Integers, Floats]:
        """The k units nearest to `x`, the nearest first, and their Euclidean distances, both of shape (k,).

        Raises:
            sklearn.exceptions.NotFittedError: before `initialise` or the first input; a ValueError.
            ValueError: if the length is wrong, a value is not finite, or the map has fewer than k units.
        """
        check_is_fitted(self)
        squared = self._squared(self._usable_input(x)[None])[0]
        if not (isinstance(k, (int, np.integer)) and 1 <= k <= squared.size):
            raise ValueError(f"k must be a whole number from 1 to {squared.size}, the units of this map; got {k!r}")
        units = np.argsort(squared, kind="stable")[:k]
        return units, np.sqrt(squared[units])

    def predict(self, X: ArrayLike) -> Integers:
        """The winner of each row of X (n, dims), shape (n,). Changes nothing."""
        check_is_fitted(self)
        return self._winners(self._usable_inputs(X, reset=False))

    def transform(self, X: ArrayLike) -> Floats:
        """Euclidean distance of each row of X (n, dims) to each unit, shape (n, units). Changes nothing."""
        check_is_fitted(self)
        return self._distances(self._usable_inputs(X, reset=False))

    def transform_chunks(self, X: ArrayLike) -> Iterator[Floats]:
        """What `transform` gives, some rows at a time, so that memory does not grow with X."""
        check_is_fitted(self)
        samples = self._usable_inputs(X, reset=False)
        rows = self._chunk()
        for start in range(0, len(samples), rows):
            yield self._distances(samples[start : start + rows])

    # Keeping

    def state(self) -> dict[str, Array]:
        """All that learning has changed, as arrays (copies)."""
        check_is_fitted(self)
        return {name: value.copy() for name, value in self._state_arrays().items()}

    def restore(self, state: Mapping[str, ArrayLike]) -> None:
        """Take over the state of a map of the same parameters; learning then goes on bit for bit.

        Raises:
            ValueError: if arrays are missing or do not fit this map; then nothing has changed.
        """
        codebook = np.asarray(state.get("codebook", 0.0))
        if codebook.ndim != 2 or codebook.shape[1] < 1:
            raise ValueError(f"a state needs a codebook of shape (units, dims); this one has {sorted(state)}")
        expected = self._fresh_arrays(np.zeros((1, codebook.shape[1])), np.random.default_rng(0))
        if wrong := set(expected) ^ set(state):
            raise ValueError(
                f"the state of a {type(self).__name__} has {sorted(expected)}; {sorted(wrong)} are missing or unknown"
            )
        arrays = {name: restored(name, state[name], like.dtype) for name, like in expected.items()}
        self._check_state(arrays, expected)
        if arrays["samples_seen"].shape or arrays["samples_seen"] < 0:
            raise ValueError(f"the restored samples_seen must be a number from 0 up; got {arrays['samples_seen']}")
        if self.__dict__.get("n_features_in_") != codebook.shape[1]:
            self.__dict__.pop("feature_names_in_", None)
        self._go_on_from(arrays)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the map to one .npz file: parameters as JSON, all that was learned as arrays, nothing pickled.

        `load_map` reads it; learning then goes on bit for bit.

        Raises:
            ValueError: if a parameter is of a kind that JSON has no word for, or what was learned does not fit the
                parameters, as after a change of `shape` while learning; then nothing has been written.
        """
        from somatopy.maps.storage import save_map

        save_map(self, path)

    # What the maps share. A map with a layout of its own overrides `_take_over`, `_state_arrays` and `_codes`, and
    # what it can do faster

    def _fresh_arrays(self, samples: Array, rng: np.random.Generator) -> dict[str, Array]:
        """What `_start_from` gives, in the map's precision, with the number of inputs."""
        precision = self._checked_precision()
        arrays = self._start_from(samples, rng)
        codebook = np.array(arrays["codebook"], dtype=np.float64)
        if not (np.abs(codebook) <= LIMITS[precision]).all():
            raise ValueError(f"start codes must be at most {LIMITS[precision]:g} in size for {precision}")
        codebook = codebook.astype(precision)
        return {**arrays, "codebook": codebook, "samples_seen": np.array(0)}

    def _checked_precision(self) -> str:
        """The precision that is asked for, if there is such a one."""
        try:
            precision = np.dtype(self.dtype).name
        except TypeError:
            precision = ""
        if precision not in LIMITS:
            raise ValueError(f"unknown dtype {self.dtype!r}; valid: {list(LIMITS)}")
        self._allows_missing()
        return precision

    def _allows_missing(self) -> bool:
        """Whether values may be missing."""
        try:
            return MISSING[self.missing]
        except (KeyError, TypeError):
            raise ValueError(f"unknown missing {self.missing!r}; valid: {list(MISSING)}") from None

    def _go_on_from(self, arrays: dict[str, Array]) -> None:
        """Start, or go on, from a whole state."""
        fixed = {name: deepcopy(getattr(self, name)) for name in self.FIXED}
        for name in ("labels_", "n_iter_"):
            self.__dict__.pop(name, None)
        self._fixed, self.n_features_in_ = fixed, arrays["codebook"].shape[1]
        self._take_over(arrays)

    def _check_state(self, arrays: dict[str, Array], expected: dict[str, Array]) -> None:
        """Refuse arrays that do not fit; `expected` is the state of a map that has learned nothing."""
        for name, values in arrays.items():
            if values.shape != expected[name].shape:
                raise ValueError(
                    f"the restored {name} must have shape {expected[name].shape} for this map; got {values.shape}"
                )

    def _take_over(self, arrays: dict[str, Array]) -> None:
        """Make these arrays what the map has learned."""
        self._learned = arrays

    def _state_arrays(self) -> dict[str, Array]:
        """All that learning has changed, perhaps not copies."""
        return self._learned

    def _codes(self) -> Array:
        """The codes (units, dims), perhaps not a copy."""
        return self._learned["codebook"]

    def _learn(self, samples: Array) -> int:
        """Learn usable samples (n, dims) in their order; return the last winner before its update."""
        unit = -1
        for sample in samples:
            unit = self._step(sample)
            self._learned["samples_seen"] += 1
        return unit

    def _winners(self, samples: Array) -> Integers:
        """The winner of each usable sample (n, dims)."""
        rows = self._chunk()
        found = [self._squared(samples[t : t + rows]).argmin(axis=1) for t in range(0, len(samples), rows)]
        return np.concatenate(found)

    def _chunk(self) -> int:
        """How many inputs are looked at together."""
        return max(1, CHUNK // max(self._units(), 1))

    def _units(self) -> int:
        """Number of units."""
        return len(self._codes())

    def _distances(self, samples: Array) -> Floats:
        """Euclidean distances of usable samples (n, dims) to the units, shape (n, units)."""
        distances: Floats = np.sqrt(self._squared(samples))
        return distances

    def _squared(self, samples: Array) -> Floats:
        """Their squares, by which winners are found."""
        if not self._units():
            raise self._without_units()
        return squared_distances(samples, self._codes())

    def _without_units(self) -> NotFittedError:
        return NotFittedError(f"this {type(self).__name__} has no units yet; let it learn an input first")

    def _usable_input(self, x: ArrayLike) -> Array:
        """One usable input (dims,), a copy in the map's precision."""
        sample = real(x).astype(self._precision())
        if self.__sklearn_is_fitted__() and sample.shape != (self.n_features_in_,):
            raise self._wrong_length(sample)
        if sample.ndim != 1 or sample.size == 0:
            raise ValueError(f"an input must be one vector, shape (dims,); got shape {sample.shape}")
        if unusable(sample[None], self._allows_missing()).any():
            raise self._refusal(sample)
        return sample

    def _usable_inputs(self, X: ArrayLike, *, reset: bool) -> Array:
        """Usable inputs (n, dims) in the map's precision."""
        dtype = self._checked_precision() if reset else self._precision()
        try:
            samples: Array = validate_data(self, unmasked(X), reset=reset, dtype=dtype, ensure_all_finite=False)
        except (TypeError, ValueError) as error:
            if said := no_numbers(X):
                error.add_note(said)
            raise
        if unusable(samples, self._allows_missing()).any():
            raise self._refusal(samples)
        return samples

    def _precision(self) -> str:
        """The precision of the codes; before there are any, the one that they will have."""
        return np.dtype(self._fixed["dtype"]).name if self.__sklearn_is_fitted__() else self._checked_precision()

    def _refusal(self, samples: Array) -> ValueError:
        return refusal(samples, self._allows_missing())

    def _wrong_length(self, sample: Array) -> ValueError:
        return ValueError(
            f"this map learns inputs of shape ({self.n_features_in_},); got shape {sample.shape}. "
            "Call initialise(dims) to start anew with another length"
        )

    @property
    def _n_features_out(self) -> int:
        return self._units()

    def __setstate__(self, state: dict[str, Any]) -> None:
        super().__setstate__(state)
        if self.__sklearn_is_fitted__():
            self._take_over(self.state())  # in arrays of its own: a worker process is given some that cannot be written

    def __sklearn_is_fitted__(self) -> bool:
        return hasattr(self, "_learned")

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.input_tags.allow_nan = getattr(self, "missing", "error") == "ignore"
        return tags
