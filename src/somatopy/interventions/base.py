"""An intervention that does nothing. Others derive from it, and override the methods that they need."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from somatopy.contract import Stage
from somatopy.percept import Column, Floats, Percept

__all__ = ["NoIntervention"]


class NoIntervention:
    """Leaves the experiment as it is. `somatopy.contract.Intervention` says what each method is for.

    Example:
        >>> class Dazed(NoIntervention):
        ...     '''The head goes only half of each way.'''
        ...     def act(self, target, gaze, rng):
        ...         return target, 0.5 * gaze
        >>> Dazed().act(np.zeros(4), np.array([1.0, 0.2]), np.random.default_rng())[1]
        array([0.5, 0.1])
    """

    alters_ceiling = False
    moves_arm = False
    columns: Sequence[Column] = ()
    remark = ""

    def check(self, stage: Stage) -> None:
        """Accepts every body and learner."""

    def begin(self, stage: Stage) -> None:
        """Changes nothing."""

    def hold(self, stage: Stage) -> None:
        """Changes nothing."""

    def release(self, stage: Stage) -> None:
        """Has nothing to undo."""

    def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
        """The percept itself."""
        return percept

    def act(self, target: Floats, gaze: Floats, rng: np.random.Generator) -> tuple[Floats, Floats]:
        """The commands themselves."""
        return target, gaze

    def probes(self) -> Mapping[str, float]:
        """None."""
        return {}

    def state(self) -> dict[str, Any]:
        """Nothing changes from frame to frame."""
        return {}

    def restore(self, state: dict[str, Any]) -> None:
        """There is nothing to restore."""
