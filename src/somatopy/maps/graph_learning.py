"""Compiled kernels of the maps that grow: what each does with an input.

Each kernel learns the samples (n, padded dims) in their order, from the place `start` on, as far as the net has room.
It returns the place of the first sample that it has not learned, and the winner of the last one that it has, before its
update; -1 and -1, and nothing has changed, if any sample is not usable.
"""

from __future__ import annotations

from math import exp, sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from somatopy._jit import jit
from somatopy.maps.graph_kernels import (
    SEEN,
    UNITS,
    Net,
    add_unit,
    drop_older,
    fade,
    grow_older,
    join,
    move,
    nearest_of,
    nearest_two,
    neighbour,
    part,
    remove_lonely,
    remove_unit,
    room,
)
from somatopy.maps.kernels import all_usable

__all__ = [
    "EvolvingRule",
    "GasRule",
    "RequiredRule",
    "learn_evolving_som",
    "learn_grow_when_required",
    "learn_growing_neural_gas",
]

Array = NDArray[Any]
Floats = NDArray[np.float64]

ERROR, UTILITY = range(2)  # places in the values of a growing neural gas
HABITUATION = 0  # and in those of a map that grows when required
# An age and a place. They have a type because kernels are compiled anew for each literal number
NEW: Any = np.int64(0)
FIRST: Any = np.int64(0)


class GasRule(NamedTuple):
    """Parameters of `GrowingNeuralGas`; no utility is 0."""

    max_units: int
    learning_rate: float
    neighbour_rate: float
    insert_every: int
    max_age: int
    error_share: float
    decay: float
    utility: float


class EvolvingRule(NamedTuple):
    """Parameters of `EvolvingSOM`."""

    max_units: int
    threshold: float
    learning_rate: float
    prune_every: int


class RequiredRule(NamedTuple):
    """Parameters of `GrowWhenRequired`."""

    max_units: int
    activity_threshold: float
    firing_threshold: float
    learning_rate: float
    neighbour_rate: float
    max_age: int
    rest: float
    kept: float
    neighbour_kept: float


@jit
def _greatest(values: Floats, units: int) -> int:
    """The unit of the greatest value, the first of equals."""
    most = FIRST
    for unit in range(units):
        if values[unit] > values[most]:
            most = unit
    return int(most)


@jit
def _insert_by_error(net: Net, share: float) -> None:
    """Put a unit half-way between that of greatest error and its neighbour of greatest error."""
    errors, utilities = net.values[ERROR], net.values[UTILITY]
    worst = _greatest(errors, net.counts[UNITS])
    if net.degrees[worst] == 0:
        return
    beside = neighbour(net, worst, FIRST)
    for i in range(net.degrees[worst]):
        if errors[neighbour(net, worst, i)] > errors[beside]:
            beside = neighbour(net, worst, i)
    unit = add_unit(net, worst, net.codes[:, beside], 0.5)
    part(net, worst, beside)
    join(net, unit, worst, NEW)
    join(net, unit, beside, NEW)
    errors[worst] *= share
    errors[beside] *= share
    errors[unit] = 0.5 * (errors[worst] + errors[beside])
    utilities[unit] = 0.5 * (utilities[worst] + utilities[beside])


@jit
def _remove_useless(net: Net, limit: float) -> None:
    """Remove the unit of least utility if the greatest error is over `limit` times that."""
    errors, utilities, units = net.values[ERROR], net.values[UTILITY], net.counts[UNITS]
    least = FIRST
    for unit in range(units):
        if utilities[unit] < utilities[least]:
            least = unit
    if units > 2 and errors[_greatest(errors, units)] > limit * utilities[least]:
        remove_unit(net, least)
        remove_lonely(net)


@jit
def learn_growing_neural_gas(
    net: Net, dims: int, missing: bool, samples: Array, start: int, rule: GasRule
) -> tuple[int, int]:
    """Learn the samples as `GrowingNeuralGas` states it."""
    if start == 0 and not all_usable(samples, dims, missing):
        return -1, -1
    winner = -1
    for t in range(start, samples.shape[0]):
        if not room(net, rule.max_units):
            return t, winner
        x = samples[t]
        winner, second = nearest_two(net, x, dims)
        grow_older(net, winner)
        net.values[ERROR, winner] += net.work[winner] / net.fade[0]
        move(net, winner, x, rule.learning_rate)
        for i in range(net.degrees[winner]):
            move(net, neighbour(net, winner, i), x, rule.neighbour_rate)
        join(net, winner, second, NEW)
        if rule.utility > 0:
            net.values[UTILITY, winner] += (net.work[second] - net.work[winner]) / net.fade[0]
        drop_older(net, winner, rule.max_age)
        net.counts[SEEN] += 1
        if net.counts[SEEN] % rule.insert_every == 0:
            if rule.utility > 0:
                _remove_useless(net, rule.utility)
            if net.counts[UNITS] < rule.max_units:
                _insert_by_error(net, rule.error_share)
        fade(net, rule.decay)
    return samples.shape[0], winner


@jit
def _move_by_activation(net: Net, winner: int, x: Array, rate: float, threshold: float) -> None:
    """Move the winner and its neighbours by `rate` times their share in the activation.

    Activations are taken relative to the winner's, which is then 1, however far x is.
    """
    nearest, total = net.work[winner], 1.0
    for i in range(net.degrees[winner]):
        total += exp(-2.0 * (net.work[neighbour(net, winner, i)] - nearest) / threshold / threshold)
    for i in range(net.degrees[winner]):
        other = neighbour(net, winner, i)
        activation = exp(-2.0 * (net.work[other] - nearest) / threshold / threshold)
        move(net, other, x, rate * activation / total)
    move(net, winner, x, rate / total)


@jit
def _length(net: Net, a: int, b: int) -> float:
    """Squared distance between two units."""
    length = 0.0
    for k in range(net.codes.shape[0]):
        length += float(net.codes[k, a] - net.codes[k, b]) ** 2
    return length


@jit
def _prune(net: Net) -> None:
    """Remove the longest edge, the first of equals."""
    a, b, longest = -1, -1, -1.0
    for unit in range(net.counts[UNITS]):
        for i in range(net.degrees[unit]):
            other = neighbour(net, unit, i)
            if other > unit and _length(net, unit, other) > longest:
                a, b, longest = unit, other, _length(net, unit, other)
    if a >= 0:
        part(net, a, b)


@jit
def _evolve(net: Net, x: Array, dims: int, rule: EvolvingRule) -> int:
    """Learn one input; the winner before."""
    units = net.counts[UNITS]
    if units == 0:
        return add_unit(net, -1, x, 1.0)
    winner = second = nearest_of(net, x, dims)
    if units > 1:
        winner, second = nearest_two(net, x, dims)
    if sqrt(net.work[winner]) >= rule.threshold and units < rule.max_units:
        unit = add_unit(net, winner, x, 1.0)
        join(net, unit, winner, NEW)
        join(net, unit, second, NEW)
        return winner
    _move_by_activation(net, winner, x, rule.learning_rate, rule.threshold)
    if second != winner:
        join(net, winner, second, NEW)
    return winner


@jit
def learn_evolving_som(
    net: Net, dims: int, missing: bool, samples: Array, start: int, rule: EvolvingRule
) -> tuple[int, int]:
    """Learn the samples as `EvolvingSOM` states it."""
    if start == 0 and not all_usable(samples, dims, missing):
        return -1, -1
    winner = -1
    for t in range(start, samples.shape[0]):
        if not room(net, rule.max_units):
            return t, winner
        winner = _evolve(net, samples[t], dims, rule)
        net.counts[SEEN] += 1
        if net.counts[SEEN] % rule.prune_every == 0:
            _prune(net)
    return samples.shape[0], winner


@jit
def _habituate(net: Net, winner: int, rule: RequiredRule) -> None:
    """Bring the winner and its neighbours one firing nearer to rest."""
    habituation = net.values[HABITUATION]
    habituation[winner] = rule.rest + rule.kept * (habituation[winner] - rule.rest)
    for i in range(net.degrees[winner]):
        other = neighbour(net, winner, i)
        habituation[other] = rule.rest + rule.neighbour_kept * (habituation[other] - rule.rest)


@jit
def _grow_or_move(net: Net, x: Array, dims: int, rule: RequiredRule) -> int:
    """Learn one input; the winner before."""
    units, habituation = net.counts[UNITS], net.values[HABITUATION]
    if units < 2:
        habituation[add_unit(net, units - 1, x, 1.0)] = 1.0
        return 0
    winner, second = nearest_two(net, x, dims)
    join(net, winner, second, NEW)
    new = exp(-sqrt(net.work[winner])) < rule.activity_threshold
    if new and habituation[winner] < rule.firing_threshold and units < rule.max_units:
        unit = add_unit(net, winner, x, 0.5)
        habituation[unit] = 1.0
        part(net, winner, second)
        join(net, unit, winner, NEW)
        join(net, unit, second, NEW)
    else:
        move(net, winner, x, rule.learning_rate * habituation[winner])
        for i in range(net.degrees[winner]):
            other = neighbour(net, winner, i)
            move(net, other, x, rule.neighbour_rate * habituation[other])
    grow_older(net, winner)
    _habituate(net, winner, rule)
    drop_older(net, winner, rule.max_age)
    return winner


@jit
def learn_grow_when_required(
    net: Net, dims: int, missing: bool, samples: Array, start: int, rule: RequiredRule
) -> tuple[int, int]:
    """Learn the samples as `GrowWhenRequired` states it."""
    if start == 0 and not all_usable(samples, dims, missing):
        return -1, -1
    winner = -1
    for t in range(start, samples.shape[0]):
        if not room(net, rule.max_units):
            return t, winner
        winner = _grow_or_move(net, samples[t], dims, rule)
        net.counts[SEEN] += 1
    return samples.shape[0], winner
