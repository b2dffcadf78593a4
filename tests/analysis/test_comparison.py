"""Conditions side by side: closed forms, hand-made tables, and what does not depend on the order of anything."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from somatopy.analysis.comparison import MEASURES, Comparison, compare, courses
from somatopy.analysis.runs import RunFolderError

PLASTIC = {0: [0.50, 0.40], 1: [0.54, 0.42], 2: [0.58, 0.44]}
FROZEN = {0: [0.40, 0.20], 1: [0.42, 0.22], 2: [0.47, 0.21]}
DAMAGES = ("none", "offset")


def rate(comparison: Comparison, condition: str, phase: int = 0) -> Any:
    (row,) = comparison.of(condition, phase, "rate")
    return row


def test_mean_and_interval_are_students(make_study: Any) -> None:
    """Three seeds: mean ± 4.3027 sd / sqrt(3); the quantile of two degrees of freedom has a closed form."""
    row = rate(compare(make_study({"plastic": PLASTIC}, DAMAGES)), "plastic")
    quantile = 2 * (0.975 - 0.5) * math.sqrt(2 / (1 - (2 * 0.975 - 1) ** 2))
    assert row.values == {0: 0.50, 1: 0.54, 2: 0.58}
    assert row.interval.mean == pytest.approx(0.54)
    assert row.interval.high - row.interval.mean == pytest.approx(quantile * 0.04 / math.sqrt(3))


def test_differences_are_between_runs_of_one_seed(make_study: Any) -> None:
    """Seeds that only one of both has do not count; p of two degrees of freedom in closed form."""
    frozen = {seed: FROZEN[seed] for seed in (0, 1, 2)} | {9: [0.01, 0.01]}
    row = rate(compare(make_study({"plastic": PLASTIC, "frozen": frozen}, DAMAGES)), "frozen")
    found = np.array([-0.10, -0.12, -0.11])
    t = found.mean() / (found.std(ddof=1) / math.sqrt(3))
    assert row.interval.n == 4 and row.difference.seeds == (0, 1, 2)
    assert row.difference.interval.mean == pytest.approx(-0.11)
    assert row.difference.p == pytest.approx(1 - abs(t) / math.sqrt(2 + t * t))


def test_p_values_of_a_measure_are_adjusted_together(make_study: Any) -> None:
    """Holm by hand: the smallest times their number, and none below one before it; other measures do not count."""
    third = {0: [0.51, 0.41], 1: [0.50, 0.47], 2: [0.60, 0.40]}
    comparison = compare(make_study({"plastic": PLASTIC, "frozen": FROZEN, "third": third}, DAMAGES))
    rows = [rate(comparison, name, phase) for name in ("frozen", "third") for phase in (0, 1)]
    order = sorted(rows, key=lambda row: row.difference.p)
    expected = np.minimum(np.maximum.accumulate([row.difference.p * (4 - k) for k, row in enumerate(order)]), 1)
    assert [row.p_holm for row in order] == pytest.approx(expected)


def test_any_condition_can_be_the_one_compared_with(make_study: Any) -> None:
    """Differences turn around, means stay."""
    study = make_study({"plastic": PLASTIC, "frozen": FROZEN}, DAMAGES)
    ahead, back = compare(study), compare(study, "frozen")
    assert (ahead.against, back.against) == ("plastic", "frozen")
    one, other = rate(ahead, "frozen").difference, rate(back, "plastic").difference
    assert other.interval.mean == pytest.approx(-one.interval.mean) and other.p == pytest.approx(one.p)
    assert rate(ahead, "frozen").interval == rate(back, "frozen").interval
    assert rate(back, "frozen").difference is None
    with pytest.raises(RunFolderError, match=r"no condition 'x' to compare with; there are: 'plastic', 'frozen'\.$"):
        compare(study, "x")


def test_conditions_come_in_the_order_of_the_study(make_study: Any) -> None:
    """Whatever the order in which cells ended; one that has none is left out, and the next is compared with."""
    study = make_study({"b": FROZEN, "a": PLASTIC}, DAMAGES, order=["gone", "b", "a"])
    assert [(name, phase) for name, phase, _ in compare(study).phases()] == [("b", 0), ("b", 1), ("a", 0), ("a", 1)]
    assert compare(study).against == "b"
    mixed = replace(study, table=study.table.take(np.random.default_rng(0).permutation(study.table.num_rows)))
    assert compare(mixed) == compare(study)


def test_phases_say_what_was_done(make_study: Any) -> None:
    """By their damage, whatever they are called; kinds of one's own without their place; none without frames."""
    damages = ("none", "offset+my_lab.harm:Tremor", "none")
    study = make_study({"a": {0: [0.5, 0.4, None]}}, damages, frames=(9000, 9000, 0))
    assert compare(study).phases() == [("a", 0, "intact"), ("a", 1, "offset+Tremor")]


def test_every_segment_has_its_slope(make_study: Any) -> None:
    """Lists are compared place by place; what a phase is too short for has no mean."""
    slopes = ([3.0], [8.0, None])
    comparison = compare(make_study({"a": PLASTIC, "b": FROZEN}, DAMAGES, slopes=slopes))
    first, second = comparison.of("b", 1, "slopes")
    assert (first.segment, first.interval.mean, first.difference.interval.mean) == (0, 8.0, 0.0)
    assert (second.segment, second.interval.n, second.interval.mean, second.difference) == (1, 0, None, None)


def test_what_is_too_little_has_no_difference(make_study: Any) -> None:
    """One seed has no interval; one shared seed, or none, no difference; equal runs one of 0, untested."""
    study = make_study({"a": PLASTIC, "same": PLASTIC, "one": {0: [0.3, 0.3]}, "other": {7: [0.3, 0.3]}}, DAMAGES)
    comparison = compare(study)
    one, other, same = (rate(comparison, name) for name in ("one", "other", "same"))
    assert one.interval.low is None and one.difference is None and other.difference is None
    assert (same.difference.interval.mean, same.difference.p, same.p_holm) == (0.0, None, None)


def test_nothing_finished_is_nothing_compared(make_study: Any) -> None:
    """No rows, no error; but a condition that is named must be there."""
    study = make_study({}, order=["a"])
    assert compare(study) == Comparison("", ()) and courses(study)[0] == []
    with pytest.raises(RunFolderError, match="none has finished cells"):
        compare(study, "a")


def test_measures_may_be_chosen(make_study: Any) -> None:
    """Only those are compared."""
    rows = compare(make_study({"a": PLASTIC}, DAMAGES), measures=MEASURES[1:2]).rows
    assert {row.measure.column for row in rows} == {"efficiency"}


def test_courses_run_over_all_phases_with_gaps_between(make_study: Any) -> None:
    """Windows at their starts, hits of every seed, range of few seeds, the border where the damage comes."""
    (course,), band = courses(make_study({"a": PLASTIC}, DAMAGES))
    np.testing.assert_array_equal(course.at, [0, 1, np.nan, 2, 3])
    np.testing.assert_array_equal(course.seeds[1], [2430, 2439, np.nan, 1890, 1899])
    np.testing.assert_array_equal(course.low, [2250, 2259, np.nan, 1800, 1809])
    np.testing.assert_array_equal(course.high, [2610, 2619, np.nan, 1980, 1989])
    np.testing.assert_allclose(course.mean, course.seeds[1])
    assert (band, course.borders, course.end) == ("range", ((2.0, "damage"),), 4.0)


def test_bands_of_five_seeds_are_intervals(make_study: Any) -> None:
    """The same as the interval of the mean of each window; one condition of fewer seeds makes all bands ranges."""
    five = {seed: [0.3 + 0.02 * seed**2] for seed in range(5)}
    (course,), band = courses(make_study({"a": five}))
    interval = rate(compare(make_study({"a": five})), "a").interval
    assert band == "interval"
    assert (course.low[0], course.high[0]) == pytest.approx((4500 * interval.low, 4500 * interval.high), abs=1)
    for few in ({0: [0.1]}, {seed: five[seed] for seed in range(4)}):
        assert courses(make_study({"a": five, "b": few}))[1] == "range"


def test_a_window_that_only_some_seeds_have(make_study: Any) -> None:
    """Its mean is theirs; its interval needs two; nothing is warned of."""
    cells = {seed: [0.1] for seed in range(5)}
    study = make_study({"a": cells})
    rows = study.table.to_pylist()
    for row in rows[1:]:
        row["hits_per_window"] = row["hits_per_window"][:1]
    import pyarrow as pa

    (course,), _ = courses(replace(study, table=pa.Table.from_pylist(rows, study.table.schema)))
    assert course.mean.tolist() == [450.0, 459.0]
    assert course.low[0] == course.high[0] == 450.0 and np.isnan([course.low[1], course.high[1]]).all()
