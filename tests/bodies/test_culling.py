"""What is left out of a picture: only what the part of it cannot show, seen by the pixels and by projection."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np
import pytest

from somatopy.bodies import MujocoBody
from somatopy.bodies.culling import mark_unseen
from somatopy.bodies.rendering import Renderer
from somatopy.percept import Floats

AWAY = 5  # the group of what is unseen

MIRROR = """
<mujoco>
  <asset><material name="mirror" reflectance=".5"/></asset>
  <worldbody>
    <light pos="0 0 2"/>
    <geom name="floor" type="plane" size="0 0 1"/>
    <geom name="behind" type="box" size=".1 .1 .1" pos="0 0 2" material="mirror"/>
    <geom name="before" type="box" size=".1 .1 .1" pos="0 0 .3" material="mirror"/>
    <geom name="beside" type="sphere" size=".1" pos="3 0 .3"/>
    <camera name="above" pos="0 0 1" fovy="40"/>
    <camera name="flat" pos="0 0 1" fovy="1" projection="orthographic"/>
  </worldbody>
</mujoco>"""


def test_a_ball_with_a_point_in_the_part_is_kept() -> None:
    """Of balls all around, those of which a random point projects into the part; most others are marked."""
    rng, marked = np.random.default_rng(0), 0
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    eye, edges = rng.normal(size=3), (-0.3, -0.2, 0.5, 0.1)
    places, reaches = eye + rng.normal(size=(3000, 3)), rng.uniform(0.01, 0.3, 3000)
    groups = np.zeros(3000, np.int32)
    mark_unseen(eye, turn.ravel(), edges, places, reaches, groups, AWAY)
    for place, reach, group in zip(places, reaches, groups, strict=True):
        ways = rng.normal(size=(200, 3))
        points = place + reach * ways / np.linalg.norm(ways, axis=1)[:, None]
        x, y, z = (turn.T @ (points - eye).T)[:, (points - eye) @ turn[:, 2] < 0]
        shown = (edges[0] < x / -z) & (x / -z < edges[2]) & (edges[1] < y / z) & (y / z < edges[3])
        assert group == 0 or not shown.any()
        marked += group == AWAY
    assert marked > 2000


def test_what_has_no_ball_is_kept() -> None:
    """An endless plane is kept wherever its middle is."""
    groups = np.zeros(1, np.int32)
    mark_unseen(np.zeros(3), np.eye(3).ravel(), (-1.0, -1.0, 1.0, 1.0), np.array([[0, 0, 5.0]]), np.zeros(1), groups, 5)
    assert groups.tolist() == [0]


@pytest.fixture
def nao() -> Iterator[MujocoBody]:
    body = MujocoBody("nao", "kinematic")
    yield body
    body.close()


def postures(body: MujocoBody, count: int) -> Iterator[tuple[Floats, Floats]]:
    rng = np.random.default_rng(2)
    for _ in range(count):
        yield rng.uniform(body.arm.lower, body.arm.upper), rng.uniform(body.head.lower, body.head.upper)


@pytest.mark.gl
def test_no_pixel_depends_on_what_is_left_out(nao: MujocoBody) -> None:
    """Whole pictures, and parts of any size and place, are those of all shapes drawn; the model is as it was."""
    rng, everything = np.random.default_rng(3), Renderer(nao.model, nao.camera.name, 320, 240)
    everything._reaches = np.zeros(nao.model.ngeom)
    before = nao.model.geom_group.copy()
    for arm, head in postures(nao, 150):
        nao.place(arm, head)
        (left, right), (top, bottom) = np.sort(rng.choice(321, 2, False)), np.sort(rng.choice(241, 2, False))
        full = everything.render(nao.data)
        np.testing.assert_array_equal(nao.picture(), full)
        np.testing.assert_array_equal(nao.picture(part=(left, top, right, bottom)), full[top:bottom, left:right])
    np.testing.assert_array_equal(nao.model.geom_group, before)
    everything.close()


@pytest.mark.gl
def test_most_shapes_are_left_out(nao: MujocoBody) -> None:
    """Else nothing were gained."""
    drawn = []
    for arm, head in postures(nao, 20):
        nao.place(arm, head)
        nao.picture(part=(100, 80, 180, 140))
        (renderer,) = nao._renderers.values()
        drawn.append(renderer._scene.ngeom)
    assert np.mean(drawn) < 0.4 * (nao.model.geom_group < 3).sum()


@pytest.mark.gl
@pytest.mark.parametrize(("camera", "kept"), [("above", 3), ("flat", 4)])
def test_mirrors_and_what_odd_cameras_see_are_kept(camera: str, kept: int) -> None:
    """MuJoCo draws the first mirror in a way of its own; a camera without a field of view cannot be asked."""
    model = mujoco.MjModel.from_xml_string(MIRROR)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    renderer = Renderer(model, camera, 64, 48)
    renderer.render(data)
    assert renderer._scene.ngeom == kept
    renderer.close()
