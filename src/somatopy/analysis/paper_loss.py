"""How far a condition's runs are from the paper's curves: the loss of the calibration.

It is fixed before anything is searched; docs/calibration.md says what came of it. Each landmark is a number of the
paper, or a band that its text gives, with a scale: the standard deviation over seeds that a trial of ten seeds had
where there is one, else a share that is stated here. The last trend of the paper is no landmark: whether the hand is
seen more and more often again is left for the confirmation to tell.
"""

from __future__ import annotations

import math
from statistics import fmean
from typing import NamedTuple

from somatopy.analysis.cells import StudyResult
from somatopy.analysis.paper_measures import Measure, arm_early_share, arm_fall_after, arm_jump, level_after, measure
from somatopy.analysis.table import PAPER_FRAMES, PAPER_HITS, PAPER_TRENDS
from somatopy.clock import WINDOW

__all__ = ["LANDMARKS", "Landmark", "distances", "paper"]


class Landmark(NamedTuple):
    """A number that runs should come near to.

    Attributes:
        name: what it is.
        low: the least value that fits; equal to `high` where the paper gives one number.
        high: the greatest value that fits.
        scale: what counts as one.
        value: the measure, by seed; their mean counts.
        source: where in the paper it stands, and where the scale is from.
    """

    name: str
    low: float
    high: float
    scale: float
    value: Measure
    source: str


def paper(result: StudyResult, condition: str) -> float:
    """The root mean square of the distances to all landmarks, in scales; infinite where one cannot be told.

    Args:
        result: a study.
        condition: the name of one of its conditions.
    """
    found = distances(result, condition)
    return math.sqrt(fmean(distance**2 for distance in found.values())) if found else math.inf


def distances(result: StudyResult, condition: str) -> dict[str, float]:
    """The distance to each landmark, in scales, with its sign; empty where one cannot be told."""
    found = {}
    for mark in LANDMARKS:
        values = mark.value(result, condition)
        if not values:
            return {}
        value = fmean(values.values())
        found[mark.name] = (value - min(max(value, mark.low), mark.high)) / mark.scale
    return found


_RATE = PAPER_HITS / PAPER_FRAMES[0]
_REST = PAPER_TRENDS[2]
_REST_RATE = _REST.at((_REST.last - _REST.first) / 2) / WINDOW

#: What the calibration fits, with scales; a trial is the one of ten seeds that came nearest to the paper.
LANDMARKS: tuple[Landmark, ...] = (
    Landmark("level", _RATE, _RATE, 0.056, measure("rate", 0), "hits of phase 1, section IV; scale of a trial"),
    Landmark(
        "slope",
        *(PAPER_TRENDS[0].slope, PAPER_TRENDS[0].slope, 7.8),
        measure("slopes", 0, 0),
        "first trend of Fig. 3; scale of a trial",
    ),
    Landmark(
        "drop",
        *(PAPER_TRENDS[1].slope, PAPER_TRENDS[1].slope, 41.0),
        measure("slopes", 1, 0),
        "second trend of Fig. 3, seven windows; scale of a trial",
    ),
    Landmark(
        "level after", _REST_RATE, _REST_RATE, 0.045, level_after, "mean of the third line of Fig. 3; scale of a trial"
    ),
    Landmark(
        "early fall",
        *(0.75, math.inf, 0.25),
        arm_early_share,
        "Fig. 4: the arm distortion falls in the first 5 minutes, then it is level; three quarters or more fit",
    ),
    Landmark(
        "jump",
        1.25,
        math.inf,
        0.25,
        arm_jump,
        "Fig. 4: the arm distortion jumps at the damage; by a quarter or more fits",
    ),
    Landmark(
        "fall after", 0.0, 0.95, 0.1, arm_fall_after, "Fig. 4: it falls again; by a twentieth of its peak or more fits"
    ),
    Landmark(
        "head distortion",
        *(0.01, 0.02, 0.005),
        measure("head_distortion_end", 0),
        "Fig. 5: between 0.01 and 0.02; scale: half of that band",
    ),
)
