"""Imports MuJoCo where its own import fails: when MUJOCO_GL names an OpenGL library that this machine lacks.

With MuJoCo imported, everything that needs no pictures works. What needs pictures can say which library to install.
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
