"""Verdicts over seeds: each rule from both sides, what cannot be told, and seeds that are the paper's own."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tests.analysis.paper_cells import PAPER, noisy, study_of

from somatopy.analysis.paper_measures import measure
from somatopy.analysis.statistics import holm, prediction_interval
from somatopy.analysis.table import PAPER_FRAMES
from somatopy.analysis.verdicts import CLAIMS, ClaimOverSeeds, Judged, Rule, judge_over_seeds

NOISE = [-1.0, 1.0, 0.5, -0.5, 0.3, -0.3, 0.8, -0.8]


def judged(rule: Rule, values: list[float], **own: Any) -> Judged:
    """What a rule says of seeds with these slopes."""
    claim = ClaimOverSeeds("key", "text", measure("slopes", 0, 0), rule, **own)
    (found,) = judge_over_seeds(study_of(len(values), lambda seed: {"slope": values[seed]}), "paper", claims=[claim])
    return found


def around(centre: float, spread: float = 1.0) -> list[float]:
    return [centre + spread * noise for noise in NOISE]


@pytest.mark.parametrize(
    "rule, own, holds, fails, unsure",
    [
        ("above", {"low": 10.0}, 11.0, 9.0, 10.1),
        ("below", {"low": 10.0}, 9.0, 11.0, 9.9),
        ("within", {"low": 8.0, "high": 12.0}, 10.0, 14.0, 12.1),
        ("level", {"high": 2.0}, 0.5, 5.0, 2.1),
        ("level", {"high": 2.0}, -0.5, -5.0, -2.1),
    ],
)
def test_each_rule_from_both_sides(rule: Rule, own: dict[str, Any], holds: float, fails: float, unsure: float) -> None:
    """Eight seeds with known spread; near the border no verdict is forced, nor from one seed."""
    assert judged(rule, around(holds), **own).verdict == "holds"
    assert judged(rule, around(fails), **own).verdict == "does not hold"
    assert judged(rule, around(unsure), **own).verdict == "cannot tell"
    assert judged(rule, [holds], **own).verdict == "cannot tell"


def test_seeds_that_scatter_widely_are_not_level() -> None:
    """An interval that holds 0 is no evidence of levelness."""
    assert judged("level", around(0.0, 50.0), high=2.0).verdict == "cannot tell"


def test_near_asks_where_one_more_seed_would_fall() -> None:
    """Beyond the interval of the mean the paper's number may still be one of ours."""
    values = around(10.0)
    low, high = prediction_interval(values) or (0.0, 0.0)
    for paper, verdict in ((low + 0.01, "holds"), (high - 0.01, "holds"), (low - 0.01, "does not hold")):
        found = judged("near", values, paper=paper)
        assert found.verdict == verdict and found.paper_is_inside is (verdict == "holds") and found.p is None
    assert judged("near", [10.0], paper=10.0).verdict == "cannot tell"


def test_levels_are_compared_over_the_papers_time() -> None:
    """Runs that are shorter than nine tenths of the paper's first phase cannot tell."""
    for share, verdict in ((0.89, "cannot tell"), (0.91, "holds")):
        frames = round(share * PAPER_FRAMES[0]), PAPER_FRAMES[1]
        short = study_of(8, lambda seed, frames=frames: {**noisy(seed), "frames": frames})
        (found,) = (one for one in judge_over_seeds(short, "paper") if one.claim.rule == "near")
        assert found.verdict == verdict


@pytest.mark.parametrize("seeds", [8, 25])
def test_the_papers_own_lines_hold(seeds: int) -> None:
    """Seeds that are drawn around the paper's numbers show all of its claims but one: its last slope is level."""
    found = {one.claim.key: one for one in judge_over_seeds(study_of(seeds, noisy), "paper")}
    assert {*found} == {claim.key for claim in CLAIMS} and len(found) == len(CLAIMS)
    assert {key for key, one in found.items() if one.verdict != "holds"} == set()
    assert all(one.interval.method == ("t" if seeds < 20 else "BCa") for one in found.values())
    assert all(one.paper_is_inside for one in found.values() if one.claim.paper is not None)


@pytest.mark.parametrize(
    "own, refuted",
    [
        ({"slope": -12.0}, {"learns"}),
        ({"rate": 0.1}, {"level"}),
        ({"drop": 80.0}, {"degrades gradually"}),
        ({"rise": -3.0}, {"improves again"}),
        ({"rise": 30.0}, {"stays"}),
        ({"head": 0.03, "head_peak": 0.03}, {"head map's band"}),
        ({"head_peak": 0.03}, {"head map does not jump"}),
        ({"arm_after": (0.1, 0.08)}, {"arm map jumps"}),
        ({"arm_after": (0.15, 0.15)}, {"arm map adapts"}),
        ({"line_end": 0.1}, {"costs"}),
        ({"arm": [None, *[0.1] * 5, *[0.2] * 190], "arm_after": (0.4, 0.2)}, {"arm map settles", "arm map is level"}),
    ],
)
def test_each_claim_is_refuted_alone(own: dict[str, Any], refuted: set[str]) -> None:
    """By what it is about, and by nothing else."""

    def draw(seed: int) -> dict[str, Any]:
        base = noisy(seed)
        rng = np.random.default_rng(100 + seed)
        return {**base, **{key: _shaken(value, rng) for key, value in own.items()}}

    found = judge_over_seeds(study_of(8, draw), "paper")
    assert {one.claim.key for one in found if one.verdict == "does not hold"} == refuted


def _shaken(value: Any, rng: np.random.Generator) -> Any:
    factor = 1 + 0.003 * rng.normal()
    if isinstance(value, list | tuple):
        return type(value)(None if each is None else each * factor for each in value)
    return value * factor


#: What each claim says where its border is: "above", "within a tenth", "between 0.01 and 0.02".
BORDERS: dict[str, tuple[Rule, float, float]] = {
    "learns": ("above", 0.0, 0.0),
    "level": ("near", 0.0, 0.0),
    "costs": ("below", 0.0, 0.0),
    "degrades gradually": ("below", 0.0, 0.0),
    "improves again": ("above", 0.0, 0.0),
    "stays": ("level", 0.0, 6.0),
    "arm map settles": ("below", 1.0, 0.0),
    "arm map is level": ("level", 0.0, 0.1),
    "arm map jumps": ("above", 1.1, 0.0),
    "arm map adapts": ("below", 0.9, 0.0),
    "head map's band": ("within", 0.01, 0.02),
    "head map does not jump": ("below", 1.1, 0.0),
}


def test_borders_are_those_that_were_fixed_before_anything_was_run() -> None:
    """Whoever moves one changes what has been found."""
    assert {claim.key: (claim.rule, claim.low, claim.high) for claim in CLAIMS} == {
        key: (rule, pytest.approx(low), pytest.approx(high)) for key, (rule, low, high) in BORDERS.items()
    }


def test_seeds_that_show_it_and_chance() -> None:
    """A half by default; of runs in which nothing learns, their share with one more run on either side."""
    study = study_of(4, lambda seed: {"slope": [12.0, 11.0, 10.0, -1.0][seed]})
    (found,) = judge_over_seeds(study, "paper", claims=CLAIMS[:1])
    assert found.shown is not None and (found.shown.count, found.shown.n, found.shown.chance) == (3, 4, 0.5)
    chance = {"learns": {seed: 1.0 if seed < 2 else -1.0 for seed in range(8)}}
    (found,) = judge_over_seeds(study, "paper", chance, CLAIMS[:1])
    assert found.shown is not None and found.shown.chance == pytest.approx(3 / 10)
    assert judged("level", around(0.0), high=2.0).shown is None


def test_p_values_are_corrected_for_all_claims() -> None:
    """Holm's, over those that have a test; none gets smaller."""
    found = judge_over_seeds(study_of(8, noisy), "paper")
    assert {one.claim.key: one.p_holm for one in found} == holm({one.claim.key: one.p for one in found})
    assert all(one.p_holm >= one.p for one in found if one.p is not None and one.p_holm is not None)
    assert {one.claim.rule for one in found if one.p is None} == {"near", "within"}


def test_runs_that_are_too_short_cannot_tell() -> None:
    """No claim holds or is refuted without seeds; of short runs, those alone that need more cannot be told."""
    for one in judge_over_seeds(study_of(2), "another"):
        assert (one.verdict, one.shown, one.p) == ("cannot tell", None, None)
    short = study_of(8, lambda seed: {**noisy(seed), "after": PAPER["after"][:5]})
    unsure = {one.claim.key for one in judge_over_seeds(short, "paper") if one.verdict == "cannot tell"}
    assert unsure == {"costs"}
