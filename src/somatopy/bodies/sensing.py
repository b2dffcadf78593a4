"""Reads the true poses of a body in one compiled call, and whether arm and head interpenetrate."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from somatopy._jit import jit
from somatopy.bodies.engine import call, function
from somatopy.bodies.marker import SITE
from somatopy.bodies.model import Build
from somatopy.bodies.occluders import Occluders
from somatopy.percept import Floats, Ints, View

__all__ = ["Sensing"]

_TOUCH = 1e-9  # m: spheres that far apart may touch, as far as rounding goes
_OF_MASS = (2, 4)  # MuJoCo's modes of cameras and lights that follow a centre of mass


class Sensing:
    """Reads the poses of camera, marker and occluders from a state of a model.

    Args:
        built: the model.
        data: the state. References to its arrays are kept.
        camera: name of the camera.
        occluders: the shapes that can hide the marker.
    """

    def __init__(self, built: Build, data: mujoco.MjData, camera: str, occluders: Occluders) -> None:
        model, self._built, self._data = built.model, built, data
        refreshing = [mujoco.mj_kinematics, mujoco.mj_camlight]
        if np.isin(np.concatenate([model.cam_mode, model.light_mode]), _OF_MASS).any():
            refreshing.insert(1, mujoco.mj_comPos)
        self._refreshing = refreshing
        places = [function(step.__name__) for step in refreshing] if built.calls_directly else [0]
        self._functions = np.array(places if all(places) else [], np.int64)
        self._count = len(occluders.geoms)
        self._solids = tuple(
            np.array([model.geom(name).id for name in names], np.int64)
            for names in (built.arm_solids, built.head_solids)
        )
        self._seen: Any = (
            int(model._address),
            int(data._address),
            data.cam_xpos[model.camera(camera).id],
            data.cam_xmat[model.camera(camera).id],
            data.site_xpos[model.site(SITE).id],
            data.site_xmat[model.site(SITE).id],
            data.geom_xpos,
            data.geom_xmat,
            occluders.geoms,
            occluders.offsets,
            np.flatnonzero(occluders.offsets.any(axis=1)),
            model.geom_rbound,
            *self._solids,
        )
        self._near = False
        self._side = np.zeros(model.ngeom, np.int64)
        self._side[self._solids[0]], self._side[self._solids[1]] = 1, 2

    def view(self) -> View:
        """Compute the poses from the positions of the joints, and read them."""
        if not len(self._functions):
            for refresh in self._refreshing:
                refresh(self._built.model, self._data)
        poses = np.empty((self._count + 2, 12))
        self._near = _gather(poses, self._functions, *self._seen)
        return View(poses[0], poses[1], poses[2:])

    def overlap(self) -> bool:
        """Whether arm and head interpenetrate, by the poses that `view` has computed."""
        if not self._near:
            return False
        mujoco.mj_collision(self._built.model, self._data)
        return self._data.ncon > 0 and bool((self._side[self._data.contact.geom].sum(axis=1) == 3).any())


@jit
def _gather(
    poses: Floats,
    functions: Ints,
    model: int,
    data: int,
    camera: Floats,
    camera_turn: Floats,
    site: Floats,
    site_turn: Floats,
    places: Floats,
    turns: Floats,
    geoms: Ints,
    offsets: Floats,
    shifted: Ints,
    reach: Floats,
    arm: Ints,
    head: Ints,
) -> bool:
    """Call the functions, then write the poses of camera, marker and occluders, shape (2 + n, 12).

    Returns:
        Whether arm and head may interpenetrate; see `_near`.
    """
    for refresh in functions:
        call(refresh, model, data)
    poses[0, :3], poses[0, 3:] = camera, camera_turn
    poses[1, :3], poses[1, 3:] = site, site_turn
    for row in range(geoms.size):
        geom, pose = geoms[row], poses[row + 2]
        for k in range(3):
            pose[k] = places[geom, k]
        for k in range(9):
            pose[3 + k] = turns[geom, k]
    for row in shifted:
        pose, offset = poses[row + 2], offsets[row]
        for k in range(3):
            pose[k] += pose[3 + 3 * k] * offset[0] + pose[4 + 3 * k] * offset[1] + pose[5 + 3 * k] * offset[2]
    return _near(places, reach, arm, head)


@jit
def _near(places: Floats, reach: Floats, arm: Ints, head: Ints) -> bool:
    """Whether the bounding sphere of any of the arm's solids meets one of the head's; without radius it is endless."""
    for a in arm:
        for b in head:
            if reach[a] == 0.0 or reach[b] == 0.0:
                return True
            square = 0.0
            for k in range(3):
                square += (places[a, k] - places[b, k]) ** 2
            if square <= (reach[a] + reach[b] + _TOUCH) ** 2:
                return True
    return False
