"""Links from every node of one map to every node of another."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from somatopy._jit import jit
from somatopy.links.rules import Rule

__all__ = ["HebbianLinks"]

Floats = NDArray[np.float64]

U = np.uint64  # unsigned indices spare the compiler Python's meaning of negative ones
BLOCK = U(100)


@jit
def _greatest(row: Floats) -> float:
    """The greatest link; most blocks hold none above the greatest so far, which vectors of links tell at once."""
    greatest, start, size = float(row[0]), U(0), U(row.size)
    while start < size:
        stop, above = min(start + BLOCK, size), np.int64(0)
        for j in range(start, stop):
            above |= np.int64(row[j] > greatest)
        if above:
            for j in range(start, stop):
                greatest = max(greatest, float(row[j]))
        start += BLOCK
    return greatest


@jit
def _strongest(row: Floats, u: float) -> int:
    greatest = _greatest(row)
    ties = 0
    for j in range(U(row.size)):
        ties += int(row[j] == greatest)
    to_skip = int(u * ties)  # under ties: no double below 1 rounds up that far
    node = U(0)
    while to_skip > 0 or row[node] != greatest:
        to_skip -= int(row[node] == greatest)
        node += U(1)
    return int(np.int64(node))


class HebbianLinks:
    """A table of links between two sets of nodes, all 0 at first.

    It knows numbers of nodes, not maps: any two things with winners can be linked.

    Args:
        n_pre: nodes of the first map, at least 1.
        n_post: nodes of the second map, at least 1.
        rule: how a link learns.

    Raises:
        ValueError: if a number of nodes is not a whole number from 1 up.

    Example:
        >>> from somatopy.links import HebbianLinks, PositiveHebb
        >>> links = HebbianLinks(n_pre=2, n_post=3, rule=PositiveHebb(learning_rate=0.01))
        >>> links.update(0, 2, activation=0.5, target=1.0)
        >>> links.row(0)
        array([0.   , 0.   , 0.005])
        >>> links.strongest(0, u=0.7)
        2
    """

    def __init__(self, n_pre: int, n_post: int, rule: Rule) -> None:
        for name, count in (("n_pre", n_pre), ("n_post", n_post)):
            if not (isinstance(count, (int, np.integer)) and count >= 1):
                raise ValueError(f"{name} must be a whole number of nodes, at least 1; got {count!r}")
        self.n_pre = int(n_pre)
        self.n_post = int(n_post)
        self.rule = rule
        self._table = np.zeros((self.n_pre, self.n_post))

    def update(self, i: int, j: int, activation: float, target: float) -> None:
        """Let the rule learn that nodes i and j won together; see `Rule.update`.

        Raises:
            ValueError: if i or j is not a node, or a value is not finite; then nothing has changed.
        """
        if not 0 <= j < self.n_post:
            raise ValueError(f"j must be a node of the second map, 0 to {self.n_post - 1}; got {j!r}")
        self.rule.update(self._row(i), j, activation, target)

    def strongest(self, i: int, u: float) -> int:
        """The node j with the greatest link from node i. Changes nothing.

        Args:
            i: node of the first map.
            u: uniform random number in [0, 1) that chooses among equal greatest links, each with the same chance;
                a row that has learned nothing is a tie of all nodes.

        Raises:
            ValueError: if i is not a node or u is outside [0, 1).
        """
        if not 0 <= u < 1:
            raise ValueError(f"u must be a number in [0, 1); got {u!r}")
        return _strongest(self._row(i), u)

    def row(self, i: int) -> Floats:
        """The links of node i, shape (n_post,): a view that cannot be written and follows what is learned.

        Raises:
            ValueError: if i is not a node.
        """
        row = self._row(i).view()
        row.flags.writeable = False
        return row

    def state(self) -> dict[str, NDArray[Any]]:
        """`links` (n_pre, n_post) and the rule's own arrays, their names led by `rule_` (copies)."""
        remembered = {f"rule_{name}": value for name, value in self.rule.state().items()}
        return {"links": self._table.copy(), **remembered}

    def restore(self, state: Mapping[str, ArrayLike]) -> None:
        """Take over the state of links of the same sizes and rule.

        Raises:
            ValueError: if `links` is missing, has another shape or holds values that are not finite.
        """
        if "links" not in state:
            raise ValueError(f"the state of links lacks 'links'; it has {sorted(state)}")
        table = np.array(state["links"], dtype=np.float64, order="C")
        if table.shape != self._table.shape or not np.isfinite(table).all():
            raise ValueError(f"links must be finite, shape {self._table.shape}; got shape {table.shape}")
        self.rule.restore(
            {name.removeprefix("rule_"): value for name, value in state.items() if name.startswith("rule_")}
        )
        self._table = table

    def _row(self, i: int) -> Floats:
        if not 0 <= i < self.n_pre:
            raise ValueError(f"i must be a node of the first map, 0 to {self.n_pre - 1}; got {i!r}")
        row: Floats = self._table[i]
        return row
