"""Which OpenGL library draws, what happens where it is missing, and that it makes no difference to the picture."""

from __future__ import annotations

import hashlib
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import mujoco
import pytest

from somatopy.bodies import NoGL, gl_backend
from somatopy.bodies.rendering import Renderer

SCENE = """
<mujoco>
  <worldbody>
    <light pos="0 0 2"/>
    <geom name="ball" type="sphere" size=".1" rgba="1 0 0 1" pos=".1 .05 0"/>
    <camera name="above" pos="0 0 1" fovy="40"/>
  </worldbody>
</mujoco>"""

DRAW = """
import hashlib
from somatopy.bodies import MujocoBody, gl_backend
body = MujocoBody("nao", "kinematic", arm_speed=None)
for _ in range(10):
    reading = body.step([0.2, 0.3, 0.0, -0.6], [0.4, 0.3])
print(gl_backend(), hashlib.sha256(reading.image().tobytes()).hexdigest())
"""

# Python imports a module of this name when it starts, here and in the processes that the program starts.
SITE_CUSTOMIZE = """
import sys
class Missing:
    def find_spec(self, name, path=None, target=None):
        if name in {modules!r}:
            raise {error}("no library behind " + name)
sys.meta_path.insert(0, Missing())
"""


@pytest.fixture
def without(tmp_path: Path) -> Callable[..., dict[str, str]]:
    """The environment of a Python in which importing some modules fails, as it does where a library is missing."""

    def environment(*modules: str, error: str) -> dict[str, str]:
        (tmp_path / "sitecustomize.py").write_text(SITE_CUSTOMIZE.format(modules=modules, error=error))
        return {"PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}

    return environment


def run(program: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """A program in a Python of its own, in which only these OpenGL settings hold."""
    inherited = {k: v for k, v in os.environ.items() if not k.startswith(("MUJOCO_", "PYOPENGL_"))}
    return subprocess.run(
        [sys.executable, "-c", program], env=inherited | environment, capture_output=True, text=True, check=False
    )


def drawn(program: str = DRAW, **environment: str) -> list[str]:
    done = run(program, **environment)
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


@pytest.fixture(scope="module")
def picture() -> str:
    """Digest of the robot's picture, drawn without being told with what."""
    return drawn()[1]


@pytest.mark.gl
def test_some_library_is_chosen_without_being_told() -> None:
    """EGL where it works, else OSMesa; it stays the same."""
    assert gl_backend() in ("egl", "osmesa")
    assert gl_backend() == gl_backend()


@pytest.mark.gl
@pytest.mark.osmesa
@pytest.mark.parametrize("backend", ["egl", "OSMesa"])
def test_every_library_draws_the_same_picture(picture: str, backend: str) -> None:
    """MUJOCO_GL chooses, in any case of letters; not one bit of the robot's picture depends on it."""
    assert drawn(MUJOCO_GL=backend) == [backend.lower(), picture]


@pytest.mark.gl
@pytest.mark.osmesa
@pytest.mark.parametrize("platform", ["", "osmesa"])
def test_osmesa_draws_where_egl_fails(picture: str, platform: str) -> None:
    """On a graphics device that does not exist, and where PyOpenGL was told of OSMesa beforehand."""
    told = {"PYOPENGL_PLATFORM": platform} if platform else {}
    assert drawn(MUJOCO_EGL_DEVICE_ID="99", **told) == ["osmesa", picture]


@pytest.mark.gl
def test_mujoco_may_be_imported_first(picture: str) -> None:
    """A program that uses MuJoCo itself can draw the robot, and in another process it draws the same."""
    assert drawn("import mujoco\n" + DRAW)[1] == picture


def test_without_any_library_the_message_says_what_to_install(without: Callable[..., dict[str, str]]) -> None:
    """Both reasons, and the packages that set-up, README and the page on installing name."""
    done = run(DRAW, **without("mujoco.egl", "mujoco.osmesa", error="ImportError"))
    assert done.returncode == 1
    last = done.stderr.strip().splitlines()[-1]
    assert "NoGL: Cannot draw the robot's camera" in last
    assert "egl: ImportError: no library behind mujoco.egl" in last
    assert "osmesa: ImportError: no library behind mujoco.osmesa" in last
    root = Path(__file__).parents[2]
    packages = re.search('EGL_PACKAGES="(.+)"', (root / "scripts/setup.sh").read_text(encoding="utf-8"))
    assert packages and f"apt-get install {packages[1]}." in last
    for page in ("README.md", "docs/install.md"):
        assert f"apt-get install {packages[1]} " in (root / page).read_text(encoding="utf-8")


@pytest.mark.parametrize(("backend", "module"), [("osmesa", "OpenGL.osmesa"), ("egl", "mujoco.egl.egl_ext")])
def test_library_that_is_asked_for_but_missing_is_named(
    without: Callable[..., dict[str, str]], backend: str, module: str
) -> None:
    """PyOpenGL's AttributeError, at which even `import mujoco` fails then, does not come through; motion works."""
    missing = without(module, error="AttributeError") | {"MUJOCO_GL": backend}
    assert "AttributeError" in run("import mujoco", **missing).stderr
    move = "from somatopy.bodies import MujocoBody\nprint(*MujocoBody('nao').reset().head)\n"
    done = run(move + DRAW, **missing)
    assert done.stdout.split() == ["0.0", "0.0"]
    assert "NoGL: Cannot draw the robot's camera" in done.stderr.strip().splitlines()[-1]


def test_no_gl_is_no_error_of_input() -> None:
    """It is the machine that lacks something."""
    assert issubclass(NoGL, RuntimeError) and not issubclass(NoGL, ValueError)


@pytest.mark.gl
def test_picture_is_upright_and_in_rgb() -> None:
    """A red ball right of and above the camera's axis is in the right upper quarter, and red."""
    model = mujoco.MjModel.from_xml_string(SCENE)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_camlight(model, data)
    renderer = Renderer(model, "above", 64, 48)
    picture = renderer.render(data).astype(int)
    assert picture.shape == (48, 64, 3)
    rows, columns = (picture[..., 0] > picture[..., 2] + 30).nonzero()
    assert rows.size > 20 and rows.mean() < 24 and columns.mean() > 32
    renderer.close()
    renderer.close()


@pytest.mark.gl
def test_two_renderers_do_not_disturb_each_other() -> None:
    """Each has a context of its own, and a picture is a copy."""
    model = mujoco.MjModel.from_xml_string(SCENE)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_camlight(model, data)
    large, small = Renderer(model, "above", 128, 96), Renderer(model, "above", 64, 48)
    before = large.render(data)
    digest = hashlib.sha256(before.tobytes()).digest()
    assert small.render(data).shape == (48, 64, 3)
    assert (large.render(data) == before).all()
    small.close()
    assert (large.render(data) == before).all()
    large.close()
    assert hashlib.sha256(before.tobytes()).digest() == digest
