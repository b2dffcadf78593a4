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
from sklearn.datasets import load_iris

from somatopy.maps import DSOM, SOM, GrowingNeuralGas
from somatopy.maps.pictures import codebook, component_planes, growth, hit_map, hit_maps, u_matrix
from somatopy.maps.quality import follow, topographic_error, topographic_product

Floats = NDArray[np.float64]

INPUTS = 20_000


def clusters(rng: np.random.Generator, count: int) -> Floats:
    """Three clouds in a plane, of different widths."""
    centres, widths = np.array([(0.2, 0.25), (0.8, 0.3), (0.45, 0.8)]), np.array([0.05, 0.09, 0.07])
    cloud = rng.integers(3, size=count)
    return rng.normal(centres[cloud], widths[cloud, None])


def ring(rng: np.random.Generator, count: int) -> Floats:
    angle, radius = rng.uniform(0, 2 * np.pi, count), np.sqrt(rng.uniform(0.25**2, 0.5**2, count))
    return 0.5 + np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)


def sphere(rng: np.random.Generator, count: int) -> Floats:
    points: Floats = rng.normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    return 0.5 + 0.5 * points


def arm(rng: np.random.Generator, count: int) -> Floats:
    """Shoulder and elbow of an arm of two links, rad, and its hand's position, link lengths."""
    shoulder, elbow = rng.uniform(-1.5, 1.5, count), rng.uniform(0, 2.5, count)
    x, y = np.cos(shoulder) + np.cos(shoulder + elbow), np.sin(shoulder) + np.sin(shoulder + elbow)
    return np.stack([shoulder, elbow, x, y], axis=1)


def u_matrices(rng: np.random.Generator) -> Figure:
    """Three clouds on squares, on hexagons, and in a graph."""
    figure = Figure(figsize=(12, 3.3), layout="constrained")
    maps = {
        "SOM, rectangular": SOM(shape=(20, 20), random_state=0),
        "SOM, hexagonal": SOM(shape=(23, 20), lattice="hexagonal", random_state=0),
        "GrowingNeuralGas": GrowingNeuralGas(max_units=80, max_age=200, random_state=0),
    }
    inputs = clusters(rng, INPUTS)
    for axes, (title, som) in zip(figure.subplots(1, 3), maps.items(), strict=True):
        u_matrix(som.partial_fit(inputs), axes).set_title(title)
    return figure


def planes(rng: np.random.Generator) -> Figure:
    """What an arm's map knows of joints and hand."""
    figure = Figure(figsize=(12, 2.1), layout="constrained")
    som = SOM(shape=(20, 24), lattice="hexagonal", bounds=(-2, 2), random_state=0).partial_fit(arm(rng, INPUTS))
    names = ("shoulder (rad)", "elbow (rad)", "hand x", "hand y")
    for axes, name in zip(component_planes(som, figure.subplots(1, 4)), names, strict=True):
        axes.set_title(name)
    return figure


def hits(rng: np.random.Generator) -> Figure:
    """Where inputs fall, on squares, on hexagons and on a strip."""
    figure = Figure(figsize=(8, 4.9), layout="constrained")
    places = figure.subplot_mosaic("AB;CC", height_ratios=(3, 1))
    maps = {
        "A": SOM(shape=(12, 12), random_state=0),
        "B": SOM(shape=(14, 12), lattice="hexagonal", random_state=0),
        "C": SOM(shape=(40,), random_state=0),
    }
    inputs, fresh = clusters(rng, INPUTS), clusters(rng, 2000)
    for place, som in maps.items():
        hit_map(som.partial_fit(inputs), fresh, places[place])
    return figure


def codebooks(rng: np.random.Generator) -> Figure:
    """A lattice and a graph on a ring, a lattice on a sphere."""
    figure = Figure(figsize=(10.5, 3.3), layout="constrained")
    grid = figure.add_gridspec(1, 3, width_ratios=(1, 1, 1.3))
    plane, graph, space = (figure.add_subplot(grid[k], projection="3d" if k == 2 else None) for k in range(3))
    inputs, ball = ring(rng, INPUTS), sphere(rng, INPUTS)
    codebook(DSOM(shape=(8, 8), elasticity=1.75, random_state=2).partial_fit(inputs), plane, X=inputs[:800])
    codebook(GrowingNeuralGas(max_units=80, random_state=0).partial_fit(inputs), graph, X=inputs[:800])
    codebook(SOM(shape=(14, 14), lattice="hexagonal", random_state=0).partial_fit(ball), space, dims=(0, 1, 2))
    for axes, title in ((plane, "DSOM"), (graph, "GrowingNeuralGas"), (space, "SOM, hexagonal")):
        axes.set_title(title)
    return figure


def grown(rng: np.random.Generator) -> Figure:
    """A map that grows; after 10,000 inputs the ring moves away."""
    figure = Figure(figsize=(7, 4), layout="constrained")
    inputs = np.concatenate([ring(rng, INPUTS // 2), ring(rng, INPUTS // 2) + 1])
    gas = GrowingNeuralGas(max_units=100, utility=3, random_state=0)
    growth(follow(gas, inputs, every=200), figure.subplots(2, sharex=True))
    return figure


def dimensions(rng: np.random.Generator) -> Figure:
    """A chain, a square and a cube on a square of inputs, and what the measures say of them."""
    figure = Figure(figsize=(10.5, 4), layout="constrained")
    inputs = rng.random((INPUTS, 2))
    panels = figure.subplots(1, 3, sharex=True, sharey=True)
    for axes, shape in zip(panels, ((64,), (8, 8), (4, 4, 4)), strict=True):
        som = SOM(shape=shape, random_state=0).partial_fit(inputs)
        product, error = round(topographic_product(som), 3) + 0.0, topographic_error(som, inputs)
        codebook(som, axes).set_title(f"{shape}: product {product:+.3f}, error {error:.2f}")
        axes.label_outer()
    return figure


def flowers(rng: np.random.Generator) -> Figure:
    """Iris: what units know of each column, and where its three species fall."""
    figure = Figure(figsize=(12, 4.9), layout="constrained")
    iris = load_iris(as_frame=True)
    som = SOM(shape=(10, 10), lattice="hexagonal", random_state=0).fit(iris.data)
    grid = figure.subplots(2, 4)
    component_planes(som, grid[0])
    hit_maps(som, iris.data, iris.target_names[iris.target], grid[1, :3])
    u_matrix(som, grid[1, 3]).set_title("U-matrix")
    for axes in grid.flat:
        axes.set(xlabel="", ylabel="", xticks=[], yticks=[])
    return figure


PICTURES = {
    "iris": flowers,
    "u_matrix": u_matrices,
    "component_planes": planes,
    "hit_map": hits,
    "codebook": codebooks,
    "growth": grown,
    "topographic_product": dimensions,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=PICTURES, default=list(PICTURES), help="which (default all)")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "img" / "maps")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    matplotlib.rcParams.update({"font.size": 9, "axes.titlesize": 10})
    matplotlib.rcParams.update({"axes.spines.top": False, "axes.spines.right": False})
    for name in args.only:
        figure = PICTURES[name](np.random.default_rng(1))
        figure.draw_without_rendering()  # what is equally scaled has its size only now: the layout is then exact
        figure.savefig(args.out / f"{name}.png", dpi=100)


if __name__ == "__main__":
    main()
