"""The axis of time that figures of a run share: windows, or minutes of a short run; borders with their names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from somatopy.analysis.series import borders, in_minutes, lone, phase_starts
from somatopy.analysis.style import marks
from somatopy.clock import FRAMES_PER_MINUTE, WINDOW
from somatopy.percept import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

__all__ = ["over_time", "plot"]

#: Minutes in a window.
MINUTES = WINDOW // FRAMES_PER_MINUTE


def over_time(
    panels: Sequence[Axes], phases: Sequence[Mapping[str, Any]], more: Sequence[tuple[float, str]] = (), text: str = ""
) -> None:
    """Set limits, ticks and label of the axis of time, and draw the borders between phases.

    Args:
        panels: one above the other; names of borders stand in the first, the label under the last.
        phases: of the summary.
        more: further borders and their names.
        text: the label; what points mean that stand where a stretch of time starts if "".
    """
    end = phase_starts(phases)[-1] or 1.0
    for axes in panels:
        axes.set_xlim(-0.015 * end, end)
        named = [*borders(phases), *more]
        marks(axes, named if axes is panels[0] else [(at, "") for at, _ in named])
        _ticks(axes, end)
    unit = "minutes of robot time" if in_minutes(end) else "5-minute windows of robot time"
    panels[-1].set_xlabel(text or f"{unit}; windows and minutes are drawn where they start")


def _ticks(axes: Axes, end: float) -> None:
    from matplotlib.ticker import FuncFormatter, MultipleLocator

    if not in_minutes(end):
        axes.locator_params(axis="x", integer=True)
        return
    step = next(step for step in (0.25, 0.5, 1, 2, 5) if MINUTES * end <= 8 * step or step == 5)
    axes.xaxis.set_major_locator(MultipleLocator(step / MINUTES))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda at, _: f"{round(MINUTES * at, 2):g}"))


def plot(axes: Axes, at: Floats, values: Floats, **look: Any) -> Line2D:
    """Draw a line, with marks where a point has no neighbour and would not be seen."""
    alone = lone(values).tolist()
    marked: Any = {"marker": "o", "ms": 3.0, "markevery": alone} if alone else {}
    (drawn,) = axes.plot(at, values, **marked, **look)
    return drawn
