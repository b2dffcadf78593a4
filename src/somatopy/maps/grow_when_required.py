"""The map of Marsland, Shapiro and Nehmzow that grows when required."""

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
    drop_older,
    grow_older,
    join,
    move,
    nearest_two,
    neighbour,
    part,
    room,
)
from somatopy.maps.graph_map import GraphMap
from somatopy.maps.kernels import all_usable, read_sample
from somatopy.maps.start import check_number, check_units, remembered

__all__ = ["GrowWhenRequired"]

Array = NDArray[Any]

HABITUATION = 0  # its place in the values


class GrowWhenRequired(GraphMap):
    r"""Grow when required: a unit is added where a trained winner still matches badly, at any time.

    The first two inputs become the first two units. For each further input :math:`v`, with :math:`s` and :math:`t` the
    nearest and the second nearest unit:

    1. an edge of age 0 joins :math:`s` and :math:`t`;
    2. if the activity :math:`a = e^{-\|v - w_s\|}` is under :math:`a_T` and the winner has fired often, its habituation
       :math:`h_s` under :math:`h_T`, a unit is added at :math:`(w_s + v) / 2`. It replaces the edge of :math:`s` and
       :math:`t` by one to each;
    3. otherwise :math:`s` and its neighbours :math:`i` move:

       .. math::
           \Delta w_s = \varepsilon_b h_s (v - w_s) \qquad \Delta w_i = \varepsilon_n h_i (v - w_i)
    4. all edges of :math:`s` grow older by 1;
    5. :math:`s` and its neighbours habituate. The :math:`h` of a unit starts at 1 and follows
       :math:`\tau \dot h = \alpha (1 - h) - S`, by one unit of time an input: after :math:`n` wins it is

       .. math::
           h = 1 - \frac{S}{\alpha} \left(1 - e^{-\alpha n / \tau}\right)

       with :math:`\tau_b` for the winner and the slower :math:`\tau_n` for neighbours;
    6. edges of :math:`s` older than `max_age` are removed, and units that have lost their last edge.

    Two units are always left. Where one is removed, the last one takes its number. Of equals, the first counts. The
    activity has a scale: bring the inputs to a range near 1, or choose :math:`a_T` for theirs.

    Source: S. Marsland, J. Shapiro, U. Nehmzow, A self-organising network that grows when required, Neural Networks
    15(8-9), 2002; steps and defaults as in algorithm 1 of Frontiers in Neurorobotics 9:3, 2015. Both start from two
    units at random inputs.

    Args:
        activity_threshold: :math:`a_T`, in (0, 1]: activity below which an input is new. Its distance is then over
            :math:`-\ln a_T`.
        firing_threshold: :math:`h_T`, in (0, 1]: habituation below which a unit is trained. None is ever trained, and
            none added, where it is not over :math:`1 - S / \alpha`, the least habituation there is.
        learning_rate: :math:`\varepsilon_b`, in (0, 1].
        neighbour_rate: :math:`\varepsilon_n`, in (0, 1].
        max_age: age that an edge may have, in wins of the units at its ends.
        tau: :math:`\tau_b`, over 0, inputs.
        neighbour_tau: :math:`\tau_n`, over 0, inputs.
        alpha: :math:`\alpha`, over 0.
        stimulus: :math:`S`, over 0 and at most :math:`\alpha`.
        max_units: most units that there may be, at least 2.
        epochs: passes of `fit` over the rows, in a new random order each.
        dtype: precision of codes, "float64" or "float32".
        missing: "error" refuses inputs with NaN; "ignore" uses the coordinates that were observed. A new unit takes
            the others from the winner; the first one is 0 there.
        random_state: not used, since nothing is drawn; maps have it.

    Example:
        >>> import numpy as np
        >>> inputs = np.random.default_rng(0).random((5000, 2))
        >>> growing = GrowWhenRequired(activity_threshold=0.9).partial_fit(inputs)
        >>> unit, distance = growing.winner([0.5, 0.5])
        >>> distance < 0.2
        True
    """

    VALUES = ("habituation",)

    def __init__(
        self,
        activity_threshold: float = 0.9,
        firing_threshold: float = 0.1,
        learning_rate: float = 0.1,
        neighbour_rate: float = 0.01,
        max_age: int = 50,
        tau: float = 3.33,
        neighbour_tau: float = 14.3,
        alpha: float = 1.05,
        stimulus: float = 1.0,
        max_units: int = 1000,
        dtype: str = "float64",
        missing: str = "error",
        random_state: int | np.random.Generator | None = None,
        epochs: int = 10,
    ) -> None:
        self.activity_threshold = activity_threshold
        self.firing_threshold = firing_threshold
        self.learning_rate = learning_rate
        self.neighbour_rate = neighbour_rate
        self.max_age = max_age
        self.tau = tau
        self.neighbour_tau = neighbour_tau
        self.alpha = alpha
        self.stimulus = stimulus
        self.max_units = max_units
        self.epochs = epochs
        self.dtype = dtype
        self.missing = missing
        self.random_state = random_state

    def _start_from(self, samples: Array, rng: np.random.Generator) -> dict[str, Array]:
        self._parameters()
        return self._edgeless(np.empty((0, samples.shape[1])))

    def _learn_from(self, samples: Array, start: int) -> tuple[int, int]:
        return learn_grow_when_required(self._net, self._allows_missing(), samples, start, self._parameters())

    def _parameters(self) -> tuple[Any, ...]:
        return required_rule(
            self.max_units,
            self.activity_threshold,
            self.firing_threshold,
            self.learning_rate,
            self.neighbour_rate,
            self.max_age,
            self.tau,
            self.neighbour_tau,
            self.alpha,
            self.stimulus,
        )


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


@remembered
def required_rule(
    max_units: Any,
    activity_threshold: Any,
    firing_threshold: Any,
    learning_rate: Any,
    neighbour_rate: Any,
    max_age: Any,
    tau: Any,
    neighbour_tau: Any,
    alpha: Any,
    stimulus: Any,
) -> tuple[Any, ...]:
    """The values of a `RequiredRule`.

    Raises:
        ValueError: if one is not valid.
    """
    shares = {
        "activity_threshold": activity_threshold,
        "firing_threshold": firing_threshold,
        "learning_rate": learning_rate,
        "neighbour_rate": neighbour_rate,
    }
    for name, share in shares.items():
        check_number(name, share, most=1)
    for name, number in (("tau", tau), ("neighbour_tau", neighbour_tau), ("alpha", alpha)):
        check_number(name, number)
    check_number("stimulus", stimulus, most=alpha)
    check_units("max_age", max_age)
    check_units("max_units", max_units, least=2)
    habituation = float(1 - stimulus / alpha), exp(-alpha / tau), exp(-alpha / neighbour_tau)
    return int(max_units), *map(float, shares.values()), int(max_age), *habituation


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
    net: Net, missing: bool, samples: Array, start: int, parameters: tuple[Any, ...]
) -> tuple[int, int]:
    """Learn the samples (n, dims) as `GrowWhenRequired` states it; see `GraphMap._learn_from`."""
    if start == 0 and not all_usable(samples, missing):
        return -1, -1
    rule, dims, x = RequiredRule(*parameters), samples.shape[1], np.zeros(net.codes.shape[0], net.codes.dtype)
    winner = -1
    for t in range(start, samples.shape[0]):
        if not room(net, rule.max_units):
            return t, winner
        read_sample(samples, t, x)
        winner = _grow_or_move(net, x, dims, rule)
        net.counts[SEEN] += 1
    return samples.shape[0], winner
