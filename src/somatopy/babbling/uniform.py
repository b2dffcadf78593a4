"""Motor babbling to uniform random targets at constant joint speed, the paper's exploration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike
from typing_extensions import Doc

from somatopy.percept import Floats, JointGroup
from somatopy.registry import BuildContext, Finite, Positive, Settings

__all__ = ["Uniform", "UniformBabbler", "check_bounds"]


class UniformBabbler:
    """Moves the arm to one uniform random target after another, at constant joint speed.

    "Random motor commands of its arm sampled from uniform random distributions within its arm joints ranges"
    (Schillaci, Hafner and Lara 2014, section III). A new target is drawn when set-points of constant speed must have
    reached the last one in all joints. The babbler goes by the clock alone, and never looks at the arm.

    Args:
        arm: the joints. Targets must lie inside their limits.
        bounds: low and high of each joint, shape (n_arm, 2), rad.
        speed: speed of the set-points, rad/s. A joint with a lower velocity limit moves at its limit.
        start: the set-points at time 0, shape (n_arm,), rad.
        rng: the babbler's own random numbers.

    Raises:
        ValueError: bounds of wrong shape, outside the joint limits or with low above high; a speed that is not
            positive.

    Example:
        >>> arm = JointGroup(("a", "b"), np.array([-1.0, -1.0]), np.array([1.0, 1.0]), np.array([8.0, 8.0]))
        >>> babbler = UniformBabbler(arm, [[-1, 1], [0, 1]], speed=0.5, start=[0, 0], rng=np.random.default_rng(1))
        >>> babbler.command(0.0).round(3)
        array([0.024, 0.95 ])
        >>> bool((babbler.command(1.0) == babbler.command(1.5)).all())
        True
    """

    def __init__(
        self, arm: JointGroup, bounds: ArrayLike, speed: float, start: ArrayLike, rng: np.random.Generator
    ) -> None:
        self.bounds = check_bounds(bounds, arm)
        if not 0 < speed < np.inf:
            raise ValueError(f"The babbling speed must be a positive number of rad/s, not {speed!r}.")
        self._speed = np.minimum(speed, arm.velocity)
        self._rng = rng
        self._target = np.array(start, float)
        self._until = 0.0

    def command(self, time: float) -> Floats:
        """Final target of the movement under way at `time` (s), shape (n_arm,), rad."""
        if time >= self._until - 1e-9:
            before = self._target
            self._target = self._rng.uniform(self.bounds[:, 0], self.bounds[:, 1])
            self._until = max(time, self._until) + float((np.abs(self._target - before) / self._speed).max())
        return self._target.copy()

    def state(self) -> dict[str, Any]:
        """Target, end of the movement and generator."""
        return {"target": self._target.copy(), "until": self._until, "rng": self._rng.bit_generator.state}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from `state`."""
        self._target = np.array(state["target"], float)
        self._until = float(state["until"])
        self._rng.bit_generator.state = state["rng"]


def check_bounds(bounds: ArrayLike, arm: JointGroup) -> Floats:
    """`bounds` as an array (n_arm, 2) inside the joint limits, or a ValueError that names the joint."""
    array = np.array(bounds, float)
    if array.shape != (len(arm), 2):
        raise ValueError(
            f"A range needs [low, high] for each of {', '.join(arm.names)}; its shape is {array.shape}. "
            'Give as many, or name a range of the body: babbling.range = "mechanical", or "confined" for a robot with '
            "a MuJoCo model."
        )
    for name, (low, high), lower, upper, unit in zip(arm.names, array, arm.lower, arm.upper, arm.units, strict=True):
        if low > high:
            raise ValueError(f"The range [{low:g}, {high:g}] of {name} must have its low end first.")
        if not lower - 1e-4 <= low <= high <= upper + 1e-4:
            raise ValueError(
                f"The range [{low:g}, {high:g}] of {name} must lie inside its limits [{lower:.4f}, {upper:.4f}] "
                f'{unit}. Give others, or name a range of the body: babbling.range = "mechanical".'
            )
    return np.asarray(np.clip(array, arm.lower[:, None], arm.upper[:, None]))


@dataclass(frozen=True)
class Uniform(Settings):
    """Motor babbling to uniform random targets."""

    range: Annotated[
        str | tuple[tuple[Finite, Finite], ...],
        Doc("A range that the body names, or low and high of each arm joint, rad, or m of a slide."),
    ] = "mechanical"
    speed: Annotated[Positive, Doc("Speed of the arm's set-points, rad/s, or m/s of a slide.")] = 0.8

    def build(self, context: BuildContext) -> UniformBabbler:
        """The babbler, from the arm's posture at time 0.

        Raises:
            ValueError: the body has no range of that name, or the range does not fit the arm.
        """
        bounds = self.range if isinstance(self.range, tuple) else context.range(self.range)
        return UniformBabbler(context.arm, bounds, self.speed, context.start, context.rng)
