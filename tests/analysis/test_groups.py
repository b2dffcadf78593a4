"""Runs of one description, taken together over their seeds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from somatopy.analysis.comparison import compare
from somatopy.analysis.groups import as_study, grouped


@pytest.fixture
def runs(make_run: Any, edited: Any) -> Any:
    """Make a run of two windows under a seed: `runs(folder, seed, hits a window, learner)`."""

    def make(folder: str, seed: int, hits: int, learner: str = "hebbian") -> tuple[str, Any]:
        seen = np.tile(np.arange(4500) < hits, 2)
        run = make_run(seen, learner=learner, folder=folder)
        return folder, edited(run, ("seed = 7", f"seed = {seed}"), ('name = "synthetic"', f'name = "{folder}"'))

    return make


def test_runs_that_differ_in_their_seed_are_one_group(runs: Any) -> None:
    """Names do not part them, other settings do; groups and runs come in the order given."""
    named = [runs("a", 3, 900), runs("x", 1, 90, "random"), runs("b", 1, 1800), runs("c", 2, 1350)]
    first, second = grouped(named)
    assert (first.name, [*first.runs], second.name, [*second.runs]) == ("a and 2 more", [3, 1, 2], "x", [1])


def test_versions_and_citations_part_no_runs(runs: Any) -> None:
    """They say who ran it, not what was run."""
    named = [runs("a", 1, 900), runs("b", 2, 900)]
    with (named[0][1].path / "experiment.toml").open("a", encoding="utf-8") as file:
        file.write('[versions]\nsomatopy = "1.2.3"\n')
    assert len(grouped(named)) == 1


def test_a_seed_counts_once(runs: Any) -> None:
    """A second run of it is named, and left out."""
    (group,) = grouped([runs("a", 1, 900), runs("copy", 1, 1800), runs("b", 2, 1350)])
    assert (group.twice, [name for name, _ in group.runs.values()]) == (["copy"], ["a", "b"])


def test_groups_are_compared_like_conditions(runs: Any) -> None:
    """Means by hand: 900 and 1800 of 4500 frames a window are .2 and .4; differences are between equal seeds."""
    named = [runs("a", 1, 900), runs("b", 2, 1800), runs("x", 1, 450, "random"), runs("y", 2, 900, "random")]
    comparison = compare(as_study(grouped(named)))
    (ours,), (theirs,) = (comparison.of(name, 0, "rate") for name in ("a and 1 more", "x and 1 more"))
    assert ours.values == {1: 0.2, 2: 0.4} and ours.interval.mean == pytest.approx(0.3)
    assert theirs.difference.interval.mean == pytest.approx((-0.1 - 0.2) / 2)


def test_no_runs_are_no_study() -> None:
    """Nothing is compared."""
    assert compare(as_study(grouped([]))).rows == ()
