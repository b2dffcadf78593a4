"""The paper's claims over many seeds: each is a rule about an interval of the mean, fixed before anything was run.

The seed is the unit. Beside each verdict stand the number of seeds that show the claim, what chance would show, and,
where the paper gives a number of its one run, whether that number lies where one more seed would fall.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from somatopy.analysis.cells import StudyResult
from somatopy.analysis.paper_measures import (
    BySeed,
    Measure,
    arm_drift,
    arm_fall,
    arm_fall_after,
    arm_jump,
    head_jump,
    loss_of_level,
    measure,
)
from somatopy.analysis.statistics import (
    Interval,
    Shown,
    equivalent,
    holm,
    mean_interval,
    prediction_interval,
    shows,
)
from somatopy.analysis.table import PAPER_FRAMES, PAPER_HITS, PAPER_TRENDS
from somatopy.clock import WINDOW

__all__ = ["CLAIMS", "LEVEL_DISTORTION", "LEVEL_SLOPE", "ClaimOverSeeds", "Judged", "judge_over_seeds"]

#: Margins of "level", fixed beforehand: a tenth of a distortion; 6 hits a window, 2 points of rate in 72 minutes.
LEVEL_DISTORTION, LEVEL_SLOPE = 0.1, 6.0
#: Levels change with time: they are set beside the paper's over at least this share of its time.
LONG_ENOUGH = 0.9

Rule = Literal["above", "below", "within", "level", "near"]
Verdict = Literal["holds", "does not hold", "cannot tell"]


@dataclass(frozen=True)
class ClaimOverSeeds:
    """One claim of the paper as a rule over seeds.

    Attributes:
        key: a short name that does not change.
        text: what is claimed.
        measure: the number of each seed that decides.
        rule: "above" and "below": the 95 % interval of the mean lies on that side of `low`; "within": between `low` and
            `high`; "level": equivalence to 0, with `high` as the margin; "near": `paper` lies where one more seed would
            fall, which is asked only of runs that are about as long as the paper's.
        low: see `rule`.
        high: see `rule`.
        form: format of the numbers.
        unit: their unit.
        paper: the paper's number; None where it gives none.
        source: where the paper says it.
        fitted: whether the calibration fits this number, so that it cannot count as found.
    """

    key: str
    text: str
    measure: Measure
    rule: Rule
    low: float = 0.0
    high: float = 0.0
    form: str = "{:+.1f}"
    unit: str = ""
    paper: float | None = None
    source: str = ""
    fitted: bool = False

    @property
    def sign(self) -> int:
        """On which side of `low` a seed shows the claim; 0 where that has no meaning."""
        return {"above": 1, "below": -1}.get(self.rule, 0)


@dataclass(frozen=True)
class Judged:
    """What many seeds say to a claim.

    Attributes:
        claim: the claim.
        values: the number of each seed.
        interval: mean and 95 % interval.
        verdict: "holds", "does not hold", "cannot tell".
        shown: how many seeds show it, and how probable as many are by chance; None where a seed cannot show it alone.
        prediction: where one more seed would fall, with 95 %; None below two seeds.
        p: of the test behind the verdict; None where there is none.
        p_holm: the same, corrected for the number of claims.
    """

    claim: ClaimOverSeeds
    values: BySeed
    interval: Interval
    verdict: Verdict
    shown: Shown | None
    prediction: tuple[float, float] | None
    p: float | None
    p_holm: float | None = None

    @property
    def paper_is_inside(self) -> bool | None:
        """Whether the paper's number lies where one more seed would fall; None where it gives none."""
        if self.prediction is None or self.claim.paper is None:
            return None
        return self.prediction[0] <= self.claim.paper <= self.prediction[1]


def judge_over_seeds(
    result: StudyResult,
    condition: str,
    chance: Mapping[str, BySeed] | None = None,
    claims: Sequence[ClaimOverSeeds] | None = None,
) -> list[Judged]:
    """Every claim of the paper with what the seeds of a condition say to it.

    Args:
        result: a study.
        condition: the name of the condition.
        chance: by key of a claim, the numbers of seeds in which nothing learns: what chance shows. A half if None.
        claims: the claims; `CLAIMS` if None.
    """
    judged = [
        _judged(claim, _numbers(claim, result, condition), (chance or {}).get(claim.key)) for claim in claims or CLAIMS
    ]
    corrected = holm({each.claim.key: each.p for each in judged})
    return [replace(each, p_holm=corrected[each.claim.key]) for each in judged]


def _numbers(claim: ClaimOverSeeds, result: StudyResult, condition: str) -> BySeed:
    """The claim's number of each seed; where it is set beside the paper's level, of runs that are as long."""
    values = claim.measure(result, condition)
    if claim.rule != "near":
        return values
    frames = result.values(condition, "frames", 0)
    return {seed: value for seed, value in values.items() if frames[seed] >= LONG_ENOUGH * PAPER_FRAMES[0]}


def _judged(claim: ClaimOverSeeds, values: BySeed, chance: BySeed | None) -> Judged:
    numbers = list(values.values())
    interval, prediction = mean_interval(numbers), prediction_interval(numbers)
    shown = None
    if claim.sign and numbers:
        shown = shows([value - claim.low for value in numbers], claim.sign, _chance(claim, chance))
    verdict, p = _decided(claim, numbers, interval, prediction)
    return Judged(claim, values, interval, verdict, shown, prediction, p)


def _chance(claim: ClaimOverSeeds, chance: BySeed | None) -> float:
    """The share of seeds that show a claim by chance; one more run on either side keeps it from being 0 or 1."""
    if not chance:
        return 0.5
    count = sum(claim.sign * (value - claim.low) > 0 for value in chance.values())
    return (count + 1) / (len(chance) + 2)


def _decided(
    claim: ClaimOverSeeds, numbers: list[float], interval: Interval, prediction: tuple[float, float] | None
) -> tuple[Verdict, float | None]:
    if claim.rule == "near":
        inside = prediction and claim.paper is not None and prediction[0] <= claim.paper <= prediction[1]
        return ("cannot tell" if prediction is None else "holds" if inside else "does not hold"), None
    if claim.rule == "level":
        found = equivalent(numbers, claim.high) if numbers else None
        words: dict[str, Verdict] = {"level": "holds", "not level": "does not hold", "cannot tell": "cannot tell"}
        return (words[found.verdict], found.p) if found else ("cannot tell", None)
    if interval.low is None or interval.high is None:
        return "cannot tell", None
    if claim.rule == "within":
        inside = claim.low <= interval.low and interval.high <= claim.high
        outside = interval.high < claim.low or interval.low > claim.high
        return ("holds" if inside else "does not hold" if outside else "cannot tell"), None
    least, most = sorted(claim.sign * (end - claim.low) for end in (interval.low, interval.high))
    return ("holds" if least > 0 else "does not hold" if most < 0 else "cannot tell"), _p_of_mean(numbers, claim.low)


def _p_of_mean(numbers: Sequence[float], value: float) -> float | None:
    """Of Student's test that the mean is a value; None where the numbers are all equal."""
    from scipy.stats import ttest_1samp

    return float(ttest_1samp(numbers, value).pvalue) if len(set(numbers)) > 1 else None


_A_WINDOW = "hits per window, per window"
_RATE = PAPER_HITS / PAPER_FRAMES[0]
_LOSS = (PAPER_TRENDS[2].at(6.5) - PAPER_TRENDS[0].at(38)) / WINDOW

CLAIMS: tuple[ClaimOverSeeds, ...] = (
    ClaimOverSeeds(
        "learns",
        "With time the hand is seen more often.",
        measure("slopes", 0, 0),
        "above",
        unit=_A_WINDOW,
        paper=PAPER_TRENDS[0].slope,
        source="section IV, Fig. 3",
        fitted=True,
    ),
    ClaimOverSeeds(
        "level",
        "While intact, the hand is seen in about half of the frames.",
        measure("rate", 0),
        "near",
        form="{:.3f}",
        unit="share of frames",
        paper=_RATE,
        source="section IV",
        fitted=True,
    ),
    ClaimOverSeeds(
        "costs",
        "The damage costs sight of the hand: from 35 minutes on, the rate is below that at the end of phase 1.",
        loss_of_level,
        "below",
        form="{:+.3f}",
        unit="share of frames",
        paper=_LOSS,
        source="Fig. 3, from its trend lines",
        fitted=True,
    ),
    ClaimOverSeeds(
        "degrades gradually",
        "In the first 35 minutes after the damage the hand is seen less and less.",
        measure("slopes", 1, 0),
        "below",
        unit=_A_WINDOW,
        paper=PAPER_TRENDS[1].slope,
        source="section IV, Fig. 3",
        fitted=True,
    ),
    ClaimOverSeeds(
        "improves again",
        "After that it is seen more and more again.",
        measure("slopes", 1, 1),
        "above",
        unit=_A_WINDOW,
        paper=PAPER_TRENDS[2].slope,
        source="section IV, Fig. 3",
    ),
    ClaimOverSeeds(
        "stays",
        f"After that the rate is level: within {LEVEL_SLOPE:g} hits a window, 2 points in 72 minutes.",
        measure("slopes", 1, 1),
        "level",
        high=LEVEL_SLOPE,
        unit=_A_WINDOW,
        paper=PAPER_TRENDS[2].slope,
        source="our margin; the paper's number lies in it",
    ),
    ClaimOverSeeds(
        "arm map settles",
        "The arm map's distortion falls at first: at the end of phase 1 it is below its start.",
        arm_fall,
        "below",
        low=1.0,
        form="{:.2f}",
        unit="× its start",
        source="Fig. 4, no number given",
        fitted=True,
    ),
    ClaimOverSeeds(
        "arm map is level",
        "From minute 5 to the end of phase 1 it stays level, within a tenth.",
        arm_drift,
        "level",
        high=LEVEL_DISTORTION,
        form="{:+.2f}",
        unit="of its value at minute 5",
        source="section IV, Fig. 4, no number given",
        fitted=True,
    ),
    ClaimOverSeeds(
        "arm map jumps",
        "At the damage it jumps, by more than a tenth.",
        arm_jump,
        "above",
        low=1 + LEVEL_DISTORTION,
        form="{:.2f}",
        unit="× its value before",
        source="section IV, Fig. 4, no number given",
        fitted=True,
    ),
    ClaimOverSeeds(
        "arm map adapts",
        "After the jump it falls again, by more than a tenth of its peak.",
        arm_fall_after,
        "below",
        low=1 - LEVEL_DISTORTION,
        form="{:.2f}",
        unit="× its peak",
        source="section IV, Fig. 4, no number given",
        fitted=True,
    ),
    ClaimOverSeeds(
        "head map's band",
        "The head map's distortion stays between 0.01 and 0.02.",
        measure("head_distortion_end", 0),
        "within",
        low=0.01,
        high=0.02,
        form="{:.4f}",
        source="Fig. 5",
        fitted=True,
    ),
    ClaimOverSeeds(
        "head map does not jump",
        "The damage, which is the arm's, leaves the head map alone: its peak stays within a tenth of its value before.",
        head_jump,
        "below",
        low=1 + LEVEL_DISTORTION,
        form="{:.2f}",
        unit="× its value before",
        source="section IV, Fig. 5, no number given",
    ),
)
