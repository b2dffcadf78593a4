"""Ceiling and reactive bound, as ceiling.json has them."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from somatopy.analysis import summarise
from somatopy.analysis.bounds import (
    ceiling_rates,
    ceiling_shares,
    efficiency,
    reactive_efficiency,
    reactive_rate,
    why_no_ceiling,
)
from somatopy.analysis.runs import RunFolderError
from somatopy.analysis.standings import standings

WINDOWS = st.lists(st.tuples(st.integers(0, 4500), st.floats(0.001, 1)), max_size=40)


@given(WINDOWS)
def test_efficiency_times_ceiling_is_hits(windows: list[tuple[int, float]]) -> None:
    """efficiency * ceiling share * 4,500 = hits, in every window."""
    hits, shares = [hit for hit, _ in windows], [share for _, share in windows]
    for hit, share, found in zip(hits, shares, efficiency(hits, shares), strict=True):
        assert found is not None
        assert found * share * 4500 == pytest.approx(hit)


@given(st.lists(st.integers(0, 4500), max_size=9), st.lists(st.floats(0, 1), max_size=9))
def test_every_window_has_an_entry(hits: list[int], shares: list[float]) -> None:
    """One entry a window of hits, None beyond the ceiling's windows and where it is 0."""
    found = efficiency(hits, shares)
    assert len(found) == len(hits)
    assert [entry is None for entry in found] == [k >= len(shares) or shares[k] == 0 for k in range(len(hits))]


def test_bounds_of_a_run(rich_run: Any) -> None:
    """Rates over all frames and by phase; the reactive bound is relative to the ceiling of its own frames."""
    assert ceiling_rates(rich_run) == (0.5, [0.5, 0.5])
    assert ceiling_shares(rich_run) == [[0.5] * 5, [0.5] * 4]
    assert reactive_rate(rich_run) == 0.45 and reactive_efficiency(rich_run) == pytest.approx(0.9)


def test_without_a_ceiling_nothing_is_said(make_run: Any) -> None:
    """A run folder without ceiling.json has no bounds."""
    run = make_run([True])
    assert ceiling_rates(run) == (None, []) and ceiling_shares(run) is None
    assert reactive_rate(run) is reactive_efficiency(run) is None


def test_a_reactive_bound_without_frames_is_none(rich_copy: Any) -> None:
    """A run too short to be sampled."""
    table = rich_copy.ceiling | {"reactive": {"rate": None, "ceiling_rate": None, "frames": 0}}
    (rich_copy.path / "ceiling.json").write_text(json.dumps(table))
    assert reactive_rate(rich_copy) is reactive_efficiency(rich_copy) is None


def test_a_reactive_bound_may_be_unknown(rich_copy: Any) -> None:
    """A ceiling without a reactive bound is a ceiling."""
    (rich_copy.path / "ceiling.json").write_text(json.dumps(rich_copy.ceiling | {"reactive": None}))
    assert reactive_rate(rich_copy) is reactive_efficiency(rich_copy) is None
    assert ceiling_rates(rich_copy) == (0.5, [0.5, 0.5])
    assert [found.name for found in standings(rich_copy)] == ["ceiling", "this run", "frozen", "random"]


def test_why_there_is_no_ceiling(rich_run: Any, make_run: Any, edited: Any) -> None:
    """One sentence for each reason, and none where there is one."""
    reasons = {
        "the run has not ended": make_run(np.ones(20), recorded=10, part_frames=5, folder="killed"),
        "ceiling.json is missing": make_run(np.ones(20), folder="lost"),
        "the body has no model of itself": edited(make_run(np.ones(20)), ('"mujoco"', '"my_lab.arms:RealArm"')),
    }
    for reason, run in reasons.items():
        told = why_no_ceiling(run, summarise(run))
        assert told.startswith("There is no ceiling") and reason in told and told.count(".") - ("json" in told) == 1
    assert why_no_ceiling(rich_run, summarise(rich_run)) == ""


@pytest.mark.parametrize("table", [{}, {"rate": 0.5}, {"rate": 0.5, "phases": [{}]}, {"rate": 1, "phases": [3]}])
def test_a_broken_ceiling_is_named(rich_copy: Any, table: dict[str, Any]) -> None:
    """The file, what is wrong, and what to do."""
    (rich_copy.path / "ceiling.json").write_text(json.dumps(table))
    with pytest.raises(RunFolderError, match=r"ceiling\.json .*Delete it, and compute the ceiling again"):
        ceiling_shares(rich_copy)
