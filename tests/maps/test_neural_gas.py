"""Neural gas against its equation and its laws; the original program's states are in test_golden."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from somatopy.maps import NeuralGas

Floats = NDArray[np.float64]


def slow_gas(
    codes: Floats, inputs: Floats, rates: tuple[float, float], widths: tuple[float, float], T: float
) -> Floats:
    """The equation, written down as it stands."""
    codes = codes.copy()
    for t, v in enumerate(inputs):
        rate, width = (a * (b / a) ** min(t / T, 1) for a, b in (rates, widths))
        ranks = np.linalg.norm(v - codes, axis=1).argsort(kind="stable").argsort()
        codes += (rate * np.exp(-ranks / width))[:, None] * (v - codes)
    return codes


@pytest.mark.parametrize("widths", [(10.0, 0.01), (0.3, 0.3), (200.0, 50.0)])
@pytest.mark.parametrize(("units", "dims"), [(1, 2), (2, 1), (40, 3), (300, 4), (97, 6)])
def test_agrees_with_its_equation(units: int, dims: int, widths: tuple[float, float]) -> None:
    """300 inputs over a horizon of 200 leave the codes where plain NumPy leaves them."""
    rng = np.random.default_rng(3)
    start, inputs = rng.random((units, dims)), rng.uniform(-0.5, 1.5, (300, dims))
    trained = NeuralGas(units=units, learning_rate=(0.5, 0.01), width=widths, horizon=200, init=start)
    expected = slow_gas(start, inputs, (0.5, 0.01), widths, 200)
    np.testing.assert_allclose(trained.partial_fit(inputs).codebook_, expected, rtol=0, atol=1e-12)


def test_it_begins_with_the_schedule_whose_errors_are_published() -> None:
    """Rougier and Boniface (2011), as in test_golden: from .5 to .005, and from 10 ranks to .01, over 20,000 inputs."""
    own = NeuralGas().get_params()
    assert (own["learning_rate"], own["width"], own["horizon"]) == ((0.5, 0.005), (10.0, 0.01), 20_000)


def test_equal_units_rank_in_their_order() -> None:
    """Of units at one place the first moves most, each next one less by the factor exp(-1 / width)."""
    trained = NeuralGas(units=4, learning_rate=0.5, width=1.0, init=np.zeros((4, 2)))
    assert trained.learn_one([1.0, 0.0]) == 0
    np.testing.assert_allclose(trained.codebook_[:, 0], 0.5 * np.exp(-np.arange(4.0)))


def test_schedules_end_at_their_last_value() -> None:
    """From the horizon on, a map that fades learns like one that has the last values from the start."""
    inputs = np.random.default_rng(0).random((300, 2))
    faded = NeuralGas(units=20, learning_rate=(0.5, 0.1), width=(5, 0.5), horizon=100, random_state=0)
    codes = faded.partial_fit(inputs[:100]).codebook_
    steady = NeuralGas(units=20, learning_rate=0.1, width=0.5, init=codes)
    np.testing.assert_array_equal(faded.partial_fit(inputs[100:]).codebook_, steady.partial_fit(inputs[100:]).codebook_)


def test_has_no_topology() -> None:
    """Its units have no neighbours, and it says so."""
    gas = NeuralGas(units=3).initialise(2)
    assert not hasattr(gas, "topology_")
    with pytest.raises(AttributeError, match="a NeuralGas has no topology"):
        _ = gas.topology_


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"units": 0}, "units must be a whole number, at least 1; got 0"),
        ({"units": 2.5}, "units must be a whole number, at least 1; got 2.5"),
        (
            {"learning_rate": (0.5, 0)},
            r"learning_rate must be a finite number over 0 and at most 1, or a pair.*0\.5, 0",
        ),
        ({"learning_rate": (0.5, 0.1, 0.1)}, "learning_rate must be"),
        ({"width": -1}, r"width must be a finite number over 0, or a pair \(first, last\) of such; got -1"),
        ({"width": "wide"}, "width must be a finite number"),
        ({"horizon": 0}, "horizon must be a finite number over 0; got 0"),
        ({"init": np.zeros((3, 2))}, r"init must have shape \(units, dims\), \(100, 2\) here; got \(3, 2\)"),
    ],
)
def test_bad_parameters_are_refused_by_name(parameters: dict[str, Any], message: str) -> None:
    """The error says which parameter, its value and what is valid."""
    with pytest.raises(ValueError, match=message):
        NeuralGas(**parameters).fit([[0.1, 0.2]])
