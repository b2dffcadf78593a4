"""MuJoCo's own defaults, for what is added to a model: the model's default classes must not change it.

A model in which all meshes are scaled by 0.001, or all shapes are invisible unless they say otherwise, would else do
the same to what is added. `body.add_geom(PLAIN, ...)` and its like take these defaults instead of the model's.
"""

from __future__ import annotations

import mujoco

__all__ = ["PLAIN"]

_EMPTY = mujoco.MjSpec()  # kept, as its defaults live no longer than it

PLAIN = _EMPTY.default
