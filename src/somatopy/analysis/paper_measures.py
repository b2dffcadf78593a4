"""The numbers in which the paper's curves are read, by seed: what its claims and the calibration are about."""

from __future__ import annotations

from collections.abc import Callable
from statistics import fmean

from somatopy.analysis.cells import StudyResult
from somatopy.clock import WINDOW

__all__ = [
    "BySeed",
    "Measure",
    "arm_drift",
    "arm_early_share",
    "arm_fall",
    "arm_fall_after",
    "arm_jump",
    "head_jump",
    "level_after",
    "loss_of_level",
    "measure",
]

BySeed = dict[int, float]
#: A measure of a condition of a study.
Measure = Callable[[StudyResult, str], BySeed]

#: Windows of the second phase after which the paper's third trend begins.
SECOND_TREND = 7
#: Minutes in which the paper's arm distortion falls (section IV, Fig. 4).
FALL_MINUTES = 5


def measure(name: str, phase: int, place: int | None = None) -> Measure:
    """A column of the table of cells as a measure; see `StudyResult.values`."""
    return lambda result, condition: result.values(condition, name, phase, place)


def level_after(result: StudyResult, condition: str) -> BySeed:
    """The rate in the windows of the paper's third trend: from 35 minutes after the damage on."""
    counts = result.values(condition, "hits_per_window", 1)
    return {seed: fmean(each[SECOND_TREND:]) / WINDOW for seed, each in counts.items() if len(each) > SECOND_TREND}


def loss_of_level(result: StudyResult, condition: str) -> BySeed:
    """What the damage costs for good: `level_after` less the rate at the end of phase 1, on its trend line."""
    before = result.values(condition, "line_ends", 0, 0)
    return _pairs(level_after(result, condition), before, lambda after, end: after - end)


def arm_fall(result: StudyResult, condition: str) -> BySeed:
    """The arm distortion at the end of phase 1, as a multiple of its start."""
    return _ratio(result, condition, ("arm_distortion_end", 0), ("arm_distortion_start", 0))


def arm_early_share(result: StudyResult, condition: str) -> BySeed:
    """The share of that fall which the first five minutes have; 0 where it does not fall."""
    found = {}
    for seed, curve in result.values(condition, "arm_distortion", 0).items():
        known = [value for value in curve if value is not None]
        if len(curve) >= FALL_MINUTES and curve[FALL_MINUTES - 1] is not None:
            fall = known[0] - known[-1]
            found[seed] = (known[0] - curve[FALL_MINUTES - 1]) / fall if fall > 0 else 0.0
    return found


def arm_drift(result: StudyResult, condition: str) -> BySeed:
    """By what share of itself the arm distortion changes from minute 5 to the end of phase 1."""
    found = {}
    for seed, curve in result.values(condition, "arm_distortion", 0).items():
        if len(curve) > FALL_MINUTES and curve[FALL_MINUTES - 1] and curve[-1] is not None:
            found[seed] = curve[-1] / curve[FALL_MINUTES - 1] - 1
    return found


def arm_jump(result: StudyResult, condition: str) -> BySeed:
    """The peak of the arm distortion after the damage, as a multiple of its value before."""
    return _ratio(result, condition, ("arm_distortion_peak", 1), ("arm_distortion_end", 0))


def arm_fall_after(result: StudyResult, condition: str) -> BySeed:
    """The arm distortion at the end, as a multiple of its peak after the damage."""
    return _ratio(result, condition, ("arm_distortion_end", 1), ("arm_distortion_peak", 1))


def head_jump(result: StudyResult, condition: str) -> BySeed:
    """The peak of the head distortion after the damage, as a multiple of its value before."""
    return _ratio(result, condition, ("head_distortion_peak", 1), ("head_distortion_end", 0))


def _ratio(result: StudyResult, condition: str, above: tuple[str, int], below: tuple[str, int]) -> BySeed:
    over, under = (result.values(condition, name, phase) for name, phase in (above, below))
    return _pairs(over, {seed: value for seed, value in under.items() if value}, lambda a, b: a / b)


def _pairs(first: BySeed, second: BySeed, joined: Callable[[float, float], float]) -> BySeed:
    return {seed: joined(first[seed], second[seed]) for seed in first if seed in second}
