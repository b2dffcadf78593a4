"""What every map owes its users: each keeps the laws of `check_map`, and so does a toy of under 30 lines."""

from __future__ import annotations

import inspect
import pickle
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import sklearn
from numpy.typing import NDArray
from sklearn.exceptions import NotFittedError

import somatopy.maps
from somatopy.contract import same
from somatopy.maps import (
    DSOM,
    SOM,
    EvolvingSOM,
    GrowingNeuralGas,
    GrowWhenRequired,
    Map,
    NeuralGas,
    check_map,
    load_map,
)
from somatopy.maps.quality import quality

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
        ("learn_one", [0.0, 0.0, -np.inf], r"input\[2\] is -inf: .* at most 1e\+150 in size; nothing has changed"),
        ("winner", [0.0, 1e151, 0.0], r"input\[1\] is 1e\+151: values must be finite"),
        ("partial_fit", [[0.0, 0.0, 0.0], [1e151, 0.0, 0.0]], r"input\[1, 0\] is 1e\+151: values must be finite"),
        ("learn_one", [0.0, 0.0], r"learns inputs of shape \(3,\); got shape \(2,\)\. Call initialise\(dims\)"),
        ("learn_one", [0.0, 1j, 0.0], "inputs are real numbers; got complex ones"),
        (
            "partial_fit",
            [[0.0, np.nan, 0.0]],
            r'input\[0, 1\] is nan: values must be finite \(missing="ignore" allows NaN',
        ),
        ("fit", [[0.0, np.inf, 0.0]], r"input\[0, 1\] is inf: values must be finite"),
        ("initialise", 2.5, "dims must be a whole number, at least 1; got 2.5"),
        ("winner", [[0.0, 0.0, 0.0]], r"learns inputs of shape \(3,\); got shape \(1, 3\)"),
        ("initialise", 0, "dims must be a whole number, at least 1; got 0"),
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
        with pytest.raises(ValueError, match=rf"input{place} is .*finite or NaN, not all of an input NaN"):
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


# What is asked of every kind of map, beyond the laws

KINDS: list[Callable[..., Map]] = [
    partial(SOM, shape=(3, 2)),
    partial(GrowingNeuralGas, insert_every=5, max_units=9),
    partial(GrowWhenRequired, max_units=9),
    RunningMeans,
]
every_kind = pytest.mark.parametrize("make", KINDS)


def test_columns_of_words_are_named() -> None:
    """With what to do about them."""
    table = named("abc").assign(colour="red", made=pd.Timestamp(0))
    for given, names in ((table.drop(columns="made"), "colour"), (table, "colour, made")):
        with pytest.raises((TypeError, ValueError)) as caught:
            RunningMeans().fit(given)
        assert f"no numbers: {names}. Leave them out, X.select_dtypes('number')" in caught.value.__notes__[0]


@every_kind
def test_what_a_mask_hides_is_missing(make: Callable[..., Map]) -> None:
    """A masked table is learned, asked and judged as one with NaN in these places, row by row, too; or refused."""
    hidden = np.arange(INPUTS.size).reshape(INPUTS.shape) % 7 == 3
    masked, gaps = np.ma.masked_array(INPUTS, hidden), np.where(hidden, np.nan, INPUTS)
    one, other = (make(missing="ignore", random_state=0).fit(table) for table in (masked, gaps))
    np.testing.assert_array_equal(one.codebook_, other.codebook_)
    np.testing.assert_array_equal(one.transform(masked), other.transform(gaps))
    assert one.score(masked) == other.score(gaps)
    assert [one.learn_one(row) for row in masked] == [other.learn_one(row) for row in gaps]
    with pytest.raises(ValueError, match=r"is nan: values must be finite \(missing=.ignore. allows NaN"):
        make().fit(masked)
    np.testing.assert_array_equal(masked.data, INPUTS)


def named(names: str, inputs: Any = INPUTS) -> pd.DataFrame:
    return pd.DataFrame(np.asarray(inputs)[:, : len(names)], columns=list(names))


@every_kind
def test_a_fit_that_is_refused_changes_nothing(make: Callable[..., Map]) -> None:
    """Neither codes nor the number and names of columns are those of the refused inputs."""
    learner = make(random_state=0).fit(named("abc"))
    before, found = learner.state(), learner.predict(named("abc"))
    for inputs in (named("xyz", INPUTS * 1e200), named("xy", np.full((5, 2), np.nan)), named("xy") * np.inf):
        with pytest.raises(ValueError, match="values must be finite"):
            learner.fit(inputs)
    with pytest.raises(ValueError, match="unknown dtype"):
        learner.set_params(dtype="int8").fit(named("xy"))
    assert same(learner.set_params(dtype="float64").state(), before)
    assert same(learner.predict(named("abc")), found)


@every_kind
def test_names_of_columns_are_kept_as_long_as_they_hold(make: Callable[..., Map], tmp_path: Path) -> None:
    """Files have them; a new start without names, or a state of other dims, has none."""
    learner = make(random_state=0).partial_fit(named("abc"))
    learner.save(tmp_path / "map.npz")
    with pytest.raises(ValueError, match="feature names"):
        load_map(tmp_path / "map.npz").predict(named("cba"))
    other = make(random_state=0).fit(INPUTS[:, :2]).state()
    assert not hasattr(learner.initialise(2), "feature_names_in_")
    learner.fit(named("abc")).restore(other)
    assert not hasattr(learner, "feature_names_in_")


@every_kind
@pytest.mark.parametrize("offset", [1e4, 1e7])
def test_distances_are_as_exact_beside_gaps_and_far_from_0(make: Callable[..., Map], offset: float) -> None:
    """An offset that all inputs have, or a gap in another row, leaves distances what they are."""
    learner = make(missing="ignore", random_state=0).fit(INPUTS)
    state = learner.state()
    learner.restore(state | {"codebook": state["codebook"] + offset})
    inputs, codes = offset + INPUTS, learner.codebook_
    expected = np.sqrt(((inputs[:, None] - codes) ** 2).sum(axis=2))
    np.testing.assert_allclose(learner.transform(inputs), expected, rtol=1e-12)
    inputs[0, 1] = np.nan
    np.testing.assert_allclose(learner.transform(inputs)[1:], expected[1:], rtol=1e-12)
    observed = np.sqrt(1.5 * ((inputs[0] - codes)[:, [0, 2]] ** 2).sum(axis=1))
    np.testing.assert_allclose(learner.transform(inputs)[0], observed, rtol=1e-12)
    for x, row in zip(inputs, learner.transform(inputs), strict=True):
        assert learner.winner(x) == (learner.winners(x)[0][0], learner.winners(x)[1][0]) == (row.argmin(), row.min())


@every_kind
def test_a_map_may_be_asked_in_many_threads(make: Callable[..., Map]) -> None:
    """Looking shares no room."""
    learner, many = make(random_state=0).fit(INPUTS), np.random.default_rng(2).random((4000, 3))
    expected = learner.predict(many).tolist()
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(lambda x: learner.winner(x)[0], many)) == expected


@every_kind
def test_arrays_that_cannot_be_written_are_learned_on_in(make: Callable[..., Map]) -> None:
    """Processes of joblib are given such ones."""
    learner = make(random_state=0).fit(INPUTS[:30])
    buffers: list[pickle.PickleBuffer] = []
    packed = pickle.dumps(learner, protocol=5, buffer_callback=buffers.append)
    frozen = pickle.loads(packed, buffers=[bytes(buffer) for buffer in buffers])
    assert same(frozen.partial_fit(INPUTS[30:]).state(), learner.partial_fit(INPUTS[30:]).state())


@pytest.mark.parametrize(
    ("make", "change", "message"),
    [
        (DSOM, {"learning_rate": 50.0}, "learning_rate must be a finite number over 0 and at most 1; got 50.0"),
        (SOM, {"width": -1}, "width must be a finite number over 0"),
        (NeuralGas, {"horizon": 0}, "horizon must be a finite number over 0"),
        (GrowingNeuralGas, {"insert_every": 0}, "insert_every must be a whole number, at least 1; got 0"),
        (GrowingNeuralGas, {"max_age": 10**20}, "max_age must be at most 2147483647; got 100000000000000000000"),
        (EvolvingSOM, {"threshold": np.nan}, "threshold must be a finite number over 0; got nan"),
        (GrowWhenRequired, {"tau": 0}, "tau must be a finite number over 0; got 0"),
        *((kind, {"missing": "Ignore"}, "unknown missing 'Ignore'") for kind in MAPS),
    ],
)
def test_parameters_that_are_set_later_are_checked_too(make: Any, change: dict[str, Any], message: str) -> None:
    """Learning goes on with what is valid, and with nothing else."""
    learner = make(random_state=0).partial_fit(INPUTS)
    before = learner.state()
    for learn, given in ((learner.partial_fit, INPUTS), (learner.learn_one, INPUTS[0])):
        with pytest.raises(ValueError, match=message):
            learner.set_params(**change) and learn(given)
    assert same(learner.state(), before)


@pytest.mark.parametrize(
    "change",
    [{"shape": (6, 4)}, {"shape": (3, 3)}, {"lattice": "hexagonal"}, {"periodic": True}, {"preset": "printed"}],
)
def test_the_lattice_of_a_start_holds_until_the_next(change: dict[str, Any], tmp_path: Path) -> None:
    """A lattice that is asked for later changes nothing, until the map starts anew; nor can it be saved meanwhile."""
    dsom, twin = (DSOM(shape=(4, 6), random_state=0).partial_fit(INPUTS) for _ in range(2))
    dsom.set_params(**change)
    assert dsom.topology_ == twin.topology_
    assert same(dsom.partial_fit(INPUTS).state(), twin.partial_fit(INPUTS).state())
    (name,) = change
    with pytest.raises(ValueError, match=rf"{name} is .* now, but the map has started with .*: set it back"):
        dsom.save(tmp_path / "map.npz")
    assert not list(tmp_path.iterdir())
    assert same(dsom.fit(INPUTS).state(), DSOM(**{"shape": (4, 6), "random_state": 0} | change).fit(INPUTS).state())


@pytest.mark.parametrize("shape", [3, None, (), ("a", "b")])
@pytest.mark.parametrize("make", [SOM, DSOM])
def test_shapes_that_are_none_are_refused_by_name(make: Callable[..., Map], shape: Any) -> None:
    """Whatever else is given."""
    with pytest.raises(ValueError, match="shape must be one to four whole numbers"):
        make(shape=shape).fit(INPUTS)


@pytest.mark.parametrize(("dtype", "code"), [("float32", 1e39), ("float32", 1e16), ("float64", 1e151)])
def test_start_codes_that_the_precision_cannot_hold_are_refused(dtype: str, code: float) -> None:
    """Their squares would be infinite."""
    with pytest.raises(ValueError, match=r"start codes must be at most 1e\+\d+ in size for float"):
        SOM(shape=(2,), init=np.full((2, 3), code), dtype=dtype).fit(INPUTS)


def test_single_precision_holds_the_largest_inputs_in_many_dimensions() -> None:
    """Distances of inputs that are taken are finite."""
    large = np.full((2, 5000), 1e15) * [[1.0], [-1.0]]
    dsom = DSOM(shape=(2, 2), dtype="float32", random_state=0).fit(large * 0.99)
    assert np.isfinite(dsom.transform(large * 0.99)).all() and np.isfinite(dsom.state()["running_max_squared"])


def test_tables_are_given_where_tables_are_asked_for() -> None:
    """pandas output of transform, and measures that do not mind it."""
    som = SOM(shape=(3, 2), random_state=0).fit(INPUTS).set_output(transform="pandas")
    plain = SOM(shape=(3, 2), random_state=0).fit(INPUTS)
    assert list(som.transform(INPUTS).columns) == [f"som{unit}" for unit in range(6)]
    assert quality(som, INPUTS) == quality(plain, INPUTS)
    with sklearn.config_context(transform_output="pandas"):
        check_map(RunningMeans)


def test_a_unit_that_is_not_there_is_refused_by_name() -> None:
    """The message has the number that was asked for."""
    with pytest.raises(IndexError, match="this map has units 0 to 5; got 6"):
        SOM(shape=(3, 2)).fit(INPUTS).code(6)


def test_a_map_without_units_gives_no_distances() -> None:
    """Not in pieces either."""
    empty = EvolvingSOM().initialise(3)
    for look in (empty.transform, lambda X: list(empty.transform_chunks(X)), empty.predict):
        with pytest.raises(NotFittedError, match="no units yet"):
            look(INPUTS)
