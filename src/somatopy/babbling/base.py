"""The Babbler contract: arm movements that depend on nothing but time and the babbler's own random numbers."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

from somatopy.percept import Floats

__all__ = ["Babbler"]


@runtime_checkable
class Babbler(Protocol):
    """Says where the arm should go. Open loop, so that one seed gives every learner the same arm movement."""

    def command(self, time: float) -> Floats:
        """Final target of the movement under way at `time` (s, never decreasing), shape (n_arm,), rad."""
        ...

    def state(self) -> dict[str, Any]:
        """All that a bit-exact continuation needs, random numbers included."""
        ...

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from `state`."""
        ...
