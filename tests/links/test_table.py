"""Both kinds of table against a plain array: rows, read-outs, ties and what is left of them in memory."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from somatopy.links import NormalisedHebb, PositiveHebb
from somatopy.links.table import MOST_DENSE, DenseTable, SparseTable, Table, new_table

KINDS = pytest.mark.parametrize("kind", [DenseTable, SparseTable])
SHARES = st.floats(0, 1, exclude_max=True)
ROWS = st.integers(1, 12).flatmap(
    lambda size: st.lists(st.lists(st.integers(-2, 2), min_size=size, max_size=size), min_size=1, max_size=5)
)


class Adding(PositiveHebb):
    """Adds the target, so that links fall, and come back to 0, too."""

    local = True

    def update(self, row: Any, j: int, activation: float, target: float) -> None:
        row[j] += target


class Centring(Adding):
    """Changes each link of the row, those that are 0 not least."""

    local = False

    def update(self, row: Any, j: int, activation: float, target: float) -> None:
        row[j] += target
        row -= round(row.mean())


def filled(kind: Callable[[int, int], Table], rows: list[list[int]]) -> Table:
    dense = np.array(rows, dtype=float)
    table, (pre, post) = kind(*dense.shape), np.nonzero(dense)
    table.fill(pre, post, dense[pre, post])
    return table


def rows_of(table: Table, count: int) -> np.ndarray:
    return np.array([table.row(i) for i in range(count)])


@KINDS
@given(rows=ROWS, u=SHARES)
def test_the_strongest_is_the_tie_of_that_share(kind: Any, rows: list[list[int]], u: float) -> None:
    """Of the nodes whose links equal the maximum of the row, in order: number floor(u * ties). A 0 is a link too."""
    table = filled(kind, rows)
    for i, row in enumerate(rows):
        ties = np.flatnonzero(np.array(row) == max(row))
        assert table.strongest(i, u) == ties[int(u * ties.size)]


@KINDS
@pytest.mark.parametrize("rule", [Adding(), Centring()])
@given(happened=st.lists(st.tuples(st.integers(0, 2), st.integers(0, 6), st.integers(-2, 2)), max_size=40), u=SHARES)
def test_updates_are_those_of_an_array(kind: Any, rule: Adding, happened: list[tuple[int, int, int]], u: float) -> None:
    """After each update: the same rows, the same strongest link; local rules and others, links that go back to 0."""
    table, dense = kind(3, 7), np.zeros((3, 7))
    for i, j, target in happened:
        table.update(rule, i, j, 1.0, target)
        rule.update(dense[i], j, 1.0, target)
        np.testing.assert_array_equal(rows_of(table, 3), dense)
        ties = np.flatnonzero(dense[i] == dense[i].max())
        assert table.strongest(i, u) == ties[int(u * ties.size)]
    pre, post, weight = table.used()
    np.testing.assert_array_equal(np.column_stack(np.nonzero(dense)), np.column_stack([pre, post]))
    np.testing.assert_array_equal(weight, dense[dense != 0])


@KINDS
@given(rows=ROWS)
def test_what_is_used_fills_another_table(kind: Any, rows: list[list[int]]) -> None:
    """used and fill: the same rows, of which no link is 0, in arrays that are not the table's own."""
    table, other = filled(kind, rows), kind(len(rows), len(rows[0]))
    used = table.used()
    other.fill(*used)
    for values in used:
        values[:] = 1
    np.testing.assert_array_equal(rows_of(other, len(rows)), rows)
    np.testing.assert_array_equal(rows_of(table, len(rows)), rows)


@KINDS
def test_a_rule_that_refuses_leaves_the_table(kind: Any) -> None:
    """After an error of the rule no row has anything of the update, nor of another row."""
    table = filled(kind, [[0, 3, 0], [2, 0, 0]])
    for rule in (PositiveHebb(), NormalisedHebb()):
        with pytest.raises(ValueError, match="finite"):
            table.update(rule, 0, 1, np.nan, 1.0)
    table.update(PositiveHebb(1.0), 1, 2, 1.0, 1.0)
    np.testing.assert_array_equal(rows_of(table, 2), [[0, 3, 0], [2, 0, 1]])


@KINDS
def test_a_rule_may_have_its_update_anywhere(kind: Any) -> None:
    """On the object itself, as what it says about it, or on an object of no class of its own."""

    def fill(row: Any, j: int, activation: float, target: float) -> None:
        row[:] = activation

    changed = PositiveHebb()
    changed.update, changed.local = fill, False  # type: ignore[method-assign]
    for rule in (changed, SimpleNamespace(local=False, update=fill, state=dict, restore=lambda state: None)):
        table = filled(kind, [[0, 3, 0], [2, 0, 0]])
        table.update(rule, 0, 1, 0.5, 1.0)  # type: ignore[arg-type]
        np.testing.assert_array_equal(rows_of(table, 2), [[0.5, 0.5, 0.5], [2, 0, 0]])


def test_small_tables_are_arrays_and_large_ones_are_not() -> None:
    """Two maps of 30x30 units have the table that reads out fastest, two of 300x300 the one that fits."""
    assert isinstance(new_table(900, 900), DenseTable)
    assert isinstance(new_table(1, MOST_DENSE), DenseTable)
    assert isinstance(new_table(1, MOST_DENSE + 1), SparseTable)


@pytest.mark.parametrize("target", [1.0, 0.0])
def test_memory_grows_with_the_links_in_use(target: float) -> None:
    """Two maps of 300x300 units: a kilobyte for each link at most, and none for misses, beside a row of scratch."""
    rng, rule = np.random.default_rng(0), PositiveHebb()
    pairs = rng.integers(0, 90_000, (5000, 2)).tolist()
    table = new_table(90_000, 90_000)
    table.update(rule, 0, 0, 1.0, 0.0)
    tracemalloc.start()
    for i, j in pairs:
        table.update(rule, i, j, 1.0, target)
    taken, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert taken < (5000 * 1000 if target else 10_000)
