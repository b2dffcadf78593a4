"""Share of frames with the hand in view over time, beside what was possible and what ignorance scores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from somatopy.analysis.bounds import ceiling_rates, ceiling_shares, reactive_efficiency, why_no_ceiling
from somatopy.analysis.figures.time_axis import over_time, plot
from somatopy.analysis.phases import played
from somatopy.analysis.runs import Run
from somatopy.analysis.series import ceiling_line, levels, line, running_ceiling, running_rate
from somatopy.analysis.standings import OWN, Standing, standings
from somatopy.analysis.style import CEILING, CONTROLS, HITS, PAPER, RUNNING, UNSEEN, source, style
from somatopy.analysis.summary import summarise
from somatopy.clock import WINDOW
from somatopy.percept import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["efficiency_figure", "rates"]

Line = tuple[Floats, Floats]


def efficiency_figure(run: Run) -> Figure | None:
    """Draw the share of frames with the hand in view, with ceiling, reactive bound and controls; None without frames.

    Below, where there is a ceiling: hits as a share of what was possible. Lines go from window to window; a phase of
    less than two full windows is level at its mean. The running minute stands behind.

    Args:
        run: an open run folder.
    """
    from matplotlib.figure import Figure

    summary = summarise(run)
    if not played(summary["phases"]):
        return None
    shares, learners = ceiling_shares(run), [s for s in standings(run, summary) if s.summary]
    with style():
        figure = Figure(figsize=(8.0, 6.8 if shares else 4.4), layout="constrained")
        panels = figure.subplots(
            2 if shares else 1, sharex=True, squeeze=False, height_ratios=[3, 2][: 1 + bool(shares)]
        )
        top = panels[0, 0]
        plot(top, *running_rate(run), color=RUNNING, lw=1.0, zorder=1, label="running minute")
        if shares:
            plot(top, *running_ceiling(run, summary["phases"]), color=PAPER, lw=0.9, zorder=1)
            _draw_bounds(top, ceiling_line(run, summary["phases"]), reactive_efficiency(run))
        _draw_learners(top, learners, None)
        if shares:
            _draw_learners(panels[1, 0], learners, (shares, ceiling_rates(run)[1]))
            _draw_bound_efficiency(panels[1, 0], reactive_efficiency(run))
        _finish(figure, [panel for (panel,) in panels], run, summary)
    return figure


def rates(summary: Mapping[str, Any]) -> list[list[float]]:
    """Share of frames with the hand in view, per full window of each phase."""
    return [[hits / WINDOW for hits in phase["hits_per_window"]] for phase in summary["phases"]]


def _draw_bounds(axes: Axes, bound: Line, reactive: float | None) -> None:
    at, ceiling = bound
    axes.fill_between(at, ceiling, 100, color=UNSEEN, lw=0, zorder=0, label="out of reach of any gaze")
    plot(axes, at, ceiling, color=CEILING, lw=2.2, zorder=2, label="ceiling")
    if reactive is not None:
        plot(axes, at, reactive * ceiling, color=CEILING, lw=1.1, dashes=(4, 2), zorder=2, label="reactive bound")


#: Shares under the ceiling: per window of each phase, and over each phase.
Limits = tuple[list[list[float]], list[float | None]]


def _draw_learners(axes: Axes, learners: Sequence[Standing], limits: Limits | None) -> None:
    controls = [standing for standing in learners if standing.name != OWN]
    for standing, (color, dashes, marker) in zip(controls, CONTROLS * len(controls), strict=False):
        look: Any = {"color": color, "lw": 1.3, "dashes": dashes, "marker": marker, "ms": 3.0, "markevery": 3}
        axes.plot(*_percent(standing, limits), label=f"{standing.name} ({standing.eye} eye)", zorder=3, **look)
    (own,) = (standing for standing in learners if standing.name == OWN)
    axes.plot(*_percent(own, limits), color=HITS, lw=1.8, zorder=4, label=f"{OWN} ({own.eye} eye)")
    assert own.summary is not None
    at, values = line(_relative(rates(own.summary), limits and limits[0]), own.summary["phases"])
    axes.plot(at, values, color=HITS, lw=0, marker="o", ms=3.4, zorder=4)


def _percent(standing: Standing, limits: Limits | None) -> Line:
    assert standing.summary is not None
    found, phases = rates(standing.summary), standing.summary["phases"]
    means = [phase["rate"] for phase in phases]
    if limits is None:
        return levels(found, means, phases)
    shares, wholes = limits
    return levels(_relative(found, shares), _relative([means], [wholes])[0], phases)


def _relative(
    found: Sequence[Sequence[float | None]], shares: Sequence[Sequence[float | None]] | None
) -> list[list[float | None]]:
    """What was seen as a share of what could be; the same where nothing is known of that."""
    if shares is None:
        return [list(rates) for rates in found]
    return [
        [rate / share if share and rate is not None else None for rate, share in zip(a, b, strict=False)]
        for a, b in zip(found, shares, strict=False)
    ]


def _draw_bound_efficiency(axes: Axes, reactive: float | None) -> None:
    axes.axhline(100, color=CEILING, lw=2.2, zorder=2)
    if reactive is not None:
        axes.axhline(100 * reactive, color=CEILING, lw=1.1, dashes=(4, 2), zorder=2)
    axes.set_ylabel("efficiency: hits as a share\nof what was possible (%)")
    axes.set_ylim(0, max(112.0, 1.1 * axes.dataLim.y1))


def _finish(figure: Figure, panels: Sequence[Axes], run: Run, summary: Mapping[str, Any]) -> None:
    top = panels[0]
    top.set_ylim(0, 112)  # room on top for the words at the borders
    top.set_yticks(range(0, 101, 20))
    over_time(panels, summary["phases"])
    top.set_title(f"{'Beside what was possible' if run.ceiling else 'Hand seen'}: {source(summary)}")
    top.set_ylabel("frames with the hand in view (%)")
    top.text(0.01, 0.96, why_no_ceiling(run, summary), transform=top.transAxes, va="top", color="#5f5f5f")
    handles, names = top.get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=3)
