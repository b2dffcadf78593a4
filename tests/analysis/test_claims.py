"""The paper's claims, and the rules that decide them: verdicts flip when the numbers do."""

from __future__ import annotations

from typing import Any

import pytest

from somatopy.analysis.claims import CLAIMS, VERDICTS, judge
from somatopy.analysis.trends import quantile


def summary() -> dict[str, Any]:
    """A run that is the paper's in every respect."""

    def trend(first: int, last: int, slope: float, intercept: float) -> dict[str, Any]:
        half = abs(slope) / 2
        error = half / quantile(last - first + 1)
        return {"first": first, "last": last, "slope": slope, "slope_se": error, "intercept": intercept}

    def phase(damage: str, frames: int, rate: float, trends: list[Any], arm: Any, head: Any) -> dict[str, Any]:
        windows = frames // 4500
        marks = [dict(zip(("start", "peak", "end"), values, strict=True)) for values in (arm, head)]
        counts = [round(4500 * rate) + (60 if k % 2 else -60) for k in range(windows)]
        return {
            "damage": damage,
            "frames": frames,
            "rate": rate,
            "hits_per_window": counts,
            "trends": trends,
            "arm_distortion": marks[0],
            "head_distortion": marks[1],
        }

    first = phase("none", 177_823, 0.5154, [trend(0, 38, 12.147, 2175.2)], (0.2, 0.2, 0.1), (0.03, 0.03, 0.015))
    trends = [trend(0, 6, -80.286, 2685.9), trend(7, 20, 1.2154, 2255.3)]
    second = phase("offset", 96_049, 0.48, trends, (0.1, 0.2, 0.12), (0.015, 0.0155, 0.014))
    return {"phases": [first, second]}


def verdicts(changed: dict[str, Any]) -> dict[str, str]:
    return {claim.key: finding.verdict for claim, finding in judge(changed)}


def test_the_papers_own_run_bears_out_the_paper() -> None:
    """All claims hold of a run with its numbers and small errors."""
    assert set(verdicts(summary()).values()) == {"holds"}


def test_keys_differ_and_every_rule_is_told() -> None:
    """Each claim has its name, words, the paper's side and its rule."""
    assert len({claim.key for claim in CLAIMS}) == len(CLAIMS)
    assert all(claim.text and claim.paper and claim.rule for claim in CLAIMS)


@pytest.mark.parametrize(("name", "where"), [("learns", (0, 0)), ("degrades", (1, 0)), ("recovers", (1, 1))])
def test_directions_flip_with_the_sign(name: str, where: tuple[int, int]) -> None:
    """The other sign, beyond the error: does not hold. An error larger than the slope: cannot tell."""
    for factor, error, verdict in (
        (1, 1, "holds"),
        (-1, 1, "does not hold"),
        (1, 3, "cannot tell"),
        (-1, 3, "cannot tell"),
    ):
        changed = summary()
        trend = changed["phases"][where[0]]["trends"][where[1]]
        trend["slope"] *= factor
        trend["slope_se"] *= error
        assert verdicts(changed)[name] == verdict


def test_few_windows_tell_no_direction() -> None:
    """The paper's shortest trend has seven windows; six, however steep, tell nothing, and the reason is the length."""
    for last, verdict in ((6, "holds"), (5, "cannot tell")):
        changed = summary()
        changed["phases"][0]["trends"][0] |= {"last": last, "slope": 218.0, "slope_se": 1.0}
        found = {claim.key: finding for claim, finding in judge(changed)}["learns"]
        assert found.verdict == verdict and bool(found.why) == (verdict == "cannot tell")


def test_what_cannot_be_told_has_a_reason() -> None:
    """And what can has none: from nothing at all, from a run like the paper's, and from one whose slopes are unsure."""
    unsure = summary()
    unsure["phases"][0]["trends"][0]["slope_se"] *= 3
    short = {"damage": "none", "frames": 0, "hits_per_window": [], "rate": None, "trends": [None]}
    marks = {"arm_distortion": {"start": None}, "head_distortion": {"start": None}}
    for changed in (summary(), unsure, {"phases": [short | marks]}):
        for _, finding in judge(changed):
            assert bool(finding.why) == (finding.verdict == "cannot tell")


def test_a_slope_is_the_papers_within_both_errors() -> None:
    """√2 of the half-width is the border: 12.147 against 12.147 + 1.4 half-widths, and 1.5."""
    half = 12.147 / 2
    for away, verdict in ((1.4, "holds"), (1.5, "does not hold"), (-1.5, "does not hold"), (-1.1, "cannot tell")):
        changed = summary()
        changed["phases"][0]["trends"][0]["slope"] += away * half
        assert verdicts(changed)["learns, by how much"] == verdict


def test_numbers_of_shorter_runs_are_not_compared() -> None:
    """Slope and level change with time: under nine tenths of the paper's time neither verdict is given."""
    changed = summary()
    changed["phases"][0]["trends"][0]["last"] = 33
    changed["phases"][0]["frames"] = 150_000
    found = {claim.key: finding for claim, finding in judge(changed)}
    assert found["learns, by how much"].verdict == found["level"].verdict == "cannot tell"
    assert "34 of the paper's 39 windows" in found["learns, by how much"].ours
    assert found["learns"].verdict == "holds"


def test_nine_tenths_of_the_papers_time_are_enough() -> None:
    """36 of its 39 windows and 160,100 of its 177,823 frames are; 35 and 160,000 are not."""
    for last, frames, enough in ((34, 160_000, False), (35, 160_100, True)):
        changed = summary()
        changed["phases"][0]["trends"][0]["last"] = last
        changed["phases"][0]["frames"] = frames
        found = verdicts(changed)
        assert found["learns, by how much"] == found["level"] == ("holds" if enough else "cannot tell")


def test_the_level_flips_when_it_leaves_the_interval() -> None:
    """Rates that differ by more than √2 half-widths do not bear the paper out."""
    for rate, verdict in ((0.515, "holds"), (0.45, "does not hold"), (0.58, "does not hold")):
        changed = summary()
        changed["phases"][0]["rate"] = rate
        assert verdicts(changed)["level"] == verdict


@pytest.mark.parametrize(
    ("name", "phase", "side", "mark", "values"),
    [
        ("arm map settles", 0, "arm", "end", {0.18: "holds", 0.195: "cannot tell", 0.21: "does not hold"}),
        ("arm map adapts", 1, "arm", "end", {0.18: "holds", 0.195: "cannot tell", 0.2: "does not hold"}),
        ("arm map jumps", 1, "arm", "peak", {0.13: "holds", 0.12: "cannot tell", 0.105: "does not hold"}),
        ("head map does not jump", 1, "head", "peak", {0.016: "holds", 0.0175: "cannot tell", 0.019: "does not hold"}),
        ("head map is fine", 0, "head", "end", {0.0101: "holds", 0.0099: "does not hold", 0.021: "does not hold"}),
        ("head map is fine", 1, "head", "peak", {0.0199: "holds", 0.0201: "does not hold"}),
    ],
)
def test_distortion_rules_flip(name: str, phase: int, side: str, mark: str, values: dict[float, str]) -> None:
    """Each side of each threshold."""
    for value, verdict in values.items():
        changed = summary()
        changed["phases"][phase][f"{side}_distortion"][mark] = value
        assert verdicts(changed)[name] == verdict


def test_what_is_missing_cannot_be_told() -> None:
    """No second phase, no damage in it, no trends, no maps: the claims on them are left open, with the reason."""
    damage = {
        claim.key for claim in CLAIMS if any(word in claim.key for word in ("degrades", "recovers", "jump", "adapts"))
    }
    no_phase, healthy, empty = summary(), summary(), summary()
    del no_phase["phases"][1]
    healthy["phases"][1]["damage"] = "none"
    empty["phases"][1] |= {"frames": 0, "rate": None, "hits_per_window": [], "trends": [None, None]}
    for changed, reason in ((no_phase, "no such phase"), (healthy, "no damage in this phase"), (empty, "too short")):
        found = {claim.key: finding for claim, finding in judge(changed)}
        assert {found[key].verdict for key in damage} == {"cannot tell"}
        assert {found[key].ours for key in damage} == {reason}
        assert found["learns"].verdict == "holds"
    mapless = summary()
    for phase in mapless["phases"]:
        phase["arm_distortion"] = phase["head_distortion"] = {"start": None, "peak": None, "end": None}
    assert {verdict for key, verdict in verdicts(mapless).items() if "map" in key} == {"cannot tell"}


def test_radians_are_not_compared_with_shares_of_a_range() -> None:
    """The claim that gives a number in [0, 1] units cannot be told, with our number and why; ratios can."""
    told = {claim.key: finding for claim, finding in judge(summary(), {"arm": "rad", "head": "rad"})}
    assert told["head map is fine"].verdict == "cannot tell"
    assert told["head map is fine"].ours == "0.0140 to 0.0155 rad; the paper's are in [0, 1] units"
    assert {finding.verdict for key, finding in told.items() if key != "head map is fine"} == {"holds"}
    assert judge(summary(), {"arm": "1", "head": ""}) == judge(summary())


def test_a_run_damaged_from_its_start_has_no_intact_phase() -> None:
    """What is damaged stands beside the paper's damaged phase, whether or not a phase of no frames comes before."""
    whole, alone, idle = summary(), summary(), summary()
    del alone["phases"][0]
    idle["phases"][0] |= {"frames": 0, "rate": None, "hits_per_window": [], "trends": [None]}
    found = verdicts(alone)
    assert found["degrades"] == found["recovers"] == found["arm map adapts"] == "holds"
    assert found["learns"] == found["level"] == found["arm map jumps"] == "cannot tell"
    assert verdicts(idle) == found != verdicts(whole)


def test_verdicts_are_three() -> None:
    """Nothing else is ever said."""
    assert set(VERDICTS) == {"holds", "does not hold", "cannot tell"}
