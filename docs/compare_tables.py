"""Compare the maps with minisom on tables, raw and standardised; rewrites docs/maps/tables.md.

Each map has 100 units and its defaults. It learns three quarters of the rows; errors are those of the rest, medians
over seeds of map and split. Needs minisom: `make tables` fetches it.

Example: python docs/compare_tables.py --seeds 5
"""

from __future__ import annotations

import argparse
import re
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from statistics import median
from time import process_time
from typing import NamedTuple

import numpy as np
import statsmodels.datasets
from numpy.typing import NDArray
from sklearn import datasets
from sklearn.exceptions import ConvergenceWarning
from sklearn.model_selection import train_test_split
from sklearn.preprocessing import StandardScaler

from somatopy.maps import DSOM, SOM, EvolvingSOM, GrowingNeuralGas, GrowWhenRequired, Map, NeuralGas
from somatopy.maps.quality import quantisation_error, topographic_error

Floats = NDArray[np.float64]
Make = Callable[[Floats, int], Map]

PAGE = Path(__file__).parent / "maps" / "tables.md"
SHAPE, UNITS = (10, 10), 100
TABLES = {
    "iris": datasets.load_iris,
    "wine": datasets.load_wine,
    "digits": datasets.load_digits,
    "breast cancer": datasets.load_breast_cancer,
}
OTHERS = ("engel", "modechoice", "randhie")  # of statsmodels
MANY = (100_000, 20)
INPUTS_A_UNIT = (10, 50, 100, 200, 500, 1000, 2000)


def minisom(steps: int | None = None) -> Make:
    """minisom from its PCA start with width 3: so many steps, or ten a row and at least 10,000."""

    def make(X: Floats, seed: int) -> Map:
        from minisom import MiniSom  # of `make tables` alone

        som = MiniSom(*SHAPE, X.shape[1], sigma=3, random_seed=seed)
        som.pca_weights_init(X)
        som.train(X, steps or max(10 * len(X), 10_000))
        return SOM(shape=SHAPE, init=som.get_weights().reshape(UNITS, -1)).initialise(X.shape[1])

    return make


MAPS: dict[str, Make] = {
    "minisom": minisom(),
    "SOM": lambda X, seed: SOM(shape=SHAPE, random_state=seed).fit(X),
    "NeuralGas": lambda X, seed: NeuralGas(units=UNITS, random_state=seed).fit(X),
    "DSOM": lambda X, seed: DSOM(shape=SHAPE, random_state=seed).fit(X),
    "GrowingNeuralGas": lambda X, seed: GrowingNeuralGas(max_units=UNITS, random_state=seed).fit(X),
    "EvolvingSOM": lambda X, seed: EvolvingSOM(max_units=UNITS, random_state=seed).fit(X),
    "GrowWhenRequired": lambda X, seed: GrowWhenRequired(max_units=UNITS, random_state=seed).fit(X),
}
BARRED = ("minisom", "SOM", "NeuralGas")


class Outcome(NamedTuple):
    """One map on one table: error on rows that it learned and on others, order, CPU seconds, units."""

    learned: float
    error: float
    disorder: float
    seconds: float
    units: int


def tried(make: Make, table: Floats, seed: int) -> Outcome:
    """Learn three quarters of the rows, and measure on the rest."""
    learned, others = train_test_split(table, test_size=0.25, random_state=seed)
    began = process_time()
    trained = make(learned, seed)
    seconds = process_time() - began
    disorder = topographic_error(trained, others) if hasattr(trained, "topology_") else np.nan
    errors = (quantisation_error(trained, rows) for rows in (learned, others))
    return Outcome(*errors, disorder, seconds, len(trained.codebook_))


def middle(make: Make, table: Floats, seeds: int) -> Outcome:
    """Medians over the seeds."""
    return Outcome(*map(median, zip(*(tried(make, table, seed) for seed in range(seeds)), strict=True)))


def named_tables() -> Iterator[tuple[str, Floats]]:
    """Each table as it comes and standardised."""
    tables = {name: load().data for name, load in TABLES.items()}
    tables |= {name: _numbers(getattr(statsmodels.datasets, name).load_pandas().data) for name in OTHERS}
    for name, table in tables.items():
        yield f"{name}, {len(table):,} × {table.shape[1]}, raw", table
        yield f"{name}, standardised", StandardScaler().fit_transform(table)


def _numbers(frame: object) -> Floats:
    return np.asarray(frame, dtype=np.float64)


def line(cells: list[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def barred(found: dict[str, dict[str, Outcome]]) -> list[str]:
    """minisom's values, and beside them how many times as much SOM and NeuralGas have."""
    lines = [
        "| table | minisom: error, disorder, time | SOM: error × | disorder | time × | NeuralGas: error × | time × |",
        "|---" * 7 + "|",
    ]
    for name, outcomes in found.items():
        peer, som, gas = (outcomes[kind] for kind in BARRED)
        lines.append(
            line(
                [
                    name,
                    f"{peer.error:.4g}, {peer.disorder:.2f}, {peer.seconds:.2f} s",
                    f"{som.error / peer.error:.2f}",
                    f"{som.disorder:.2f}",
                    f"{som.seconds / peer.seconds:.2f}",
                    f"{gas.error / peer.error:.2f}",
                    f"{gas.seconds / peer.seconds:.2f}",
                ]
            )
        )
    return lines


def beside(found: dict[str, dict[str, Outcome]]) -> list[str]:
    """Error of the other maps, in minisom's, and their disorder and units."""
    others = [name for name in MAPS if name not in BARRED]
    heads = ["table", *(f"{name}: error ×, disorder, units" for name in others)]
    lines = [line(heads), "|---" * len(heads) + "|"]
    for name, outcomes in found.items():
        cells = [
            f"{one.error / outcomes['minisom'].error:.2f}, {one.disorder:.2f}, {one.units}"
            for one in (outcomes[kind] for kind in others)
        ]
        lines.append(line([name, *cells]))
    return lines


def by_inputs() -> list[str]:
    """How error on held-out rows and order change with the inputs a unit, by which the default was chosen."""
    frames = {name: getattr(statsmodels.datasets, name).load_pandas().exog for name in ("anes96", "fair", "star98")}
    chosen = {
        "seven blobs": datasets.make_blobs(500, 5, centers=7, random_state=0)[0],
        "swiss roll": datasets.make_swiss_roll(1000, noise=0.5, random_state=0)[0],
        "diabetes": datasets.load_diabetes().data,
        **{name: _numbers(frame) for name, frame in frames.items()},
    }
    lines = [line(["table", *(f"{n:,}" for n in INPUTS_A_UNIT)]), "|---" * (len(INPUTS_A_UNIT) + 1) + "|"]
    for kind in ("SOM", "NeuralGas"):
        for name, table in chosen.items():
            scaled = StandardScaler().fit_transform(table)
            found = [middle(passing(kind, inputs), scaled, 3) for inputs in INPUTS_A_UNIT]
            last = found[-1].error
            cells = [f"{one.error / last:.2f}{'' if kind != 'SOM' else f', {one.disorder:.2f}'}" for one in found]
            lines.append(line([f"{kind}, {name}", *cells]))
    return lines


def passing(kind: str, inputs: int) -> Make:
    """A map that learns about so many inputs a unit."""

    def make(X: Floats, seed: int) -> Map:
        epochs = max(1, round(inputs * UNITS / len(X)))
        if kind == "SOM":
            return SOM(shape=SHAPE, epochs=epochs, random_state=seed).fit(X)
        return NeuralGas(units=UNITS, epochs=epochs, random_state=seed).fit(X)

    return make


def against_time(seed: int = 0) -> list[str]:
    """Error against time on a large table: clusters of many widths in five dimensions, turned into twenty."""
    rng = np.random.default_rng(seed)
    low, _ = datasets.make_blobs(MANY[0], 5, centers=40, cluster_std=rng.uniform(0.3, 2.0, 40), random_state=seed)
    table = low @ rng.normal(size=(5, MANY[1])) + 0.3 * rng.normal(size=MANY)
    entries: dict[str, Make] = {f"minisom, {steps:,} steps": minisom(steps) for steps in (10_000, 100_000, 300_000)}
    for epochs in (None, 3, 10):
        said = "as it comes" if epochs is None else f"epochs={epochs}"
        entries[f"SOM, {said}"] = lambda X, seed, n=epochs: SOM(shape=SHAPE, epochs=n, random_state=seed).fit(X)
        entries[f"NeuralGas, {said}"] = lambda X, seed, n=epochs: NeuralGas(epochs=n, random_state=seed).fit(X)
    entries["DSOM, as it comes"] = MAPS["DSOM"]
    lines = ["| map | time | error | disorder |", "|---|---|---|---|"]
    for name, make in entries.items():
        one = tried(make, table, seed)
        disorder = "-" if np.isnan(one.disorder) else f"{one.disorder:.2f}"
        lines.append(line([name, f"{one.seconds:.2f} s", f"{one.error:.2f}", disorder]))
    return lines


def written(page: str, **results: list[str]) -> str:
    """The page with each of its places filled."""
    for name, lines in results.items():
        filled = "\n".join(lines) + "\n"
        pattern = f"(<!-- {name} -->\n).*?(<!-- end -->)"
        page, places = re.subn(pattern, lambda m, filled=filled: m[1] + filled + m[2], page, flags=re.DOTALL)
        assert places == 1, f"{PAGE} has no place for {name}"
    return page


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=5, help="splits and starts of each map (default 5)")
    seeds = parser.parse_args().seeds
    warnings.simplefilter("ignore", ConvergenceWarning)
    for make in MAPS.values():
        make(np.random.default_rng(0).random((50, 5)), 0)  # kernels are compiled before time counts
    found: dict[str, dict[str, Outcome]] = {}
    for name, table in named_tables():
        found[name] = {kind: middle(make, table, seeds) for kind, make in MAPS.items()}
        print(barred({name: found[name]})[-1], flush=True)
    results = {"bar": barred(found), "beside": beside(found), "time": against_time(), "inputs": by_inputs()}
    PAGE.write_text(written(PAGE.read_text(encoding="utf-8"), **results), encoding="utf-8")
    print("\n".join(results["beside"] + results["time"] + results["inputs"]))


if __name__ == "__main__":
    main()
