"""Learning rules: how a link between two maps changes when its two nodes win together."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite, tanh
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from somatopy._jit import jit

__all__ = ["NormalisedHebb", "PositiveHebb", "Rule", "activation"]

Floats = NDArray[np.float64]


def activation(distance: float, slope: float = 1.0) -> float:
    """Activation of a node: 1 / (1 + slope * tanh(distance)), equation 4 of Schillaci, Hafner and Lara (2014).

    Args:
        distance: Euclidean distance of the node's code from its input, from 0 up.
        slope: 1 in the paper; 2 in the library that its first author published in 2016.

    Returns:
        1 on an exact hit, falling to 1 / (1 + slope).

    Raises:
        ValueError: if the distance is negative or NaN.

    Example:
        >>> activation(0.0)
        1.0
    """
    if not distance >= 0:
        raise ValueError(f"distance must be a number from 0 up; got {distance!r}")
    return 1.0 / (1.0 + slope * tanh(distance))


class Rule(Protocol):
    """A learning rule of links. It sees one row of links and what happened, and nothing else.

    Attributes:
        local: whether an update never changes another link than j. Large tables, which keep only links that are not 0,
            then read this link alone after an update, and any other change is lost. `check_rule` tests it.
    """

    local: bool

    def update(self, row: Floats, j: int, activation: float, target: float) -> None:
        """Change a row of links in place, after its node and node j won together.

        Args:
            row: the links of the winner of the first map, shape (n_post,).
            j: the winner of the second map.
            activation: product of the two winners' activations.
            target: how near to the image centre the hand was seen, f_c in [0, 1]; 0 on a miss.
        """
        ...

    def state(self) -> dict[str, NDArray[Any]]:
        """Copies of the arrays that the rule remembers beside the links."""
        ...

    def restore(self, state: Mapping[str, ArrayLike]) -> None:
        """Continue from what `state` returned."""
        ...


@jit
def _add(row: Floats, j: int, increment: float) -> bool:
    if not (0 <= j < row.size and isfinite(increment)):
        return False
    row[j] += increment
    return True


class PositiveHebb:
    """The paper's rule: links only grow, and only when the hand was seen.

    Equation 3 of Schillaci, Hafner and Lara (2014), w_ij += eta * A_i * A_j * f_c: with the product of activations A_i
    * A_j and the target f_c. The target is 0 on a miss, so that a miss changes nothing.

    Args:
        learning_rate: eta, over 0.

    Raises:
        ValueError: if the learning rate is not a finite number over 0.

    Example:
        >>> import numpy as np
        >>> row = np.zeros(3)
        >>> PositiveHebb(learning_rate=0.01).update(row, 1, activation=0.5, target=1.0)
        >>> row
        array([0.   , 0.005, 0.   ])
    """

    local = True

    def __init__(self, learning_rate: float = 0.01) -> None:
        if not (learning_rate > 0 and isfinite(learning_rate)):
            raise ValueError(f"learning_rate must be a finite number over 0; got {learning_rate!r}")
        self.learning_rate = learning_rate

    def update(self, row: Floats, j: int, activation: float, target: float) -> None:
        """Strengthen link j of the row; see `Rule.update`.

        Raises:
            ValueError: if j is not an index of the row, or activation or target is not finite; nothing has changed.
        """
        if not _add(row, j, self.learning_rate * activation * target):
            raise ValueError(
                f"j must be an index from 0 to {len(row) - 1}, activation and target finite; "
                f"got j {j!r}, activation {activation!r}, target {target!r}"
            )

    def state(self) -> dict[str, NDArray[Any]]:
        """An empty dictionary, since this rule remembers nothing beside the links."""
        return {}

    def restore(self, state: Mapping[str, ArrayLike]) -> None:
        """Does nothing; see `state`."""


@jit
def _normalise(row: Floats) -> None:
    total = 0.0
    for link in row:
        total += link
    if total > 0.0:
        for j in range(row.size):
            row[j] /= total


class NormalisedHebb(PositiveHebb):
    """The paper's rule, after which the row is divided by its sum, so that a link fades while others of its row grow.

    This is the rule of the library that the first author of the paper published in 2016, there with `activation(...,
    slope=2)`. A miss leaves a normalised row as it is, except for rounding. A row whose links are all 0 stays as it is.

    Args:
        learning_rate: eta of equation 3, over 0.

    Raises:
        ValueError: if the learning rate is not a finite number over 0.

    Example:
        >>> import numpy as np
        >>> rule, row = NormalisedHebb(learning_rate=0.5), np.zeros(3)
        >>> for j in (0, 1):
        ...     rule.update(row, j, activation=0.5, target=1.0)
        >>> row
        array([0.8, 0.2, 0. ])
    """

    local = False

    def update(self, row: Floats, j: int, activation: float, target: float) -> None:
        """Strengthen link j, then divide the row by its sum; see `PositiveHebb.update`."""
        super().update(row, j, activation, target)
        _normalise(row)
