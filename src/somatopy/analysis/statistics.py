"""Statistics over seeds: the seed is the unit, one number of each run.

Below 20 seeds, the interval of a mean is Student's, which is exact for normal values whatever their number. From 20
seeds on it is the bias-corrected and accelerated bootstrap (BCa; Efron 1987), which follows skewed values: it misses on
either side more evenly. The interquartile mean stands beside it, which a few runaway seeds cannot move (Agarwal and
others 2021). BCa covers the mean less often than it says while seeds are few (Owen 2025, arXiv 2508.10083): at 20
seeds about 93 % of the time for normal values, where it is 9 % narrower than Student's, 92 % for exponential and 86 %
for lognormal ones. Tests, equivalence and prediction stay with Student whatever the number of seeds; a rank test
stands beside where pairs are compared.

Nothing here depends on the order of seeds, and the bootstrap draws the same resamples each time: equal values, equal
bytes. A missing value is an error; the caller drops seeds and says so.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import ceil, sqrt
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from somatopy.percept import Floats

__all__ = [
    "MIN_BOOTSTRAP",
    "Difference",
    "Equivalence",
    "Interval",
    "Shown",
    "equivalent",
    "holm",
    "mean_interval",
    "paired",
    "prediction_interval",
    "seeds_needed",
    "shows",
]

#: Seeds from which on intervals are bootstrapped.
MIN_BOOTSTRAP = 20
#: Effects of more standard deviations than this count as this many: they need three seeds, and two are no plan.
LARGEST_EFFECT = 5.0

Bounds = tuple[float, float]
Verdict = Literal["level", "not level", "cannot tell"]


@dataclass(frozen=True)
class Interval:
    """A mean over seeds with its 95 % interval. What too few seeds cannot tell is None.

    Attributes:
        n: number of seeds.
        mean: their mean; None without seeds.
        sd: standard deviation of one seed, with n - 1; None below two seeds.
        low: lower end of the 95 % interval of the mean; None below two seeds. Seeds that are all equal have an interval
            of no width.
        high: its upper end.
        method: "t" below `MIN_BOOTSTRAP` seeds, "BCa" from there on, None where there is no interval.
        iqm: mean of the middle half of the seeds; None below `MIN_BOOTSTRAP`, and where it was not asked for.
        iqm_low: lower end of its 95 % interval, BCa; None also where the middle half is one value that leaving out any
            seed does not change.
        iqm_high: its upper end.
    """

    n: int
    mean: float | None
    sd: float | None
    low: float | None
    high: float | None
    method: Literal["t", "BCa"] | None
    iqm: float | None = None
    iqm_low: float | None = None
    iqm_high: float | None = None


@dataclass(frozen=True)
class Shown:
    """How many seeds show an effect's sign.

    Attributes:
        count: seeds that show it.
        n: all seeds.
        chance: share of seeds that would show it by chance.
        p: probability of at least as many by chance (binomial, one-sided).
    """

    count: int
    n: int
    chance: float
    p: float


@dataclass(frozen=True)
class Equivalence:
    """Whether a mean over seeds is as good as a given value.

    Attributes:
        n: number of seeds.
        mean: their mean; None without seeds.
        low: lower end of the 90 % interval of the mean (Student's t), the interval that two one-sided tests of 5 % each
            stand for; None below two seeds.
        high: its upper end.
        p: the larger p value of the two one-sided tests; None below two seeds, or where all are equal.
        verdict: "level" if the 90 % interval lies within the margins; "not level" if the 95 % interval lies beyond one
            of them; else "cannot tell".
    """

    n: int
    mean: float | None
    low: float | None
    high: float | None
    p: float | None
    verdict: Verdict


@dataclass(frozen=True)
class Difference:
    """Two sorts of runs compared seed by seed.

    Attributes:
        seeds: those that both have, ascending.
        interval: of the differences a - b.
        p: of the paired t test, two-sided; None where all differences are equal, which leaves t no scale.
        p_rank: of Wilcoxon's signed-rank test, two-sided; None where all differences are 0.
    """

    seeds: tuple[int, ...]
    interval: Interval
    p: float | None
    p_rank: float | None


def mean_interval(values: ArrayLike, iqm: bool = True) -> Interval:
    """Mean over seeds with its 95 % interval.

    Args:
        values: one a seed, in any order, shape (n,).
        iqm: whether the interquartile mean is computed too, whose bootstrap takes two thirds of the time.

    Raises:
        ValueError: a value is missing or not finite.

    Example:
        >>> interval = mean_interval([1.2, 2.4, 1.3, 1.3, 0.0, 1.0, 1.8, 0.8, 4.6, 1.4])
        >>> f"{interval.mean:.2f}, 95 % {interval.low:.2f} to {interval.high:.2f} ({interval.method}, n = {interval.n})"
        '1.58, 95 % 0.70 to 2.46 (t, n = 10)'
    """
    numbers = np.sort(_finite(values))
    mean, sd = _mean_sd(numbers)
    if len(numbers) < MIN_BOOTSTRAP:
        low, high = _t_bounds(numbers, _error(numbers)) or (None, None)
        return Interval(len(numbers), mean, sd, low, high, None if low is None else "t")
    low, high = _bca(numbers, np.mean) or (None, None)
    if not iqm:
        return Interval(len(numbers), mean, sd, low, high, "BCa")
    iqm_low, iqm_high = _bca(numbers, _iqm) or (None, None)
    return Interval(len(numbers), mean, sd, low, high, "BCa", float(_iqm(numbers)), iqm_low, iqm_high)


def prediction_interval(values: ArrayLike) -> tuple[float, float] | None:
    """Where one more seed would fall with 95 % probability, if values are normal (Hahn and Meeker 1991, chapter 4).

    This is what a single run of somebody else, such as the paper's, is compared with; the interval of the mean is too
    narrow for it.

    Args:
        values: one a seed, in any order, shape (n,).

    Returns:
        Both ends; None below two seeds.

    Raises:
        ValueError: a value is missing or not finite.

    Example:
        >>> low, high = prediction_interval([51.4, 49.5, 48.7, 49.3, 51.6])
        >>> f"{low:.1f} to {high:.1f}"
        '46.1 to 54.1'
    """
    numbers = np.sort(_finite(values))
    return _t_bounds(numbers, _error(numbers) * sqrt(1 + len(numbers)))


def shows(values: ArrayLike, sign: int, chance: float = 0.5) -> Shown:
    """How many seeds lie on one side of 0, and how probable as many are by chance.

    Args:
        values: one a seed, shape (n,). A value of 0 is on neither side and shows nothing.
        sign: 1 or -1, the side in question.
        chance: share of chance runs that show it. Where k of m runs of a control do, take (k + 1) / (m + 1): a share of
            0 would make every p value 0 (Phipson and Smyth 2010).

    Raises:
        ValueError: a value is missing or not finite, the sign is neither, or chance is not above 0 and at most 1.

    Example:
        >>> shows([12.1, 9.7, 3.0, -1.2, 8.8], sign=1)
        Shown(count=4, n=5, chance=0.5, p=0.1875)
    """
    from scipy.stats import binomtest

    if sign not in (1, -1):
        raise ValueError(f"sign = {sign} must be 1 (above 0) or -1 (below 0).")
    if not 0 < chance <= 1:
        raise ValueError(f"chance = {chance} must be above 0 and at most 1; from a control: (k + 1) / (m + 1).")
    numbers = _finite(values)
    count, n = int(np.sum(sign * numbers > 0)), len(numbers)
    p = float(binomtest(count, n, chance, alternative="greater").pvalue) if n else 1.0
    return Shown(count, n, chance, p)


def equivalent(values: ArrayLike, margin: float, centre: float = 0.0) -> Equivalence:
    """Whether the mean over seeds lies within centre ± margin: two one-sided t tests (Schuirmann 1987).

    A slope whose interval holds 0 is not thereby level: few seeds hold anything. This asks for evidence of levelness.

    Args:
        values: one a seed, in any order, shape (n,).
        margin: greatest deviation that counts as none, positive, in the values' unit. To be settled before looking.
        centre: the value to be as good as.

    Raises:
        ValueError: a value is missing or not finite, or the margin is not positive.

    Example:
        >>> slopes = [0.3, -0.2, 0.1, 0.0, -0.4, 0.2]
        >>> equivalent(slopes, margin=1).verdict, equivalent(slopes, margin=0.1).verdict
        ('level', 'cannot tell')
    """
    from statsmodels.stats.weightstats import DescrStatsW

    if not margin > 0:
        raise ValueError(f"margin = {margin} must be positive: the greatest deviation that counts as none.")
    numbers = np.sort(_finite(values))
    mean, sd = _mean_sd(numbers)
    margins = (centre - margin, centre + margin)
    p = float(DescrStatsW(numbers).ttost_mean(*margins)[0]) if sd else None
    inner, outer = (_t_bounds(numbers, _error(numbers), level) for level in (0.90, 0.95))
    low, high = inner or (None, None)
    return Equivalence(len(numbers), mean, low, high, p, _verdict(inner, outer, *margins))


def _verdict(inner: Bounds | None, outer: Bounds | None, least: float, most: float) -> Verdict:
    if inner and least < inner[0] and inner[1] < most:
        return "level"
    return "not level" if outer and (outer[0] > most or outer[1] < least) else "cannot tell"


def paired(values_a: Mapping[int, float], values_b: Mapping[int, float], iqm: bool = True) -> Difference:
    """Differences a - b between runs of the same seed, which share the arm's movement.

    Args:
        values_a: by seed.
        values_b: by seed. Seeds that only one of both has are left out.
        iqm: see `mean_interval`.

    Raises:
        ValueError: fewer than two seeds in common, or a value of theirs is missing or not finite.

    Example:
        >>> plastic, frozen = {1: 62.0, 2: 58.5, 3: 60.1, 4: 59.0}, {1: 55.2, 2: 54.1, 3: 52.9, 5: 50.0}
        >>> difference = paired(plastic, frozen)
        >>> difference.seeds, round(difference.interval.mean, 2), round(difference.p, 3), difference.p_rank
        ((1, 2, 3), 6.13, 0.02, 0.25)
    """
    from scipy.stats import ttest_1samp, wilcoxon

    seeds = tuple(sorted(values_a.keys() & values_b.keys()))
    if len(seeds) < 2:
        raise ValueError(
            f"values_a has the seeds {sorted(values_a)} and values_b {sorted(values_b)}: a paired comparison needs two "
            "or more in common."
        )
    a = _finite([values_a[seed] for seed in seeds], "values_a", seeds)
    b = _finite([values_b[seed] for seed in seeds], "values_b", seeds)
    differences = np.sort(a - b)
    p = float(ttest_1samp(differences, 0.0).pvalue) if np.ptp(differences) else None
    p_rank = float(wilcoxon(differences).pvalue) if differences.any() else None
    return Difference(seeds, mean_interval(differences, iqm), p, p_rank)


def holm(p_values: Mapping[str, float | None]) -> dict[str, float | None]:
    """p values adjusted for their number (Holm 1979): the chance of any false alarm among them stays below the level.

    Args:
        p_values: by the test's name; None for a test that could not be done, which is kept and not counted.

    Returns:
        By name, in the same order.

    Raises:
        ValueError: a p value is not in [0, 1].

    Example:
        >>> holm({"rise": 0.01, "level": None, "jump": 0.04})
        {'rise': 0.02, 'level': None, 'jump': 0.04}
    """
    known = {name: p for name, p in p_values.items() if p is not None}
    for name, p in known.items():
        if not 0 <= p <= 1:
            raise ValueError(f"p_values[{name!r}] = {p} must lie in [0, 1], or be None for a test that was not done.")
    if not known:
        return dict(p_values)
    values = np.array([*known.values()], dtype=float)
    order = np.argsort(values)  # by hand: statsmodels' multipletests collects all garbage of the process at each call
    adjusted = np.empty_like(values)
    adjusted[order] = np.minimum(np.maximum.accumulate(np.arange(len(values), 0, -1) * values[order]), 1.0)
    return {**p_values, **dict(zip(known, adjusted.tolist(), strict=True))}


def seeds_needed(effect: float, sd: float, power: float = 0.8, alpha: float = 0.05) -> int | None:
    """Seeds with which a two-sided t test finds a mean that differs from 0.

    Args:
        effect: the mean to be found.
        sd: standard deviation of one seed, in the same unit, at least 0.
        power: probability to find it.
        alpha: level of the test, below the power.

    Returns:
        Three or more; None for an effect of 0, which no number of seeds finds. Effects beyond five standard deviations
        count as five.

    Raises:
        ValueError: effect or sd is not finite, sd is negative, or not 0 < alpha < power < 1.

    Example:
        >>> seeds_needed(effect=5, sd=10), seeds_needed(effect=8, sd=10)
        (34, 15)
    """
    from statsmodels.stats.power import TTestPower

    if not (np.isfinite(effect) and np.isfinite(sd) and sd >= 0):
        raise ValueError(f"effect = {effect} and sd = {sd} must be finite, and sd at least 0.")
    if not 0 < alpha < power < 1:
        raise ValueError(f"alpha = {alpha} and power = {power} must satisfy 0 < alpha < power < 1.")
    if effect == 0:
        return None
    size = abs(effect) / max(sd, abs(effect) / LARGEST_EFFECT)
    return max(3, ceil(float(TTestPower().solve_power(effect_size=size, alpha=alpha, power=power))))


def _finite(values: ArrayLike, name: str = "values", labels: Sequence[int] = ()) -> Floats:
    """Values as numbers, none of them missing; the error calls each by its label, or else by its place."""
    numbers = np.asarray(values, dtype=np.float64)
    if numbers.ndim != 1:
        raise ValueError(f"{name} has shape {numbers.shape}; it must have one number a seed, shape (n,).")
    wrong = np.flatnonzero(~np.isfinite(numbers))
    if len(wrong):
        label = labels[wrong[0]] if labels else wrong[0]
        raise ValueError(f"{name}[{label}] = {numbers[wrong[0]]} is missing or not finite; leave such seeds out.")
    return numbers


def _mean_sd(numbers: Floats) -> tuple[float | None, float | None]:
    if len(numbers) == 0:
        return None, None
    if np.ptp(numbers) == 0:  # spared the rounding, so that equal values have exactly their mean and a plain 0
        return float(numbers[0]), 0.0 if len(numbers) > 1 else None
    return float(numbers.mean()), float(numbers.std(ddof=1))


def _error(numbers: Floats) -> float:
    """Standard error of the mean; 0 where there is none."""
    sd = _mean_sd(numbers)[1]
    return sd / sqrt(len(numbers)) if sd else 0.0


def _t_bounds(numbers: Floats, error: float, level: float = 0.95) -> Bounds | None:
    """The mean ± Student's quantile times an error; None below two numbers."""
    from scipy.special import stdtrit

    mean = _mean_sd(numbers)[0]
    if mean is None or len(numbers) < 2:
        return None
    half = float(stdtrit(len(numbers) - 1, (1 + level) / 2)) * error
    return mean - half, mean + half


def _iqm(numbers: Floats, axis: int = 0) -> Any:
    from scipy.stats import trim_mean

    return trim_mean(numbers, 0.25, axis=axis)


def _bca(numbers: Floats, statistic: Callable[..., Any]) -> Bounds | None:
    """BCa interval from the same 9,999 resamples each time, which leave its ends unsure by about 1 % of its width.

    None where it is not defined.
    """
    from scipy.stats import DegenerateDataWarning, bootstrap

    if np.ptp(numbers) == 0:
        return float(numbers[0]), float(numbers[0])
    with warnings.catch_warnings(), np.errstate(invalid="ignore"):
        warnings.simplefilter("ignore", DegenerateDataWarning)
        done = bootstrap((numbers,), statistic, method="BCa", vectorized=True, rng=np.random.default_rng(0))
    low, high = map(float, done.confidence_interval)
    return (low, high) if np.isfinite(low) and np.isfinite(high) else None
