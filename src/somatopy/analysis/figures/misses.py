"""How often each arm region is missed: cells over every pair of arm joints, intact below and damaged above."""

from __future__ import annotations

from collections.abc import Mapping
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from somatopy.analysis.phases import phase_names
from somatopy.analysis.regions import FEW, Regions, arm_regions
from somatopy.analysis.runs import Run
from somatopy.analysis.style import HITS, MISSES, NOTHING, TREND, source, style
from somatopy.analysis.summary import summarise

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["misses_figure"]

#: Letters of the title to an inch.
LETTERS = 11.5


def misses_figure(run: Run) -> Figure | None:
    """Draw the share of misses over the arm's joint space; None where no arm posture was recorded.

    A square of panels, one row and one column a joint: below the diagonal the first phase, above it the last; on the
    diagonal both, over one joint alone.

    Args:
        run: an open run folder.
    """
    from matplotlib.figure import Figure

    found, summary = arm_regions(run), summarise(run)
    if not found:
        return None
    names = phase_names(summary)
    first, last = min(found), max(found)
    joints = found[first].joints
    with style():
        edge = 2.3 * len(joints) if len(joints) > 1 else 4.6
        figure = Figure(figsize=(edge + 1.2, edge + 0.6), layout="constrained")
        panels = figure.subplots(len(joints), len(joints), squeeze=False, sharex="col")
        for (row, column), axes in np.ndenumerate(panels):
            _clean(axes)
            if row == column:
                _draw_joint(axes, {names[p]: found[p] for p in dict.fromkeys((first, last))}, row)
            elif row > column or last != first:
                drawn = _draw_pair(axes, found[first if row > column else last], column, row)
            else:
                axes.set_axis_off()
            _label(axes, row, column, found[first])
        if len(joints) > 1:
            bar = figure.colorbar(drawn, ax=panels, shrink=0.5, aspect=30, pad=0.02, format="{x:.0f} %")
            bar.set_label("frames in which the hand was not seen")
        _title(figure, panels, summary, names, first, last)
    return figure


def _clean(axes: Axes) -> None:
    axes.grid(False)
    axes.spines["right"].set_visible(False)
    axes.tick_params(labelsize=8.0)


def _draw_pair(axes: Axes, regions: Regions, x: int, y: int) -> Any:
    a, b = min(x, y), max(x, y)
    share = regions.share(a, b)
    cells = 100 * (share.T if x == a else share)
    axes.set_facecolor(NOTHING)
    axes.patch.set(hatch="////", edgecolor="#dcdcdc", linewidth=0)
    look: Any = {"cmap": MISSES, "vmin": 0, "vmax": 100, "rasterized": True}
    return axes.pcolormesh(regions.borders(x), regions.borders(y), np.ma.masked_invalid(cells), **look)


def _draw_joint(axes: Axes, phases: Mapping[str, Regions], joint: int) -> None:
    looks: tuple[Any, Any] = ({"color": TREND, "lw": 1.8}, {"color": HITS, "lw": 1.4, "dashes": (4, 1.5)})
    for (name, regions), look in zip(phases.items(), looks, strict=False):
        edges = regions.borders(joint)
        axes.plot((edges[1:] + edges[:-1]) / 2, 100 * regions.along(joint), label=name, **look)
    axes.set_ylim(0, 100)
    axes.yaxis.tick_right()
    axes.spines["left"].set_visible(False)
    axes.spines["right"].set_visible(True)
    if joint == 0:
        axes.legend(loc="lower center", fontsize=7.5, handlelength=1.8)


def _label(axes: Axes, row: int, column: int, regions: Regions) -> None:
    if regions.units[column] != "rad":
        axes.locator_params(axis="x", nbins=3)
    if row == len(regions.joints) - 1:
        axes.set_xlabel(regions.axis(column), fontsize=9.0)
    if column == (1 if row == 0 else 0) and row != column:
        axes.set_ylabel(regions.axis(row), fontsize=9.0)
    elif row == column:
        axes.set_ylabel("missed (%)", fontsize=9.0)
        axes.yaxis.set_label_position("right")
    else:
        axes.tick_params(labelleft=False)


def _title(figure: Figure, panels: Any, summary: Mapping[str, Any], names: list[str], first: int, last: int) -> None:
    where = names[first] if first == last else f"below the diagonal {names[first]}, above it {names[last]}"
    few = f"hatched: fewer than {FEW} frames"
    if panels.size == 1:
        where, few = (
            names[first] if first == last else f"{names[first]} and {names[last]}",
            few.replace("hatched", "gaps"),
        )
    said = f"How often each arm region is missed: {source(summary)}", f"{where}; {few}"
    room = int(LETTERS * figure.get_figwidth())
    text = "\n".join(line for whole in said for line in wrap(whole, room))
    figure.suptitle(text, x=0.01, ha="left", fontsize=11.0)
