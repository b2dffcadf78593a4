"""The Damage contract, and the paper's damage: what is sensed of the arm is shifted."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from somatopy.bodies import Body
from somatopy.percept import Percept

__all__ = ["Damage", "JointOffset", "NoDamage"]


@runtime_checkable
class Damage(Protocol):
    """Something is wrong with the robot for the length of a phase. Either seam may do nothing.

    Attributes:
        alters_ceiling: whether the injured body must be asked anew what it could see.
    """

    alters_ceiling: bool

    def injure(self, body: Body) -> None:
        """Change the body when the phase begins."""
        ...

    def heal(self, body: Body) -> None:
        """Undo that when the phase ends."""
        ...

    def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
        """Change what the robot senses, in every frame."""
        ...


class NoDamage:
    """The intact robot."""

    alters_ceiling = False

    def injure(self, body: Body) -> None:
        """Leaves the body alone."""

    def heal(self, body: Body) -> None:
        """Nothing to undo."""

    def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
        """The percept itself."""
        return percept


class JointOffset(NoDamage):
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
