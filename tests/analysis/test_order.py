"""Whether maps are ordered: the topographic error of snapshots."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from somatopy.analysis import summarise
from somatopy.analysis.order import Order, by_chance, orders, topographic_error
from somatopy.maps import SOM
from somatopy.maps.quality import topographic_error as of_a_map


def test_it_is_the_error_of_the_map_itself() -> None:
    """The library's measure of a map with these units, on random inputs, ordered units and shuffled ones."""
    rng = np.random.default_rng(0)
    grid = np.stack(np.indices((5, 4)), axis=-1).reshape(-1, 2) / 4
    inputs = rng.random((200, 2))
    for codes in (grid, rng.permutation(grid), grid + rng.normal(0, 0.1, grid.shape)):
        trained = SOM(shape=(5, 4), init=codes).initialise(2)
        assert topographic_error(codes, (5, 4), inputs) == pytest.approx(of_a_map(trained, inputs))


def test_chance_is_the_mean_over_orders() -> None:
    """Units in any order have the error that is expected of them."""
    rng = np.random.default_rng(1)
    grid = np.stack(np.indices((4, 4)), axis=-1).reshape(-1, 2).astype(float)
    errors = [topographic_error(rng.permutation(grid), (4, 4), 3 * rng.random((20, 2))) for _ in range(300)]
    assert np.mean(errors) == pytest.approx(by_chance((4, 4)), abs=0.03)


def test_each_phase_tells_of_its_last_snapshot(rich_run: Any) -> None:
    """After 25 and 45 minutes; the chance maps of the run are not ordered, a map of one unit is not known."""
    found = orders(rich_run, summarise(rich_run))
    assert [when for when, _ in found] == ["after 25 min, phase 1, intact", "after 45 min, phase 2, damaged (offset)"]
    assert {order.side for _, pair in found for order in pair} == {"arm", "head"}
    assert all(order.error is not None and order.error > 0.3 for _, pair in found for order in pair)
    words = [Order("arm", error, 1.0).word for error in (None, 0.1, 0.5, 0.9)]
    assert words == ["not known", "ordered", "ordered in part", "not ordered"]
