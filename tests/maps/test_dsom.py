"""DSOM against its equations and its laws."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from somatopy.maps import DSOM

Floats = NDArray[np.float64]


def positions(shape: tuple[int, ...]) -> Floats:
    """Lattice positions, opposite corners 1 apart."""
    axes = [np.arange(n) / max(n - 1, 1) for n in shape]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(shape))
    return grid / np.sqrt(max(1, sum(n > 1 for n in shape)))


def slow_dsom(
    codes: Floats, inputs: Floats, shape: tuple[int, ...], rate: float, elasticity: float, preset: str = "rougier"
) -> Floats:
    """Equations 1 and 2, written down as they stand."""
    in_cells = preset == "schillaci2016"
    places = np.argwhere(np.ones(shape)) if in_cells else positions(shape)
    codes, farthest = codes.copy(), 0.0
    for v in inputs:
        distance = np.linalg.norm(v - codes, axis=1)
        farthest = max(farthest, distance.max())
        s = distance.argmin()
        if distance[s] == 0:
            continue
        lattice, omega = np.linalg.norm(places - places[s], axis=1), distance / (1 if in_cells else farthest)
        if in_cells:
            h = np.exp(-lattice / omega[s] / elasticity**2)
        else:
            h = np.exp(-((lattice / (omega if preset == "printed" else omega[s])) ** 2) / elasticity**2)
        codes += np.minimum(rate * omega * h, 1)[:, None] * (v - codes)
    return codes


@pytest.mark.parametrize("preset", ["rougier", "schillaci2016", "printed"])
@pytest.mark.parametrize("elasticity", [0.02, 0.1, 0.5, 1.75, 50.0])
@pytest.mark.parametrize(("shape", "dims"), [((8, 8), 2), ((30, 30), 4), ((3, 20), 5), ((12,), 1), ((12, 1), 3)])
def test_agrees_with_its_equations(shape: tuple[int, ...], dims: int, elasticity: float, preset: str) -> None:
    """300 random inputs, some beyond the range of the codes, leave the codes where plain NumPy leaves them."""
    rng = np.random.default_rng(7)
    start, inputs = rng.random((int(np.prod(shape)), dims)), rng.uniform(-0.5, 1.5, (300, dims))
    learned = DSOM(shape=shape, learning_rate=0.3, elasticity=elasticity, preset=preset, init=start).partial_fit(inputs)
    expected = slow_dsom(start, inputs, shape, 0.3, elasticity, preset)
    np.testing.assert_allclose(learned.codebook_, expected, rtol=0, atol=1e-12)


def test_raw_distances_never_carry_a_code_beyond_the_input() -> None:
    """Where a distance of over 1 / rate would overshoot, the code lands on the input."""
    dsom = DSOM(shape=(1,), preset="schillaci2016", init=[[0.0, 0.0]])
    dsom.learn_one([30.0, 40.0])
    np.testing.assert_array_equal(dsom.codebook_, [[30.0, 40.0]])


def test_presets_bring_their_own_rates() -> None:
    """Rates that are not given are the preset's; given ones win."""
    own = DSOM(shape=(4, 4), preset="schillaci2016", random_state=0)
    given = DSOM(shape=(4, 4), preset="schillaci2016", learning_rate=0.2, elasticity=1.5, random_state=0)
    other = DSOM(shape=(4, 4), preset="schillaci2016", learning_rate=0.1, random_state=0)
    codes = [dsom.partial_fit([[0.3, 0.4]]).codebook_ for dsom in (own, given, other)]
    np.testing.assert_array_equal(codes[0], codes[1])
    assert not np.array_equal(codes[0], codes[2])


@given(st.integers(0, 63), st.floats(0.01, 10.0), st.integers(1, 6))
def test_an_exact_hit_moves_nothing(unit: int, elasticity: float, dims: int) -> None:
    """An input that lies on a code leaves every code where it is, and is counted."""
    dsom = DSOM(shape=(8, 8), elasticity=elasticity, random_state=0).initialise(dims)
    before = dsom.codebook_
    assert dsom.learn_one(before[unit]) == unit
    np.testing.assert_array_equal(dsom.codebook_, before)
    assert dsom.state()["samples_seen"] == 1


def test_equal_codes_and_inputs_stay_finite() -> None:
    """Where all distances are 0 there is no maximum to divide by, and nothing moves."""
    dsom = DSOM(shape=(3, 3), init=np.ones((9, 2))).partial_fit(np.ones((5, 2)))
    np.testing.assert_array_equal(dsom.codebook_, np.ones((9, 2)))


@settings(max_examples=40)
@given(
    st.integers(0, 2**32),
    st.sampled_from([(6, 7), (1, 9), (9,), (20, 20)]),
    st.floats(0.01, 1.0),
    st.floats(1e-160, 1e160),
)
def test_codes_stay_among_start_codes_and_inputs(
    seed: int, shape: tuple[int, ...], rate: float, elasticity: float
) -> None:
    """No step overshoots its input, whatever rate and elasticity: codes stay in the box of start codes and inputs."""
    rng = np.random.default_rng(seed)
    inputs = rng.normal(size=(50, 3)) * 10.0 ** rng.integers(-6, 7)
    dsom = DSOM(shape=shape, learning_rate=rate, elasticity=elasticity, random_state=rng).initialise(3)
    known = np.concatenate([dsom.codebook_, inputs])
    codes = dsom.partial_fit(inputs).codebook_
    slack = 1e-12 * np.abs(known).max()
    assert (codes >= known.min(axis=0) - slack).all()
    assert (codes <= known.max(axis=0) + slack).all()


@pytest.mark.parametrize("preset", ["rougier", "schillaci2016", "printed"])
@pytest.mark.parametrize("elasticity", [1e-300, 1e-170, 1e170, 1e300])
def test_extreme_elasticities_stay_finite(preset: str, elasticity: float) -> None:
    """Where the elasticity's square leaves the range of a double, the winner moves alone, or all units alike."""
    dsom = DSOM(shape=(5, 20), preset=preset, elasticity=elasticity, random_state=0).initialise(2)
    before = dsom.codebook_
    winner = dsom.learn_one([2.0, 2.0])
    moved = np.flatnonzero((dsom.codebook_ != before).any(axis=1))
    np.testing.assert_array_equal(moved, [winner] if elasticity < 1 else np.arange(100))
    assert np.isfinite(dsom.partial_fit(np.random.default_rng(0).random((50, 2))).codebook_).all()


def test_largest_values_are_learned_without_overflow() -> None:
    """The largest inputs that are taken give finite codes."""
    codes = DSOM(shape=(4, 4), random_state=0).partial_fit([[1e150, -1e150], [0.0, 1e-150]]).codebook_
    assert np.isfinite(codes).all()


def test_seeds_reproduce_and_differ() -> None:
    """One seed or equal generators give the same start codes, another seed others."""
    first, again = (DSOM(random_state=5).initialise(4).codebook_ for _ in range(2))
    generator = DSOM(random_state=np.random.default_rng(5)).initialise(4).codebook_
    np.testing.assert_array_equal(first, again)
    np.testing.assert_array_equal(first, generator)
    assert not np.array_equal(first, DSOM(random_state=6).initialise(4).codebook_)


def test_start_codes_fill_their_bounds() -> None:
    """Each dimension is drawn from its own range, and all of it."""
    bounds = np.array([[-2.0, -1.0], [0.0, 10.0]])
    codes = DSOM(bounds=bounds, random_state=0).initialise(2).codebook_
    np.testing.assert_allclose(codes.min(axis=0), bounds[:, 0], atol=0.01 * np.ptp(bounds, axis=1).max())
    np.testing.assert_allclose(codes.max(axis=0), bounds[:, 1], atol=0.01 * np.ptp(bounds, axis=1).max())
    assert (codes >= bounds[:, 0]).all()
    assert (codes <= bounds[:, 1]).all()


def test_given_start_codes_are_copied() -> None:
    """Learning does not write into the array that init gave."""
    start = np.random.default_rng(0).random((9, 2))
    kept = start.copy()
    DSOM(shape=(3, 3), init=start).partial_fit(kept[:4] + 0.3)
    np.testing.assert_array_equal(start, kept)


def test_rates_can_be_set_while_learning() -> None:
    """A new learning rate holds from the next input on."""
    fast, slow = (DSOM(shape=(3, 3), random_state=0).initialise(2) for _ in range(2))
    slow.set_params(learning_rate=0.01)
    before = fast.codebook_
    moved = [dsom.codebook_ - before for dsom in (fast, slow) if dsom.learn_one([2.0, 2.0]) >= 0]
    np.testing.assert_allclose(moved[0], 10 * moved[1], atol=1e-15)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"shape": (0, 3)}, "shape must be one to four whole numbers"),
        ({"learning_rate": 0}, r"learning_rate must be a finite number over 0 and at most 1; got 0"),
        ({"learning_rate": 1.5}, r"learning_rate must be a finite number over 0 and at most 1; got 1.5"),
        ({"learning_rate": np.nan}, "learning_rate must be a finite number over 0"),
        ({"elasticity": -1.0}, r"elasticity must be a finite number over 0; got -1.0"),
        ({"elasticity": np.inf}, "elasticity must be a finite number"),
        ({"preset": "printet"}, r"unknown preset 'printet'; valid presets: \['rougier', 'schillaci2016', 'printed'\]"),
        ({"bounds": (1, 0)}, r"bounds must be finite \(low, high\) with low < high.*got \(1, 0\)"),
        ({"bounds": (0, np.inf)}, "bounds must be finite"),
        ({"bounds": [[0, 1]] * 3}, r"shape \(2, 2\)"),
        ({"init": "pcs"}, r"one of \['auto', 'pca', 'sample', 'uniform'\], or an array \(units, dims\); got 'pcs'"),
        ({"init": np.zeros((8, 2))}, r"init must have shape \(units, dims\), \(9, 2\) here; got \(8, 2\)"),
        ({"init": np.full((9, 2), np.nan)}, "init must be finite"),
    ],
)
def test_bad_parameters_are_refused_by_name(parameters: dict[str, Any], message: str) -> None:
    """The error says which parameter, its value and what is valid, and comes before anything is learned."""
    dsom = DSOM(**{"shape": (3, 3), **parameters})
    for start in (lambda: dsom.initialise(2), lambda: dsom.learn_one([0.1, 0.2]), lambda: dsom.fit([[0.1, 0.2]])):
        with pytest.raises(ValueError, match=message):
            start()


def test_wrong_length_is_named() -> None:
    """The message has both lengths."""
    dsom = DSOM(shape=(3, 3)).initialise(4)
    with pytest.raises(ValueError, match=r"inputs of shape \(4,\); got shape \(2,\)"):
        dsom.learn_one([0.1, 0.2])
    with pytest.raises(ValueError, match="dims must be a whole number, at least 1; got 0"):
        dsom.initialise(0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"codebook": np.zeros((8, 2))}, r"the restored codebook must have shape \(9, 2\) for this map; got \(8, 2\)"),
        ({"codebook": np.full((9, 2), np.inf)}, "restored codebook must be finite"),
        ({"running_max_squared": np.nan}, "the restored running_max_squared must be finite"),
        ({"samples_seen": -1}, "counters of a DSOM are numbers from 0 up"),
    ],
)
def test_bad_states_are_refused_before_anything_changes(change: dict[str, Any], message: str) -> None:
    """A state that does not fit leaves the map as it was."""
    dsom = DSOM(shape=(3, 3), random_state=0).partial_fit([[0.1, 0.2]])
    before = dsom.codebook_
    with pytest.raises(ValueError, match=message):
        dsom.restore({**dsom.state(), **change})
    with pytest.raises(ValueError, match=r"\['samples_seen'\] are missing or unknown"):
        dsom.restore({name: value for name, value in dsom.state().items() if name != "samples_seen"})
    np.testing.assert_array_equal(dsom.codebook_, before)
