"""The table of links, its read-out and its ties."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import ArrayLike, NDArray

from somatopy.contract import same
from somatopy.links import HebbianLinks, NormalisedHebb, PositiveHebb, activation

GOLDEN = np.load(Path(__file__).parents[1] / "data" / "hebbian_schillaci2016.npz")


def linked(row: ArrayLike) -> HebbianLinks:
    """Links of one node with the given row."""
    table = np.atleast_2d(np.asarray(row, dtype=float))
    links, (pre, post) = HebbianLinks(*table.shape, PositiveHebb()), np.nonzero(table)
    links.restore({"link_pre": pre, "link_post": post, "link_weight": table[pre, post]})
    return links


def table_of(links: HebbianLinks) -> NDArray[np.float64]:
    """All rows."""
    return np.array([links.row(i) for i in range(links.n_pre)])


@pytest.mark.parametrize(("rule", "name"), [(PositiveHebb, "links"), (NormalisedHebb, "links_row_normalised")])
@pytest.mark.parametrize("nodes", [64, 3000])
def test_agrees_with_the_first_authors_program(rule: type[PositiveHebb], name: str, nodes: int) -> None:
    """300 recorded updates end at the recorded table, to that program's single precision, in a large table too."""
    links = HebbianLinks(nodes, nodes, rule(float(GOLDEN["learning_rate"])))
    names = ("pre_winners", "post_winners", "pre_distances", "post_distances", "factors")
    for i, j, d_i, d_j, factor in zip(*(GOLDEN[name].tolist() for name in names), strict=True):
        links.update(i, j, activation(d_i, slope=2.0) * activation(d_j, slope=2.0), factor)
    np.testing.assert_allclose([links.row(i)[:64] for i in range(64)], GOLDEN[name], rtol=0, atol=1e-6)


def test_links_start_at_zero() -> None:
    """Nothing is linked before anything is learned."""
    assert not table_of(HebbianLinks(3, 5, PositiveHebb())).any()


def test_a_rule_that_does_not_say_whether_it_is_local_is_refused() -> None:
    """The error names its class and what to set, before there is a table."""

    class Silent(PositiveHebb):
        local: Any = None

    with pytest.raises(ValueError, match=r"a rule must say whether it is local; Silent does not\. Set local = True in"):
        HebbianLinks(2, 2, Silent())


def test_an_update_changes_one_link() -> None:
    """Only the link between the two winners grows."""
    links = HebbianLinks(3, 5, PositiveHebb(0.5))
    links.update(1, 4, activation=0.5, target=1.0)
    expected = np.zeros((3, 5))
    expected[1, 4] = 0.25
    np.testing.assert_array_equal(table_of(links), expected)


@given(st.lists(st.integers(-2, 2), min_size=1, max_size=300), st.floats(0, 1, exclude_max=True))
def test_strongest_is_a_greatest_link(row: list[int], u: float) -> None:
    """Whatever u, the chosen link is the greatest of its row: the tie's member number floor(u * ties)."""
    ties = np.flatnonzero(np.array(row) == max(row))
    assert linked(row).strongest(0, u) == ties[int(u * len(ties))]


@pytest.mark.parametrize("size", [1, 7, 900])
def test_ties_are_broken_uniformly(size: int) -> None:
    """A sweep of u over [0, 1) hits every greatest link equally often: here 4 times, with all nodes tied."""
    links = HebbianLinks(1, size, PositiveHebb())
    chosen = [links.strongest(0, (k + 0.5) / (4 * size)) for k in range(4 * size)]
    np.testing.assert_array_equal(np.bincount(chosen, minlength=size), 4)


def test_ties_far_apart_share_equally() -> None:
    """Ties are found wherever they lie in the row, and only they are chosen."""
    row = np.random.default_rng(0).random(900)
    row[[0, 437, 899]] = 2.0
    links = linked(row)
    chosen = [links.strongest(0, (k + 0.5) / 300) for k in range(300)]
    assert {j: chosen.count(j) for j in set(chosen)} == {0: 100, 437: 100, 899: 100}


@pytest.mark.parametrize("size", [1, 2, 511, 512, 513, 900])
def test_the_largest_u_stays_in_the_row(size: int) -> None:
    """The largest double under 1 chooses the last of the ties, never a node behind them."""
    assert HebbianLinks(1, size, PositiveHebb()).strongest(0, float(np.nextafter(1, 0))) == size - 1


def test_choosing_changes_nothing() -> None:
    """strongest is pure: the same row and u give the same node."""
    links = linked([[1.0, 1.0, 0.0]])
    before = links.state()
    assert links.strongest(0, 0.9) == links.strongest(0, 0.9) == 1
    assert same(links.state(), before)


@pytest.mark.parametrize("nodes", [3, 3000])
def test_row_cannot_be_written(nodes: int) -> None:
    """A caller sees the links of a node, as learned so far, but cannot change any."""
    links = HebbianLinks(nodes, nodes, PositiveHebb(1.0))
    links.update(1, 2, 1.0, 1.0)
    row = links.row(1)
    assert row.shape == (nodes,) and row[2] == row.sum() == 1.0
    with pytest.raises(ValueError, match="read-only"):
        row[0] = 5.0


class Counting(PositiveHebb):
    """A rule with a memory of its own."""

    def __init__(self) -> None:
        super().__init__()
        self.updates = 0

    def update(self, row: NDArray[np.float64], j: int, activation: float, target: float) -> None:
        super().update(row, j, activation, target)
        self.updates += 1

    def state(self) -> dict[str, NDArray[Any]]:
        return {"updates": np.array(self.updates)}

    def restore(self, state: Mapping[str, ArrayLike]) -> None:
        self.updates = int(np.asarray(state["updates"]))


@pytest.mark.parametrize("nodes", [2, 3000])
def test_restored_links_learn_on(nodes: int) -> None:
    """Links and the rule's memory come back, as copies, and learning goes on alike."""
    original, restored = HebbianLinks(nodes, nodes, Counting()), HebbianLinks(nodes, nodes, Counting())
    original.update(0, 1, 0.5, 0.5)
    state = original.state()
    restored.restore(state)
    state["link_weight"][:] = 9.0
    for links in (original, restored):
        links.update(0, 1, 0.5, 0.5)
        links.update(1, 1, 0.5, 0.5)
    assert same(original.state(), restored.state())
    assert restored.state()["rule_updates"] == 3


@pytest.mark.parametrize("index", [-1, 3])
def test_bad_indices_are_named(index: int) -> None:
    """Which map's node, its value and the valid range: and nothing has changed."""
    links = HebbianLinks(3, 3, PositiveHebb())
    for act in (
        lambda: links.update(index, 0, 1.0, 1.0),
        lambda: links.strongest(index, 0.5),
        lambda: links.row(index),
    ):
        with pytest.raises(ValueError, match=f"i must be a node of the first map, 0 to 2; got {index}"):
            act()
    with pytest.raises(ValueError, match=f"j must be a node of the second map, 0 to 2; got {index}"):
        links.update(0, index, 1.0, 1.0)
    assert not table_of(links).any()


@pytest.mark.parametrize("u", [-0.1, 1.0, float("nan")])
def test_bad_random_numbers_are_named(u: float) -> None:
    """u must come from [0, 1)."""
    with pytest.raises(ValueError, match=r"u must be a number in \[0, 1\); got"):
        HebbianLinks(1, 2, PositiveHebb()).strongest(0, u)


@pytest.mark.parametrize("count", [0, -3, 2.5, "4"])
def test_bad_sizes_are_named(count: Any) -> None:
    """Sizes are whole numbers from 1 up."""
    with pytest.raises(ValueError, match="n_pre must be a whole number of nodes, at least 1; got"):
        HebbianLinks(count, 3, PositiveHebb())
    with pytest.raises(ValueError, match="n_post must be"):
        HebbianLinks(3, count, PositiveHebb())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"link_pre": [0]}, r"one axis and one length; got link_pre \(1,\), link_post \(2,\)"),
        ({"link_pre": [0, 2]}, "link_pre must hold nodes, 0 to 1; got 2"),
        ({"link_post": [-1, 1]}, "link_post must hold nodes, 0 to 1; got -1"),
        ({"link_post": [0.5, 1]}, "link_post must hold whole numbers"),
        ({"link_weight": [1.0, np.nan]}, "link_weight must be finite"),
        ({"link_pre": [0, 0], "link_post": [1, 1]}, "in the order of link_pre, then link_post, each link once"),
        ({"link_pre": [1, 0]}, "in the order of link_pre"),
    ],
)
def test_bad_states_are_refused(change: dict[str, Any], message: str) -> None:
    """A state that does not fit is named, and leaves the links and the rule's memory as they were."""
    links = HebbianLinks(2, 2, Counting())
    links.update(0, 0, 1.0, 1.0)
    before = links.state()
    good: dict[str, Any] = {"link_pre": [0, 1], "link_post": [0, 1], "link_weight": [1.0, 2.0], "rule_updates": 7}
    with pytest.raises(ValueError, match=message):
        links.restore({name: np.array(value) for name, value in (good | change).items()})
    with pytest.raises(ValueError, match=r"lacks \['link_post'\]; it has"):
        links.restore({name: np.array(value) for name, value in good.items() if name != "link_post"})
    assert same(links.state(), before)


@pytest.mark.parametrize("nodes", [3, 3000])
@pytest.mark.parametrize("node", [1.0, "1", None, -1, 3000, [1]])
def test_what_is_no_node_is_refused_by_name(nodes: int, node: Any) -> None:
    """Nodes are whole numbers, in small tables and in large ones."""
    links = HebbianLinks(nodes, nodes, PositiveHebb())
    for call in (links.row, lambda i: links.strongest(i, 0.5), lambda i: links.update(i, 0, 0.5, 1.0)):
        with pytest.raises(ValueError, match=rf"i must be a node of the first map, 0 to {nodes - 1}; got "):
            call(node)
    with pytest.raises(ValueError, match=rf"j must be a node of the second map, 0 to {nodes - 1}; got "):
        links.update(0, node, 0.5, 1.0)
    assert not links.used()[0].size


@pytest.mark.parametrize("weight", [["heavy"], [1j], [None], [np.nan]])
def test_links_that_are_no_numbers_are_refused(weight: list[Any]) -> None:
    """Text, complex numbers and objects are no links."""
    with pytest.raises(ValueError, match="link_weight must be finite numbers"):
        HebbianLinks(3, 3, PositiveHebb()).restore({"link_pre": [0], "link_post": [1], "link_weight": weight})
