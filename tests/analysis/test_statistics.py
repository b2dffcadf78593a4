"""Statistics over seeds: published examples, laws, and how often the intervals keep what they promise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import astuple, replace
from math import comb, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from statsmodels.stats.multitest import multipletests

from somatopy.analysis.statistics import (
    MIN_BOOTSTRAP,
    Interval,
    equivalent,
    holm,
    mean_interval,
    paired,
    prediction_interval,
    seeds_needed,
    shows,
)

#: Student (1908), hours of sleep that ten patients gained: group 2 and group 1 in R's data set of that name.
SLEEP_2 = [1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4]
SLEEP_1 = [0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0]
#: Darwin (1876), crossed less self-fertilised maize in eighths of an inch; Fisher (1935) has its t test.
DARWIN = [49, -67, 8, 16, 6, 23, 28, 41, 14, 29, 56, 24, 75, 60, -48]
#: Hahn and Meeker (1991): readings of five units, mean 50.10, standard deviation 1.31.
UNITS = [51.4, 49.5, 48.7, 49.3, 51.6]

VALUES = st.lists(st.integers(-1000, 1000).map(lambda k: k / 8), min_size=2, max_size=15)
P_VALUES = st.dictionaries(st.text(max_size=3), st.none() | st.floats(0, 1), max_size=8)


def by_seed(values: list[float]) -> dict[int, float]:
    return dict(enumerate(values, start=1))


def skewed(n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).exponential(size=n)


def sample(n: int, mean: float, sd: float) -> np.ndarray:
    """Numbers with exactly this mean and standard deviation."""
    values = np.linspace(-1, 1, n)
    return mean + sd * values / values.std(ddof=1)


def test_interval_of_a_published_example() -> None:
    """R's documentation gives Student's sleep data: mean 1.58, 95 % interval .7001142 to 2.4598858."""
    interval = mean_interval(np.subtract(SLEEP_2, SLEEP_1))
    assert (interval.mean, interval.low, interval.high) == pytest.approx((1.58, 0.7001142, 2.4598858), abs=1e-7)
    assert (interval.n, interval.method, interval.iqm) == (10, "t", None)
    assert interval.sd == pytest.approx(1.229995, abs=1e-6)


def test_prediction_of_a_published_example() -> None:
    """Hahn and Meeker: 50.10 ± 3.04 × 1.31 for one more unit, against 50.10 ± 1.24 × 1.31 for the mean."""
    assert prediction_interval(UNITS) == pytest.approx((46.1, 54.1), abs=0.05)
    interval = mean_interval(UNITS)
    assert (interval.low, interval.high) == pytest.approx((48.5, 51.7), abs=0.05)


@given(VALUES)
def test_prediction_is_wider_than_the_mean_by_a_known_factor(values: list[float]) -> None:
    """sqrt(1 + 1/n) over sqrt(1/n)."""
    interval, ends = mean_interval(values), prediction_interval(values)
    assert ends is not None and interval.low is not None and interval.high is not None
    assert ends[1] - ends[0] == pytest.approx(sqrt(len(values) + 1) * (interval.high - interval.low))
    assert sum(ends) == pytest.approx(interval.low + interval.high, abs=1e-9)


@pytest.mark.parametrize("n", [3, 10, 19])
def test_student_covers_what_it_promises(n: int) -> None:
    """Of 400 intervals from normal seeds, 380 ± 13 (three binomial errors) hold the mean; so with one more seed."""
    rng = np.random.default_rng(n)
    held = predicted = 0
    for values in rng.normal(5, 2, size=(400, n + 1)):
        interval, ends = mean_interval(values[:-1]), prediction_interval(values[:-1])
        assert interval.low is not None and interval.high is not None and ends is not None
        held += interval.low <= 5 <= interval.high
        predicted += ends[0] <= values[-1] <= ends[1]
    assert abs(held - 380) <= 13 and abs(predicted - 380) <= 13


def test_bca_covers_normal_seeds_as_theory_says() -> None:
    """With normal values BCa is mean ± 1.96 s sqrt((n-1)/n) / sqrt(n): of 400 intervals, 92.9 % ± 3.8 hold the mean."""
    n = MIN_BOOTSTRAP
    expected = 1 - 2 * stats.t.sf(1.959964 * sqrt((n - 1) / n), n - 1)
    held = 0
    for values in np.random.default_rng(1).normal(size=(400, n)):
        interval = mean_interval(values)
        assert interval.low is not None and interval.high is not None
        held += interval.low <= 0 <= interval.high
    assert expected == pytest.approx(0.929, abs=1e-3)
    assert abs(held / 400 - expected) <= 3 * sqrt(expected * (1 - expected) / 400)


def test_bca_misses_skewed_seeds_more_evenly_than_student() -> None:
    """Exponential seeds: covers at least 88 %, and the rarer of both misses is not as rare as Student's."""
    n, above, below, student = 25, 0, 0, 0
    reach = stats.t.ppf(0.975, n - 1) / sqrt(n)
    for values in np.random.default_rng(2).exponential(size=(400, n)):
        interval = mean_interval(values)
        assert interval.low is not None and interval.high is not None
        above += interval.low > 1
        below += interval.high < 1
        student += values.mean() - reach * values.std(ddof=1) > 1
    assert 0.88 <= 1 - (above + below) / 400 <= 0.97
    assert min(above, below) > student


def written_out(values: np.ndarray, statistic: Callable[[np.ndarray], np.ndarray]) -> tuple[float, float]:
    """BCa after Efron and Tibshirani (1993), equations 14.9 to 14.15, with resamples of its own."""
    n = len(values)
    found = statistic(values)
    resampled = statistic(values[np.random.default_rng(99).integers(n, size=(40000, n))])
    left = np.array([statistic(np.delete(values, i)) for i in range(n)])
    z0 = stats.norm.ppf(np.mean(resampled < found))
    deviation = left.mean() - left
    a = (deviation**3).sum() / (6 * (deviation**2).sum() ** 1.5)
    z = z0 + stats.norm.ppf([0.025, 0.975])
    low, high = np.quantile(resampled, stats.norm.cdf(z0 + z / (1 - a * z)))
    return float(low), float(high)


def middle_half(values: np.ndarray) -> np.ndarray:
    n = values.shape[-1]
    return np.sort(values, axis=-1)[..., n // 4 : n - n // 4].mean(axis=-1)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_bca_is_the_formula_written_out(seed: int) -> None:
    """24 skewed seeds, within 5 % of the interval's width: four standard errors of an end from 10,000 resamples."""
    values = skewed(24, seed)
    interval = mean_interval(values)
    ends, iqm_ends = written_out(values, lambda v: v.mean(axis=-1)), written_out(values, middle_half)
    assert interval.method == "BCa"
    assert (interval.low, interval.high) == pytest.approx(ends, abs=0.05 * np.ptp(ends))
    assert interval.iqm == pytest.approx(float(middle_half(values)))
    assert (interval.iqm_low, interval.iqm_high) == pytest.approx(iqm_ends, abs=0.05 * np.ptp(iqm_ends))


@pytest.mark.parametrize("n", [9, 21])
def test_order_of_seeds_does_not_matter(n: int) -> None:
    """The same values in another order give the same bytes."""
    values = skewed(n)
    shuffled = np.random.default_rng(7).permutation(values)
    assert astuple(mean_interval(shuffled)) == astuple(mean_interval(values))
    assert prediction_interval(shuffled) == prediction_interval(values)
    assert equivalent(shuffled, 0.3, 1) == equivalent(values, 0.3, 1)
    assert paired(by_seed(list(values)), dict.fromkeys(range(1, n + 1), 0.5)) == paired(
        dict(reversed(by_seed(list(values)).items())), dict.fromkeys(range(1, n + 1), 0.5)
    )


@pytest.mark.parametrize("n", [9, 21])
@settings(max_examples=8)
@given(shift=st.integers(-50, 50), scale=st.floats(0.1, 10))
def test_intervals_follow_shift_and_scale(n: int, shift: int, scale: float) -> None:
    """Another zero or another unit changes the numbers and nothing else."""
    before, after = mean_interval(skewed(n)), mean_interval(shift + scale * skewed(n))
    assert after.sd == pytest.approx(scale * (before.sd or 0))
    for name in ("mean", "low", "high", "iqm", "iqm_low", "iqm_high"):
        old, new = getattr(before, name), getattr(after, name)
        assert new == (None if old is None else pytest.approx(shift + scale * old, abs=1e-6))


def test_runaway_seeds_leave_the_interquartile_mean_alone() -> None:
    """A seed a million times as large moves the mean only."""
    values = np.sort(skewed(20))
    runaway = np.append(values[:-1], 1e6)
    assert mean_interval(runaway).iqm == mean_interval(values).iqm
    assert (mean_interval(runaway).mean or 0) > 1e4


@pytest.mark.parametrize("n", [2, 5, 20, 33])
def test_equal_seeds_have_an_interval_of_no_width(n: int) -> None:
    """Without rounding: .1 is .1."""
    interval = mean_interval([0.1] * n)
    assert (interval.mean, interval.sd, interval.low, interval.high) == (0.1, 0, 0.1, 0.1)
    assert (interval.iqm, interval.iqm_low, interval.iqm_high) == ((0.1,) * 3 if n >= 20 else (None,) * 3)
    assert prediction_interval([0.1] * n) == (0.1, 0.1)


def test_few_seeds_tell_little() -> None:
    """None: nothing. One: a mean. Two: the widest of Student's intervals, ± 12.706 standard errors."""
    assert mean_interval([]) == Interval(0, None, None, None, None, None)
    assert mean_interval([3]) == Interval(1, 3, None, None, None, None)
    two = mean_interval([0, 2])
    assert (two.mean, two.low, two.high, two.method) == pytest.approx((1, -11.7062, 13.7062, "t"), abs=1e-4)
    assert prediction_interval([]) is None and prediction_interval([3]) is None
    assert shows([], 1).p == 1 and equivalent([], 1).verdict == equivalent([0], 1).verdict == "cannot tell"


@pytest.mark.parametrize(("n", "method"), [(19, "t"), (20, "BCa")])
def test_from_twenty_seeds_on_intervals_are_bootstrapped(n: int, method: str) -> None:
    """And only then there is an interquartile mean."""
    interval = mean_interval(skewed(n))
    assert interval.method == method and (interval.iqm is None) == (method == "t")


def test_a_middle_half_of_one_value_has_no_interval() -> None:
    """Where leaving out any seed changes nothing, BCa has no acceleration; the mean's interval stays."""
    interval = mean_interval([0.0] * 18 + [1.0, 2.0])
    assert (interval.iqm, interval.iqm_low, interval.iqm_high) == (0, None, None)
    assert interval.low is not None and interval.high is not None and 0 <= interval.low < 0.15 < interval.high


@pytest.mark.parametrize("missing", [float("nan"), None, float("inf")])
@pytest.mark.parametrize(
    "function", [mean_interval, prediction_interval, lambda v: shows(v, 1), lambda v: equivalent(v, 1)]
)
def test_missing_values_are_named(function: Callable[[list[float | None]], object], missing: float | None) -> None:
    """By their place."""
    with pytest.raises(ValueError, match=r"values\[2\] = (nan|inf) is missing or not finite; leave such seeds out"):
        function([1.0, 2.0, missing, 3.0])


def test_values_are_one_a_seed() -> None:
    """A table of values is refused rather than flattened."""
    with pytest.raises(ValueError, match=r"values has shape \(2, 2\); it must have one number a seed"):
        mean_interval([[1, 2], [3, 4]])


@given(VALUES, st.sampled_from([1, -1]), st.integers(1, 20).map(lambda k: k / 20))
def test_shown_is_the_binomial_tail(values: list[float], sign: int, chance: float) -> None:
    """Term by term; zeros are on neither side."""
    shown, n = shows(values, sign, chance), len(values)
    tail = sum(comb(n, k) * chance**k * (1 - chance) ** (n - k) for k in range(shown.count, n + 1))
    assert shown.p == pytest.approx(tail)
    assert shown.count + shows(values, -sign).count + values.count(0) == n


def test_all_of_ten_seeds() -> None:
    """2^-10, as in the sign test."""
    assert shows(range(1, 11), 1).p == pytest.approx(1 / 1024)
    assert shows(range(1, 11), -1).p == 1


@pytest.mark.parametrize(("sign", "chance", "name"), [(0, 0.5, "sign"), (2, 0.5, "sign"), (1, 0, "chance")])
def test_what_shows_cannot_ask(sign: int, chance: float, name: str) -> None:
    """A sign is 1 or -1; a chance of 0 would prove anything."""
    with pytest.raises(ValueError, match=f"{name} = "):
        shows([1, 2], sign, chance)


def test_equivalence_of_a_published_example() -> None:
    """Lakens (2017): m = .54 against .5, sd 1.2, n = 100, margins of .3 sd. t(99) = -2.67, p = .0045."""
    found = equivalent(sample(100, 0.54, 1.2), margin=0.36, centre=0.5)
    assert found.p == pytest.approx(float(stats.t.sf(0.32 / 0.12, 99))) == pytest.approx(0.0045, abs=5e-5)
    assert (found.low, found.high) == pytest.approx((0.5 - 0.1592, 0.5 + 0.2392), abs=1e-4)
    assert found.verdict == "level"


@given(VALUES, st.floats(0.01, 200), st.floats(-100, 100))
def test_verdict_and_p_value_agree(values: list[float], margin: float, centre: float) -> None:
    """Schuirmann (1987): the 90 % interval lies within the margins if and only if both tests reject at 5 %."""
    found = equivalent(values, margin, centre)
    if found.p is None:
        assert len(set(values)) == 1
    elif abs(found.p - 0.05) > 1e-6:
        assert (found.verdict == "level") == (found.p < 0.05)
    if found.verdict == "not level":
        assert found.mean is not None and abs(found.mean - centre) > margin


def test_three_verdicts() -> None:
    """Standard error .1, 9 degrees of freedom: 90 % is ± .183, 95 % ± .226."""
    for mean, verdict in ((0.3, "level"), (0.33, "cannot tell"), (0.72, "cannot tell"), (0.73, "not level")):
        assert equivalent(sample(10, mean, sqrt(0.1)), 0.5).verdict == verdict
        assert equivalent(sample(10, -mean, sqrt(0.1)), 0.5).verdict == verdict
    assert equivalent([0.2, 0.2], 0.5).verdict == "level"
    assert equivalent([0.7, 0.7], 0.5).verdict == "not level"


@pytest.mark.parametrize("margin", [0, -1, float("nan")])
def test_margins_are_positive(margin: float) -> None:
    """Nothing is as good as a value within nothing."""
    with pytest.raises(ValueError, match=r"margin = .* must be positive"):
        equivalent([1, 2], margin)


def test_pairs_of_published_examples() -> None:
    """Sleep: p = .002833 (R). Darwin: p = .0497 (Fisher 1935), by ranks 24 against 96 and .04126 (R)."""
    assert paired(by_seed(SLEEP_2), by_seed(SLEEP_1)).p == pytest.approx(0.002833, abs=5e-7)
    darwin = paired(by_seed([100 + d for d in DARWIN]), by_seed([100] * 15))
    assert darwin.p == pytest.approx(0.0497, abs=5e-5)
    assert darwin.p_rank == pytest.approx(0.04126, abs=5e-6)


@given(st.dictionaries(st.integers(0, 9), st.integers(0, 4500)), st.dictionaries(st.integers(0, 9), st.integers(0, 99)))
def test_pairs_are_of_common_seeds(a: dict[int, float], b: dict[int, float]) -> None:
    """Others change nothing; a - b and b - a are mirror images."""
    common = sorted(set(a) & set(b))
    if len(common) < 2:
        with pytest.raises(ValueError, match="two or more in common"):
            paired(a, b)
        return
    there, back = paired(a, b), paired(b, a)
    assert there.seeds == tuple(common)
    assert there.interval == mean_interval([a[seed] - b[seed] for seed in common])
    assert there.interval.low == pytest.approx(-(back.interval.high or 0))
    assert (there.p, there.p_rank) == pytest.approx((back.p, back.p_rank))


def test_pairs_without_scatter() -> None:
    """Equal differences give t no scale; ranks can still tell, unless all are 0."""
    same = by_seed([1, 2, 3, 4, 5])
    equal = paired({seed: value + 1 for seed, value in same.items()}, same)
    assert equal.p is None and equal.p_rank == pytest.approx(2 / 2**5)
    none = paired(same, same)
    assert none.p is None and none.p_rank is None and none.interval.mean == 0


def test_what_pairs_lack_is_named() -> None:
    """Both lists of seeds, or the seed whose value is missing."""
    with pytest.raises(ValueError, match=r"values_a has the seeds \[1, 2\] and values_b \[2, 7\]"):
        paired({2: 0, 1: 0}, {7: 0, 2: 0})
    with pytest.raises(ValueError, match=r"values_b\[12\] = nan is missing or not finite"):
        paired({11: 1, 12: 2}, {11: 1, 12: float("nan")})


def test_holm_on_a_worked_example() -> None:
    """p = .01, .04, .03, .005 times 3, 1, 2, 4, none below a smaller one's: .03, .06, .06, .02."""
    adjusted = holm({"1": 0.01, "2": 0.04, "none": None, "3": 0.03, "4": 0.005})
    assert list(adjusted) == ["1", "2", "none", "3", "4"]
    assert list(adjusted.values()) == [pytest.approx(0.03), pytest.approx(0.06), None, pytest.approx(0.06), 0.02]


@given(P_VALUES)
def test_holm_lies_between_no_correction_and_bonferronis(p_values: dict[str, float | None]) -> None:
    """Keeps names, Nones and order of p values; the least is Bonferroni's."""
    adjusted = holm(p_values)
    assert list(adjusted) == list(p_values)
    known = sorted((p, adjusted[name]) for name, p in p_values.items() if p is not None)
    assert [name for name in p_values if adjusted[name] is None] == [n for n, p in p_values.items() if p is None]
    for (p, q), least in zip(known, [(0.0, 0.0), *known], strict=False):
        assert q is not None and least[1] is not None
        assert p - 1e-12 <= q <= min(1, len(known) * p) + 1e-12 and q >= least[1]
    if known:
        assert known[0][1] == pytest.approx(min(1, len(known) * known[0][0]))


def test_holm_is_that_of_statsmodels() -> None:
    """Bit for bit, with equal p values, 0 and 1 among them."""
    values = [*(np.random.default_rng(0).random(20) / 30).tolist(), 0.01, 0.01, 0.0, 1.0]
    adjusted = holm({str(k): p for k, p in enumerate(values)})
    assert [*adjusted.values()] == multipletests(values, method="holm")[1].tolist()


def test_holm_names_what_is_no_probability() -> None:
    """A p value above 1 or nan is a mistake of the caller's."""
    for wrong in (1.2, -0.1, float("nan")):
        with pytest.raises(ValueError, match=r"p_values\['jump'\] = .* must lie in \[0, 1\]"):
            holm({"rise": 0.1, "jump": wrong})


@pytest.mark.parametrize(("size", "seeds"), [(0.2, 199), (0.5, 34), (0.8, 15)])
def test_seeds_needed_for_cohens_effects(size: float, seeds: int) -> None:
    """Small, medium and large effects in a one-sample t test, two-sided, power .8 (G*Power's numbers)."""
    assert seeds_needed(size, 1) == seeds_needed(-40 * size, 40) == seeds


@pytest.mark.parametrize(("size", "power"), [(0.5, 0.8), (1.0, 0.9), (1.6, 0.95)])
def test_power_by_simulation(size: float, power: float) -> None:
    """Of 200,000 experiments with so many seeds the share wanted finds the effect; with one seed less, fewer do."""
    seeds = seeds_needed(size, 1, power)
    assert seeds is not None
    rng = np.random.default_rng(3)

    def found(n: int) -> float:
        t = (rng.normal(size=200_000) + size * sqrt(n)) / np.sqrt(rng.chisquare(n - 1, size=200_000) / (n - 1))
        return float(np.mean(abs(t) > stats.t.ppf(0.975, n - 1)))

    assert found(seeds - 1) < power < found(seeds) + 0.003


def test_seeds_needed_at_the_ends() -> None:
    """Nothing cannot be found; a huge effect takes three; a tiny one very many."""
    assert seeds_needed(0, 1) is None and seeds_needed(0, 0) is None
    assert {seeds_needed(effect, sd) for effect, sd in ((5, 1), (8, 1), (1e6, 1), (-3, 0))} == {3}
    assert seeds_needed(1e-3, 1) == pytest.approx((1.959964 + 0.841621) ** 2 * 1e6, rel=1e-5)


def test_what_no_number_of_seeds_means() -> None:
    """Spread, effect and probabilities are checked before anything is solved."""
    with pytest.raises(ValueError, match=r"sd = -1 must be finite, and sd at least 0"):
        seeds_needed(1, -1)
    with pytest.raises(ValueError, match=r"effect = nan"):
        seeds_needed(float("nan"), 1)
    with pytest.raises(ValueError, match=r"alpha = 0.05 and power = 0.01 must satisfy 0 < alpha < power < 1"):
        seeds_needed(1, 1, power=0.01)


def test_the_interquartile_mean_can_be_left_out() -> None:
    """All else stays as it is, to the last bit."""
    values = {seed: value for seed, value in enumerate(np.random.default_rng(0).lognormal(size=25).tolist())}
    whole, without = mean_interval([*values.values()]), mean_interval([*values.values()], iqm=False)
    assert replace(whole, iqm=None, iqm_low=None, iqm_high=None) == without and whole.iqm is not None
    zeros = dict.fromkeys(values, 0.0)
    assert paired(values, zeros, iqm=False).interval == without
