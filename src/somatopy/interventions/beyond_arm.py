"""Damages of what is sensed besides the arm: the head is felt elsewhere, or the picture is mirrored."""

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
    """A constant added to the head posture as sensed; the efference copy of the head command stays as it is.

    Nothing is clipped. All information is kept, and the command says where the head was told to go.

    Args:
        offset: one a joint, shape (n_head,), or one for all, rad, or m of a slide.

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
    """A constant added to the sensed head posture, not to the efference copy of the head command.

    Severity: 0.2 rad are 11.5 degrees, a fifth of the picture's width behind a NAO's camera.
    """

    offset: Annotated[
        Annotated[tuple[Finite, ...], Len(1)] | Finite,
        Doc("Offset, rad; of a slide, as a share of its range. One for all joints of the head, or one a joint."),
    ] = 0.2

    def build(self, context: BuildContext) -> HeadShift:
        """The damage.

        Raises:
            ValueError: offsets of another number than the head has joints.
        """
        head = context.body.head
        if isinstance(self.offset, tuple) and len(self.offset) != len(head):
            raise ValueError(
                f"{len(self.offset)} offsets; write one for all joints of the head, such as offset = 0.2, or one for "
                f"each of {', '.join(head.names)}"
            )
        return HeadShift(np.array(self.offset) * scale(head))


class MirroredPicture(NoIntervention):
    """Left and right of the picture change places, as behind the prisms and mirrors of experiments with people.

    The marker is read in the true picture, and its place is told in the mirrored one. All information is kept, but what
    used to lead the eye to the marker now leads away from it.

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
    """The picture is mirrored: the marker's u is counted from the other side, as behind a prism.

    Severity: learners that do not use where in the picture the marker is notice nothing.
    """

    def build(self, context: BuildContext) -> MirroredPicture:
        """The damage."""
        return MirroredPicture(context.body.camera)
