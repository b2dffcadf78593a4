"""Storage of links: one array for a small table; for a large one only the links that are not 0."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from somatopy._jit import jit
from somatopy.links.rules import Rule

__all__ = ["DenseTable", "SparseTable", "Table", "new_table", "strongest_link"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int32]

MOST_DENSE = 8_000_000  # links, 64 MB: up to two maps of 53x53 units

U = np.uint64  # unsigned indices spare the compiler Python's meaning of negative ones
BLOCK = U(100)


class Table(Protocol):
    """Storage of links between nodes, all 0 at first. Callers have checked indices, and that u lies in [0, 1)."""

    def update(self, rule: Rule, i: int, j: int, activation: float, target: float) -> None:
        """Let the rule change row i."""
        ...

    def strongest(self, i: int, u: float) -> int:
        """The node with the greatest link from i; of several, in their order, the one at the share u."""
        ...

    def row(self, i: int) -> Floats:
        """Row i, which may be the table's own."""
        ...

    def used(self) -> tuple[Integers, Integers, Floats]:
        """The links that are not 0, by i and then j: their i, their j, their values."""
        ...

    def fill(self, pre: NDArray[Any], post: NDArray[Any], weight: Floats) -> None:
        """Set links of an empty table, given as `used` gives them."""
        ...


def new_table(n_pre: int, n_post: int) -> Table:
    """An empty table of the kind that suits its size."""
    return DenseTable(n_pre, n_post) if n_pre * n_post <= MOST_DENSE else SparseTable(n_pre, n_post)


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
def _ties(row: Floats, start: Any, greatest: float) -> int:
    """How many links of the block from `start` on are the greatest."""
    ties = 0
    for j in range(start, min(start + BLOCK, U(row.size))):
        ties += int(row[j] == greatest)
    return ties


@jit
def strongest_link(links: Floats, i: int, u: float) -> int:
    """The node with the greatest link from i; of several, in their order, the one at the share u in [0, 1)."""
    row = links[i]
    greatest, size, ties = _greatest(row), U(row.size), 0
    for start in range(U(0), size, BLOCK):
        ties += _ties(row, start, greatest)
    to_skip = int(u * ties)  # under ties: no double below 1 rounds up that far
    node = U(0)
    while True:
        ties = _ties(row, node, greatest)
        if ties > to_skip:
            break
        to_skip -= ties
        node += BLOCK
    while to_skip > 0 or row[node] != greatest:
        to_skip -= int(row[node] == greatest)
        node += U(1)
    return int(np.int64(node))


class DenseTable:
    """A table that stores all links in one array.

    Attributes:
        links: the links, shape (n_pre, n_post).
    """

    def __init__(self, n_pre: int, n_post: int) -> None:
        self.links = np.zeros((n_pre, n_post))

    def update(self, rule: Rule, i: int, j: int, activation: float, target: float) -> None:
        """Let the rule change row i."""
        rule.update(self.links[i], j, activation, target)

    def strongest(self, i: int, u: float) -> int:
        """The node with the greatest link from i; of several, in their order, the one at the share u."""
        return strongest_link(self.links, i, u)

    def row(self, i: int) -> Floats:
        """Row i, the table's own."""
        row: Floats = self.links[i]
        return row

    def used(self) -> tuple[Integers, Integers, Floats]:
        """The links that are not 0."""
        pre, post = np.nonzero(self.links != 0.0)  # of truths, which takes a third of the time
        return pre.astype(np.int32), post.astype(np.int32), self.links[pre, post]

    def fill(self, pre: NDArray[Any], post: NDArray[Any], weight: Floats) -> None:
        """Set links of an empty table."""
        self.links[pre, post] = weight


NO_LINKS = np.empty(0, np.int32), np.empty(0)


def _inserted(values: NDArray[Any], at: int, value: float) -> NDArray[Any]:
    """What `np.insert` gives, sooner."""
    longer = np.empty(values.size + 1, values.dtype)
    longer[:at], longer[at], longer[at + 1 :] = values[:at], value, values[at:]
    return longer


class SparseTable:
    """A table that stores only the links that are not 0: for each row, their nodes in order, and their values.

    A rule sees a whole row of n_post links, in an array that all rows share. After the update of a local rule the table
    reads only the link that was named; after that of another rule, the whole row.
    """

    def __init__(self, n_pre: int, n_post: int) -> None:
        self._n_pre, self._n_post = n_pre, n_post
        self._rows: dict[int, tuple[Integers, Floats]] = {}
        self._whole = np.zeros(n_post)

    def update(self, rule: Rule, i: int, j: int, activation: float, target: float) -> None:
        """Let the rule change row i, unless it refuses."""
        local, row = rule.local, self._whole
        nodes, links = self._rows.get(i, NO_LINKS)
        row[nodes] = links
        try:
            rule.update(row, j, activation, target)
            if local:
                self._keep(i, j, row[j])
            else:
                found = np.flatnonzero(row)
                self._rows[i] = found.astype(np.int32), row[found]
        finally:
            if local:
                row[nodes] = row[j] = 0.0
            else:
                row[:] = 0.0

    def _keep(self, i: int, j: int, link: float) -> None:
        """Make link j of row i what it is now."""
        nodes, links = self._rows.get(i, NO_LINKS)
        at = int(nodes.searchsorted(j))
        if at < nodes.size and nodes[at] == j:
            links[at] = link  # a link that has come back to 0 stays until the state is next restored
        elif link != 0.0:
            self._rows[i] = _inserted(nodes, at, j), _inserted(links, at, link)

    def strongest(self, i: int, u: float) -> int:
        """The node with the greatest link from i; of several, in their order, the one at the share u."""
        nodes, links = self._rows.get(i, NO_LINKS)
        greatest = links.max(initial=-np.inf if nodes.size == self._n_post else 0.0)
        if greatest == 0.0:
            return self._zero(nodes[links != 0.0], u)
        ties = nodes[links == greatest]
        return int(ties[int(u * ties.size)])

    def _zero(self, others: Integers, u: float) -> int:
        """Of all nodes but `others`, in their order, the one at the share u."""
        place = int(u * (self._n_post - others.size))
        before = others - np.arange(others.size)  # how many of the nodes sought lie before each of the others
        return place + int(before.searchsorted(place, side="right"))

    def row(self, i: int) -> Floats:
        """A copy of row i."""
        nodes, links = self._rows.get(i, NO_LINKS)
        row = np.zeros(self._n_post)
        row[nodes] = links
        return row

    def used(self) -> tuple[Integers, Integers, Floats]:
        """The links that are not 0."""
        known = sorted(self._rows)
        rows = [self._rows[i] for i in known]
        pre = np.repeat(np.array(known, np.int32), [nodes.size for nodes, _ in rows])
        post = np.concatenate([NO_LINKS[0], *(nodes for nodes, _ in rows)])
        weight = np.concatenate([NO_LINKS[1], *(links for _, links in rows)])
        some = weight != 0.0
        return pre[some], post[some], weight[some]

    def fill(self, pre: NDArray[Any], post: NDArray[Any], weight: Floats) -> None:
        """Set links of an empty table."""
        known, first = np.unique(pre, return_index=True)
        ends = np.searchsorted(pre, known, side="right")
        for i, start, stop in zip(known.tolist(), first, ends, strict=True):
            self._rows[i] = post[start:stop].astype(np.int32), weight[start:stop].copy()
