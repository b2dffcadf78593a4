"""Pictures of a robot from outside, taken by a camera in the room that sees everything that moves."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import mujoco
import numpy as np
from numpy.typing import ArrayLike

from somatopy.bodies.marker import SITE
from somatopy.bodies.mujoco import MujocoBody
from somatopy.percept import Floats, Image

__all__ = ["OUTSIDE", "Onlooker", "Standpoint", "standpoint"]

#: Name of a camera of the model that shows the robot from outside, where the model has one.
OUTSIDE = "outside"
_FOVY = 30.0  # degrees
_ASIDE, _ABOVE = np.deg2rad(35), np.deg2rad(25)
_FINE = (
    2  # how many times as wide and high it is drawn: finer edges than multisampling gives, in two thirds of the time
)


@dataclass(frozen=True)
class Standpoint:
    """The position and the direction of a camera in the room.

    Attributes:
        place: its position, shape (3,), m.
        back: the unit vector opposite to its viewing direction, shape (3,).
    """

    place: Floats
    back: Floats


class Onlooker:
    """Draws a robot as a camera in the room sees it, in high quality. It must be closed.

    It draws a copy of the body as it is when the onlooker is made, with its injuries. The body itself does not move.

    Args:
        body: the robot.
        at: where the camera stands. With None, the model's own camera named `OUTSIDE` is used.
        size: width and height of the pictures, px.

    Example:
        >>> body = MujocoBody("nao", motion="kinematic")
        >>> onlooker = Onlooker(body, standpoint(body, [([0.4, 0.0, -1.0, -0.9], [0.0, 0.0])]), (320, 240))
        >>> onlooker.pixel(body.view([0.4, 0.0, -1.0, -0.9], [0.0, 0.0]).camera[:3]).shape
        (2,)
        >>> onlooker.close()
    """

    def __init__(self, body: MujocoBody, at: Standpoint | None, size: tuple[int, int]) -> None:
        self._shown, self._size = body.another(), size
        self._name = body.camera.name if at else OUTSIDE
        model = self._shown.model
        model.vis.quality.offsamples = 0
        if at is not None:
            _put_camera(self._shown, at)
        self._camera = int(model.camera(self._name).id)

    def picture(self, arm: ArrayLike, head: ArrayLike) -> Image:
        """Draw the robot in a posture, RGB, shape (height, width, 3).

        Args:
            arm: arm posture, shape (n_arm,), rad, slides m.
            head: head posture, shape (n_head,), rad, slides m.
        """
        self._shown.place(arm, head)
        width, height = self._size
        drawn = self._shown.picture(self._name, _FINE * width, _FINE * height)
        return np.asarray(cv2.resize(drawn, self._size, interpolation=cv2.INTER_AREA), np.uint8)

    def pixel(self, point: Floats) -> Floats:
        """The place of a point of the room, shape (3,), m, in the last picture: (u, v), px."""
        data, (width, height) = self._shown.data, self._size
        x, y, z = (point - data.cam_xpos[self._camera]) @ data.cam_xmat[self._camera].reshape(3, 3)
        focal = 0.5 * height / np.tan(np.deg2rad(self._shown.model.cam_fovy[self._camera]) / 2)
        return np.asarray(0.5 * np.array([width, height]) + focal * np.array([x, -y]) / -z)

    def close(self) -> None:
        """Free the copy of the body. A second call does nothing."""
        self._shown.close()


def standpoint(body: MujocoBody, postures: Iterable[tuple[ArrayLike, ArrayLike]]) -> Standpoint:
    """A place for a camera that sees everything that moves in some postures. It looks down from the side of the hand.

    Args:
        body: the robot. This function moves it.
        postures: at least one pair of arm posture, shape (n_arm,), and head posture, shape (n_head,), rad, slides m.
    """
    balls, hands, eyes = [], [], []
    for posture in postures:
        body.place(*posture)
        balls.append(_balls(body))
        hands.append(np.array(body.data.site(SITE).xpos))
        eyes.append(np.array(body.data.cam_xpos[_eye(body)]))
    middle, radius = _around(np.vstack(balls))
    hand, eye = np.mean(hands, axis=0) - middle, np.mean(eyes, axis=0) - middle
    back = _aslant(hand if np.linalg.norm(hand[:2]) > 0.05 * radius else hand - eye)
    return Standpoint(middle + back * radius / np.sin(np.deg2rad(_FOVY) / 2), back)


def _eye(body: MujocoBody) -> int:
    return int(body.model.camera(body.camera.name).id)


def _balls(body: MujocoBody) -> Floats:
    """Balls around all that moves, what carries it, and the eye: places and radii, shape (n, 4), m."""
    model, data = body.model, body.data
    geoms = np.flatnonzero(np.isin(model.geom_bodyid, _robot(body)) & (model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE))
    centres = np.vstack([data.geom_xpos[geoms], data.cam_xpos[[_eye(body)]]])
    return np.column_stack([centres, np.append(model.geom_rbound[geoms], 0.03)])


def _around(balls: Floats) -> tuple[Floats, float]:
    """Middle and radius, m, of a ball around balls."""
    centres, reach = balls[:, :3], balls[:, 3:]
    low, high = (centres - reach).min(axis=0), (centres + reach).max(axis=0)
    middle = 0.5 * (low + high)
    return middle, float((np.linalg.norm(centres - middle, axis=1) + reach[:, 0]).max())


def _robot(body: MujocoBody) -> list[int]:
    """The bodies that stand on the same child of the world as arm or eye."""
    model = body.model
    parts = model.body(body.anatomy.marker.body).id, model.cam_bodyid[_eye(body)]
    roots = {int(model.body_rootid[part]) for part in parts} - {0}
    return [b for b in range(model.nbody) if int(model.body_rootid[b]) in roots]


def _aslant(way: Floats) -> Floats:
    """Unit vector from the robot to the camera: from the hand's side, turned aside, from above."""
    angle = np.arctan2(way[1], way[0]) - _ASIDE
    return np.array([np.cos(_ABOVE) * np.cos(angle), np.cos(_ABOVE) * np.sin(angle), np.sin(_ABOVE)])


def _put_camera(body: MujocoBody, at: Standpoint) -> None:
    """Take the body's camera out of its head and fix it in the room."""
    model, k = body.model, _eye(body)
    right = np.cross([0.0, 0.0, 1.0], at.back)
    right /= np.linalg.norm(right)
    turn = np.column_stack([right, np.cross(at.back, right), at.back])
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, turn.ravel())
    model.cam_bodyid[k], model.cam_pos[k], model.cam_quat[k] = 0, at.place, quaternion
    model.cam_fovy[k], model.cam_sensorsize[k] = _FOVY, 0.0
