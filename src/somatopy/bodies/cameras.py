"""Cameras of MuJoCo models as pinhole cameras, with picture size, focal lengths and optical axis."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np

from somatopy.bodies.anatomy import Anatomy
from somatopy.bodies.base import BodyError
from somatopy.percept import Camera

__all__ = ["eye_camera", "is_pinhole", "pinhole", "set_fovy"]

_PERSPECTIVE = int(mujoco.mjtProjection.mjPROJ_PERSPECTIVE)
_USUAL = 320, 240  # px, where neither anatomy nor model says a size
_MOST = 4096  # px


def set_fovy(spec: mujoco.MjSpec, camera: str, fovy: float) -> None:
    """Set the vertical field of view of a spec's camera, degrees. It replaces the sensor and the focal lengths."""
    found = spec.camera(camera)
    found.fovy = fovy
    for name in ("sensor_size", "focal_length", "focal_pixel", "principal_length", "principal_pixel"):
        setattr(found, name, (0, 0))


def eye_camera(model: mujoco.MjModel, anatomy: Anatomy) -> Camera:
    """The camera that the anatomy names.

    The size of its picture is that of the anatomy, else that of the model, else 320 x 240 px.

    Raises:
        BodyError: the camera cannot be an eye.
    """
    name, said = anatomy.camera.name, model.camera(anatomy.camera.name)
    if int(model.cam_projection[said.id]) != _PERSPECTIVE:
        raise BodyError(
            f"The camera {name!r} of {anatomy.model} is orthographic: things do not look larger when they "
            f"are near, so no eye can tell where the marker is. "
            f'Write <camera name="{name}" projection="perspective" fovy="45" .../>.'
        )
    own = tuple(int(side) for side in model.cam_resolution[said.id])
    width, height = (anatomy.camera.width, anatomy.camera.height)
    if width is None or height is None:
        width, height = own if own != (1, 1) else _USUAL
    if max(width, height) > _MOST:
        raise BodyError(
            f"The camera {name!r} of {anatomy.model} takes pictures of {width} x {height} px, but {_MOST} is the "
            "most along either side. Write smaller ones into the anatomy: [camera] width = 320, height = 240."
        )
    if not is_pinhole(model, said.id):
        raise BodyError(
            f"The camera {name!r} of {anatomy.model} has a sensorsize but no focal length. Give it both, as in "
            f'<camera name="{name}" sensorsize="0.004 0.003" focal="0.004 0.004" resolution="320 240" .../>, or '
            "fovy alone."
        )
    return pinhole(model, said.id, width, height)


def is_pinhole(model: mujoco.MjModel, camera: int) -> bool:
    """Whether a camera shows things in perspective and has a focal length."""
    sensor = model.cam_sensorsize[camera].any()
    return bool(model.cam_projection[camera] == _PERSPECTIVE and (not sensor or model.cam_intrinsic[camera, :2].all()))


def pinhole(model: mujoco.MjModel, camera: int, width: int, height: int) -> Camera:
    """A camera of a model, by its number, as a pinhole camera whose pictures are `width` x `height` px.

    MuJoCo shows the whole sensor in any picture. If sensor and picture differ in shape, the two focal lengths differ.
    MuJoCo's principal point has the opposite sign of a shift in u and v: if the middle of the sensor is right of the
    optical axis, the axis appears left of the middle of the picture.
    """
    plain = Camera(model.camera(camera).name, width, height, fovy=float(np.deg2rad(model.cam_fovy[camera])))
    if not model.cam_sensorsize[camera].any():
        return plain
    across, along, right, down = model.cam_intrinsic[camera].tolist()
    per_u, per_v = np.divide((width, height), model.cam_sensorsize[camera]).tolist()
    u, v = plain.centre
    return replace(plain, intrinsics=(across * per_u, along * per_v, u - right * per_u, v - down * per_v))
