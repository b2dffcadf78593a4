"""A run beside its bounds and controls."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from somatopy.analysis.standings import Standing, render_standings, standings


def test_bounds_first_then_the_run_then_controls_by_rate(rich_run: Any) -> None:
    """The order in which a table shows them."""
    assert [s.name for s in standings(rich_run)] == ["ceiling", "reactive bound", "this run", "frozen", "random"]


def test_efficiency_is_rate_by_ceiling(rich_run: Any) -> None:
    """For every one, in every phase; the controls share the run's ceiling."""
    found = standings(rich_run)
    ceiling = found[0].rates
    for standing in found:
        products = [share * limit for share, limit in zip(standing.efficiencies, ceiling, strict=True)]
        assert products == pytest.approx(list(standing.rates))
    assert found[0].efficiencies == (1.0, 1.0) and found[1].efficiencies == pytest.approx((0.9, 0.9))


def test_without_ceiling_and_controls_the_run_stands_alone(make_run: Any) -> None:
    """Rates are there, efficiencies are not; a phase without frames has neither."""
    (own,) = standings(make_run(np.arange(100) % 4 == 0, []))
    assert (own.name, own.eye, own.rates, own.efficiencies) == ("this run", "geometric", (0.25, None), (None, None))


def test_the_text_has_a_row_a_standing_and_says_where_there_is_no_number() -> None:
    """Every name, eye and share stands in the text; what is unknown is n/a."""
    rows = [
        Standing("ceiling", "geometric", (0.5, None), (1.0, None)),
        Standing("random", "fiducial", (0.05, 0.1), (0.1, 0.2)),
    ]
    head, *lines = render_standings(rows, ["intact", "damaged"]).splitlines()
    assert "intact" in head and "damaged" in head
    assert lines[0].split() == ["ceiling", "geometric", "50.0", "%", "100.0", "%", "n/a", "n/a"]
    assert lines[1].split() == ["random", "fiducial", "5.0", "%", "10.0", "%", "10.0", "%", "20.0", "%"]
