"""The growing neural gas against its published steps, on data that stand and that move."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from sklearn.utils.estimator_checks import check_estimator

from somatopy.maps.growing_neural_gas import GrowingNeuralGas

Floats = NDArray[np.float64]


class SlowGas:
    """The steps written down as they stand, with units as numbered dictionaries and edges as sets of two numbers."""

    def __init__(self, start: Floats) -> None:
        self.units = [{"id": i, "w": code.copy(), "E": 0.0, "U": 0.0} for i, code in enumerate(start)]
        self.ages: dict[frozenset[int], int] = {}
        self.born = len(start)

    def neighbours(self, unit: dict[str, Any]) -> list[dict[str, Any]]:
        return [u for u in self.units if frozenset({u["id"], unit["id"]}) in self.ages and u is not unit]

    def remove(self, place: int) -> None:
        gone = self.units[place]["id"]
        self.ages = {pair: age for pair, age in self.ages.items() if gone not in pair}
        self.units[place] = self.units[-1]
        self.units.pop()

    def remove_lonely(self) -> None:
        for place in reversed(range(len(self.units))):
            if len(self.units) > 2 and not self.neighbours(self.units[place]):
                self.remove(place)

    def learn(self, inputs: Floats, e_b: float, e_n: float, every: int, oldest: int, most: int, k: float) -> None:
        for t, v in enumerate(inputs, 1):
            seen = ~np.isnan(v)
            squared = [v.size / seen.sum() * ((v - u["w"])[seen] ** 2).sum() for u in self.units]
            first, second = np.argsort(squared, kind="stable")[:2]
            s = self.units[first]
            self.ages = {pair: age + (s["id"] in pair) for pair, age in self.ages.items()}
            s["E"] += squared[first]
            s["U"] += squared[second] - squared[first]
            for u, rate in [(s, e_b), *((u, e_n) for u in self.neighbours(s))]:
                u["w"][seen] += rate * (v - u["w"])[seen]
            self.ages[frozenset({s["id"], self.units[second]["id"]})] = 0
            self.ages = {pair: age for pair, age in self.ages.items() if age <= oldest}
            self.remove_lonely()
            if t % every == 0:
                self.forget(k)
                self.insert(most)
            for u in self.units:
                u["E"] *= 0.98
                u["U"] *= 0.98

    def forget(self, k: float) -> None:
        useless = min(range(len(self.units)), key=lambda i: self.units[i]["U"])
        if len(self.units) > 2 and max(u["E"] for u in self.units) > k * self.units[useless]["U"]:
            self.remove(useless)
            self.remove_lonely()

    def insert(self, most: int) -> None:
        if len(self.units) >= most or not self.ages:  # two units that utility left without an edge
            return
        q = max(self.units, key=lambda u: u["E"])
        f = max(self.neighbours(q), key=lambda u: u["E"])
        for u in (q, f):
            u["E"] *= 0.4
        new = {name: (q[name] + f[name]) / 2 for name in ("w", "E", "U")} | {"id": self.born}
        del self.ages[frozenset({q["id"], f["id"]})]
        for u in (q, f):
            self.ages[frozenset({u["id"], self.born})] = 0
        self.units.append(new)
        self.born += 1

    def state(self) -> dict[str, Any]:
        places = {u["id"]: i for i, u in enumerate(self.units)}
        edges = sorted((*sorted(places[i] for i in pair), age) for pair, age in self.ages.items())
        kept = {name: np.array([u[key] for u in self.units]) for name, key in (("codebook", "w"), ("errors", "E"))}
        return kept | {"edges": np.array(edges)[:, :2], "ages": np.array(edges)[:, 2]}


@pytest.mark.parametrize("utility", [None, 3.0])
@pytest.mark.parametrize("gaps", [0.0, 0.2])
@pytest.mark.parametrize(("dims", "every", "oldest", "most"), [(1, 10, 8, 40), (2, 30, 50, 1000), (4, 5, 5, 30)])
def test_agrees_with_its_steps(
    dims: int, every: int, oldest: int, most: int, gaps: float, utility: float | None
) -> None:
    """600 inputs, with and without gaps, lead to the units, edges, ages and errors of the steps in plain Python."""
    rng = np.random.default_rng(dims)
    start, inputs = rng.random((2, dims)), rng.uniform(-0.5, 1.5, (600, dims))
    inputs[:, 1:][rng.random((600, dims - 1)) < gaps] = np.nan
    gas = GrowingNeuralGas(
        0.2, 0.01, every, oldest, 0.4, 0.98, utility=utility, max_units=most, init=start, missing="ignore"
    )
    slow = SlowGas(start)
    slow.learn(inputs, 0.2, 0.01, every, oldest, most, np.inf if utility is None else utility)
    state = gas.partial_fit(inputs).state()
    state["errors"] *= state["fade"]
    for name, expected in slow.state().items():
        np.testing.assert_allclose(state[name], expected, rtol=0, atol=1e-12, err_msg=name)


def square(seed: int, centre: float, count: int) -> Floats:
    """Inputs in a square half as wide as the unit square."""
    return np.random.default_rng(seed).uniform(centre - 0.25, centre + 0.25, (count, 2))


def distortion(gas: GrowingNeuralGas, inputs: Floats) -> float:
    """Mean squared distance of the inputs from their winners."""
    return float((gas.transform(inputs).min(axis=1) ** 2).mean())


def test_utility_follows_data_that_jump() -> None:
    """After a jump GNG-U has the error of a map that never saw the old place; without utility most units stay there."""
    here, dead = [], []
    for seed in range(5):
        old, new, fresh = square(seed, 0.25, 20_000), square(seed, 0.75, 20_000), square(seed + 100, 0.75, 5000)
        maps = [GrowingNeuralGas(max_units=60, utility=k, random_state=seed) for k in (10.0, None)]
        followed, stayed = (gas.partial_fit(old).partial_fit(new) for gas in maps)
        only_new = GrowingNeuralGas(max_units=60, utility=10.0, random_state=seed).partial_fit(new)
        here.append([distortion(gas, fresh) for gas in (followed, only_new, stayed)])
        dead.append([len(gas.codebook_) - len(np.unique(gas.predict(fresh))) for gas in (followed, stayed)])
    assert np.all(np.array(dead)[:, 0] == 0)
    assert np.all(np.array(dead)[:, 1] > 30)
    ours, new_only, without = np.mean(here, axis=0)
    assert abs(ours - new_only) < 3 * np.std([row[1] - row[0] for row in here], ddof=1) / np.sqrt(5)
    assert without > 2 * ours


@pytest.mark.parametrize("utility", [None, 2.0])
def test_keeps_its_invariants_while_units_come_and_go(utility: float | None) -> None:
    """Edges are no older than `max_age`, of three units or more each has one, `max_units` is kept, always."""
    gas = GrowingNeuralGas(insert_every=3, max_age=4, max_units=15, utility=utility, random_state=0)
    sizes = set()
    for x in np.random.default_rng(0).normal(size=(500, 2)):
        gas.learn_one(x)
        state = gas.state()
        sizes.add(len(state["codebook"]))
        assert set(state["ages"].tolist()) <= {0, 1, 2, 3, 4}
        assert set(state["edges"].ravel().tolist()) == set(range(len(state["codebook"]))) or len(state["codebook"]) == 2
        assert (state["errors"] >= 0).all()
        assert (state["utilities"] >= 0).all()
    assert min(sizes) >= 2
    assert max(sizes) <= 15
    assert len(sizes) > 5


def test_it_begins_with_the_numbers_of_its_source() -> None:
    """Fritzke (1995): lambda = 100, alpha = .5, d = .995, epsilon_n = .006 and a_max = 50."""
    own = GrowingNeuralGas().get_params()
    names = ("insert_every", "error_share", "decay", "neighbour_rate", "max_age")
    assert [own[name] for name in names] == [100, 0.5, 0.995, 0.006, 50]


def test_a_unit_comes_each_lambda_inputs() -> None:
    """While no edge can grow too old, after n inputs there are 2 + n // lambda units, up to `max_units`."""
    gas, inputs = GrowingNeuralGas(insert_every=7, max_age=10_000, max_units=50, random_state=0), square(0, 0.5, 500)
    for n, x in enumerate(inputs, 1):
        gas.learn_one(x)
        assert gas.topology_.units == min(2 + n // 7, 50)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"learning_rate": 0}, "learning_rate must be a finite number over 0 and at most 1; got 0"),
        ({"neighbour_rate": 1.5}, "neighbour_rate must be a finite number over 0 and at most 1; got 1.5"),
        ({"error_share": "half"}, "error_share must be a finite number"),
        ({"decay": 1.01}, "decay must be a finite number over 0 and at most 1; got 1.01"),
        ({"utility": 0}, "utility must be a finite number over 0; got 0"),
        ({"insert_every": 0}, "insert_every must be a whole number, at least 1; got 0"),
        ({"max_age": 2.5}, "max_age must be a whole number, at least 1; got 2.5"),
        ({"max_units": 1}, "max_units must be a whole number, at least 2; got 1"),
        ({"init": np.zeros((3, 2))}, r"init must have shape \(units, dims\), \(2, 2\) here; got \(3, 2\)"),
    ],
)
def test_bad_parameters_are_refused_by_name(parameters: dict[str, Any], message: str) -> None:
    """The error says which parameter, its value and what is valid."""
    with pytest.raises(ValueError, match=message):
        GrowingNeuralGas(**parameters).fit([[0.1, 0.2]])


@pytest.mark.filterwarnings("ignore::sklearn.exceptions.SkipTestWarning")
@pytest.mark.parametrize("parameters", [{}, {"utility": 3.0, "insert_every": 5}])
def test_passes_scikit_learns_checks(parameters: dict[str, Any]) -> None:
    """It is a scikit-learn estimator and transformer."""
    check_estimator(GrowingNeuralGas(random_state=0, **parameters))
