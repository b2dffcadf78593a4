"""Compiled tests whether convex shapes stand between two points, one for each kind of shape."""

from __future__ import annotations

import math

from somatopy._jit import jit
from somatopy.percept import Floats, Ints

__all__ = ["MARGIN", "Vector", "any_between", "beside"]

_SPHERE, _ELLIPSOID, _CYLINDER, _BOX = 2, 4, 5, 6

#: What is passed over because it stands in no way is at least that far from all ways, m: rounding stays far below.
MARGIN = 1e-6

Vector = tuple[float, float, float]


@jit
def _dot(a: Vector, b: Vector) -> float:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@jit
def any_between(poses: Floats, kinds: Ints, sizes: Floats, camera: Floats, points: Floats, radius: float) -> bool:
    """Whether any shape stands between the camera and any of nine points.

    A shape that encloses the camera hides nothing, as in a picture, in which insides are not drawn.

    Args:
        poses: position and rotation (row by row) of each shape, shape (n, 12).
        kinds: MuJoCo's geom type of each, shape (n,).
        sizes: half-sizes and bounding radius of each, shape (n, 4).
        camera: array whose first three entries are the camera's position.
        points: array whose first nine rows are the points, shape (at least 9, 3). They lie in one plane; the last is
            their middle.
        radius: radius of a ball around that middle that contains all points.
    """
    way = points[8, 0] - camera[0], points[8, 1] - camera[1], points[8, 2] - camera[2]
    scale, plane = 1.0 / _dot(way, way), _plane(points, way)
    for n in range(len(poses)):
        p = poses[n, 0] - camera[0], poses[n, 1] - camera[1], poses[n, 2] - camera[2]
        if (
            not beside(p, way, scale, sizes[n, 3] + radius)
            and not _separated(poses, n, kinds[n], sizes, p, way, scale, plane, radius)
            and _is_between(poses, n, kinds[n], sizes, p, camera, points)
        ):
            return True
    return False


@jit
def beside(p: Vector, way: Vector, scale: float, reach: float) -> bool:
    """Whether a point stays at least `reach` away from a way that begins at the origin.

    Args:
        p: the point.
        way: where the way ends.
        scale: 1 / the square of its length.
        reach: as long as `p` and `way`, m.
    """
    t = min(max(_dot(p, way) * scale, 0.0), 1.0)
    gap = p[0] - t * way[0], p[1] - t * way[1], p[2] - t * way[2]
    return _dot(gap, gap) >= reach * reach


@jit
def _plane(points: Floats, way: Vector) -> Vector:
    """A vector across the points, which lie in a plane with their corners first, on the camera's side; may be 0."""
    a = points[1, 0] - points[0, 0], points[1, 1] - points[0, 1], points[1, 2] - points[0, 2]
    b = points[2, 0] - points[0, 0], points[2, 1] - points[0, 1], points[2, 2] - points[0, 2]
    n = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    return n if _dot(n, way) < 0.0 else (-n[0], -n[1], -n[2])


@jit
def _separated(
    poses: Floats,
    n: int,
    kind: int,
    sizes: Floats,
    p: Vector,
    way: Vector,
    scale: float,
    plane: Vector,
    radius: float,
) -> bool:
    """Whether shape n, at `p` from the camera, lies behind the points or beside all ways to them; it may without.

    Two planes are tried, across which it would have to reach: that of the points, and one along the way on the side
    where the shape is. It stays a distance away that no rounding crosses.
    """
    length = math.sqrt(_dot(plane, plane))
    if length > 0.0 and _dot(p, plane) + _reach(poses, n, kind, sizes, plane) <= _dot(way, plane) - MARGIN * length:
        return True
    t = min(max(_dot(p, way) * scale, 0.0), 1.0)
    gap = p[0] - t * way[0], p[1] - t * way[1], p[2] - t * way[2]
    length = math.sqrt(_dot(gap, gap))
    ways = max(0.0, _dot(way, gap) + radius * length)
    return length > 0.0 and _dot(p, gap) - _reach(poses, n, kind, sizes, gap) >= ways + MARGIN * length


@jit
def _reach(poses: Floats, n: int, kind: int, sizes: Floats, direction: Vector) -> float:
    """How far shape n reaches from its centre along a direction, times that one's length."""
    u, v, w = _turned(poses, n, direction[0], direction[1], direction[2])
    x, y, z = sizes[n, 0], sizes[n, 1], sizes[n, 2]
    if kind in (_SPHERE, _ELLIPSOID):
        return math.sqrt((x * u) ** 2 + (y * v) ** 2 + (z * w) ** 2)
    if kind == _BOX:
        return float(x * abs(u) + y * abs(v) + z * abs(w))
    across = u * u + v * v if kind == _CYLINDER else u * u + v * v + w * w
    return float(x * math.sqrt(across) + y * abs(w))


@jit
def _is_between(poses: Floats, n: int, kind: int, sizes: Floats, p: Vector, camera: Floats, points: Floats) -> bool:
    """Whether shape n, at `p` from the camera, is entered on the way from there to any of nine points."""
    o = _turned(poses, n, -p[0], -p[1], -p[2])
    x, y, z = sizes[n, 0], sizes[n, 1], sizes[n, 2]
    for k in range(9):
        d = _turned(poses, n, points[k, 0] - camera[0], points[k, 1] - camera[1], points[k, 2] - camera[2])
        if kind in (_SPHERE, _ELLIPSOID):
            entered = _enters_ellipsoid(o, d, x, y, z)
        elif kind == _BOX:
            entered = _enters_box(o, d, x, y, z)
        elif kind == _CYLINDER:
            entered = _enters_cylinder(o, d, x, y)
        else:
            entered = _enters_capsule(o, d, x, y)
        if entered:
            return True
    return False


@jit
def _turned(poses: Floats, n: int, x: float, y: float, z: float) -> Vector:
    """A vector of the world in the axes of shape n."""
    return (
        poses[n, 3] * x + poses[n, 6] * y + poses[n, 9] * z,
        poses[n, 4] * x + poses[n, 7] * y + poses[n, 10] * z,
        poses[n, 5] * x + poses[n, 8] * y + poses[n, 11] * z,
    )


@jit
def _first_root(a: float, b: float, c: float) -> float:
    """The first t with a t^2 + 2 b t + c = 0 if a ray from outside (c > 0) goes in there, else -1."""
    discriminant = b * b - a * c
    if discriminant <= 0.0 or c <= 0.0 or a <= 0.0:
        return -1.0
    return (-b - math.sqrt(discriminant)) / a


@jit
def _enters_ellipsoid(o: Vector, d: Vector, x: float, y: float, z: float) -> bool:
    """Whether o + t d, t in (0, 1), enters the ellipsoid with half-axes x, y, z from outside."""
    p, q = (o[0] / x, o[1] / y, o[2] / z), (d[0] / x, d[1] / y, d[2] / z)
    return 0.0 < _first_root(_dot(q, q), _dot(p, q), _dot(p, p) - 1.0) < 1.0


@jit
def _enters_box(o: Vector, d: Vector, x: float, y: float, z: float) -> bool:
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
def _enters_cylinder(o: Vector, d: Vector, radius: float, half: float) -> bool:
    """Whether o + t d, t in (0, 1), enters the cylinder along z with that radius and half height from outside."""
    a, b, c = _across(o, d, radius)
    t = _first_root(a, b, c)
    if 0.0 < t < 1.0 and abs(o[2] + t * d[2]) < half:
        return True
    if abs(o[2]) <= half or o[2] * d[2] >= 0.0:
        return False
    t = (math.copysign(half, o[2]) - o[2]) / d[2]
    return t < 1.0 and a * t * t + 2.0 * b * t + c < 0.0


@jit
def _enters_capsule(o: Vector, d: Vector, radius: float, half: float) -> bool:
    """Whether o + t d, t in (0, 1), enters the capsule along z with that radius and half length from outside."""
    a, b, c = _across(o, d, radius)
    beyond = max(abs(o[2]) - half, 0.0)
    if c + beyond * beyond <= 0.0:
        return False
    t = _first_root(a, b, c)
    if 0.0 < t < 1.0 and abs(o[2] + t * d[2]) < half:
        return True
    for end in (-half, half):
        z = o[2] - end
        if 0.0 < _first_root(a + d[2] * d[2], b + z * d[2], c + z * z) < 1.0:
            return True
    return False


@jit
def _across(o: Vector, d: Vector, radius: float) -> Vector:
    """Coefficients a, b, c by which a t^2 + 2 b t + c < 0 within the endless cylinder along z."""
    return (
        d[0] * d[0] + d[1] * d[1],
        o[0] * d[0] + o[1] * d[1],
        o[0] * o[0] + o[1] * o[1] - radius * radius,
    )
