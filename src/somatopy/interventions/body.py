"""Damages to the body, which change what it can see: a turned camera, a moved marker, a longer arm."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import radians
from typing import Annotated

from annotated_types import Le
from typing_extensions import Doc

from somatopy.contract import Alterable, Stage
from somatopy.interventions.base import NoIntervention
from somatopy.registry import BuildContext, Finite, Positive, Settings

__all__ = ["AlteredBody", "LongerArm", "MovedMarker", "TurnedCamera"]


class AlteredBody(NoIntervention):
    """Base class of interventions that change the body for the length of a phase. Derive from it and write `alter`.

    Raises:
        ValueError: on `check`, if the body has no model of itself that can be changed.
    """

    alters_ceiling = True

    def __init__(self) -> None:
        self._undo: Callable[[], None] | None = None

    def alter(self, body: Alterable) -> Callable[[], None]:
        """Change the body. Returns a function that undoes the change."""
        raise NotImplementedError(f"{type(self).__qualname__} has no alter(body)")

    def check(self, stage: Stage) -> None:
        """Check that the body can be changed in this way, by changing it and undoing the change."""
        body = stage.body
        if not isinstance(body, Alterable):
            raise ValueError(
                f"the body {type(body).__name__} has no model of itself that can be changed (turn_camera, move_marker, "
                "stretch_arm, pace_arm); choose a damage of what is sensed, such as offset or gain"
            )
        self.alter(body)()

    def hold(self, stage: Stage) -> None:
        """Change the body."""
        if isinstance(stage.body, Alterable):
            self._undo = self.alter(stage.body)

    def release(self, stage: Stage) -> None:
        """Undo the change."""
        if self._undo is not None:
            self._undo()
            self._undo = None


class TurnedCamera(AlteredBody):
    """Turns the camera in the head, as a blow might. All information is kept.

    Args:
        tilt: how much further up the camera looks, degrees.
        roll: how far the camera is turned about its line of sight, degrees.

    Example:
        >>> damage = TurnedCamera(tilt=10)
        >>> damage.alters_ceiling, damage.moves_arm
        (True, False)
    """

    def __init__(self, tilt: float = 0.0, roll: float = 0.0) -> None:
        super().__init__()
        self._tilt, self._roll = radians(tilt), radians(roll)

    def alter(self, body: Alterable) -> Callable[[], None]:
        """Turn the camera."""
        return body.turn_camera(self._tilt, self._roll)


@dataclass(frozen=True)
class CameraTurn(Settings):
    """Turns the camera in the head: it is tilted up or down, or rolled about its line of sight.

    Severity: 10 degrees of tilt are a fifth of the picture's height with a NAO's camera.
    """

    tilt: Annotated[Finite, Doc("How much further up the camera looks, degrees.")] = 10.0
    roll: Annotated[Finite, Doc("By how much it is turned about its line of sight, degrees.")] = 0.0

    def build(self, context: BuildContext) -> TurnedCamera:
        """The damage."""
        return TurnedCamera(self.tilt, self.roll)


class MovedMarker(AlteredBody):
    """Moves the marker along its axis, as if the hand held a tool. All information is kept.

    Args:
        by: how far, m.

    Example:
        >>> MovedMarker(0.05).alters_ceiling
        True
    """

    def __init__(self, by: float) -> None:
        super().__init__()
        self._by = by

    def alter(self, body: Alterable) -> Callable[[], None]:
        """Move the marker."""
        return body.move_marker(self._by)


@dataclass(frozen=True)
class MarkerMoved(Settings):
    """Moves the marker along its axis, as if the hand held a tool.

    Severity: 5 cm are an edge of the cube, and 15 cm are more than the forearm of a NAO.
    """

    by: Annotated[Finite, Doc("How far along its axis, m; a negative number moves it back.")] = 0.05

    def build(self, context: BuildContext) -> MovedMarker:
        """The damage."""
        return MovedMarker(self.by)


class LongerArm(AlteredBody):
    """Makes the links of the arm, up to the marker, longer or shorter, as growth does. All information is kept.

    The same commands then lead to other movements, and the phase has its own ceiling.

    Args:
        factor: lengths are multiplied by this number.

    Example:
        >>> LongerArm(1.2).alters_ceiling, LongerArm(1.2).moves_arm
        (True, True)
    """

    moves_arm = True

    def __init__(self, factor: float) -> None:
        super().__init__()
        self._factor = factor

    def alter(self, body: Alterable) -> Callable[[], None]:
        """Stretch the arm."""
        return body.stretch_arm(self._factor)


@dataclass(frozen=True)
class Longer(Settings):
    """Makes the links of the arm, up to the marker, longer: by 20 percent unless a factor is given.

    Severity: the hand is up to 20 percent of the arm's length away from where it was in the same posture.
    """

    factor: Annotated[Positive, Le(100), Doc("By how much lengths are multiplied, at most 100; masses stay.")] = 1.2

    def build(self, context: BuildContext) -> LongerArm:
        """The damage."""
        return LongerArm(self.factor)
