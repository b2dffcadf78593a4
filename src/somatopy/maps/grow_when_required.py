"""The map of Marsland, Shapiro and Nehmzow that grows when required."""

from __future__ import annotations

from math import exp
from typing import Any

import numpy as np
from numpy.typing import NDArray

from somatopy.maps.graph_learning import RequiredRule, learn_grow_when_required
from somatopy.maps.graph_map import GraphMap
from somatopy.maps.start import check_number, check_units

__all__ = ["GrowWhenRequired"]


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
        self.dtype = dtype
        self.missing = missing
        self.random_state = random_state

    def _start(self, dims: int, rng: np.random.Generator) -> dict[str, NDArray[Any]]:
        self._rule()
        return self._edgeless(np.empty((0, dims)))

    def _taught(self, samples: NDArray[Any], start: int) -> tuple[int, int]:
        missing, rule = self._ruled()
        return learn_grow_when_required(self._net, self.n_features_in_, missing, samples, start, rule)

    def _rule(self) -> RequiredRule:
        for name in ("activity_threshold", "firing_threshold", "learning_rate", "neighbour_rate"):
            check_number(name, getattr(self, name), most=1)
        for name in ("tau", "neighbour_tau", "alpha"):
            check_number(name, getattr(self, name))
        check_number("stimulus", self.stimulus, most=self.alpha)
        check_units("max_age", self.max_age)
        check_units("max_units", self.max_units, least=2)
        return RequiredRule(
            int(self.max_units),
            float(self.activity_threshold),
            float(self.firing_threshold),
            float(self.learning_rate),
            float(self.neighbour_rate),
            int(self.max_age),
            float(1 - self.stimulus / self.alpha),
            exp(-self.alpha / self.tau),
            exp(-self.alpha / self.neighbour_tau),
        )
