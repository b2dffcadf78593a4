"""Controls: what is scored without learning."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike
from typing_extensions import Doc

from somatopy.learners.base import Plastic
from somatopy.percept import Floats, Percept, Robot
from somatopy.registry import BuildContext, Finite, Settings

__all__ = ["Fixed", "FixedGaze", "RandomGaze"]


class _Unlearning(Plastic):
    """A learner that learns nothing."""

    def observe(self, percept: Percept) -> None:
        """Learns nothing."""


class RandomGaze(_Unlearning):
    """Control: uniform random head postures, each held until reached or for one second.

    Args:
        robot: its head is moved.
        rng: the control's random numbers.

    Example:
        >>> from somatopy.percept import Camera, Space
        >>> arm, head = Space(("shoulder", "elbow"), [-2, 0], [2, 1]), Space(("yaw", "pitch"), [-2, -0.6], [2, 0.5])
        >>> robot = Robot({"arm": arm, "head": head}, ("head",), Camera("eye", 320, 240, fovy=0.83))
        >>> control = RandomGaze(robot, np.random.default_rng(3))
        >>> zero = np.zeros(2)
        >>> control.gaze(Percept(0.0, zero, zero, zero, zero)).round(2)
        array([-1.66, -0.34])
    """

    HOLD = 1.0
    REACHED: ClassVar[Mapping[str, float]] = MappingProxyType({"rad": 0.02, "m": 0.002})

    def __init__(self, robot: Robot, rng: np.random.Generator) -> None:
        self._limits = robot.head.limits
        self._reached = np.array([self.REACHED.get(unit, self.REACHED["rad"]) for unit in robot.head.units])
        self._rng = rng
        self._target: Floats = self._limits.mean(axis=1)
        self._since = -np.inf

    def gaze(self, percept: Percept) -> Floats:
        """The target under way, or a new one."""
        held = percept.time - self._since
        arrived = held > 0 and bool((np.abs(percept.head - percept.head_command) < self._reached).all())
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
    """Control: one head posture for ever.

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


@dataclass(frozen=True)
class Fixed(Settings):
    """Control: one head posture for ever."""

    head: Annotated[
        tuple[Finite, ...] | None,
        Doc("That posture, rad, or m of a slide; if none, the one that sees the hand most often while babbling."),
    ] = None

    def build(self, context: BuildContext) -> FixedGaze:
        """The control.

        Raises:
            ValueError: the posture does not fit the head, or the body cannot tell the best one.
        """
        if self.head is None:
            return FixedGaze(context.best_fixed_head())
        space = context.robot.head
        if len(self.head) != len(space):
            raise ValueError(
                f"head has {len(self.head)} angles; there are {len(space)} joints: {', '.join(space.names)}"
            )
        for name, angle, (low, high), unit in zip(space.names, self.head, space.limits, space.units, strict=True):
            if not low <= angle <= high:
                raise ValueError(f"head: {name} = {angle:g} lies outside its limits [{low:.4f}, {high:.4f}] {unit}")
        return FixedGaze(self.head)
