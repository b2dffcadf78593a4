"""The evolving self-organising map of Deng and Kasabov."""

from __future__ import annotations

from math import exp, sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from somatopy._jit import jit
from somatopy.maps.graph_kernels import (
    NEW,
    SEEN,
    UNITS,
    Net,
    add_unit,
    join,
    move,
    nearest_of,
    nearest_two,
    neighbour,
    part,
    room,
)
from somatopy.maps.graph_map import GraphMap
from somatopy.maps.kernels import all_usable, read_sample
from somatopy.maps.start import check_number, check_units, remembered

__all__ = ["EvolvingSOM"]

Array = NDArray[Any]


class EvolvingSOM(GraphMap):
    r"""Evolving self-organising map: an input that no unit is near to becomes a unit at once.

    There is no unit at first. For each input :math:`v`, with :math:`s` and :math:`t` the nearest and the second nearest
    unit:

    * if :math:`\|v - w_s\| \ge \epsilon`, or there is no unit, :math:`v` becomes one, joined to :math:`s` and
      :math:`t`;
    * otherwise the winner :math:`s` and its neighbours :math:`i` move by their shares in the activation,

      .. math::
          \Delta w_i = \gamma \frac{a_i}{\sum_j a_j} (v - w_i) \qquad a_i = e^{-2 \|v - w_i\|^2 / \epsilon^2}

      and then an edge joins :math:`s` and :math:`t`;
    * each :math:`T` inputs the weakest edge is removed. The strength of an edge is
      :math:`\epsilon / \|w_i - w_j\|`, so this is the longest one, the first of equals.

    Descriptions differ. Taken here: activations are divided by their sum over the winner and its neighbours, which some
    leave out; the two nearest units are joined whenever they win, not only when a unit is added; strengths are those
    of the present codes, and of edges only. Units are never removed, with or without edges. A full map, of `max_units`,
    moves its winner however far the input is.

    Sources: D. Deng, N. Kasabov, On-line pattern analysis by evolving self-organizing maps, Neurocomputing 51, 2003;
    algorithm 3 of Sensors 15(5), 2015, doi 10.3390/s150510100.

    Args:
        threshold: :math:`\epsilon`, over 0, in units of the inputs: how near a unit has to be.
        learning_rate: :math:`\gamma`, in (0, 1].
        prune_every: :math:`T`, inputs from one removed edge to the next.
        max_units: most units that there may be, at least 1.
        epochs: passes of `fit` over the rows, in a new random order each.
        dtype: precision, "float64" or "float32".
        missing: "error" refuses inputs with NaN; "ignore" uses the coordinates that were observed. A new unit takes
            the others from the winner; the first one is 0 there.
        random_state: not used, since nothing is drawn; maps have it.

    Example:
        >>> import numpy as np
        >>> angles = np.random.default_rng(0).uniform(0, 2 * np.pi, 10_000)
        >>> ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        >>> evolving = EvolvingSOM(threshold=0.3).partial_fit(ring)
        >>> evolving.topology_.components
        1
        >>> unit, distance = evolving.winner([1.0, 0.0])
        >>> distance < 0.3
        True
    """

    AGED = False

    def __init__(
        self,
        threshold: float = 0.1,
        learning_rate: float = 0.05,
        prune_every: int = 100,
        max_units: int = 1000,
        dtype: str = "float64",
        missing: str = "error",
        random_state: int | np.random.Generator | None = None,
        epochs: int = 10,
    ) -> None:
        self.threshold = threshold
        self.learning_rate = learning_rate
        self.prune_every = prune_every
        self.max_units = max_units
        self.epochs = epochs
        self.dtype = dtype
        self.missing = missing
        self.random_state = random_state

    def _start_from(self, samples: Array, rng: np.random.Generator) -> dict[str, Array]:
        self._parameters()
        return self._edgeless(np.empty((0, samples.shape[1])))

    def _learn_from(self, samples: Array, start: int) -> tuple[int, int]:
        return learn_evolving_som(self._net, self._allows_missing(), samples, start, self._parameters())

    def _parameters(self) -> tuple[Any, ...]:
        return evolving_rule(
            self.max_units,
            self.threshold,
            self.learning_rate,
            self.prune_every,
        )


class EvolvingRule(NamedTuple):
    """Parameters of `EvolvingSOM`."""

    max_units: int
    threshold: float
    learning_rate: float
    prune_every: int


@remembered
def evolving_rule(max_units: Any, threshold: Any, learning_rate: Any, prune_every: Any) -> tuple[Any, ...]:
    """The values of an `EvolvingRule`.

    Raises:
        ValueError: if one is not valid.
    """
    check_number("threshold", threshold)
    check_number("learning_rate", learning_rate, most=1)
    for name, count in (("prune_every", prune_every), ("max_units", max_units)):
        check_units(name, count)
    return int(max_units), float(threshold), float(learning_rate), int(prune_every)


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
    net: Net, missing: bool, samples: Array, start: int, parameters: tuple[Any, ...]
) -> tuple[int, int]:
    """Learn the samples (n, dims) as `EvolvingSOM` states it; see `GraphMap._learn_from`."""
    if start == 0 and not all_usable(samples, missing):
        return -1, -1
    rule, dims, x = EvolvingRule(*parameters), samples.shape[1], np.zeros(net.codes.shape[0], net.codes.dtype)
    winner = -1
    for t in range(start, samples.shape[0]):
        if not room(net, rule.max_units):
            return t, winner
        read_sample(samples, t, x)
        winner = _evolve(net, x, dims, rule)
        net.counts[SEEN] += 1
        if net.counts[SEEN] % rule.prune_every == 0:
            _prune(net)
    return samples.shape[0], winner
