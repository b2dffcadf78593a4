"""The loss of the calibration: 0 on the paper's own numbers, and one for one scale away, landmark by landmark."""

from __future__ import annotations

import math
from typing import Any

import pytest
from tests.analysis.paper_cells import PAPER, study_of

from somatopy.analysis.paper_loss import LANDMARKS, distances, paper

#: For each landmark, what moves it by one scale away from what fits, and nothing else.
AWAY: dict[str, dict[str, Any]] = {
    "level": {"rate": PAPER["rate"] - 0.056},
    "slope": {"slope": PAPER["slope"] + 7.8},
    "drop": {"drop": PAPER["drop"] - 41.0},
    "level after": {"after": [*PAPER["after"][:7], *(value + 0.045 * 4500 for value in PAPER["after"][7:])]},
    "early fall": {"arm": [None, 0.2, 0.2, 0.2, 0.15, *[0.1] * 190]},
    "jump": {"arm_after": (0.1, 0.08)},
    "fall after": {"arm_after": (0.15, 0.15 * 1.05)},
    "head distortion": {"head": 0.025},
}
#: Hits are whole: half a hit of a window is a five hundredth of the scale.
EXACT = 0.5 / 4500 / 0.045


def test_the_papers_own_numbers_have_no_loss() -> None:
    """Every landmark of a table that is made of them is met."""
    found = distances(study_of(3), "paper")
    assert {*found} == {mark.name for mark in LANDMARKS} == {*AWAY}
    assert paper(study_of(3), "paper") < EXACT


@pytest.mark.parametrize("name", AWAY)
def test_one_scale_away_is_one(name: str) -> None:
    """With its sign, and no other landmark moves: the loss is then the root of one eighth."""
    result = study_of(2, lambda seed: AWAY[name])
    for other, distance in distances(result, "paper").items():
        expected = 1.0 if other == name else 0.0
        shorter = {"level", "drop", "early fall", "jump"}
        assert distance == pytest.approx(-expected if name in shorter else expected, abs=2 * EXACT)
    assert paper(result, "paper") == pytest.approx(math.sqrt(1 / len(LANDMARKS)), rel=2 * EXACT)


def test_the_mean_over_seeds_counts() -> None:
    """Two seeds on either side of the paper's slope are as good as two on it."""
    either = study_of(2, lambda seed: {"slope": PAPER["slope"] + (20 if seed else -20)})
    assert paper(either, "paper") == pytest.approx(paper(study_of(2), "paper"))


def test_whether_the_hand_comes_back_is_not_fitted() -> None:
    """The last trend is left for the confirmation to tell."""
    fallen = study_of(2, lambda seed: {"rise": -500.0})
    assert distances(fallen, "paper") == distances(study_of(2), "paper")


def test_what_cannot_be_told_is_infinite() -> None:
    """A run that is too short for one of the landmarks, and a condition that is not there."""
    short = study_of(1, lambda seed: {"after": PAPER["after"][:7]})
    assert distances(short, "paper") == {} and math.isinf(paper(short, "paper"))
    assert math.isinf(paper(short, "another"))
