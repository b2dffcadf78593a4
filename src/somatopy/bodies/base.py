"""The Body contract: what any robot, simulated, recorded or real, offers to an experiment."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

from numpy.typing import ArrayLike

from somatopy.percept import Camera, JointGroup, Marker, Reading

__all__ = ["Body", "BodyError"]


class BodyError(ValueError):
    """A body's description does not fit its model: the message names what is missing and what there is."""


@runtime_checkable
class Body(Protocol):
    """A robot with an arm, a head with a camera in it, and a marker on its hand.

    `arm`, `head`, `camera` and `marker` are readable while disconnected. Only the body clips commands: to position
    and velocity limits and to limits that couple joints. One `step` lasts one frame.
    """

    arm: JointGroup
    head: JointGroup
    camera: Camera
    marker: Marker

    def reset(self, seed: int | None = None) -> Reading:
        """Go to the start posture; `seed` is for bodies with noise of their own."""
        ...

    def step(self, arm: ArrayLike, head: ArrayLike) -> Reading:
        """Move towards the targets, (n_arm,) and (n_head,) rad, for one frame, and sense."""
        ...

    def state(self) -> dict[str, Any]:
        """All that a bit-exact continuation needs."""
        ...

    def restore(self, state: dict[str, Any]) -> Reading:
        """Continue from `state`; returns the reading of that moment."""
        ...

    def close(self) -> None:
        """Release renderer and connections; a second call does nothing."""
        ...
