"""The geometric eye: a model of the rendered eye that needs no picture, only true poses."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from somatopy._jit import jit
from somatopy.contract import Twin
from somatopy.eyes.frustum import optics
from somatopy.eyes.rays import MARGIN, Vector, any_between, beside
from somatopy.percept import Camera, Floats, Ints, Marker, Reading, Shapes, Sighting, View
from somatopy.registry import BuildContext, Settings

__all__ = ["Geometric", "GeometricEye"]

# What OpenCV's detector needs of a tag, calibrated against the rendered eye (docs/eyes.md).
#: Apparent height of a tag seen askew (its area by its longest side), px.
MIN_HEIGHT = 10.0
#: Angle between the tag's normal and the line to the camera, rad.
MAX_TILT = math.radians(79.0)
#: Distance of every corner from the edge of the picture, px.
BORDER = 2.0
#: Where in a tag something must stand to hide it, from its centre (0) to its corners (1).
REACH = 0.8333

#: Corners, middles of the edges and centre of a tag, in half edges up and to the right; the corners go round.
_POINTS = np.array([(1, -1), (1, 1), (-1, 1), (-1, -1), (1, 0), (0, 1), (-1, 0), (0, -1), (0, 0)], float)
#: y and z, in the cube's frame, of the outward normal of each face.
_NORMALS = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)], float)


@jit
def see(
    camera: Floats,
    lens: Floats,
    marker: Floats,
    cube: Floats,
    poses: Floats,
    kinds: Ints,
    sizes: Floats,
    tags: Floats,
    work: Floats,
) -> int:
    """The face of the cube whose tag the eye reads, or -1.

    Args:
        camera: position and rotation (row by row) of the camera, shape (12,).
        lens: what `optics` says of the camera, least height (px), cosine of the largest tilt, border (px), shape (9,).
        marker: position and rotation of the marker, shape (12,).
        cube: half edge of cube and of tag, and of the part of a tag that must not be hidden, shape (3,), m.
        poses: position and rotation of each occluder, shape (n, 12).
        kinds: MuJoCo's geom type of each, shape (n,).
        sizes: half-sizes and bounding radius of each, shape (n, 4).
        tags: scratch, shape (4, 14, 3).
        work: scratch, shape (5, 3); its last row returns pixel (u, v) of the cube's centre and area (px^2) of the tag.
    """
    slack = _slack(lens, cube)
    if not _in_frame(camera, lens, marker, slack, work):
        return -1
    _place(marker, cube, tags)
    if not _measure(camera, lens, marker, cube, tags, work):
        return -1
    return _read(camera, cube, tags, poses, kinds, sizes, work)


@jit
def _place(marker: Floats, cube: Floats, tags: Floats) -> None:
    """Write normal, corners and the nine points of each tag to `tags`, shape (4, 14, 3)."""
    for face in range(4):
        ny, nz = _NORMALS[face, 0], _NORMALS[face, 1]
        for k in range(3):
            tags[face, 0, k] = ny * marker[4 + 3 * k] + nz * marker[5 + 3 * k]
            for n in range(4):
                tags[face, 1 + n, k] = _point(marker, cube, face, cube[1] * _POINTS[n, 0], cube[1] * _POINTS[n, 1], k)
            for n in range(9):
                tags[face, 5 + n, k] = _point(marker, cube, face, cube[2] * _POINTS[n, 0], cube[2] * _POINTS[n, 1], k)


@jit
def _measure(camera: Floats, lens: Floats, marker: Floats, cube: Floats, tags: Floats, work: Floats) -> bool:
    """Whether any tag could be read if nothing stood before it; the tags' areas are left in work[:4, 2]."""
    some = False
    for face in range(4):
        work[face, 2] = _tag_area(tags[face], camera, lens, marker, cube, work)
        some |= work[face, 2] > 0.0
    return some


@jit
def _read(camera: Floats, cube: Floats, tags: Floats, poses: Floats, kinds: Ints, sizes: Floats, work: Floats) -> int:
    """The largest tag that nothing hides, of those that `_measure` has found, or -1; its area is left in work[4, 2]."""
    for _ in range(4):
        face = 0
        for other in range(1, 4):
            if work[other, 2] > work[face, 2]:
                face = other
        if work[face, 2] <= 0.0:
            return -1
        if not any_between(poses, kinds, sizes, camera, tags[face, 5:], math.sqrt(2.0) * cube[2]):
            work[4, 2] = work[face, 2]
            return face
        work[face, 2] = 0.0
    return -1


@jit
def _project(camera: Floats, lens: Floats, x: float, y: float, z: float) -> Vector:
    """Pixel (u, v) and depth (m) of a point of the world; the pixel is NaN behind the camera."""
    dx, dy, dz = x - camera[0], y - camera[1], z - camera[2]
    right = camera[3] * dx + camera[6] * dy + camera[9] * dz
    up = camera[4] * dx + camera[7] * dy + camera[10] * dz
    depth = -(camera[5] * dx + camera[8] * dy + camera[11] * dz)
    if depth <= 1e-6:
        return math.nan, math.nan, depth
    return lens[2] + lens[0] * right / depth, lens[3] - lens[1] * up / depth, depth


@jit
def _slack(lens: Floats, cube: Floats) -> float:
    """How far, px at 1 m, the centre of a face can appear to be from that of the cube, where it is inside the image.

    A point inside the image and one that is h away from it at depth z appear at most h sqrt(f^2 + r^2) / z apart along
    either axis, r the largest distance of the image's edge from the pixel of the optical axis.
    """
    across = max(lens[2] + 0.5, lens[4] - 0.5 - lens[2])
    along = max(lens[3] + 0.5, lens[5] - 0.5 - lens[3])
    return float(cube[0] * max(math.hypot(lens[0], across), math.hypot(lens[1], along)))


@jit
def _in_frame(camera: Floats, lens: Floats, marker: Floats, slack: float, work: Floats) -> bool:
    """Whether the centre of any face can be inside the image; the pixel of the cube's own is left in work[4, :2]."""
    u, v, depth = _project(camera, lens, marker[0], marker[1], marker[2])
    if depth <= 1e-6:
        return False
    margin = slack / depth
    work[4, 0], work[4, 1] = u, v
    return bool(-margin <= u <= lens[4] - 1.0 + margin and -margin <= v <= lens[5] - 1.0 + margin)


@jit
def _point(marker: Floats, cube: Floats, face: int, up: float, right: float, k: int) -> float:
    """Coordinate k in the world of a point `up` and `right` (m) from the centre of a face."""
    ny, nz = _NORMALS[face, 0], _NORMALS[face, 1]
    x, y, z = marker[3 + 3 * k], marker[4 + 3 * k], marker[5 + 3 * k]
    return float(marker[k] + cube[0] * (ny * y + nz * z) + up * x + right * (ny * z - nz * y))


@jit
def _tag_area(tag: Floats, camera: Floats, lens: Floats, marker: Floats, cube: Floats, work: Floats) -> float:
    """Area (px^2) of a face's tag if it is turned to the camera, large enough and inside the image, else 0."""
    distance = facing = 0.0
    for k in range(3):
        gap = camera[k] - marker[k] - cube[0] * tag[0, k]
        facing += tag[0, k] * gap
        distance += gap * gap
    if facing <= lens[7] * math.sqrt(distance):
        return 0.0
    for corner in range(4):
        u, v, _ = _project(camera, lens, tag[1 + corner, 0], tag[1 + corner, 1], tag[1 + corner, 2])
        if not (lens[8] <= u <= lens[4] - 1.0 - lens[8] and lens[8] <= v <= lens[5] - 1.0 - lens[8]):
            return 0.0
        work[corner, 0], work[corner, 1] = u, v
    return _large_area(lens, work)


@jit
def _large_area(lens: Floats, work: Floats) -> float:
    """Area of the quadrangle whose corners, px, stand in work[:4], or 0 if its height is too small."""
    area = longest = 0.0
    for corner in range(4):
        u0, v0 = work[corner, 0], work[corner, 1]
        u1, v1 = work[(corner + 1) % 4, 0], work[(corner + 1) % 4, 1]
        area += 0.5 * (u0 * v1 - u1 * v0)
        longest = max(longest, (u1 - u0) ** 2 + (v1 - v0) ** 2)
    return abs(area) if abs(area) >= lens[6] * math.sqrt(longest) else 0.0


@jit
def see_from_each(
    cameras: Floats,
    moved: Floats,
    rows: Ints,
    first: int,
    lens: Floats,
    marker: Floats,
    cube: Floats,
    poses: Floats,
    kinds: Ints,
    sizes: Floats,
    tags: Floats,
    work: Floats,
    seen: NDArray[np.bool_],
) -> None:
    """Find out which of many head postures see the marker, or, with `first` >= 0, only whether any does.

    Args:
        cameras: pose of the camera at each head posture, shape (m, 12).
        moved: at each head posture, the poses of the occluders that move with the head, shape (m, len(rows), 12).
        rows: which occluders those are.
        first: head posture to try first, followed by the next ones, until one sees the marker. -1 to try all.
        seen: result, shape (m,). All False at first; set to True for head postures that see the marker.

    The others are as in `see`; `poses` is overwritten in `rows`.
    """
    if first >= 0:
        poses[rows] = moved[first]
        seen[first] = see(cameras[first], lens, marker, cube, poses, kinds, sizes, tags, work) >= 0
        if seen[first]:
            return
    slack = _slack(lens, cube)
    _place(marker, cube, tags)
    near, kinds_near, sizes_near = np.empty_like(poses), np.empty_like(kinds), np.empty_like(sizes)
    fixed = _sift_fixed(cameras, rows, marker, cube, poses, kinds, sizes, near, kinds_near, sizes_near)
    for trial in range(len(cameras)):
        h = (max(first, 0) + trial) % len(cameras)  # what sees is seldom far from what saw the last time
        camera = cameras[h]
        if not (_in_frame(camera, lens, marker, slack, work) and _measure(camera, lens, marker, cube, tags, work)):
            continue
        n = fixed
        for r in range(rows.size):
            if not _aside(moved[h, r], sizes[rows[r], 3], camera, marker, cube, 0.0):
                near[n], kinds_near[n], sizes_near[n] = moved[h, r], kinds[rows[r]], sizes[rows[r]]
                n += 1
        seen[h] = _read(camera, cube, tags, near[:n], kinds_near[:n], sizes_near[:n], work) >= 0
        if seen[h] and first >= 0:
            return


@jit
def _sift_fixed(
    cameras: Floats,
    rows: Ints,
    marker: Floats,
    cube: Floats,
    poses: Floats,
    kinds: Ints,
    sizes: Floats,
    near: Floats,
    kinds_near: Ints,
    sizes_near: Floats,
) -> int:
    """Write to the last three the occluders that do not move with the head and may hide something; how many they are.

    All ways begin in a ball around all cameras.
    """
    fixed = np.ones(len(poses), np.bool_)
    fixed[rows] = False
    middle, spread = cameras[len(cameras) // 2], 0.0
    for h in range(len(cameras)):
        x, y, z = cameras[h, 0] - middle[0], cameras[h, 1] - middle[1], cameras[h, 2] - middle[2]
        spread = max(spread, x * x + y * y + z * z)
    spread = math.sqrt(spread)
    n = 0
    for row in range(len(poses)):
        if fixed[row] and not _aside(poses[row], sizes[row, 3], middle, marker, cube, spread):
            near[n], kinds_near[n], sizes_near[n] = poses[row], kinds[row], sizes[row]
            n += 1
    return n


@jit
def _aside(pose: Floats, size: float, camera: Floats, marker: Floats, cube: Floats, spread: float) -> bool:
    """Whether an occluder is too far to the side to hide any face of the cube from a camera, or from `spread` around.

    A way to a face ends within half an edge of the cube's centre, and the part of its tag that must not be hidden
    within sqrt(2) times its half edge of there; so near to the line between the two centres stays all of it.
    """
    way = marker[0] - camera[0], marker[1] - camera[1], marker[2] - camera[2]
    p = pose[0] - camera[0], pose[1] - camera[1], pose[2] - camera[2]
    square = way[0] * way[0] + way[1] * way[1] + way[2] * way[2]
    reach = size + math.sqrt(2.0) * cube[2] + max(spread, cube[0]) + MARGIN
    return square > 0.0 and beside(p, way, 1.0 / square, reach)


class GeometricEye:
    """Computes what the rendered eye would see, from the true poses of camera, marker and occluders.

    A tag is read if it is turned to the camera, large enough and wholly inside the image, and if nothing hides its
    centre or the black frame around it, at its corners and the middles of its edges. Of several such tags the largest
    counts. This eye is a model of the detector, a thousand times as fast as pictures. It serves for ceilings, controls
    and studies of many seeds, and its numbers are labelled as its own.

    Args:
        camera: size and intrinsics of the pictures.
        marker: the cube of tags.
        occluders: shapes that can hide the marker, in the order of the poses in each view.

    Example:
        >>> camera, marker = Camera("eye", 320, 240, fovy=0.83), Marker()
        >>> eye = GeometricEye(camera, marker, Shapes(np.empty(0, np.int64), np.empty((0, 4))))
        >>> here = np.array([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1.0])
        >>> ahead = np.array([0, 0, -0.2, 0, 0, 1, -1, 0, 0, 0, -1, 0])
        >>> eye.find(View(here, ahead, np.empty((0, 12)))).pixel
        (159.5, 119.5)
    """

    def __init__(self, camera: Camera, marker: Marker, occluders: Shapes) -> None:
        lens, cube = optics(camera, marker)
        self._lens = np.concatenate([lens, [MIN_HEIGHT, math.cos(MAX_TILT), BORDER]])
        self._cube = np.append(cube, REACH * cube[1])
        self._ids = marker.ids
        self._kinds, self._sizes = occluders.kinds, occluders.sizes
        self._tags, self._work = np.zeros((4, 14, 3)), np.zeros((5, 3))

    def look(self, reading: Reading) -> Sighting | None:
        """The sighting that the rendered eye would have, or None.

        Raises:
            ValueError: the reading has no view.
        """
        if reading.view is None:
            raise ValueError("This body does not know its true poses; the geometric eye needs them. Use another eye.")
        return self.find(reading.view)

    def find(self, view: View) -> Sighting | None:
        """The sighting for these poses, or None."""
        face = see(
            view.camera,
            self._lens,
            view.marker,
            self._cube,
            view.occluders,
            self._kinds,
            self._sizes,
            self._tags,
            self._work,
        )
        if face < 0:
            return None
        u, v, area = self._work[4].tolist()
        return Sighting(pixel=(u, v), tag=self._ids[face], area=area)

    def look_from_each(
        self, cameras: Floats, moved: Floats, rows: Ints, view: View, first: int = -1
    ) -> NDArray[np.bool_]:
        """Which of many head postures would see the marker at its place in `view`.

        Args:
            cameras: the camera's pose at each head posture, shape (m, 12).
            moved: at each head posture, the poses of the occluders that move with the head, shape (m, len(rows), 12).
            rows: which occluders those are, shape (k,).
            view: marker and occluders for the arm's posture.
            first: head posture to try first, if you only need to know whether any sees the marker. The others then stay
                False.

        Returns:
            Shape (m,).
        """
        seen = np.zeros(len(cameras), np.bool_)
        see_from_each(
            cameras,
            moved,
            rows,
            first,
            self._lens,
            view.marker,
            self._cube,
            view.occluders.copy(),
            self._kinds,
            self._sizes,
            self._tags,
            self._work,
            seen,
        )
        return seen


@dataclass(frozen=True)
class Geometric(Settings):
    """A geometric model of the detector, which needs no pictures and is fast."""

    def build(self, context: BuildContext) -> GeometricEye:
        """The eye behind the camera of `context.body`.

        Raises:
            ValueError: the body has no model of itself, which gives the true poses.
        """
        body = context.body
        if not isinstance(body, Twin):
            raise ValueError(
                f"The body {type(body).__name__} has no model of itself, which the geometric eye needs; "
                "use --eye fiducial or an eye of your own."
            )
        return GeometricEye(body.camera, body.marker, body.occluders)
