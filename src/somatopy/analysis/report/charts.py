"""The report's interactive plots, as plotly figures: what the static figures show, to be looked at closely."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from somatopy.analysis.band import spread_of
from somatopy.analysis.bounds import ceiling_shares, reactive_efficiency
from somatopy.analysis.columns import readable
from somatopy.analysis.described import on_papers_robot
from somatopy.analysis.figures.distortion import PAPER_HEAD_BAND
from somatopy.analysis.figures.efficiency import rates
from somatopy.analysis.phases import phase_title, played
from somatopy.analysis.regions import Regions, arm_regions
from somatopy.analysis.report.plots import add, dashes, label, look, over_time, plain_figure, restyle
from somatopy.analysis.runs import Run
from somatopy.analysis.series import (
    borders,
    ceiling_line,
    distance_units,
    distortion,
    gaze_error,
    in_minutes,
    in_shares,
    levels,
    line,
    phase_starts,
    running_ceiling,
    running_rate,
)
from somatopy.analysis.standings import OWN, Standing
from somatopy.analysis.style import BAND, CEILING, CONTROLS, HITS, NOTHING, PAPER, RUNNING, TREND
from somatopy.analysis.table import paper_lines
from somatopy.analysis.trends import Trend
from somatopy.clock import TEN_SECONDS, WINDOW
from somatopy.percept import Floats

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

__all__ = ["distortion_chart", "efficiency_chart", "gaze_chart", "hits_chart", "misses_chart"]

Summary = Mapping[str, Any]
#: A run to be drawn: its name in legends, the folder, its summary.
Drawn = tuple[str, Run, Summary]

#: Letters of a run's name in a line of the legend.
NAME = 48
#: Points of the running minute in a window.
TENS_OF_WINDOW = WINDOW // TEN_SECONDS


def hits_chart(runs: Sequence[Drawn]) -> Figure:
    """Hits per window and over a running minute, with trends, the paper's beside them (its Figure 3)."""
    figure, alone = _figure("hits per 5-minute window (frames)"), len(runs) == 1
    if alone:
        _add_band(figure, runs[0][1])
        _add_paper(figure, *runs[0][1:])
        _add_running(figure, runs[0][1], WINDOW / 100, None, RUNNING)
    for index, (name, run, summary) in enumerate(runs):
        color, dash = (HITS, "solid") if alone else look(index)
        at, percent = line(rates(summary), summary["phases"])
        shown: Any = {} if alone else {"legendgroup": name}
        text = "hits, this run" if alone else _called(name)
        if len(at) > len(played(summary["phases"])) or not alone:
            add(figure, at, percent * WINDOW / 100, text, color, dash=dash, mode="lines+markers", decimals=0, **shown)
        if not alone and _is_short(summary):
            _add_running(figure, run, WINDOW / 100, name, color)
        _add_trends(figure, summary, TREND if alone else color, None if alone else name)
    figure.update_yaxes(rangemode="tozero")
    return _finished(figure, runs)


def efficiency_chart(runs: Sequence[Drawn], standings: Mapping[str, Sequence[Standing]]) -> Figure:
    """Share of frames with the hand in view, with ceiling, reactive bound and controls.

    Args:
        runs: what is drawn.
        standings: of each run, by its name.
    """
    figure, alone = _figure("frames with the hand in view (%)"), len(runs) == 1
    if alone:
        _add_bounds(figure, runs[0][1], runs[0][2])
        _add_running(figure, runs[0][1], 1.0, None, RUNNING)
    else:
        _add_ceilings(figure, runs)
    for index, (name, run, summary) in enumerate(runs):
        color, dash = (HITS, "solid") if alone else look(index)
        own = next(found for found in standings[name] if found.name == OWN)
        text = f"{OWN} ({own.eye} eye)" if alone else _called(name)
        shown: Any = {} if alone else {"legendgroup": name}
        mode = "lines+markers" if any(phase["hits_per_window"] for phase in summary["phases"]) else "lines"
        add(figure, *_levels(summary), text, color, dash=dash, mode=mode, **shown)
        if not alone and _is_short(summary):
            _add_running(figure, run, 1.0, name, color)
    with_controls = next((name for name, run, _ in runs if run.controls), None)
    if with_controls is not None:
        _add_controls(figure, "" if alone else with_controls, standings[with_controls])
    figure.update_yaxes(range=[0, 102])
    return _finished(figure, runs)


def _is_short(summary: Summary) -> bool:
    return in_minutes(phase_starts(summary["phases"])[-1])


def distortion_chart(runs: Sequence[Drawn], side: str) -> Figure | None:
    """Moving mean of winner distances of one map (the paper's Figures 4 and 5); None where none was recorded."""
    found = {name: distortion(run, side) for name, run, _ in runs}
    if not any(len(at) for at, _ in found.values()):
        return None
    units = {name: "" if in_shares(unit := distance_units(run)[side]) else unit for name, run, _ in runs}
    alike = len(set(units.values())) == 1
    unit = units[runs[0][0]] if alike else "in the unit named"
    figure = _figure(f"distortion of the {side} map{unit and f' ({unit})'}", height=300)
    for index, (name, (at, means)) in enumerate(found.items()):
        color, dash = (HITS if side == "arm" else TREND, "solid") if len(runs) == 1 else look(index)
        label = f"{side} map" if len(runs) == 1 else _called(name if alike else f"{name}, {units[name] or '[0, 1]'}")
        add(figure, at, means, label, color, dash=dash, decimals=4)
    if side == "head" and not unit and any(on_papers_robot(run) for _, run, _ in runs):
        low, high = PAPER_HEAD_BAND
        note = {"annotation_text": "the paper, after 10 min", "annotation_position": "top right"}
        figure.add_hrect(low, high, fillcolor="#f0f0f0", line_width=0, layer="below", **note)
    figure.update_yaxes(rangemode="tozero")
    figure.update_layout(showlegend=len(runs) > 1)
    return _finished(figure, runs)


def gaze_chart(runs: Sequence[Drawn]) -> Figure | None:
    """How far the gaze points past the hand; None where it was not recorded."""
    found = {name: gaze_error(run) for name, run, _ in runs}
    if not any(len(at) for at, _ in found.values()):
        return None
    figure = _figure("gaze error (degrees)", height=320)
    for index, (name, (at, angles)) in enumerate(found.items()):
        color, dash = (TREND, "solid") if len(runs) == 1 else look(index)
        if len(runs) == 1:
            add(figure, at, angles[:, 3], "95th percentile", PAPER, dash="dot", decimals=1)
            _add_middle_half(figure, at, angles)
        add(figure, at, angles[:, 1], "median" if len(runs) == 1 else _called(name), color, dash=dash, decimals=1)
    figure.update_yaxes(rangemode="tozero")
    return _finished(figure, runs)


def _add_middle_half(figure: Figure, at: Floats, angles: Floats) -> None:
    """From the lower to the upper quartile, phase by phase: plotly fills across gaps."""
    cuts = np.flatnonzero(np.isnan(at))
    for k, part in enumerate(np.split(np.arange(len(at)), cuts)):
        inside = part[np.isfinite(at[part])]
        shown: Any = {"decimals": 1, "width": 0.8, "legendgroup": "half"}
        add(figure, at[inside], angles[inside, 2], "upper quartile", "#9db0d8", showlegend=False, **shown)
        add(figure, at[inside], angles[inside, 0], "middle half", "#9db0d8", fill="tonexty", showlegend=k == 0, **shown)


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
    restyle(figure, 430)
    any_phase = next(iter(found.values()))
    figure.update_layout(coloraxis=_coloraxis("missed (%)"), updatemenus=[_pair_menu(any_phase, pairs, len(found))])
    a, b = pairs[0]
    framed = {"showgrid": False, "mirror": True, "showline": True}
    figure.update_xaxes(title_text=any_phase.axis(a), **framed)
    figure.update_yaxes(**framed)
    figure.update_yaxes(title_text=any_phase.axis(b), col=1)
    figure.update_layout(plot_bgcolor=NOTHING, margin_t=92, hovermode="closest")
    return figure


def _misses_of_one_joint(found: Mapping[str, Regions]) -> Figure:
    figure = plain_figure(360)
    for index, (title, regions) in enumerate(found.items()):
        color, dash = look(index)
        add(figure, _middles(regions, 0), 100 * regions.along(0), title, color, dash=dash, decimals=0)
        figure.update_xaxes(title_text=regions.axis(0))
    figure.update_yaxes(title_text="missed (%)", range=[0, 100])
    return figure


def _figure(title: str, height: int = 400) -> Figure:
    figure = plain_figure(height)
    figure.update_yaxes(title_text=title)
    return figure


def _finished(figure: Figure, runs: Sequence[Drawn]) -> Figure:
    end = max(phase_starts(summary["phases"])[-1] for _, _, summary in runs)
    return over_time(figure, end, sorted({border for _, _, summary in runs for border in borders(summary["phases"])}))


def _called(name: str) -> str:
    return label(name, NAME)


def _add_trends(figure: Figure, summary: Summary, color: str, of: str | None) -> None:
    """Trends of a run that is alone, or `of` one of several."""
    named, shown = of is None, False
    for phase, start in zip(summary["phases"], phase_starts(summary["phases"]), strict=False):
        for entry in filter(None, phase["trends"]):
            trend = Trend(**entry)
            at = np.array([start + trend.first, start + trend.last])
            values = np.array([trend.at(0), trend.at(trend.last - trend.first)])
            group = of or "trend"
            more: Any = {"legendgroup": group, "showlegend": named and not shown, "hoverinfo": "skip"}
            add(figure, at, values, "trend, this run", color, width=3.2 if named else 2.2, **more)
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
                add(figure, at, values, "trend, the paper's run", PAPER, dash="dash", **more)
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
            add(figure, spread.at[there], spread.high[there], label, BAND, width=0, **shown)
            add(figure, spread.at[there], spread.low[there], label, BAND, width=0, fill="tonexty", fillcolor=BAND,
                 **shown | {"showlegend": part == 0})  # fmt: skip
            for trace in figure.data[-2:]:
                trace.hovertemplate = None


def _add_bounds(figure: Figure, run: Run, summary: Summary) -> None:
    if not ceiling_shares(run):
        return
    at, ceiling = ceiling_line(run, summary["phases"])
    if _is_short(summary):
        add(figure, *running_ceiling(run, summary["phases"]), "ceiling, running minute", PAPER, width=1.0)
    add(figure, at, ceiling, "ceiling", CEILING, width=2.6)
    if (reactive := reactive_efficiency(run)) is not None:
        add(figure, at, reactive * ceiling, "reactive bound", CEILING, dash="dash", width=1.2)


def _add_ceilings(figure: Figure, runs: Sequence[Drawn]) -> None:
    """Of several runs: one ceiling, with its bound, if they have it in common; or else one a run, dotted."""
    known = [(index, *found) for index, found in enumerate(runs) if ceiling_shares(found[1])]
    if len({repr(found[2].ceiling) for found in known}) == 1 and len(known) == len(runs):
        _add_bounds(figure, *known[0][2:])
        return
    for index, name, run, summary in known:
        at, ceiling = ceiling_line(run, summary["phases"])
        more: Any = {"legendgroup": name, "showlegend": False, "hoverinfo": "skip"}
        add(figure, at, ceiling, f"ceiling of {_called(name)}", look(index)[0], dash="dot", width=1.0, **more)
        figure.data[-1].hovertemplate = None


def _add_controls(figure: Figure, of: str, found: Sequence[Standing]) -> None:
    """What less learning scores; of several runs, those of the first that has any."""
    controls = [standing for standing in found if standing.summary and standing.name != OWN]
    for control, (color, lengths, _) in zip(controls, CONTROLS * 9, strict=False):
        assert control.summary is not None
        name = f"{control.name} ({control.eye} eye)" if not of else f"{control.name}, beside {_called(of)}"
        add(figure, *_levels(control.summary), name, color, dash=dashes(lengths))


def _levels(summary: Summary) -> tuple[Floats, Floats]:
    return levels(rates(summary), [phase["rate"] for phase in summary["phases"]], summary["phases"])


def _add_running(figure: Figure, run: Run, factor: float, group: str | None, color: str) -> None:
    """The running minute; of several runs as part of the run's own line."""
    at, percent = running_rate(run)
    name, short = "running minute" if factor == 1 else "running minute, × 5", in_minutes(len(at) / TENS_OF_WINDOW)
    look: Any = {"width": 1.8 if short else 1.1, "opacity": 0.45 if group else 1.0}
    more: Any = {"legendgroup": group, "showlegend": group is None, "hoverinfo": "skip" if group else None}
    add(figure, at, factor * percent, name, color, **look, **more)
    if group:
        figure.data[-1].hovertemplate = None


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
