"""The plots of a study's report: means with their seeds, and hits over time with bands."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from somatopy.analysis.comparison import Compared, Comparison, Course
from somatopy.analysis.report.plots import TIME, label, look, name_borders, plain_figure
from somatopy.analysis.series import lone
from somatopy.analysis.style import BORDER, CEILING, PAPER
from somatopy.percept import Floats

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

__all__ = ["PANELS", "SHOWN", "course_charts", "courses_chart", "rates_charts"]

#: More conditions than this have a plot of hits each.
PANELS = 6
#: So many conditions are shown at once; the others are folded.
SHOWN = 12
#: Letters in a line of a condition's name beside an axis.
LETTERS = 28


def rates_charts(comparison: Comparison) -> list[Figure]:
    """The share of frames with the hand in view: a line for each condition, its seeds, mean and interval by phase.

    Returns:
        A figure of the first conditions, and one of all others where there are more than `SHOWN`.
    """
    rows = [row for row in comparison.rows if row.measure.column == "rate" and row.interval.n]
    names = list(dict.fromkeys(row.condition for row in rows))
    phases = sorted({row.phase for row in rows})
    parts = [part for part in (names[:SHOWN], names[SHOWN:]) if part]
    return [_rates([row for row in rows if row.condition in part], part, phases, comparison) for part in parts]


def _rates(rows: Sequence[Compared], names: Sequence[str], phases: Sequence[int], comparison: Comparison) -> Figure:
    texts = [label(name, LETTERS) for name in names]
    lines = max(text.count("<br>") + 1 for text in texts)
    figure = plain_figure(height=110 + len(names) * max(17 * lines, 16 * len(phases) + 8))
    for k, phase in enumerate(phases):
        places = {name: n + 0.62 * (k - (len(phases) - 1) / 2) / len(phases) for n, name in enumerate(names)}
        if found := [row for row in rows if row.phase == phase]:
            _add_phase(figure, found, places, look(k)[0])
    _add_ceilings(figure, comparison, names)
    figure.update_xaxes(title_text="frames with the hand in view (%)", range=[-1, 101])
    figure.update_yaxes(tickvals=list(range(len(names))), ticktext=texts, range=[len(names) - 0.4, -0.6], ticks="")
    figure.update_layout(hovermode="closest")
    return figure


def _add_phase(figure: Figure, rows: Sequence[Compared], places: dict[str, float], color: str) -> None:
    phase = rows[0].phase
    group: dict[str, Any] = {"legendgroup": str(phase), "mode": "markers"}
    means = [100 * float(row.interval.mean or 0.0) for row in rows]
    ends = [(row.interval.low, row.interval.high) for row in rows]
    up = [0.0 if high is None else 100 * high - mean for (_, high), mean in zip(ends, means, strict=True)]
    down = [0.0 if low is None else mean - 100 * low for (low, _), mean in zip(ends, means, strict=True)]
    figure.add_scatter(
        x=means,
        y=[places[row.condition] for row in rows],
        name=f"phase {phase + 1}",
        customdata=[row.state for row in rows],
        marker={
            "size": 9,
            "symbol": ["circle" if row.state == "intact" else "circle-open" for row in rows],
            "color": color,
            "line": {"width": 1.8, "color": color},
        },
        error_x={"type": "data", "array": up, "arrayminus": down, "color": color, "thickness": 1.6, "width": 4},
        hovertemplate=f"phase {phase + 1}, %{{customdata}}: %{{x:.1f}} %<extra></extra>",
        **group,
    )
    seeds = [(100 * value, places[row.condition], seed) for row in rows for seed, value in row.values.items()]
    x, y, who = zip(*seeds, strict=True)
    dots = {"size": 4, "color": CEILING, "opacity": 0.6}
    hover = "seed %{customdata}: %{x:.1f} %<extra></extra>"
    figure.add_scatter(x=x, y=y, customdata=who, marker=dots, showlegend=False, hovertemplate=hover, **group)


def _add_ceilings(figure: Figure, comparison: Comparison, names: Sequence[str]) -> None:
    """A tick for each condition at its ceiling, the mean over its phases and seeds."""
    found: dict[str, list[float]] = {}
    for row in comparison.rows:
        if row.measure.column == "ceiling" and row.interval.mean is not None and row.condition in names:
            found.setdefault(row.condition, []).append(100 * row.interval.mean)
    if found:
        figure.add_scatter(
            x=[float(np.mean(values)) for values in found.values()],
            y=[names.index(name) for name in found],
            mode="markers",
            name="ceiling",
            marker={"symbol": "line-ns", "size": 16, "line": {"width": 2, "color": CEILING}},
            hovertemplate="ceiling: %{x:.1f} %<extra></extra>",
        )


def courses_chart(courses: Sequence[Course]) -> Figure:
    """Hits per window of a few conditions in one plot."""
    long = any(len(course.condition) > LETTERS for course in courses)
    figure = plain_figure(height=410 + 30 * (len(courses) if long else 1))  # a legend's line for each long name
    for k, course in enumerate(courses):
        _add_course(figure, course, *look(k))
    _finish_courses(figure, courses, courses, TIME, "hits per 5-minute window (frames)")
    return figure


def course_charts(courses: Sequence[Course]) -> list[dict[str, Any]]:
    """A small plot of each condition, with the first one's mean behind, on the axes that all of them have.

    Returns:
        What plotly draws, as plain data: to build and check that many figures takes it half a minute.
    """
    figure = plain_figure(height=190)
    _finish_courses(figure, courses, [])
    figure.update_layout(showlegend=False, margin={"l": 44, "r": 8, "t": 8, "b": 26}, font_size=11)
    layout, first = figure.to_plotly_json()["layout"], courses[0]
    dotted = {"mode": "lines", "line": {"color": PAPER, "width": 1.4, "dash": "dot"}, "hoverinfo": "skip"}
    behind = {"type": "scatter", "x": _listed(first.at), "y": _listed(first.mean), **dotted}
    return [
        {
            "data": [*([behind] if course is not first else []), *_traces(course)],
            "layout": layout | {"shapes": [_upright(at) for at in dict(course.borders)]},
        }
        for course in courses
    ]


def _upright(at: float) -> dict[str, Any]:
    line = {"color": BORDER, "width": 1.4}
    return {"type": "line", "x0": at, "x1": at, "y0": 0, "y1": 1, "yref": "y domain", "line": line}


def _traces(course: Course) -> list[dict[str, Any]]:
    """Band, seeds and mean of a condition."""
    color, quiet = look(0)[0], {"type": "scatter", "hoverinfo": "skip"}
    x, y = _outline(course)
    dots = {"size": 3, "color": color, "opacity": 0.35}
    at, hits = np.tile(course.at, len(course.seeds)), np.concatenate([*course.seeds.values()])
    known = np.isfinite(hits)
    mean = {"mode": "lines+markers", "marker": {"size": 4}, "line": {"color": CEILING, "width": 2.2}}
    if not len(lone(course.mean)):
        mean["mode"] = "lines"  # in another colour than the dots, to stand out among them
    return [
        {**quiet, "x": x, "y": y, "mode": "lines", "fill": "toself", "fillcolor": _faint(color), "line": {"width": 0}},
        {**quiet, "x": _listed(at[known]), "y": _listed(hits[known]), "mode": "markers", "marker": dots},
        {"type": "scatter", "x": _listed(course.at), "y": _listed(course.mean), "hovertemplate": "%{y:,.0f}", **mean},
    ]


def _listed(values: Floats) -> list[float | None]:
    """Numbers for JSON, as exact as a plot shows them."""
    return [round(value, 3) if value == value else None for value in values.tolist()]


def _add_course(figure: Figure, course: Course, color: str, dash: str) -> None:
    group: dict[str, Any] = {"legendgroup": course.condition, "hoverinfo": "skip"}
    x, y = _outline(course)
    filled = {"fill": "toself", "fillcolor": _faint(color), "line_width": 0, "mode": "lines"}
    figure.add_scatter(x=x, y=y, showlegend=False, **filled, **group)
    dots = {"size": 3, "color": color, "opacity": 0.35}
    at = np.tile(course.at, len(course.seeds))
    hits = np.concatenate([*course.seeds.values()])
    figure.add_scatter(x=_short(at), y=_short(hits), mode="markers", marker=dots, showlegend=False, **group)
    line = {"color": color, "dash": dash, "width": 2.2}
    figure.add_scatter(
        x=_short(course.at),
        y=_short(course.mean),
        mode="lines",
        line=line,
        name=label(course.condition, 60),
        legendgroup=course.condition,
        hovertemplate="%{y:,.0f}",
    )


def _outline(course: Course) -> tuple[list[float | None], list[float | None]]:
    """The band as closed outlines, one for each stretch of windows without a gap."""
    known = np.isfinite(course.at) & np.isfinite(course.low) & np.isfinite(course.high)
    cuts = np.flatnonzero(np.diff(known.astype(int)) != 0) + 1
    x: list[float | None] = []
    y: list[float | None] = []
    for part in np.split(np.arange(len(known)), cuts):
        if len(part) and known[part[0]]:
            x += [*course.at[part].tolist(), *course.at[part][::-1].tolist(), None]
            y += [*course.high[part].tolist(), *course.low[part][::-1].tolist(), None]
    return x, y


def _finish_courses(
    figure: Figure, courses: Sequence[Course], shown: Sequence[Course], across: str = "", up: str = ""
) -> None:
    """Axes that hold all courses, and the borders of those that are shown."""
    end = max(1.0, *(course.end for course in courses))
    top = max(float(np.nanmax([*course.seeds.values(), course.high], initial=1.0)) for course in courses)
    figure.update_xaxes(title_text=across, range=[-0.015 * end, 1.01 * end])
    figure.update_yaxes(title_text=up, range=[0, 1.05 * top])
    borders: dict[float, str] = {}
    for course in shown:
        for at, name in course.borders:
            borders[at] = "damage" if "damage" in (name, borders.get(at)) else name
    for at in borders:
        figure.add_vline(at, line_color=BORDER, line_width=1.4)
    if up:
        name_borders(figure, borders, end)


def _faint(color: str) -> str:
    red, green, blue = (int(color[k : k + 2], 16) for k in (1, 3, 5))
    return f"rgba({red},{green},{blue},0.16)"


def _short(values: Floats) -> Any:
    return np.asarray(values, dtype=np.float32)
