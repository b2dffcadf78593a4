"""Graphs: hops, parts and loops, and edges that are none."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from somatopy.maps.graph import Graph


@st.composite
def graphs(draw: st.DrawFn) -> Graph:
    units = draw(st.integers(1, 9))
    pairs = list(combinations(range(units), 2))
    return Graph(units, np.array([pair for pair in pairs if draw(st.booleans())], dtype=np.int64).reshape(-1, 2))


@given(graphs())
def test_hops_are_a_metric_that_edges_make(graph: Graph) -> None:
    """Distances are 0 to oneself alone, 1 along edges alone, symmetric, keep the triangle; parts have no way across."""
    apart = np.stack([graph.distances(unit) for unit in range(graph.units)])
    joined = np.zeros((graph.units, graph.units), dtype=bool)
    joined[graph.edges[:, 0], graph.edges[:, 1]] = True
    joined |= joined.T
    np.testing.assert_array_equal(apart == 0, np.eye(graph.units, dtype=bool))
    np.testing.assert_array_equal(apart == 1, joined)
    np.testing.assert_array_equal(apart, apart.T)
    assert (apart[:, None] <= apart[:, :, None] + apart[None]).all()
    assert graph.components == len({row.tobytes() for row in np.isfinite(apart)})
    a, b = np.indices(joined.shape)
    np.testing.assert_array_equal(graph.adjacent(a, b), joined)


@given(graphs())
def test_removing_an_edge_opens_a_loop_or_parts_the_graph(graph: Graph) -> None:
    """Each edge less is one loop less or one part more; without edges there are no loops."""
    for kept in range(len(graph.edges), 0, -1):
        before, after = Graph(graph.units, graph.edges[:kept]), Graph(graph.units, graph.edges[: kept - 1])
        assert (before.loops - after.loops) + (after.components - before.components) == 1
        assert after.components - before.components in (0, 1)
    assert Graph(graph.units, []).loops == 0


@pytest.mark.parametrize(
    ("edges", "message"),
    [
        ([[0, 1, 2]], r"edges must be pairs of units, shape \(edges, 2\); got shape \(1, 3\)"),
        ([[0, 3]], r"an edge joins two of 3 units, the lower number first, from 0; got \[0, 3\]"),
        ([[1, 0]], r"got \[1, 0\]"),
        ([[1, 1]], r"got \[1, 1\]"),
        ([[-1, 1]], r"got \[-1, 1\]"),
        ([[0, 1], [0, 1]], "each pair of units has at most one edge"),
        ([[0.4, 1.9]], "edges must be pairs of whole numbers, the units; got float64"),
    ],
)
def test_edges_that_are_none_are_refused(edges: list[list[int]], message: str) -> None:
    """The error shows the first edge that is wrong."""
    with pytest.raises(ValueError, match=message):
        Graph(3, edges)


def test_units_that_are_none_are_refused() -> None:
    """Neither fewer than none, nor neighbours of units that there are not."""
    with pytest.raises(ValueError, match="units must be a whole number, at least 0; got -1"):
        Graph(-1, [])
    for pair in ((0, 7), (-1, 0)):
        with pytest.raises(IndexError, match="units are 0 to 4; got "):
            Graph(5, [(1, 2)]).adjacent(*pair)
