"""The evolving self-organising map of Deng and Kasabov."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from somatopy.maps.graph_learning import EvolvingRule, learn_evolving_som
from somatopy.maps.graph_map import GraphMap
from somatopy.maps.start import check_number, check_units

__all__ = ["EvolvingSOM"]


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
    ) -> None:
        self.threshold = threshold
        self.learning_rate = learning_rate
        self.prune_every = prune_every
        self.max_units = max_units
        self.dtype = dtype
        self.missing = missing
        self.random_state = random_state

    def _start(self, dims: int, rng: np.random.Generator) -> dict[str, NDArray[Any]]:
        self._rule()
        return self._edgeless(np.empty((0, dims)))

    def _taught(self, samples: NDArray[Any], start: int) -> tuple[int, int]:
        missing, rule = self._ruled()
        return learn_evolving_som(self._net, self.n_features_in_, missing, samples, start, rule)

    def _rule(self) -> EvolvingRule:
        check_number("threshold", self.threshold)
        check_number("learning_rate", self.learning_rate, most=1)
        for name in ("prune_every", "max_units"):
            check_units(name, getattr(self, name))
        return EvolvingRule(
            int(self.max_units), float(self.threshold), float(self.learning_rate), int(self.prune_every)
        )
