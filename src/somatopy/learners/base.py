"""What learners share: parts that learn or not, and joint angles in units of their range."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from somatopy.percept import Column, Floats

__all__ = ["Plastic", "Scale"]


class Plastic:
    """Parts that learn, or not; derive from it, and it gives a learner all that a simple one leaves away.

    It has no columns and no maps of its own, and its `plastic` refuses what is none of its `parts`.
    """

    #: The parts of this kind of learner that can learn.
    parts: frozenset[str] = frozenset()
    columns: Sequence[Column] = ()
    _plastic: frozenset[str] | None = None

    @property
    def plastic(self) -> frozenset[str]:
        """The parts that learn now, all of them at first.

        Raises:
            ValueError: on setting, if a name is none of `parts`.
        """
        return self.parts if self._plastic is None else self._plastic

    @plastic.setter
    def plastic(self, parts: Iterable[str]) -> None:
        wanted = frozenset(parts)
        if unknown := sorted(wanted - self.parts):
            known = ", ".join(sorted(self.parts)) or "none"
            raise ValueError(f"This learner has no part {unknown[0]!r} that learns; its parts: {known}.")
        self._plastic = wanted

    def probes(self) -> Mapping[str, float]:
        """None."""
        return {}

    def maps(self) -> dict[str, Any]:
        """None."""
        return {}


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
        """Shape (n,), rad, to [0, 1] units; or of several postures, shape (m, n).

        Raises:
            ValueError: another number of angles.
        """
        given = np.asarray(angles, float)
        if given.shape[-1:] != self.low.shape:
            raise ValueError(f"A posture of {len(self.low)} joints is needed; got an array of shape {given.shape}.")
        units: Floats = (given - self.low) / self.span
        return units

    def to_angle(self, units: ArrayLike) -> Floats:
        """[0, 1] units, shape (n,), to rad."""
        angles: Floats = self.low + np.asarray(units, float) * self.span
        return angles
