"""A classifier on top of a map."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest
from sklearn import datasets
from sklearn.model_selection import cross_val_score
from sklearn.utils.estimator_checks import check_estimator

from somatopy.maps import SOM, GrowingNeuralGas, MapClassifier, NeuralGas

CORNERS = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 1.0]])


def labelled() -> MapClassifier:
    """Three units at three places, the third of which wins nothing: "a" twice and "b" once here, "b" once there."""
    still = NeuralGas(3, init=[[0.0, 0.0], [0.0, 1.0], [9.0, 9.0]], learning_rate=1e-12, epochs=1)
    X = [[0.0, 0.0], [0.1, 0.0], [0.0, 0.1], [0.0, 1.0]]
    classifier: MapClassifier = MapClassifier(still).fit(X, ["a", "b", "a", "b"])
    return classifier


def test_it_is_an_estimator() -> None:
    """scikit-learn's checks for classifiers."""
    check_estimator(MapClassifier(SOM(shape=(6, 6), epochs=20), random_state=0), on_skip=None)


@pytest.mark.filterwarnings("ignore:learning has not ended")
def test_probabilities_are_shares_of_what_the_unit_won() -> None:
    """And of a unit that has won nothing, those of the nearest that has."""
    classifier = labelled()
    np.testing.assert_allclose(classifier.shares_, [[2 / 3, 1 / 3], [0, 1], [0, 0]])
    found = classifier.predict_proba([[0.02, 0.02], [0.0, 0.9], [9.0, 9.1]])
    np.testing.assert_allclose(found, [[2 / 3, 1 / 3], [0, 1], [0, 1]])
    assert classifier.predict([[0.02, 0.02], [0.0, 0.9], [9.0, 9.1]]).tolist() == ["a", "b", "b"]


@pytest.mark.parametrize(
    ("chart", "load", "least"),
    [
        (None, datasets.load_iris, 0.9),
        (NeuralGas(60), datasets.load_wine, 0.6),
        (GrowingNeuralGas(max_units=200, epochs=20), datasets.load_digits, 0.9),
    ],
)
def test_it_tells_classes_that_lie_apart(chart: Any, load: Any, least: float) -> None:
    """On rows that it has not learned, with maps of any kind; the raw columns of wine are known to be hard."""
    X, y = load(return_X_y=True)
    assert cross_val_score(MapClassifier(chart, random_state=0), X, y, cv=3).mean() > least


def test_its_map_is_a_clone() -> None:
    """The one that is given stays as it was."""
    given = SOM(shape=(3, 3), epochs=1, random_state=0)
    classifier = MapClassifier(given, random_state=5).fit(CORNERS, [0, 1, 2])
    assert classifier.map_ is not given and not hasattr(given, "labels_")
    assert given.random_state == 0 and classifier.map_.random_state == 5


def test_columns_keep_their_names_and_gaps_are_learned_around() -> None:
    """What its map takes, it takes."""
    table = pd.DataFrame(CORNERS.repeat(5, axis=0), columns=["width", "height"])
    table.iloc[3, 1] = np.nan
    classifier = MapClassifier(SOM(shape=(3, 3), missing="ignore", random_state=0)).fit(table, np.arange(3).repeat(5))
    assert classifier.map_.feature_names_in_.tolist() == ["width", "height"]
    assert classifier.predict(pd.DataFrame({"width": [1.0, 0.0], "height": [np.nan, 1.0]})).tolist() == [2, 1]
    with pytest.raises(ValueError, match="feature names"):
        classifier.predict(table[["height", "width"]])
    with pytest.raises(ValueError, match="values must be finite"):
        MapClassifier(SOM(shape=(3, 3))).fit(table, np.arange(3).repeat(5))
