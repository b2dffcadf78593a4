"""Draw the pictures of docs/maps/pictures.md and docs/maps/quality.md.

usage: python docs/make_map_pictures.py [--out docs/img/maps]

Takes about ten seconds.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from somatopy.maps import DSOM, SOM, GrowingNeuralGas
from somatopy.maps.pictures import codebook, component_planes, growth, hit_map, u_matrix
from somatopy.maps.quality import follow, topographic_error, topographic_product

Floats = NDArray[np.float64]

RNG = np.random.default_rng(1)
INPUTS = 20_000


def clusters(count: int) -> Floats:
    """Three clouds in the unit cube."""
    centres = np.array([(0.2, 0.2, 0.3), (0.8, 0.3, 0.6), (0.5, 0.8, 0.5)])
    return centres[RNG.integers(3, size=count)] + RNG.normal(scale=0.06, size=(count, 3))


def ring(count: int) -> Floats:
    angle, radius = RNG.uniform(0, 2 * np.pi, count), np.sqrt(RNG.uniform(0.25**2, 0.5**2, count))
    return 0.5 + np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)


def sphere(count: int) -> Floats:
    points = RNG.normal(size=(count, 3))
    return 0.5 + 0.5 * points / np.linalg.norm(points, axis=1, keepdims=True)


def arm(count: int) -> Floats:
    """Shoulder and elbow of an arm of two links, rad, and its hand's position, link lengths."""
    shoulder, elbow = RNG.uniform(-1.5, 1.5, count), RNG.uniform(0, 2.5, count)
    x, y = np.cos(shoulder) + np.cos(shoulder + elbow), np.sin(shoulder) + np.sin(shoulder + elbow)
    return np.stack([shoulder, elbow, x, y], axis=1)


def u_matrices() -> Figure:
    """Three clouds on squares, on hexagons, and in a graph."""
    figure = Figure(figsize=(12, 3.6), layout="constrained")
    inputs = clusters(INPUTS)
    for axes, lattice in zip(figure.subplots(1, 3), ("rectangular", "hexagonal", "graph"), strict=True):
        if lattice == "graph":
            trained = GrowingNeuralGas(max_units=150, random_state=0).partial_fit(inputs)
        else:
            trained = SOM(shape=(20, 20), lattice=lattice, random_state=0).partial_fit(inputs)
        u_matrix(trained, axes).set_title(lattice)
    return figure


def planes() -> Figure:
    """What an arm's map knows of joints and hand."""
    figure = Figure(figsize=(12, 2.9), layout="constrained")
    som = SOM(shape=(20, 24), lattice="hexagonal", bounds=(-2, 2), random_state=0).partial_fit(arm(INPUTS))
    names = ("shoulder (rad)", "elbow (rad)", "hand x", "hand y")
    for axes, name in zip(component_planes(som, figure.subplots(1, 4)), names, strict=True):
        axes.set_title(name)
    return figure


def hits() -> Figure:
    """Where inputs fall, on squares, on hexagons and on a strip."""
    figure = Figure(figsize=(12, 3.6), layout="constrained")
    inputs = clusters(INPUTS)
    shapes = [((12, 12), "rectangular"), ((12, 12), "hexagonal"), ((40,), "rectangular")]
    for axes, (shape, lattice) in zip(figure.subplots(1, 3), shapes, strict=True):
        som = SOM(shape=shape, lattice=lattice, random_state=0).partial_fit(inputs)
        hit_map(som, clusters(2000), axes)
    return figure


def codebooks() -> Figure:
    """A lattice and a graph on a ring, a lattice on a sphere."""
    figure = Figure(figsize=(12, 4), layout="constrained")
    plane, graph, space = figure.add_subplot(131), figure.add_subplot(132), figure.add_subplot(133, projection="3d")
    inputs, ball = ring(INPUTS), sphere(INPUTS)
    codebook(DSOM(shape=(8, 8), elasticity=1.75, random_state=0).partial_fit(inputs), plane, X=inputs[:3000])
    codebook(GrowingNeuralGas(max_units=80, random_state=0).partial_fit(inputs), graph, X=inputs[:3000])
    codebook(SOM(shape=(16, 16), lattice="hexagonal", random_state=0).partial_fit(ball), space, dims=(0, 1, 2))
    for axes, title in ((plane, "DSOM"), (graph, "GrowingNeuralGas"), (space, "SOM, hexagonal")):
        axes.set_title(title)
    return figure


def grown() -> Figure:
    """A map that grows; after 10,000 inputs the ring moves away."""
    figure = Figure(figsize=(7, 4), layout="constrained")
    inputs = np.concatenate([ring(INPUTS // 2), ring(INPUTS // 2) + 1])
    gas = GrowingNeuralGas(max_units=100, utility=3, random_state=0)
    growth(follow(gas, inputs, every=200), figure.subplots(2, sharex=True))
    return figure


def dimensions() -> Figure:
    """A chain, a square and a cube on a square of inputs, and what the measures say of them."""
    figure = Figure(figsize=(12, 4.2), layout="constrained")
    inputs = RNG.random((INPUTS, 2))
    for axes, shape in zip(figure.subplots(1, 3), ((64,), (8, 8), (4, 4, 4)), strict=True):
        som = SOM(shape=shape, random_state=0).partial_fit(inputs)
        product, error = topographic_product(som), topographic_error(som, inputs)
        codebook(som, axes).set_title(f"{shape}: product {product:+.3f}, error {error:.2f}")
    return figure


PICTURES = {
    "u_matrix": u_matrices,
    "component_planes": planes,
    "hit_map": hits,
    "codebook": codebooks,
    "growth": grown,
    "topographic_product": dimensions,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "img" / "maps")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    matplotlib.rcParams.update({"font.size": 9, "axes.titlesize": 10, "axes.spines.top": False})
    for name, draw in PICTURES.items():
        draw().savefig(args.out / f"{name}.png", dpi=110)


if __name__ == "__main__":
    main()
