"""Offscreen pictures of a MuJoCo model by software OpenGL: EGL, else OSMesa."""

from __future__ import annotations

import atexit
import importlib
import os
import subprocess
import sys
from functools import cache
from typing import Any
from weakref import WeakSet

import mujoco
import numpy as np

from somatopy.percept import Image

__all__ = ["NoGL", "Renderer", "gl_backend"]

_BACKENDS = ("egl", "osmesa")
_open: WeakSet[Renderer] = WeakSet()


class NoGL(RuntimeError):
    """No OpenGL library on this machine can draw without a screen."""


def _failure(backend: str) -> str:
    """Why another process cannot make a context, or nothing if it can.

    Not tried in this process: MuJoCo draws with the first OpenGL library that it finds loaded, so one that was loaded
    and does not work would spoil the next.
    """
    program = f"from mujoco.{backend} import GLContext; context = GLContext(16, 16); context.make_current()"
    environment = os.environ | {"MUJOCO_GL": "disable"}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=False)
    return "" if done.returncode == 0 else (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]


@cache
def _context_class() -> tuple[str, Any]:
    os.environ.setdefault("LP_NUM_THREADS", "0")  # Mesa's software renderer: threads cost more than they give here
    wanted = os.environ.get("MUJOCO_GL", "").strip().lower()
    reasons = []
    for name in (wanted,) if wanted in _BACKENDS else _BACKENDS:
        reason = _failure(name)
        if not reason:
            return name, importlib.import_module(f"mujoco.{name}").GLContext
        reasons.append(f"{name}: {reason}")
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


@cache
def _close_all_at_exit() -> None:
    """PyOpenGL cannot free contexts any more when Python has begun to take itself apart.

    Functions called at exit run last in, first out: register this one once MuJoCo has registered its own.
    """
    atexit.register(_close_all)


def _close_all() -> None:
    for renderer in list(_open):
        renderer.close()


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
        _close_all_at_exit()
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
        _open.add(self)

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
