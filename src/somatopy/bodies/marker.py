"""The cube of tags as a shape of MuJoCo: a mesh with texture coordinates, and an atlas of ArUco tags as its texture."""

from __future__ import annotations

import cv2
import mujoco
import numpy as np

from somatopy.bodies.plain import PLAIN
from somatopy.percept import Floats, Image, Marker

__all__ = ["SITE", "add_marker"]

SITE = "somatopy_marker"
_CELL = 32  # texture pixels per tag cell
_CELLS = 6  # a 4x4 tag with its black border


def tag_atlas(marker: Marker) -> Image:
    """The picture of the four faces with tags side by side, RGB, shape (face, 4 face, 3), with `face` px for each."""
    tag = _CELL * _CELLS
    face = round(tag * marker.size / marker.tag_size)
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, marker.dictionary))
    atlas = np.full((face, 4 * face, 3), 255, np.uint8)
    edge = (face - tag) // 2
    for k, identity in enumerate(marker.ids):
        picture = cv2.aruco.generateImageMarker(dictionary, identity, tag)
        atlas[edge : edge + tag, k * face + edge : k * face + edge + tag] = picture[..., None]
    return atlas


def _face_corners(marker: Marker) -> Floats:
    """Corners of the six faces seen from outside, top left first and clockwise, shape (6, 4, 3), m."""
    x, y, z = np.eye(3)
    sides = [(normal, x) for normal in (y, z, -y, -z)]
    half = 0.5 * marker.size
    corners = []
    for normal, up in [*sides, (x, z), (-x, z)]:
        right = np.cross(up, normal)
        corners.append([half * (normal + a * up + b * right) for a, b in ((1, -1), (1, 1), (-1, 1), (-1, -1))])
    return np.array(corners)


def _texture_coordinates() -> Floats:
    """(u, v) of those corners in the atlas, shape (6, 4, 2); the two end faces show white margin only."""
    sides = [[[k / 4, 0], [(k + 1) / 4, 0], [(k + 1) / 4, 1], [k / 4, 1]] for k in range(4)]
    blank = [[[0.002, 0.002]] * 4] * 2
    return np.array(sides + blank, float)


def add_marker(spec: mujoco.MjSpec, body: str, position: Floats, axis: Floats, marker: Marker) -> None:
    """Fix the cube to a body of a spec, with a site of the same pose, named `SITE`.

    The cube has no mass, and nothing can touch it.

    Args:
        spec: the spec. It is changed.
        body: name of the body.
        position: the cube's centre in the body's frame, shape (3,), m.
        axis: direction of the cube's axis in that frame, shape (3,).
        marker: the cube.
    """
    atlas = tag_atlas(marker)
    texture = spec.add_texture(
        name=SITE, type=mujoco.mjtTexture.mjTEXTURE_2D, width=atlas.shape[1], height=atlas.shape[0], nchannel=3
    )
    texture.data = atlas.tobytes()
    material = spec.add_material(PLAIN, name=SITE, specular=0.0, shininess=0.0, reflectance=0.0, emission=0.35)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = SITE
    triangles = np.array([[4 * k + i for i in t] for k in range(6) for t in ((0, 2, 1), (0, 3, 2))])
    mesh = spec.add_mesh(PLAIN, name=SITE)
    mesh.uservert = _face_corners(marker).ravel().tolist()
    mesh.userface = triangles.ravel().tolist()
    mesh.usertexcoord = _texture_coordinates().ravel().tolist()
    carrier = spec.body(body)
    pose = {"pos": position, "quat": _turn_x_to(axis)}
    carrier.add_site(PLAIN, name=SITE, **pose)
    untouchable = {"mass": 0, "contype": 0, "conaffinity": 0}
    looks = {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": SITE, "material": SITE}
    carrier.add_geom(PLAIN, name=SITE, **looks, **untouchable, **pose)


def _turn_x_to(axis: Floats) -> Floats:
    """Quaternion of the smallest rotation that takes the x axis to `axis`."""
    unit = np.asarray(axis, float) / np.linalg.norm(axis)
    quaternion = np.array([1 + unit[0], 0.0, -unit[2], unit[1]])
    if 1 + unit[0] < 1e-9:
        return np.array([0.0, 0.0, 0.0, 1.0])
    return np.asarray(quaternion / np.linalg.norm(quaternion))
