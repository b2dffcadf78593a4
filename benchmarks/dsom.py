"""Speed of a DSOM update beside the rule in NumPy, minisom's online step and what this core can do at best.

All are measured in one run, turn by turn, so that they meet the same machine; compare the ratios, not the times.
The map has converged: it has learned 20,000 uniform inputs.

Example: python benchmarks/dsom.py --shape 30 30 --dims 4
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from somatopy._jit import jit
from somatopy.maps import DSOM

Floats = NDArray[np.float64]
Run = Callable[[Floats], object]


@jit
def bound(codes: Floats, samples: Floats) -> None:
    """The codebook (4 x units) read and written once for each sample, with a distance and a square root a unit."""
    a, b, c, d = codes[0], codes[1], codes[2], codes[3]
    for t in range(samples.shape[0]):
        x0, x1, x2, x3 = samples[t, 0], samples[t, 1], samples[t, 2], samples[t, 3]
        for i in range(a.size):
            d0, d1, d2, d3 = x0 - a[i], x1 - b[i], x2 - c[i], x3 - d[i]
            gain = 1e-9 * sqrt(d0 * d0 + d1 * d1 + d2 * d2 + d3 * d3)
            a[i] += gain * d0
            b[i] += gain * d1
            c[i] += gain * d2
            d[i] += gain * d3


def plain_rule(start: Floats, shape: tuple[int, int], rate: float, elasticity: float) -> Run:
    """Equations 1 and 2 in NumPy as one reads them: an expression a symbol, nothing computed beforehand."""
    codes, farthest = start.copy().reshape(*shape, -1), 0.0

    def learn(samples: Floats) -> None:
        nonlocal codes, farthest
        for v in samples:
            distance = np.linalg.norm(v - codes, axis=-1)
            farthest = max(farthest, float(distance.max()))
            omega = distance / farthest
            s = np.unravel_index(distance.argmin(), shape)
            p = np.stack(np.meshgrid(*(np.linspace(0, 1, n) for n in shape), indexing="ij"), axis=-1) / sqrt(len(shape))
            h = np.exp(-((p - p[s]) ** 2).sum(axis=-1) / (elasticity * omega[s]) ** 2)
            codes = codes + rate * (omega * h)[..., None] * (v - codes)

    return learn


def tuned_rule(start: Floats, shape: tuple[int, int], rate: float, elasticity: float) -> Run:
    """Equations 1 and 2 in NumPy, all dimensions at once, lattice positions computed beforehand."""
    codes, farthest = start.copy(), 0.0
    rows, columns = (axis.ravel() / (max(n - 1, 1) * sqrt(2)) for axis, n in zip(np.indices(shape), shape, strict=True))

    def learn(samples: Floats) -> None:
        nonlocal codes, farthest
        for v in samples:
            delta = v - codes
            squared = (delta**2).sum(axis=1)
            s, farthest = squared.argmin(), max(farthest, squared.max())
            lattice = (rows - rows[s]) ** 2 + (columns - columns[s]) ** 2
            gains = rate * np.sqrt(squared / farthest) * np.exp(-lattice / (elasticity**2 * squared[s] / farthest))
            codes += gains[:, None] * delta

    return learn


def minisom_step(shape: tuple[int, int], dims: int) -> Run | None:
    """minisom's winner and update, or None where minisom is not installed."""
    try:
        from minisom import MiniSom
    except ImportError:
        return None
    som = MiniSom(*shape, dims, random_seed=0)

    def learn(samples: Floats) -> None:
        for t, x in enumerate(samples):
            som.update(x, som.winner(x), t, 100_000)

    return learn


def calls(act: Callable[[Floats], object]) -> Run:
    def run(samples: Floats) -> None:
        for x in samples:
            act(x)

    return run


def contestants(shape: tuple[int, int], dims: int, inputs: Floats) -> dict[str, tuple[Run, int]]:
    """What to measure: name to (what it runs, on how many samples)."""
    dsom = DSOM(shape=shape, random_state=0).partial_fit(inputs)
    found: dict[str, tuple[Run, int]] = {
        "DSOM.partial_fit": (dsom.partial_fit, 20_000),
        "DSOM.learn_one": (calls(dsom.learn_one), 5_000),
        "DSOM.winner": (calls(dsom.winner), 5_000),
        "NumPy, plain": (plain_rule(dsom.codebook_, shape, 0.1, 0.1), 500),
        "NumPy, tuned": (tuned_rule(dsom.codebook_, shape, 0.1, 0.1), 500),
    }
    if (som := minisom_step(shape, dims)) is not None:
        found["minisom"] = (som, 500)
    if dims == 4:
        codes = np.ascontiguousarray(dsom.codebook_.T)
        found["bound"] = (lambda samples: bound(codes, samples), 20_000)
    return found


def measure(runs: dict[str, tuple[Run, int]], inputs: Floats, repeats: int) -> dict[str, float]:
    """Median microseconds a sample, the contestants taking turns."""
    times: dict[str, list[float]] = {name: [] for name in runs}
    for run, _ in runs.values():
        run(inputs[:2])
    for _ in range(repeats):
        for name, (run, count) in runs.items():
            began = time.perf_counter()
            run(inputs[:count])
            times[name].append(1e6 * (time.perf_counter() - began) / count)
    return {name: statistics.median(taken) for name, taken in times.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--shape", type=int, nargs=2, default=(30, 30), help="units along each axis (default 30 30)")
    parser.add_argument("--dims", type=int, default=4, help="input dimensions (default 4; the bound needs 4)")
    parser.add_argument("--repeats", type=int, default=15, help="turns, of which the median counts (default 15)")
    chosen = parser.parse_args()
    inputs = np.random.default_rng(0).random((20_000, chosen.dims))
    medians = measure(contestants(tuple(chosen.shape), chosen.dims, inputs), inputs, chosen.repeats)
    print(f"{'':>18}{'us/sample':>12}{'times partial_fit':>20}")
    for name, median in medians.items():
        print(f"{name:>18}{median:>12.2f}{median / medians['DSOM.partial_fit']:>20.2f}")


if __name__ == "__main__":
    main()
