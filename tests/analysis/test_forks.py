"""Damaged rows beside their undamaged forks: shares that are put in come out, and only siblings are compared."""

from __future__ import annotations

import pytest
from tests.analysis.damaged_rows import FACTORS, row, study

from somatopy.analysis.forks import AGAINST_FORK, against_forks, forks

NAMES = [column.name for column in AGAINST_FORK]


def test_a_fork_differs_in_nothing_but_the_damage() -> None:
    """Not in the learner, and not in any other factor; without one that is undamaged there is none."""
    assert forks(study([], FACTORS)) == {"a, gain": "a, none", "b, gain": "b, none"}
    others = {"slow": {"speed": 1, "damage": "gain"}, "fast": {"speed": 2, "damage": "none"}, "plain": {}}
    assert forks(study([], others)) == {}


def test_shares_of_the_fork() -> None:
    """In windows 1, 2, 3, and pooled over 4 to 6; another ceiling of an altered body does not count."""
    own = [0.2] * 5 + [0.4] * 5 + [0.6] * 5 + [0.7, 0.6, 0.8, 0.7, 0.7] * 3
    rows = [row("a, none", [0.8] * 30), row("a, gain", own, ceiling=0.8), row("b, none", [0.1] * 30)]
    result = against_forks(study(rows, FACTORS))
    found = {name: result.values("a, gain", name, 1) for name in NAMES}
    assert [found[name][0] for name in NAMES[:4]] == pytest.approx([0.25, 0.5, 0.75, 0.875], abs=1e-3)
    assert found["fork_deficit_minutes"][0] == pytest.approx(5 * (0.6 + 0.4 + 0.2) + 15 * 0.1, abs=0.01)
    assert found["fork_minutes_back"] == {}  # never at 95 %
    assert all(result.values("a, none", name, 1) == {} for name in NAMES)


def test_windows_4_to_6_are_pooled_whole() -> None:
    """Each counts, the first and the last too: .4, .7 and .7 in any order are three quarters of .8."""
    for late in ([0.4, 0.7, 0.7], [0.7, 0.4, 0.7], [0.7, 0.7, 0.4]):
        own = [0.1] * 15 + [level for level in late for _ in range(5)]
        rows = [row("a, none", [0.8] * 30), row("a, gain", own)]
        assert against_forks(study(rows, FACTORS)).values("a, gain", "fork_4_to_6", 1)[0] == pytest.approx(0.75)


def test_minutes_back_are_those_from_which_on_it_keeps_up() -> None:
    """Where the fork falls, too, the damaged one need not do better."""
    fork = [0.8] * 10 + [0.2] * 5 + [0.8] * 15
    own = [0.1] * 6 + fork[6:]
    result = against_forks(study([row("a, none", fork), row("a, gain", own), row("a, gain", own, seed=1)], FACTORS))
    assert result.values("a, gain", "fork_minutes_back", 1) == {0: 6.0}  # seed 1 has no fork


def test_windows_that_were_not_run_are_null() -> None:
    """Six minutes have one window; a first phase has no damage to tell of."""
    rows = [row(name, [0.5] * 6, phase) for name in ("a, none", "a, gain") for phase in (0, 1)]
    result = against_forks(study(rows, FACTORS))
    assert [len(result.values("a, gain", name, 1)) for name in NAMES] == [1, 0, 0, 0, 1, 1]
    assert all(result.values("a, gain", name, 0) == {} for name in NAMES)


def test_without_ceilings_nothing_is_compared() -> None:
    """Hits of bodies that were altered are no shares of each other."""
    bare = {"ceiling_per_minute": None, "ceiling_per_window": [], "efficiency": None}
    rows = [row("a, none", [0.5] * 30), row("a, gain", [0.5] * 30) | bare]
    result = against_forks(study(rows, FACTORS))
    assert all(result.values("a, gain", name, 1) == {} for name in NAMES)
