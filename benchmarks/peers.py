"""What the maps are compared with: other packages, where they are installed, and plain rules in NumPy."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import redirect_stdout
from io import StringIO
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Run = Callable[[Floats], object]
Shape = tuple[int, int]


# Rules in NumPy


def plain_dsom(start: Floats, shape: Shape, rate: float, elasticity: float, farthest: float = 0.0) -> Run:
    """Equations 1 and 2 of `DSOM` as one reads them: an expression a symbol, but lattice positions once for all."""
    codes = start.copy().reshape(*shape, -1)
    p = np.stack(np.meshgrid(*(np.linspace(0, 1, n) for n in shape), indexing="ij"), axis=-1) / sqrt(len(shape))

    def learn(samples: Floats) -> Floats:
        nonlocal codes, farthest
        for v in samples:
            distance = np.linalg.norm(v - codes, axis=-1)
            farthest = max(farthest, float(distance.max()))
            omega = distance / farthest
            s = np.unravel_index(distance.argmin(), shape)
            h = np.exp(-((p - p[s]) ** 2).sum(axis=-1) / (elasticity * omega[s]) ** 2)
            codes = codes + rate * (omega * h)[..., None] * (v - codes)
        return codes.reshape(len(start), -1)

    return learn


def tuned_dsom(start: Floats, shape: Shape, rate: float, elasticity: float, farthest: float = 0.0) -> Run:
    """The same, with one Gaussian along each axis, and codes one array a dimension."""
    codes, greatest = np.ascontiguousarray(start.T.reshape(-1, *shape)), farthest**2
    rows, columns = (np.arange(n) / (max(n - 1, 1) * sqrt(2)) for n in shape)

    def learn(samples: Floats) -> Floats:
        nonlocal codes, greatest
        for v in samples:
            delta = v[:, None, None] - codes
            squared = np.einsum("kij,kij->ij", delta, delta)
            i, j = divmod(int(squared.argmin()), shape[1])
            greatest = max(greatest, float(squared.max()))
            scale = elasticity**2 * squared[i, j] / greatest
            across = rate / sqrt(greatest) * np.exp(-((rows - rows[i]) ** 2) / scale)
            delta *= np.sqrt(squared) * across[:, None] * np.exp(-((columns - columns[j]) ** 2) / scale)
            codes += delta
        return np.ascontiguousarray(codes.reshape(len(codes), -1).T)

    return learn


def plain_gas(start: Floats, rate: float, width: float) -> Run:
    """The equation of `NeuralGas`, its ranks by sorting twice."""
    codes = start.copy()

    def learn(samples: Floats) -> Floats:
        for v in samples:
            delta = v - codes
            ranks = (delta**2).sum(axis=1).argsort(kind="stable").argsort()
            codes[:] += (rate * np.exp(-ranks / width))[:, None] * delta
        return codes

    return learn


def plain_graph(start: Floats, edges: NDArray[np.int64], rate: float, neighbour_rate: float, max_age: int) -> Run:
    """What the growing maps have in common: two nearest units, the winner and its neighbours move, edges age.

    It adds and removes no unit and keeps no errors, so that it does less than any of them.
    """
    codes = start.copy()
    ages: list[dict[int, int]] = [{} for _ in codes]
    for a, b in edges.tolist():
        ages[a][b] = ages[b][a] = 0

    def learn(samples: Floats) -> Floats:
        for v in samples:
            delta = v - codes
            s, t = np.argpartition(np.einsum("ij,ij->i", delta, delta), 1)[:2].tolist()
            codes[s] += rate * delta[s]
            around = list(ages[s])
            codes[around] += neighbour_rate * delta[around]
            for i in around:
                ages[s][i] = ages[i][s] = ages[s][i] + 1
                if ages[s][i] > max_age:
                    del ages[s][i], ages[i][s]
            ages[s][t] = ages[t][s] = 0
        return codes

    return learn


# Packages


def minisom(shape: Shape, dims: int, count: int = 100_000) -> Run | None:
    """minisom's winner and update, each of the samples a step of a training of `count`; None if it is missing."""
    try:
        from minisom import MiniSom
    except ImportError:
        return None
    som = MiniSom(*shape, dims, sigma=max(shape) / 2, random_seed=0)

    def learn(samples: Floats) -> None:
        for t, x in enumerate(samples):
            som.update(x, som.winner(x), t, count)

    return learn


def numbasom(shape: Shape) -> Run | None:
    """A whole training of numbasom, as many inputs as there are samples; None if it is missing."""
    try:
        from numbasom import SOM
    except ImportError:
        return None

    def learn(samples: Floats) -> None:
        with redirect_stdout(StringIO()):
            SOM(som_size=shape).train(samples, len(samples))

    return learn


def minigng(units: int, inputs: Floats, settings: dict[str, Any]) -> Run | None:
    """A growing neural gas of minigng that has grown to so many units, a unit each 10 inputs; None if it is missing."""
    try:
        from minigng import MiniGNG
    except ImportError:
        return None
    gas = MiniGNG(
        max_units=units,
        sigma=10,
        eps_b=settings["learning_rate"],
        eps_n=settings["neighbour_rate"],
        max_edge_age=settings["max_age"],
        shuffle=False,
    )
    while len(gas.units) < units:
        gas.partial_fit(inputs[: 10 * units])
    gas.set_params(sigma=100)
    gas.partial_fit(inputs[: 2 * units])
    return gas.partial_fit
