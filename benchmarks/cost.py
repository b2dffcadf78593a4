"""Measure and draw what an update costs, against the number of units and the dimensions of the inputs.

Takes some minutes, and rewrites docs/img/cost.png.

Example: python benchmarks/cost.py --turns 5
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from entries import CONVERGED, dsoms, gases, growing, soms
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, FuncFormatter
from turns import Contestant, measure, uniform

from somatopy.analysis.style import style

PICTURE = Path(__file__).parents[1] / "docs" / "img" / "cost.png"
SIDES = (10, 20, 30, 50, 100, 200, 300)
DIMS = (2, 4, 8, 16, 32, 64)

# What is drawn: group and name of a contestant to label, colour, dashes. Others than ours are grey and dashed.
LINES: dict[tuple[str, str], tuple[str, str, tuple[float, ...]]] = {
    ("DSOM", "equations in NumPy, plainly"): ("DSOM in NumPy", "#b0b0b0", (1.0, 1.2)),
    ("SOM, settled", "minisom, online step"): ("minisom", "#7a7a7a", (6.0, 2.0)),
    ("GrowingNeuralGas", "minigng, partial_fit"): ("minigng", "#4a4a4a", (2.0, 1.5)),
    ("SOM, whole training", "numbasom, train"): ("numbasom", "#9a9a9a", (6.0, 1.5, 1.5, 1.5)),
    ("EvolvingSOM", "EvolvingSOM.partial_fit"): ("EvolvingSOM", "#b8860b", ()),
    ("NeuralGas, settled", "NeuralGas.partial_fit"): ("NeuralGas", "#7b3fa0", ()),
    ("GrowingNeuralGas", "GrowingNeuralGas.partial_fit"): ("GrowingNeuralGas", "#008b8b", ()),
    ("GrowWhenRequired", "GrowWhenRequired.partial_fit"): ("GrowWhenRequired", "#2f9e44", ()),
    ("SOM, settled", "SOM.partial_fit"): ("SOM", "#123a8c", ()),
    ("DSOM", "DSOM.partial_fit"): ("DSOM", "#e0453a", ()),
    ("DSOM", "DSOM.partial_fit, float32"): ("DSOM, float32", "#f0a09a", ()),
}


def drawn(side: int, dims: int) -> list[Contestant]:
    """What is drawn, at one size."""
    shape, inputs = (side, side), uniform(CONVERGED, dims)
    every = (one for enter in (dsoms, soms, gases, growing) for one in enter(shape, dims, inputs))
    return [one for one in every if (one.group, one.name) in LINES]


def costs(sizes: Iterable[list[Contestant]], dims: int, turns: int) -> list[dict[tuple[str, str], float]]:
    """Microseconds an update at several sizes, all of which take turns."""
    each = list(sizes)
    measured = iter(measure([one for size in each for one in size], dims, turns))
    return [{(one.group, one.name): next(measured)["microseconds"] for one in size} for size in each]


def draw(axes: Axes, places: list[int], found: list[dict[tuple[str, str], float]]) -> None:
    """A line for each of `LINES`, both axes logarithmic."""
    for key, (label, colour, dashes) in LINES.items():
        known = [(place, cost[key]) for place, cost in zip(places, found, strict=True) if key in cost]
        if known:
            line: Any = axes.plot(*zip(*known, strict=True), color=colour, lw=1.8, marker="o", ms=3, label=label)[0]
            line.set_dashes(dashes) if dashes else None
    axes.set(xscale="log", yscale="log")
    axes.xaxis.set_major_locator(FixedLocator(places))
    axes.xaxis.set_minor_locator(FixedLocator([]))
    axes.xaxis.set_major_formatter(
        FuncFormatter(lambda place, _: f"{place / 1000:g}k" if place >= 1000 else f"{place:g}")
    )
    axes.yaxis.set_major_formatter(FuncFormatter(lambda cost, _: f"{cost:,g}"))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--turns", type=int, default=5, help="of which the median counts (default 5)")
    parser.add_argument("--out", type=Path, default=PICTURE)
    chosen = parser.parse_args()
    by_size = costs((drawn(side, 4) for side in SIDES), 4, chosen.turns)
    by_dims = [cost for dims in DIMS for cost in costs([drawn(30, dims)], dims, chosen.turns)]
    with style():
        figure, (left, right) = plt.subplots(1, 2, figsize=(10.5, 4.6), sharey=True, layout="constrained")
        draw(left, [side * side for side in SIDES], by_size)
        draw(right, list(DIMS), by_dims)
        left.set(title="4 dimensions", xlabel="units", ylabel="µs an update")
        right.set(title="900 units", xlabel="dimensions")
        figure.legend(*left.get_legend_handles_labels(), loc="outside right center")
        figure.savefig(chosen.out, dpi=130)


if __name__ == "__main__":
    main()
