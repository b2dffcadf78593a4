"""The paper's damage: what is sensed of the arm is shifted."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from annotated_types import Len
from numpy.typing import ArrayLike
from typing_extensions import Doc

from somatopy.interventions.base import NoIntervention
from somatopy.percept import Floats, JointGroup, Percept
from somatopy.registry import BuildContext, Finite, Settings

__all__ = ["PAPER_OFFSET", "JointOffset", "Offset", "paper_offset"]

#: The shift of the paper's arm (ShoulderPitch, ShoulderRoll, ElbowYaw, ElbowRoll), rad.
PAPER_OFFSET = (0.1265, 1.1411, 1.2295, -0.2242)
#: The limits of these joints on the NAO's left arm, rad, to four digits as its maker prints them.
NAO_LIMITS = ((-2.0857, 2.0857), (-0.3142, 1.3265), (-2.0857, 2.0857), (-1.5446, -0.0349))
#: Limits that differ by less, rad, are the same joint's.
_SAME = 0.001


def paper_offset(arm: JointGroup) -> Floats:
    """The paper's damage for any arm, shape (n_arm,), each value in its joint's unit.

    An arm of four hinges with the limits of the NAO's left arm is shifted by what the paper prints. On any other arm
    each joint is shifted by the same share of its whole range as its counterpart there: 3, 70, 29 and -15 percent, and
    from the fifth joint on the same again.

    Example:
        >>> nao = JointGroup(("a", "b", "c", "d"), *np.transpose(NAO_LIMITS), np.full(4, 8.0))
        >>> paper_offset(nao).tolist() == [*PAPER_OFFSET]
        True
        >>> arm = JointGroup(("lift", "turn"), np.array([0.0, -2.0]), np.array([0.1, 2.0]), np.ones(2), ("m", "rad"))
        >>> paper_offset(arm).round(3)
        array([0.003, 2.782])
    """
    if _is_nao(arm):
        return np.array(PAPER_OFFSET)
    shares = np.array(PAPER_OFFSET) / np.diff(NAO_LIMITS)[:, 0]
    return np.asarray(np.resize(shares, len(arm)) * (arm.upper - arm.lower))


def _is_nao(arm: JointGroup) -> bool:
    limits = arm.space.limits
    return limits.shape == (4, 2) and {*arm.units} == {"rad"} and np.allclose(limits, NAO_LIMITS, rtol=0, atol=_SAME)


class JointOffset(NoIntervention):
    """A constant added to the arm posture as sensed and to the efference copy of the arm command.

    The sum is not clipped to the joint limits: clipping contradicts the paper's Figure 4. The body is untouched.

    Args:
        offset: one a joint, shape (n_arm,), rad, or m of a slide.
        remark: what a run says of it before its first frame.

    Example:
        >>> zero = np.zeros(2)
        >>> JointOffset([0.1, -0.2]).sense(Percept(0.0, zero, zero, zero, zero), np.random.default_rng()).arm
        array([ 0.1, -0.2])
    """

    def __init__(self, offset: ArrayLike, remark: str = "") -> None:
        self._offset = np.array(offset, float)
        self.remark = remark

    def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
        """The percept with both arm vectors shifted."""
        return replace(percept, arm=percept.arm + self._offset, arm_command=percept.arm_command + self._offset)


@dataclass(frozen=True)
class Offset(Settings):
    """A constant added to the sensed arm posture and to the efference copy of the arm command; nothing is clipped."""

    offset: Annotated[
        Literal["paper"] | Annotated[tuple[Finite, ...], Len(1)],
        Doc("One a joint, rad, or m of a slide; paper: the paper's, on other arms the same shares of the ranges."),
    ] = "paper"

    def build(self, context: BuildContext) -> JointOffset:
        """The damage.

        Raises:
            ValueError: an offset of another length than the arm.
        """
        arm = context.arm
        if isinstance(self.offset, str):
            offset = paper_offset(arm)
            return JointOffset(offset, "" if _is_nao(arm) else _told(arm, offset))
        if len(self.offset) != len(arm):
            zeros = ", ".join(["0.1"] * len(arm))
            raise ValueError(
                f"{len(self.offset)} offsets; the arm has {len(arm)} joints: {', '.join(arm.names)}. "
                f'Write one for each, such as offset = [{zeros}], or offset = "paper", which fits every arm'
            )
        return JointOffset(self.offset)


def _told(arm: JointGroup, offset: Floats) -> str:
    """Which shift stands for the paper's on an arm that is not the NAO's."""
    shifts = ", ".join(f"{name} {by:+.4g} {unit}" for name, by, unit in zip(arm.names, offset, arm.units, strict=True))
    return (
        "The paper's damage is that of a NAO's arm. Here each joint is felt shifted by the same share of its range: "
        f"{shifts}."
    )
