"""A damage that grows: an offset of the arm's sense that drifts."""

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
    """Adds an offset to the arm's sense. It is 0 when the damage begins, and grows linearly without end.

    The same offset is added to the sensed arm posture and to the efference copy of the arm's command. Nothing is
    clipped. In each frame all information is kept.

    Args:
        rate: how fast the offset of each joint grows, shape (n_arm,), rad/s, or m/s for a slide.

    Example:
        >>> damage, zero, rng = JointDrift([0.1, 0.0]), np.zeros(2), np.random.default_rng()
        >>> [damage.sense(Percept(time, zero, zero, zero, zero), rng).arm.tolist() for time in (7.0, 9.0)]
        [[0.0, 0.0], [0.2, 0.0]]
    """

    def __init__(self, rate: ArrayLike) -> None:
        self._rate = np.array(rate, float)
        self._since, self._passed = nan, 0.0

    def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
        """The percept with both arm vectors shifted by the present offset."""
        if isnan(self._since):
            self._since = percept.time
        self._passed = max(self._passed, percept.time - self._since)
        shift = self._rate * self._passed
        return replace(percept, arm=percept.arm + shift, arm_command=percept.arm_command + shift)

    def state(self) -> dict[str, Any]:
        """The time at which the drift began, s (NaN before the first frame), and for how long it has grown, s."""
        return {"since": self._since, "passed": self._passed}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from `state`."""
        self._since, self._passed = float(state["since"]), float(state["passed"])


@dataclass(frozen=True)
class Drift(Settings):
    """Shifts the arm's sense by an offset in a random direction, which grows with time.

    Severity: none in the first frame, `norm` after `minutes`, twice that after twice the time.
    """

    norm: Annotated[Positive, Doc("Length of the offset after that time, rad; a slide's range counts as 1 rad.")] = 1.0
    minutes: Annotated[Positive, Doc("How long it takes to grow so far, minutes of robot time.")] = 15.0
    draw: Annotated[int, Ge(0), Doc("Number of the random direction, which is the same for all learners.")] = 0

    def build(self, context: BuildContext) -> JointDrift:
        """The damage."""
        shift = drawn(context.arm, self.norm, context.description.seed, self.draw)
        return JointDrift(shift / (60 * self.minutes))
