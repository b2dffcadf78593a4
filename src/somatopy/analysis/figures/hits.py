"""The paper's Figure 3, drawn from a run; matplotlib is imported when a figure is drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from somatopy.analysis.band import spread_of
from somatopy.analysis.described import on_papers_robot
from somatopy.analysis.figures.time_axis import over_time, plot
from somatopy.analysis.runs import Run
from somatopy.analysis.series import in_minutes, phase_starts, running_rate
from somatopy.analysis.style import BAND, HITS, PAPER, RUNNING, TREND, source, style
from somatopy.analysis.summary import summarise
from somatopy.analysis.table import paper_lines
from somatopy.analysis.trends import MIN_WINDOWS, Trend, segments
from somatopy.clock import FRAMES_PER_MINUTE, WINDOW

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["figure3"]

LEGEND = (
    "hits, this run",
    "trend, this run",
    "trend, the paper's run",
    "other seeds, geometric eye",
    "running minute, × 5",
)


def figure3(run: Run | Mapping[str, Any]) -> Figure:
    """Draw hits per 5-minute window with their trends, in the form of the paper's Figure 3.

    A window is drawn where it starts, so that a trend's intercept lies at its segment's first window. The paper's own
    regression lines start where the run's segments start and are as long as both allow; a run of another robot is
    drawn without them. The running minute stands behind, scaled to five minutes, so that a run of three minutes has a
    curve as well. Behind all, a band reaches from the lowest to the highest of the seeds that went beside the run,
    if any did.

    Args:
        run: an open run folder, or a summary, which knows neither band nor running minutes.
    """
    from matplotlib.figure import Figure

    summary = summarise(run) if isinstance(run, Run) else run
    with style():
        figure = Figure(figsize=(8.0, 4.6), layout="constrained")
        axes = figure.add_subplot()
        starts = phase_starts(summary["phases"])
        if isinstance(run, Run):
            _draw_band(axes, run)
            _draw_running(axes, run, 1.6 if in_minutes(starts[-1]) else 0.9)
        if not isinstance(run, Run) or on_papers_robot(run):
            _draw_paper(axes, summary["phases"], starts)
        for phase, start in zip(summary["phases"], starts, strict=False):
            _draw_phase(axes, phase, start)
        _scale(axes)
        over_time([axes], summary["phases"], _later_segments(summary["phases"], starts))
        _label(axes, summary)
        _note_shortness(axes, summary["phases"])
        entries = {str(drawn.get_label()): drawn for drawn in (*axes.get_lines(), *axes.collections)}
        named = [label for label in LEGEND if label in entries]
        figure.legend(
            [entries[label] for label in named], named, loc="outside lower center", ncols=2 if len(named) == 4 else 3
        )
    return figure


def _draw_band(axes: Axes, run: Run) -> None:
    spread = spread_of(run)
    if spread is not None:
        axes.fill_between(spread.at, spread.low, spread.high, color=BAND, lw=0, label=LEGEND[3], zorder=1)


def _draw_running(axes: Axes, run: Run, width: float) -> None:
    at, percent = running_rate(run)
    plot(axes, at, _hits(percent), color=RUNNING, lw=width, label=LEGEND[4], zorder=2)


def _draw_phase(axes: Axes, phase: Mapping[str, Any], start: float) -> None:
    counts = phase["hits_per_window"]
    if counts:
        at = [start + k for k in range(len(counts))]
        axes.plot(at, counts, color=HITS, lw=1.2, marker="o", ms=3.2, label=LEGEND[0], zorder=3)
    for entry in filter(None, phase["trends"]):
        trend = Trend(**entry)
        _draw_line(axes, trend, start + trend.first, trend.last - trend.first, TREND, lw=2.6, label=LEGEND[1])


def _draw_paper(axes: Axes, phases: Sequence[Mapping[str, Any]], starts: Sequence[float]) -> None:
    """Draw the paper's three lines where the run has the segments they belong to."""
    style = {"lw": 1.4, "dashes": (5, 2.5), "label": LEGEND[2]}
    for index, lines in paper_lines(phases):
        for cut, line in zip(_segments(phases[index]), lines, strict=False):
            length = min(line.last - line.first, len(cut) - 1)
            if length > 0:
                _draw_line(axes, line, starts[index] + cut.start, length, PAPER, **style)


def _draw_line(axes: Axes, trend: Trend, start: float, length: float, color: str, **style: Any) -> None:
    at, hits = (start, start + length), (trend.at(0), trend.at(length))
    axes.plot(at, hits, color=color, solid_capstyle="butt", zorder=4, **style)


def _segments(phase: Mapping[str, Any]) -> list[range]:
    """The windows of each segment that has begun, as far as the trends tell where."""
    windows, trends = len(phase["hits_per_window"]), phase["trends"]
    breaks = [after["first"] if after else before["last"] + 1 for before, after in pairwise(trends) if before or after]
    return [cut for cut in segments(windows, breaks) if cut]


def _later_segments(phases: Sequence[Mapping[str, Any]], starts: Sequence[float]) -> list[tuple[float, str]]:
    """Where a phase has a further trend."""
    cuts = [(starts[index], _segments(phase)[1:]) for index, phase in enumerate(phases)]
    return [(start + cut.start, "next trend") for start, found in cuts for cut in found]


def _scale(axes: Axes) -> None:
    # One scale for most runs, so that figures compare at a glance; the room on top is for the words at the borders.
    axes.set_ylim(0, max(0.8 * WINDOW, 1.15 * axes.dataLim.y1))
    axes.yaxis.set_major_formatter("{x:,.0f}")


def _label(axes: Axes, summary: Mapping[str, Any]) -> None:
    axes.set_title(f"Hand seen: {source(summary)}")
    axes.set_ylabel("hits per 5-minute window (frames)")
    axes.secondary_yaxis("right", functions=(_percent, _hits)).set_ylabel("hit rate (%)")


def _percent(hits: Any) -> Any:
    return hits * 100 / WINDOW


def _hits(percent: Any) -> Any:
    return percent * WINDOW / 100


def _note_shortness(axes: Axes, phases: Sequence[Mapping[str, Any]]) -> None:
    windows = [len(phase["hits_per_window"]) for phase in phases]
    if not sum(windows):
        minutes = sum(phase["frames"] for phase in phases) / FRAMES_PER_MINUTE
        text = f"{minutes:.1f} minutes: too short for a 5-minute window"
    elif not any(trend for phase in phases for trend in phase["trends"]):
        text = f"no trend: no segment has {MIN_WINDOWS} windows"
    else:
        return
    axes.text(0.5, 0.03, text, transform=axes.transAxes, ha="center", color=PAPER)
