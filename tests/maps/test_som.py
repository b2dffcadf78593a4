"""SOM against its laws; its equation on every lattice is in test_lattice_kernels, recorded states in test_golden."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from somatopy.maps import SOM, Lattice

INPUTS = np.random.default_rng(0).random((3000, 2))


def test_partial_fit_never_restarts_the_schedule() -> None:
    """In ten batches or one, the same map; and it fades by inputs, not by calls."""
    whole, pieces = (SOM(shape=(5, 5), horizon=3000, random_state=1) for _ in range(2))
    for piece in np.split(INPUTS, 10):
        pieces.partial_fit(piece)
    np.testing.assert_array_equal(whole.partial_fit(INPUTS).codebook_, pieces.codebook_)


def test_unfolds_over_a_square() -> None:
    """Of 5 maps that started at random, all end unfolded: lattice neighbours are nearer than other units."""
    for seed in range(5):
        trained = SOM(shape=(6, 6), horizon=3000, random_state=seed).fit(INPUTS)
        codes, lattice = trained.codebook_, Lattice((6, 6))
        apart = np.linalg.norm(codes[:, None] - codes, axis=2)
        joined = np.zeros_like(apart, dtype=bool)
        joined[tuple(lattice.edges.T)] = True
        others = ~(joined | joined.T | np.eye(36, dtype=bool))
        assert apart[joined].max() < 0.35
        assert apart[joined].mean() < 0.5 * apart[others].mean()


def test_a_ring_of_units_closes_on_a_circle() -> None:
    """A periodic lattice of one axis, on a circle: first and last unit are as near as any neighbours."""
    angle = np.random.default_rng(0).uniform(0, 2 * np.pi, 4000)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    codes = SOM(shape=(20,), periodic=True, horizon=4000, bounds=(-1, 1), random_state=0).fit(circle).codebook_
    steps = np.linalg.norm(codes - np.roll(codes, 1, axis=0), axis=1)
    assert steps.max() < 2 * 2 * np.pi / 20
    turned = np.unwrap(np.append(*(np.arctan2(c[:, 1], c[:, 0]) for c in (codes, codes[:1]))))
    assert abs(turned[-1] - turned[0]) == pytest.approx(2 * np.pi)


def test_a_width_of_none_starts_at_half_the_longest_axis() -> None:
    """It is the pair (half the longest axis, half a cell)."""
    automatic, explicit = SOM(shape=(4, 10), random_state=0), SOM(shape=(4, 10), width=(5, 0.5), random_state=0)
    np.testing.assert_array_equal(automatic.fit(INPUTS).codebook_, explicit.fit(INPUTS).codebook_)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"shape": (2, 2, 2, 2, 2)}, "shape must be one to four whole numbers"),
        ({"lattice": "hex"}, r"unknown lattice 'hex'; valid lattices: \['rectangular', 'hexagonal'\]"),
        ({"lattice": "hexagonal", "shape": (9,)}, r"a hexagonal lattice has two axes; got shape \(9,\)"),
        ({"lattice": "hexagonal", "shape": (3, 4), "periodic": True}, "needs an even number of rows"),
        ({"periodic": "yes"}, "periodic must be True or False; got 'yes'"),
        ({"learning_rate": 2.0}, "learning_rate must be a finite number over 0 and at most 1"),
        ({"width": (1.0, np.nan)}, "width must be a finite number over 0"),
        ({"horizon": np.inf}, "horizon must be a finite number over 0; got inf"),
        ({"dtype": "float16"}, r"unknown dtype 'float16'; valid: \['float64', 'float32'\]"),
        ({"missing": "drop"}, r"unknown missing 'drop'; valid: \['error', 'ignore'\]"),
    ],
)
def test_bad_parameters_are_refused_by_name(parameters: dict[str, Any], message: str) -> None:
    """The error says which parameter, its value and what is valid."""
    for start in (lambda som: som.fit(INPUTS), lambda som: som.learn_one(INPUTS[0]), lambda som: som.initialise(2)):
        with pytest.raises(ValueError, match=message):
            start(SOM(**parameters))
