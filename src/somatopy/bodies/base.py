"""Errors of bodies: a description that does not fit the model, and unstable physics."""

from __future__ import annotations

__all__ = ["BodyError", "Diverged"]


class BodyError(ValueError):
    """A model and its anatomy do not fit each other. The message names what is missing, and what the model has."""


class Diverged(RuntimeError):
    """The physics of a body became unstable. The message names the joint, the time, and what to try.

    The body is then in the state that it had before the step that raised the error.
    """
