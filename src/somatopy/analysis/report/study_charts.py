"""The plots of a study's report: means with their seeds, and hits over time with bands."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from somatopy.analysis.comparison import Compared, Comparison, Course
from somatopy.analysis.report.charts import TIME, look, plain_figure
from somatopy.analysis.style import BORDER, CEILING, PAPER
from somatopy.percept import Floats

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

__all__ = ["PANELS", "course_chart", "courses_chart", "rates_chart"]

#: More conditions than this have a plot each.
PANELS = 6
#: Letters in a line of a condition's name beside an axis.
LETTERS = 28


def rates_chart(comparison: Comparison) -> Figure | None:
    """The share of frames with the hand in view: a line for each condition, its seeds, mean and interval by phase."""
    rows = [row for row in comparison.rows if row.measure.column == "rate" and row.interval.n]
    if not rows:
        return None
    names = list(dict.fromkeys(row.condition for row in rows))
    labels = [_label(name) for name in names]
    phases = sorted({row.phase for row in rows})
    lines = max(label.count("<br>") + 1 for label in labels)
    figure = plain_figure(height=110 + len(names) * max(17 * lines, 16 * len(phases) + 8))
    for k, phase in enumerate(phases):
        places = {name: n + 0.62 * (k - (len(phases) - 1) / 2) / len(phases) for n, name in enumerate(names)}
        _add_phase(figure, [row for row in rows if row.phase == phase], places, look(k)[0])
    _add_ceilings(figure, comparison, names)
    figure.update_xaxes(title_text="frames with the hand in view (%)", range=[-1, 101])
    figure.update_yaxes(tickvals=list(range(len(names))), ticktext=labels, range=[len(names) - 0.4, -0.6], ticks="")
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


def course_chart(course: Course, first: Course, courses: Sequence[Course]) -> Figure:
    """A small plot of one condition, with the first one's mean behind, on the axes that all of them have."""
    figure = plain_figure(height=190)
    if first is not course:
        dotted = {"color": PAPER, "width": 1.4, "dash": "dot"}
        figure.add_scatter(x=_short(first.at), y=_short(first.mean), mode="lines", line=dotted, hoverinfo="skip")
    _add_course(figure, course, *look(0))
    figure.data[-1].line.color = CEILING  # the mean, to stand out among the dots
    _finish_courses(figure, courses, [course])
    figure.update_layout(showlegend=False, margin={"l": 44, "r": 8, "t": 8, "b": 26}, font_size=11)
    return figure


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
        name=_label(course.condition, 60),
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
        _name_borders(figure, borders, end)


def _name_borders(figure: Figure, borders: dict[float, str], end: float) -> None:
    """Names beside borders, but for those that would overprint the one before; the last ones stand on the left."""
    free, width = 0.0, 0.15 * end
    for at, name in sorted(borders.items()):
        start, side = (at, "left") if at + width <= end else (at - width, "right")
        if start >= free:
            note = {"xanchor": side, "yanchor": "top", "yref": "paper", "showarrow": False}
            figure.add_annotation(x=at, y=1, text=name, font_color=BORDER, **note)
            free = start + width


def _label(name: str, letters: int = LETTERS) -> str:
    """A name for plotly, in lines of so many letters."""
    lines = textwrap.wrap(name, letters) or [name]
    return "<br>".join(line.replace("&", "&amp;").replace("<", "&lt;") for line in lines)


def _faint(color: str) -> str:
    red, green, blue = (int(color[k : k + 2], 16) for k in (1, 3, 5))
    return f"rgba({red},{green},{blue},0.16)"


def _short(values: Floats) -> Any:
    return np.asarray(values, dtype=np.float32)
