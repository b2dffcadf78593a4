"""The Learner contract: percepts in, head postures out; it knows no robot."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from somatopy.percept import Floats, Percept

__all__ = ["Learner", "Plastic", "Scale"]


@runtime_checkable
class Learner(Protocol):
    """Learns online where to look.

    Attributes:
        plastic: the named parts that may learn now; settable at any time.
    """

    plastic: frozenset[str]

    def observe(self, percept: Percept) -> None:
        """Learn from this frame."""
        ...

    def gaze(self, percept: Percept) -> Floats:
        """The head posture to command in this frame, shape (n_head,), rad; may draw random numbers."""
        ...

    def predict(self, arm: ArrayLike) -> Floats:
        """Where it would look for this arm posture, shape (n_head,), rad. Pure: draws nothing, changes nothing."""
        ...

    def probes(self) -> dict[str, float]:
        """Figures of the last observed frame for the recorder, the same keys in every frame."""
        ...

    def maps(self) -> dict[str, Any]:
        """Arrays worth keeping at window ends, to show what was learned; {} if there are none."""
        ...

    def state(self) -> dict[str, Any]:
        """All that a bit-exact continuation needs, random numbers included."""
        ...

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from `state`."""
        ...


class Plastic:
    """Parts that learn, or not: gives a learner its `plastic`, which refuses what is no part of it."""

    #: The parts of this kind of learner that can learn.
    PARTS: frozenset[str] = frozenset()
    _plastic: frozenset[str] | None = None

    @property
    def plastic(self) -> frozenset[str]:
        """The parts that learn now, all of them at first.

        Raises:
            ValueError: on setting, if a name is none of `PARTS`.
        """
        return self.PARTS if self._plastic is None else self._plastic

    @plastic.setter
    def plastic(self, parts: Iterable[str]) -> None:
        wanted = frozenset(parts)
        if unknown := sorted(wanted - self.PARTS):
            known = ", ".join(sorted(self.PARTS)) or "none"
            raise ValueError(f"This learner has no part {unknown[0]!r} that learns; its parts: {known}.")
        self._plastic = wanted


class Scale:
    """Joint angles (rad) to [0, 1] by their limits, and back; a damaged posture may leave [0, 1].

    Args:
        limits: low and high of each joint, shape (n, 2), rad.

    Example:
        >>> scale = Scale([[-1.0, 1.0], [0.0, 4.0]])
        >>> scale.to_unit(np.array([0.0, 5.0]))
        array([0.5 , 1.25])
        >>> scale.to_angle(np.array([0.5, 1.25]))
        array([0., 5.])
    """

    def __init__(self, limits: ArrayLike) -> None:
        array = np.array(limits, float)
        if array.ndim != 2 or array.shape[1] != 2 or not (array[:, 0] < array[:, 1]).all():
            raise ValueError(f"Joint limits need shape (n, 2) with low below high, not {array.tolist()}.")
        self.low = array[:, 0].copy()
        self.span = array[:, 1] - array[:, 0]

    @property
    def limits(self) -> Floats:
        """Low and high of each joint, shape (n, 2), rad."""
        return np.column_stack([self.low, self.low + self.span])

    def to_unit(self, angles: ArrayLike) -> Floats:
        """Shape (n,), rad, to [0, 1] units."""
        return np.asarray((np.asarray(angles, float) - self.low) / self.span)

    def to_angle(self, units: ArrayLike) -> Floats:
        """[0, 1] units, shape (n,), to rad."""
        return np.asarray(self.low + np.asarray(units, float) * self.span)
