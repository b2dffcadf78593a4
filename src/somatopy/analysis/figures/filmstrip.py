"""A filmstrip of what the robot saw: pictures of its head camera, with what was detected in them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from somatopy.analysis.runs import Run
from somatopy.analysis.series import phase_starts
from somatopy.analysis.style import BORDER, HITS, source, style
from somatopy.analysis.summary import summarise
from somatopy.clock import FRAMES_PER_MINUTE, WINDOW
from somatopy.percept import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["Shot", "filmstrip", "filmstrip_frames", "robot_time"]

COLUMNS = 6
#: Frames from one picture to the next: about half a second.
EVERY = 8


@dataclass(frozen=True)
class Shot:
    """One picture of the head camera.

    Attributes:
        frame: which frame of the run it shows.
        image: shape (height, width, 3), uint8.
        pixel: (u, v) of the hand where the eye found it, or None.
        corners: outlines of the tags that were found, shape (tags, 4, 2), px.

    Example:
        >>> Shot(90, np.zeros((240, 320, 3), np.uint8)).pixel is None
        True
    """

    frame: int
    image: NDArray[np.uint8]
    pixel: tuple[float, float] | None = None
    corners: Floats = field(default_factory=lambda: np.empty((0, 4, 2)))


def filmstrip_frames(run: Run, columns: int = COLUMNS, every: int = EVERY) -> list[list[int]]:
    """Choose frames without looking at them: rows of `columns` frames, at the start and the end of every phase.

    A row begins in the middle of the phase's first and last five minutes; a phase shorter than that has one row, in
    its middle.

    Args:
        run: an open run folder.
        columns: pictures in a row.
        every: frames from one picture to the next.
    """
    rows = []
    starts = [round(start * WINDOW) for start in phase_starts(summarise(run)["phases"])]
    for start, stop in pairwise(starts):
        middles = [start + WINDOW // 2, stop - WINDOW // 2] if stop - start > 2 * WINDOW else [(start + stop) // 2]
        rows += [[middle + k * every for k in range(columns) if middle + k * every < stop] for middle in middles]
    return [row for row in rows if row]


def filmstrip(run: Run, shots: Sequence[Shot]) -> Figure:
    """Lay pictures out in rows, each with its time and what was detected.

    Args:
        run: the run that they belong to.
        shots: pictures in the order of time; see `filmstrip_frames`. A new row starts where frames are further apart.

    Raises:
        ValueError: no picture.
    """
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    rows = _rows(shots)
    summary = summarise(run)
    height, width = shots[0].image.shape[:2]
    across = max(map(len, rows))
    with style():
        size = (2.0 * across + 0.2, (2.0 * height / width + 0.42) * len(rows) + 0.5)
        figure = Figure(figsize=size, layout=ConstrainedLayoutEngine(w_pad=0.02, h_pad=0.02, wspace=0.02, hspace=0.02))
        figure.suptitle(
            f"What the head camera saw, at times set by the clock: {source(summary)}", x=0.01, ha="left", fontsize=11.0
        )
        panels = figure.subplots(len(rows), across, squeeze=False)
        for axes in panels.flat:
            axes.set_axis_off()
        for row, line in zip(panels, rows, strict=True):
            for axes, shot in zip(row, line, strict=False):
                _draw(axes, shot)
            row[0].set_title(f"{_phase(summary, line[0])}, {robot_time(line[0].frame)}", fontsize=9.0)
    return figure


def _rows(shots: Sequence[Shot]) -> list[list[Shot]]:
    if not shots:
        raise ValueError("A filmstrip needs at least one picture; filmstrip_frames(run) says which frames to render.")
    rows = [[shots[0]]]
    step = min((b.frame - a.frame for a, b in pairwise(shots)), default=1)
    for before, shot in pairwise(shots):
        if shot.frame - before.frame > step:
            rows.append([])
        rows[-1].append(shot)
    return rows


def _draw(axes: Axes, shot: Shot) -> None:
    axes.imshow(shot.image)
    for outline in shot.corners:
        axes.plot(*np.vstack([outline, outline[:1]]).T, color="#ff9d00", lw=1.6)
    if shot.pixel is not None:
        axes.plot(*shot.pixel, marker="+", ms=11, mew=2.0, color=BORDER)
    seen = shot.pixel is not None
    axes.set_title(robot_time(shot.frame), fontsize=9.0)
    colors: Any = {"color": "white", "backgroundcolor": BORDER if seen else HITS}
    axes.text(0.03, 0.05, "seen" if seen else "missed", transform=axes.transAxes, fontsize=7.5, **colors)


def robot_time(frame: int) -> str:
    """When a frame was, in robot time.

    Example:
        >>> robot_time(950)
        '1 min 03.3 s'
    """
    minutes, frames = divmod(frame, FRAMES_PER_MINUTE)
    return f"{minutes} min {frames * 60 / FRAMES_PER_MINUTE:04.1f} s"


def _phase(summary: Mapping[str, Any], shot: Shot) -> str:
    starts = [round(start * WINDOW) for start in phase_starts(summary["phases"])]
    phase = int(np.searchsorted(starts[1:-1], shot.frame, side="right"))
    return "intact" if summary["phases"][phase]["damage"] == "none" else "damaged"
