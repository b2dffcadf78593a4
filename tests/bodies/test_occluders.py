"""What counts as standing in the way: what is drawn, finite and not the marker."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from somatopy.bodies import MujocoBody
from somatopy.bodies.marker import SITE
from somatopy.bodies.occluders import Occluders
from somatopy.bodies.rendering import Renderer
from somatopy.percept import Floats

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
    """No plane, no group 3, nothing transparent, not the marker; a wedge counts as an ellipsoid, the rest as it is."""
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


PANE = """
<mujoco>
  <asset>
    <material name="solid" rgba="1 0 0 1"/><material name="thin" rgba="1 0 0 .3"/><material name="none" rgba="1 0 0 0"/>
  </asset>
  <worldbody>
    <light pos="0 0 2"/>
    <camera name="above" pos="0 0 1" fovy="40"/>
    <geom name="{site}" type="box" size=".1 .1 .1"/>
    <geom name="pane" type="box" size=".3 .3 .01" pos="0 0 .5" {looks}/>
  </worldbody>
</mujoco>"""
LOOKS = [
    *('rgba="1 1 1 1"', 'rgba="1 1 1 .9"', 'rgba="0 0 0 .3"', 'rgba="0 0 0 0"', 'material="solid"', 'material="thin"'),
    *('material="none" rgba="1 1 1 1"', 'material="solid" rgba="1 1 1 0"', 'material="thin" rgba="1 1 1 1"'),
    *('material="solid" rgba=".5 .5 .5 1"', 'material="none"', 'rgba=".5 .5 .5 .2"'),
]


@pytest.mark.gl
@pytest.mark.parametrize("looks", LOOKS)
def test_what_hides_things_in_the_picture_is_what_counts(looks: str) -> None:
    """A shape's own colour comes before its material's; half of what stands behind must get through to be read."""

    def centre(scene: str) -> Floats:
        model = mujoco.MjModel.from_xml_string(scene)
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_camlight(model, data)
        renderer = Renderer(model, "above", 16, 16)
        drawn = renderer.render(data)[8, 8].astype(float)
        renderer.close()
        return drawn

    scene = PANE.format(site=SITE, looks=looks)
    dark, light = (scene.replace('size=".1 .1 .1"', f'size=".1 .1 .1" rgba="{c} {c} {c} 1"') for c in (0, 1))
    through = np.abs(centre(light) - centre(dark)).max() / 255
    hides = len(Occluders(mujoco.MjModel.from_xml_string(scene)).geoms) == 1
    assert hides == (through < 0.3)


def test_a_box_made_of_triangles_hides_what_the_box_hides() -> None:
    """Meshes of links are often boxes, whose corners an ellipsoid would leave out."""
    corners = "  ".join(f"{x} {y} {z}" for x in (-0.1, 0.1) for y in (-0.02, 0.02) for z in (-0.05, 0.05))
    model = mujoco.MjModel.from_xml_string(f"""<mujoco><asset><mesh name="brick" vertex="{corners}"/></asset><worldbody>
      <geom type="mesh" mesh="brick"/><site name="{SITE}"/><geom name="{SITE}" size=".01"/></worldbody></mujoco>""")
    shapes = Occluders(model).shapes
    assert shapes.kinds.tolist() == [mujoco.mjtGeom.mjGEOM_BOX]
    assert sorted(shapes.sizes[0, :3]) == pytest.approx([0.02, 0.05, 0.1])
