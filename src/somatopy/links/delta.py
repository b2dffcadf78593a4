"""The delta rule for links, which learns from misses as well as from hits."""

from __future__ import annotations

from math import isfinite

from somatopy._jit import jit
from somatopy.links.rules import Floats, PositiveHebb

__all__ = ["DeltaRule"]


@jit
def _approach(row: Floats, j: int, rate: float, target: float) -> bool:
    if not (0 <= j < row.size and isfinite(rate) and isfinite(target)):
        return False
    row[j] += rate * (target - row[j])
    return True


class DeltaRule(PositiveHebb):
    """Moves a link towards its target: t on a hit, 0 on a miss.

    w_ij += eta * A_i * A_j * (t - w_ij), with the product of activations A_i * A_j and the target t: the rule of Widrow
    and Hoff (1960) for one input. It is stable, since activations are at most 1. With t = 1 on a hit and 0 on a miss, a
    link estimates how often the hand is seen from node j while i wins, over about the last 1 / (eta * A_i * A_j) such
    frames. The paper's rule ignores misses, so that a link that was good once stays strong for ever.

    Args:
        learning_rate: eta, over 0 and at most 1. With a larger one, a link would overshoot its target.

    Raises:
        ValueError: if the learning rate is not a number over 0 and up to 1.

    Example:
        >>> import numpy as np
        >>> rule, row = DeltaRule(learning_rate=0.5), np.zeros(3)
        >>> for target in (1.0, 1.0, 0.0):
        ...     rule.update(row, 1, activation=1.0, target=target)
        >>> row
        array([0.   , 0.375, 0.   ])
    """

    def __init__(self, learning_rate: float = 0.3) -> None:
        if not 0 < learning_rate <= 1:
            raise ValueError(f"learning_rate of the delta rule must be over 0 and at most 1; got {learning_rate!r}")
        super().__init__(learning_rate)

    def update(self, row: Floats, j: int, activation: float, target: float) -> None:
        """Move link j of the row towards the target; see `Rule.update`.

        Raises:
            ValueError: if j is not an index of the row, or activation or target is not finite; nothing has changed.
        """
        if not _approach(row, j, self.learning_rate * activation, target):
            raise ValueError(
                f"j must be an index from 0 to {len(row) - 1}, activation and target finite; "
                f"got j {j!r}, activation {activation!r}, target {target!r}"
            )
