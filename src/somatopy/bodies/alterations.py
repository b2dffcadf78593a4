"""Changes of a body that can be undone: they turn its camera, move its marker, or make its arm longer or faster."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from somatopy.bodies.anatomy import Anatomy
from somatopy.bodies.marker import SITE
from somatopy.bodies.occluders import Occluders
from somatopy.clock import FRAME
from somatopy.percept import Floats, Ints, JointGroup

__all__ = ["Alterations"]

Undo = Callable[[], None]
#: Names of arrays of a model, the rows that change, and their new values.
_Change = tuple[str, Any, Any]

_FIXED = int(mujoco.mjtCamLight.mjCAMLIGHT_FIXED)
_CAPSULE = int(mujoco.mjtGeom.mjGEOM_CAPSULE)
_LONG = (_CAPSULE, int(mujoco.mjtGeom.mjGEOM_CYLINDER))
_NO_MIDPHASE = int(mujoco.mjtDisableBit.mjDSBL_MIDPHASE)


class Alterations:
    """The capability `somatopy.contract.Alterable` of MuJoCo bodies. A change shows from the next reading on.

    Each method returns a function that undoes the change to the last bit. Undo overlapping changes in reverse order.
    """

    model: mujoco.MjModel
    anatomy: Anatomy
    arm: JointGroup
    _occluders: Occluders
    _speeds: tuple[Any, Any]
    _stride: Floats

    def turn_camera(self, tilt: float, roll: float) -> Undo:
        """Turn the eye's camera in the head: see `Alterable`.

        Raises:
            ValueError: the camera is not fixed to its body, but turns to follow something.
        """
        camera, name = self.model.camera(self.anatomy.camera.name).id, self.anatomy.camera.name
        if int(self.model.cam_mode[camera]) != _FIXED:
            raise ValueError(f'the camera {name!r} follows something; only one with mode="fixed" can be turned')
        turned = self.model.cam_quat[camera].copy()
        for axis, angle in ((0, tilt), (2, roll)):
            turn, whole = np.empty(4), np.empty(4)
            mujoco.mju_axisAngle2Quat(turn, np.eye(3)[axis], angle)
            mujoco.mju_mulQuat(whole, turned, turn)
            turned = whole
        return self._change([("cam_quat", camera, turned)])

    def move_marker(self, by: float) -> Undo:
        """Move the marker along its axis: see `Alterable`."""
        site, geom, along = self.model.site(SITE).id, self.model.geom(SITE).id, np.empty(3)
        mujoco.mju_rotVecQuat(along, np.array([by, 0.0, 0.0]), self.model.site_quat[site])
        shifted = [("site_pos", site, self.model.site_pos[site]), ("geom_pos", geom, self.model.geom_pos[geom])]
        return self._change([(name, row, before + along) for name, row, before in shifted])

    def stretch_arm(self, factor: float) -> Undo:
        """Lengthen the links of the arm: see `Alterable`.

        The factor multiplies the positions of joints, shapes and marker in the links, and the lengths of capsules and
        cylinders. Thicknesses stay as they are. The body with the marker keeps its shape and moves outwards as a whole,
        since a hand that grew would hide its marker. Masses stay as they are, and inertias grow with the square of the
        factor. Only bodies between the first arm joint and the hand move: a head on a torso that turns with the arm
        stays where it is.
        """
        model = self.model
        links = _links(model, self.anatomy)
        joints, geoms, sites = (
            np.flatnonzero(np.isin(bodies, links))
            for bodies in (model.jnt_bodyid, model.geom_bodyid, model.site_bodyid)
        )
        hand = int(model.body(self.anatomy.marker.body).id)
        outwards = (factor - 1) * model.site_pos[model.site(SITE).id]
        placed = {
            "body_pos": (links[1:], model.body_parentid),
            "site_pos": (sites, model.site_bodyid),
            "geom_pos": (geoms, model.geom_bodyid),
        }
        changes: list[_Change] = [
            (name, rows, np.where(on[rows, None] == hand, before + outwards, factor * before))
            for name, (rows, on) in placed.items()
            for before in [getattr(model, name)[rows]]
        ]
        changes += [("body_ipos", links, factor * model.body_ipos[links])]
        changes += [("jnt_pos", joints, factor * model.jnt_pos[joints])]
        changes.append(("body_inertia", links, factor**2 * model.body_inertia[links]))
        long = geoms[np.isin(model.geom_type[geoms], _LONG) & (model.geom_bodyid[geoms] != hand)]
        sizes, reach = _stretched(model, long, factor)
        undo = [
            self._change([*changes, ("geom_size", long, sizes), ("geom_rbound", long, reach)]),
            self._resize_occluders(long),
        ]
        before = model.opt.disableflags  # the boxes of that phase of collision detection stay as they were compiled
        model.opt.disableflags = before | _NO_MIDPHASE

        def back() -> None:
            model.opt.disableflags = before
            for each in reversed(undo):
                each()

        return back

    def pace_arm(self, factor: float) -> Undo:
        """Let the arm's set-points move faster or slower: see `Alterable`."""
        speeds, stride, velocity = self._speeds, self._stride.copy(), self.arm.velocity
        slower = np.minimum(velocity, factor * np.minimum(velocity, speeds[0]))
        self._speeds = slower, speeds[1]
        self._stride[: len(self.arm)] = FRAME * slower

        def back() -> None:
            self._speeds, self._stride[:] = speeds, stride

        return back

    def _change(self, changes: list[_Change]) -> Undo:
        """Give rows of the model's arrays other values."""
        kept = [
            (getattr(self.model, name), rows, np.copy(getattr(self.model, name)[rows])) for name, rows, _ in changes
        ]
        for (array, rows, _), (_, _, value) in zip(kept, changes, strict=True):
            array[rows] = value

        def back() -> None:
            for array, rows, value in kept:
                array[rows] = value

        return back

    def _resize_occluders(self, geoms: Ints) -> Undo:
        """Tell those who hold the occluders' sizes, such as the geometric eye, in the array that they hold."""
        sizes, own = self._occluders.shapes.sizes, self._occluders.geoms
        rows = np.flatnonzero(np.isin(own, geoms))
        before = sizes[rows]
        sizes[rows] = np.column_stack([self.model.geom_size[own[rows]], self.model.geom_rbound[own[rows]]])

        def back() -> None:
            sizes[rows] = before

        return back


def _stretched(model: mujoco.MjModel, geoms: Ints, factor: float) -> tuple[Floats, Floats]:
    """Sizes of capsules and cylinders that are longer, (n, 3), m, and the radii of the balls around them, (n,), m."""
    sizes = model.geom_size[geoms] * [1.0, factor, 1.0]
    radius, half = sizes[:, 0], sizes[:, 1]
    return sizes, np.where(model.geom_type[geoms] == _CAPSULE, radius + half, np.hypot(radius, half))


def _links(model: mujoco.MjModel, anatomy: Anatomy) -> Ints:
    """The bodies that the arm is made of, the first of its joints' first: the way to the hand, and what moves with it.

    What an inner link carries rigidly belongs to it, and all that hangs on the last joint of the arm, but nothing that
    carries the camera.
    """
    way = _above(model, int(model.body(anatomy.marker.body).id))[::-1]
    moved = {int(model.joint(name).bodyid[0]) for name in anatomy.arm.joints}
    places = [k for k, body in enumerate(way) if body in moved]
    first, last = places[0], way[places[-1]]
    rigid = {int(model.body_weldid[body]) for body in way[first:]}
    camera = {*_above(model, int(model.cam_bodyid[model.camera(anatomy.camera.name).id]))} - {*way}
    found = way[first:]
    for body in range(model.nbody):
        above = _above(model, body)
        under = way[first] in above and not camera & {*above}
        if under and body not in found and (last in above or int(model.body_weldid[body]) in rigid):
            found.append(body)
    return np.array(found, np.int64)


def _above(model: mujoco.MjModel, body: int) -> list[int]:
    """A body and all that carry it, up to the world."""
    found = [body]
    while found[-1]:
        found.append(int(model.body_parentid[found[-1]]))
    return found
