"""Measure what the elasticity of a DSOM does: error, order, twists. The numbers of docs/maps/dsom.md.

Takes about two minutes.

Example: python docs/sweep_elasticity.py
"""

from __future__ import annotations

import warnings

import numpy as np
import statsmodels.datasets
from numpy.typing import NDArray
from sklearn import datasets
from sklearn.exceptions import ConvergenceWarning
from sklearn.model_selection import train_test_split
from sklearn.preprocessing import StandardScaler

from somatopy.maps import DSOM
from somatopy.maps.quality import mean_squared_error, quantisation_error, topographic_error

Floats = NDArray[np.float64]

ELASTICITIES = (0.1, 0.2, 0.35, 0.5, 0.7, 1.0, 1.75)
CASES = ((2, (8, 8)), (2, (30, 30)), (3, (30, 30)), (4, (8, 8)), (4, (30, 30)))
TWISTED = 1.5  # times the median error of all seeds


def trained(inputs: Floats, shape: tuple[int, int], elasticity: float, seed: int, preset: str = "rougier") -> DSOM:
    return DSOM(shape=shape, elasticity=elasticity, preset=preset, random_state=seed).partial_fit(inputs)


def measured(dims: int, shape: tuple[int, int], elasticity: float) -> str:
    """Medians, over three seeds, of quantisation error and topographic error on fresh inputs from the unit cube."""
    fresh, found = np.random.default_rng(9).random((2000, dims)), []
    for seed in range(3):
        dsom = trained(np.random.default_rng(50 + seed).random((100_000, dims)), shape, elasticity, seed)
        found.append((quantisation_error(dsom, fresh), topographic_error(dsom, fresh)))
    error, disorder = np.median(found, axis=0)
    return f"{error:.3f}, {disorder:.2f}"


def ring(rng: np.random.Generator, count: int) -> Floats:
    angle, radius = rng.uniform(0, 2 * np.pi, count), np.sqrt(rng.uniform(0.25**2, 0.5**2, count))
    return 0.5 + np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)


def twisted(inputs: Floats, elasticity: float, starts: int) -> str:
    """How many of so many random starts of 8x8 units end with far more than the median error."""
    errors = np.array([mean_squared_error(trained(inputs, (8, 8), elasticity, seed), inputs) for seed in range(starts)])
    return f"{(errors > TWISTED * np.median(errors)).sum()} of {starts}"


def collapsed(inputs: Floats, elasticity: float) -> str:
    """How many times the error of `rougier` the preset `printed` has, from five starts."""
    ratios = [
        mean_squared_error(trained(inputs, (8, 8), elasticity, seed, "printed"), inputs)
        / mean_squared_error(trained(inputs, (8, 8), elasticity, seed), inputs)
        for seed in range(5)
    ]
    return f"{min(ratios):.1f} to {max(ratios):.1f} times"


def tables() -> dict[str, Floats]:
    """Those that the rule of `fit` was found on, then others, standardised if nothing else is said."""
    frames = {name: getattr(statsmodels.datasets, name).load_pandas().exog for name in ("fair", "anes96", "star98")}
    found = {
        "seven blobs": datasets.make_blobs(500, 5, centers=7, random_state=0)[0],
        "swiss roll": datasets.make_swiss_roll(1000, noise=0.5, random_state=0)[0],
        "rank 5 in 30": datasets.make_low_rank_matrix(400, 30, effective_rank=5, random_state=0),
        **{name: np.asarray(frame, dtype=np.float64) for name, frame in frames.items()},
    }
    others = (datasets.load_iris, datasets.load_wine, datasets.load_digits, datasets.load_breast_cancer)
    found |= {load.__name__.removeprefix("load_"): load().data for load in others}
    scaled = {name: StandardScaler().fit_transform(table) for name, table in found.items()}
    return scaled | {"star98, raw": found["star98"], "wine, raw": found["wine"]}


def on_table(table: Floats, elasticity: float | None) -> tuple[float, float, float]:
    """Medians over three seeds: error and order on a quarter of the rows that `fit` has not learned; the elasticity."""
    found = []
    for seed in range(3):
        learned, others = train_test_split(table, test_size=0.25, random_state=seed)
        dsom = DSOM(shape=(10, 10), elasticity=elasticity, random_state=seed).fit(learned)
        found.append((quantisation_error(dsom, others), topographic_error(dsom, others), dsom.elasticity_))
    error, disorder, chosen = np.median(found, axis=0)
    return float(error), float(disorder), float(chosen)


def print_tables() -> None:
    """For each table the elasticity that `fit` chooses; errors there and at others, as multiples of the least."""
    print("| table | chosen | there | " + " | ".join(map(str, ELASTICITIES)) + " |")
    print("|---" * (len(ELASTICITIES) + 3) + "|")
    for name, table in tables().items():
        found = [on_table(table, elasticity) for elasticity in (None, *ELASTICITIES)]
        least = min(error for error, _, _ in found)
        cells = [f"{error / least:.2f}, {disorder:.2f}" for error, disorder, _ in found]
        print(f"| {name} | {found[0][2]:.2f} | " + " | ".join(cells) + " |", flush=True)


def main() -> None:
    warnings.simplefilter("ignore", ConvergenceWarning)
    print_tables()
    print("| dimensions, units | " + " | ".join(map(str, ELASTICITIES)) + " |")
    print("|---" * (len(ELASTICITIES) + 1) + "|")
    for dims, shape in CASES:
        cells = [measured(dims, shape, elasticity) for elasticity in ELASTICITIES]
        print(f"| {dims}, {shape[0]}x{shape[1]} | " + " | ".join(cells) + " |", flush=True)
    square = np.random.default_rng(0).random((20_000, 2))
    for elasticity in (1.5, 1.75, 2.0):
        on_ring = ", ".join(twisted(ring(np.random.default_rng(draw), 20_000), elasticity, 20) for draw in (1, 2))
        print(f"twisted at {elasticity}: square {twisted(square, elasticity, 80)}, two rings {on_ring}")
    for elasticity in (0.1, 1.75):
        print(f"printed at {elasticity}: {collapsed(square, elasticity)} the error of rougier")


if __name__ == "__main__":
    main()
