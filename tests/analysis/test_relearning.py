"""Measures of a learning curve, held against curves whose answers are known without computing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

from somatopy.analysis.relearning import (
    Curve,
    deficit,
    dip,
    minutes_back,
    minutes_to,
    of_phase,
    plateau,
    retention,
)
from somatopy.clock import FRAMES_PER_MINUTE, TEN_SECONDS

STEP = TEN_SECONDS / FRAMES_PER_MINUTE  # minutes


def curve(efficiency: ArrayLike, visible: ArrayLike = 100.0) -> Curve:
    """A curve in steps of ten seconds."""
    shares = np.asarray(efficiency, float)
    frames = np.broadcast_to(np.asarray(visible, float), shares.shape)
    return Curve(shares * frames, frames, STEP)


def minutes(*stretches: tuple[float, float]) -> Any:
    """Efficiency in steps of ten seconds: pairs of minutes and level, one after the other."""
    return np.concatenate([np.full(round(long / STEP), level) for long, level in stretches])


# -- learning ----------------------------------------------------------------------------------------------------------


def test_a_step_is_reached_when_it_comes() -> None:
    """Half of it half a minute before, since the running minute then holds as much of both."""
    step = curve(minutes((6, 0.0), (12, 0.8)))
    assert plateau(step) == pytest.approx(0.8)
    assert minutes_to(step, 0.8) == pytest.approx(6.0)
    assert minutes_to(step, 0.4) == pytest.approx(5.5)
    assert minutes_to(curve(minutes((9, 0.5))), 0.5) == 0.0


@pytest.mark.parametrize("part", [0.5, 0.9, 0.95])
def test_an_exponential_is_reached_after_its_logarithm(part: float) -> None:
    """1 - exp(-t / 4 min) has a share p after -4 log(1 - p) minutes: they lie in the first minute that has it."""
    t = (np.arange(600) + 0.5) * STEP
    learned = curve(1 - np.exp(-t / 4.0))
    assert plateau(learned) == pytest.approx(1.0, abs=1e-6)
    found = minutes_to(learned, part)
    assert found is not None and found <= -4 * np.log(1 - part) <= found + 1.0


def test_a_level_that_is_never_reached_is_none() -> None:
    """Whatever stands for a missing level: a plateau of nothing is no plateau to reach."""
    flat = curve(minutes((9, 0.3)))
    assert minutes_to(flat, 0.31) is None and minutes_to(flat, None) is None and minutes_to(flat, 0.0) is None
    assert minutes_to(curve([0.9, 0.9]), 0.1) is None  # shorter than a minute
    assert plateau(curve([0.9, 0.9])) is None and plateau(curve(minutes((9, 0.0)))) == 0.0


def test_the_plateau_pools_frames_and_takes_the_last_third() -> None:
    """Steps in which the hand could hardly be seen count for little; those in which it could not, for nothing."""
    shares = minutes((4, 0.1), (1, 0.9), (1, 0.3))
    assert plateau(curve(shares)) == pytest.approx(0.6)
    assert plateau(curve(shares, minutes((5, 30.0), (1, 10.0)))) == pytest.approx(0.75)
    hidden = curve(minutes((4, 0.1), (1, 0.9), (1, 0.0)), minutes((5, 30.0), (1, 0.0)))
    assert plateau(hidden) == pytest.approx(0.9)
    assert np.isnan(hidden.efficiency()[-6:]).all() and plateau(curve(minutes((6, 0.0)), 0.0)) is None


# -- a damage ----------------------------------------------------------------------------------------------------------


def test_a_dip_and_its_recovery() -> None:
    """From .8 to .2 for seven minutes, then .8 again: a quarter is left, .6 times seven minutes are lost."""
    dipped = curve(minutes((7, 0.2), (23, 0.8)))
    assert dip(dipped, 0.8) == pytest.approx(0.25)
    assert deficit(dipped, 0.8) == pytest.approx(0.6 * 7)
    back = minutes_back(dipped, 0.8)  # five minutes of which x are bad have .8 - .6 x / 5, at least 95 % of .8
    assert back == pytest.approx(7 - 0.05 * 0.8 * 5 / 0.6, abs=STEP)
    assert retention(dipped, 0.8) == pytest.approx(0.25)


def test_a_dip_is_looked_for_up_to_the_end_of_the_fifth_minute() -> None:
    """A fall in that minute alone is found whole."""
    assert dip(curve(minutes((4, 0.8), (1, 0.2), (15, 0.8))), 0.8) == pytest.approx(0.25)


def test_back_is_told_by_five_minutes() -> None:
    """Of which two may be at .7 where 95 % of .8 are asked for: so it is back two minutes before it is at .8."""
    assert minutes_back(curve(minutes((7, 0.7), (23, 0.8))), 0.8) == pytest.approx(5.0)


def test_only_what_stays_is_back() -> None:
    """A second fall counts, and who ends below is not back; who never fell needs no time, and has no deficit."""
    twice = curve(minutes((5, 0.2), (10, 0.8), (5, 0.2), (10, 0.8)))
    found = minutes_back(twice, 0.8)
    assert found is not None and 19 < found <= 20
    assert minutes_back(curve(minutes((5, 0.2), (10, 0.8), (5, 0.2))), 0.8) is None
    unharmed = curve(minutes((30, 0.8)))
    assert minutes_back(unharmed, 0.8) == 0.0 and dip(unharmed, 0.8) == pytest.approx(1.0)
    assert deficit(unharmed, 0.8) == pytest.approx(0.0) and deficit(unharmed, 0.7) == pytest.approx(-0.1 * 30)


def test_a_fall_after_five_minutes_is_no_dip() -> None:
    """It shows in the deficit, and in the minutes until it is over."""
    late = curve(minutes((5, 0.8), (5, 0.0), (10, 0.8)))
    assert dip(late, 0.8) == pytest.approx(1.0)
    assert deficit(late, 0.8) == pytest.approx(0.8 * 5)


def test_without_a_level_before_nothing_is_told() -> None:
    """Neither without a ceiling, nor where a learner never saw anything before."""
    some, empty = curve(minutes((9, 0.3))), Curve.of([150] * 60, [], TEN_SECONDS, STEP)
    for found in (dip(some, None), minutes_back(some, None), deficit(some, None), retention(some, 0.0), dip(some, 0.0)):
        assert found is None
    assert plateau(empty) is dip(empty, 0.5) is minutes_back(empty, 0.5) is deficit(empty, 0.5) is None


# -- a phase -----------------------------------------------------------------------------------------------------------


def flags(shares: Any, ceiling: float) -> Any:
    """Frames with so many hits among the visible ones, evenly in each step of ten seconds."""
    counts = np.rint(np.asarray(shares) * ceiling * TEN_SECONDS)
    return (np.arange(TEN_SECONDS) < counts[:, None]).ravel()


def row(frames: int, damage: str, reached: float | None) -> dict[str, Any]:
    return {"frames": frames, "damage": damage, "plateau": reached}


def test_a_phase_is_told_by_efficiency_not_by_hits() -> None:
    """The same shares under any ceiling give the same measures; minutes are counted whole."""
    before = [row(9000, "none", 0.8)]
    for ceiling in (1.0, 0.5):
        shares = minutes((6, 0.2), (9, 0.8), (0.5, 0.8))
        found = of_phase(flags(shares, ceiling), [ceiling] * len(shares), "gain", before)
        assert found["plateau"] == pytest.approx(0.8) and found["level_before"] == 0.8
        assert found["dip"] == pytest.approx(0.25) and found["deficit_minutes"] == pytest.approx(3.6)
        assert found["hits_per_minute"] == [round(900 * ceiling * level) for level in [0.2] * 6 + [0.8] * 9]
        assert found["ceiling_per_minute"] == pytest.approx([ceiling] * 15)
        assert found["retention"] is found["retention_minutes"] is None


def test_levels_are_those_of_the_last_undamaged_phase() -> None:
    """Also after two damages, and where the damage is undone, which alone has a retention; the first phase has none."""
    healthy, shares = flags(minutes((2, 0.4), (4, 0.8)), 1.0), [1.0] * 36
    first = of_phase(healthy, shares, "none", [])
    for name in ("level_before", "dip", "minutes_back", "deficit_minutes", "retention", "retention_minutes"):
        assert first[name] is None
    before = [row(9, "none", 0.7), row(9, "none", 0.8), row(9, "gain", 0.1), row(0, "none", None), row(9, "drift", 0.2)]
    assert of_phase(healthy, shares, "noise", before)["level_before"] == 0.8
    healed = of_phase(healthy, shares, "none", before)
    assert healed["retention"] == pytest.approx(0.5) and 1.5 < healed["retention_minutes"] <= 2
    assert of_phase(healthy, shares, "none", before[:2])["retention"] is None


def test_what_is_kept_is_measured_by_the_level_before_not_by_what_it_comes_to() -> None:
    """From .4 to .8, where .5 was before: .8 of it is kept, and 95 % of it come soon, long before 95 % of .8."""
    before = [row(9, "none", 0.5), row(9, "gain", 0.1)]
    healed = of_phase(flags(minutes((2, 0.4), (4, 0.8)), 1.0), [1.0] * 36, "none", before)
    assert healed["retention"] == pytest.approx(0.8)
    # .4 + .4 x >= .475 for the share x of a minute that is good: two steps of ten seconds, after eight of them
    assert healed["retention_minutes"] == pytest.approx(8 * STEP)


def test_without_a_ceiling_only_hits_are_known() -> None:
    """All else is null, as it is for a phase without frames."""
    bare, none = of_phase(flags([0.5] * 12, 1.0), [], "none", []), of_phase(np.empty(0, bool), [], "none", [])
    assert bare.pop("hits_per_minute") == [450, 450] and none.pop("hits_per_minute") == []
    assert bare.pop("ceiling_per_minute") == [] == none.pop("ceiling_per_minute")
    assert {*bare.values(), *none.values()} == {None}
