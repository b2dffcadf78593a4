"""Imports MuJoCo where its own import fails: when MUJOCO_GL names an OpenGL library that this machine lacks.

What needs no picture then works, and what needs one can say what to install.
"""

from __future__ import annotations

import os

try:
    import mujoco
except AttributeError:  # PyOpenGL's word for a missing library
    named = os.environ["MUJOCO_GL"]
    os.environ["MUJOCO_GL"] = "disable"
    import mujoco  # noqa: F401

    os.environ["MUJOCO_GL"] = named
