"""The growing neural gas of Fritzke."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from somatopy._jit import jit
from somatopy.maps.first_codes import first_codes
from somatopy.maps.graph_kernels import (
    NEW,
    SEEN,
    UNITS,
    Net,
    add_unit,
    drop_older,
    fade,
    grow_older,
    join,
    move,
    nearest_two,
    neighbour,
    part,
    remove_lonely,
    remove_unit,
    room,
)
from somatopy.maps.graph_map import GraphMap
from somatopy.maps.kernels import all_usable, read_sample
from somatopy.maps.start import check_number, check_units, remembered

__all__ = ["GrowingNeuralGas"]

Array = NDArray[Any]
Floats = NDArray[np.float64]

ERROR, UTILITY = range(2)  # places in the values
FIRST: Any = np.int64(0)  # a unit or a place; it has a type because kernels are compiled anew for each literal number


class GrowingNeuralGas(GraphMap):
    r"""Growing neural gas: units are added where the error is greatest, and edges show the topology of the inputs.

    For each input :math:`v`, with :math:`s` and :math:`t` the nearest and the second nearest unit:

    1. all edges of :math:`s` grow older by 1;
    2. :math:`s` keeps account of its error, :math:`E_s \leftarrow E_s + \|v - w_s\|^2`;
    3. :math:`s` and its neighbours :math:`i` move:

       .. math::
           \Delta w_s = \varepsilon_b (v - w_s) \qquad \Delta w_i = \varepsilon_n (v - w_i)
    4. an edge of age 0 joins :math:`s` and :math:`t`;
    5. edges of :math:`s` older than `max_age` are removed, and units that have lost their last edge;
    6. each :math:`\lambda` inputs a unit is added half-way between the unit :math:`q` of the greatest error and its
       neighbour :math:`f` of the greatest error. It replaces their edge by one to each; :math:`E_q` and :math:`E_f` are
       multiplied by :math:`\alpha`, and the new unit starts with their mean;
    7. all errors are multiplied by :math:`d`.

    With `utility` (GNG-U) units are also removed where they have become useless, so that the map follows data that
    move. The utility of a unit is what the error would have been more without it,
    :math:`U_s \leftarrow U_s + \|v - w_t\|^2 - \|v - w_s\|^2`, and fades as the errors do; a new unit starts with the
    mean of those of :math:`q` and :math:`f`. The unit :math:`i` of least utility goes if :math:`\max E > k U_i`.
    Descriptions differ in how often this is asked; here it is each :math:`\lambda` inputs, before a unit is added.

    Two units are always left, which may have no edge once utility took the one between them. Where a unit is removed,
    the last one takes its number. Of equals, the first counts. The errors and utilities in `state()` are yet to be
    multiplied by its "fade": step 7 changes this one number, and all of them only now and then.

    Sources: B. Fritzke, A growing neural gas network learns topologies, NIPS 7, 1995 (its step order and
    :math:`\alpha`, :math:`d`, :math:`\lambda`, :math:`\varepsilon_n`); B. Fritzke, A self-organizing network that can
    follow non-stationary distributions, ICANN 1997. The 1995 paper lets a new unit start with the error that
    :math:`q` is left with; the mean is what its author's DemoGNG takes.

    Args:
        learning_rate: :math:`\varepsilon_b`, in (0, 1]: how far the winner moves.
        neighbour_rate: :math:`\varepsilon_n`, in (0, 1]: how far its neighbours move.
        insert_every: :math:`\lambda`, inputs from one new unit to the next.
        max_age: age that an edge may have, in wins of the units at its ends. On a curve 50 will do; on a surface about
            400 keeps the edges that close its triangles, and a few too many.
        error_share: :math:`\alpha`, in (0, 1]: what is left of an error that a new unit takes a part of.
        decay: :math:`d`, in (0, 1]: what is left of all errors after an input.
        utility: :math:`k`, over 0; None never removes a unit for its utility. A small one forgets faster.
        max_units: most units that there may be, at least 2.
        bounds: range (low, high) in which start codes are drawn, for all dimensions or one pair for each, shape
            (dims, 2); None is the range of the rows where `fit` starts, and 0 to 1 otherwise.
        init: "sample" takes rows as start codes, "uniform" draws them within `bounds`; an array (2, dims) gives
            them. "auto" is "sample" where `fit` starts, and "uniform" where `partial_fit` or `learn_one` do, since they
            know no table.
        epochs: passes of `fit` over the rows, in a new random order each.
        dtype: precision of codes, "float64" or "float32".
        missing: "error" refuses inputs with NaN; "ignore" uses the coordinates that were observed.
        random_state: seed or NumPy Generator of the start codes.

    Example:
        >>> import numpy as np
        >>> angles = np.random.default_rng(0).uniform(0, 2 * np.pi, 10_000)
        >>> ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        >>> gas = GrowingNeuralGas(max_units=30, random_state=0).partial_fit(ring)
        >>> graph = gas.topology_
        >>> graph.units, graph.components, graph.loops
        (30, 1, 1)
    """

    VALUES = ("errors", "utilities")
    FADES = True
    LEAST = 2

    def __init__(
        self,
        learning_rate: float = 0.05,
        neighbour_rate: float = 0.006,
        insert_every: int = 100,
        max_age: int = 50,
        error_share: float = 0.5,
        decay: float = 0.995,
        utility: float | None = None,
        max_units: int = 1000,
        bounds: ArrayLike | None = None,
        init: ArrayLike = "auto",
        dtype: str = "float64",
        missing: str = "error",
        random_state: int | np.random.Generator | None = None,
        epochs: int = 10,
    ) -> None:
        self.learning_rate = learning_rate
        self.neighbour_rate = neighbour_rate
        self.insert_every = insert_every
        self.max_age = max_age
        self.error_share = error_share
        self.decay = decay
        self.utility = utility
        self.max_units = max_units
        self.bounds = bounds
        self.init = init
        self.epochs = epochs
        self.dtype = dtype
        self.missing = missing
        self.random_state = random_state

    def _start_from(self, samples: Array, rng: np.random.Generator) -> dict[str, Array]:
        self._parameters()
        return self._edgeless(first_codes(self.init, self.bounds, 2, samples, rng))

    def _learn_from(self, samples: Array, start: int) -> tuple[int, int]:
        return learn_growing_neural_gas(self._net, self._allows_missing(), samples, start, self._parameters())

    def _parameters(self) -> tuple[Any, ...]:
        return gas_rule(
            self.max_units,
            self.learning_rate,
            self.neighbour_rate,
            self.insert_every,
            self.max_age,
            self.error_share,
            self.decay,
            self.utility,
        )


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


@remembered
def gas_rule(
    max_units: Any,
    learning_rate: Any,
    neighbour_rate: Any,
    insert_every: Any,
    max_age: Any,
    error_share: Any,
    decay: Any,
    utility: Any,
) -> tuple[Any, ...]:
    """The values of a `GasRule`.

    Raises:
        ValueError: if one is not valid.
    """
    check_units("max_units", max_units, least=2)
    for name, count in (("insert_every", insert_every), ("max_age", max_age)):
        check_units(name, count)
    rates = {
        "learning_rate": learning_rate,
        "neighbour_rate": neighbour_rate,
        "error_share": error_share,
        "decay": decay,
    }
    for name, rate in rates.items():
        check_number(name, rate, most=1)
    if utility is not None:
        check_number("utility", utility)
    counts, numbers = (int(insert_every), int(max_age)), (float(error_share), float(decay), float(utility or 0))
    return int(max_units), float(learning_rate), float(neighbour_rate), *counts, *numbers


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
    net: Net, missing: bool, samples: Array, start: int, parameters: tuple[Any, ...]
) -> tuple[int, int]:
    """Learn the samples (n, dims) as `GrowingNeuralGas` states it; see `GraphMap._learn_from`."""
    if start == 0 and not all_usable(samples, missing):
        return -1, -1
    rule, dims, x = GasRule(*parameters), samples.shape[1], np.zeros(net.codes.shape[0], net.codes.dtype)
    winner = -1
    for t in range(start, samples.shape[0]):
        if not room(net, rule.max_units):
            return t, winner
        read_sample(samples, t, x)
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
