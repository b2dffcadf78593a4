"""Offscreen pictures of a MuJoCo model by software OpenGL: EGL, else OSMesa."""

from __future__ import annotations

import importlib
import os
import sys
from functools import cache
from typing import Any

import mujoco
import numpy as np

from somatopy.percept import Image

__all__ = ["NoGL", "Renderer", "gl_backend"]

_BACKENDS = ("egl", "osmesa")


class NoGL(RuntimeError):
    """No OpenGL library on this machine can draw without a screen."""


def _forget_opengl() -> None:
    """PyOpenGL binds itself to one platform when imported; a second try needs a fresh import."""
    os.environ.pop("PYOPENGL_PLATFORM", None)
    for name in list(sys.modules):
        if name.partition(".")[0] == "OpenGL" or name.startswith(("mujoco.egl", "mujoco.osmesa")):
            del sys.modules[name]


@cache
def _context_class() -> tuple[str, Any]:
    os.environ.setdefault("LP_NUM_THREADS", "0")  # Mesa's software renderer: threads cost more than they give here
    wanted = os.environ.get("MUJOCO_GL", "").strip().lower()
    reasons = []
    for name in (wanted,) if wanted in _BACKENDS else _BACKENDS:
        try:
            context_class = importlib.import_module(f"mujoco.{name}").GLContext
            context = context_class(16, 16)
            context.make_current()
            context.free()
        except (ImportError, AttributeError, OSError, RuntimeError, ValueError) as error:
            reasons.append(f"{name}: {str(error).strip() or type(error).__name__}")
            _forget_opengl()
        else:
            return name, context_class
    raise NoGL(
        "Cannot draw the robot's camera: no offscreen OpenGL works here "
        f"({'; '.join(reasons)}). Install one, on Debian or Ubuntu: apt-get install libegl1 libgl1-mesa-dri libosmesa6."
    )


def gl_backend() -> str:
    """Name of the OpenGL backend in use, "egl" or "osmesa" (environment variable MUJOCO_GL chooses).

    Raises:
        NoGL: neither works; the message says what to install.
    """
    return _context_class()[0]


class Renderer:
    """Draws one camera of a model without shadows or effects; close it explicitly.

    Args:
        model: the compiled model; its quality settings count at this moment.
        camera: name of the camera.
        width: px.
        height: px.
    """

    def __init__(self, model: mujoco.MjModel, camera: str, width: int, height: int) -> None:
        self._context = _context_class()[1](width, height)
        self._context.make_current()
        self._resources = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._resources)
        self._model = model
        self._scene = mujoco.MjvScene(model, maxgeom=1000)
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION, mujoco.mjtRndFlag.mjRND_HAZE):
            self._scene.flags[flag] = False
        self._option = mujoco.MjvOption()
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._camera.fixedcamid = model.camera(camera).id
        self._rectangle = mujoco.MjrRect(0, 0, width, height)
        self._buffer = np.empty((height, width, 3), np.uint8)

    def render(self, data: mujoco.MjData) -> Image:
        """The picture of `data`'s kinematic state, shape (height, width, 3), RGB."""
        self._context.make_current()
        mujoco.mjv_updateScene(
            self._model, data, self._option, None, self._camera, mujoco.mjtCatBit.mjCAT_ALL, self._scene
        )
        mujoco.mjr_render(self._rectangle, self._scene, self._resources)
        mujoco.mjr_readPixels(self._buffer, None, self._rectangle, self._resources)
        return np.ascontiguousarray(self._buffer[::-1])

    def close(self) -> None:
        """Free the OpenGL resources; a second call does nothing."""
        if self._context is not None:
            self._context.make_current()
            self._resources.free()
            self._context.free()
            self._context = None
