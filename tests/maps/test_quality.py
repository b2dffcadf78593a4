"""Measures of maps: values worked out by hand, the definitions taken literally, laws, and memory."""

from __future__ import annotations

import tracemalloc
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise, permutations
from math import log, log2
from typing import Any

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray
from scipy.spatial.distance import cdist
from sklearn.base import clone
from sklearn.exceptions import NotFittedError
from sklearn.manifold import trustworthiness as trustworthiness_of_sklearn
from sklearn.metrics.pairwise import nan_euclidean_distances

from somatopy.contract import same
from somatopy.maps import DSOM, SOM, Lattice, Map, NeuralGas, Topology
from somatopy.maps.graph import Graph
from somatopy.maps.quality import (
    History,
    dead_units,
    distortion,
    entropy,
    follow,
    mean_squared_error,
    quality,
    quantisation_error,
    topographic_error,
    topographic_product,
    trustworthiness,
    winner_counts,
)

Floats = NDArray[np.float64]
RNG = np.random.default_rng(7)


class Still(Map):
    """A map that does not learn: codes and topology as given."""

    def __init__(self, codes: Any, topology: Any = None, dtype: str = "float64", missing: str = "error") -> None:
        self.codes, self.topology, self.dtype, self.missing = codes, topology, dtype, missing
        self.random_state = None

    @property
    def topology_(self) -> Topology:
        if self.topology is None:
            return super().topology_
        topology: Topology = self.topology
        return topology

    def _start(self, dims: int, rng: np.random.Generator) -> dict[str, Any]:
        return {"codebook": np.array(self.codes, dtype=float).reshape(-1, dims)}

    def _step(self, x: Any) -> int:
        return int(self._distances(x[None]).argmin())


@dataclass
class Places:
    """Units anywhere in a plane; none is said to be another's neighbour."""

    positions: Floats
    edges: Any = None

    def adjacent(self, a: Any, b: Any) -> NDArray[np.bool_]:
        return np.zeros(np.shape(a), dtype=bool)

    def distances(self, unit: int) -> Floats:
        return cdist(self.positions[unit : unit + 1], self.positions)[0]


def still(codes: Any, topology: Any = None, **options: Any) -> Still:
    codes = np.array(codes, dtype=float)
    codes = codes[:, None] if codes.ndim == 1 else codes
    made: Still = Still(codes, topology, **options).initialise(codes.shape[1])
    return made


def chain(codes: Any) -> Still:
    return still(codes, Lattice((len(codes),)))


LATTICES = [
    Lattice((9,)),
    Lattice((5, 6)),
    Lattice((3, 4, 3)),
    Lattice((2, 3, 2, 3)),
    Lattice((6, 5), "hexagonal"),
    Lattice((1, 7)),
]
every_lattice = pytest.mark.parametrize("lattice", LATTICES, ids=lambda lattice: f"{lattice.kind[:3]}{lattice.shape}")
SQUARE = RNG.random((3000, 2))


def with_gaps(inputs: Floats) -> Floats:
    """The inputs with every fifth value missing, but none with nothing left."""
    holed = inputs.copy()
    holed[np.random.default_rng(0).random(inputs.shape) < 0.2] = np.nan
    holed[np.isnan(holed).all(axis=1), 0] = 0.5
    return holed


# How near


def test_errors_worked_out_by_hand() -> None:
    """Inputs 0.1, 0.2, 0.1 and 0.2 away from their winners: mean .15, mean square .025."""
    units, inputs = chain([0, 1, 2]), [[0.1], [0.2], [0.9], [1.2]]
    assert quantisation_error(units, inputs) == pytest.approx(0.15, rel=1e-14)
    assert mean_squared_error(units, inputs) == pytest.approx(0.025, rel=1e-14)


@pytest.mark.parametrize("dtype", ["float64", "float32"])
@pytest.mark.parametrize("missing", ["error", "ignore"])
@pytest.mark.parametrize("kind", [SOM, DSOM, NeuralGas])
def test_errors_are_means_over_the_least_distances(kind: Any, missing: str, dtype: str) -> None:
    """On real maps, with and without missing values, over more inputs than are looked at together."""
    inputs = RNG.random((9000, 3))
    inputs = with_gaps(inputs) if missing == "ignore" else inputs
    size = {"units": 48} if kind is NeuralGas else {"shape": (6, 8)}
    trained = kind(**size, missing=missing, dtype=dtype, random_state=0).partial_fit(inputs[:500])
    least = nan_euclidean_distances(inputs, trained.codebook_.astype(float)).min(axis=1)
    precision = 1e-12 if dtype == "float64" else 1e-6
    assert quantisation_error(trained, inputs) == pytest.approx(least.mean(), rel=precision)
    assert mean_squared_error(trained, inputs) == pytest.approx((least**2).mean(), rel=precision)


def test_errors_scale_with_the_world() -> None:
    """In a world 7 times as large, the error is 7 times and the squared one 49 times as large."""
    codes = RNG.random((20, 2))
    small, large = still(codes), still(7 * codes)
    assert quantisation_error(large, 7 * SQUARE) == pytest.approx(7 * quantisation_error(small, SQUARE))
    assert mean_squared_error(large, 7 * SQUARE) == pytest.approx(49 * mean_squared_error(small, SQUARE))


@pytest.mark.parametrize("missing", ["error", "ignore"])
@pytest.mark.parametrize("topology", [Lattice((3, 4), "hexagonal"), Graph(12, [(0, 1), (1, 2), (0, 5)])], ids=repr)
def test_distortion_is_its_definition(topology: Any, missing: str) -> None:
    """The sum over all pairs of input and unit, taken literally; units that nothing joins do not count."""
    codes, inputs = RNG.random((12, 3)), RNG.random((300, 3))
    inputs = with_gaps(inputs) if missing == "ignore" else inputs
    squared = nan_euclidean_distances(inputs, codes) ** 2
    apart = np.array([topology.distances(unit) for unit in range(12)])
    expected = (np.exp(-(apart[squared.argmin(axis=1)] ** 2) / (2 * 0.8**2)) * squared).sum() / len(inputs)
    assert distortion(still(codes, topology, missing=missing), inputs, width=0.8) == pytest.approx(expected, rel=1e-12)


def test_distortion_without_neighbourhood_is_the_mean_squared_error() -> None:
    """A width far below one cell leaves the winner alone."""
    units = still(RNG.random((12, 2)), Lattice((3, 4)))
    assert distortion(units, SQUARE, width=0.01) == pytest.approx(mean_squared_error(units, SQUARE), rel=1e-12)


def test_som_moves_down_the_distortion() -> None:
    """The mean step of a SOM of one width and rate is minus half the rate times the distortion's gradient."""
    codes, inputs, rate = RNG.random((12, 2)), SQUARE[:400], 0.1
    steps = np.zeros_like(codes)
    for x in inputs:
        som = SOM(shape=(3, 4), learning_rate=rate, width=0.8, init=codes)
        steps += (som.partial_fit(x[None]).codebook_ - codes) / len(inputs)
    gradient, tiny = np.zeros_like(codes), 1e-7
    for place in np.ndindex(codes.shape):
        up, down = codes.copy(), codes.copy()
        up[place], down[place] = up[place] + tiny, down[place] - tiny
        rise = [distortion(still(moved, Lattice((3, 4))), inputs, width=0.8) for moved in (up, down)]
        gradient[place] = (rise[0] - rise[1]) / (2 * tiny)
    np.testing.assert_allclose(steps, -0.5 * rate * gradient, rtol=1e-5, atol=1e-8)


# How units are used


def test_counts_worked_out_by_hand() -> None:
    """Three inputs for the first unit, one for the third, none for the second and fourth."""
    units, inputs = chain([0, 1, 2, 3]), [[0.1], [0.2], [-5.0], [2.2]]
    assert winner_counts(units, inputs).tolist() == [3, 0, 1, 0]
    assert dead_units(units, inputs).tolist() == [1, 3]
    assert entropy(units, inputs) == pytest.approx(-(0.75 * log2(0.75) + 0.25 * log2(0.25)))


def test_counts_are_those_of_predict() -> None:
    """Each input counts once, for the unit that predict names."""
    dsom = DSOM(shape=(9, 7), random_state=0).partial_fit(SQUARE[:200])
    np.testing.assert_array_equal(
        winner_counts(dsom, SQUARE), np.bincount(dsom.predict(SQUARE), minlength=dsom.topology_.units)
    )


def test_entropy_is_between_one_winner_and_all_alike() -> None:
    """0 bits if one unit wins all, log2(units) if all win equally often, less otherwise."""
    units = chain([0, 1, 2, 3, 4])
    assert entropy(units, [[0.0]] * 9) == 0
    assert entropy(units, [[0.0], [1.0], [2.0], [3.0], [4.0]] * 3) == pytest.approx(log2(5), rel=1e-14)
    assert 0 < entropy(units, [[0.0], [1.0], [2.0], [3.0], [3.0]]) < log2(5)


# Topographic error


def test_topographic_error_worked_out_by_hand() -> None:
    """In a chain whose last two codes are swapped, the inputs between the first and the last unit go wrong."""
    folded = chain([0.0, 2.0, 1.0])
    assert topographic_error(folded, [[0.1], [0.9], [1.2], [1.9]]) == 0.5
    assert topographic_error(folded, [[1.2], [1.9]]) == 0
    assert topographic_error(folded, [[0.4]]) == 1


@every_lattice
def test_a_perfect_lattice_has_no_topographic_error(lattice: Lattice) -> None:
    """Codes at the lattice's own positions: the two units nearest to any point are neighbours; shuffled, mostly not."""
    inputs = RNG.random((500, len(lattice.shape))) * lattice.positions.max(axis=0)
    assert topographic_error(still(lattice.positions, lattice), inputs) == 0
    shuffled = RNG.permutation(lattice.positions)
    assert topographic_error(still(shuffled, lattice), inputs) > 0.3


def test_corners_are_neighbours_on_rectangles_and_only_some_on_hexagons() -> None:
    """Input between units (1, 1) and (0, 0): neighbours among squares, not among hexagons; (0, 2) is one in both."""
    codes = np.full((9, 2), 50.0) + np.arange(9)[:, None]
    codes[[0, 4, 2]] = [0.0, 0.0], [1.0, 0.0], [1.0, 1.0]
    square, hexagonal = still(codes, Lattice((3, 3))), still(codes, Lattice((3, 3), "hexagonal"))
    first_corner, second_corner = [[0.6, 0.0]], [[1.0, 0.4]]
    assert [topographic_error(square, x) for x in (first_corner, second_corner)] == [0, 0]
    assert [topographic_error(hexagonal, x) for x in (first_corner, second_corner)] == [1, 0]


def test_opposite_borders_are_neighbours_where_the_lattice_has_none() -> None:
    """First and last unit of a ring, and of a chain of the same codes."""
    codes = [[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 1.0]]
    ring, open_chain = still(codes, Lattice((4,), periodic=True)), still(codes, Lattice((4,)))
    assert (topographic_error(ring, [[0.0, 0.4]]), topographic_error(open_chain, [[0.0, 0.4]])) == (0, 1)


def test_edges_decide_in_a_graph() -> None:
    """The same codes and inputs with one edge and with another."""
    codes, inputs = [[0.0], [1.0], [5.0]], [[0.4], [0.6]]
    assert topographic_error(still(codes, Graph(3, np.array([[0, 1]]))), inputs) == 0
    assert topographic_error(still(codes, Graph(3, np.array([[1, 2]]))), inputs) == 1


def test_missing_values_leave_out_their_coordinate() -> None:
    """With the first coordinate unknown, units 0 and 3 are nearest, which are not neighbours; with it, 0 and 1."""
    units = still([[0, 0], [1, 5], [2, 5], [3, 1]], Lattice((4,)), missing="ignore")
    assert topographic_error(units, [[np.nan, 0.4]]) == 1
    assert topographic_error(units, [[0.0, np.nan]]) == 0


# Topographic product


def test_topographic_product_worked_out_by_hand() -> None:
    """Codes 0, 3, 1 on a chain: only the first unit's nearest differ, by 3/1 between codes and 1/2 on the map."""
    assert topographic_product(chain([0.0, 3.0, 1.0])) == pytest.approx(0.5 * log(3 / 2) / 6, rel=1e-14)


@every_lattice
def test_topographic_product_of_a_perfect_lattice_is_0(lattice: Lattice) -> None:
    """Codes at the lattice's own positions, to scale or not."""
    assert topographic_product(still(lattice.positions, lattice)) == pytest.approx(0, abs=1e-12)
    assert topographic_product(still(0.3 * lattice.positions, lattice)) == pytest.approx(0, abs=1e-12)


def test_topographic_product_changes_its_sign_where_map_and_codes_change_places() -> None:
    """What too few dimensions are in one direction, too many are in the other. A shuffled map so has 0 in the mean."""
    a, b = RNG.random((30, 2)), RNG.random((30, 3))
    one, other = topographic_product(still(a, Places(b))), topographic_product(still(b, Places(a)))
    assert one == pytest.approx(-other, rel=1e-10)
    assert abs(one) > 1e-3


def test_topographic_product_looks_at_shape_only() -> None:
    """Codes turned, mirrored, moved and stretched have the same product."""
    codes, turn = RNG.random((20, 3)), np.linalg.qr(RNG.normal(size=(3, 3)))[0]
    lattice = Lattice((4, 5), "hexagonal")
    expected = topographic_product(still(codes, lattice))
    assert topographic_product(still(5 + 3.7 * codes @ turn, lattice)) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("shape", [(12,), (4, 5)])
def test_topographic_product_does_not_depend_on_numbering(shape: tuple[int, ...]) -> None:
    """A lattice read backwards is the same lattice, though all units that are equally near change their order."""
    codes, lattice = RNG.random((np.prod(shape), 2)), Lattice(shape)
    forwards, backwards = topographic_product(still(codes, lattice)), topographic_product(still(codes[::-1], lattice))
    assert forwards == pytest.approx(backwards, rel=1e-10)
    assert abs(forwards) > 1e-3


@pytest.mark.parametrize("seed", range(3))
def test_topographic_product_tells_too_few_and_too_many_dimensions(seed: int) -> None:
    """As published: on a square a chain is below 0, a cube above, a square near 0."""
    inputs = np.random.default_rng(seed).random((12_000, 2))
    products = []
    for shape in ((64,), (8, 8), (4, 4, 4)):
        som = SOM(shape=shape, horizon=10_000, random_state=seed).partial_fit(inputs)
        products.append(topographic_product(som))
    few, fitting, many = products
    assert few < 0 < many
    assert abs(fitting) < min(-few, many) / 2


def test_topographic_product_refuses_what_has_none() -> None:
    """Two units of one code, units that no edges join, a single unit: the message names them."""
    with pytest.raises(ValueError, match=r"units 1 and 3 have the same code.*topographic_error has one"):
        topographic_product(chain([0.0, 1.0, 2.0, 1.0]))
    with pytest.raises(ValueError, match="nothing joins units 0 and 2"):
        topographic_product(still([[0.0], [1.0], [2.0]], Graph(3, np.array([[0, 1]]))))
    with pytest.raises(ValueError, match="pairs of units; this map has 1"):
        topographic_product(chain([0.0]))


# Trustworthiness


@pytest.mark.parametrize("neighbours", [1, 5, 14])
def test_trustworthiness_is_that_of_sklearn_where_none_are_equally_near(neighbours: int) -> None:
    """Each input on a unit of its own, units anywhere in the plane."""
    inputs, places = RNG.random((30, 4)), RNG.random((30, 2))
    expected = trustworthiness_of_sklearn(inputs, places, n_neighbors=neighbours)
    assert trustworthiness(still(inputs, Places(places)), inputs, neighbours) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("topology", [Lattice((3,)), Graph(3, [(0, 1)])], ids=["chain", "graph in two parts"])
@pytest.mark.parametrize("neighbours", [1, 2, 3])
def test_trustworthiness_is_the_mean_over_all_orders_of_equally_near_inputs(neighbours: int, topology: Any) -> None:
    """The definition with every order of the other inputs that agrees with their distances on the map."""
    inputs = RNG.random((7, 1)) * 3 - 0.5
    units = still([[0.0], [1.0], [2.0]], topology)
    winners, count, k = units.predict(inputs), len(inputs), neighbours
    penalty = 0.0
    for i in range(count):
        others = [j for j in range(count) if j != i]
        rank = {j: 1 + sum(abs(inputs[m] - inputs[i]) < abs(inputs[j] - inputs[i]) for m in others) for j in others}
        away = topology.distances(winners[i])[winners]
        orders = [p for p in permutations(others) if all(away[a] <= away[b] for a, b in pairwise(p))]
        penalty += np.mean([sum(max(float(rank[j][0]) - k, 0.0) for j in order[:k]) for order in orders])
    expected = 1 - 2 * penalty / (count * k * (2 * count - 3 * k - 1))
    assert trustworthiness(units, inputs, k) == pytest.approx(expected, rel=1e-12)


@every_lattice
def test_a_map_that_keeps_all_distances_is_trustworthy(lattice: Lattice) -> None:
    """Inputs at the lattice's own positions, in any scale: 1, whatever lies equally near."""
    units = still(1.7 * lattice.positions, lattice)
    assert all(trustworthiness(units, units.codebook_, k) == 1 for k in (1, 2, 3))


def test_a_map_that_knows_nothing_has_the_trust_of_chance() -> None:
    """Inputs scattered over units at random: the mean is the expected one within 4 standard errors."""
    count, k = 120, 5
    inputs = RNG.random((count, 3))
    found = [trustworthiness(still(RNG.permutation(inputs), Lattice((10, 12))), inputs, k) for _ in range(100)]
    chance = 1 - (count - 1 - k) * (count - k) / ((2 * count - 3 * k - 1) * (count - 1))
    assert np.mean(found) == pytest.approx(chance, abs=4 * np.std(found) / np.sqrt(len(found)))


def test_trustworthiness_of_missing_values() -> None:
    """Distances are those of the coordinates known of both; where there is none, the message names the inputs."""
    complete = RNG.random((60, 4))
    inputs = np.column_stack([complete[:, 0], with_gaps(complete[:, 1:])])
    units = still(RNG.random((12, 4)), Lattice((3, 4)), missing="ignore")
    doubled = still(np.tile(units.codebook_, 2), Lattice((3, 4)), missing="ignore")
    assert trustworthiness(doubled, np.tile(inputs, 2)) == pytest.approx(trustworthiness(units, inputs), rel=1e-12)
    complete[[3, 8]] = [1, np.nan, np.nan, np.nan], [np.nan, 1, np.nan, np.nan]
    with pytest.raises(ValueError, match=r"X\[(3|8)\] and X\[(3|8)\] have no coordinate that is known of both"):
        trustworthiness(units, complete)


@pytest.mark.parametrize(("neighbours", "message"), [(0, "whole number, at least 1"), (5, "less than half of the")])
def test_trustworthiness_refuses_neighbours_that_do_not_fit(neighbours: int, message: str) -> None:
    """From 1 to less than half of the inputs."""
    with pytest.raises(ValueError, match=f"neighbours must be (a )?{message}.*got {neighbours}"):
        trustworthiness(chain(range(10)), np.arange(10.0)[:, None], neighbours)


# All of them

MEASURES: dict[str, Callable[[Map, Any], object]] = {
    "quantisation_error": quantisation_error,
    "mean_squared_error": mean_squared_error,
    "distortion": lambda trained, X: distortion(trained, X, width=1.0),
    "winner_counts": winner_counts,
    "dead_units": dead_units,
    "entropy": entropy,
    "topographic_error": topographic_error,
    "trustworthiness": trustworthiness,
    "quality": quality,
}
every_measure = pytest.mark.parametrize("measure", MEASURES.values(), ids=MEASURES)


def agree(a: Any, b: Any) -> bool:
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(agree(a[name], b[name]) for name in a)
    return bool(np.allclose(a, b, rtol=1e-12, atol=0))


@every_measure
def test_the_order_of_the_inputs_does_not_matter(measure: Callable[[Map, Any], object]) -> None:
    """Inputs in another order give the same value."""
    som = SOM(shape=(5, 5), horizon=1000, random_state=0).partial_fit(SQUARE[:1000])
    assert agree(measure(som, SQUARE[:700]), measure(som, SQUARE[:700][::-1]))


@every_measure
def test_measuring_changes_nothing(measure: Callable[[Map, Any], object]) -> None:
    """The map's state and the inputs stay as they were; read-only inputs will do, and so will lists."""
    som = SOM(shape=(5, 5), horizon=1000, random_state=0).partial_fit(SQUARE[:1000])
    state, inputs = som.state(), SQUARE[:300].copy()
    inputs.flags.writeable = False
    assert agree(measure(som, inputs), measure(som, inputs.tolist()))
    assert same(som.state(), state)
    assert (inputs == SQUARE[:300]).all()


@every_measure
def test_inputs_that_are_not_usable_are_refused(measure: Callable[[Map, Any], object]) -> None:
    """One axis, no rows, another number of columns, NaN, and a map that has learned nothing."""
    som = SOM(shape=(3, 3), random_state=0).initialise(2)
    for unusable in ([0.1, 0.2], np.empty((0, 2)), np.ones((9, 3)), np.full((20, 2), np.nan)):
        with pytest.raises(ValueError, match=r"Expected 2D|minimum of 1|features|NaN"):
            measure(som, unusable)
    with pytest.raises(NotFittedError):
        measure(SOM(shape=(3, 3)), SQUARE[:20])


@every_measure
def test_names_of_columns_are_no_trouble(measure: Callable[[Map, Any], object]) -> None:
    """A map that learned from a table takes tables with the same columns, and gives what arrays give."""
    table = pd.DataFrame(SQUARE[:300], columns=["shoulder", "elbow"])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        named = SOM(shape=(4, 4), horizon=300, random_state=0).fit(table)
        found = measure(named, table)
    assert agree(found, measure(SOM(shape=(4, 4), horizon=300, random_state=0).fit(SQUARE[:300]), SQUARE[:300]))


def test_a_refused_input_is_named_by_its_row() -> None:
    """Rows in the message are counted from where the note says, though inputs are looked at in pieces."""
    inputs = np.zeros((30_000, 2))
    inputs[20_010, 1] = 1e200
    with pytest.raises(ValueError, match=r"input\[\d+, 1\] is 1e\+200") as caught:
        quantisation_error(SOM(shape=(30, 30), random_state=0).initialise(2), inputs)
    (note,) = caught.value.__notes__
    first = int(note.removeprefix("rows are counted from X[").removesuffix("]"))
    assert f"input[{20_010 - first}, 1]" in str(caught.value)


@pytest.mark.parametrize("measure", ["distortion", "topographic_error", "trustworthiness"])
def test_measures_of_topology_refuse_maps_without(measure: str) -> None:
    """The message names the map and what can be had of it."""
    gas = NeuralGas(units=9, random_state=0).initialise(2)
    with pytest.raises(ValueError, match="a NeuralGas has no topology; what needs none: quantisation_error"):
        MEASURES[measure](gas, SQUARE)
    with pytest.raises(ValueError, match=r"topographic product needs .* a NeuralGas has no topology"):
        topographic_product(gas)


def test_topographic_error_refuses_a_single_unit() -> None:
    """There is no second nearest."""
    with pytest.raises(ValueError, match="two nearest units; this map has one"):
        topographic_error(chain([0.0]), [[0.3]])


def test_quality_has_what_applies_and_the_values_of_the_measures() -> None:
    """All that one asks for by name without more arguments; what needs a topology only if there is one."""
    som, gas = SOM(shape=(6, 6), random_state=0), NeuralGas(units=36, random_state=0)
    for trained in (som.partial_fit(SQUARE[:99]), gas.partial_fit(SQUARE[:99]), chain([[0.5, 0.5]])):
        expected = {name: MEASURES[name](trained, SQUARE) for name in ("quantisation_error", "mean_squared_error")}
        expected |= {"dead_units": len(dead_units(trained, SQUARE)), "entropy": entropy(trained, SQUARE)}
        if trained is som:
            expected["topographic_error"] = topographic_error(som, SQUARE)
        assert quality(trained, SQUARE) == expected


@every_measure
def test_memory_does_not_grow_with_the_inputs(measure: Callable[[Map, Any], object]) -> None:
    """200,000 inputs take no more than 20,000 do. Trustworthiness may take a few arrays of its inputs' length."""
    som = SOM(shape=(30, 30), random_state=0).initialise(4)
    few, many = (400, 2000) if measure is trustworthiness else (20_000, 200_000)
    inputs = RNG.random((many, 4))
    measure(som, inputs[:100])
    peaks = [peak_of(lambda n=n: measure(som, inputs[:n])) for n in (few, many)]  # type: ignore[misc]
    if measure is trustworthiness:
        assert peaks[1] < 12e6  # a matrix of all distances would be 32 MB
    else:
        assert peaks[1] < 1.05 * peaks[0] + 1e5


def peak_of(call: Callable[[], object]) -> int:
    """Greatest memory in use during a call beyond what was before, bytes."""
    tracemalloc.start()
    try:
        call()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


# History


def test_follow_learns_as_partial_fit_does() -> None:
    """Following changes nothing of what is learned."""
    followed, alone = (SOM(shape=(5, 5), horizon=900, random_state=0) for _ in range(2))
    follow(followed, SQUARE[:777], every=100)
    assert same(followed.state(), alone.partial_fit(SQUARE[:777]).state())


def test_follow_records_the_error_before_learning() -> None:
    """Each piece's error is that of the map which has learned all pieces before it; unknown for a map without units."""
    history = follow(SOM(shape=(5, 5), horizon=900, random_state=0), SQUARE[:250], every=100)
    twin = SOM(shape=(5, 5), horizon=900, random_state=0)
    assert isinstance(history, History)
    assert (history.samples.tolist(), history.units.tolist()) == ([100, 200, 250], [25, 25, 25])
    assert np.isnan(history.error[0])
    for start, error in ((100, history.error[1]), (200, history.error[2])):
        before = clone(twin).partial_fit(SQUARE[:start])
        assert error == quantisation_error(before, SQUARE[start : min(start + 100, 250)])


def test_follow_goes_on_where_a_map_stands() -> None:
    """A map that has learned has an error from the first piece on, and its inputs are counted on."""
    history = follow(SOM(shape=(5, 5), random_state=0).partial_fit(SQUARE[:50]), SQUARE[50:150], every=50)
    assert history.samples.tolist() == [100, 150]
    assert np.isfinite(history.error).all()


@pytest.mark.parametrize("every", [0, 2.5, True])
def test_follow_refuses_steps_that_are_none(every: Any) -> None:
    """Nothing has been learned then."""
    som = SOM(shape=(3, 3))
    with pytest.raises(ValueError, match="every must be a whole number, at least 1"):
        follow(som, SQUARE, every)
    assert not som.__sklearn_is_fitted__()
