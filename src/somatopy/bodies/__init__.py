"""Robots: the Body contract, and MuJoCo models with an anatomy file."""

from somatopy.bodies import _opengl  # noqa: F401 - before anything that imports mujoco
from somatopy.bodies.anatomy import MODELS, Anatomy, Coupling, anatomy_path
from somatopy.bodies.arm_track import ArmTrack, kept_track
from somatopy.bodies.base import BodyError, Diverged
from somatopy.bodies.check import check_body
from somatopy.bodies.mujoco import Motion, Mujoco, MujocoBody
from somatopy.bodies.rendering import NoGL, gl_backend
from somatopy.contract import Body
from somatopy.registry import BODIES

__all__ = [
    "MODELS",
    "Anatomy",
    "ArmTrack",
    "Body",
    "BodyError",
    "Coupling",
    "Diverged",
    "Motion",
    "Mujoco",
    "MujocoBody",
    "NoGL",
    "anatomy_path",
    "check_body",
    "gl_backend",
    "kept_track",
]

BODIES.add("mujoco", "somatopy.bodies.mujoco:Mujoco")
