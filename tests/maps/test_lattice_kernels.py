"""SOM and DSOM on every kind of lattice, against their equations in plain NumPy on `Lattice.distances`."""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from somatopy.maps import DSOM, SOM, Lattice

Floats = NDArray[np.float64]
Gains = Callable[[Floats, int, int], Floats]  # distances to the input, winner, inputs before: gain of each unit

LATTICES = [
    *(Lattice(shape) for shape in [(7,), (40,), (6, 5), (3, 40), (30, 2), (3, 4, 5), (2, 3, 3, 4), (2, 1, 4)]),
    *(Lattice(shape, periodic=True) for shape in [(7,), (40,), (6, 5), (3, 40), (9, 2), (3, 4, 5), (2, 3, 3, 4)]),
    *(Lattice(shape, "hexagonal") for shape in [(6, 5), (5, 6), (3, 37), (1, 9), (9, 1)]),
    *(Lattice(shape, "hexagonal", periodic=True) for shape in [(6, 5), (4, 4), (4, 37), (2, 3)]),
]
every_lattice = pytest.mark.parametrize("lattice", LATTICES, ids=str)


def cells(lattice: Lattice) -> Floats:
    """Distance between any two units, cells."""
    return np.array([lattice.distances(unit) for unit in range(lattice.units)])


def normalised(lattice: Lattice) -> Floats:
    """The same where the farthest are 1 apart, each axis of a rectangular lattice counting alike."""
    if lattice.kind == "hexagonal":
        return cells(lattice) / max(cells(lattice).max(), 1.0)
    squares, axes = np.zeros((lattice.units, lattice.units)), 0
    for axis, n in enumerate(lattice.shape):
        if n > 1:
            along, place = cells(Lattice((n,), periodic=lattice.periodic)), lattice.places[:, axis]
            squares += (along / along.max())[place][:, place] ** 2
            axes += 1
    return np.sqrt(squares / max(axes, 1))


def learned(codes: Floats, inputs: Floats, gains: Gains) -> Floats:
    """All codes move by their gain towards each input, in the coordinates that were observed."""
    codes = codes.copy()
    for t, v in enumerate(inputs):
        seen = ~np.isnan(v)
        distances = np.linalg.norm((v - codes)[:, seen], axis=1) * sqrt(v.size / seen.sum())
        gain = gains(distances, int(distances.argmin()), t)
        codes[:, seen] += gain[:, None] * (v - codes)[:, seen]
    return codes


def material(lattice: Lattice, missing: str, dims: int = 3) -> tuple[Floats, Floats]:
    """Start codes, and inputs around them; some lack a coordinate, if they may."""
    rng = np.random.default_rng(lattice.units)
    codes, inputs = rng.random((lattice.units, dims)), rng.uniform(-0.3, 1.3, (40, dims))
    if missing == "ignore":
        inputs[np.arange(40), rng.integers(0, dims, 40)] = np.where(rng.random(40) < 0.7, np.nan, 0.5)
    return codes, inputs


def of_lattice(lattice: Lattice, codes: Floats, missing: str) -> dict[str, Any]:
    return {
        "shape": lattice.shape,
        "lattice": lattice.kind,
        "periodic": lattice.periodic,
        "init": codes,
        "missing": missing,
    }


def agree(trained: SOM | DSOM, codes: Floats, inputs: Floats, gains: Gains) -> None:
    """Learning from `inputs` leaves the codes where the equation leaves them."""
    found = trained.partial_fit(inputs).codebook_
    assert not np.allclose(found, codes)
    np.testing.assert_allclose(found, learned(codes, inputs, gains), rtol=0, atol=1e-12)


@every_lattice
@pytest.mark.parametrize(
    ("width", "missing"),
    [(0.2, "error"), (0.7, "error"), ((3.0, 0.5), "error"), (60.0, "error"), ((3.0, 0.5), "ignore")],
)
def test_som(lattice: Lattice, width: Any, missing: str) -> None:
    """A Gaussian of the distance in cells, its width fading or not."""
    codes, inputs = material(lattice, missing)
    apart, (first, last) = cells(lattice), width if isinstance(width, tuple) else (width, width)

    def gains(distances: Floats, s: int, t: int) -> Floats:
        share = min(t / 30, 1.0)
        sigma, rate = first * (last / first) ** share, 0.3 * (0.05 / 0.3) ** share
        return rate * np.exp(-(apart[s] ** 2) / (2 * sigma**2))

    trained = SOM(learning_rate=(0.3, 0.05), width=width, horizon=30, **of_lattice(lattice, codes, missing))
    agree(trained, codes, inputs, gains)


def dsom_gains(lattice: Lattice, preset: str, rate: float, elasticity: float) -> Gains:
    """Equations 1 and 2 in the three ways to read them."""
    apart = cells(lattice) if preset == "schillaci2016" else normalised(lattice)
    farthest = 0.0

    def gains(distances: Floats, s: int, t: int) -> Floats:
        nonlocal farthest
        farthest = max(farthest, distances.max())
        if preset == "schillaci2016":
            h = np.exp(-apart[s] / (elasticity**2 * distances[s]))
            return np.minimum(rate * distances * h, 1.0)
        relative = distances / farthest
        own = relative[s] if preset == "rougier" else relative
        return rate * relative * np.exp(-((apart[s] / (elasticity * own)) ** 2))

    return gains


@every_lattice
@pytest.mark.parametrize(("elasticity", "missing"), [(0.1, "error"), (0.8, "error"), (20.0, "error"), (0.8, "ignore")])
@pytest.mark.parametrize("preset", ["rougier", "schillaci2016", "printed"])
def test_dsom(lattice: Lattice, preset: str, elasticity: float, missing: str) -> None:
    """Neighbourhoods from less than a cell to the whole lattice, in each preset."""
    codes, inputs = material(lattice, missing)
    trained = DSOM(learning_rate=0.3, elasticity=elasticity, preset=preset, **of_lattice(lattice, codes, missing))
    agree(trained, codes, inputs, dsom_gains(lattice, preset, 0.3, elasticity))


@pytest.mark.parametrize("dims", [1, 2, 4, 5, 8, 11])
@pytest.mark.parametrize("lattice", [Lattice((6, 20)), Lattice((6, 5), "hexagonal", periodic=True)], ids=str)
def test_any_number_of_dimensions(lattice: Lattice, dims: int) -> None:
    """Padded dimensions change nothing."""
    codes, inputs = material(lattice, "error", dims)
    common, squares = of_lattice(lattice, codes, "error"), cells(lattice) ** 2
    agree(
        SOM(learning_rate=0.2, width=1.5, **common),
        codes,
        inputs,
        lambda distances, s, t: 0.2 * np.exp(-squares[s] / (2 * 1.5**2)),
    )
    trained = DSOM(learning_rate=0.2, elasticity=0.5, **common)
    agree(trained, codes, inputs, dsom_gains(lattice, "rougier", 0.2, 0.5))


@every_lattice
def test_single_precision_takes_the_same_steps(lattice: Lattice) -> None:
    """One input moves float32 codes as the equation does, but for rounding."""
    codes, inputs = material(lattice, "error")
    codes, inputs = codes.astype(np.float32).astype(float), inputs.astype(np.float32).astype(float)
    squares, common = cells(lattice) ** 2, of_lattice(lattice, codes, "error") | {"dtype": "float32"}

    def gains(distances: Floats, s: int, t: int) -> Floats:
        return 0.2 * np.exp(-squares[s] / (2 * 0.9**2))

    for v in inputs[:8, None]:
        som = SOM(learning_rate=0.2, width=0.9, **common).partial_fit(v)
        np.testing.assert_allclose(som.codebook_, learned(codes, v, gains), rtol=0, atol=1e-6)
        for preset, elasticity in (("rougier", 0.3), ("schillaci2016", 1.5), ("printed", 0.3)):
            dsom = DSOM(learning_rate=0.2, elasticity=elasticity, preset=preset, **common).partial_fit(v)
            expected = learned(codes, v, dsom_gains(lattice, preset, 0.2, elasticity))
            np.testing.assert_allclose(dsom.codebook_, expected, rtol=0, atol=2e-6)


def test_normalised_distances_of_the_reference_are_the_authors() -> None:
    """On an open square, positions from 0 to 1 divided by the square root of 2: opposite corners are 1 apart."""
    apart = normalised(Lattice((3, 3)))
    assert apart[0, 8] == pytest.approx(1.0)
    assert apart[0, 1] == pytest.approx(0.5 / sqrt(2))
