"""Share of frames with the hand in view over time, beside what was possible and what ignorance scores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from somatopy.analysis.bounds import ceiling_shares, reactive_efficiency, why_no_ceiling
from somatopy.analysis.phases import played
from somatopy.analysis.runs import Run
from somatopy.analysis.series import borders, phase_starts, window_starts
from somatopy.analysis.standings import OWN, Standing, standings
from somatopy.analysis.style import CEILING, CONTROLS, HITS, UNSEEN, mark, source, style
from somatopy.analysis.summary import summarise
from somatopy.clock import WINDOW
from somatopy.percept import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["efficiency_figure", "line"]

Line = tuple[Floats, Floats]


def efficiency_figure(run: Run) -> Figure | None:
    """Draw hits per window as a share of frames, with ceiling, reactive bound and controls; None without a window.

    Below, where there is a ceiling: hits as a share of what was possible.

    Args:
        run: an open run folder.
    """
    from matplotlib.figure import Figure

    summary = summarise(run)
    phases = summary["phases"]
    if not any(phase["hits_per_window"] for phase in phases):
        return None
    shares, learners = ceiling_shares(run), [s for s in standings(run, summary) if s.summary]
    with style():
        figure = Figure(figsize=(8.0, 6.8 if shares else 4.4), layout="constrained")
        panels = figure.subplots(
            2 if shares else 1, sharex=True, squeeze=False, height_ratios=[3, 2][: 1 + bool(shares)]
        )
        top = panels[0, 0]
        _draw_bounds(top, phases, shares, reactive_efficiency(run))
        _draw_learners(top, learners, None)
        if shares:
            _draw_learners(panels[1, 0], learners, shares)
            _draw_bound_efficiency(panels[1, 0], phases, reactive_efficiency(run))
        _finish(figure, [panel for (panel,) in panels], run, summary)
    return figure


def line(values: Sequence[Sequence[float | None]], phases: Sequence[Mapping[str, Any]]) -> Line:
    """Values per full window of each phase as one line over the run, in percent, broken between phases."""
    at: list[float] = []
    shown: list[float] = []
    starts = window_starts(phases)
    for index in played(phases[: len(values)]):
        windows = list(zip(starts[index], values[index], strict=False))
        at += [*(start for start, _ in windows), np.nan]
        shown += [*(np.nan if value is None else 100 * value for _, value in windows), np.nan]
    return np.array(at), np.array(shown)


def rates(summary: Mapping[str, Any]) -> list[list[float]]:
    """Share of frames with the hand in view, per full window of each phase."""
    return [[hits / WINDOW for hits in phase["hits_per_window"]] for phase in summary["phases"]]


def _draw_bounds(
    axes: Axes, phases: Sequence[Mapping[str, Any]], shares: list[list[float]] | None, reactive: float | None
) -> None:
    if not shares:
        return
    at, ceiling = line(shares, phases)
    axes.fill_between(at, ceiling, 100, color=UNSEEN, lw=0, zorder=0, label="out of reach of any gaze")
    axes.plot(at, ceiling, color=CEILING, lw=2.2, zorder=2, label="ceiling")
    if reactive is not None:
        axes.plot(at, reactive * ceiling, color=CEILING, lw=1.1, dashes=(4, 2), zorder=2, label="reactive bound")


def _draw_learners(axes: Axes, learners: Sequence[Standing], shares: list[list[float]] | None) -> None:
    controls = [standing for standing in learners if standing.name != OWN]
    for standing, (color, dashes, marker) in zip(controls, CONTROLS * len(controls), strict=False):
        at, values = _percent(standing, shares)
        look: Any = {"color": color, "lw": 1.3, "dashes": dashes, "marker": marker, "ms": 3.0, "markevery": 3}
        axes.plot(at, values, label=f"{standing.name} ({standing.eye} eye)", zorder=3, **look)
    (own,) = (standing for standing in learners if standing.name == OWN)
    at, values = _percent(own, shares)
    axes.plot(at, values, color=HITS, lw=1.8, marker="o", ms=3.4, zorder=4, label=f"{OWN} ({own.eye} eye)")


def _percent(standing: Standing, shares: list[list[float]] | None) -> Line:
    assert standing.summary is not None
    found = rates(standing.summary)
    if shares is None:
        return line(found, standing.summary["phases"])
    relative = [
        [rate / share if share else None for rate, share in zip(a, b, strict=False)]
        for a, b in zip(found, shares, strict=False)
    ]
    return line(relative, standing.summary["phases"])


def _draw_bound_efficiency(axes: Axes, phases: Sequence[Mapping[str, Any]], reactive: float | None) -> None:
    axes.axhline(100, color=CEILING, lw=2.2, zorder=2)
    if reactive is not None:
        axes.axhline(100 * reactive, color=CEILING, lw=1.1, dashes=(4, 2), zorder=2)
    axes.set_ylabel("efficiency: hits as a share\nof what was possible (%)")
    axes.set_ylim(0, max(112.0, 1.1 * axes.dataLim.y1))


def _finish(figure: Figure, panels: Sequence[Axes], run: Run, summary: Mapping[str, Any]) -> None:
    top, end = panels[0], max(phase_starts(summary["phases"])[-1], 1.0)
    for axes in panels:
        axes.set_xlim(-0.015 * end, end)
        axes.locator_params(axis="x", integer=True)
    top.set_ylim(0, 112)  # room on top for the words at the borders
    top.set_yticks(range(0, 101, 20))
    for at, name in borders(summary["phases"]):
        for axes in panels:
            mark(axes, at, name if axes is top else "")
    top.set_title(f"{'Beside what was possible' if run.ceiling else 'Hand seen'}: {source(summary)}")
    top.set_ylabel("frames with the hand in view (%)")
    panels[-1].set_xlabel("5-minute windows of robot time, each drawn where it starts")
    top.text(0.01, 0.96, why_no_ceiling(run, summary), transform=top.transAxes, va="top", color="#5f5f5f")
    handles, names = top.get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=3)
