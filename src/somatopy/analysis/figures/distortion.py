"""The paper's Figures 4 and 5: distortion of the arm map and of the head map over time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from somatopy.analysis.described import on_papers_robot
from somatopy.analysis.figures.time_axis import over_time, plot
from somatopy.analysis.runs import Run
from somatopy.analysis.series import distance_units, distortion, in_minutes, in_shares, phase_starts
from somatopy.analysis.style import HITS, PAPER, TREND, source, style
from somatopy.analysis.summary import summarise
from somatopy.clock import DISTORTION_WIDTH

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["PAPER_HEAD_BAND", "figure4", "figure5"]

#: Where the paper's head distortion stays after ten minutes (Fig. 5).
PAPER_HEAD_BAND = (0.01, 0.02)


def figure4(run: Run) -> Figure | None:
    """Draw the arm map's distortion, in the form of the paper's Figure 4; None for a learner without maps."""
    return _figure(run, "arm", HITS)


def figure5(run: Run) -> Figure | None:
    """Draw the head map's distortion, in the form of the paper's Figure 5; None for a learner without maps."""
    return _figure(run, "head", TREND)


def _figure(run: Run, side: str, color: str) -> Figure | None:
    from matplotlib.figure import Figure

    at, means = distortion(run, side, every=60)
    if not len(at):
        return None
    summary, unit = summarise(run), distance_units(run)[side]
    with style():
        figure = Figure(figsize=(8.0, 3.6), layout="constrained")
        axes = figure.add_subplot()
        plot(axes, at, means, color=color, lw=1.6, zorder=3)
        top = float(np.nanmax(means))
        axes.set_ylim(0, 1.2 * top if top > 0 else 1.0)
        if side == "head" and in_shares(unit) and on_papers_robot(run):
            _draw_paper_band(axes)
        unit_of_time = "minutes" if in_minutes(phase_starts(summary["phases"])[-1]) else "5-minute windows"
        over_time([axes], summary["phases"], text=f"robot time, in {unit_of_time}")
        axes.set_title(f"Distortion of the {side} map: {source(summary)}")
        measured = f"mean distance from {side} posture\nto winner, last {DISTORTION_WIDTH:,} inputs"
        axes.set_ylabel(f"{measured}\n({'1 = a joint’s whole range' if in_shares(unit) else unit})")
    return figure


def _draw_paper_band(axes: Axes) -> None:
    low, high = PAPER_HEAD_BAND
    axes.set_ylim(0, max(axes.get_ylim()[1], 1.2 * high))
    axes.axhspan(low, high, facecolor="#f0f0f0", edgecolor=PAPER, lw=0.8, ls=(0, (5, 2.5)), zorder=0)
    look: Any = {"color": "#5f5f5f", "size": 9.0, "ha": "right", "va": "top", "transform": axes.get_yaxis_transform()}
    axes.text(0.99, high - 0.0006, "the paper's run after 10 min: 0.01 to 0.02", **look)
