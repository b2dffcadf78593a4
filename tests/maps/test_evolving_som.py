"""The evolving self-organising map against its published steps."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from sklearn.exceptions import NotFittedError
from sklearn.utils.estimator_checks import check_estimator

from somatopy.maps.evolving_som import EvolvingSOM

Floats = NDArray[np.float64]
Edges = set[tuple[int, int]]


def slow_evolving(inputs: Floats, eps: float, gamma: float, every: int, most: int) -> tuple[Floats, Edges]:
    """The steps in plain NumPy: codes, and edges as a set of pairs."""
    codes, edges = np.empty((0, inputs.shape[1])), set()
    for t, v in enumerate(inputs, 1):
        seen = ~np.isnan(v)
        distances = np.sqrt(v.size / seen.sum() * ((v - codes)[:, seen] ** 2).sum(axis=1))
        nearest = [int(unit) for unit in np.argsort(distances, kind="stable")[:2]]
        if not nearest or (distances[nearest[0]] >= eps and len(codes) < most):
            known = codes[nearest[0]] if nearest else np.zeros(v.size)
            edges |= {(unit, len(codes)) for unit in nearest}
            codes = np.vstack([codes, np.where(seen, v, known)])
        else:
            moved = [u for u in range(len(codes)) if u == nearest[0] or {(u, nearest[0]), (nearest[0], u)} & edges]
            activation = np.exp(-2 * distances[moved] ** 2 / eps**2)
            share = gamma * activation / activation.sum()
            codes[moved] += np.where(seen, share[:, None] * (v - codes[moved]), 0)
            edges |= {(min(nearest), max(nearest))} if len(nearest) == 2 else set()
        if t % every == 0 and edges:
            edges.remove(max(sorted(edges), key=lambda e: float(np.linalg.norm(codes[e[0]] - codes[e[1]]))))
    return codes, edges


@pytest.mark.parametrize("gaps", [0.0, 0.2])
@pytest.mark.parametrize(("eps", "every", "most"), [(0.3, 5, 1000), (0.1, 20, 60), (0.05, 1, 1000), (3.0, 7, 5)])
@pytest.mark.parametrize("dims", [1, 2, 5])
def test_agrees_with_its_steps(dims: int, eps: float, every: int, most: int, gaps: float) -> None:
    """400 inputs, with and without gaps, lead to the units and edges of the steps in plain NumPy."""
    rng = np.random.default_rng(dims)
    inputs = rng.random((400, dims))
    inputs[:, 1:][rng.random((400, dims - 1)) < gaps] = np.nan
    trained = EvolvingSOM(eps, 0.1, every, most, missing="ignore").partial_fit(inputs)
    codes, edges = slow_evolving(inputs, eps, 0.1, every, most)
    np.testing.assert_allclose(trained.codebook_, codes, rtol=0, atol=1e-12)
    assert set(map(tuple, trained.topology_.edges.tolist())) == edges


def test_the_first_input_is_the_first_unit() -> None:
    """There is no unit before it; it becomes one to the last bit, wins, and a map of one unit has no edge."""
    trained = EvolvingSOM(threshold=0.5).initialise(2)
    with pytest.raises(NotFittedError, match="no units yet"):
        trained.winner([0.1, 0.7])
    assert trained.learn_one([0.1, 0.7]) == 0
    assert trained.codebook_.tolist() == [[0.1, 0.7]]
    assert trained.learn_one([0.2, 0.7]) == 0
    assert trained.topology_.edges.shape == (0, 2)


def test_an_input_becomes_a_unit_from_the_threshold_on() -> None:
    """At the threshold it does, below it the winner moves; it is joined to the two nearest and wins from then on."""
    trained = EvolvingSOM(threshold=1.0).partial_fit([[0.0], [0.9375], [1.0 - 2**-5]])
    assert len(trained.codebook_) == 1
    trained = EvolvingSOM(threshold=1.0).partial_fit([[0.0], [1.0]])
    assert trained.learn_one([3.0]) == 1
    assert trained.winner([3.0]) == (2, 0.0)
    assert trained.topology_.edges.tolist() == [[0, 1], [0, 2], [1, 2]]


def test_units_are_about_the_threshold_apart() -> None:
    """Where nothing moves, all units are at least the threshold apart, and no input is farther from its winner."""
    inputs = np.random.default_rng(0).random((3000, 2))
    trained = EvolvingSOM(threshold=0.1, learning_rate=1e-15).partial_fit(inputs)
    codes = trained.codebook_
    assert min(np.linalg.norm(codes[a] - codes[b]) for a, b in combinations(range(len(codes)), 2)) >= 0.1 - 1e-9
    assert trained.transform(inputs).min(axis=1).max() <= 0.1 + 1e-9


def test_a_full_map_moves_however_far_the_input_is() -> None:
    """With `max_units` units none is added; shares of the activation stay numbers where all activations underflow."""
    trained = EvolvingSOM(threshold=0.1, learning_rate=0.5, max_units=2).partial_fit([[0.0], [1.0]])
    assert trained.learn_one([1000.0]) == 1
    assert trained.codebook_.tolist() == [[0.0], [500.5]]


def test_gaps_of_a_new_unit_are_filled_by_the_winner() -> None:
    """Where the input of a new unit has NaN, the unit has the winner's code, and the first one 0."""
    trained = EvolvingSOM(threshold=0.5, missing="ignore").partial_fit([[np.nan, 1.0], [3.0, 4.0], [np.nan, 9.0]])
    assert trained.codebook_.tolist() == [[0.0, 1.0], [3.0, 4.0], [3.0, 9.0]]


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"threshold": 0}, "threshold must be a finite number over 0; got 0"),
        ({"learning_rate": 2}, "learning_rate must be a finite number over 0 and at most 1; got 2"),
        ({"prune_every": 0}, "prune_every must be a whole number, at least 1; got 0"),
        ({"max_units": None}, "max_units must be a whole number, at least 1; got None"),
    ],
)
def test_bad_parameters_are_refused_by_name(parameters: dict[str, Any], message: str) -> None:
    """The error says which parameter, its value and what is valid."""
    with pytest.raises(ValueError, match=message):
        EvolvingSOM(**parameters).fit([[0.1, 0.2]])


@pytest.mark.filterwarnings("ignore::sklearn.exceptions.SkipTestWarning")
def test_passes_scikit_learns_checks() -> None:
    """It is a scikit-learn estimator and transformer."""
    check_estimator(EvolvingSOM())
