"""Damages to senses other than the arm's: an offset of the sensed head posture, and a mirrored picture."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from annotated_types import Len
from numpy.typing import ArrayLike
from typing_extensions import Doc

from somatopy.interventions.base import NoIntervention
from somatopy.interventions.joints import scale
from somatopy.percept import Camera, Percept
from somatopy.registry import BuildContext, Finite, Settings

__all__ = ["HeadShift", "MirroredPicture"]


class HeadShift(NoIntervention):
    """Adds a constant to the sensed head posture. The efference copy of the head's command stays as it is.

    Nothing is clipped. All information is kept, and the command still says where the head was told to go.

    Args:
        offset: one for each joint, shape (n_head,), or one for all; rad, or m for a slide.

    Example:
        >>> zero = np.zeros(2)
        >>> felt = HeadShift(0.2).sense(Percept(0.0, zero, zero, zero, zero), np.random.default_rng())
        >>> felt.head, felt.head_command
        (array([0.2, 0.2]), array([0., 0.]))
    """

    def __init__(self, offset: ArrayLike) -> None:
        self._offset = np.array(offset, float)

    def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
        """The percept with the head posture shifted."""
        return replace(percept, head=percept.head + self._offset)


@dataclass(frozen=True)
class HeadOffset(Settings):
    """Adds a constant to the sensed head posture, but not to the efference copy of the head's command.

    Severity: 0.2 rad are 11.5 degrees, a fifth of the picture's width with a NAO's camera.
    """

    offset: Annotated[
        Annotated[tuple[Finite, ...], Len(1)] | Finite,
        Doc("Offset, rad; of a slide, as a share of its range. One for all joints of the head, or one a joint."),
    ] = 0.2

    def build(self, context: BuildContext) -> HeadShift:
        """The damage.

        Raises:
            ValueError: the number of offsets is not the number of the head's joints.
        """
        head = context.body.head
        if isinstance(self.offset, tuple) and len(self.offset) != len(head):
            raise ValueError(
                f"{len(self.offset)} offsets; write one for all joints of the head, such as offset = 0.2, or one for "
                f"each of {', '.join(head.names)}"
            )
        return HeadShift(np.array(self.offset) * scale(head))


class MirroredPicture(NoIntervention):
    """Exchanges left and right of the picture, like the prisms and mirrors of experiments with people.

    The marker is found in the true picture, but the learner is told its pixel in the mirrored one. All information is
    kept. A movement that used to bring the marker to the centre now leads away from it.

    Args:
        camera: the camera behind the eye.

    Example:
        >>> from somatopy.percept import Sighting
        >>> zero, seen = np.zeros(1), Sighting((10.0, 20.0), 1, 300.0)
        >>> damage = MirroredPicture(Camera("eye", 320, 240, fovy=0.83))
        >>> damage.sense(Percept(0.0, zero, zero, zero, zero, seen), np.random.default_rng()).sighting.pixel
        (309.0, 20.0)
    """

    def __init__(self, camera: Camera) -> None:
        self._last = camera.width - 1

    def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
        """The percept with the sighting in the other half of the picture."""
        seen = percept.sighting
        if seen is None:
            return percept
        u, v = seen.pixel
        return replace(percept, sighting=replace(seen, pixel=(self._last - u, v)))


@dataclass(frozen=True)
class Mirrored(Settings):
    """Mirrors the picture: the marker's pixel u is counted from the other side, as if through a prism.

    Severity: none for learners that do not use the pixel of the marker.
    """

    def build(self, context: BuildContext) -> MirroredPicture:
        """The damage."""
        return MirroredPicture(context.body.camera)
