"""Small multiples of damages: a panel each, lines that are the efficiencies put in."""

from __future__ import annotations

import numpy as np
import pytest
from tests.analysis.damaged_rows import FACTORS, row, study

from somatopy.analysis.figures.relearning import course, relearning_figure


def test_lines_are_pooled_efficiencies_around_the_damage() -> None:
    """Two minutes a step, all seeds together by frames; ten minutes before the damage, a gap between phases."""
    rows = [row("a", [0.4] * 20, phase=0), row("a", [0.2, 0.4, 0.6, 0.8, 0.9])]
    at, shown = course(rows)
    assert at[~np.isnan(at)].tolist() == [-9, -7, -5, -3, -1, 1, 3]
    assert shown[~np.isnan(shown)] == pytest.approx([40] * 5 + [30, 70], abs=0.1)
    assert np.isnan(at[5]) and np.isnan(shown[5])
    more = [*rows, row("a", [0.8] * 20, phase=0, seed=1, ceiling=0.25), row("a", [0.0] * 5, seed=1)]
    at, shown = course(more)
    pooled = (0.5 * 40 + 0.25 * 80) / 0.75
    assert shown[~np.isnan(shown)] == pytest.approx([pooled] * 5 + [15, 35], abs=0.2)


def test_each_damage_has_a_panel_with_forks_behind() -> None:
    """Three damages, two learners: each panel has two lines, two forks, and a line where the damage begins."""
    factors = {f"{a}, {d}": {"learner": a, "damage": d} for a in "ab" for d in ("none", "gain", "noise", "drift")}
    rows = [row(name, [0.5] * 10, phase) for name in factors for phase in (0, 1, 2)]
    figure = relearning_figure(study(rows, factors))
    assert figure is not None
    assert [panel.get_title(loc="left") for panel in figure.axes] == ["gain", "noise", "drift"]
    for panel in figure.axes:
        labels = [line.get_label() for line in panel.get_lines()]
        assert labels.count("without damage") == 2 and {"a", "b"} < {*labels}
        upright = [line.get_xdata()[0] for line in panel.get_lines() if len({*map(float, line.get_xdata())}) == 1]
        assert upright == [0, 10]  # begins, and is undone


def test_without_damages_or_ceilings_nothing_is_drawn() -> None:
    """None, not an empty picture."""
    assert relearning_figure(study([row("a, none", [0.5] * 10)], {"a, none": FACTORS["a, none"]})) is None
    bare = row("a, gain", [0.5] * 10) | {"ceiling_per_minute": []}
    assert relearning_figure(study([bare], FACTORS)) is None
