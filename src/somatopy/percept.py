"""The data that pass between body, eye, interventions and learner, as frozen dataclasses.

Angles are radians, lengths metres, times seconds, pixels are (u, v) from the centre of the top-left pixel.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from time import perf_counter
from types import MappingProxyType
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "Camera",
    "Column",
    "Floats",
    "Image",
    "Ints",
    "JointGroup",
    "Marker",
    "Part",
    "Percept",
    "Picture",
    "Reading",
    "Robot",
    "Shapes",
    "Sighting",
    "Space",
    "View",
]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Image = NDArray[np.uint8]
#: Type of a column's values.
ColumnType = Literal["float", "int", "bool"]
#: Part of a picture: left, top, right and bottom, px; right and bottom are the first column and row outside.
Part = tuple[int, int, int, int]
_NO_MORE: Mapping[str, Floats] = MappingProxyType({})


@dataclass(frozen=True, eq=False)
class Space:
    """Names, limits and units of the values of a sense, in the order of its vectors.

    Attributes:
        names: one name for each value, such as the names of joints.
        lower: lower limits, shape (n,).
        upper: upper limits, shape (n,), each above its lower one.
        units: unit of each value and of its limits: "rad" for a hinge, "m" for a slide. Give one `unit` for all values,
            or a sequence with one for each.

    Raises:
        ValueError: the numbers of names, limits and units differ, or a lower limit is not below its upper one.

    Example:
        >>> head = Space(("yaw", "pitch"), [-2.0, -0.6], [2.0, 0.5])
        >>> len(head), head.unit, head.limits.tolist()
        (2, 'rad', [[-2.0, 2.0], [-0.6, 0.5]])
        >>> Space(("yaw", "lift"), [-2.0, 0.0], [2.0, 0.1], unit=("rad", "m")).units
        ('rad', 'm')
    """

    names: tuple[str, ...]
    lower: Floats
    upper: Floats
    units: tuple[str, ...]

    def __init__(
        self, names: Sequence[str], lower: ArrayLike, upper: ArrayLike, unit: str | Sequence[str] = "rad"
    ) -> None:
        low, high = np.array(lower, float), np.array(upper, float)
        if not low.shape == high.shape == (len(names),) or not (low < high).all():
            raise ValueError(
                f"A space needs a lower limit below an upper one for each of its names {list(names)}; "
                f"got {low.tolist()} and {high.tolist()}."
            )
        units = (unit,) * len(names) if isinstance(unit, str) else tuple(unit)
        if len(units) != len(names):
            raise ValueError(f"A space needs a unit for each of its names {list(names)}; got {list(units)}.")
        low.flags.writeable = high.flags.writeable = False
        for name, value in (("names", tuple(names)), ("lower", low), ("upper", high), ("units", units)):
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        return len(self.names)

    @property
    def unit(self) -> str:
        """The unit that all values share; "" if they have different units."""
        return self.units[0] if len(set(self.units)) == 1 else ""

    @property
    def limits(self) -> Floats:
        """Low and high of each value, shape (n, 2)."""
        return np.column_stack([self.lower, self.upper])


@dataclass(frozen=True, eq=False)
class Robot:
    """What a learner knows about the robot: its senses, which of them the learner commands, and the camera.

    Attributes:
        senses: the space of each sense, by name. "arm" and "head" are always among them.
        moves: names of the senses whose postures the learner commands.
        camera: the camera behind the eye.

    Example:
        >>> arm, head = Space(("shoulder", "elbow"), [-2, 0], [2, 1.5]), Space(("pan", "tilt"), [-2, -1], [2, 1])
        >>> robot = Robot({"arm": arm, "head": head}, ("head",), Camera("eye", 320, 240, fovy=0.83))
        >>> robot.arm.names, robot.head.limits.tolist()
        (('shoulder', 'elbow'), [[-2.0, 2.0], [-1.0, 1.0]])
    """

    senses: Mapping[str, Space]
    moves: tuple[str, ...]
    camera: Camera

    @property
    def arm(self) -> Space:
        """The arm's postures."""
        return self.senses["arm"]

    @property
    def head(self) -> Space:
        """The head's postures."""
        return self.senses["head"]


@dataclass(frozen=True)
class Column:
    """A column of the record of frames.

    Attributes:
        name: its name, which no other column of the run may have.
        type: the type of its values: "float", "int" or "bool".
        meaning: what they mean, with unit, and what stands for a missing value.
        unit: their unit, as a symbol; "" for pure numbers.
        role: what kind of thing it is: "clock", "sensed", "command", "percept", "sighting", "body", "probe".

    Raises:
        ValueError: there is no such type.
    """

    name: str
    type: ColumnType
    meaning: str
    unit: str = ""
    role: str = "probe"

    def __post_init__(self) -> None:
        if self.type not in (valid := get_args(ColumnType)):
            raise ValueError(
                f"The column {self.name!r} has the type {self.type!r}, which is unknown; choose one of "
                f"{', '.join(map(repr, valid))}, such as Column({self.name!r}, {valid[0]!r}, ...)."
            )


@dataclass(frozen=True)
class JointGroup:
    """The joints of an arm or a head, in the order of its posture vectors.

    Attributes:
        names: one name for each joint.
        lower: lower position limits, shape (n,), in the joint's unit.
        upper: upper position limits, shape (n,), likewise.
        velocity: velocity limits, shape (n,), in the joint's unit per second.
        units: one for each joint: "rad" for a hinge, "m" for a slide; all "rad" if none are given.
    """

    names: tuple[str, ...]
    lower: Floats
    upper: Floats
    velocity: Floats
    units: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.units:
            object.__setattr__(self, "units", ("rad",) * len(self.names))

    def __len__(self) -> int:
        return len(self.names)

    @property
    def space(self) -> Space:
        """The space of the group's postures, which a learner gets."""
        return Space(self.names, self.lower, self.upper, self.units)


@dataclass(frozen=True)
class Camera:
    """A pinhole camera without distortion.

    Attributes:
        name: the camera's name in the body's model.
        width: image width, px.
        height: image height, px.
        fovy: vertical field of view, rad.
        intrinsics: focal lengths along u and v, and pixel (u, v) of the optical axis, px. If None, both focal lengths
            follow from `fovy`, and the axis meets the middle of the image.
    """

    name: str
    width: int
    height: int
    fovy: float
    intrinsics: tuple[float, float, float, float] | None = None

    @property
    def focal(self) -> float:
        """Focal length along v, px. The one along u may differ; see `focals`."""
        return self.focals[1]

    @property
    def focals(self) -> tuple[float, float]:
        """Focal lengths along u and v, px."""
        focal = 0.5 * self.height / float(np.tan(0.5 * self.fovy))
        return self.intrinsics[:2] if self.intrinsics else (focal, focal)

    @property
    def centre(self) -> tuple[float, float]:
        """Pixel (u, v) of the optical axis: (159.5, 119.5) at 320 x 240 without intrinsics."""
        middle = 0.5 * (self.width - 1), 0.5 * (self.height - 1)
        return self.intrinsics[2:] if self.intrinsics else middle


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
        kinds: MuJoCo's numbers of the shapes, shape (n,): 2 sphere, 3 capsule, 4 ellipsoid, 5 cylinder, 6 box.
        sizes: half-sizes along the shape's own axes as MuJoCo has them, and bounding radius, shape (n, 4), m.
    """

    kinds: Ints
    sizes: Floats


@dataclass(frozen=True)
class View:
    """True poses of camera, marker and occluders. Geometric eyes and measures use them; learners never get them.

    Rotations are matrices whose columns are the frame's axes in the world. The camera looks along its -z, its x
    points right in the image and its y up (MuJoCo's and OpenGL's convention).

    Attributes:
        camera: position (m) and rotation matrix, row by row, shape (12,).
        marker: position of the marker's centre (m) and its rotation matrix, likewise, shape (12,).
        occluders: position and rotation matrix of each of the body's `Shapes`, shape (n, 12).
    """

    camera: Floats
    marker: Floats
    occluders: Floats

    @property
    def gaze_error(self) -> float:
        """Angle between the optical axis and the line from camera to marker, rad."""
        x0, y0, z0, _, _, ax, _, _, ay, _, _, az = self.camera.tolist()
        x, y, z = self.marker[:3].tolist()
        x, y, z = x - x0, y - y0, z - z0
        along = -(ax * x + ay * y + az * z)
        across = x + along * ax, y + along * ay, z + along * az
        return math.atan2(math.hypot(*across), along)


class Picture:
    """A picture that is drawn when it is first asked for, and then kept. It measures the time that drawing takes.

    Args:
        draw: draws the picture, (height, width, 3), RGB.
        draw_part: draws a part with the same pixels as in the whole picture; None if parts cannot be drawn alone.

    Attributes:
        seconds: time that drawing has taken so far, s.
        comes_in_parts: whether a part can be drawn alone.

    Example:
        >>> picture = Picture(lambda: np.zeros((2, 3, 3), np.uint8))
        >>> picture().shape, picture() is picture(), picture.part(1, 0, 3, 1).shape
        ((2, 3, 3), True, (1, 2, 3))
    """

    __slots__ = ("_draw", "_draw_part", "_drawn", "seconds")

    def __init__(self, draw: Callable[[], Image], draw_part: Callable[[Part], Image] | None = None) -> None:
        self._draw, self._draw_part = draw, draw_part
        self._drawn: Image | None = None
        self.seconds = 0.0

    @property
    def comes_in_parts(self) -> bool:
        """Whether a part can be drawn alone."""
        return self._draw_part is not None

    def __call__(self) -> Image:
        if self._drawn is None:
            start = perf_counter()
            self._drawn = self._draw()
            self.seconds += perf_counter() - start
        return self._drawn

    def part(self, left: int, top: int, right: int, bottom: int) -> Image:
        """A part of the picture, (bottom - top, right - left, 3). It is drawn alone if the whole is not drawn yet.

        Args:
            left: first column.
            top: first row.
            right: first column that is not in the part.
            bottom: first row that is not in the part.
        """
        if self._draw_part is None or self._drawn is not None:
            return self()[top:bottom, left:right]
        start = perf_counter()
        drawn = self._draw_part((left, top, right, bottom))
        self.seconds += perf_counter() - start
        return drawn


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
        overlap: whether arm and head interpenetrate. They can, since there is no contact between them.
        image: function that returns the camera's picture, (height, width, 3); None if there is none. A `Picture` is
            drawn at the first call, and its time counts as drawing.
        view: the true poses, or None if they are unknown.
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
    """What a learner is told in a frame: the sensed vectors after interventions, and what the eye saw.

    Vectors can be read by name: `percept["arm"]` is what is sensed of the arm, and `percept["arm_command"]` the
    efference copy of its command. Those of arm and head are also attributes.

    Attributes:
        time: seconds since reset.
        arm: arm posture as perceived (after damage, unclipped), shape (n_arm,), rad.
        head: sensed head posture, shape (n_head,), rad.
        arm_command: efference copy of the arm command as perceived, shape (n_arm,), rad.
        head_command: efference copy of the head command, shape (n_head,), rad.
        sighting: the marker, or None on a miss.
        dt: measured time since the reading before, s.
        more: the vectors of further senses, by name.

    Example:
        >>> percept = Percept(0.0, np.ones(4), np.zeros(2), np.ones(4), np.zeros(2), more={"torso": np.zeros(1)})
        >>> percept["arm"] is percept.arm, percept["torso"].tolist()
        (True, [0.0])
    """

    time: float
    arm: Floats
    head: Floats
    arm_command: Floats
    head_command: Floats
    sighting: Sighting | None = None
    dt: float = 0.0
    more: Mapping[str, Floats] = field(default_factory=lambda: _NO_MORE)

    def __getitem__(self, sense: str) -> Floats:
        if sense in ("arm", "head", "arm_command", "head_command"):
            vector: Floats = getattr(self, sense)
            return vector
        if sense not in self.more:
            known = ", ".join(("arm", "head", "arm_command", "head_command", *self.more))
            raise KeyError(f"This percept has no sense {sense!r}; it has {known}.")
        return self.more[sense]
