"""What could be seen and was believed: classes of misses, ages and agreement, counted a second time by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from somatopy.analysis.sight import AGES, GAZES, Sight, ages, beliefs_of, sight_of, why_no_sight
from somatopy.analysis.summary import summarise


def ages_by_hand(visible: list[bool], stretch: list[int]) -> list[int]:
    """Frame by frame: None while nobody knows since when the hand is visible."""
    found: list[int] = []
    since: int | None = None
    passed = 0
    for k, now in enumerate(visible):
        if k == 0 or stretch[k] != stretch[k - 1]:
            since, passed = None, 0
        if not now:
            since, passed = 0, 0
            found.append(-1)
        else:
            found.append(passed if since is not None or passed >= AGES[-1] else -1)
            passed += 1
    return found


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 0.97, 1.0])
def test_ages_count_from_the_first_visible_frame(share: float) -> None:
    """In each stretch anew; what nobody knows is not told, until it is old in any case."""
    rng = np.random.default_rng(0)
    visible, stretch = rng.random(300) < share, np.repeat([2, 3, 7], [100, 150, 50])
    assert ages(visible, stretch).tolist() == ages_by_hand(visible.tolist(), stretch.tolist())


def test_misses_are_classed_by_gazes_and_ages() -> None:
    """Each miss once; shares are of the frames that could be seen, of the phase alone."""
    rng = np.random.default_rng(1)
    gazes = np.where(rng.random(900) < 0.7, rng.integers(1, 200, 900), 0)
    phase, missed = np.repeat([0, 2], [500, 400]), (rng.random(900) < 0.3) | (gazes == 0)
    sight = Sight(np.arange(900), phase.copy(), gazes, 2089, phase, missed)
    ends = [*GAZES[1:], 10**9]
    for p in (0, 2):
        there = phase == p
        visible = (there & (gazes > 0)).sum()
        expected = [
            (there & missed & (a <= gazes) & (gazes < b)).sum() / visible for a, b in zip(GAZES, ends, strict=True)
        ]
        np.testing.assert_allclose(sight.by_gazes(p), expected)
        age = ages(gazes > 0, phase)
        shares, frames = sight.by_age(p)
        for k, (a, b) in enumerate(zip(AGES, [*AGES[1:], 10**9], strict=True)):
            these = there & (a <= age) & (age < b)
            assert frames[k] == these.sum()
            np.testing.assert_equal(shares[k], missed[these].mean() if these.any() else np.nan)


def test_classes_are_those_that_the_report_names() -> None:
    """Misses from 1, 5, 15, 50 and 150 gazes on, and from 0, 2, 4, 8 and 16 frames on."""
    gazes = np.array([0, 1, 4, 5, 14, 15, 49, 50, 149, 150, 999])
    sight = Sight(np.arange(11), np.zeros(11, int), gazes, 2089, np.zeros(11, int), np.ones(11, bool))
    np.testing.assert_allclose(sight.by_gazes(0), np.array([1, 2, 2, 2, 2, 2]) / 10)
    gazes = np.array([0, *[9] * 20])
    sight = Sight(np.arange(21), np.zeros(21, int), gazes, 2089, np.zeros(21, int), np.ones(21, bool))
    assert sight.by_age(0)[1].tolist() == [2, 2, 4, 8, 4]


def test_without_visible_frames_there_are_no_shares() -> None:
    """No warning, no number made up."""
    none = np.zeros(5, np.int64)
    sight = Sight(none, none, none, 9, none, np.ones(5, bool))
    shares, frames = sight.by_age(0)
    assert np.isnan(shares).all() and not frames.any()
    assert sight.by_gazes(0).tolist() == [5.0, 0, 0, 0, 0, 0]


def test_agreement_is_of_those_that_see_and_those_that_do_not(rich_run: Any) -> None:
    """Over all postures, against the truth of the phase."""
    beliefs = beliefs_of(rich_run)
    assert beliefs is not None and beliefs.told
    sees, does_not = beliefs.agreement()
    for t in range(len(beliefs.frame)):
        truth, believed = beliefs.seen[0 if t < 5 else 1], beliefs.belief[t] >= 128
        assert sees[t] == pytest.approx(believed[truth].mean())
        assert does_not[t] == pytest.approx((~believed)[~truth].mean())


def test_missed_is_what_the_record_says(rich_run: Any) -> None:
    """Frame by frame, in its phase."""
    sight, hit = sight_of(rich_run), rich_run.values("hit")
    assert sight is not None
    assert sight.missed.tolist() == [not hit[frame] for frame in sight.frame]
    assert set(sight.phase[:900]) == {0} and set(sight.phase[900:]) == {1}


def test_it_says_why_nothing_is_shown(twinless_run: Any, write_sight: Any) -> None:
    """No model, no end yet, or a run that was recorded without."""
    told = "What the learner knows, and what it misses, is not shown, because "
    assert why_no_sight(twinless_run, summarise(twinless_run)) == f"{told}the body has no model of itself."
    write_sight(twinless_run.path, (3, 3))
    assert why_no_sight(twinless_run, summarise(twinless_run)) == ""


def test_a_run_recorded_without_says_so(rich_copy: Any) -> None:
    """The ceiling is there, and what would be shown is not."""
    (rich_copy.path / "sight.npz").unlink()
    assert "because sight.npz is missing" in why_no_sight(rich_copy, summarise(rich_copy))
    assert beliefs_of(rich_copy) is None and sight_of(rich_copy) is None
