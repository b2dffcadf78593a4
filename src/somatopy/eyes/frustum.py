"""A cautious test for pictures that need not be drawn: no tag in them can be turned to the camera and whole."""

from __future__ import annotations

import numpy as np

from somatopy._jit import jit
from somatopy.percept import Camera, Floats, Marker

__all__ = ["may_be_seen", "optics"]

#: A tag is read from its four corners, which the detector wants 3 px inside the picture. One that lies this share of
#: the picture's width outside is out of its reach, however coarsely it draws the outline of a tag that is cut off.
_BEYOND = 0.1


def optics(camera: Camera, marker: Marker) -> tuple[Floats, Floats]:
    """Camera and marker as `may_be_seen` takes them.

    Returns:
        Focal length, width and height of the picture, shape (3,), px; half edge of cube and of tag, shape (2,), m.
    """
    lens = np.array([camera.focal, camera.width, camera.height], float)
    return lens, np.array([0.5 * marker.size, 0.5 * marker.tag_size])


@jit
def may_be_seen(camera: Floats, marker: Floats, lens: Floats, cube: Floats) -> bool:
    """False only if no picture from here can show a whole tag, whatever stands in between.

    That is: each tag is turned away from the camera, or a corner of it is behind the camera or well outside the
    picture. Takes about a microsecond, a thousandth of drawing and searching the picture.

    Args:
        camera: position (m) and rotation (row by row) of the camera, shape (12,), as in a `View`.
        marker: the same of the marker.
        lens: see `optics`.
        cube: see `optics`.

    Example:
        >>> lens, cube = optics(Camera("eye", 320, 240, fovy=0.83), Marker())
        >>> upright = [1, 0, 0, 0, 1, 0, 0, 0, 1]
        >>> camera = np.array([0, 0, 0, *upright], float)
        >>> [may_be_seen(camera, np.array([x, 0, -0.2, *upright]), lens, cube) for x in (0.0, 0.1, 0.2)]
        [True, True, False]
    """
    for axis, sign in ((1, 1.0), (2, 1.0), (1, -1.0), (2, -1.0)):
        facing = -cube[0]
        for k in range(3):
            facing += sign * marker[3 + 3 * k + axis] * (camera[k] - marker[k])
        if facing > 0.0 and _has_all_corners_near_view(camera, marker, axis, sign, lens, cube):
            return True
    return False


@jit
def _has_all_corners_near_view(
    camera: Floats, marker: Floats, axis: int, sign: float, lens: Floats, cube: Floats
) -> bool:
    """Whether all corners of the tag on the face along `sign` times the cube's `axis` are in the view or beside it."""
    for a in (-cube[1], cube[1]):
        for b in (-cube[1], cube[1]):
            x = y = depth = 0.0
            for k in range(3):
                row = 3 + 3 * k
                gap = marker[k] - camera[k]
                gap += a * marker[row] + b * marker[row + 3 - axis] + sign * cube[0] * marker[row + axis]
                x += camera[row] * gap
                y += camera[row + 1] * gap
                depth -= camera[row + 2] * gap
            across, along = (0.5 + _BEYOND) * lens[1] * depth, (0.5 * lens[2] + _BEYOND * lens[1]) * depth
            if abs(lens[0] * x) > across or abs(lens[0] * y) > along:
                return False
    return True
