"""The shapes of a MuJoCo model that can stand between camera and marker."""

from __future__ import annotations

import mujoco
import numpy as np
from scipy.spatial import ConvexHull, QhullError

from somatopy.bodies.marker import SITE
from somatopy.percept import Shapes

__all__ = ["Occluders"]

_SPHERE, _CAPSULE, _ELLIPSOID, _CYLINDER, _BOX, _MESH = 2, 3, 4, 5, 6, 7  # MuJoCo's geom types
_INVISIBLE_GROUP = 3  # MuJoCo draws groups 0 to 2
_UNSET = np.array([0.5, 0.5, 0.5, 1.0], np.float32)  # the colour of a shape that says none: its material's counts
_FULL = 0.8  # share of its box from which a mesh is more like it than like a cylinder or an ellipsoid
_SEEN_THROUGH = 0.62  # opacity up to which the detector reads a tag behind a shape of any colour


class Occluders:
    """The shapes of a model that can hide the marker: those that are drawn, finite and opaque.

    A mesh is replaced by its bounding box if it fills the box, and else by the ellipsoid in the box. Height fields,
    signed distance fields, skins, flexible bodies and tendons are ignored.

    Args:
        model: the compiled model.

    Attributes:
        shapes: kinds and sizes.
        geoms: indices of the shapes among the model's geoms, shape (n,).
        offsets: centres of the shapes in the frames of the geoms, shape (n, 3), m.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        of_material = (model.geom_matid >= 0) & (model.geom_rgba == _UNSET).all(axis=1)
        opacity = np.where(of_material, np.append(model.mat_rgba[:, 3], 1.0)[model.geom_matid], model.geom_rgba[:, 3])
        shown = (opacity > _SEEN_THROUGH) & (model.geom_group < _INVISIBLE_GROUP)
        shown &= np.isin(model.geom_type, [_SPHERE, _CAPSULE, _ELLIPSOID, _CYLINDER, _BOX, _MESH])
        shown[model.geom(SITE).id] = False
        self.geoms = np.flatnonzero(shown)
        kinds, sizes = model.geom_type[self.geoms].astype(np.int64), model.geom_size[self.geoms].copy()
        odd = kinds == _MESH
        boxes = model.geom_aabb[self.geoms]
        self.offsets = np.where(odd[:, None], boxes[:, :3], 0.0)
        sizes[odd] = boxes[odd, 3:]
        kinds[odd] = [_BOX if _fills(model, int(geom)) else _ELLIPSOID for geom in self.geoms[odd]]
        sizes[kinds == _SPHERE] = sizes[kinds == _SPHERE][:, :1]
        reach = np.where(odd, np.linalg.norm(sizes, axis=1), model.geom_rbound[self.geoms])
        self.shapes = Shapes(kinds, np.column_stack([sizes, reach]))


def _fills(model: mujoco.MjModel, geom: int) -> bool:
    """Whether the convex hull of a mesh fills its box."""
    first, count = (int(each[model.geom_dataid[geom]]) for each in (model.mesh_vertadr, model.mesh_vertnum))
    try:
        hull = ConvexHull(model.mesh_vert[first : first + count])
    except QhullError:  # a flat one
        return False
    return bool(hull.volume > _FULL * np.prod(2 * model.geom_aabb[geom, 3:]))
