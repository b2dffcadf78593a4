"""Memory and time that the links of two 300x300 maps take, after as many frames as the paper's experiment has.

Winners are drawn uniformly, the worst case, or are those of an arm that goes from target to target and a head that
follows with noise. The numbers of docs/links.md.

Example: python benchmarks/links.py
"""

from __future__ import annotations

import argparse
import tracemalloc
from collections.abc import Iterator
from time import process_time

import numpy as np
from numpy.typing import NDArray

from somatopy.links import HebbianLinks, PositiveHebb

SIDE, FRAMES = 300, 273_872
READ = 20_000  # rows that are read out to be timed

Integers = NDArray[np.int64]


def uniform(rng: np.random.Generator, frames: int) -> Integers:
    """Any two nodes."""
    return rng.integers(0, SIDE * SIDE, (frames, 2))


def followed(rng: np.random.Generator, frames: int) -> Integers:
    """Places in the arm map on straight lines between random targets, 100 frames each; in the head map near them."""
    targets = rng.uniform(0, SIDE - 1, (frames // 100 + 2, 2))
    legs, share = np.divmod(np.arange(frames) / 100, 1.0)
    leg = legs.astype(np.int64)
    arm = targets[leg] + share[:, None] * (targets[leg + 1] - targets[leg])
    head = np.clip(arm + rng.normal(scale=5.0, size=arm.shape), 0, SIDE - 1)
    nodes = [np.rint(places).astype(np.int64) @ np.array([SIDE, 1]) for places in (arm, head)]
    return np.stack(nodes, axis=1)


def measured(pairs: Integers) -> Iterator[tuple[str, float]]:
    """What the links need, by name."""
    every = pairs.tolist()
    links = HebbianLinks(SIDE * SIDE, SIDE * SIDE, PositiveHebb())
    tracemalloc.start()
    for i, j in every:
        links.update(i, j, 0.5, 0.7)
    taken, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    yield "links in use", len(links.used()[0])
    yield "MB taken", taken / 1e6
    timed = HebbianLinks(SIDE * SIDE, SIDE * SIDE, PositiveHebb())
    began = process_time()
    for i, j in every:
        timed.update(i, j, 0.5, 0.7)
    yield "us an update", 1e6 * (process_time() - began) / len(every)
    began = process_time()
    for i, _ in every[:READ]:
        timed.strongest(i, 0.3)
    yield "us a read-out", 1e6 * (process_time() - began) / READ


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=FRAMES, help="updates (default: the paper's 273,872)")
    frames = parser.parse_args().frames
    for name, draw in (("uniform", uniform), ("followed", followed)):
        numbers = measured(draw(np.random.default_rng(0), frames))
        print(f"{name}: " + ", ".join(f"{what} {value:,.1f}" for what, value in numbers))


if __name__ == "__main__":
    main()
