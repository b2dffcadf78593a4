"""Who takes part: each map, and beside it what else does the same."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from bound import bound
from numpy.typing import NDArray
from peers import minigng, minisom, numbasom, plain_dsom, plain_gas, plain_graph, tuned_dsom
from turns import MOST, Contestant, Run, uniform

from somatopy.links import PositiveHebb
from somatopy.links.table import DenseTable, SparseTable, Table
from somatopy.maps import DSOM, SOM, EvolvingSOM, GrowingNeuralGas, GrowWhenRequired, Map, NeuralGas

Shape = tuple[int, int]

CONVERGED = 20_000  # inputs that a map has learned before it is measured
MOST_MINIGNG = 1000  # units; to grow more takes it minutes
RATE = ELASTICITY = 0.1
GAS = {"learning_rate": 0.2, "neighbour_rate": 0.006, "max_age": 50}


def each(act: Callable[[Any], object]) -> Run:
    """A call for each sample."""

    def run(samples: NDArray[Any]) -> None:
        for x in samples:
            act(x)

    return run


def whole(shape: Shape) -> int:
    """Inputs of a whole training of a map with a schedule, in a turn."""
    return min(MOST, max(200, 4_000_000 // (shape[0] * shape[1])))


def dsoms(shape: Shape, dims: int, inputs: NDArray[Any]) -> Iterator[Contestant]:
    """The dynamic map, converged and fresh, in both precisions; rules in NumPy; minisom's step; the bound."""
    settings: dict[str, Any] = {"shape": shape, "elasticity": ELASTICITY, "random_state": 0}
    dsom, single = DSOM(**settings).partial_fit(inputs), DSOM(**settings, dtype="float32").partial_fit(inputs)
    fresh = DSOM(**settings).initialise(dims)
    start, memory = fresh.state(), float(np.sqrt(dsom.state()["running_max_squared"]))
    rule = shape, RATE, ELASTICITY, memory
    yield Contestant("DSOM", "DSOM.partial_fit", dsom.partial_fit)
    yield Contestant("DSOM", "DSOM.partial_fit, float32", single.partial_fit)
    yield Contestant("DSOM", "DSOM.partial_fit, first 500 inputs", fresh.partial_fit, 500, lambda: fresh.restore(start))
    yield Contestant("DSOM", "DSOM.learn_one", each(dsom.learn_one))
    yield Contestant("DSOM", "DSOM.winner", each(dsom.winner))
    yield Contestant("DSOM", "equations in NumPy, plainly", plain_dsom(dsom.codebook_, *rule))
    yield Contestant("DSOM", "equations in NumPy, tuned", tuned_dsom(dsom.codebook_, *rule))
    if step := minisom(shape, dims):
        yield Contestant("DSOM", "minisom, online step (a SOM)", step)
    if dims == 4:
        for name, map_ in (("bound", dsom), ("bound, float32", single)):
            codes = np.ascontiguousarray(map_.codebook_.T)
            yield Contestant("DSOM", name, bounded(codes))


def bounded(codes: NDArray[Any]) -> Run:
    rate = codes.dtype.type(1e-9)
    return lambda samples: bound(codes, samples.astype(codes.dtype), rate)


def soms(shape: Shape, dims: int, inputs: NDArray[Any]) -> Iterator[Contestant]:
    """A whole training, from a width of half the map on; and steps after it."""
    count = whole(shape)
    som, settled = (SOM(shape=shape, horizon=n, epochs=1, random_state=0) for n in (count, len(inputs)))
    yield Contestant("SOM, whole training", "SOM.fit", som.fit, count)
    if step := minisom(shape, dims, count):
        yield Contestant("SOM, whole training", "minisom, online steps", step, count)
    if train := numbasom(shape):
        yield Contestant("SOM, whole training", "numbasom, train", train, count)
    yield Contestant("SOM, settled", "SOM.partial_fit", settled.partial_fit(inputs).partial_fit)
    yield Contestant("SOM, settled", "SOM.learn_one", each(settled.learn_one))
    if step := minisom(shape, dims):
        yield Contestant("SOM, settled", "minisom, online step", step)


def gases(shape: Shape, dims: int, inputs: NDArray[Any]) -> Iterator[Contestant]:
    """Neural gas: a whole training, from a width of ten ranks on; and steps after it."""
    count, units = whole(shape), shape[0] * shape[1]
    gas, settled = (NeuralGas(units=units, horizon=n, epochs=1, random_state=0) for n in (count, len(inputs)))
    yield Contestant("NeuralGas, whole training", "NeuralGas.fit", gas.fit, count)
    yield Contestant("NeuralGas, whole training", "equation in NumPy", plain_gas(uniform(units, dims), 0.05, 1.0))
    yield Contestant("NeuralGas, settled", "NeuralGas.partial_fit", settled.partial_fit(inputs).partial_fit)
    yield Contestant("NeuralGas, settled", "equation in NumPy", plain_gas(settled.codebook_, 0.005, 0.01))


def growing(shape: Shape, dims: int, inputs: NDArray[Any]) -> Iterator[Contestant]:
    """The growing maps, grown to as many units and settled."""
    units = shape[0] * shape[1]
    many = uniform(2 * units, dims)
    pace = 10 if units <= MOST_MINIGNG else 1  # inputs from unit to unit
    gas = GrowingNeuralGas(**GAS, insert_every=pace, max_units=units, random_state=0)
    gas.partial_fit(uniform(pace * (units + 1), dims)).partial_fit(inputs)
    evolving = EvolvingSOM(threshold=1e-9, max_units=units).partial_fit(many)
    evolving.set_params(threshold=0.1).partial_fit(inputs)
    required = GrowWhenRequired(activity_threshold=1 - 1e-9, firing_threshold=1.0, max_units=units).partial_fit(many)
    required.partial_fit(inputs)
    for map_ in (gas, evolving, required):
        name = type(map_).__name__
        assert len(map_.codebook_) == units, f"{name} has {len(map_.codebook_)} units, not {units}"
        yield Contestant(name, f"{name}.partial_fit", map_.partial_fit)
        if map_ is gas and units <= MOST_MINIGNG and (step := minigng(units, inputs, GAS)):
            yield Contestant(name, "minigng, partial_fit", step)
        yield Contestant(name, "search and moves in NumPy", beside(map_))


def beside(map_: Map) -> Run:
    return plain_graph(map_.codebook_, map_.topology_.edges, GAS["learning_rate"], GAS["neighbour_rate"], 50)


def links(nodes: int) -> Iterator[Contestant]:
    """Updates and read-outs of links, those of two maps of so many nodes; a dense table has as few rows as fit."""
    rng, known = np.random.default_rng(0), min(nodes, 900)
    pairs = np.stack([rng.integers(0, known, 50_000), rng.integers(0, nodes, 50_000)], axis=1).tolist()
    tables = {"dense": DenseTable(known, nodes), "sparse": SparseTable(nodes, nodes)}
    for what, call in (("update", updated), ("strongest", read), ("row", row)):
        for name, table in tables.items():
            updated(table, pairs)
            yield Contestant(f"links of {nodes:,} nodes, {what}", f"{name} table", acting(call, table, pairs))


def acting(call: Callable[[Table, list[list[int]]], None], table: Table, pairs: list[list[int]]) -> Run:
    return lambda samples: call(table, pairs[: len(samples)])


def updated(table: Table, pairs: list[list[int]]) -> None:
    rule = PositiveHebb()
    for i, j in pairs:
        table.update(rule, i, j, 0.5, 0.7)


def read(table: Table, pairs: list[list[int]]) -> None:
    for i, _ in pairs:
        table.strongest(i, 0.3)


def row(table: Table, pairs: list[list[int]]) -> None:
    for i, _ in pairs:
        table.row(i)
