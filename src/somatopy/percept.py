"""What passes between body, eye, damage and learner: plain frozen data, no behaviour.

Angles are radians, lengths metres, times seconds, pixels are (u, v) from the centre of the top-left pixel.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "Camera",
    "Floats",
    "Image",
    "Ints",
    "JointGroup",
    "Marker",
    "Percept",
    "Reading",
    "Shapes",
    "Sighting",
    "View",
]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Image = NDArray[np.uint8]


@dataclass(frozen=True)
class JointGroup:
    """The joints of an arm or a head, in the order of its posture vectors.

    Attributes:
        names: one name a joint.
        lower: lower position limits, shape (n,), rad.
        upper: upper position limits, shape (n,), rad.
        velocity: velocity limits, shape (n,), rad/s.
    """

    names: tuple[str, ...]
    lower: Floats
    upper: Floats
    velocity: Floats

    def __len__(self) -> int:
        return len(self.names)


@dataclass(frozen=True)
class Camera:
    """A pinhole camera without distortion; the principal point is the image centre.

    Attributes:
        name: the camera's name in the body's model.
        width: image width, px.
        height: image height, px.
        fovy: vertical field of view, rad.
    """

    name: str
    width: int
    height: int
    fovy: float

    @property
    def focal(self) -> float:
        """Focal length in pixels, the same along both axes."""
        return 0.5 * self.height / float(np.tan(0.5 * self.fovy))

    @property
    def centre(self) -> tuple[float, float]:
        """Pixel (u, v) of the optical axis: (159.5, 119.5) at 320 x 240."""
        return 0.5 * (self.width - 1), 0.5 * (self.height - 1)


@dataclass(frozen=True)
class Marker:
    """A cube with a square ArUco tag on each of four side faces.

    The cube's own frame has x along the axis that the four faces surround. Face k's outward normal is
    y turned about x by k * 90 degrees: +y, +z, -y, -z. Each tag's upper edge points along +x.

    Attributes:
        size: edge of the cube, m.
        tag_size: edge of the black square of a tag, m.
        ids: the four tag ids, face by face.
        dictionary: name of OpenCV's predefined ArUco dictionary.
    """

    size: float = 0.05
    tag_size: float = 0.04
    ids: tuple[int, int, int, int] = (0, 1, 2, 3)
    dictionary: str = "DICT_4X4_50"


@dataclass(frozen=True)
class Shapes:
    """Convex shapes that can stand between camera and marker.

    Attributes:
        kinds: 2 sphere, 3 capsule, 4 ellipsoid, 5 cylinder, 6 box (MuJoCo's numbers), shape (n,).
        sizes: half-sizes along the shape's own axes as MuJoCo has them, and bounding radius, shape (n, 4), m.
    """

    kinds: Ints
    sizes: Floats


@dataclass(frozen=True)
class View:
    """Where camera, marker and occluders truly are; for geometric eyes and measures, never for learners.

    Rotations are matrices whose columns are the frame's axes in the world. The camera looks along its -z, its x
    points right in the image and its y up (MuJoCo's and OpenGL's convention).

    Attributes:
        camera: position (m) and rotation matrix, row by row, shape (12,).
        marker: the same of the marker's centre.
        occluders: the same of the body's `Shapes`, shape (n, 12).
    """

    camera: Floats
    marker: Floats
    occluders: Floats

    @property
    def gaze_error(self) -> float:
        """Angle between the optical axis and the line from camera to marker, rad."""
        ray = self.marker[:3] - self.camera[:3]
        axis = -self.camera[5::3]
        along = float(axis @ ray)
        across = ray - along * axis
        return math.atan2(math.sqrt(float(across @ across)), along)


@dataclass(frozen=True)
class Reading:
    """What a body senses at the end of one frame.

    Attributes:
        time: seconds since reset.
        arm: sensed arm posture, shape (n_arm,), rad.
        head: sensed head posture, shape (n_head,), rad.
        arm_command: final target of the current arm movement (the efference copy), shape (n_arm,), rad.
        head_command: head target after the body's clipping, shape (n_head,), rad.
        dt: measured time since the reading before, s.
        skew: age of the postures when the image was taken, s; 0 in simulation.
        overlap: whether arm and head interpenetrate (their contact is off).
        image: renders the camera's picture, (height, width, 3), when first called; None without a camera.
        view: the true poses, or None where no one knows them.
    """

    time: float
    arm: Floats
    head: Floats
    arm_command: Floats
    head_command: Floats
    dt: float = 0.0
    skew: float = 0.0
    overlap: bool = False
    image: Callable[[], Image] | None = field(default=None, repr=False)
    view: View | None = field(default=None, repr=False)


@dataclass(frozen=True)
class Sighting:
    """The marker as an eye found it.

    Attributes:
        pixel: the hand's centre (u, v) in the image, px; it may lie outside the image.
        tag: id of the tag that was read (the largest one).
        area: area of that tag in the image, px^2.
    """

    pixel: tuple[float, float]
    tag: int
    area: float


@dataclass(frozen=True)
class Percept:
    """What reaches the learner: a reading's vectors after damage, and what the eye saw.

    Attributes:
        time: seconds since reset.
        arm: arm posture as perceived (after damage, unclipped), shape (n_arm,), rad.
        head: sensed head posture, shape (n_head,), rad.
        arm_command: efference copy of the arm command as perceived, shape (n_arm,), rad.
        head_command: efference copy of the head command, shape (n_head,), rad.
        sighting: the marker, or None on a miss.
        dt: measured time since the reading before, s.
    """

    time: float
    arm: Floats
    head: Floats
    arm_command: Floats
    head_command: Floats
    sighting: Sighting | None = None
    dt: float = 0.0
