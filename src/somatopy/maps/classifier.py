"""A classifier on top of a map: each unit says how often it has won which class."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, ClassifierMixin, clone
from sklearn.utils.multiclass import check_classification_targets
from sklearn.utils.validation import check_is_fitted, column_or_1d, validate_data

from somatopy.maps.base import Map
from somatopy.maps.som import SOM

__all__ = ["MapClassifier"]

Floats = NDArray[np.float64]


class MapClassifier(ClassifierMixin, BaseEstimator):  # type: ignore[misc]
    """Learns a map of the inputs without their classes, and then what share of each class every unit wins.

    The class of an input is the most frequent one of its unit: of the nearest unit that has won any input in `fit`.

    Args:
        map: the map, which is cloned and not changed; None is a `SOM` of 10 x 10 units.
        random_state: seed or NumPy Generator for the map; None leaves it its own.

    Attributes:
        classes_: the classes, in rising order, shape (classes,).
        map_: the map that has been learned.
        shares_: share of each class among the inputs that a unit has won, shape (units, classes); a row of zeros where
            it has won none.

    Example:
        >>> from sklearn.datasets import load_iris
        >>> from sklearn.model_selection import cross_val_score
        >>> X, y = load_iris(return_X_y=True, as_frame=True)
        >>> bool(cross_val_score(MapClassifier(random_state=0), X, y, cv=5).mean() > 0.9)
        True
    """

    def __init__(self, map: Map | None = None, random_state: int | np.random.Generator | None = None) -> None:
        self.map = map
        self.random_state = random_state

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Learn inputs X (n, dims) and their classes y (n,).

        Raises:
            ValueError: if they do not fit together, y is not classes, or the map refuses X.
        """
        chart = SOM(shape=(10, 10)) if self.map is None else clone(self.map)
        if self.random_state is not None:
            chart.set_params(random_state=self.random_state)
        validate_data(self, X, y, ensure_all_finite=False)
        check_classification_targets(y)
        self.classes_, which = np.unique(column_or_1d(y, warn=True), return_inverse=True)
        self.map_ = chart.fit(X)
        wins = np.zeros((len(self.map_.codebook_), len(self.classes_)))
        np.add.at(wins, (self.map_.labels_, which), 1.0)
        self.shares_ = wins / np.maximum(wins.sum(axis=1, keepdims=True), 1.0)
        return self

    def predict_proba(self, X: ArrayLike) -> Floats:
        """Share of each class in the unit of each row of X (n, dims), shape (n, classes)."""
        check_is_fitted(self)
        validate_data(self, X, reset=False, ensure_all_finite=False)
        won = np.flatnonzero(self.shares_.any(axis=1))
        nearest = [won[distances[:, won].argmin(axis=1)] for distances in self.map_.transform_chunks(X)]
        shares: Floats = self.shares_[np.concatenate(nearest)]
        return shares

    def predict(self, X: ArrayLike) -> NDArray[Any]:
        """The class of each row of X (n, dims), shape (n,); of classes equally frequent the first."""
        check_is_fitted(self)
        found: NDArray[Any] = self.classes_[self.predict_proba(X).argmax(axis=1)]
        return found

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.input_tags.allow_nan = getattr(self.map, "missing", "error") == "ignore"
        return tags
