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

from somatopy.bodies.cameras import is_pinhole, pinhole
from somatopy.bodies.culling import mark_unseen
from somatopy.percept import Floats, Image, Part

__all__ = ["NoGL", "Renderer", "gl_backend"]

_BACKENDS = ("egl", "osmesa")
_HIDDEN = 5  # a group of geoms that MuJoCo does not draw unless told
_open: WeakSet[Renderer] = WeakSet()


class NoGL(RuntimeError):
    """This machine has no OpenGL library that can draw without a screen."""


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
        f"({'; '.join(reasons)}). Install one, on Debian or Ubuntu: apt-get install libegl1 libgl1-mesa-dri libopengl0."
    )


def gl_backend() -> str:
    """The name of the OpenGL backend in use: "egl" or "osmesa". The environment variable MUJOCO_GL can choose one.

    Raises:
        NoGL: neither works. The message says what to install.
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
    """Draws what one camera of a model sees, without shadows or effects. It must be closed.

    Sites and the rays of rangefinders are not drawn, since no real camera sees them. Shapes that the picture cannot
    show are not drawn either, which changes no pixel. For this purpose the model's `geom_group` is changed while a
    picture is drawn, and then restored.

    Args:
        model: the compiled model. Its quality settings are read when the renderer is made.
        camera: name of the camera.
        width: width of the pictures, px.
        height: height of the pictures, px.
    """

    def __init__(self, model: mujoco.MjModel, camera: str, width: int, height: int) -> None:
        self._context = _context_class()[1](width, height)
        _close_all_at_exit()
        self._context.make_current()
        self._resources = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._resources)
        self._model = model
        self._scene = mujoco.MjvScene(model, maxgeom=_room(model))
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION, mujoco.mjtRndFlag.mjRND_HAZE):
            self._scene.flags[flag] = False
        self._option = mujoco.MjvOption()
        self._option.flags[mujoco.mjtVisFlag.mjVIS_RANGEFINDER] = False
        self._option.sitegroup[:] = 0
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._camera.fixedcamid = model.camera(camera).id
        self._rectangle = mujoco.MjrRect(0, 0, width, height)
        self._reaches = _reaches(model, self._camera.fixedcamid)
        _open.add(self)

    def render(self, data: mujoco.MjData, part: Part | None = None) -> Image:
        """Draw the picture of a state, RGB, shape (height, width, 3).

        Args:
            data: the state. Its poses must be up to date.
            part: left, top, right and bottom, px, of the part to draw. The picture then has the shape
                (bottom - top, right - left, 3), and its pixels are the same as in the whole picture.
        """
        left, top, right, bottom = part or (0, 0, self._rectangle.width, self._rectangle.height)
        self._context.make_current()
        self._choose(data, (left, top, right, bottom))
        mujoco.mjr_render(self._rectangle, self._scene, self._resources)
        drawn = np.empty((bottom - top, right - left, 3), np.uint8)
        wanted = mujoco.MjrRect(left, self._rectangle.height - bottom, right - left, bottom - top)
        mujoco.mjr_readPixels(drawn, None, wanted, self._resources)
        return np.ascontiguousarray(drawn[::-1])

    def _choose(self, data: mujoco.MjData, part: Part) -> None:
        """Put into the scene what that part of the picture can show."""
        groups, k = self._model.geom_group, self._camera.fixedcamid
        kept = groups.copy()
        mark_unseen(
            data.cam_xpos[k], data.cam_xmat[k], self._edges(part), data.geom_xpos, self._reaches, groups, _HIDDEN
        )
        try:
            mujoco.mjv_updateScene(
                self._model, data, self._option, None, self._camera, mujoco.mjtCatBit.mjCAT_ALL, self._scene
            )
        finally:
            groups[:] = kept

    def _edges(self, part: Part) -> tuple[float, float, float, float]:
        """Tangents of the angles from the camera's axis to left, top, right and bottom edge of a part."""
        if not self._reaches.any():
            return 0.0, 0.0, 0.0, 0.0
        camera = pinhole(self._model, self._camera.fixedcamid, self._rectangle.width, self._rectangle.height)
        (across, along), (u, v) = camera.focals, camera.centre
        left, top, right, bottom = (edge - 0.5 for edge in part)  # of pixels, whose centres count
        return (left - u) / across, (top - v) / along, (right - u) / across, (bottom - v) / along

    def close(self) -> None:
        """Free the OpenGL resources. A second call does nothing."""
        if self._context is not None:
            self._context.make_current()
            self._resources.free()
            self._context.free()
            self._context = None


def _room(model: mujoco.MjModel) -> int:
    """How many shapes a scene holds at most: MuJoCo leaves out what comes last. Tendons are drawn in pieces."""
    return int(1000 + model.ngeom + model.nskin + model.nflex + 2 * model.nwrap + 64 * model.ntendon)


def _reaches(model: mujoco.MjModel, camera: int) -> Floats:
    """Radii of the balls around all shapes, 0 for those that are always drawn, shape (ngeom,), m.

    These are endless planes and what mirrors, which MuJoCo draws in a way of its own; and all shapes where the camera
    is no pinhole.
    """
    odd = not is_pinhole(model, camera)
    mirrors = (model.geom_matid >= 0) & (np.append(model.mat_reflectance, 0.0)[model.geom_matid] > 0)
    reaches: Floats = np.where(mirrors | odd, 0.0, model.geom_rbound)
    return reaches
