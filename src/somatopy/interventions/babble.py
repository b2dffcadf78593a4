"""Interventions that change how the arm babbles: at another speed, or in another range."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Annotated, Any
from zlib import crc32

import numpy as np
from typing_extensions import Doc

from somatopy.contract import Alterable, Babbler, Stage
from somatopy.interventions.base import NoIntervention
from somatopy.percept import Floats, Percept
from somatopy.registry import BuildContext, Finite, Positive, Settings

__all__ = ["OtherBabbling"]


class OtherBabbling(NoIntervention):
    """Another babbler moves the arm for the length of a phase. No information is lost.

    The original babbler is still asked in each frame, but its targets are not used. After the phase the arm therefore
    moves as if the phase had not been. If the speed changes, the body must be able to pace its arm (`Alterable`).

    Args:
        babbler: the other babbler.
        pace: by how much the speed of the arm's set-points is multiplied.

    Example:
        >>> class Still:
        ...     def command(self, time): return np.array([0.5, 0.5])
        >>> damage, zero, rng = OtherBabbling(Still()), np.zeros(2), np.random.default_rng()
        >>> damage.act(zero, zero, rng)[0], damage.moves_arm
        (array([0.5, 0.5]), True)
    """

    moves_arm = True

    def __init__(self, babbler: Babbler, pace: float = 1.0) -> None:
        self._babbler, self._pace, self._time = babbler, pace, 0.0
        self._undo: Callable[[], None] | None = None

    def check(self, stage: Stage) -> None:
        """Check that the arm can be paced, if the speed changes."""
        if self._pace != 1 and not isinstance(stage.body, Alterable):
            raise ValueError(
                f"the arm of the body {type(stage.body).__name__} has a speed that cannot be changed (pace_arm); "
                "choose babbling-range or another damage"
            )

    def hold(self, stage: Stage) -> None:
        """Pace the arm."""
        if self._pace != 1 and isinstance(stage.body, Alterable):
            self._undo = stage.body.pace_arm(self._pace)

    def release(self, stage: Stage) -> None:
        """Undo that."""
        if self._undo is not None:
            self._undo()
            self._undo = None

    def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
        """The percept itself. Its time is kept for the babbler."""
        self._time = max(self._time, percept.time)
        return percept

    def act(self, target: Floats, gaze: Floats, rng: np.random.Generator) -> tuple[Floats, Floats]:
        """The other babbler's target."""
        return self._babbler.command(self._time), gaze

    def state(self) -> dict[str, Any]:
        """The babbler's state and the time, s."""
        return {"babbler": self._babbler.state(), "time": self._time}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from `state`."""
        self._babbler.restore(state["babbler"])
        self._time = float(state["time"])


@dataclass(frozen=True)
class ArmSpeed(Settings):
    """Changes the speed of the arm: both the babbler's movements and the arm's set-points are slower or faster.

    Severity: at half the speed there are half as many movements in the same time, and half the change from frame to
    frame.
    """

    factor: Annotated[Positive, Doc("By how much the speed is multiplied; joints keep their own limits.")] = 0.5

    def build(self, context: BuildContext) -> OtherBabbling:
        """The damage.

        Raises:
            ValueError: the babbling has no speed.
        """
        babbling = _with_settings(context, "speed")
        slower = babbling.replaced(speed=self.factor * babbling.speed)
        return OtherBabbling(_babbler(slower, context), self.factor)


@dataclass(frozen=True)
class BabblingRange(Settings):
    """Lets the arm babble in another range: a share of the original one about its middle, or one that is given.

    Severity: with a share of one half and four joints, a sixteenth of the postures is left. A wider range brings
    postures that the learner has never met.
    """

    range: Annotated[
        Positive | str | tuple[tuple[Finite, Finite], ...],
        Doc("A share of the babbling range, about its middle; or a range of the body; or [low, high] of each joint."),
    ] = 0.5

    def build(self, context: BuildContext) -> OtherBabbling:
        """The damage.

        Raises:
            ValueError: the babbling has no range, the body has none of that name, or the range does not fit the arm.
        """
        babbling = _with_settings(context, "range")
        new = self.range
        if isinstance(new, float | int):
            new = _share(context, babbling.range, new)
        return OtherBabbling(_babbler(babbling.replaced(range=new), context))


def _babbler(babbling: Settings, context: BuildContext) -> Any:
    """A babbler whose numbers depend on the seed alone, so that all learners of one seed meet the same movement."""
    sequence = np.random.SeedSequence(context.description.seed, spawn_key=(crc32(b"babbling otherwise"),))
    return babbling.build(context.told(rng=np.random.default_rng(sequence)))


def _with_settings(context: BuildContext, name: str) -> Any:
    """The settings of the experiment's babbling, which must have one of this name."""
    babbling = context.description.babbling
    if name not in {entry.name for entry in fields(babbling)}:
        raise ValueError(f"the babbling {babbling.kind!r} has no {name} that could be changed; choose another damage")
    return babbling


def _share(context: BuildContext, before: Any, share: float) -> tuple[tuple[float, float], ...]:
    """A range about the middle of another one, inside the joints' limits."""
    limits = context.range(before) if isinstance(before, str) else np.array(before, float)
    middle, half = limits.mean(axis=1), share * np.diff(limits, axis=1)[:, 0] / 2
    low, high = np.maximum(middle - half, context.arm.lower), np.minimum(middle + half, context.arm.upper)
    return tuple(zip(low.tolist(), high.tolist(), strict=True))
