"""What counts as standing in the way: what is drawn, finite and not the marker."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from somatopy.bodies import MujocoBody
from somatopy.bodies.marker import SITE
from somatopy.bodies.occluders import Occluders

MJCF = f"""
<mujoco>
  <asset>
    <material name="glass" rgba="1 1 1 0"/>
    <material name="paint" rgba="1 0 0 1"/>
    <mesh name="wedge" vertex="0 0 0  .3 0 0  0 .2 0  0 0 .1"/>
  </asset>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1"/>
    <geom name="ball" size=".1" pos="1 0 0"/>
    <geom name="touched" size=".1" group="3"/>
    <geom name="clear" size=".1" rgba="1 1 1 0"/>
    <geom name="glazed" size=".1" material="glass"/>
    <geom name="painted" type="box" size=".1 .2 .3" material="paint" euler="10 20 30"/>
    <body pos="0 0 1">
      <joint name="turn" axis="0 0 1"/>
      <geom name="{SITE}" size=".03"/>
      <geom name="rod" type="capsule" fromto="0 0 0 .3 0 0" size=".02"/>
      <geom name="tube" type="cylinder" size=".02 .1" pos="0 .4 0"/>
      <geom name="egg" type="ellipsoid" size=".1 .05 .02" pos="0 0 .4"/>
      <geom name="wedge" type="mesh" mesh="wedge" pos=".5 0 0" euler="0 40 0"/>
    </body>
  </worldbody>
</mujoco>"""
SHOWN = ["ball", "painted", "rod", "tube", "egg", "wedge"]


@pytest.fixture
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(MJCF)


def test_only_what_is_drawn_and_finite_counts(model: mujoco.MjModel) -> None:
    """No plane, no group 3, nothing transparent, not the marker; a mesh counts as an ellipsoid, the rest as it is."""
    kinds = [model.geom(name).type[0] for name in SHOWN[:-1]] + [mujoco.mjtGeom.mjGEOM_ELLIPSOID]
    assert Occluders(model).shapes.kinds.tolist() == [int(kind) for kind in kinds]


def test_sizes_are_mujocos_and_spheres_have_three_equal_ones(model: mujoco.MjModel) -> None:
    """The order is that of the model's geoms."""
    sizes = Occluders(model).shapes.sizes
    np.testing.assert_allclose(sizes[0], 0.1)
    np.testing.assert_allclose(sizes[1, :3], [0.1, 0.2, 0.3])
    np.testing.assert_allclose(sizes[2, :2], [0.02, 0.15])
    np.testing.assert_allclose(sizes[4, :3], [0.1, 0.05, 0.02])


def test_bounding_radius_holds_the_whole_shape(model: mujoco.MjModel) -> None:
    """Else a ray could miss what it should hit."""
    _ball, box, rod, tube, egg, wedge = Occluders(model).shapes.sizes
    assert box[3] >= np.linalg.norm(box[:3]) - 1e-9
    assert rod[3] >= rod[0] + rod[1] - 1e-9
    assert tube[3] >= np.hypot(tube[0], tube[1]) - 1e-9
    assert egg[3] >= egg[:3].max() - 1e-9 and wedge[3] >= wedge[:3].max() - 1e-9


def test_naos_occluders_are_what_its_camera_can_see() -> None:
    """Every shape of the NAO that is drawn, its room and the cube aside, in every view."""
    body = MujocoBody("nao", "kinematic")
    drawn = [k for k in range(body.model.ngeom) if body.model.geom_group[k] < 3 and body.model.geom_type[k] != 0]
    assert len(body.occluders.kinds) == len(drawn) - 1
    assert body.view(body.arm.lower, body.head.upper).occluders.shape == (len(drawn) - 1, 12)
