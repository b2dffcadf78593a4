"""Robots: the Body contract, and MuJoCo models with an anatomy file."""

from somatopy.bodies import _opengl  # noqa: F401 - before anything that imports mujoco
from somatopy.bodies.anatomy import BODIES, Anatomy, Coupling, anatomy_path
from somatopy.bodies.base import Body, BodyError
from somatopy.bodies.check import check_body
from somatopy.bodies.model import FRAME
from somatopy.bodies.mujoco import Motion, MujocoBody
from somatopy.bodies.rendering import NoGL, gl_backend

__all__ = [
    "BODIES",
    "FRAME",
    "Anatomy",
    "Body",
    "BodyError",
    "Coupling",
    "Motion",
    "MujocoBody",
    "NoGL",
    "anatomy_path",
    "check_body",
    "gl_backend",
]
