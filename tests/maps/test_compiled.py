"""What the compiled maps share: parameters that hold from the next input on, and one call in the place of two."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from sklearn.exceptions import NotFittedError

from somatopy.contract import same
from somatopy.maps import DSOM, SOM, EvolvingSOM, GrowingNeuralGas, GrowWhenRequired, Map, NeuralGas
from somatopy.maps.compiled import CompiledMap

INPUTS = np.random.default_rng(3).random((300, 3))

Make = Callable[..., Map]
MAPS: list[Make] = [
    partial(DSOM, shape=(6, 7), elasticity=0.5, random_state=0),
    partial(DSOM, shape=(6, 7), preset="schillaci2016", random_state=0),
    partial(SOM, shape=(6, 7), lattice="hexagonal", random_state=0),
    partial(NeuralGas, units=20, random_state=0),
    partial(GrowingNeuralGas, insert_every=5, random_state=0),
    partial(EvolvingSOM, threshold=0.2),
    partial(GrowWhenRequired, activity_threshold=0.8),
]
every_map = pytest.mark.parametrize("make", MAPS)


@every_map
def test_learning_and_finding_in_one_call_is_both_calls(make: Make) -> None:
    """Winner, distance and all that is learned are the same bits, from the first input on, while maps grow."""
    one, two = make(), make()
    assert isinstance(one, CompiledMap)
    for x in INPUTS:
        found = one.learn_and_find(x)
        two.learn_one(x)
        assert found == two.winner(x)
    assert same(one.state(), two.state())


@every_map
def test_code_is_a_copy_of_the_row(make: Make) -> None:
    """Counted from either end, as arrays are; a number beyond the units is an IndexError that says which there are."""
    trained = make().partial_fit(INPUTS)
    codes = trained.codebook_
    for unit in range(len(codes)):
        np.testing.assert_array_equal(trained.code(unit), codes[unit])
        np.testing.assert_array_equal(trained.code(unit - len(codes)), codes[unit])
    trained.code(0)[:] = 9.0
    np.testing.assert_array_equal(trained.codebook_, codes)
    for beyond in (len(codes), -len(codes) - 1):
        with pytest.raises(IndexError, match=rf"this map has units 0 to {len(codes) - 1}; got {beyond}"):
            trained.code(beyond)
    with pytest.raises(NotFittedError):
        make().code(0)


#: A map, a parameter that can change in place, as it begins, and what it becomes.
MUTABLE: list[tuple[Make, str, Any, Any]] = [
    (partial(SOM, shape=(6, 7)), "learning_rate", [0.5, 0.4], [0.01, 0.01]),
    (partial(SOM, shape=(6, 7)), "width", np.array([3.0, 2.0]), [0.5, 0.5]),
    (partial(NeuralGas, units=20), "width", [10.0, 5.0], [0.5, 0.5]),
    (partial(DSOM, shape=(6, 7)), "elasticity", np.array(2.0), 0.1),
    (partial(DSOM, shape=(6, 7)), "learning_rate", np.array(0.9), 0.1),
    (GrowingNeuralGas, "learning_rate", np.array(0.9), 0.1),
    (partial(EvolvingSOM, threshold=0.2), "learning_rate", np.array(0.9), 0.1),
    (partial(GrowWhenRequired, activity_threshold=0.8), "learning_rate", np.array(0.9), 0.1),
]


@pytest.mark.parametrize(("make", "name", "first", "then"), MUTABLE)
def test_a_parameter_that_changes_in_place_holds_from_the_next_input_on(
    make: Make, name: str, first: Any, then: Any
) -> None:
    """The map learns as one whose parameter is set anew, not as one whose parameter stays."""
    changed, told, left = (make(**{name: np.array(first)}, random_state=0) for _ in range(3))
    if isinstance(first, list):
        changed.set_params(**{name: list(first)})
    for learner in (changed, told, left):
        for x in INPUTS[:20]:
            learner.learn_one(x)
    getattr(changed, name)[... if isinstance(first, np.ndarray) else slice(None)] = then
    told.set_params(**{name: np.array(then)})
    for learner in (changed, told, left):
        for x in INPUTS[20:40]:
            learner.learn_one(x)
    assert same(changed.state(), told.state())
    assert not same(changed.state(), left.state())


@pytest.mark.parametrize("learn", ["learn_one", "learn_and_find"])
def test_a_parameter_that_becomes_wrong_is_refused_before_anything_is_learned(learn: str) -> None:
    """Set or changed in place, it is named; the map goes on once it is mended."""
    som = SOM(shape=(3, 3), learning_rate=[0.5, 0.1], random_state=0).partial_fit(INPUTS)
    before = som.state()
    som.learning_rate[0] = -1.0  # type: ignore[index]
    with pytest.raises(ValueError, match=r"learning_rate must be a finite number over 0 and at most 1, or a pair"):
        getattr(som, learn)(INPUTS[0])
    som.set_params(learning_rate=0.5, horizon=0)
    with pytest.raises(ValueError, match="horizon must be a finite number over 0; got 0"):
        getattr(som, learn)(INPUTS[0])
    som.set_params(horizon=100)
    assert same(som.state(), before)
    getattr(som, learn)(INPUTS[0])
    assert som.samples_seen_ == len(INPUTS) + 1


def test_importing_the_maps_loads_no_description_machinery() -> None:
    """Maps are of use without the experiment: neither its packages nor its own layers come with them."""
    heavy = ("pydantic", "tyro", "mujoco", "cv2", "matplotlib", "plotly")
    upper = ("experiment", "analysis", "cli", "learners", "bodies", "eyes", "babbling", "links")
    names = [*heavy, *(f"somatopy.{part}" for part in upper)]
    program = f"import sys, somatopy.maps; print([name for name in {names} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
