"""Measures of the paper's curves: on tables whose numbers are put in."""

from __future__ import annotations

import pytest
from tests.analysis.paper_cells import PAPER, THIRD, study_of

from somatopy.analysis.paper_measures import (
    arm_drift,
    arm_early_share,
    arm_fall,
    arm_fall_after,
    arm_jump,
    head_jump,
    level_after,
    loss_of_level,
    measure,
)


def test_each_is_the_number_that_was_put_in() -> None:
    """By seed; two seeds that differ keep their own."""
    result = study_of(2, lambda seed: {"slope": 10.0 + seed, "arm_after": (0.2, 0.1 + 0.05 * seed)})
    assert measure("slopes", 0, 0)(result, "paper") == {0: 10.0, 1: 11.0}
    assert arm_jump(result, "paper") == pytest.approx({0: 2.0, 1: 2.0})
    assert arm_fall_after(result, "paper") == pytest.approx({0: 0.5, 1: 0.75})
    assert arm_fall(result, "paper") == pytest.approx({0: 0.25, 1: 0.25})
    assert head_jump(result, "paper") == pytest.approx({0: 1.0, 1: 1.0})


def test_the_level_after_is_that_of_the_third_line() -> None:
    """The mean of a line is its middle: half a hit of rounding aside; the loss is against the end of phase 1."""
    result = study_of(1)
    middle = THIRD.at(6.5) / 4500
    assert level_after(result, "paper")[0] == pytest.approx(middle, abs=0.5 / 4500)
    assert loss_of_level(result, "paper")[0] == pytest.approx(middle - PAPER["line_end"], abs=0.5 / 4500)
    changed = study_of(1, lambda seed: {"after": [4500] * 7 + PAPER["after"][7:]})
    assert level_after(changed, "paper") == level_after(result, "paper")


def test_runs_that_are_too_short_are_left_out() -> None:
    """No number is made up, and other seeds keep theirs."""
    result = study_of(2, lambda seed: {"after": [100] * (7 + seed), "arm": [None, 0.4, 0.3, 0.2, *[0.1] * (2 * seed)]})
    assert {*level_after(result, "paper")} == {*loss_of_level(result, "paper")} == {1}
    assert {*arm_early_share(result, "paper")} == {*arm_drift(result, "paper")} == {1}


@pytest.mark.parametrize(
    "curve, share, drift",
    [
        ([None, 0.5, 0.5, 0.5, 0.4, *[0.3] * 5], 0.5, -0.25),
        ([None, 0.5, 0.4, 0.3, 0.2, *[0.2] * 5], 1.0, 0.0),
        ([None, 0.5, 0.4, 0.3, 0.2, *[0.3] * 5], 1.5, 0.5),
        ([None, 0.2, 0.2, 0.2, 0.2, *[0.3] * 5], 0.0, 0.5),
    ],
)
def test_how_early_the_arm_map_settles(curve: list[float | None], share: float, drift: float) -> None:
    """The share of the fall in five minutes, and the change from there on; a curve that rises has no share."""
    result = study_of(1, lambda seed: {"arm": curve})
    assert arm_early_share(result, "paper")[0] == pytest.approx(share)
    assert arm_drift(result, "paper")[0] == pytest.approx(drift)
