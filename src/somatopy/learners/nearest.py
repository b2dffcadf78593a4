"""Control: one nearest neighbour over every hit that was ever seen."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import KDTree

from somatopy.learners.base import Plastic, Scale
from somatopy.percept import Floats, Percept, Robot

__all__ = ["NearestGaze"]


class NearestGaze(Plastic):
    """Control: the head posture of the nearest arm posture at which the hand was seen, all hits remembered.

    There is no map and no generalisation: this is what a table of experience alone is worth. A k-d tree is built anew
    whenever memory has grown by a quarter; what came since is searched one by one. Before the first hit it looks at
    random postures.

    Args:
        robot: its arm's limits scale distances to [0, 1] units; its head is moved.
        rng: random numbers for the time before the first hit.

    Example:
        >>> from somatopy.percept import Camera, Sighting, Space
        >>> shoulder, head = Space(("shoulder",), [-2], [2]), Space(("yaw", "pitch"), [-2, -0.6], [2, 0.5])
        >>> robot = Robot({"arm": shoulder, "head": head}, ("head",), Camera("eye", 320, 240, fovy=0.83))
        >>> control = NearestGaze(robot, np.random.default_rng(0))
        >>> arm, head = np.array([0.5]), np.array([0.3, 0.1])
        >>> control.observe(Percept(0.0, arm, head, arm, head, Sighting((159.5, 119.5), tag=0, area=900.0)))
        >>> control.predict([0.4])
        array([0.3, 0.1])
    """

    parts = frozenset({"memory"})
    _LOOSE = 256

    def __init__(self, robot: Robot, rng: np.random.Generator) -> None:
        self._scale = Scale(robot.arm.limits)
        self._head_limits = robot.head.limits
        self._rng = rng
        self._restart(np.empty((0, len(self._scale.low))), np.empty((0, len(self._head_limits))))

    def _restart(self, arms: Floats, heads: Floats) -> None:
        """Take these hits over, all of them in the tree."""
        self._count = self._planted = len(arms)
        self._arms, self._heads = np.repeat(arms, 2, axis=0), np.repeat(heads, 2, axis=0)
        self._arms[: self._count], self._heads[: self._count] = arms, heads
        self._tree = KDTree(arms) if self._planted else None

    def observe(self, percept: Percept) -> None:
        """Remember the frame if the hand was seen."""
        if percept.sighting is None or "memory" not in self.plastic:
            return
        if self._count - self._planted >= self._LOOSE + self._planted // 4:
            self._restart(self._arms[: self._count].copy(), self._heads[: self._count].copy())
        if self._count == len(self._arms):
            self._arms, self._heads = (
                np.resize(a, (2 * self._count + 64, a.shape[1])) for a in (self._arms, self._heads)
            )
        self._arms[self._count] = self._scale.to_unit(percept.arm)
        self._heads[self._count] = percept.head
        self._count += 1

    def gaze(self, percept: Percept) -> Floats:
        """The head posture of the nearest hit, or a random one."""
        if not self._count:
            return self._rng.uniform(self._head_limits[:, 0], self._head_limits[:, 1])
        return self.predict(percept.arm)

    def predict(self, arm: ArrayLike) -> Floats:
        """The head posture of the nearest hit, or the middle of the range before the first."""
        if not self._count:
            return np.asarray(self._head_limits.mean(axis=1))
        x = self._scale.to_unit(arm)
        best, least = -1, np.inf
        if self._tree is not None:
            least, best = self._tree.query(x)
        if self._planted < self._count:
            distances = np.linalg.norm(self._arms[self._planted : self._count] - x, axis=1)
            if distances.min() < least:
                best = self._planted + int(distances.argmin())
        return np.array(self._heads[best])

    def state(self) -> dict[str, Any]:
        """All hits, and the generator."""
        return {
            "arms": self._arms[: self._count].copy(),
            "heads": self._heads[: self._count].copy(),
            "planted": self._planted,
            "rng": self._rng.bit_generator.state,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from `state`."""
        arms, heads, planted = np.array(state["arms"]), np.array(state["heads"]), int(state["planted"])
        self._restart(arms[:planted], heads[:planted])
        self._arms, self._heads, self._count = arms, heads, len(arms)
        self._rng.bit_generator.state = state["rng"]
