"""Efficiency over time around each damage: small multiples of a study's learners."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from somatopy.analysis.cells import StudyResult
from somatopy.analysis.relearning_table import named_conditions
from somatopy.analysis.style import BORDER, RUNS, style
from somatopy.clock import FRAMES_PER_MINUTE
from somatopy.percept import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["relearning_figure"]

#: Minutes before the damage that are drawn, at most, and minutes of a step over which all seeds are pooled.
_BEFORE, _STEP = 10, 2
_FORK = "#b4b4b4"
Rows = Sequence[Mapping[str, Any]]
Line = tuple[Floats, Floats]


def relearning_figure(result: StudyResult) -> Figure | None:
    """A panel for each damage: efficiency in steps of two minutes, pooled over seeds, a line for each learner.

    Behind each line, in grey, is that of the same learner without damage. None where the study has no conditions that
    differ in their damage, or no ceilings.

    Args:
        result: an open study folder.
    """
    from matplotlib.figure import Figure

    named = named_conditions(result)
    damages = [damage for damage in dict.fromkeys(damage for _, damage in named.values()) if damage != "none"]
    rows = [row for row in result.table.to_pylist() if row["ceiling_per_minute"]]
    if not damages or not rows:
        return None
    learners = list(dict.fromkeys(learner for learner, _ in named.values()))
    lines = {of: course([row for row in rows if row["condition"] == name]) for name, of in named.items()}
    across = min(5, len(damages))
    down = -(-len(damages) // across)
    with style():
        figure = Figure(figsize=(max(5.5, 2.5 * across), 1.1 + 1.75 * down), layout="constrained")
        panels = figure.subplots(down, across, sharex=True, sharey=True, squeeze=False).ravel()
        for panel, damage in zip(panels, damages, strict=False):
            _draw(panel, damage, learners, lines, _borders(rows, named, damage))
        for panel in panels[len(damages) :]:
            panel.set_visible(False)
        for k in range(max(0, len(damages) - across), len(damages)):
            panels[k].tick_params(labelbottom=True)
        _legend(figure, panels[0])
        figure.supxlabel("minutes since the damage", fontsize=9.5)
        figure.supylabel("efficiency (% of what could be seen)", fontsize=9.5)
    return figure


def course(rows: Rows) -> Line:
    """Efficiency of a condition over time, all seeds together.

    Args:
        rows: of the table of cells, of one condition.

    Returns:
        The middle of each step, in minutes since the end of the first phase, and the efficiency in it, percent; NaN
        between phases, where a line is to be broken.
    """
    at: list[float] = []
    shown: list[float] = []
    start = 0.0
    for phase in sorted({row["phase"] for row in rows}):
        same = [row for row in rows if row["phase"] == phase]
        if phase == 0:
            start = -same[0]["frames"] / FRAMES_PER_MINUTE
        values = _steps(same)
        at += [*(start + _STEP * (k + 0.5) for k in range(len(values))), np.nan]
        shown += [*values, np.nan]
        start += same[0]["frames"] / FRAMES_PER_MINUTE
    x, y = np.array(at), np.array(shown)
    late = ~(x < -_BEFORE)
    return x[late], y[late]


def _steps(rows: Rows) -> list[float]:
    """Efficiency in steps of a phase, pooled over its rows; a rest that is no step is left out."""
    n = min(len(row["ceiling_per_minute"]) for row in rows) // _STEP * _STEP
    hits, shares = (
        np.sum([np.array(row[name][:n], float) for row in rows], axis=0).reshape(-1, _STEP).sum(axis=1)
        for name in ("hits_per_minute", "ceiling_per_minute")
    )
    visible = FRAMES_PER_MINUTE * shares
    return [float(100 * hit / sight) if sight > 0 else np.nan for hit, sight in zip(hits, visible, strict=True)]


def _borders(rows: Rows, named: Mapping[str, tuple[str, str]], damage: str) -> list[float]:
    """Where the damage is undone, in minutes since it began, if it is."""
    frames = {row["phase"]: row["frames"] for row in rows if named.get(row["condition"], ("", ""))[1] == damage}
    return [frames[1] / FRAMES_PER_MINUTE] if frames.get(2) else []


def _draw(
    panel: Axes, damage: str, learners: Sequence[str], lines: Mapping[tuple[str, str], Line], undone: Sequence[float]
) -> None:
    for learner in learners:
        if (learner, "none") in lines:
            panel.plot(*lines[learner, "none"], color=_FORK, lw=1.0, zorder=2, label="without damage")
    for (color, dashes), learner in zip(RUNS * len(learners), learners, strict=False):
        if (learner, damage) in lines:
            style_of_line: Any = {"color": color, "dashes": dashes} if dashes else {"color": color}
            panel.plot(*lines[learner, damage], lw=1.6, zorder=3, label=learner, **style_of_line)
    panel.axvline(0, color=BORDER, lw=1.4, zorder=1)
    for at in undone:
        panel.axvline(at, color=BORDER, lw=1.0, ls=":", zorder=1)
    panel.set_title(damage, fontsize=9.5, pad=3)
    panel.set_ylim(0, 102)
    panel.set_yticks([0, 25, 50, 75, 100])
    panel.tick_params(labelsize=8.0, length=2)


def _legend(figure: Figure, panel: Axes) -> None:
    handles, labels = panel.get_legend_handles_labels()
    found = dict(zip(labels[::-1], handles[::-1], strict=True))
    order = [*(label for label in dict.fromkeys(labels) if label != "without damage"), "without damage"]
    shown = [label for label in order if label in found]
    figure.legend([found[label] for label in shown], shown, loc="outside upper center", ncols=6, fontsize=9.0)
