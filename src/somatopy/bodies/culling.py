"""Finds shapes that a part of a picture cannot show. Leaving them out of the drawing changes no pixel."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from somatopy._jit import jit
from somatopy.percept import Floats

__all__ = ["mark_unseen"]

#: By which a ball is taken larger than it is, for rounding in single precision: a share, and m.
_SHARE, _MORE = 1e-3, 1e-5


@jit
def mark_unseen(
    camera: Floats,
    turn: Floats,
    edges: tuple[float, float, float, float],
    places: Floats,
    reaches: Floats,
    groups: NDArray[np.int32],
    group: int,
) -> None:
    """Put shapes that a part of a picture cannot show into a group of their own.

    Each shape lies in a ball. It cannot be seen if its ball is wholly behind the camera, or wholly outside of the
    pyramid that the part of the picture shows.

    Args:
        camera: position of the camera, shape (3,), m. The camera looks along its -z axis, and its y axis points up.
        turn: rotation of the camera, row by row, shape (9,).
        edges: tangents of the angles from the optical axis to the left, top, right and bottom edge of the part. Right
            and down are positive.
        places: centre of the ball around each shape, shape (n, 3), m.
        reaches: radius of each ball, shape (n,), m. A radius of 0 marks a shape without a ball, such as an endless
            plane. It is never left out.
        groups: group of each shape, shape (n,). Entries of unseen shapes are overwritten.
        group: the group for unseen shapes.

    Example:
        >>> places, groups = np.array([[0, 0, -1.0], [0, 0, 1], [2, 0, -1], [1.1, 0, -1]]), np.zeros(4, np.int32)
        >>> ahead, edges = np.eye(3).ravel(), (-1.0, -1.0, 1.0, 1.0)
        >>> mark_unseen(np.zeros(3), ahead, edges, places, np.full(4, 0.2), groups, 5)
        >>> groups.tolist()
        [0, 5, 5, 0]
    """
    for n in range(len(reaches)):
        if reaches[n] <= 0.0:
            continue
        x, y, z = places[n, 0] - camera[0], places[n, 1] - camera[1], places[n, 2] - camera[2]
        right = turn[0] * x + turn[3] * y + turn[6] * z
        down = -(turn[1] * x + turn[4] * y + turn[7] * z)
        depth = -(turn[2] * x + turn[5] * y + turn[8] * z)
        reach = (1.0 + _SHARE) * reaches[n] + _MORE
        if (
            depth < -reach
            or edges[0] * depth - right > reach * math.hypot(1.0, edges[0])
            or edges[1] * depth - down > reach * math.hypot(1.0, edges[1])
            or right - edges[2] * depth > reach * math.hypot(1.0, edges[2])
            or down - edges[3] * depth > reach * math.hypot(1.0, edges[3])
        ):
            groups[n] = group
