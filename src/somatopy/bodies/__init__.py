"""Bodies, that is, robots: any MuJoCo model with an anatomy file, and a check for bodies of your own."""

from somatopy.bodies import _opengl  # noqa: F401 - before anything that imports mujoco
from somatopy.bodies.anatomy import MODELS, Add, Anatomy, Coupling, Servo, anatomy_path
from somatopy.bodies.arm_track import ArmTrack, kept_track
from somatopy.bodies.base import BodyError, Diverged
from somatopy.bodies.check import check_body
from somatopy.bodies.mujoco import Motion, Mujoco, MujocoBody
from somatopy.bodies.rendering import NoGL, gl_backend
from somatopy.bodies.servos import proposed_servos
from somatopy.contract import Body
from somatopy.registry import BODIES

__all__ = [
    "MODELS",
    "Add",
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
    "Servo",
    "anatomy_path",
    "check_body",
    "gl_backend",
    "kept_track",
    "proposed_servos",
]

BODIES.add("mujoco", "somatopy.bodies.mujoco:Mujoco")
