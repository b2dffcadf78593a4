"""Computes from the true poses in which part of a picture a tag can be read. Only that part must be drawn."""

from __future__ import annotations

import math

import numpy as np

from somatopy._jit import jit
from somatopy.percept import Camera, Floats, Marker, Part

__all__ = ["may_be_seen", "optics", "part_with_tags"]

#: A tag is read from its four corners, which the detector wants 3 px inside the picture. One that lies this share of
#: the picture's width outside is out of its reach, however coarsely it draws the outline of a tag that is cut off.
_BEYOND = 0.1
#: The detector asks of pixels up to 11 px away, half of its largest window, whether a pixel is dark or light. It drops
#: outlines with a corner within 3 px of the picture's edge. Two more are for rounding.
_NEIGHBOURHOOD = 16.0
#: Outlines of which the corners are less than half a side apart, an eighth of the smaller one's length, stand for each
#: other: the tag, the white face around it, and the dark seam of that. With the largest of them falls the tag.
_ALIKE = 0.125


def optics(camera: Camera, marker: Marker) -> tuple[Floats, Floats]:
    """Camera and marker as `part_with_tags` takes them.

    Returns:
        Focal lengths along u and v, pixel (u, v) of the optical axis, width and height of the picture, shape (6,), px;
        half edge of cube and of tag, shape (2,), m.
    """
    lens = np.array([*camera.focals, *camera.centre, camera.width, camera.height], float)
    return lens, np.array([0.5 * marker.size, 0.5 * marker.tag_size])


@jit
def may_be_seen(camera: Floats, marker: Floats, lens: Floats, cube: Floats) -> bool:
    """Whether a picture could show a whole tag. False only if it cannot, whatever stands in between.

    It is False if `part_with_tags`, which takes the same arguments, is empty.

    Example:
        >>> lens, cube = optics(Camera("eye", 320, 240, fovy=0.83), Marker())
        >>> upright = [1, 0, 0, 0, 1, 0, 0, 0, 1]
        >>> camera = np.array([0, 0, 0, *upright], float)
        >>> [may_be_seen(camera, np.array([x, 0, -0.2, *upright]), lens, cube) for x in (0.0, 0.1, 0.2)]
        [True, True, False]
    """
    return part_with_tags(camera, marker, lens, cube)[2] > 0


@jit
def part_with_tags(camera: Floats, marker: Floats, lens: Floats, cube: Floats) -> Part:
    """The part of a picture in which all tags are found that are found in the whole picture.

    A tag that is turned away from the camera, or has a corner behind the camera or well outside the picture, cannot be
    read. The part surrounds all other tags, with a margin as wide as the surroundings that the detector takes into
    account. What stands between camera and tag does not matter here. Computing the part takes about a microsecond, a
    thousandth of the time for drawing and searching a picture.

    Args:
        camera: position (m) and rotation (row by row) of the camera, shape (12,), as in a `View`.
        marker: the same of the marker.
        lens: see `optics`.
        cube: see `optics`.

    Returns:
        All zeros where no tag can be read.

    Example:
        >>> lens, cube = optics(Camera("eye", 320, 240, fovy=0.83), Marker())
        >>> upright = [1, 0, 0, 0, 1, 0, 0, 0, 1]
        >>> part_with_tags(np.array([0, 0, 0, *upright], float), np.array([0, 0, -0.2, *upright]), lens, cube)
        (81, 41, 239, 199)
    """
    left, top, right, bottom = lens[4], lens[5], 0.0, 0.0
    for axis, sign in ((1, 1.0), (2, 1.0), (1, -1.0), (2, -1.0)):
        facing = -cube[0]
        for k in range(3):
            facing += sign * marker[3 + 3 * k + axis] * (camera[k] - marker[k])
        if facing > 0.0:
            u0, v0, u1, v1, length = _box(camera, marker, axis, sign, lens, cube)
            margin = _NEIGHBOURHOOD + _ALIKE * length
            left, top = min(left, u0 - margin), min(top, v0 - margin)
            right, bottom = max(right, u1 + margin), max(bottom, v1 + margin)
    first_column, first_row = max(0, math.floor(left)), max(0, math.floor(top))
    columns, rows = min(int(lens[4]), math.ceil(right) + 1), min(int(lens[5]), math.ceil(bottom) + 1)
    if first_column >= columns or first_row >= rows:
        return 0, 0, 0, 0
    return first_column, first_row, columns, rows


@jit
def _box(
    camera: Floats, marker: Floats, axis: int, sign: float, lens: Floats, cube: Floats
) -> tuple[float, float, float, float, float]:
    """Least and greatest pixel (u, v) of the tag on the face along `sign` times the cube's `axis`, and its outline.

    Infinitely far apart, the wrong way round, where a corner is neither in the view nor beside it.
    """
    u0, v0, u1, v1, length = math.inf, math.inf, -math.inf, -math.inf, 0.0
    before = _corner(camera, marker, axis, sign, 3, lens, cube)
    for corner in range(4):
        u, v, inside = _corner(camera, marker, axis, sign, corner, lens, cube)
        if not inside:
            return math.inf, math.inf, -math.inf, -math.inf, 0.0
        u0, v0, u1, v1 = min(u0, u), min(v0, v), max(u1, u), max(v1, v)
        length += math.hypot(u - before[0], v - before[1])
        before = u, v, inside
    return u0, v0, u1, v1, length


@jit
def _corner(
    camera: Floats, marker: Floats, axis: int, sign: float, corner: int, lens: Floats, cube: Floats
) -> tuple[float, float, bool]:
    """Pixel (u, v) of one of a tag's corners, which go round, and whether it is in the view or beside it."""
    a = cube[1] if corner in (1, 2) else -cube[1]
    b = cube[1] if corner in (2, 3) else -cube[1]
    x = y = depth = 0.0
    for k in range(3):
        row = 3 + 3 * k
        gap = marker[k] - camera[k]
        gap += a * marker[row] + b * marker[row + 3 - axis] + sign * cube[0] * marker[row + axis]
        x += camera[row] * gap
        y += camera[row + 1] * gap
        depth -= camera[row + 2] * gap
    right, down, beyond = lens[0] * x, -lens[1] * y, _BEYOND * lens[4]
    if (
        depth <= 0.0
        or right < -(lens[2] + 0.5 + beyond) * depth
        or right > (lens[4] - 0.5 - lens[2] + beyond) * depth
        or down < -(lens[3] + 0.5 + beyond) * depth
        or down > (lens[5] - 0.5 - lens[3] + beyond) * depth
    ):
        return 0.0, 0.0, False
    return lens[2] + right / depth, lens[3] + down / depth, True
