"""The map that grows when required against its published steps, and when it does."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from sklearn.utils.estimator_checks import check_estimator

from somatopy.maps.grow_when_required import GrowWhenRequired

Floats = NDArray[np.float64]


class SlowGrowing:
    """The steps written down as they stand, with units as numbered dictionaries and edges as sets of two numbers."""

    def __init__(self, inputs: Floats) -> None:
        known = np.zeros(inputs.shape[1])
        self.units: list[dict[str, Any]] = []
        for i, v in enumerate(inputs[:2]):
            known = np.where(np.isnan(v), known, v)
            self.units.append({"id": i, "w": known.copy(), "h": 1.0})
        self.ages: dict[frozenset[int], int] = {}
        self.born = 2

    def neighbours(self, unit: dict[str, Any]) -> list[dict[str, Any]]:
        return [u for u in self.units if frozenset({u["id"], unit["id"]}) in self.ages and u is not unit]

    def learn(self, inputs: Floats, a_T: float, h_T: float, oldest: int, most: int) -> None:
        for v in inputs:
            seen = ~np.isnan(v)
            distances = [np.sqrt(v.size / seen.sum() * ((v - u["w"])[seen] ** 2).sum()) for u in self.units]
            s, t = (self.units[i] for i in np.argsort(distances, kind="stable")[:2])
            self.ages[frozenset({s["id"], t["id"]})] = 0
            if np.exp(-min(distances)) < a_T and s["h"] < h_T and len(self.units) < most:
                del self.ages[frozenset({s["id"], t["id"]})]
                self.ages |= {frozenset({u["id"], self.born}): 0 for u in (s, t)}
                self.units.append({"id": self.born, "w": np.where(seen, (s["w"] + v) / 2, s["w"]), "h": 1.0})
                self.born += 1
            else:
                for u, rate in [(s, 0.1), *((u, 0.01) for u in self.neighbours(s))]:
                    u["w"][seen] += rate * u["h"] * (v - u["w"])[seen]
            self.ages = {pair: age + (s["id"] in pair) for pair, age in self.ages.items()}
            for u, tau in [(s, 3.33), *((u, 14.3) for u in self.neighbours(s))]:
                rest = 1 - 1 / 1.05
                u["h"] = rest + (u["h"] - rest) * np.exp(-1.05 / tau)
            self.ages = {pair: age for pair, age in self.ages.items() if age <= oldest}
            for place in reversed(range(len(self.units))):
                if len(self.units) > 2 and not self.neighbours(self.units[place]):
                    self.units[place] = self.units[-1]
                    self.units.pop()

    def state(self) -> dict[str, Any]:
        places = {u["id"]: i for i, u in enumerate(self.units)}
        edges = sorted((*sorted(places[i] for i in pair), age) for pair, age in self.ages.items())
        kept = {name: np.array([u[key] for u in self.units]) for name, key in (("codebook", "w"), ("habituation", "h"))}
        return kept | {"edges": np.array(edges)[:, :2], "ages": np.array(edges)[:, 2]}


@pytest.mark.parametrize("gaps", [0.0, 0.2])
@pytest.mark.parametrize(
    ("dims", "a_T", "h_T", "oldest", "most"),
    [(1, 0.95, 0.2, 50, 1000), (2, 0.95, 0.5, 6, 1000), (4, 0.9, 0.3, 20, 25), (2, 1.0, 1.0, 4, 20)],
)
def test_agrees_with_its_steps(dims: int, a_T: float, h_T: float, oldest: int, most: int, gaps: float) -> None:
    """500 inputs, with and without gaps, lead to the units, edges, ages and habituation of plain Python."""
    rng = np.random.default_rng(dims)
    inputs = rng.random((500, dims))
    inputs[:, 1:][rng.random((500, dims - 1)) < gaps] = np.nan
    trained = GrowWhenRequired(a_T, h_T, max_age=oldest, max_units=most, missing="ignore").partial_fit(inputs)
    slow, state = SlowGrowing(inputs), trained.state()
    slow.learn(inputs[2:], a_T, h_T, oldest, most)
    for name, expected in slow.state().items():
        np.testing.assert_allclose(state[name], expected, rtol=0, atol=1e-12, err_msg=name)


def test_habituation_is_the_published_exponential() -> None:
    """After n wins a unit's habituation is 1 - (S / alpha) (1 - exp(-alpha n / tau)); its neighbour's is slower."""
    trained = GrowWhenRequired(firing_threshold=0.01, tau=5.0, neighbour_tau=20.0, alpha=1.2, stimulus=0.9)
    trained.partial_fit([[0.0], [1.0]])
    for n in range(1, 40):
        assert trained.learn_one([0.0]) == 0
        expected = [1 - 0.9 / 1.2 * (1 - np.exp(-1.2 * n / tau)) for tau in (5.0, 20.0)]
        np.testing.assert_allclose(trained.state()["habituation"], expected, rtol=0, atol=1e-12)


def square(seed: int, centre: float, count: int) -> Floats:
    """Inputs in a square half as wide as the unit square."""
    return np.random.default_rng(seed).uniform(centre - 0.25, centre + 0.25, (count, 2))


def units_after(trained: GrowWhenRequired, inputs: Floats) -> int:
    """How many units it has once it has learned the inputs."""
    return len(trained.partial_fit(inputs).codebook_)


@pytest.mark.parametrize("seed", range(5))
def test_grows_when_required_and_only_then(seed: int) -> None:
    """Growth ends on static data, goes on at a new place, and ends there; the old place is remembered."""
    trained = GrowWhenRequired(activity_threshold=0.9)
    first, later = (units_after(trained, square(seed + i, 0.25, 30_000)) for i in (0, 10))
    assert later <= first + 1
    moved, settled = (units_after(trained, square(seed + i, 0.75, 30_000)) for i in (20, 30))
    assert moved > 1.5 * later
    assert settled <= moved + 1
    for centre in (0.25, 0.75):
        near = np.exp(-trained.transform(square(seed + 40, centre, 2000)).min(axis=1)) > 0.9
        assert near.mean() > 0.98


def test_an_untrained_unit_moves_where_a_trained_one_would_be_helped() -> None:
    """However new the input, no unit is added before the winner has fired often enough."""
    trained = GrowWhenRequired(activity_threshold=0.99, firing_threshold=0.1).partial_fit([[0.0], [1.0]])
    sizes = [units_after(trained, np.array([[-1.0]])) for _ in range(15)]
    wins = next(n for n in range(100) if 1 - (1 - np.exp(-1.05 * n / 3.33)) / 1.05 < 0.1)
    assert sizes == [2] * wins + [3] + sizes[wins + 1 :]


def test_keeps_its_invariants_while_units_come_and_go() -> None:
    """Edges are no older than `max_age`, of three units or more each has one, habituation stays in its range."""
    trained, sizes = GrowWhenRequired(0.9, 0.5, max_age=4, max_units=15), set()
    for x in np.random.default_rng(0).normal(size=(500, 2)):
        trained.learn_one(x)
        state = trained.state()
        sizes.add(len(state["codebook"]))
        assert set(state["ages"].tolist()) <= {0, 1, 2, 3, 4}
        assert set(state["edges"].ravel().tolist()) == set(range(len(state["codebook"]))) or len(state["codebook"]) <= 2
        assert (state["habituation"] >= 1 - 1 / 1.05).all()
        assert (state["habituation"] <= 1).all()
    assert max(sizes) == 15
    assert len(sizes) > 5


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"activity_threshold": 0}, "activity_threshold must be a finite number over 0 and at most 1; got 0"),
        ({"firing_threshold": 2}, "firing_threshold must be a finite number over 0 and at most 1; got 2"),
        ({"learning_rate": np.nan}, "learning_rate must be a finite number"),
        ({"neighbour_rate": -1}, "neighbour_rate must be a finite number"),
        ({"tau": 0}, "tau must be a finite number over 0; got 0"),
        ({"neighbour_tau": 0}, "neighbour_tau must be a finite number over 0; got 0"),
        ({"alpha": 0}, "alpha must be a finite number over 0; got 0"),
        ({"stimulus": 1.1}, "stimulus must be a finite number over 0 and at most 1.05; got 1.1"),
        ({"max_age": 0}, "max_age must be a whole number, at least 1; got 0"),
        ({"max_units": 1}, "max_units must be a whole number, at least 2; got 1"),
    ],
)
def test_bad_parameters_are_refused_by_name(parameters: dict[str, Any], message: str) -> None:
    """The error says which parameter, its value and what is valid."""
    with pytest.raises(ValueError, match=message):
        GrowWhenRequired(**parameters).fit([[0.1, 0.2]])


@pytest.mark.filterwarnings("ignore::sklearn.exceptions.SkipTestWarning")
def test_passes_scikit_learns_checks() -> None:
    """It is a scikit-learn estimator and transformer."""
    check_estimator(GrowWhenRequired())
