"""The paper's damage, a constant offset of the arm's sense, and offsets in random directions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Len
from numpy.typing import ArrayLike
from typing_extensions import Doc

from somatopy.interventions.base import NoIntervention
from somatopy.interventions.joints import drawn
from somatopy.percept import Floats, JointGroup, Percept
from somatopy.registry import BuildContext, Finite, Positive, Settings

__all__ = ["PAPER_OFFSET", "JointOffset", "Offset", "RandomOffset", "paper_offset"]

#: The shift of the paper's arm (ShoulderPitch, ShoulderRoll, ElbowYaw, ElbowRoll), rad.
PAPER_OFFSET = (0.1265, 1.1411, 1.2295, -0.2242)
#: The limits of these joints on the NAO's left arm, rad, to four digits as its maker prints them.
NAO_LIMITS = ((-2.0857, 2.0857), (-0.3142, 1.3265), (-2.0857, 2.0857), (-1.5446, -0.0349))
#: Limits that differ by less, rad, are the same joint's.
_SAME = 0.001


def paper_offset(arm: JointGroup) -> Floats:
    """The paper's damage for any arm, shape (n_arm,), each value in its joint's unit.

    An arm of four hinges with the limits of the NAO's left arm gets the numbers that the paper prints. On any other arm
    each joint is shifted by the same share of its range as the NAO's joint with the same number: 3, 70, 29 and -15
    percent. From the fifth joint on these shares repeat.

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
    """Adds a constant to the sensed arm posture and to the efference copy of the arm's command.

    The sum is not clipped to the joint limits: clipping contradicts the paper's Figure 4. The body is untouched.

    Args:
        offset: one for each joint, shape (n_arm,), rad, or m for a slide.
        remark: a sentence that a run prints before its first frame.

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
    """Adds a constant to the sensed arm posture and to the efference copy of the arm's command. Nothing is clipped."""

    offset: Annotated[
        Literal["paper"] | Annotated[tuple[Finite, ...], Len(1)],
        Doc("One a joint, rad, or m of a slide; paper: the paper's, on other arms the same shares of the ranges."),
    ] = "paper"

    def build(self, context: BuildContext) -> JointOffset:
        """The damage.

        Raises:
            ValueError: the number of offsets is not the number of the arm's joints.
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


@dataclass(frozen=True)
class RandomOffset(Settings):
    """Adds a constant in a random direction to the sensed arm posture and to the efference copy of its command.

    Severity: the norm; that of the paper's offset is 1.7 rad. All information is kept.

    Example:
        >>> from types import SimpleNamespace
        >>> arm, zero = JointGroup(("a", "b"), -np.ones(2), np.ones(2), np.ones(2)), np.zeros(2)
        >>> damage = RandomOffset(norm=0.5).build(SimpleNamespace(arm=arm, description=SimpleNamespace(seed=0)))
        >>> felt = damage.sense(Percept(0.0, zero, zero, zero, zero), np.random.default_rng())
        >>> round(float(np.linalg.norm(felt.arm)), 9), bool((felt.arm == felt.arm_command).all())
        (0.5, True)
    """

    norm: Annotated[Positive, Doc("Euclidean length of the offset, rad; a slide's whole range counts as 1 rad.")] = 0.8
    draw: Annotated[int, Ge(0), Doc("Number of the random direction, which is the same for all learners.")] = 0

    def build(self, context: BuildContext) -> JointOffset:
        """The damage, from the experiment's seed and the draw alone."""
        return JointOffset(drawn(context.arm, self.norm, context.description.seed, self.draw))
