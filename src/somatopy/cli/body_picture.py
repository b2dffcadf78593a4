"""A robot from outside, and beside it what its eye sees, in two arm postures."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing

import mujoco
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from somatopy.bodies import MujocoBody
from somatopy.bodies.marker import SITE
from somatopy.experiment.look import Outlook
from somatopy.eyes import FiducialEye
from somatopy.percept import Floats, Image

__all__ = ["body_picture", "telling"]

_SIZE = 600  # px, of the pictures from outside
_FOVY = 30.0  # degrees
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
    figure.suptitle(body.anatomy.name, fontsize=12)
    with closing(body.another()) as shown:
        eye = FiducialEye(body.camera, body.marker, skip=False)
        for row, (arm, head) in zip(axes, postures, strict=True):
            body.place(arm, head)
            picture, pixel = _from_outside(body, shown, (arm, head))
            _show(row[0], picture, "from outside; the ring is around the eye")
            row[0].plot(*pixel, "o", markersize=14, markerfacecolor="none", markeredgecolor=_FOUND, markeredgewidth=2)
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
    axes.set_title(f"what {camera} sees: {said}", fontsize=10)


# -- from outside ------------------------------------------------------------------------------------------------------


def _from_outside(body: MujocoBody, shown: MujocoBody, posture: tuple[Floats, Floats]) -> tuple[Image, Floats]:
    """The body as a camera in the room sees it, and the pixel of its eye.

    The camera is that of a second body, taken out of its head and put there.
    """
    middle, radius = _extent(body)
    eye, hand = (place - middle for place in (body.data.cam_xpos[_camera(body)], body.data.site(SITE).xpos))
    way = _aslant(hand if np.linalg.norm(hand[:2]) > 0.05 * radius else hand - eye)
    place, outside = middle + way * radius / np.sin(np.deg2rad(_FOVY) / 2), _camera(shown)
    _put_camera(shown, place, way)
    shown.place(*posture)
    x, y, z = (body.data.cam_xpos[_camera(body)] - place) @ shown.data.cam_xmat[outside].reshape(3, 3)
    focal = 0.5 * _SIZE / np.tan(np.deg2rad(_FOVY) / 2)
    return np.array(shown.picture(width=_SIZE, height=_SIZE)), 0.5 * _SIZE + focal * np.array([x, -y]) / -z


def _camera(body: MujocoBody) -> int:
    return int(body.model.camera(body.camera.name).id)


def _extent(body: MujocoBody) -> tuple[Floats, float]:
    """Middle and radius, m, of a ball around all that moves, what carries it, and the eye."""
    model, data = body.model, body.data
    robot = _robot(body)
    geoms = np.flatnonzero(np.isin(model.geom_bodyid, robot) & (model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE))
    centres = np.vstack([data.geom_xpos[geoms], data.cam_xpos[[_camera(body)]]])
    reach = np.append(model.geom_rbound[geoms], 0.03)[:, None]
    low, high = (centres - reach).min(axis=0), (centres + reach).max(axis=0)
    middle = 0.5 * (low + high)
    return middle, float((np.linalg.norm(centres - middle, axis=1) + reach[:, 0]).max())


def _robot(body: MujocoBody) -> list[int]:
    """The bodies that stand on the same child of the world as arm or eye."""
    model = body.model
    parts = model.body(body.anatomy.marker.body).id, model.cam_bodyid[_camera(body)]
    roots = {int(model.body_rootid[part]) for part in parts} - {0}
    return [b for b in range(model.nbody) if int(model.body_rootid[b]) in roots]


def _aslant(way: Floats) -> Floats:
    """Unit vector from the robot to the camera: from the hand's side, turned by 35 degrees, from 25 above."""
    angle = np.arctan2(way[1], way[0]) - np.deg2rad(35)
    lift = np.deg2rad(25)
    return np.array([np.cos(lift) * np.cos(angle), np.cos(lift) * np.sin(angle), np.sin(lift)])


def _put_camera(body: MujocoBody, place: Floats, back: Floats) -> None:
    """Fix the body's camera to the world; `back` is the unit vector against which it looks."""
    model, k = body.model, _camera(body)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    turn = np.column_stack([right, np.cross(back, right), back])
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, turn.ravel())
    model.cam_bodyid[k], model.cam_pos[k], model.cam_quat[k] = 0, place, quaternion
    model.cam_fovy[k], model.cam_sensorsize[k] = _FOVY, 0.0
