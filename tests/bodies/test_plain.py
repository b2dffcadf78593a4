"""What is added to a model is what it is said to be, whatever the model's default classes say."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from somatopy.bodies.plain import PLAIN

DEFAULTS = """
<mujoco>
  <default>
    <geom type="box" size="9 9 9" group="3" rgba="1 0 0 0" euler="1 2 3" pos="4 5 6" shellinertia="true" mass="7"/>
    <site type="box" size="9 9 9" group="4" euler="1 2 3"/>
    <camera fovy="9" mode="track" euler="1 2 3" pos="4 5 6" projection="orthographic"/>
    <joint type="slide" damping="8" armature="3" range="1 2" axis="1 0 0"/>
    <mesh scale="0.001 0.001 0.001"/>
    <material rgba="1 0 0 0" reflectance="0.9" emission="3" texrepeat="5 5"/>
  </default>
  <worldbody><body name="hand"><geom size="0.1 0.1 0.1"/></body></worldbody>
</mujoco>"""
TETRAHEDRON = {"uservert": [0, 0, 0, 0.1, 0, 0, 0, 0.1, 0, 0, 0, 0.1], "userface": [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]}


def furnished(spec: mujoco.MjSpec, body: str, plain: bool) -> mujoco.MjModel:
    """A model with one of each added, by us or, where there are no defaults, by MuJoCo itself."""
    on = spec.body(body)

    def add(method: object, **values: object) -> None:
        method(*([PLAIN] if plain else []), **values)  # type: ignore[operator]

    add(spec.add_material, name="new", specular=0.1)
    add(spec.add_mesh, name="new", **TETRAHEDRON)
    add(on.add_geom, name="new", type=mujoco.mjtGeom.mjGEOM_MESH, meshname="new", material="new", mass=1)
    add(on.add_geom, name="ball", size=[0.2, 0, 0])
    add(on.add_site, name="new", pos=[0, 0, 1])
    add(on.add_camera, name="new", pos=[0, 1, 0])
    add(on.add_joint, name="new", axis=[0, 1, 0], range=[-1, 1])
    return spec.compile()


@pytest.mark.parametrize("prefix", ["geom_", "site_", "cam_", "jnt_", "mat_", "mesh_", "body_mass", "dof_"])
def test_new_parts_are_those_of_a_model_without_defaults(prefix: str) -> None:
    """All that the compiled model says of them, but for what was there before."""
    bare = mujoco.MjSpec.from_string("<mujoco><worldbody><body name='hand'/></worldbody></mujoco>")
    expected = furnished(bare, "hand", plain=False)
    found = furnished(mujoco.MjSpec.from_string(DEFAULTS.replace('<geom size="0.1 0.1 0.1"/>', "")), "hand", plain=True)
    for name in filter(lambda name: name.startswith(prefix), dir(expected)):
        if isinstance(values := getattr(expected, name), np.ndarray):
            np.testing.assert_array_equal(getattr(found, name), values, err_msg=name)
