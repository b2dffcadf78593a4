"""The paper's Figure 2 with the real maps: both lattices and their strongest links, in lattice and in joint space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from somatopy.analysis.columns import readable
from somatopy.analysis.order import Order, order_of
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

__all__ = ["figure2", "joint_pairs"]

LINKS = 150
#: Links in joint space: the strongest of as many head units.
FEWER_LINKS = 16
EDGE = "#7f7f7f"


@dataclass(frozen=True)
class _Map:
    """A map as a reader is shown it: angles in degrees, lengths in metres.

    `at` are the units' postures (units, joints), `limits` the joints' (joints, 2), `joints` and `signs` their names and
    the signs of their units, `shape` the lattice's, `order` how far it is ordered.
    """

    title: str
    at: Floats
    limits: Floats
    shape: tuple[int, int]
    joints: Sequence[str]
    signs: Sequence[str]
    order: Order

    @classmethod
    def of(cls, run: Run, order: Order, postures: Floats, limits: Floats, shape: tuple[int, int]) -> _Map:
        side = order.side
        factors, signs = zip(*map(readable, run.units(side)), strict=True)
        shown = postures * np.array(factors), limits * np.array(factors)[:, None]
        return cls(f"{side} map", *shown, shape, run.joints(side), signs, order)

    def spots(self, a: int, b: int) -> Floats:
        """Where each unit is drawn over two joints, (units, 2); over a single one by its row in the lattice."""
        rows = np.indices(self.shape)[0 if self.shape[0] > 1 else 1].ravel()
        return np.column_stack([self.at[:, a], rows if a == b else self.at[:, b]])

    def label(self, joint: int) -> str:
        return f"{self.joints[joint]} ({self.signs[joint]})" if self.signs[joint] else self.joints[joint]


def figure2(run: Run) -> Figure | None:
    """Draw the maps and links at the end of the first phase, in the form of the paper's Figure 2.

    Units are coloured by the head's first joint: head units by their own angle, arm units by that of the head unit
    which their strongest link leads to, so that the gaze learned is seen on the arm map. Links shown are the strongest
    of their arm unit: in lattice space the 150 strongest of those; in joint space 16 that lead to different head units,
    in the colour of the gaze. Width grows with weight. The lattice is drawn in joint space where it has some order, see
    `order_of`; of a map without any it would be a tangle, and the title says so.

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
    arm_order, head_order = order_of(run, maps)
    arm = _Map.of(run, arm_order, maps.arm_postures(), maps.arm_limits, maps.arm_shape)
    head = _Map.of(run, head_order, maps.head_postures(), maps.head_limits, maps.head_shape)
    with style():
        figure = Figure(figsize=(11.0, 8.6), layout="constrained")
        rows: Any = figure.subfigures(2, 1, height_ratios=[1, 1], hspace=0.04)
        scale = _lattice_space(rows[0], maps, arm, head)
        _joint_space(rows[1], maps, arm, head)
        form = "{x:.0f}°" if head.signs[0] == "°" else f"{{x:.3g}} {head.signs[0]}".rstrip()
        bar = figure.colorbar(scale, ax=rows[0].axes, shrink=0.8, pad=0.02, format=form)
        bar.set_label(f"{head.joints[0]} of the head unit; on the arm map,\nof the unit its strongest link leads to")
        minutes = maps.frame / FRAMES_PER_MINUTE
        text = f"Maps and their {_shown(maps)} strongest links after {minutes:.0f} min: {source(summarise(run))}"
        figure.suptitle(text, x=0.01, ha="left", fontsize=11.0)
    return figure


def joint_pairs(joints: int) -> list[tuple[int, int]]:
    """Which joints to plot against each other: the first two, and the last two where there are more.

    A single joint is paired with itself: it is plotted against the rows of the lattice.

    Example:
        >>> joint_pairs(4), joint_pairs(2), joint_pairs(3), joint_pairs(1)
        ([(0, 1), (2, 3)], [(0, 1)], [(0, 1), (1, 2)], [(0, 0)])
    """
    return [(0, min(1, joints - 1))] + ([(joints - 2, joints - 1)] if joints > 2 else [])


def _led_to(maps: Snapshot, values: Floats) -> Floats:
    """Of values of the head units, those that the arm units' strongest links lead to, (arm units,); NaN without."""
    found = np.full(len(maps.arm_codebook), np.nan)
    pre, post, _ = maps.gaze_links()
    found[pre] = values[post]
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


def _lattice_space(figure: Any, maps: Snapshot, arm: _Map, head: _Map) -> Any:
    """Both lattices as two tilted sheets, the arm's on the left, and links from one to the other."""
    axes = figure.subplots()
    axes.set_axis_off()
    axes.set_aspect("equal")
    left, right = _sheet(arm.shape, 0.0), _sheet(head.shape, 1.75)
    low, high = head.limits[0]
    look: Any = {"cmap": MAP, "vmin": low, "vmax": high, "s": 26.0, "zorder": 3, "linewidths": 0.4}
    for at, shape in ((left, arm.shape), (right, head.shape)):
        _draw_edges(axes, at, shape)
    colors = _led_to(maps, head.at[:, 0])
    linked = np.isfinite(colors)
    axes.scatter(*left[~linked].T, s=12.0, facecolor="white", edgecolor="#9a9a9a", linewidths=0.6, zorder=3)
    axes.scatter(*left[linked].T, c=colors[linked], edgecolor="#555555", **look)
    drawn = axes.scatter(*right.T, c=head.at[:, 0], edgecolor="#555555", **look)
    _draw_links(axes, left, right, maps)
    for at, drawn_map in ((left, arm), (right, head)):
        rows, columns = drawn_map.shape
        text = f"{drawn_map.title}, {rows} × {columns} units, lattice space"
        axes.text(at[:, 0].mean(), at[:, 1].max() + 0.06, text, ha="center", size=10.5)
    return drawn


def _sheet(shape: tuple[int, int], shift: float) -> Floats:
    """Where a lattice's units are drawn, shape (units, 2): a parallelogram of width 1.2, `shift` to the right."""
    rows, columns = np.indices(shape).reshape(2, -1)
    x, y = columns / max(shape[1] - 1, 1), rows / max(shape[0] - 1, 1)
    return np.column_stack([shift + x + 0.25 * y, y])


def _joint_space(figure: Any, maps: Snapshot, arm: _Map, head: _Map) -> None:
    """The units where their codes lie: head in the middle, the arm's joints by pairs to its sides."""
    pairs, over = joint_pairs(len(arm.joints)), joint_pairs(len(head.joints))[0]
    panels = figure.subplots(1, 1 + len(pairs), squeeze=False)[0]
    order = [panels[0], *panels[2:]]
    yaw = _led_to(maps, head.at[:, 0])
    for axes, pair in zip(order, pairs, strict=True):
        _draw_map(axes, arm, pair, yaw, head.limits[0])
    _draw_map(panels[1], head, over, head.at[:, 0], head.limits[0])
    for axes, pair in zip(order, pairs, strict=True):
        _draw_links_between(figure, axes, panels[1], (arm, pair), (head, over), maps)


def _draw_map(axes: Axes, drawn: _Map, pair: tuple[int, int], colors: Floats, limits: Floats) -> None:
    at, (a, b) = drawn.spots(*pair), pair
    if drawn.order.word != "not ordered":
        _draw_edges(axes, at, drawn.shape)
    linked = np.isfinite(colors)
    axes.scatter(
        at[~linked, 0], at[~linked, 1], s=5.0, facecolor="white", edgecolor="#9a9a9a", linewidths=0.5, zorder=3
    )
    look: Any = {"s": 17.0, "edgecolor": "white", "linewidths": 0.3, "zorder": 3}
    axes.scatter(at[linked, 0], at[linked, 1], c=colors[linked], cmap=MAP, vmin=limits[0], vmax=limits[1], **look)
    up = drawn.label(b) if a != b else "row in the lattice"
    axes.set_xlabel(drawn.label(a))
    axes.set_ylabel(up, bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0})
    axes.set_title(f"{drawn.title}, joint space{_order_text(drawn.order)}", fontsize=10.0)
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


def _order_text(order: Order) -> str:
    return "" if order.error is None else f"\n{order.word}: topographic error {order.error:.2f}"


def _apart(maps: Snapshot) -> Any:
    """The strongest links that lead to different head units: arm units, head units, weights."""
    pre, post, weights = maps.gaze_links()
    chosen = np.sort(np.unique(post, return_index=True)[1])[:FEWER_LINKS]
    return pre[chosen], post[chosen], weights[chosen]


def _draw_links_between(
    figure: Any, a: Axes, b: Axes, arm: tuple[_Map, Any], head: tuple[_Map, Any], maps: Snapshot
) -> None:
    """Draw links across two panels."""
    from matplotlib import colormaps
    from matplotlib.patches import ConnectionPatch

    pre, post, weights = _apart(maps)
    gaze, (low, high) = head[0].at[:, 0], head[0].limits[0]
    left, right = (drawn.spots(*pair) for drawn, pair in (arm, head))
    for axes in (a, b):
        axes.patch.set_visible(False)  # links lie under the units, and under the labels between the panels
    for i, j, width in zip(pre, post, _widths(weights, 2.6) if len(pre) else [], strict=True):
        color = colormaps[MAP]((gaze[j] - low) / (high - low))
        ends: Any = (tuple(left[i]), tuple(right[j]), a.transData, b.transData)
        figure.add_artist(ConnectionPatch(*ends, color=color, lw=width + 0.6, alpha=0.9, zorder=-1))
        for axes, spot in ((a, left[i]), (b, right[j])):
            axes.scatter(spot[0], spot[1], s=34.0, color=color, edgecolor=CEILING, linewidths=0.9, zorder=5)
