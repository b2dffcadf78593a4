"""How maps learn a whole table, as estimators of scikit-learn do."""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import ceil
from typing import TYPE_CHECKING, Any, Self, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array
from sklearn.exceptions import ConvergenceWarning
from sklearn.utils.validation import check_array, check_is_fitted

from somatopy.maps.first_codes import filled
from somatopy.maps.start import check_units

if TYPE_CHECKING:
    from somatopy.maps.base import Map

__all__ = ["INPUTS_A_UNIT", "LearnsTables"]

Array = NDArray[Any]
Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Inputs a unit that fit learns where `epochs` is None: what T. Kohonen, Proceedings of the IEEE 78(9), 1990, asks for.
INPUTS_A_UNIT = 500
# Share of a table's variance by which units may be off the places where their rule would have them at rest. Maps that
# have learned to the end leave up to .1, since they grow or follow their last inputs; others up to all of it.
FAR = 0.15


class LearnsTables(ABC):
    """`fit` and what goes with it: the part of `Map` that knows all inputs at once.

    A map with a parameter `epochs` is shown the rows so many times, in a new random order each time; None is as many as
    make 500 inputs a unit, and one at least. A map without this parameter is shown the rows once, in their order.
    """

    random_state: int | np.random.Generator | None
    labels_: Integers
    n_iter_: int

    def fit(self, X: ArrayLike, y: object = None) -> Self:
        """Start anew from the rows of X (n, dims) and learn them, in `epochs` passes; schedules end when it ends.

        Raises:
            ValueError: if X has not two axes, or holds NaN or infinities, or a parameter is not valid; then nothing
                has changed.

        Warns:
            sklearn.exceptions.ConvergenceWarning: where units are far from their places of rest; see `unrest`.
        """
        with self._unchanged_if_refused():
            samples = self._usable_inputs(X, reset=True)
            rng = np.random.default_rng(self.random_state)
            self._go_on_from(self._fresh_arrays(samples, rng))
            passes = self._planned(samples, rng)
            for _ in range(passes):
                self._learn(samples[rng.permutation(len(samples))] if hasattr(self, "epochs") else samples)
            self.labels_, self.n_iter_ = self._winners(samples), passes
        self._warn_if_unfinished(samples)
        return self

    def fit_predict(self, X: ArrayLike, y: object = None) -> Integers:
        """Learn the rows of X (n, dims) by `fit`; return the winner of each afterwards, shape (n,)."""
        return self.fit(X).labels_

    def score(self, X: ArrayLike, y: object = None) -> float:
        """How near the units are to the rows of X (n, dims): minus the quantisation error, so that more is better."""
        from somatopy.maps.quality.errors import quantisation_error

        return -quantisation_error(cast("Map", self), X)

    def inverse_transform(self, X: ArrayLike) -> Array:
        """What the map makes of inputs whose distances to all units, shape (n, units), `transform` gave.

        Returns:
            The code of the nearest unit, for each row, shape (n, dims): the inputs as the map quantises them.

        Raises:
            ValueError: if there is not one distance for each unit, or one is not finite.
        """
        check_is_fitted(self)
        distances, codes = check_array(X), self._codes()
        if distances.shape[1] != len(codes):
            raise ValueError(
                f"X must have a distance to each of the {len(codes)} units, as transform gives them, shape "
                f"(n, {len(codes)}); got shape {distances.shape}"
            )
        quantised: Array = codes[distances.argmin(axis=1)]
        return quantised

    # What a map may do otherwise

    def _planned(self, samples: Array, rng: np.random.Generator) -> int:
        """How many times `fit` learns the samples (n, dims). What fades is made to have faded after them."""
        epochs = getattr(self, "epochs", 1)
        if epochs is None:
            return max(1, ceil(INPUTS_A_UNIT * self._units() / len(samples)))
        check_units("epochs", epochs)
        return int(epochs)

    def _neighbourhood(self, unit: int) -> Floats | None:
        """How strongly a unit is pulled, at last, where each unit wins, shape (units,); None if only where it does."""
        return None

    def _warn_if_unfinished(self, samples: Array) -> None:
        """Say so where the units have not come to the inputs that they win."""
        share = unrest(filled(samples), self.labels_, self._codes(), self._neighbourhood)
        if share > FAR:
            warnings.warn(
                f"learning has not ended: the units of this {type(self).__name__} are off the means of the inputs that "
                f"they learn from, by {100 * share:.0f} % of the variance of X. {self._mend()}",
                ConvergenceWarning,
                stacklevel=3,
            )

    def _mend(self) -> str:
        """What helps against that."""
        if not hasattr(self, "epochs"):
            return "It learned each row once: let partial_fit learn them again"
        return f"It learned {self.n_iter_} pass{'es' * (self.n_iter_ > 1)} over the rows: raise epochs"

    @contextmanager
    def _unchanged_if_refused(self) -> Iterator[None]:
        """Put everything back if an error comes."""
        before = dict(vars(self))
        try:
            yield
        except BaseException:
            self.__dict__.clear()
            self.__dict__.update(before)
            raise

    # What `Map` gives

    @abstractmethod
    def _usable_inputs(self, X: ArrayLike, *, reset: bool) -> Array: ...

    @abstractmethod
    def _fresh_arrays(self, samples: Array, rng: np.random.Generator) -> dict[str, Array]: ...

    @abstractmethod
    def _go_on_from(self, arrays: dict[str, Array]) -> None: ...

    @abstractmethod
    def _learn(self, samples: Array) -> int: ...

    @abstractmethod
    def _winners(self, samples: Array) -> Integers: ...

    @abstractmethod
    def _units(self) -> int: ...

    @abstractmethod
    def _codes(self) -> Array: ...


def unrest(
    table: Floats, winners: Integers, codes: Array, neighbourhood: Callable[[int], Floats | None] = lambda unit: None
) -> float:
    """Share of the variance of a table (n, dims) by which units that win rows are off their places of rest.

    A unit is at rest in the mean of the rows, each weighted by how strongly the unit is pulled where its winner is.
    """
    cells = csr_array((np.ones(len(table)), (winners, np.arange(len(table)))), shape=(len(codes), len(table)))
    sums, counts, squared = cells @ table, cells.sum(axis=1), 0.0
    for unit in np.flatnonzero(counts):
        pulls = neighbourhood(int(unit))
        rest = sums[unit] / counts[unit] if pulls is None else pulls @ sums / (pulls @ counts)
        squared += counts[unit] * float(((rest - codes[unit]) ** 2).sum())
    variance = float(((table - table.mean(axis=0)) ** 2).sum())
    return squared / variance if variance > 0 else 0.0
