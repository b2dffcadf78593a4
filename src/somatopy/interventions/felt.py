"""Damages to the arm's sense: scaled angles, exchanged joints, a stuck sensor, and noise."""

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
    """Scales what is felt of each arm joint: its distance from the middle of the range is multiplied by `gain`.

    It changes the sensed arm posture and the efference copy of the arm's command in the same way, and clips nothing.
    All information is kept, unless the gain is 0.

    Args:
        arm: the arm's joints.
        gain: the factor; 1 changes nothing.

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
    """Scales what is felt of the arm's joints: they seem nearer to the middle of their ranges, or farther from it.

    Severity: at the ends of its range a joint is felt (1 - gain) / 2 of the range away from its true angle, 15 percent
    by default.
    """

    gain: Annotated[Finite, Doc("Felt distance from the middle of the range, as a multiple of the true one.")] = 0.7

    def build(self, context: BuildContext) -> JointGain:
        """The damage."""
        return JointGain(context.arm, self.gain)


class JointOrder(NoIntervention):
    """Exchanges what is felt of the arm's joints.

    In the place of joint k the learner feels joint `order[k]`: its position within its own range, converted to the
    range of joint k. This changes the sensed arm posture and the efference copy of the arm's command in the same way.
    All information is kept.

    Args:
        arm: the arm's joints.
        order: for each joint, the index of the joint that is felt in its place, shape (n_arm,).

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
    """Exchanges what is felt of two arm joints, each value as a share of its joint's range.

    Severity: on average over uniform postures, a joint is felt a third of its range away from its true angle.
    """

    joints: Annotated[tuple[Joint, Joint], Doc("Two joints, by names or by numbers from 0 on.")] = (0, 1)

    def build(self, context: BuildContext) -> JointOrder:
        """The damage.

        Raises:
            ValueError: the arm has no such joint, or both are the same.
        """
        first, second = _several(context.arm, self.joints)
        order = list(range(len(context.arm)))
        order[first], order[second] = second, first
        return JointOrder(context.arm, order)


@dataclass(frozen=True)
class Permuted(Settings):
    """Exchanges what is felt of all arm joints, each value as a share of its joint's range.

    Severity: as with two swapped joints, but in every joint. By default the first joint is felt in the place of the
    last, and every other joint in the place of the one before it.
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
    """Makes the sensor of one arm joint stick: it keeps the value that it had when the damage began.

    The joint itself still moves. The sensed posture and the efference copy both have the stuck value, so that all
    information about this joint is lost.

    Args:
        joint: index of the joint in the arm's vectors.

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
    """Makes the sensor of one joint stick at the value that it had when the damage began. The joint still moves.

    Severity: nothing is known about this joint any more, neither from its posture nor from its command.
    """

    joint: Annotated[Joint, Doc("The joint, by its name or its number from 0 on.")] = 0

    def build(self, context: BuildContext) -> DeadJoint:
        """The damage.

        Raises:
            ValueError: the arm has no such joint.
        """
        return DeadJoint(numbered(context.arm, [self.joint])[0])


class EncoderNoise(NoIntervention):
    """Adds normal noise to the sensed arm posture, drawn anew in each frame and for each joint.

    The efference copy stays as it is, since no encoder measures a command.

    Args:
        deviation: standard deviation, one for each joint, shape (n_arm,), or one for all; rad, or m for a slide.

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
    """Adds normal noise to the sensed arm posture in each frame, but not to the efference copy of the command.

    Severity: in a single frame, differences between postures that are smaller than the deviation are lost. The mean of
    many frames still shows them.
    """

    deviation: Annotated[
        tuple[Annotated[Finite, Ge(0)], ...] | Annotated[Finite, Ge(0)],
        Doc("Standard deviation, rad; of a slide, as a share of its range. One for all joints, or one a joint."),
    ] = 0.05

    def build(self, context: BuildContext) -> EncoderNoise:
        """The damage.

        Raises:
            ValueError: the number of deviations is not the number of the arm's joints.
        """
        arm = context.arm
        if isinstance(self.deviation, tuple) and len(self.deviation) != len(arm):
            raise ValueError(
                f"{len(self.deviation)} deviations; write one for all joints, such as deviation = 0.05, or one for "
                f"each of {', '.join(arm.names)}"
            )
        return EncoderNoise(np.array(self.deviation) * scale(arm))
