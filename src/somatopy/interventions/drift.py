"""A damage that grows: what is sensed of the arm wanders off."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isnan, nan
from typing import Annotated, Any

import numpy as np
from annotated_types import Ge
from numpy.typing import ArrayLike
from typing_extensions import Doc

from somatopy.interventions.base import NoIntervention
from somatopy.interventions.joints import drawn
from somatopy.percept import Percept
from somatopy.registry import BuildContext, Positive, Settings

__all__ = ["JointDrift"]


class JointDrift(NoIntervention):
    """An offset of the arm that grows linearly from the damage on, without end.

    It is added to the sensed arm posture and to the efference copy of the arm command alike, and nothing is clipped. In
    each frame all information is kept.

    Args:
        rate: how fast it grows, one a joint, shape (n_arm,), rad/s, or m/s of a slide.

    Example:
        >>> damage, zero, rng = JointDrift([0.1, 0.0]), np.zeros(2), np.random.default_rng()
        >>> [damage.sense(Percept(time, zero, zero, zero, zero), rng).arm.tolist() for time in (7.0, 9.0)]
        [[0.0, 0.0], [0.2, 0.0]]
    """

    def __init__(self, rate: ArrayLike) -> None:
        self._rate = np.array(rate, float)
        self._since, self._passed = nan, 0.0

    def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
        """The percept with both arm vectors shifted by what has come together so far; time never goes back."""
        if isnan(self._since):
            self._since = percept.time
        self._passed = max(self._passed, percept.time - self._since)
        shift = self._rate * self._passed
        return replace(percept, arm=percept.arm + shift, arm_command=percept.arm_command + shift)

    def state(self) -> dict[str, Any]:
        """When it began, s, NaN before the first frame, and how long it has grown, s."""
        return {"since": self._since, "passed": self._passed}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from `state`."""
        self._since, self._passed = float(state["since"]), float(state["passed"])


@dataclass(frozen=True)
class Drift(Settings):
    """An offset of the sensed arm and of the efference copy that grows with time, in a direction drawn at random.

    Severity: none in the first frame, `norm` after `minutes`, twice that after as long again.
    """

    norm: Annotated[Positive, Doc("Length of the offset after that time, rad; a slide's range counts as 1 rad.")] = 1.0
    minutes: Annotated[Positive, Doc("How long it takes to grow so far, minutes of robot time.")] = 15.0
    draw: Annotated[int, Ge(0), Doc("Which direction: another number, another one; the same for each learner.")] = 0

    def build(self, context: BuildContext) -> JointDrift:
        """The damage."""
        shift = drawn(context.arm, self.norm, context.description.seed, self.draw)
        return JointDrift(shift / (60 * self.minutes))
