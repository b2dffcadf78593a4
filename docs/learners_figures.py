"""The figures of docs/learners.md, which docs/make_learners.py draws."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from learners_cells import BEST, PAPERS, WIDE, Cells, Place
from somatopy.analysis.cells import StudyResult
from somatopy.analysis.figures.relearning import relearning_figure
from somatopy.analysis.style import BORDER, CEILING, HITS, TREND, style
from somatopy.clock import FRAMES_PER_MINUTE

#: Minutes of a step.
STEP = 2
LINES = ((BEST, HITS), (PAPERS, TREND))


def draw(found: Mapping[str, StudyResult], folder: Path) -> None:
    """The figures for which there are cells."""
    folder.mkdir(parents=True, exist_ok=True)
    with style():
        if "learners" in found:
            save(course(Cells(found["learners"])), folder / "learners.png")
        if "learners-damages" in found and (figure := relearning_figure(found["learners-damages"])):
            save(figure, folder / "learners_damages.png")


def save(figure: Figure, path: Path) -> None:
    figure.savefig(path, dpi=150, metadata={"Software": None})


def course(study: Cells) -> Figure:
    """Efficiency over time, with bands over seeds."""
    figure = Figure(figsize=(8.0, 4.0), layout="constrained")
    axes = figure.subplots()
    start = 0.0
    for phase in (0, 1):
        length = 0.0
        for learner, color in LINES:
            at = start + STEP * (np.arange(len(steps(study, (WIDE, learner, "paper"), phase).T)) + 0.5)
            if phase:
                axes.plot(at, steps(study, (WIDE, learner, "none"), 1).mean(axis=0), color="0.45", lw=1.2, ls="--")
            length = max(length, band(axes, at, steps(study, (WIDE, learner, "paper"), phase), color) - start)
        start += length
    decorate(axes, study)
    return figure


def steps(study: Cells, where: Place, phase: int) -> np.ndarray:
    """Efficiency of each seed in steps of two minutes, percent, shape (seeds, steps)."""
    there = study.at(where, phase)
    hits, shares = (np.array([row[name] for row in there], float) for name in ("hits_per_minute", "ceiling_per_minute"))
    n = hits.shape[-1] // STEP * STEP
    hits, shares = (each[:, :n].reshape(len(there), -1, STEP).sum(axis=2) for each in (hits, shares))
    return np.asarray(100 * hits / (FRAMES_PER_MINUTE * shares))


def band(axes: Axes, at: np.ndarray, values: np.ndarray, color: str) -> float:
    """Mean and 95 % of the seeds; where it ends."""
    low, high = np.quantile(values, [0.025, 0.975], axis=0)
    axes.fill_between(at, low, high, color=color, alpha=0.2, lw=0)
    axes.plot(at, values.mean(axis=0), color=color, lw=2.0)
    return float(at[-1] + STEP / 2)


def decorate(axes: Axes, study: Cells) -> None:
    """Ceiling, damage, and a name at each line."""
    border, end = np.cumsum([study.at((WIDE, BEST, "paper"), k)[0]["frames"] / FRAMES_PER_MINUTE for k in (0, 1)])
    papers, best, fork = (
        steps(study, (WIDE, learner, damage), phase).mean()
        for learner, damage, phase in ((PAPERS, "paper", 0), (BEST, "paper", 0), (PAPERS, "none", 1))
    )
    axes.axhline(100, color=CEILING, lw=1.6)
    axes.axvline(border, color=BORDER, lw=1.6)
    notes = (
        (1, 101, "the ceiling: all that any gaze could see", CEILING),
        (0.45 * border, best - 14, "best", HITS),
        (0.45 * border, papers - 19, "the paper's learner", TREND),
        (border + 1, fork + 4, "without damage", "0.35"),
        (border + 1, 3, "the paper's damage", BORDER),
    )
    for x, y, text, color in notes:
        axes.text(x, y, text, color=color, fontsize=12, va="bottom")
    axes.set(ylim=(0, 108), xlim=(0, end), xlabel="minutes", ylabel="seen, % of what could be seen")
    axes.set_yticks(range(0, 101, 20))
    axes.spines["right"].set_visible(False)
