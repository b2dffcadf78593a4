"""Compare all maps on distributions that stand still, move, grow and lose a part; rewrites docs/maps/comparison.md.

Each map has at most 64 units and sees 20,000 inputs; errors are medians over seeds, with least and greatest.

Example: python docs/compare_maps.py --seeds 5
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

from somatopy.maps import DSOM, SOM, EvolvingSOM, GrowingNeuralGas, GrowWhenRequired, Map, NeuralGas
from somatopy.maps.pictures import codebook
from somatopy.maps.quality import dead_units, mean_squared_error

Floats = NDArray[np.float64]
Draw = Callable[[np.random.Generator, int, float], Floats]

INPUTS, EVERY, UNITS = 20_000, 500, 64
DOCS = Path(__file__).parent
PAGE, PICTURES = DOCS / "maps" / "comparison.md", DOCS / "img" / "maps"

MAPS: dict[str, Callable[[int], Map]] = {
    "DSOM": lambda seed: DSOM(shape=(8, 8), elasticity=1.75, random_state=seed),
    "SOM": lambda seed: SOM(shape=(8, 8), horizon=INPUTS, random_state=seed),
    "SOM, steady": lambda seed: SOM(shape=(8, 8), learning_rate=0.1, width=1, random_state=seed),
    "NeuralGas": lambda seed: NeuralGas(units=UNITS, horizon=INPUTS, random_state=seed),
    "GrowingNeuralGas": lambda seed: GrowingNeuralGas(max_units=UNITS, random_state=seed),
    "GNG, utility": lambda seed: GrowingNeuralGas(max_units=UNITS, utility=3, random_state=seed),
    "EvolvingSOM": lambda seed: EvolvingSOM(threshold=0.1, max_units=UNITS, random_state=seed),
    "GrowWhenRequired": lambda seed: GrowWhenRequired(activity_threshold=0.9, max_units=UNITS, random_state=seed),
}


def square(rng: np.random.Generator, count: int, centre: tuple[float, float], half: float) -> Floats:
    return np.array(centre) + rng.uniform(-half, half, (count, 2))


def static(rng: np.random.Generator, count: int, progress: float) -> Floats:
    """A ring, always."""
    angle, radius = rng.uniform(0, 2 * np.pi, count), np.sqrt(rng.uniform(0.25**2, 0.5**2, count))
    return 0.5 + np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)


def moving(rng: np.random.Generator, count: int, progress: float) -> Floats:
    """A quarter of the unit square that jumps three times."""
    places = ((0.25, 0.25), (0.75, 0.75), (0.25, 0.75), (0.75, 0.25))
    return square(rng, count, places[min(int(4 * progress), 3)], 0.25)


def growing(rng: np.random.Generator, count: int, progress: float) -> Floats:
    """A square that grows from a tenth of the side to the whole unit square."""
    return square(rng, count, (0.5, 0.5), 0.05 + 0.45 * progress)


def lesioned(rng: np.random.Generator, count: int, progress: float) -> Floats:
    """The unit square, of which the right half is lost after half of the inputs."""
    return rng.uniform(0, (1.0, 1.0) if progress < 0.5 else (0.5, 1.0), (count, 2))


DISTRIBUTIONS: dict[str, Draw] = {"static": static, "moving": moving, "growing": growing, "lesioned": lesioned}


@dataclass
class Outcome:
    """One map on one distribution: error on what is drawn at that time, and what it looked like at the end."""

    errors: list[list[float]] = field(default_factory=list)
    dead: list[float] = field(default_factory=list)
    units: list[int] = field(default_factory=list)
    last: Map | None = None


def follow(make: Callable[[int], Map], draw: Draw, seed: int, outcome: Outcome) -> None:
    """Let a map learn a distribution; test inputs are drawn apart from those that it learns."""
    learned, tested, trained = np.random.default_rng(seed), np.random.default_rng([seed, 1]), make(seed)
    errors = []
    for start in range(0, INPUTS, EVERY):
        steps = np.arange(start, start + EVERY) / INPUTS
        trained.partial_fit(np.concatenate([draw(learned, 1, step) for step in steps]))
        fresh = draw(tested, 2000, float(steps[-1]))
        errors.append(mean_squared_error(trained, fresh))
    outcome.errors.append(errors)
    outcome.dead.append(len(dead_units(trained, draw(tested, 10_000, 1.0))) / len(trained.codebook_))
    outcome.units.append(len(trained.codebook_))
    outcome.last = trained


def compare(seeds: int) -> dict[str, dict[str, Outcome]]:
    found = {kind: {name: Outcome() for name in MAPS} for kind in DISTRIBUTIONS}
    for kind, draw in DISTRIBUTIONS.items():
        for name, make in MAPS.items():
            for seed in range(seeds):
                follow(make, draw, seed, found[kind][name])
    return found


def spread(values: Floats, scale: float) -> str:
    """Median, least and greatest."""
    return f"{scale * np.median(values):.2f} ({scale * values.min():.2f} to {scale * values.max():.2f})"


def table(found: dict[str, dict[str, Outcome]]) -> str:
    """Mean squared error at the end x 1000, and the share of units that never win there, as Markdown."""
    lines = [
        "| | " + " | ".join(f"{kind}: error" for kind in found) + " | dead after moving | dead after lesion | units |",
        "|---" * (len(found) + 4) + "|",
    ]
    for name in MAPS:
        cells = [spread(np.array(found[kind][name].errors)[:, -1], 1000) for kind in found]
        cells += [f"{100 * np.mean(found[kind][name].dead):.0f} %" for kind in ("moving", "lesioned")]
        cells.append(f"{np.mean([outcome[name].units for outcome in found.values()]):.0f}")
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def draw_codebooks(found: dict[str, dict[str, Outcome]]) -> None:
    """What each map of the last seed looked like at the end, on what was drawn then."""
    size = 1.9 * len(MAPS), 2.0 * len(found)
    figure, axes = plt.subplots(len(found), len(MAPS), figsize=size, squeeze=False, layout="constrained")
    for row, (kind, outcomes) in zip(axes, found.items(), strict=True):
        inputs = DISTRIBUTIONS[kind](np.random.default_rng(0), 1500, 1.0)
        for ax, outcome in zip(row, outcomes.values(), strict=True):
            codebook(outcome.last, ax=ax, X=inputs)
            ax.set(xlim=(-0.05, 1.05), ylim=(-0.05, 1.05), xticks=[], yticks=[], xlabel="", ylabel="")
        row[0].set_ylabel(kind, fontsize=11)
    for ax, name in zip(axes[0], MAPS, strict=True):
        ax.set_title(name, fontsize=10)
    figure.savefig(PICTURES / "comparison.png", dpi=90)


def draw_errors(found: dict[str, dict[str, Outcome]]) -> None:
    """Median error of all seeds over time."""
    figure, axes = plt.subplots(1, len(found), figsize=(3.6 * len(found), 3.6), sharey=True, layout="constrained")
    inputs = np.arange(EVERY, INPUTS + 1, EVERY)
    for ax, (kind, outcomes) in zip(axes, found.items(), strict=True):
        for number, (name, outcome) in enumerate(outcomes.items()):
            colour, dashes = mpl.colormaps["tab10"](number), "--" if "," in name else "-"
            ax.plot(inputs, np.median(outcome.errors, axis=0), color=colour, linestyle=dashes, label=name)
        ax.set(yscale="log", xlabel="inputs learned", title=kind)
        ax.grid(alpha=0.3)
    axes[0].set_ylabel("mean squared error")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside right upper", fontsize=9, frameon=False)
    figure.savefig(PICTURES / "comparison_errors.png", dpi=90)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=5, help="runs of each map on each distribution (default 5)")
    seeds = parser.parse_args().seeds
    mpl.use("Agg")
    found = compare(seeds)
    result = f"{table(found)}\n\nErrors: median of {seeds} seeds (least to greatest). The rest: means.\n"
    page = PAGE.read_text(encoding="utf-8")
    filled, places = re.subn(
        "(<!-- results -->\n).*(<!-- end -->)", lambda m: m[1] + result + m[2], page, flags=re.DOTALL
    )
    assert places == 1, f"{PAGE} has no place for the results"
    PAGE.write_text(filled, encoding="utf-8")
    PICTURES.mkdir(parents=True, exist_ok=True)
    draw_codebooks(found)
    draw_errors(found)
    print(result)


if __name__ == "__main__":
    main()
