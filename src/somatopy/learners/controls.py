"""Controls: what is scored without learning."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from somatopy.learners.base import Plastic
from somatopy.percept import Floats, Percept

__all__ = ["FixedGaze", "RandomGaze"]


class _Unlearning(Plastic):
    """A learner that learns nothing and has nothing to record."""

    def observe(self, percept: Percept) -> None:
        """Learns nothing."""

    def probes(self) -> dict[str, float]:
        """None."""
        return {}

    def maps(self) -> dict[str, Any]:
        """None."""
        return {}


class RandomGaze(_Unlearning):
    """Looks at uniform random head postures, each held until reached or for one second.

    Args:
        head_limits: low and high of each head joint, shape (n_head, 2), rad.
        rng: the control's random numbers.

    Example:
        >>> control = RandomGaze([[-2, 2], [-0.6, 0.5]], np.random.default_rng(3))
        >>> zero = np.zeros(2)
        >>> control.gaze(Percept(0.0, zero, zero, zero, zero)).round(2)
        array([-1.66, -0.34])
    """

    HOLD = 1.0
    REACHED = 0.02

    def __init__(self, head_limits: ArrayLike, rng: np.random.Generator) -> None:
        self._limits = np.array(head_limits, float)
        self._rng = rng
        self._target: Floats = self._limits.mean(axis=1)
        self._since = -np.inf

    def gaze(self, percept: Percept) -> Floats:
        """The target under way, or a new one."""
        held = percept.time - self._since
        arrived = held > 0 and np.abs(percept.head - percept.head_command).max() < self.REACHED
        if arrived or held >= self.HOLD - 1e-9:
            self._target = self._rng.uniform(self._limits[:, 0], self._limits[:, 1])
            self._since = percept.time
        return self._target.copy()

    def predict(self, arm: ArrayLike) -> Floats:
        """The middle of the head's range, whatever the arm does."""
        return np.asarray(self._limits.mean(axis=1))

    def state(self) -> dict[str, Any]:
        """Target, its start and the generator."""
        return {"target": self._target.copy(), "since": self._since, "rng": self._rng.bit_generator.state}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from `state`."""
        self._target = np.array(state["target"], float)
        self._since = float(state["since"])
        self._rng.bit_generator.state = state["rng"]


class FixedGaze(_Unlearning):
    """Looks at one head posture for ever.

    Args:
        head: that posture, shape (n_head,), rad.

    Example:
        >>> FixedGaze([0.5, 0.2]).predict(arm=[0, 0, 0, 0])
        array([0.5, 0.2])
    """

    def __init__(self, head: ArrayLike) -> None:
        self._head = np.array(head, float)

    def gaze(self, percept: Percept) -> Floats:
        """The fixed posture."""
        return self._head.copy()

    def predict(self, arm: ArrayLike) -> Floats:
        """The fixed posture."""
        return self._head.copy()

    def state(self) -> dict[str, Any]:
        """Nothing changes."""
        return {}

    def restore(self, state: dict[str, Any]) -> None:
        """Nothing to restore."""
