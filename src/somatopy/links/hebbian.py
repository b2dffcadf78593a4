"""A table of links from every unit, or node, of one map to every node of another."""

from __future__ import annotations

from collections.abc import Mapping
from operator import index
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from somatopy.links.rules import Rule
from somatopy.links.table import DenseTable, new_table

__all__ = ["HebbianLinks"]

Floats = NDArray[np.float64]

ARRAYS = ("link_pre", "link_post", "link_weight")


class HebbianLinks:
    """A table of links between two sets of nodes, all 0 at first.

    The table needs only the numbers of nodes, not the maps, so that any two things with winners can be linked. Up to 8
    million links are kept in one array. A larger table keeps only the links that are not 0, so that its memory grows
    with the links in use.

    Args:
        n_pre: nodes of the first map, at least 1.
        n_post: nodes of the second map, at least 1.
        rule: how a link learns.

    Raises:
        ValueError: if a number of nodes is not a whole number from 1 up, or the rule does not say whether it is local.

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
        if not isinstance(getattr(rule, "local", None), bool):
            raise ValueError(
                f"a rule must say whether it is local; {type(rule).__name__} does not. Set local = True in its class "
                "if an update never changes another link than j, local = False if it may"
            )
        self.n_pre = int(n_pre)
        self.n_post = int(n_post)
        self.rule = rule
        self._table = new_table(self.n_pre, self.n_post)

    def update(self, i: int, j: int, activation: float, target: float) -> None:
        """Let the rule update the links after nodes i and j have won together; see `Rule.update`.

        Raises:
            ValueError: if i or j is not a node, or a value is not finite; then nothing has changed.
        """
        pre, post = _node("i", i, "first", self.n_pre), _node("j", j, "second", self.n_post)
        self._table.update(self.rule, pre, post, activation, target)

    def strongest(self, i: int, u: float) -> int:
        """The node j with the greatest link from node i. Changes nothing.

        Args:
            i: node of the first map.
            u: uniform random number in [0, 1). If several links are equally great, it chooses among them with equal
                chances. In a row that has learned nothing, all links are equal.

        Raises:
            ValueError: if i is not a node or u is outside [0, 1).
        """
        if not 0 <= u < 1:
            raise ValueError(f"u must be a number in [0, 1); got {u!r}")
        return self._table.strongest(_node("i", i, "first", self.n_pre), u)

    def row(self, i: int) -> Floats:
        """The links of node i, shape (n_post,), read-only. Later learning may change them: copy what must stay.

        Raises:
            ValueError: if i is not a node.
        """
        row = self._table.row(_node("i", i, "first", self.n_pre)).view()
        row.flags.writeable = False
        return row

    @property
    def whole(self) -> Floats | None:
        """The table's own array of all links, shape (n_pre, n_post), for kernels; None if there is none."""
        return self._table.links if isinstance(self._table, DenseTable) else None

    def used(self) -> tuple[NDArray[np.int32], NDArray[np.int32], Floats]:
        """The links that are not 0, sorted by i and j, as arrays of i, j and values, each of shape (links,)."""
        return self._table.used()

    def state(self) -> dict[str, NDArray[Any]]:
        """The arrays of `used`, as `link_pre`, `link_post` and `link_weight`, and the rule's arrays as `rule_...`."""
        remembered = {f"rule_{name}": value for name, value in self.rule.state().items()}
        return {**dict(zip(ARRAYS, self.used(), strict=True)), **remembered}

    def restore(self, state: Mapping[str, ArrayLike]) -> None:
        """Take over the state of links of the same sizes and rule.

        Raises:
            ValueError: if an array is missing, or the links do not fit these sizes. Then nothing has changed.
        """
        if missing := [name for name in ARRAYS if name not in state]:
            raise ValueError(f"the state of links lacks {missing}; it has {sorted(state)}")
        pre, post, weight = (np.asarray(state[name]) for name in ARRAYS)
        self._check_links(pre, post, weight)
        table = new_table(self.n_pre, self.n_post)
        table.fill(pre, post, weight.astype(np.float64))
        self.rule.restore(
            {name.removeprefix("rule_"): value for name, value in state.items() if name.startswith("rule_")}
        )
        self._table = table

    def _check_links(self, pre: NDArray[Any], post: NDArray[Any], weight: NDArray[Any]) -> None:
        if not (pre.ndim == 1 and pre.shape == post.shape == weight.shape):
            shapes = ", ".join(f"{name} {array.shape}" for name, array in zip(ARRAYS, (pre, post, weight), strict=True))
            raise ValueError(f"the arrays of links must have one axis and one length; got {shapes}")
        for name, nodes, count in (("link_pre", pre, self.n_pre), ("link_post", post, self.n_post)):
            if nodes.dtype.kind not in "iu":
                raise ValueError(f"{name} must hold whole numbers, the nodes; got {nodes.dtype}")
            if wrong := nodes[(nodes < 0) | (nodes >= count)].tolist():
                raise ValueError(f"{name} must hold nodes, 0 to {count - 1}; got {wrong[0]!r}")
        if weight.dtype.kind not in "fiu" or not np.isfinite(weight).all():
            raise ValueError(f"link_weight must be finite numbers; got {weight.dtype}, or a value that is not finite")
        if (np.diff(pre.astype(np.int64) * self.n_post + post) <= 0).any():
            raise ValueError("links must be in the order of link_pre, then link_post, each link once; they are not")


def _node(name: str, node: Any, which: str, count: int) -> int:
    """A node as an int, once it is known to be one."""
    if type(node) is int and 0 <= node < count:
        return node
    try:
        number = index(node)
    except TypeError:
        number = -1
    if not 0 <= number < count:
        raise ValueError(f"{name} must be a node of the {which} map, 0 to {count - 1}; got {node!r}")
    return number
