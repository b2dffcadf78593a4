"""The paper's claims as data, each with the rule that decides whether a run bears it out.

A verdict comes from the summary alone. Where the paper gives a number of one run without an error, it is taken to be
as unsure as ours: the difference of both has sqrt(2) times our standard error.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import sqrt
from typing import Any, Literal

from somatopy.analysis.phases import beside_paper
from somatopy.analysis.series import in_shares
from somatopy.analysis.table import PAPER_FRAMES, PAPER_HITS, PAPER_TRENDS
from somatopy.analysis.trends import Trend, mean_se, quantile
from somatopy.clock import WINDOW

__all__ = ["CLAIMS", "VERDICTS", "Claim", "Finding", "judge"]

Verdict = Literal["holds", "does not hold", "cannot tell"]
VERDICTS: tuple[Verdict, ...] = ("holds", "does not hold", "cannot tell")
Summary = Mapping[str, Any]

#: A distortion that grows by more than a quarter jumps, by less than a tenth it does not; between, nobody can tell.
JUMP, NO_JUMP = 1.25, 1.10
#: A distortion falls when it loses a twentieth.
FALL = 0.95
#: Levels and slopes change with time: numbers are compared over at least this share of the paper's time.
LONG_ENOUGH = 0.9
#: A slope of fewer windows than the paper's shortest trend has tells no direction: a learner that begins is steep.
DIRECTION = 7
TOO_SHORT = "the run is too short"
WITHIN = "the slope's interval contains 0"
SMALL = "the change is too small"
PAPER_RATE = 100 * PAPER_HITS / PAPER_FRAMES[0]
HEAD_BAND = (0.01, 0.02)


@dataclass(frozen=True)
class Finding:
    """What a run says to a claim.

    Attributes:
        ours: the run's number with its 95 % interval, or why there is none.
        verdict: one of `VERDICTS`.
        why: of what cannot be told, the reason in a clause, which many claims have in common.
    """

    ours: str
    verdict: Verdict
    why: str = ""


@dataclass(frozen=True)
class Claim:
    """One claim of the paper.

    Attributes:
        key: a short name that does not change.
        text: what the paper says, in our words.
        paper: its number, and where it stands.
        rule: how the verdict is decided.
        decide: the rule itself, from a summary.
        shares_of: the map whose distortion it compares with a number of the paper's in [0, 1] units, "arm" or "head";
            "" if none.
    """

    key: str
    text: str
    paper: str
    rule: str
    decide: Callable[[Summary], Finding]
    shares_of: str = ""


def judge(
    summary: Summary, units: Mapping[str, str] | None = None, papers_robot: bool = True
) -> list[tuple[Claim, Finding]]:
    """Every claim of the paper with what the run says to it.

    Args:
        summary: of the run.
        units: unit of each map's distances, see `distance_units`; [0, 1] units if None.
        papers_robot: whether the run is one of the paper's robot, see `on_papers_robot`; of another, nothing is said.

    Example:
        >>> phase = {"damage": "none", "frames": 0, "hits_per_window": [], "rate": None, "trends": [None],
        ...     "arm_distortion": {"start": None}, "head_distortion": {"start": None}}
        >>> {finding.verdict for _, finding in judge({"phases": [phase]})}
        {'cannot tell'}
    """
    if not papers_robot:
        return [(claim, _unknown("another robot than the paper's NAO", "the robot is another")) for claim in CLAIMS]
    return [(claim, _in_its_unit(claim, claim.decide(summary), units or {})) for claim in CLAIMS]


def _in_its_unit(claim: Claim, finding: Finding, units: Mapping[str, str]) -> Finding:
    """The finding, if the run's numbers have the unit of the paper's; else that this cannot be told."""
    unit = units.get(claim.shares_of, "")
    if in_shares(unit) or finding.verdict == "cannot tell":
        return finding
    return _unknown(f"{finding.ours} {unit}; the paper's are in [0, 1] units", "its distances have another unit")


def _unknown(ours: str, why: str) -> Finding:
    return Finding(ours, "cannot tell", why)


def _phase(summary: Summary, index: int) -> Mapping[str, Any] | Finding:
    """The phase that stands beside one of the paper's, or why nothing can be said of it."""
    found = beside_paper(summary["phases"])[index]
    if found is None:
        return _unknown("no such phase", f"the run has no {'damaged' if index else 'intact'} phase")
    phase: Mapping[str, Any] = summary["phases"][found]
    if index and phase["damage"] == "none":
        return _unknown("no damage in this phase", "nothing was damaged")
    return phase if phase["frames"] else _unknown("too short", TOO_SHORT)


def _trend(summary: Summary, index: int, segment: int) -> Trend | Finding:
    phase = _phase(summary, index)
    if isinstance(phase, Finding):
        return phase
    entry = phase["trends"][segment] if segment < len(phase["trends"]) else None
    return Trend(**entry) if entry else _unknown("too short", TOO_SHORT)


def _half_width(trend: Trend) -> float:
    return quantile(_windows(trend)) * trend.slope_se


def _windows(trend: Trend) -> int:
    return trend.last - trend.first + 1


def _slope_text(trend: Trend) -> str:
    return f"{_signed(trend.slope, '+.2f')} ± {_half_width(trend):.2f} hits per window, per window"


def _signed(value: float, form: str) -> str:
    return f"{value:{form}}".replace("-", "−")


def direction(index: int, segment: int, sign: int) -> Callable[[Summary], Finding]:
    """Whether a slope has the sign that the paper's has, beyond its 95 % interval."""

    def decide(summary: Summary) -> Finding:
        trend = _trend(summary, index, segment)
        if isinstance(trend, Finding):
            return trend
        if _windows(trend) < DIRECTION:
            return _unknown(f"{_slope_text(trend)}, over {_windows(trend)} windows only", TOO_SHORT)
        least, most = sorted(sign * (trend.slope + side * _half_width(trend)) for side in (-1, 1))
        verdict: Verdict = "holds" if least > 0 else "does not hold" if most <= 0 else "cannot tell"
        return Finding(_slope_text(trend), verdict, WITHIN if verdict == "cannot tell" else "")

    return decide


def slope_near(index: int, segment: int, paper: Trend) -> Callable[[Summary], Finding]:
    """Whether a slope is the paper's, given that both are unsure."""

    def decide(summary: Summary) -> Finding:
        trend = _trend(summary, index, segment)
        if isinstance(trend, Finding):
            return trend
        if _windows(trend) < LONG_ENOUGH * _windows(paper):
            windows = f"{_windows(trend)} of the paper's {_windows(paper)} windows"
            return _unknown(f"{_slope_text(trend)}, over {windows}", TOO_SHORT)
        half = _half_width(trend)
        if abs(trend.slope - paper.slope) > sqrt(2) * half:
            return Finding(_slope_text(trend), "does not hold")
        if abs(trend.slope) <= half:
            return _unknown(_slope_text(trend), WITHIN)
        return Finding(_slope_text(trend), "holds")

    return decide


def rate_near(index: int, paper: float) -> Callable[[Summary], Finding]:
    """Whether the share of frames with the hand in view is the paper's, given that both are unsure; percent."""

    def decide(summary: Summary) -> Finding:
        phase = _phase(summary, index)
        if isinstance(phase, Finding):
            return phase
        counts = phase["hits_per_window"]
        error = mean_se(counts)
        if error is None or phase["frames"] < LONG_ENOUGH * PAPER_FRAMES[index]:
            frames = f"{phase['frames']:,} of {PAPER_FRAMES[index]:,} frames"
            return _unknown(f"{100 * phase['rate']:.1f} %, in {frames}", TOO_SHORT)
        half = 100 * quantile(len(counts), 1) * error / WINDOW
        near = abs(100 * phase["rate"] - paper) <= sqrt(2) * half
        return Finding(f"{100 * phase['rate']:.1f} ± {half:.1f} %", "holds" if near else "does not hold")

    return decide


def falls(index: int, side: str, since: str) -> Callable[[Summary], Finding]:
    """Whether a map's distortion is lower at the phase's end than at its `since` (start or peak)."""

    def decide(summary: Summary) -> Finding:
        marks = _marks(summary, index, side)
        if isinstance(marks, Finding):
            return marks
        before, after = marks[since], marks["end"]
        verdict: Verdict = "holds" if after <= FALL * before else "does not hold" if after >= before else "cannot tell"
        why = SMALL if verdict == "cannot tell" else ""
        return Finding(f"{before:.4f} at its {since}, {after:.4f} at the end", verdict, why)

    return decide


def jumps(side: str, expected: bool) -> Callable[[Summary], Finding]:
    """Whether a map's distortion jumps (or does not, if not `expected`) at the damage."""

    def decide(summary: Summary) -> Finding:
        before, after = _marks(summary, 0, side), _marks(summary, 1, side)
        if isinstance(before, Finding):
            return before
        if isinstance(after, Finding):
            return after
        ratio = after["peak"] / before["end"] if before["end"] else float("inf")
        text = f"peak after damage {ratio:.2f} × the value before it"
        if NO_JUMP < ratio <= JUMP:
            return _unknown(text, SMALL)
        return Finding(text, "holds" if (ratio > JUMP) == expected else "does not hold")

    return decide


def head_band(summary: Summary) -> Finding:
    """Whether the head map's distortion lies in the paper's band wherever the summary tells, after ten minutes."""
    intact, first, second = _phase(summary, 0), _marks(summary, 0, "head"), _marks(summary, 1, "head")
    if isinstance(intact, Finding):
        return intact
    if isinstance(first, Finding):
        return first
    if intact["frames"] < 2 * WINDOW:
        return _unknown("too short", TOO_SHORT)
    values = [first["end"], *([] if isinstance(second, Finding) else second.values())]
    inside = all(HEAD_BAND[0] <= value <= HEAD_BAND[1] for value in values)
    return Finding(f"{min(values):.4f} to {max(values):.4f}", "holds" if inside else "does not hold")


def _marks(summary: Summary, index: int, side: str) -> Mapping[str, float] | Finding:
    phase = _phase(summary, index)
    if isinstance(phase, Finding):
        return phase
    marks: Mapping[str, float] = phase[f"{side}_distortion"]
    if None in marks.values():
        return _unknown("not recorded, or too short", "the map's distortion is not known")
    return marks


def _slope_claims(name: str, text: str, index: int, segment: int, trend: Trend) -> tuple[Claim, Claim]:
    paper = f"{_signed(trend.slope, '+g')} hits per window, per window (section IV, Fig. 3)"
    sign = 1 if trend.slope > 0 else -1
    word = "above" if sign > 0 else "below"
    return (
        Claim(
            name,
            text,
            paper,
            f"Holds if the slope's 95 % interval lies {word} 0; does not hold if on the other side; cannot tell with "
            f"fewer than {DIRECTION} windows, as many as the paper's shortest trend has.",
            direction(index, segment, sign),
        ),
        Claim(
            f"{name}, by how much",
            f"{text.rstrip('.')}: by as much as the paper's trend says.",
            paper,
            "Does not hold if ours differs from the paper's by more than √2 of our 95 % half-width. Else cannot tell "
            "if our own interval contains 0, or the run is shorter than nine tenths of the paper's; holds otherwise.",
            slope_near(index, segment, trend),
        ),
    )


CLAIMS: tuple[Claim, ...] = (
    *_slope_claims("learns", "With time the hand is seen more often.", 0, 0, PAPER_TRENDS[0]),
    Claim(
        "level",
        "While intact, the hand is seen in about half of the frames.",
        f"{PAPER_RATE:.1f} % ({PAPER_HITS:,} of {PAPER_FRAMES[0]:,} frames, section IV)",
        "Holds if ours differs by at most √2 of our 95 % half-width; cannot tell if the run is shorter than nine "
        "tenths of the paper's.",
        rate_near(0, PAPER_RATE),
    ),
    *_slope_claims(
        "degrades", "In the first 35 minutes after the damage it is seen less and less.", 1, 0, PAPER_TRENDS[1]
    ),
    *_slope_claims("recovers", "After that it is seen more and more again.", 1, 1, PAPER_TRENDS[2]),
    Claim(
        "arm map settles",
        "The arm map's distortion falls at first, and then stays level.",
        "seen in Fig. 4, no number given",
        "Holds if the distortion at the end of the intact phase is at least 5 % below its start; "
        "does not hold if it is no lower.",
        falls(0, "arm", "start"),
    ),
    Claim(
        "arm map jumps",
        "At the damage the arm map's distortion jumps.",
        "seen in Fig. 4, no number given",
        "Holds if its peak after the damage is more than 1.25 times the value before; does not hold up to 1.1 times.",
        jumps("arm", True),
    ),
    Claim(
        "arm map adapts",
        "The arm map adapts to the damage: its distortion falls again.",
        "seen in Fig. 4, no number given",
        "Holds if the distortion at the end is at least 5 % below its peak after the damage; "
        "does not hold if it is no lower.",
        falls(1, "arm", "peak"),
    ),
    Claim(
        "head map is fine",
        "After ten minutes the head map's distortion stays between 0.01 and 0.02.",
        "0.01 to 0.02 (Fig. 5)",
        "Holds if it lies there at the end of the intact phase, and at start, peak and end of the damaged one; "
        "cannot tell if the distances are not in [0, 1] units.",
        head_band,
        "head",
    ),
    Claim(
        "head map does not jump",
        "The damage, which is the arm's, leaves the head map alone.",
        "seen in Fig. 5, no number given",
        "Holds if the peak after the damage is at most 1.1 times the value before; does not hold above 1.25 times.",
        jumps("head", False),
    ),
)
