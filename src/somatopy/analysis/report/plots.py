"""What the report's interactive plots have in common: style, lines, the axis of time and its borders."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from somatopy.analysis.series import in_minutes, lone
from somatopy.analysis.style import BORDER, run_look
from somatopy.clock import FRAMES_PER_MINUTE, WINDOW
from somatopy.percept import Floats

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

__all__ = ["TIME", "add", "dashes", "label", "look", "name_borders", "over_time", "plain_figure", "restyle"]

TIME, MINUTES = "robot time, in 5-minute windows", "robot time, in minutes"
FONT = "system-ui, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif"
#: px of a row of the legend, of a letter in it, of what stands before a name, and of a plot on a wide page.
ROW, LETTER, SAMPLE, WIDE = 21, 7.2, 52, 900
#: Lines beside each other in one box say nothing any more if there are more of them.
TOGETHER = 8


def plain_figure(height: int) -> Figure:
    """An empty figure in the report's style.

    Args:
        height: px.
    """
    from plotly.graph_objects import Figure

    figure = Figure()
    restyle(figure, height)
    return figure


def restyle(figure: Figure, height: int) -> None:
    """Give a figure the report's style."""
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


def add(
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
    """Add a line; where a point has no neighbour, and would not be seen, points have marks."""
    figure.add_scatter(
        x=np.asarray(at, dtype=np.float32),
        y=np.asarray(values, dtype=np.float32),
        name=name,
        mode="lines+markers" if mode == "lines" and len(lone(values)) else mode,
        line={"color": color, "dash": dash, "width": width},
        marker={"size": 5},
        hovertemplate=f"%{{y:,.{decimals}f}}",
        **more,
    )


def over_time(figure: Figure, end: float, there: Sequence[tuple[float, str]]) -> Figure:
    """Finish a figure over time: axis, borders with their names, room for the legend.

    Args:
        figure: lines over windows; those of short runs are brought to minutes.
        end: where the last run ends, in windows.
        there: borders and their names.
    """
    borders: dict[float, list[str]] = {}
    for at, name in there:
        borders.setdefault(at, []).extend([name] if name not in borders.get(at, []) else [])
    scale = WINDOW // FRAMES_PER_MINUTE if in_minutes(end) else 1
    for trace in figure.data if scale != 1 else ():
        trace.x = np.asarray(trace.x, dtype=np.float32) * scale
    last = scale * (end or 1.0)
    for at in borders:
        figure.add_vline(scale * at, line_color=BORDER, line_width=1.6)
    name_borders(figure, {scale * at: ", ".join(names) for at, names in borders.items()}, last)
    figure.update_xaxes(title_text=MINUTES if scale != 1 else TIME, range=[-0.015 * last, 1.01 * last])
    _make_room(figure)
    return figure


def name_borders(figure: Figure, borders: Mapping[float, str], end: float) -> None:
    """Names above borders and below the legend, but for those that would overprint the one before.

    The last names end at their border, the others begin there.
    """
    free = 0.0
    for at, name in sorted(borders.items()):
        width = end * max(0.15, 0.012 * len(name))
        start, side = (at, "left") if at + width <= end else (at - width, "right")
        if start >= free:
            note = {"xanchor": side, "yanchor": "bottom", "yref": "paper", "showarrow": False}
            figure.add_annotation(x=at, y=1, text=name, font_color=BORDER, **note)
            free = start + width
    figure.update_layout(legend_y=1.09 if borders else 1.03)


def _make_room(figure: Figure) -> None:
    """Make the figure higher by what its legend takes, and tell each line by itself where there are many."""
    names = {trace.name for trace in figure.data if trace.name and trace.showlegend is not False}
    if not names or figure.layout.showlegend is False:
        return
    longest = max(len(line) for name in names for line in name.split("<br>"))
    rows = -(-len(names) // max(1, int(WIDE // (SAMPLE + LETTER * longest))))
    lines = max(name.count("<br>") + 1 for name in names)
    figure.update_layout(height=figure.layout.height + ROW * (rows * lines - 1))
    if len(names) > TOGETHER:
        figure.update_layout(hovermode="closest")


def look(index: int) -> tuple[str, str]:
    """Colour and dashes of one of several lines."""
    color, lengths = run_look(index)
    return color, dashes(lengths)


def dashes(lengths: Sequence[float]) -> str:
    """Dashes as plotly wants them."""
    return ",".join(f"{1.8 * length:g}px" for length in lengths) or "solid"


def label(name: str, letters: int) -> str:
    """A name for plotly, in lines of so many letters."""
    lines = textwrap.wrap(name, letters) or [name]
    return "<br>".join(line.replace("&", "&amp;").replace("<", "&lt;") for line in lines)
