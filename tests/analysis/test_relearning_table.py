"""The table of learners and damages: numbers that are put in come out, nobody who never got there is forgotten."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tests.analysis.damaged_rows import FACTORS, row, study

from somatopy.analysis.cells import StudyResult
from somatopy.analysis.relearning_table import WIDTH, Cell, Relearning, relearning, relearning_text
from somatopy.interventions import SUITE


def told(row: dict[str, Any], **more: Any) -> dict[str, Any]:
    return row | more


@pytest.fixture
def result() -> StudyResult:
    """Learner a under three seeds, which is back after 6, 8 and never; b has finished with its first phase alone."""
    rows = []
    for seed, back in enumerate((6, 8, 30)):
        fork = [0.8] * 30
        damaged = [0.2] * back + [0.8] * (30 - back)
        first = told(row("a, none", [0.4] * 30, phase=0, seed=seed), plateau=0.4 + 0.1 * seed, minutes_to_95=None)
        rows += [first, first | {"condition": "a, gain", "key": "a, gain"}]
        rows.append(told(row("a, none", fork, seed=seed), plateau=0.8, dip=0.9, minutes_back=0.0))
        rows.append(
            told(row("a, gain", damaged, seed=seed), plateau=0.8, dip=0.25, minutes_back=1.0, minutes_to_95=2.0)
        )
        rows.append(told(row("a, gain", fork, phase=2, seed=seed), plateau=0.8, retention=0.9, retention_minutes=None))
    rows.append(told(row("b, none", [0.4] * 30, phase=0), plateau=0.1))
    return study(rows, FACTORS)


def cells(table: Relearning | None, learner: str, damage: str) -> dict[tuple[str, str], Cell]:
    assert table is not None
    (entry,) = [entry for entry in table.entries if (entry.learner, entry.damage) == (learner, damage)]
    return dict(zip(table.heads, entry.cells, strict=True))


def test_means_stand_with_half_of_their_interval(result: StudyResult) -> None:
    """Of .4, .5, .6: the mean .5, and 4.303 standard errors, .248; one seed has no interval."""
    table = relearning(result)
    assert cells(table, "a", "intact")["level", "%"] == ("50.0", "±24.8")
    assert cells(table, "b", "intact")["level", "%"] == ("10.0", "")
    assert cells(table, "a", "gain")["after the damage", "dip %"] == ("25", "±0")
    assert [(entry.learner, entry.damage) for entry in table.entries] == [
        *(("a", "intact"), ("a", "none"), ("a", "gain"), ("b", "intact"))
    ]


def test_who_never_got_there_is_counted(result: StudyResult) -> None:
    """Means are those of the others, and say how many they are; where it does not apply there is a dash."""
    damaged, intact = (cells(relearning(result), "a", damage) for damage in ("gain", "intact"))
    assert damaged["after the damage", "back"] == ("7.0", "2/3")
    assert intact["minutes to", "95 %"] == ("never", "0/3") and damaged["minutes to", "95 %"] == ("2.0", "±0.0")
    assert damaged["undone", "kept"] == ("90", "±0") and damaged["undone", "back"] == ("never", "0/3")
    assert intact["after the damage", "back"] == ("—", "")
    assert cells(relearning(result), "a", "none")["after the damage", "lost"] == ("—", "")


def test_losses_are_against_the_fork(result: StudyResult) -> None:
    """.6 for 6, 8 and 30 minutes; a quarter of the fork in the first window."""
    damaged = cells(relearning(result), "a", "gain")
    assert float(damaged["after the damage", "lost"].mean) == pytest.approx(0.6 * (6 + 8 + 30) / 3, abs=0.01)
    assert damaged["% of the fork in window", "1"] == ("25.0", "±0.0")


def test_without_an_undamaged_run_the_level_before_stands_in(result: StudyResult) -> None:
    """And the legend says so."""
    rows = [each for each in result.table.to_pylist() if each["condition"] == "a, gain"]
    alone = study(rows, {"a, gain": FACTORS["a, gain"]})
    table = relearning(alone)
    assert table is not None and cells(table, "a", "gain")["after the damage", "back"] == ("1.0", "±0.0")
    assert "95 % of the level before" in " ".join(table.legend) and ("% of the fork in window", "1") not in table.heads
    assert "95 % of the fork's" in " ".join(relearning(result).legend)  # type: ignore[union-attr]


def test_studies_without_damages_or_ceilings_have_none() -> None:
    """They have other tables."""
    rows = [row("slow", [0.4] * 6, phase=0) | {"plateau": 0.4}]
    assert relearning(study(rows, {"slow": {"speed": 1}})) is None
    assert relearning(study([], FACTORS)) is None
    assert relearning(study([row("a, none", [0.4] * 6, phase=0)], FACTORS)) is None


def test_nineteen_damages_fit_a_terminal() -> None:
    """No line of four learners under the whole suite is wider than 120 columns, and each number is in its column."""
    rng, rows, factors = np.random.default_rng(0), [], {}
    measured = {"minutes_to_50": 10.5, "minutes_to_90": 20.5, "minutes_to_95": 25.5, "dip": 0.25, "minutes_back": 12.0}
    rest = {"miss_distance_rad": 0.15, "learner_us": 35.0, "learner_bytes": 150_000}
    for damage in ("none", *SUITE):
        factors[damage] = {"learner": "hebbian", "damage": damage}
        for seed in range(2):
            rows += [row(damage, [0.5] * 30, phase, seed) | measured | rest for phase in (0, 1, 2)]
            rows[-1] |= {"retention": 0.9, "retention_minutes": rng.uniform(1, 20)}
            for each in rows[-3:]:
                each["plateau"] = rng.uniform(0.1, 1.0)
    table = relearning(study(rows, factors))
    assert table is not None and len(table.heads) == 16
    lines = relearning_text(table).splitlines()
    assert max(map(len, lines)) <= WIDTH
    first = next(line for line in lines if line.startswith("  offset-0.3"))
    assert first.split()[1:] == [cell.mean for cell in table.entries[2].cells]
