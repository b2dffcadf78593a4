"""The report's interactive plots, as plotly figures: what the static figures show, to be looked at closely."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from somatopy.analysis.band import spread_of
from somatopy.analysis.bounds import ceiling_shares, reactive_efficiency
from somatopy.analysis.columns import readable
from somatopy.analysis.described import on_papers_robot
from somatopy.analysis.figures.distortion import PAPER_HEAD_BAND
from somatopy.analysis.figures.efficiency import line
from somatopy.analysis.phases import phase_title
from somatopy.analysis.regions import Regions, arm_regions
from somatopy.analysis.runs import Run
from somatopy.analysis.series import borders, distance_units, distortion, gaze_error, in_shares, phase_starts
from somatopy.analysis.standings import OWN, Standing
from somatopy.analysis.style import BAND, BORDER, CEILING, CONTROLS, HITS, PAPER, RUNS, TREND, UNSEEN
from somatopy.analysis.table import paper_lines
from somatopy.analysis.trends import Trend
from somatopy.clock import WINDOW
from somatopy.percept import Floats

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

__all__ = [
    "TIME",
    "distortion_chart",
    "efficiency_chart",
    "gaze_chart",
    "hits_chart",
    "look",
    "misses_chart",
    "plain_figure",
]

Summary = Mapping[str, Any]
#: A run to be drawn: its name in legends, the folder, its summary.
Drawn = tuple[str, Run, Summary]

TIME = "robot time, in 5-minute windows"
FONT = "system-ui, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif"


def hits_chart(runs: Sequence[Drawn]) -> Figure:
    """Hits per window with trends, the paper's beside them (its Figure 3)."""
    figure = _figure("hits per 5-minute window (frames)", runs)
    if len(runs) == 1:
        _add_band(figure, runs[0][1])
        _add_paper(figure, *runs[0][1:])
    for index, (name, _, summary) in enumerate(runs):
        color, dash = (HITS, "solid") if len(runs) == 1 else look(index)
        counts = [phase["hits_per_window"] for phase in summary["phases"]]
        at, percent = line([[count / WINDOW for count in found] for found in counts], summary["phases"])
        label = "hits, this run" if len(runs) == 1 else name
        _add(figure, at, percent * WINDOW / 100, label, color, dash=dash, mode="lines+markers", decimals=0)
        _add_trends(figure, summary, TREND if len(runs) == 1 else color, len(runs) == 1)
    figure.update_yaxes(rangemode="tozero")
    return figure


def efficiency_chart(runs: Sequence[Drawn], standings: Mapping[str, Sequence[Standing]]) -> Figure:
    """Share of frames with the hand in view, with ceiling, reactive bound and controls.

    Args:
        runs: what is drawn; bounds and controls only of a run that is alone.
        standings: of each run, by its name.
    """
    figure = _figure("frames with the hand in view (%)", runs)
    if len(runs) == 1:
        _add_bounds(figure, runs[0][1], runs[0][2])
    for index, (name, _, summary) in enumerate(runs):
        color, dash = (HITS, "solid") if len(runs) == 1 else look(index)
        own = next(found for found in standings[name] if found.name == OWN)
        label = f"{OWN} ({own.eye} eye)" if len(runs) == 1 else name
        _add(figure, *_rates(summary), label, color, dash=dash, mode="lines+markers")
    controls = [found for found in standings[runs[0][0]] if found.summary and found.name != OWN]
    for control, (color, dashes, _) in zip(controls if len(runs) == 1 else [], CONTROLS * 9, strict=False):
        assert control.summary is not None
        _add(figure, *_rates(control.summary), f"{control.name} ({control.eye} eye)", color, dash=_dash(dashes))
    figure.update_yaxes(range=[0, 100])
    return figure


def distortion_chart(runs: Sequence[Drawn], side: str) -> Figure | None:
    """Moving mean of winner distances of one map (the paper's Figures 4 and 5); None where none was recorded."""
    found = {name: distortion(run, side) for name, run, _ in runs}
    if not any(len(at) for at, _ in found.values()):
        return None
    units = {name: "" if in_shares(unit := distance_units(run)[side]) else unit for name, run, _ in runs}
    alike = len(set(units.values())) == 1
    unit = units[runs[0][0]] if alike else "in the unit named"
    figure = _figure(f"distortion of the {side} map{unit and f' ({unit})'}", runs, height=300)
    for index, (name, (at, means)) in enumerate(found.items()):
        color, dash = (HITS if side == "arm" else TREND, "solid") if len(runs) == 1 else look(index)
        label = f"{side} map" if len(runs) == 1 else name if alike else f"{name}, {units[name] or '[0, 1]'}"
        _add(figure, at, means, label, color, dash=dash, decimals=4)
    if side == "head" and not unit and any(on_papers_robot(run) for _, run, _ in runs):
        low, high = PAPER_HEAD_BAND
        note = {"annotation_text": "the paper, after 10 min", "annotation_position": "top right"}
        figure.add_hrect(low, high, fillcolor="#f0f0f0", line_width=0, layer="below", **note)
    figure.update_yaxes(rangemode="tozero")
    figure.update_layout(showlegend=len(runs) > 1)
    return figure


def gaze_chart(runs: Sequence[Drawn]) -> Figure | None:
    """How far the gaze points past the hand; None where it was not recorded."""
    found = {name: gaze_error(run) for name, run, _ in runs}
    if not any(len(at) for at, _ in found.values()):
        return None
    figure = _figure("gaze error (degrees)", runs, height=320)
    for index, (name, (at, angles)) in enumerate(found.items()):
        color, dash = (TREND, "solid") if len(runs) == 1 else look(index)
        if len(runs) == 1:
            _add(figure, at, angles[:, 3], "95th percentile", PAPER, dash="dot", decimals=1)
            _add(figure, at, angles[:, 2], "upper quartile", "#9db0d8", decimals=1, width=0.8, showlegend=False)
            _add(figure, at, angles[:, 0], "middle half", "#9db0d8", decimals=1, width=0.8, fill="tonexty")
        _add(figure, at, angles[:, 1], "median" if len(runs) == 1 else name, color, dash=dash, decimals=1)
    figure.update_yaxes(rangemode="tozero")
    return figure


def misses_chart(run: Run, summary: Summary) -> Figure | None:
    """How often each arm region is missed, phase beside phase, the pair of joints chosen from a list.

    Of an arm with a single joint, lines over that joint.
    """
    from plotly.subplots import make_subplots

    found = arm_regions(run)
    if not found:
        return None
    pairs, titles = list(next(iter(found.values())).frames), [phase_title(summary, p) for p in found]
    if pairs == [(0, 0)]:
        return _misses_of_one_joint(dict(zip(titles, found.values(), strict=True)))
    figure = make_subplots(1, len(found), subplot_titles=titles, shared_yaxes=True, horizontal_spacing=0.05)
    for number, pair in enumerate(pairs):
        for column, regions in enumerate(found.values(), 1):
            figure.add_trace(_heatmap(regions, *pair, visible=number == 0), 1, column)
    _style(figure, 430)
    any_phase = next(iter(found.values()))
    figure.update_layout(coloraxis=_coloraxis("missed (%)"), updatemenus=[_pair_menu(any_phase, pairs, len(found))])
    a, b = pairs[0]
    figure.update_xaxes(title_text=any_phase.axis(a), showgrid=False)
    figure.update_yaxes(title_text=any_phase.axis(b), showgrid=False, col=1)
    figure.update_layout(plot_bgcolor=UNSEEN, margin_t=92, hovermode="closest")
    return figure


def _misses_of_one_joint(found: Mapping[str, Regions]) -> Figure:
    figure = plain_figure(360)
    for index, (title, regions) in enumerate(found.items()):
        color, dash = look(index)
        _add(figure, _middles(regions, 0), 100 * regions.along(0), title, color, dash=dash, decimals=0)
        figure.update_xaxes(title_text=regions.axis(0))
    figure.update_yaxes(title_text="missed (%)", range=[0, 100])
    return figure


def _figure(title: str, runs: Sequence[Drawn], height: int = 400) -> Figure:
    figure = plain_figure(height)
    end = max(phase_starts(summary["phases"])[-1] for _, _, summary in runs)
    figure.update_xaxes(title_text=TIME, range=[-0.015 * max(end, 1.0), 1.01 * max(end, 1.0)])
    figure.update_yaxes(title_text=title)
    there = sorted({border for _, _, summary in runs for border in borders(summary["phases"])})
    for at, names in groupby(there, key=lambda border: border[0]):
        text = ", ".join(name for _, name in names)
        note = {"annotation_text": text, "annotation_font_color": BORDER, "annotation_position": "top right"}
        figure.add_vline(at, line_color=BORDER, line_width=1.6, **note)
    return figure


def plain_figure(height: int) -> Figure:
    """An empty figure in the report's style.

    Args:
        height: px.
    """
    from plotly.graph_objects import Figure

    figure = Figure()
    _style(figure, height)
    return figure


def _style(figure: Figure, height: int) -> None:
    axis = {"gridcolor": "#e6e6e6", "zeroline": False, "linecolor": "#222222", "ticks": "outside", "automargin": True}
    axis |= {"title_font_size": 13}
    figure.update_layout(
        template="none",
        height=height,
        margin={"l": 70, "r": 24, "t": 40, "b": 52},
        font={"family": FONT, "size": 13, "color": "#222222"},
        legend={"orientation": "h", "y": 1.03, "yanchor": "bottom", "x": 0},
        hovermode="x unified",
        paper_bgcolor="white",
        plot_bgcolor="white",
    )
    figure.update_xaxes(**axis)
    figure.update_yaxes(**axis)


def _add(
    figure: Figure,
    at: Floats,
    values: Floats,
    name: str,
    color: str,
    *,
    dash: str = "solid",
    mode: str = "lines",
    width: float = 1.8,
    decimals: int = 1,
    **more: Any,
) -> None:
    figure.add_scatter(
        x=np.asarray(at, dtype=np.float32),
        y=np.asarray(values, dtype=np.float32),
        name=name,
        mode=mode,
        line={"color": color, "dash": dash, "width": width},
        marker={"size": 5},
        hovertemplate=f"%{{y:,.{decimals}f}}",
        **more,
    )


def _add_trends(figure: Figure, summary: Summary, color: str, named: bool) -> None:
    shown = False
    for phase, start in zip(summary["phases"], phase_starts(summary["phases"]), strict=False):
        for entry in filter(None, phase["trends"]):
            trend = Trend(**entry)
            at = np.array([start + trend.first, start + trend.last])
            values = np.array([trend.at(0), trend.at(trend.last - trend.first)])
            group = "trend" if named else None
            more: Any = {"legendgroup": group, "showlegend": named and not shown, "hoverinfo": "skip"}
            _add(figure, at, values, "trend, this run", color, width=3.2 if named else 2.2, **more)
            figure.data[-1].hovertemplate = None
            shown = True


def _add_paper(figure: Figure, run: Run, summary: Summary) -> None:
    """The paper's regressions where a run of its robot has the segments they belong to, as far as it goes."""
    phases, shown = summary["phases"] if on_papers_robot(run) else [], False
    for index, lines in paper_lines(phases):
        for paper in lines:
            length = min(paper.last, len(phases[index]["hits_per_window"]) - 1) - paper.first
            if length > 0:
                start = phase_starts(phases)[index] + paper.first
                at, values = np.array([start, start + length]), np.array([paper.at(0), paper.at(length)])
                more: Any = {"legendgroup": "paper", "showlegend": not shown, "hoverinfo": "skip"}
                _add(figure, at, values, "trend, the paper's run", PAPER, dash="dash", **more)
                figure.data[-1].hovertemplate = None
                shown = True


def _add_band(figure: Figure, run: Run) -> None:
    """From the lowest to the highest of the seeds that went beside this run, if any did."""
    spread = spread_of(run)
    if spread is None:
        return
    label = f"{spread.seeds} seeds, geometric eye"
    gaps = np.flatnonzero(np.isnan(spread.at))
    for part, at in enumerate(np.split(np.arange(len(spread.at)), gaps)):
        there = at[np.isfinite(spread.at[at])]
        if len(there):
            shown: Any = {"legendgroup": "band", "hoverinfo": "skip", "showlegend": False}
            _add(figure, spread.at[there], spread.high[there], label, BAND, width=0, **shown)
            _add(figure, spread.at[there], spread.low[there], label, BAND, width=0, fill="tonexty", fillcolor=BAND,
                 **shown | {"showlegend": part == 0})  # fmt: skip
            for trace in figure.data[-2:]:
                trace.hovertemplate = None


def _add_bounds(figure: Figure, run: Run, summary: Summary) -> None:
    shares = ceiling_shares(run)
    if not shares:
        return
    at, ceiling = line(shares, summary["phases"])
    _add(figure, at, ceiling, "ceiling", CEILING, width=2.6)
    if (reactive := reactive_efficiency(run)) is not None:
        _add(figure, at, reactive * ceiling, "reactive bound", CEILING, dash="dash", width=1.2)


def _rates(summary: Summary) -> tuple[Floats, Floats]:
    return line([[hits / WINDOW for hits in p["hits_per_window"]] for p in summary["phases"]], summary["phases"])


def look(index: int) -> tuple[str, str]:
    """Colour and dashes of one of several lines."""
    color, dashes = RUNS[index % len(RUNS)]
    return color, _dash(dashes)


def _dash(dashes: Sequence[float]) -> str:
    return ",".join(f"{1.8 * length:g}px" for length in dashes) or "solid"


def _heatmap(regions: Regions, a: int, b: int, visible: bool) -> Any:
    from plotly.graph_objects import Heatmap

    where = f"{_shown(regions, a, 'x')}, {_shown(regions, b, 'y')}"
    return Heatmap(
        x=_middles(regions, a),
        y=_middles(regions, b),
        z=(100 * regions.share(a, b).T).astype(np.float32),
        customdata=regions.frames[a, b].T.astype(np.int32),
        coloraxis="coloraxis",
        visible=visible,
        hoverongaps=False,
        hovertemplate=f"{where}: %{{z:.0f}} % of %{{customdata:,}} frames missed<extra></extra>",
    )


def _middles(regions: Regions, joint: int) -> Floats:
    borders = regions.borders(joint)
    return ((borders[1:] + borders[:-1]) / 2).astype(np.float32)


def _shown(regions: Regions, joint: int, axis: str) -> str:
    """How plotly writes a cell's middle: whole degrees for angles, else hundredths with their unit."""
    sign = readable(regions.units[joint])[1]
    return f"%{{{axis}:.0f}}°" if sign == "°" else f"%{{{axis}:.2f}} {sign}".rstrip()


def _coloraxis(title: str) -> dict[str, Any]:
    return {
        "colorscale": "Cividis",
        "reversescale": True,
        "cmin": 0,
        "cmax": 100,
        "colorbar": {"title": {"text": title, "side": "right"}, "thickness": 14},
    }


def _pair_menu(regions: Regions, pairs: Sequence[tuple[int, int]], phases: int) -> dict[str, Any]:
    buttons = []
    for number, (a, b) in enumerate(pairs):
        shown = [other == number for other in range(len(pairs)) for _ in range(phases)]
        axes = {f"xaxis{'' if p == 0 else p + 1}.title.text": regions.axis(a) for p in range(phases)}
        axes["yaxis.title.text"] = regions.axis(b)
        label = f"{regions.joints[a]} and {regions.joints[b]}"
        buttons.append({"label": label, "method": "update", "args": [{"visible": shown}, axes]})
    return {"buttons": buttons, "x": 0, "xanchor": "left", "y": 1.12, "yanchor": "bottom", "bgcolor": "white"}
