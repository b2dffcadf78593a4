"""The paper's damage: what is sensed of the arm is shifted."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from annotated_types import Len
from numpy.typing import ArrayLike
from typing_extensions import Doc

from somatopy.interventions.base import NoIntervention
from somatopy.percept import Percept
from somatopy.registry import BuildContext, Finite, Settings

__all__ = ["PAPER_OFFSET", "JointOffset", "Offset"]

#: The shift of the paper's arm (ShoulderPitch, ShoulderRoll, ElbowYaw, ElbowRoll), rad.
PAPER_OFFSET = (0.1265, 1.1411, 1.2295, -0.2242)


class JointOffset(NoIntervention):
    """A constant added to the arm posture as sensed and to the efference copy of the arm command.

    The sum is not clipped to the joint limits: clipping contradicts the paper's Figure 4. The body is untouched.

    Args:
        offset: one a joint, shape (n_arm,), rad.

    Example:
        >>> zero = np.zeros(2)
        >>> JointOffset([0.1, -0.2]).sense(Percept(0.0, zero, zero, zero, zero), np.random.default_rng()).arm
        array([ 0.1, -0.2])
    """

    def __init__(self, offset: ArrayLike) -> None:
        self._offset = np.array(offset, float)

    def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
        """The percept with both arm vectors shifted."""
        return replace(percept, arm=percept.arm + self._offset, arm_command=percept.arm_command + self._offset)


@dataclass(frozen=True)
class Offset(Settings):
    """A constant added to the sensed arm posture and to the efference copy of the arm command; nothing is clipped."""

    offset: Annotated[tuple[Finite, ...], Len(1), Doc("One a joint, rad.")] = PAPER_OFFSET

    def build(self, context: BuildContext) -> JointOffset:
        """The damage.

        Raises:
            ValueError: an offset of another length than the arm.
        """
        names = context.arm.names
        if len(self.offset) != len(names):
            raise ValueError(f"{len(self.offset)} offsets; the arm has {len(names)} joints: {', '.join(names)}")
        return JointOffset(self.offset)
