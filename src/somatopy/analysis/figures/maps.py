"""The paper's Figure 2 with the real maps: both lattices and their strongest links, in lattice and in joint space."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from somatopy.analysis.phases import played
from somatopy.analysis.runs import Run
from somatopy.analysis.snapshots import Snapshot, paper_snapshot
from somatopy.analysis.style import CEILING, MAP, source, style
from somatopy.analysis.summary import summarise
from somatopy.clock import FRAMES_PER_MINUTE
from somatopy.percept import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["figure2", "joint_pairs", "yaw_of_units"]

LINKS = 150
FEWER_LINKS = 60
EDGE = "#7f7f7f"


def figure2(run: Run) -> Figure | None:
    """Draw the maps and links at the end of the first phase, in the form of the paper's Figure 2.

    Units are coloured by the head's first joint: head units by their own angle, arm units by that of the head unit
    which their strongest link leads to, so that the gaze learned is seen on the arm map. Links shown are the strongest
    of their arm unit: in lattice space the 150 strongest of those, in joint space 60; width grows with weight.

    Args:
        run: an open run folder.

    Returns:
        None where the run has no snapshots, or those of a learner whose maps are not the paper's.
    """
    from matplotlib.figure import Figure

    path = _end_of_first_phase(run)
    maps = paper_snapshot(run, path) if path else None
    if maps is None:
        return None
    arm, head = run.joints("arm"), run.joints("head")
    with style():
        figure = Figure(figsize=(11.0, 8.6), layout="constrained")
        rows: Any = figure.subfigures(2, 1, height_ratios=[1, 1], hspace=0.04)
        scale = _lattice_space(rows[0], maps, head)
        _joint_space(rows[1], maps, arm, head)
        bar = figure.colorbar(scale, ax=rows[0].axes, shrink=0.8, pad=0.02, format="{x:.0f}°")
        bar.set_label(f"{head[0]} of the head unit; on the arm map,\nof the unit its strongest link leads to")
        minutes = maps.frame / FRAMES_PER_MINUTE
        text = f"Maps and their {_shown(maps)} strongest links after {minutes:.0f} min: {source(summarise(run))}"
        figure.suptitle(text, x=0.01, ha="left", fontsize=11.0)
    return figure


def joint_pairs(joints: int) -> list[tuple[int, int]]:
    """Which joints to plot against each other: the first two, and the last two where there are more.

    Example:
        >>> joint_pairs(4), joint_pairs(2), joint_pairs(3), joint_pairs(1)
        ([(0, 1), (2, 3)], [(0, 1)], [(0, 1), (1, 2)], [(0, 0)])
    """
    return [(0, min(1, joints - 1))] + ([(joints - 2, joints - 1)] if joints > 2 else [])


def yaw_of_units(maps: Snapshot) -> Floats:
    """The head's first joint where each arm unit's strongest link leads, shape (arm units,), rad; NaN without links."""
    found = np.full(len(maps.arm_codebook), np.nan)
    pre, post, _ = maps.gaze_links()
    found[pre] = maps.head_postures()[post, 0]
    return found


def _end_of_first_phase(run: Run) -> Path | None:
    """The last snapshot before the first border, or else the first there is."""
    paths, phases = run.snapshots, summarise(run)["phases"]
    if not paths:
        return None
    windows = [len(phases[index]["hits_per_window"]) for index in played(phases)]
    return paths[min(max(windows[0] - 1, 0), len(paths) - 1) if windows else 0]


def _shown(maps: Snapshot) -> int:
    return min(LINKS, len(maps.gaze_links()[0]))


def _lattice_space(figure: Any, maps: Snapshot, head: Sequence[str]) -> Any:
    """Both lattices as two tilted sheets, the arm's on the left, and links from one to the other."""
    axes = figure.subplots()
    axes.set_axis_off()
    axes.set_aspect("equal")
    left, right = _sheet(maps.arm_shape, 0.0), _sheet(maps.head_shape, 1.75)
    low, high = np.degrees(maps.head_limits[0])
    look: Any = {"cmap": MAP, "vmin": low, "vmax": high, "s": 26.0, "zorder": 3, "linewidths": 0.4}
    for at, shape in ((left, maps.arm_shape), (right, maps.head_shape)):
        _draw_edges(axes, at, shape)
    colors = np.degrees(yaw_of_units(maps))
    linked = np.isfinite(colors)
    axes.scatter(*left[~linked].T, s=12.0, facecolor="white", edgecolor="#9a9a9a", linewidths=0.6, zorder=3)
    axes.scatter(*left[linked].T, c=colors[linked], edgecolor="#555555", **look)
    drawn = axes.scatter(*right.T, c=np.degrees(maps.head_postures()[:, 0]), edgecolor="#555555", **look)
    _draw_links(axes, left, right, maps)
    for at, name, shape in ((left, "arm map", maps.arm_shape), (right, "head map", maps.head_shape)):
        text = f"{name}, {shape[0]} × {shape[1]} units, lattice space"
        axes.text(at[:, 0].mean(), at[:, 1].max() + 0.06, text, ha="center", size=10.5)
    return drawn


def _sheet(shape: tuple[int, int], shift: float) -> Floats:
    """Where a lattice's units are drawn, shape (units, 2): a parallelogram of width 1.2, `shift` to the right."""
    rows, columns = np.indices(shape).reshape(2, -1)
    x, y = columns / max(shape[1] - 1, 1), rows / max(shape[0] - 1, 1)
    return np.column_stack([shift + x + 0.25 * y, y])


def _joint_space(figure: Any, maps: Snapshot, arm: Sequence[str], head: Sequence[str]) -> None:
    """The units where their codes lie: head in the middle, the arm's joints by pairs to its sides."""
    pairs = joint_pairs(len(arm))
    panels = figure.subplots(1, 1 + len(pairs), squeeze=False)[0]
    order = [panels[0], *panels[2:]]
    postures, shape = np.degrees(maps.arm_postures()), maps.arm_shape
    yaw = np.degrees(yaw_of_units(maps))
    for axes, (a, b) in zip(order, pairs, strict=True):
        _draw_map(axes, postures[:, [a, b]], shape, (arm[a], arm[b]), "arm map", yaw, maps)
    gazes = np.degrees(maps.head_postures())
    a, b = joint_pairs(len(head))[0]
    _draw_map(panels[1], gazes[:, [a, b]], maps.head_shape, (head[a], head[b]), "head map", gazes[:, 0], maps)
    for axes, (c, d) in zip(order, pairs, strict=True):
        _draw_links_between(figure, axes, panels[1], postures[:, [c, d]], gazes[:, [a, b]], maps)


def _draw_map(
    axes: Axes, at: Floats, shape: tuple[int, int], names: tuple[str, str], title: str, colors: Floats, maps: Snapshot
) -> None:
    low, high = np.degrees(maps.head_limits[0])
    _draw_edges(axes, at, shape)
    linked = np.isfinite(colors)
    axes.scatter(
        at[~linked, 0], at[~linked, 1], s=5.0, facecolor="white", edgecolor="#9a9a9a", linewidths=0.5, zorder=3
    )
    look: Any = {"s": 17.0, "edgecolor": "white", "linewidths": 0.3, "zorder": 3}
    axes.scatter(at[linked, 0], at[linked, 1], c=colors[linked], cmap=MAP, vmin=low, vmax=high, **look)
    axes.set_xlabel(f"{names[0]} (°)")
    axes.set_ylabel(f"{names[1]} (°)", bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0})
    axes.set_title(f"{title}, joint space")
    axes.grid(False)


def _draw_edges(axes: Axes, at: Floats, shape: tuple[int, int]) -> None:
    from matplotlib.collections import LineCollection

    grid = at.reshape(*shape, 2)
    look: Any = {"colors": EDGE, "linewidths": 0.4, "alpha": 0.18, "zorder": 1}
    axes.add_collection(LineCollection([*grid, *grid.swapaxes(0, 1)], **look))
    axes.autoscale_view()


def _widths(weights: Any, widest: float = 1.8) -> Floats:
    widths: Floats = 0.25 + (widest - 0.25) * weights / weights.max()
    return widths


def _draw_links(axes: Axes, left: Floats, right: Floats, maps: Snapshot) -> None:
    from matplotlib.collections import LineCollection

    pre, post, weights = (found[:LINKS] for found in maps.gaze_links())
    if len(pre):
        ends = np.stack([left[pre], right[post]], axis=1)
        look: Any = {"colors": CEILING, "linewidths": _widths(weights), "alpha": 0.45, "zorder": 4}
        axes.add_collection(LineCollection(list(ends), **look))


def _draw_links_between(figure: Any, a: Axes, b: Axes, left: Floats, right: Floats, maps: Snapshot) -> None:
    """Draw links across two panels."""
    from matplotlib.patches import ConnectionPatch

    pre, post, weights = (found[:FEWER_LINKS] for found in maps.gaze_links())
    for axes in (a, b):
        axes.patch.set_visible(False)  # links lie under the units, and under the labels between the panels
    for start, end, width in zip(left[pre], right[post], _widths(weights, 1.4) if len(pre) else [], strict=True):
        look: Any = {"color": CEILING, "lw": width, "alpha": 0.35, "zorder": -1}
        figure.add_artist(ConnectionPatch(tuple(start), tuple(end), a.transData, b.transData, **look))
