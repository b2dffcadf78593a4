"""A model of the real eye: pinhole, facing, apparent size and occlusion, computed from true poses without a picture."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from somatopy._jit import jit
from somatopy.percept import Camera, Floats, Ints, Marker, Reading, Shapes, Sighting, View

__all__ = ["GeometricEye"]

#: Calibrated against the rendered eye (docs/eyes.md): what OpenCV's detector needs of a tag.
MIN_SIDE = 9.5
MAX_TILT = np.deg2rad(80.0)
BORDER = 3.0

_SPHERE, _ELLIPSOID, _CYLINDER, _BOX = 2, 4, 5, 6

Vector = tuple[float, float, float]


@jit
def _first_root(a: float, b: float, c: float) -> float:
    """The first t with a t^2 + 2 b t + c = 0 if a ray from outside (c > 0) goes in there, else -1."""
    discriminant = b * b - a * c
    if discriminant <= 0.0 or c <= 0.0 or a <= 0.0:
        return -1.0
    return (-b - math.sqrt(discriminant)) / a


@jit
def _hits_ellipsoid(o: Vector, d: Vector, x: float, y: float, z: float) -> bool:
    """Whether o + t d, t in (0, 1), enters the ellipsoid with half-axes x, y, z from outside."""
    p, q = (o[0] / x, o[1] / y, o[2] / z), (d[0] / x, d[1] / y, d[2] / z)
    t = _first_root(_dot(q, q), _dot(p, q), _dot(p, p) - 1.0)
    return 0.0 < t < 1.0


@jit
def _hits_box(o: Vector, d: Vector, x: float, y: float, z: float) -> bool:
    """Whether o + t d, t in (0, 1), enters the box with half-edges x, y, z from outside."""
    first, last = -math.inf, math.inf
    for at, step, half in ((o[0], d[0], x), (o[1], d[1], y), (o[2], d[2], z)):
        if abs(step) < 1e-12:
            if abs(at) > half:
                return False
        else:
            t0, t1 = (-half - at) / step, (half - at) / step
            first, last = max(first, min(t0, t1)), min(last, max(t0, t1))
    return first < last and 0.0 < first < 1.0


@jit
def _hits_round(o: Vector, d: Vector, radius: float, half: float, capped: bool) -> bool:
    """Whether o + t d, t in (0, 1), enters a cylinder along z, or a capsule if not `capped`, from outside."""
    a = d[0] * d[0] + d[1] * d[1]
    b = o[0] * d[0] + o[1] * d[1]
    c = o[0] * o[0] + o[1] * o[1] - radius * radius
    t = _first_root(a, b, c)
    if 0.0 < t < 1.0 and abs(o[2] + t * d[2]) < half:
        return True
    for side in (-half, half):
        if not capped:
            z = o[2] - side
            t = _first_root(a + d[2] * d[2], b + z * d[2], c + z * z)
            if 0.0 < t < 1.0:
                return True
        elif d[2] * side < 0.0:
            t = (side - o[2]) / d[2]
            if 0.0 < t < 1.0 and a * t * t + 2.0 * b * t + c < 0.0:
                return True
    return False


@jit
def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@jit
def _into(poses: Floats, n: int, x: float, y: float, z: float) -> Vector:
    """A vector of the world in the axes of shape n."""
    return (
        poses[n, 3] * x + poses[n, 6] * y + poses[n, 9] * z,
        poses[n, 4] * x + poses[n, 7] * y + poses[n, 10] * z,
        poses[n, 5] * x + poses[n, 8] * y + poses[n, 11] * z,
    )


@jit
def _occludes(poses: Floats, n: int, kinds: Ints, sizes: Floats, camera: Floats, work: Floats, point: int) -> bool:
    """Whether shape n stands between the camera and the point in work[point]."""
    o = _into(poses, n, camera[0] - poses[n, 0], camera[1] - poses[n, 1], camera[2] - poses[n, 2])
    d = _into(poses, n, work[point, 0] - camera[0], work[point, 1] - camera[1], work[point, 2] - camera[2])
    kind, x, y, z = kinds[n], sizes[n, 0], sizes[n, 1], sizes[n, 2]
    if kind in (_SPHERE, _ELLIPSOID):
        return _hits_ellipsoid(o, d, x, y, z)
    if kind == _BOX:
        return _hits_box(o, d, x, y, z)
    return _hits_round(o, d, x, y, kind == _CYLINDER)


@jit
def _near_line(poses: Floats, n: int, reach: float, camera: Floats, marker: Floats) -> bool:
    """Whether a ball of radius `reach` around shape n's position touches the segment from camera to marker."""
    p = poses[n, 0] - camera[0], poses[n, 1] - camera[1], poses[n, 2] - camera[2]
    q = marker[0] - camera[0], marker[1] - camera[1], marker[2] - camera[2]
    t = min(max(_dot(p, q) / _dot(q, q), 0.0), 1.0)
    gap = p[0] - t * q[0], p[1] - t * q[1], p[2] - t * q[2]
    return _dot(gap, gap) < reach * reach


@jit
def _hidden(camera: Floats, poses: Floats, kinds: Ints, sizes: Floats, near: Ints, work: Floats) -> bool:
    """Whether a shape in `near` (their number first) hides one of the nine points in work[2:11]."""
    for m in range(1, near[0] + 1):
        n = near[m]
        for point in range(2, 11):
            if _occludes(poses, n, kinds, sizes, camera, work, point):
                return True
    return False


@jit
def _gather(camera: Floats, marker: Floats, cube: Floats, poses: Floats, sizes: Floats, near: Ints) -> None:
    """List in `near` the shapes close to the line from camera to marker, their number first."""
    near[0] = 0
    for n in range(len(poses)):
        if _near_line(poses, n, sizes[n, 3] + 1.75 * cube[0], camera, marker):
            near[0] += 1
            near[near[0]] = n


@jit
def _project(camera: Floats, lens: Floats, x: float, y: float, z: float) -> Vector:
    """Pixel (u, v) and depth (m) of a point of the world; the pixel is NaN behind the camera."""
    dx, dy, dz = x - camera[0], y - camera[1], z - camera[2]
    right = camera[3] * dx + camera[6] * dy + camera[9] * dz
    up = camera[4] * dx + camera[7] * dy + camera[10] * dz
    depth = -(camera[5] * dx + camera[8] * dy + camera[11] * dz)
    if depth <= 1e-6:
        return math.nan, math.nan, depth
    return 0.5 * (lens[1] - 1.0) + lens[0] * right / depth, 0.5 * (lens[2] - 1.0) - lens[0] * up / depth, depth


@jit
def _in_frame(u: float, v: float, depth: float, lens: Floats, cube: Floats) -> bool:
    """Whether any part of a cube whose centre is at pixel (u, v) can be inside the image."""
    if not depth > cube[0]:
        return False
    margin = 1.75 * cube[0] * lens[0] / (depth - cube[0])
    return bool(-margin < u < lens[1] + margin and -margin < v < lens[2] + margin)


@jit
def see(
    camera: Floats,
    lens: Floats,
    marker: Floats,
    cube: Floats,
    poses: Floats,
    kinds: Ints,
    sizes: Floats,
    near: Ints,
    work: Floats,
) -> int:
    """The face of the cube that the eye reads, or -1.

    Args:
        camera: position and rotation (row by row) of the camera, shape (12,).
        lens: focal length, width, height, least side, cosine of the largest tilt, border, shape (6,), px.
        marker: position and rotation of the marker, shape (12,).
        cube: half edge of cube and of tag, shape (2,), m.
        poses: position and rotation of each occluder, shape (n, 12).
        kinds: MuJoCo's geom type of each, shape (n,).
        sizes: half-sizes and bounding radius of each, shape (n, 4).
        near: scratch, shape (n + 1,).
        work: scratch, shape (17, 3); work[15] returns the pixel (u, v) of the cube's centre and the tag's area, px^2.
    """
    u, v, depth = _project(camera, lens, marker[0], marker[1], marker[2])
    if not _in_frame(u, v, depth, lens, cube):
        return -1
    area0 = _face_area(0, camera, lens, marker, cube, work)
    area1 = _face_area(1, camera, lens, marker, cube, work)
    area2 = _face_area(2, camera, lens, marker, cube, work)
    area3 = _face_area(3, camera, lens, marker, cube, work)
    gathered = False
    for _ in range(4):
        best = max(area0, area1, area2, area3)
        if best <= 0.0:
            return -1
        if not gathered:
            _gather(camera, marker, cube, poses, sizes, near)
            gathered = True
        face = 0 if area0 == best else 1 if area1 == best else 2 if area2 == best else 3
        _face_area(face, camera, lens, marker, cube, work)
        if not _hidden(camera, poses, kinds, sizes, near, work):
            work[15, 0], work[15, 1], work[15, 2] = u, v, best
            return face
        if face == 0:
            area0 = 0.0
        elif face == 1:
            area1 = 0.0
        elif face == 2:
            area2 = 0.0
        else:
            area3 = 0.0
    return -1


@jit
def _face_area(face: int, camera: Floats, lens: Floats, marker: Floats, cube: Floats, work: Floats) -> float:
    """Area (px^2) of a face's tag if it is turned to the camera, large enough and inside the image, else 0.

    Leaves the tag's corners, the middles of its edges and its centre in work[2:11], in the world.
    """
    turn = (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)
    ny, nz = turn[face]
    distance = facing = 0.0
    for k in range(3):
        normal = ny * marker[3 + 3 * k + 1] + nz * marker[3 + 3 * k + 2]
        gap = camera[k] - marker[k] - cube[0] * normal
        facing += normal * gap
        distance += gap * gap
    if facing <= lens[4] * math.sqrt(distance):
        return 0.0
    for corner in range(9):
        a, b = _GRID[corner]
        for k in range(3):
            normal = ny * marker[3 + 3 * k + 1] + nz * marker[3 + 3 * k + 2]
            side = -nz * marker[3 + 3 * k + 1] + ny * marker[3 + 3 * k + 2]
            work[2 + corner, k] = marker[k] + cube[0] * normal + cube[1] * (a * marker[3 + 3 * k] + b * side)
    return _tag_area(camera, lens, work)


_GRID = (
    (1.0, -1.0),
    (1.0, 1.0),
    (-1.0, 1.0),
    (-1.0, -1.0),
    (1.0, 0.0),
    (0.0, 1.0),
    (-1.0, 0.0),
    (0.0, -1.0),
    (0.0, 0.0),
)


@jit
def _tag_area(camera: Floats, lens: Floats, work: Floats) -> float:
    """Area of the tag whose corners stand in work[2:6] as the image shows it, or 0 if it is cut off or too small."""
    for corner in range(4):
        u, v, _ = _project(camera, lens, work[2 + corner, 0], work[2 + corner, 1], work[2 + corner, 2])
        if not (lens[5] <= u <= lens[1] - 1.0 - lens[5] and lens[5] <= v <= lens[2] - 1.0 - lens[5]):
            return 0.0
        work[11 + corner, 0], work[11 + corner, 1] = u, v
    area, least = 0.0, math.inf
    for corner in range(4):
        after = 11 + (corner + 1) % 4
        u0, v0, u1, v1 = work[11 + corner, 0], work[11 + corner, 1], work[after, 0], work[after, 1]
        area += 0.5 * (u0 * v1 - u1 * v0)
        least = min(least, (u1 - u0) ** 2 + (v1 - v0) ** 2)
    return abs(area) if least >= lens[3] * lens[3] else 0.0


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
    near: Ints,
    work: Floats,
    seen: NDArray[np.bool_],
) -> int:
    """Which of many head postures read the marker, in `seen`; with `first` >= 0 only whether any does.

    Args:
        cameras: pose of the camera at each head posture, shape (m, 12).
        moved: poses there of the occluders that move with the head, shape (m, len(rows), 12).
        rows: which occluders those are.
        first: head posture to try first, after which the search ends with the first success; -1 to try all.
        seen: shape (m,), overwritten unless the search ends early.

    The others are as in `see`; `poses` is overwritten in `rows`. Returns the last head posture that sees, or -1.
    """
    found = -1
    for trial in range(-1 if first >= 0 else 0, len(cameras)):
        h = first if trial < 0 else trial
        camera = cameras[h]
        u, v, depth = _project(camera, lens, marker[0], marker[1], marker[2])
        visible = False
        if _in_frame(u, v, depth, lens, cube):
            for r in range(rows.size):
                poses[rows[r]] = moved[h, r]
            visible = see(camera, lens, marker, cube, poses, kinds, sizes, near, work) >= 0
        seen[h] = visible
        if visible:
            found = h
            if first >= 0:
                return found
    return found


class GeometricEye:
    """Says what the rendered eye would see, from the true poses of camera, marker and occluders.

    A tag is read if it is turned to the camera, large enough, wholly inside the image, and if neither its corners, the
    middles of its edges nor its centre are hidden. The largest such tag counts. A model, a thousand times as fast as
    pictures: for ceilings, controls and many seeds; wherever its numbers stand, they are labelled as its own.

    Args:
        camera: size and focal length of the pictures.
        marker: the cube of tags.
        occluders: what can hide the marker, in the order of the views' poses.

    Example:
        >>> camera, marker = Camera("eye", 320, 240, fovy=0.83), Marker()
        >>> eye = GeometricEye(camera, marker, Shapes(np.empty(0, np.int64), np.empty((0, 4))))
        >>> here = np.array([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1.0])
        >>> ahead = np.array([0, 0, -0.2, 0, 0, 1, -1, 0, 0, 0, -1, 0])
        >>> eye.find(View(here, ahead, np.empty((0, 12)))).pixel
        (159.5, 119.5)
    """

    def __init__(self, camera: Camera, marker: Marker, occluders: Shapes) -> None:
        self._lens = np.array([camera.focal, camera.width, camera.height, MIN_SIDE, np.cos(MAX_TILT), BORDER])
        self._cube = np.array([0.5 * marker.size, 0.5 * marker.tag_size])
        self._ids = marker.ids
        self._kinds, self._sizes = occluders.kinds, occluders.sizes
        self._near = np.zeros(len(occluders.kinds) + 1, np.int64)
        self._work = np.zeros((17, 3))

    def look(self, reading: Reading) -> Sighting | None:
        """Where the marker would be seen.

        Raises:
            ValueError: the reading has no view.
        """
        if reading.view is None:
            raise ValueError("This body does not know its true poses; the geometric eye needs them. Use another eye.")
        return self.find(reading.view)

    def find(self, view: View) -> Sighting | None:
        """Where the marker would be seen with these poses."""
        face = see(
            view.camera,
            self._lens,
            view.marker,
            self._cube,
            view.occluders,
            self._kinds,
            self._sizes,
            self._near,
            self._work,
        )
        if face < 0:
            return None
        u, v, area = self._work[15].tolist()
        return Sighting(pixel=(u, v), tag=self._ids[face], area=area)

    def look_from_each(
        self, cameras: Floats, moved: Floats, rows: Ints, view: View, first: int = -1
    ) -> NDArray[np.bool_]:
        """Which of many head postures would see the marker where it is in `view`.

        Args:
            cameras: the camera's pose at each head posture, shape (m, 12).
            moved: poses there of the occluders that move with the head, shape (m, len(rows), 12).
            rows: which occluders those are, shape (k,).
            view: marker and occluders for the arm's posture.
            first: head posture to try first, for those who ask only whether any sees; the rest then stays False.

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
            self._near,
            self._work,
            seen,
        )
        return seen
