"""The page of learners and damages: made from the committed tables, and true of tables whose numbers are known."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from learners_cells import Cells, bounds, tables
from learners_figures import draw, steps
from learners_page import below, judged
from learners_page import page as page_of
from make_learners import PAGE
from somatopy.analysis.cells import StudyResult, to_table
from somatopy.clock import FRAMES_PER_MINUTE, WINDOW

INTACT, AFTER = 12, 6
#: Efficiency in percent by seed and window of a phase.
Curve = Callable[[int, int], float]


def row(factors: dict[str, Any], seed: int, phase: int, curve: Curve) -> dict[str, Any]:
    """A row of a cell in which half of the frames can be seen, and of these the given percentage is."""
    windows = INTACT if phase == 0 else AFTER
    hits = [round(curve(seed, k) / 100 * WINDOW / 2) for k in range(windows)]
    minutes = WINDOW // FRAMES_PER_MINUTE
    return {
        "condition": ", ".join(factors.values()),
        "key": f"{factors} {seed}",
        "cpu_s": 36.0,
        "seed": seed,
        "phase": phase,
        "frames": windows * WINDOW,
        "efficiency": 2 * sum(hits) / windows / WINDOW,
        "hits_per_window": hits,
        "ceiling_per_window": [0.5] * windows,
        "hits_per_minute": [hit // minutes for hit in hits for _ in range(minutes)],
        "ceiling_per_minute": [0.5] * windows * minutes,
        "plateau": 0.5,
    }


def study(name: str, seeds: int, every: dict[tuple[str, ...], tuple[Curve, Curve]], keys: tuple[str, ...]) -> Any:
    """A study with these curves before and after, by the values of its factors."""
    conditions, rows = {}, []
    for values, curves in every.items():
        factors = dict(zip(keys, values, strict=True))
        conditions[", ".join(values)] = {"factors": factors, "seeds": [*range(seeds)]}
        rows += [row(factors, seed, k, curves[k]) for seed in range(seeds) for k in (0, 1)]
    return StudyResult(Path(name), to_table(rows), [], {"order": [*conditions], "conditions": conditions})


def level(value: float) -> Curve:
    return lambda seed, window: value


def main_study(before: float, after: float) -> StudyResult:
    curves = {"none": (level(before), level(before)), "paper": (level(before), level(after))}
    every = {(learner, damage): both for learner in ("best", "hebbian") for damage, both in curves.items()}
    return study("learners", 3, every, ("learner", "damage"))


def line_of(page: str, *words: str) -> list[str]:
    (found,) = [line for line in page.splitlines() if line.startswith("| " + " | ".join(words))]
    return [cell.strip() for cell in found.strip("|").split("|")]


def test_the_page_is_made_from_the_committed_tables() -> None:
    """Every number of docs/learners.md follows from studies/."""
    assert page_of(tables(), bounds()) == PAGE.read_text(encoding="utf-8")


@pytest.mark.parametrize(("level_", "verdict"), [(90.0, "**floor missed**"), (92.0, "floor met"), (96.0, "goal met")])
def test_a_level_is_judged_by_floor_and_goal(level_: float, verdict: str) -> None:
    """Hits of which we know the share give that share, and the verdict that follows from 91 and 95 percent."""
    page = page_of({"learners": main_study(level_, 50.0)}, {})
    cells = line_of(page, "paper-wide", "second five minutes", "")
    assert cells[4:] == [f"{level_:.1f} [{level_:.1f}, {level_:.1f}]", "91", "95", verdict, "3"]
    assert line_of(page, "mechanical", "second five minutes", "")[7:] == ["not run yet", "0"]


def test_the_first_sentences_have_the_numbers() -> None:
    """After a damage the share of the undamaged run is told: 36 of 90 percent are 40."""
    said = " ".join(page_of({"learners": main_study(90.0, 36.0)}, {}).split("**Not finished")[0].split())
    assert "`best` sees it in **90.0 %** of the frames of its second five minutes" in said
    assert "`best` is at **40.0 %** of what it reaches without damage" in said
    assert said.count("(3 seeds)") == 2


def test_what_is_not_finished_is_named() -> None:
    """A study with a part of its cells, and one without any."""
    page = page_of({"learners": main_study(90.0, 36.0)}, {})
    assert "`learners` (12 of 80 cells)" in page and "`learners-lost` (0 of 1,260 cells)" in page


def lost_study(weak: dict[tuple[str, int], float], damages: tuple[str, ...]) -> StudyResult:
    """All at 90 percent, but for some damages and seeds from the fourth window after the damage on."""
    every = {}
    for damage in ("none", *damages):

        def after(seed: int, window: int, damage: str = damage) -> float:
            return weak.get((damage, seed), 90.0) if window >= 3 else 90.0

        every["mechanical", damage] = (level(90.0), after)
    return study("learners-lost", 2, every, ("babbling.range", "damage"))


def test_lost_cells_are_named_and_no_others() -> None:
    """Below 90 % of the fork, which is 81 here: 80 is lost, 82 is not."""
    found = lost_study({("gain", 1): 80.0, ("swapped", 0): 82.0}, ("gain", "swapped"))
    shares = judged(Cells(found), {})
    assert {place: [*below(those)] for place, those in shares.items()} == {
        ("mechanical", "gain"): [1],
        ("mechanical", "swapped"): [],
    }
    page = page_of({"learners-lost": found}, {})
    assert "Of 4 damaged runs" in page and line_of(page, "mechanical", "gain")[2:] == ["1 of 2", "94.4", "88.9 (1)"]


def test_a_dead_joint_is_judged_by_what_can_be_attained() -> None:
    """Half of its fork is enough where an oracle attains no more, and not where it attains 70 percent."""
    found = Cells(lost_study({("dead-joint-1", seed): 45.0 for seed in (0, 1)}, ("dead-joint-1",)))

    def lost(reference: float) -> list[int]:
        shares = judged(found, {"mechanical": {"references": {"7": {"dead-joint-1": reference}}}})
        return [len(below(those)) for those in shares.values()]

    assert lost(0.45) == [0] and lost(0.7) == [2]
    assert judged(found, {}) == {}


def test_damages_that_take_information_away_are_not_in_the_mean() -> None:
    """Two damages that keep it, at 80 and 100 percent of the fork, give 90, whatever a dead joint does."""
    levels = {"none": 90.0, "gain": 72.0, "swapped": 90.0, "dead-joint-1": 9.0, "noise": 9.0}
    every = {("best", damage): (level(90.0), level(value)) for damage, value in levels.items()}
    found = study("learners-damages", 3, every, ("learner", "damage"))
    page = page_of({"learners-damages": found}, {})
    moment = ("paper-wide", "second five minutes after a damage")
    assert line_of(page, *moment, "mean of 2")[4:] == ["90.0 [90.0, 90.0]", "96", "98", "**floor missed**", "3"]
    assert line_of(page, *moment, "worst: *gain*")[4] == "80.0 [80.0, 80.0]"
    assert "| dead-joint-1 | 10.0 [10.0, 10.0] | 3 |" in page


def test_figures_are_drawn(tmp_path: Path) -> None:
    """The curve that the README shows, and the panels of all damages."""
    every = {("best", damage): (level(90.0), level(80.0)) for damage in ("none", "gain")}
    damages = study("learners-damages", 2, every, ("learner", "damage"))
    draw({"learners": main_study(90.0, 36.0), "learners-damages": damages}, tmp_path)
    assert {file.name for file in tmp_path.iterdir()} == {"learners.png", "learners_damages.png"}


def test_steps_pool_hits_and_what_could_be_seen() -> None:
    """A level curve is that level in each step of two minutes."""
    cells = Cells(main_study(90.0, 36.0))
    for phase, expected in ((0, 90.0), (1, 36.0)):
        found = steps(cells, ("paper-wide", "best", "paper"), phase)
        assert found.shape == (3, 30 if phase == 0 else 15) and found == pytest.approx(expected)


def test_the_error_of_the_ceiling_and_the_misses_are_told() -> None:
    """A grid that finds 0.505 and not 0.5 says that efficiency is 1 % too high; classes have their names."""
    grids = {"ceiling": 0.5, "ceiling_finer": 0.505, "slivers": 0.02}
    misses = {
        **{"gazes": [0, 1, 5], "by_gazes": [0.4, 0.03, 0.015], "grid": 2089, "frames": 2000},
        **{"ages": [0, 2], "missed_by_age": [0.5, None], "frames_by_age": [80, 0]},
    }
    page = page_of({}, {"mechanical": {"references": {}, "grids": grids, "misses": misses}})
    assert "| mechanical | 50.00 | 50.50 | 1.00 | 2.0 |" in page
    assert "| range | 1 to 4 | 5 to 2,089 |" in page and "| mechanical | 3.0 | 1.5 |" in page
    assert "| range | 0 to 1 | 2 and more |" in page and "| mechanical | 50 (80) |  |" in page
