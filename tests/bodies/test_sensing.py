"""What a body knows of itself, against MuJoCo asked directly."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from somatopy.bodies import MujocoBody, sensing
from somatopy.bodies.marker import SITE
from somatopy.percept import Floats, View

Robot = Callable[..., Path]
WEDGE = (
    '<mesh name="wedge" vertex="0 0 0  .3 0 0  0 .2 0  0 0 .1"/>',
    '<geom name="wedge" type="mesh" mesh="wedge" pos=".5 0 0" euler="0 .7 0" contype="0" conaffinity="0" mass="0"/>',
)
FACE = '<geom type="sphere" size=".04" mass=".1"/>\n          <camera'


@pytest.fixture(params=["compiled", "through Python"])
def way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Both ways of calling MuJoCo; the second is for where its functions cannot be found."""
    if request.param == "through Python":
        monkeypatch.setattr(sensing, "function", lambda name: 0)
    return request.param


def wedged(robot: Robot) -> Path:
    """The crane with a mesh on its face."""
    path = robot(mjcf=(FACE, WEDGE[1] + FACE))
    model = path.with_name("crane.xml")
    model.write_text(model.read_text().replace("<worldbody>", f"<asset>{WEDGE[0]}</asset><worldbody>"))
    return path


def random_postures(body: MujocoBody, count: int) -> list[tuple[Floats, Floats]]:
    rng = np.random.default_rng(0)
    return [(rng.uniform(*body.arm.space.limits.T), rng.uniform(*body.head.space.limits.T)) for _ in range(count)]


def asked(body: MujocoBody) -> mujoco.MjData:
    """MuJoCo's own account of the body's posture."""
    data = mujoco.MjData(body.model)
    data.qpos[:] = body.data.qpos
    mujoco.mj_forward(body.model, data)
    return data


def poses(view: View) -> Floats:
    return np.vstack([view.camera, view.marker, view.occluders])


def test_view_is_where_mujoco_has_them(way: str) -> None:
    """Camera, marker and every drawn shape of the NAO, to the last bit."""
    body = MujocoBody("nao", "kinematic")
    drawn = [k for k in range(body.model.ngeom) if body.model.geom_group[k] < 3 and body.model.geom_type[k] != 0]
    drawn.remove(body.model.geom(SITE).id)
    for arm, head in random_postures(body, 20):
        view = body.place(arm, head).view
        assert view is not None
        data = asked(body)
        camera, site = data.camera(body.camera.name), data.site(SITE)
        expected = [np.append(thing.xpos, thing.xmat) for thing in (camera, site, *map(data.geom, drawn))]
        np.testing.assert_array_equal(poses(view), expected)


def test_mesh_counts_at_the_centre_of_its_box(robot: Robot, way: str) -> None:
    """Its ellipsoid stands where the mesh is, wherever MuJoCo puts the mesh's own origin, and fills its box."""
    body = MujocoBody(wedged(robot), "kinematic")
    view, data = body.place([0.2, -0.3], [0.4, 0.1]).view, asked(body)
    assert view is not None
    geom, turn = data.geom("wedge"), data.geom("wedge").xmat.reshape(3, 3)
    first = body.model.mesh("wedge").vertadr[0]
    corners = body.model.mesh_vert[first : first + 4]
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    distances = np.linalg.norm(view.occluders[:, :3] - (geom.xpos + turn @ middle), axis=1)
    assert distances.min() < 1e-6
    half = body.occluders.sizes[distances.argmin(), :3]
    np.testing.assert_allclose(half, 0.5 * (corners.max(axis=0) - corners.min(axis=0)), atol=1e-6)


def test_cameras_and_lights_that_follow_a_centre_of_mass_do(robot: Robot, way: str) -> None:
    """The light over the crane turns to where its mass has gone."""
    light = '<light pos="1 0 2"/>', '<light name="lamp" pos="1 0 2" mode="targetbodycom" target="post"/>'
    body = MujocoBody(robot(mjcf=light), "kinematic")
    for arm, head in random_postures(body, 5):
        body.place(arm, head)
        np.testing.assert_array_equal(body.data.light("lamp").xdir, asked(body).light("lamp").xdir)


def test_overlap_is_what_all_contacts_say() -> None:
    """Asking for contacts only where bounding spheres meet loses none: 3,000 postures, some hundred overlaps."""
    body, found = MujocoBody("nao", "kinematic"), []
    side = np.zeros(body.model.ngeom, int)
    for names, number in ((["LBicep_shell", "LForeArm_shell", "LHand_shell"], 1), (["skull", "ears"], 2)):
        side[[body.model.geom(name).id for name in names]] = number
    for arm, head in random_postures(body, 3000):
        arm[1] = min(arm[1], 0.0)
        overlap, data = body.place(arm, head).overlap, asked(body)
        assert overlap == any(side[contact.geom].sum() == 3 for contact in data.contact)
        found.append(overlap)
    assert 100 < sum(found) < 2900
