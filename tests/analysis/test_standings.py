"""A run beside its bounds and controls."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from somatopy.analysis.runs import load_run
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


def test_each_phase_has_a_bound_of_its_own(make_run: Any) -> None:
    """Half the frames could be seen in the first phase, a quarter in the second: shares are of those."""
    run = make_run(np.arange(100) % 5 == 0, np.arange(100) % 5 == 0)
    phases = [{"rate": rate, "per_window": []} for rate in (0.5, 0.25)]
    reactive = {"rate": 0.3, "ceiling_rate": 0.375, "frames": 200}
    table = {"eye": "geometric", "grid": [97, 29], "every": 10, "rate": 0.375, "phases": phases, "reactive": reactive}
    (run.path / "ceiling.json").write_text(json.dumps(table))
    ceiling, bound, own = standings(load_run(run.path))
    assert (ceiling.rates, ceiling.efficiencies) == ((0.5, 0.25), (1.0, 1.0))
    assert bound.rates == pytest.approx((0.4, 0.2)) and bound.efficiencies == pytest.approx((0.8, 0.8))
    assert own.rates == (0.2, 0.2) and own.efficiencies == pytest.approx((0.4, 0.8))


def test_controls_are_ordered_by_the_first_phase_that_has_frames(make_run: Any) -> None:
    """A phase of no frames before it does not matter, nor does what they score later."""
    share = np.arange(100) % 10
    run = make_run([], share < 4, share < 4)
    for name, first, second in (("a", 1, 9), ("b", 3, 2), ("c", 2, 3)):
        make_run([], share < first, share < second, folder=f"run/controls/{name}")
    assert [found.name for found in standings(load_run(run.path))] == ["this run", "b", "c", "a"]


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
