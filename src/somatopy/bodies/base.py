"""Errors of bodies: a description that does not fit the model, and unstable physics."""

from __future__ import annotations

__all__ = ["BodyError", "Diverged"]


class BodyError(ValueError):
    """A body's description does not fit its model. The message names what is missing, and what there is."""


class Diverged(RuntimeError):
    """The physics of a body became unstable. The message names the joint, the time, and what to try.

    The body is as it was before the step that raised the error.
    """
