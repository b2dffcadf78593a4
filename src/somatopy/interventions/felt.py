"""The arm is felt otherwise than it is: scaled, joints mixed up, one of them stuck, or noisy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isnan, nan
from typing import Annotated, Any

import numpy as np
from annotated_types import Ge
from numpy.typing import ArrayLike
from typing_extensions import Doc

from somatopy.interventions.base import NoIntervention
from somatopy.interventions.joints import Joint, numbered, scale
from somatopy.percept import Floats, JointGroup, Percept
from somatopy.registry import BuildContext, Finite, Settings

__all__ = ["DeadJoint", "EncoderNoise", "JointGain", "JointOrder"]


class JointGain(NoIntervention):
    """Each joint of the arm is felt `gain` times as far from the middle of its range as it is.

    It changes the sensed arm posture and the efference copy of the arm command alike, and clips nothing. All
    information is kept, but with a gain of 0.

    Args:
        arm: the arm's joints.
        gain: 1 changes nothing.

    Example:
        >>> arm, zero = JointGroup(("a", "b"), np.array([0.0, -1.0]), np.ones(2), np.ones(2)), np.zeros(2)
        >>> JointGain(arm, 0.5).sense(Percept(0.0, np.ones(2), zero, zero, zero), np.random.default_rng()).arm
        array([0.75, 0.5 ])
    """

    def __init__(self, arm: JointGroup, gain: float) -> None:
        self._middle, self._gain = (arm.lower + arm.upper) / 2, gain

    def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
        """The percept with both arm vectors scaled about the middle."""
        return replace(percept, arm=self._felt(percept.arm), arm_command=self._felt(percept.arm_command))

    def _felt(self, arm: Floats) -> Floats:
        return self._middle + self._gain * (arm - self._middle)


@dataclass(frozen=True)
class Gain(Settings):
    """The arm's joints are felt nearer to the middle of their ranges than they are, or farther from it.

    Severity: at the ends of a range a joint is felt (1 - gain) / 2 of the whole range aside, 15 percent by default.
    """

    gain: Annotated[Finite, Doc("Felt distance from the middle of the range, as a multiple of the true one.")] = 0.7

    def build(self, context: BuildContext) -> JointGain:
        """The damage."""
        return JointGain(context.arm, self.gain)


class JointOrder(NoIntervention):
    """Joints of the arm are felt in each other's places.

    What is felt of joint k is where joint `order[k]` is in its range, put into the range of joint k. It changes the
    sensed arm posture and the efference copy of the arm command alike. All information is kept.

    Args:
        arm: the arm's joints.
        order: for each joint the one that is felt in its place, (n_arm,).

    Example:
        >>> arm, zero = JointGroup(("a", "b"), np.zeros(2), np.array([1.0, 10.0]), np.ones(2)), np.zeros(2)
        >>> swapped = JointOrder(arm, [1, 0])
        >>> swapped.sense(Percept(0.0, np.array([0.25, 9.0]), zero, zero, zero), np.random.default_rng()).arm
        array([0.9, 2.5])
    """

    def __init__(self, arm: JointGroup, order: Sequence[int]) -> None:
        self._lower, self._span, self._order = arm.lower, arm.upper - arm.lower, np.array(order, np.int64)

    def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
        """The percept with the joints of both arm vectors in another order."""
        return replace(percept, arm=self._felt(percept.arm), arm_command=self._felt(percept.arm_command))

    def _felt(self, arm: Floats) -> Floats:
        return self._lower + self._span * ((arm - self._lower) / self._span)[self._order]


@dataclass(frozen=True)
class Swapped(Settings):
    """Two joints of the arm are felt in each other's places, each value as a share of its joint's range.

    Severity: how far a joint is felt aside depends on the posture, by a third of the range in the mean of uniform ones.
    """

    joints: Annotated[tuple[Joint, Joint], Doc("Two joints, by names or by numbers from 0 on.")] = (0, 1)

    def build(self, context: BuildContext) -> JointOrder:
        """The damage.

        Raises:
            ValueError: the arm lacks one of them, or both are the same.
        """
        first, second = _several(context.arm, self.joints)
        order = list(range(len(context.arm)))
        order[first], order[second] = second, first
        return JointOrder(context.arm, order)


@dataclass(frozen=True)
class Permuted(Settings):
    """All joints of the arm are felt in each other's places, each value as a share of its joint's range.

    Severity: as with two that are swapped, but in every joint. By default the first joint is felt in the place of the
    last, and every other one in the place of the one before it.
    """

    order: Annotated[
        tuple[Joint, ...],
        Doc("The joints in the order in which they are felt, by names or numbers; each moves up one place if none."),
    ] = ()

    def build(self, context: BuildContext) -> JointOrder:
        """The damage.

        Raises:
            ValueError: the arm has one joint only, or the order is not one of all its joints.
        """
        arm = context.arm
        order = _several(arm, self.order or (*range(1, len(arm)), 0))
        if len(order) != len(arm):
            raise ValueError(f"order names {len(order)} joints; name all that the arm has: {', '.join(arm.names)}")
        return JointOrder(arm, order)


def _several(arm: JointGroup, joints: Sequence[Joint]) -> list[int]:
    """Places of joints that are to change them, each named once."""
    if len(arm) < 2:
        raise ValueError(
            f"joints change places only where an arm has two or more, and this one has {arm.names[0]} alone; "
            "choose another damage, such as gain or dead-joint"
        )
    found = numbered(arm, joints)
    if len(set(found)) < len(found):
        raise ValueError(f"the joints {list(joints)} name one twice; name different ones of {', '.join(arm.names)}")
    return found


class DeadJoint(NoIntervention):
    """The sensor of one joint of the arm is stuck: it goes on to say what it said when the damage came.

    The joint moves as before. Posture and efference copy both have the stuck value, so that all information about this
    joint is lost.

    Args:
        joint: place of the joint in the arm's vectors.

    Example:
        >>> damage, zero, rng = DeadJoint(1), np.zeros(2), np.random.default_rng()
        >>> for arm in ([0.1, 0.2], [0.3, 0.4]):
        ...     felt = damage.sense(Percept(0.0, np.array(arm), zero, np.ones(2), zero), rng)
        >>> felt.arm, felt.arm_command
        (array([0.3, 0.2]), array([1. , 0.2]))
    """

    def __init__(self, joint: int) -> None:
        self._joint, self._stuck = joint, nan

    def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
        """The percept with the stuck value in both arm vectors."""
        if isnan(self._stuck):
            self._stuck = float(percept.arm[self._joint])
        return replace(percept, arm=self._felt(percept.arm), arm_command=self._felt(percept.arm_command))

    def _felt(self, arm: Floats) -> Floats:
        felt = np.array(arm)
        felt[self._joint] = self._stuck
        return felt

    def state(self) -> dict[str, Any]:
        """The stuck value, rad or m; NaN before the first frame."""
        return {"stuck": self._stuck}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from `state`."""
        self._stuck = float(state["stuck"])


@dataclass(frozen=True)
class Dead(Settings):
    """The sensor of one joint is stuck where it was when the damage came; the joint itself still moves.

    Severity: nothing is known of this joint any more, neither by its posture nor by its command.
    """

    joint: Annotated[Joint, Doc("The joint, by its name or its number from 0 on.")] = 0

    def build(self, context: BuildContext) -> DeadJoint:
        """The damage.

        Raises:
            ValueError: the arm has no such joint.
        """
        return DeadJoint(numbered(context.arm, [self.joint])[0])


class EncoderNoise(NoIntervention):
    """Normal noise on the sensed arm posture, drawn anew in each frame and for each joint.

    The efference copy stays as it is: the target of a movement is a command, which no encoder measures.

    Args:
        deviation: standard deviation, one a joint, shape (n_arm,), or one for all, rad, or m of a slide.

    Example:
        >>> zero = np.zeros(2)
        >>> felt = EncoderNoise([0.1, 0.0]).sense(Percept(0.0, zero, zero, zero, zero), np.random.default_rng(1))
        >>> felt.arm.round(3), felt.arm_command
        (array([0.035, 0.   ]), array([0., 0.]))
    """

    def __init__(self, deviation: ArrayLike) -> None:
        self._deviation = np.array(deviation, float)

    def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
        """The percept with noise on the posture."""
        return replace(percept, arm=percept.arm + rng.normal(0.0, 1.0, len(percept.arm)) * self._deviation)


@dataclass(frozen=True)
class Noise(Settings):
    """Normal noise on the sensed arm posture, not on the efference copy of the command, anew in each frame.

    Severity: differences between postures below the deviation are lost in a single frame, and come back in the mean of
    many.
    """

    deviation: Annotated[
        tuple[Annotated[float, Ge(0)], ...] | Annotated[float, Ge(0)],
        Doc("Standard deviation, rad; of a slide, as a share of its range. One for all joints, or one a joint."),
    ] = 0.05

    def build(self, context: BuildContext) -> EncoderNoise:
        """The damage.

        Raises:
            ValueError: deviations of another number than the arm has joints.
        """
        arm = context.arm
        if isinstance(self.deviation, tuple) and len(self.deviation) != len(arm):
            raise ValueError(
                f"{len(self.deviation)} deviations; write one for all joints, such as deviation = 0.05, or one for "
                f"each of {', '.join(arm.names)}"
            )
        return EncoderNoise(np.array(self.deviation) * scale(arm))
