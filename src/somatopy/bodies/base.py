"""What goes wrong between a body's description and its model, and in its physics."""

from __future__ import annotations

__all__ = ["BodyError", "Diverged"]


class BodyError(ValueError):
    """A body's description does not fit its model: the message names what is missing and what there is."""


class Diverged(RuntimeError):
    """The physics of a body became unstable: the message names the joint, the time, and what to try.

    The body stands as it stood before the step that raised it.
    """
