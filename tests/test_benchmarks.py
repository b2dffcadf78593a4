"""The rules in NumPy that the maps are timed against compute what the maps compute."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from somatopy.maps import DSOM, NeuralGas

FILE = Path(__file__).parents[1] / "benchmarks" / "peers.py"
INPUTS = np.random.default_rng(1).random((60, 4))


def rule(name: str) -> Callable[..., Any]:
    spec = importlib.util.spec_from_file_location("peers", FILE)
    assert spec is not None and spec.loader is not None
    peers = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(peers)
    return getattr(peers, name)


@pytest.mark.parametrize("name", ["plain_dsom", "tuned_dsom"])
def test_dsom_rules_are_those_of_the_map(name: str) -> None:
    """Same start codes and running maximum, same inputs: the same codes to rounding."""
    dsom = DSOM(shape=(5, 7), learning_rate=0.1, elasticity=0.5, random_state=0).partial_fit(INPUTS[:20])
    farthest = float(np.sqrt(dsom.state()["running_max_squared"]))
    codes = rule(name)(dsom.codebook_, (5, 7), 0.1, 0.5, farthest)(INPUTS[20:])
    np.testing.assert_allclose(codes, dsom.partial_fit(INPUTS[20:]).codebook_, rtol=0, atol=1e-12)


def test_the_neural_gas_rule_is_that_of_the_map() -> None:
    """Same start codes, same inputs: the same codes to rounding."""
    gas = NeuralGas(units=35, learning_rate=0.2, width=3.0, random_state=0).initialise(4)
    codes = rule("plain_gas")(gas.codebook_, 0.2, 3.0)(INPUTS)
    np.testing.assert_allclose(codes, gas.partial_fit(INPUTS).codebook_, rtol=0, atol=1e-12)
