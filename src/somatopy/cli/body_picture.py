"""A robot from outside, and beside it what its eye sees, in two arm postures."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from somatopy.bodies import MujocoBody
from somatopy.bodies.outside import Onlooker, standpoint
from somatopy.experiment.look import Outlook
from somatopy.eyes import FiducialEye
from somatopy.percept import Floats, Image

__all__ = ["body_picture", "telling"]

_SIZE = 600, 600  # px, of the pictures from outside
_FOUND = "#e6007e"


def body_picture(body: MujocoBody, postures: Sequence[tuple[Floats, Floats]]) -> Figure:
    """A robot and what it sees, in two postures.

    Args:
        body: the robot, without physics; it is moved.
        postures: of arm, shape (n_arm,), and head, shape (n_head,), rad, slides m: two of them.

    Raises:
        NoGL: no OpenGL works here.
    """
    figure = Figure(figsize=(9.0, 7.6), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(2, 2, width_ratios=(1.0, 1.25))
    figure.suptitle(body.anatomy.name, fontsize=12, parse_math=False)
    eye = FiducialEye(body.camera, body.marker, skip=False)
    for row, (arm, head) in zip(axes, postures, strict=True):
        with closing(Onlooker(body, standpoint(body, [(arm, head)]), _SIZE)) as onlooker:
            _show(row[0], onlooker.picture(arm, head), "from outside; the ring is around the eye")
            pixel = onlooker.pixel(body.view(arm, head).camera[:3])
        row[0].plot(*pixel, "o", markersize=14, markerfacecolor="none", markeredgecolor=_FOUND, markeredgewidth=2)
        body.place(arm, head)
        picture = body.picture()
        _show(row[1], picture, "")
        _outline(row[1], eye.detect(picture), body.anatomy.camera.name)
    return figure


def telling(arms: Floats, found: Outlook) -> list[tuple[Floats, Floats]]:
    """Two postures to show: that in which the hand is seen best, and one far from it in which it is seen well.

    Args:
        arms: arm postures, shape (n, n_arm), rad, slides m.
        found: what could be seen at these.
    """
    first = int(found.seen.argmax())
    seen = found.seen[found.seen > 0]
    good = found.seen >= (np.median(seen) if len(seen) else 0)
    apart = np.linalg.norm(arms - arms[first], axis=1)
    return [(arms[k], found.heads[k]) for k in (first, int(np.where(good, apart, -1.0).argmax()))]


def _show(axes: Axes, picture: Image, title: str) -> None:
    axes.imshow(picture)
    axes.set_axis_off()
    axes.set_title(title, fontsize=10)


def _outline(axes: Axes, tags: dict[int, Floats], camera: str) -> None:
    for corners in tags.values():
        axes.add_patch(Polygon(corners, fill=False, edgecolor=_FOUND, linewidth=2))
    said = f"tag {', '.join(map(str, tags))} found" if tags else "no tag found"
    axes.set_title(f"what {camera} sees: {said}", fontsize=10, parse_math=False)
