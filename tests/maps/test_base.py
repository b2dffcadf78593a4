"""What every map owes its users: each keeps the laws of `check_map`, and so does a toy of under 30 lines."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from sklearn.exceptions import NotFittedError

import somatopy.maps
from somatopy.maps import DSOM, SOM, Map
from somatopy.maps.check import check_map

INPUTS = np.random.default_rng(1).random((60, 3))


class RunningMeans(Map):
    """Each unit is the mean of the inputs that it has won (MacQueen's k-means)."""

    def __init__(
        self, units: int = 5, dtype: str = "float64", missing: str = "error", random_state: int | None = None
    ) -> None:
        self.units = units
        self.dtype = dtype
        self.missing = missing
        self.random_state = random_state

    def _start(self, dims: int, rng: np.random.Generator) -> dict[str, NDArray[Any]]:
        return {"codebook": rng.random((self.units, dims)), "wins": np.zeros(self.units)}

    def _step(self, x: NDArray[Any]) -> int:
        codebook, wins = self._learned["codebook"], self._learned["wins"]
        winner, seen = int(self._winners(x[None])[0]), ~np.isnan(x)
        wins[winner] += 1
        codebook[winner, seen] += (x[seen] - codebook[winner, seen]) / wins[winner]
        return winner


#: Parameters that a map is checked with; a map that is not named here is checked as it comes.
VARIANTS: dict[str, list[dict[str, Any]]] = {
    "DSOM": [
        {"shape": (5, 4), "elasticity": 0.5},
        {"shape": (5, 4), "preset": "schillaci2016"},
        {"shape": (5, 4), "preset": "printed"},
        {"shape": (4, 3), "lattice": "hexagonal", "dtype": "float32"},
        {"shape": (2, 3, 4), "periodic": True, "missing": "ignore"},
    ],
    "SOM": [
        {"shape": (5, 4)},
        {"shape": (4, 3), "lattice": "hexagonal", "periodic": True},
        {"shape": (7,), "periodic": True, "bounds": np.array([0.2, 0.8])},
        {"shape": (2, 3, 2), "horizon": 50},
        {"shape": (2, 1, 2, 3), "width": 1.5, "random_state": np.random.default_rng(5)},
    ],
    "NeuralGas": [{"units": 10}, {"units": 1}],
    "GrowingNeuralGas": [
        {"max_units": 20, "insert_every": 10},
        {"max_units": 20, "insert_every": 7, "max_age": 10, "utility": 2.0},
    ],
    "EvolvingSOM": [{"threshold": 0.4, "prune_every": 10, "max_units": 30}, {"threshold": 10.0}],
    "GrowWhenRequired": [{"max_units": 30}, {"activity_threshold": 0.8, "max_age": 5, "max_units": 20}],
}
PUBLIC = [getattr(somatopy.maps, name) for name in somatopy.maps.__all__]
MAPS = [kind for kind in PUBLIC if inspect.isclass(kind) and issubclass(kind, Map) and not inspect.isabstract(kind)]
CASES = [
    pytest.param(kind, parameters, id="-".join([kind.__name__, *(f"{key}={parameters[key]}" for key in parameters)]))
    for kind in [*MAPS, RunningMeans]
    for parameters in VARIANTS.get(kind.__name__, [{}])
]


@pytest.mark.parametrize(("kind", "parameters"), CASES)
def test_every_map_keeps_the_laws(kind: Callable[..., Map], parameters: dict[str, Any]) -> None:
    """Every public map, and the toy, in every kind of lattice and every rule that it has."""
    check_map(lambda: kind(**parameters))


def test_no_variant_is_of_a_map_that_is_not_public() -> None:
    """A map that is renamed takes its variants with it."""
    assert VARIANTS.keys() <= {kind.__name__ for kind in MAPS}


def test_the_toy_has_under_30_lines() -> None:
    """A map of one's own takes no more."""
    assert len(inspect.getsource(RunningMeans).splitlines()) < 30


@pytest.mark.parametrize("make", [lambda: SOM(shape=(3, 2)), RunningMeans])
@pytest.mark.parametrize(
    ("method", "given", "message"),
    [
        ("learn_one", [0.0, np.nan, 0.0], r'input\[1\] is nan: values must be finite \(missing="ignore" allows NaN\)'),
        ("learn_one", [0.0, 0.0, -np.inf], r"input\[2\] is -inf: .* at most 1e\+150 in size; nothing has been learned"),
        ("winner", [0.0, 1e151, 0.0], r"input\[1\] is 1e\+151: values must be finite"),
        ("partial_fit", [[0.0, 0.0, 0.0], [1e151, 0.0, 0.0]], r"input\[1, 0\] is 1e\+151: values must be finite"),
        ("learn_one", [0.0, 0.0], r"learns inputs of shape \(3,\); got shape \(2,\)\. Call initialise\(dims\)"),
        ("winner", [[0.0, 0.0, 0.0]], r"learns inputs of shape \(3,\); got shape \(1, 3\)"),
        ("initialise", 0, "dims must be at least 1; got 0"),
    ],
)
def test_refusals_name_place_value_and_fix(make: Callable[[], Map], method: str, given: Any, message: str) -> None:
    """The message says which value, of which input, what is valid, and that nothing was learned."""
    learner = make().fit(INPUTS)
    with pytest.raises(ValueError, match=message):
        getattr(learner, method)(given)


@pytest.mark.parametrize("make", [lambda **p: SOM(shape=(3, 2), **p), RunningMeans])
def test_an_input_without_any_value_is_refused_by_name(make: Callable[..., Map]) -> None:
    """missing="ignore" needs one coordinate that was observed."""
    learner = make(missing="ignore").fit(INPUTS)
    for call, given, place in (
        (learner.learn_one, np.full(3, np.nan), r"\[0\]"),
        (learner.winner, [0.0, np.inf, np.nan], r"\[1\]"),
        (learner.partial_fit, [[0.0, 0.0, np.nan], [np.nan] * 3], r"\[1, 0\]"),
    ):
        with pytest.raises(ValueError, match=rf"input{place} is .*finite or NaN, at least one of an input finite"):
            call(given)


@pytest.mark.parametrize("x", [1.0, [], [[1.0, 2.0]], np.ones((3, 1))])
def test_the_first_input_must_be_a_vector(x: Any) -> None:
    """Its shape is named; the map has not started."""
    learner = RunningMeans()
    with pytest.raises(ValueError, match=r"an input must be one vector, shape \(dims,\); got shape"):
        learner.learn_one(x)
    with pytest.raises(NotFittedError):
        learner.state()


@pytest.mark.parametrize("k", [0, 6, -1, 1.5, "2", None])
def test_winners_names_the_numbers_that_it_takes(k: Any) -> None:
    """k is from 1 to the number of units."""
    with pytest.raises(ValueError, match=rf"k must be a whole number from 1 to 5, the units of this map; got {k!r}"):
        RunningMeans().fit(INPUTS).winners(INPUTS[0], k)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"dtype": "float16"}, r"unknown dtype 'float16'; valid: \['float64', 'float32'\]"),
        ({"dtype": "no type"}, r"unknown dtype 'no type'; valid: \['float64', 'float32'\]"),
        ({"missing": "drop"}, r"unknown missing 'drop'; valid: \['error', 'ignore'\]"),
    ],
)
def test_parameters_of_all_maps_are_refused_by_name(parameters: dict[str, Any], message: str) -> None:
    """They are checked where learning starts, before anything is drawn."""
    for start in (lambda toy: toy.initialise(3), lambda toy: toy.learn_one(INPUTS[0]), lambda toy: toy.fit(INPUTS)):
        with pytest.raises(ValueError, match=message):
            start(RunningMeans(**parameters))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"codebook": np.zeros(3)}, r"a state needs a codebook of shape \(units, dims\); this one has \['codebook', "),
        ({"codebook": np.zeros((4, 3))}, r"restored codebook must have shape \(5, 3\) for this map; got \(4, 3\)"),
        ({"codebook": np.full((5, 3), "a")}, "restored codebook must be of a kind that fits float64; got <U1"),
        ({"wins": np.full(5, np.inf)}, "restored wins must be finite"),
        ({"samples_seen": -1}, "restored samples_seen must be a number from 0 up; got -1"),
        ({"samples_seen": 1.5}, "restored samples_seen must be of a kind that fits int64; got float64"),
        ({"losses": np.zeros(5)}, r"has \['codebook', 'samples_seen', 'wins'\]; \['losses'\] are missing or unknown"),
    ],
)
def test_states_that_do_not_fit_are_refused_by_name(change: dict[str, Any], message: str) -> None:
    """The message has the array, what it must be and what it is."""
    toy = RunningMeans().fit(INPUTS)
    with pytest.raises(ValueError, match=message):
        toy.restore(toy.state() | change)


def test_a_map_without_neighbours_says_so() -> None:
    """Its topology is an AttributeError that has a reason."""
    with pytest.raises(AttributeError, match="a RunningMeans has no topology: none of its units are neighbours"):
        RunningMeans().fit(INPUTS).topology_  # noqa: B018


def test_feature_names_are_those_of_the_map() -> None:
    """transform's columns are named after the map and the unit."""
    names = DSOM(shape=(5, 4)).fit(INPUTS).get_feature_names_out()
    assert list(names) == [f"dsom{unit}" for unit in range(20)]


def test_transform_chunks_works_on_some_rows_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """No part has more distances than are asked for, and the parts together are what transform gives."""
    monkeypatch.setattr("somatopy.maps.base.CHUNK", 17)
    toy = RunningMeans().fit(INPUTS)
    parts = list(toy.transform_chunks(INPUTS))
    assert {part.size for part in parts} == {15}
    np.testing.assert_array_equal(np.concatenate(parts), toy.transform(INPUTS))
    np.testing.assert_array_equal(toy.predict(INPUTS), toy.transform(INPUTS).argmin(axis=1))


def test_missing_coordinates_scale_distances_up() -> None:
    """Of three dimensions one was not observed: the distance in the others times the square root of 3/2."""
    toy = RunningMeans(missing="ignore").fit(INPUTS)
    unit, distance = toy.winner([0.3, np.nan, 0.9])
    assert distance == pytest.approx(np.sqrt(1.5) * np.linalg.norm(toy.code(unit)[[0, 2]] - [0.3, 0.9]))
