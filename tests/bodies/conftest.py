"""A robot that is not the NAO: two arm joints, two head joints, a camera of its own, no keyframe and no coupling."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

MJCF = """
<mujoco model="crane">
  <compiler angle="radian"/>
  <option integrator="implicitfast"/>
  <worldbody>
    <light pos="1 0 2"/>
    <body name="post" pos="0 0 .5">
      <body name="boom">
        <joint name="lift" axis="0 1 0" range="-1 1"/>
        <geom type="capsule" fromto="0 0 0 .2 0 0" size=".02" mass=".05"/>
        <body name="jib" pos=".2 0 0">
          <joint name="swing" axis="0 0 1" range="-1.5 .5"/>
          <geom type="capsule" fromto="0 0 0 .1 0 0" size=".02" mass=".02"/>
        </body>
      </body>
      <body name="neck" pos="0 0 .15">
        <joint name="pan" axis="0 0 1" range="-1.5 1.5"/>
        <geom type="sphere" size=".04" mass=".1"/>
        <body name="face">
          <joint name="tilt" axis="0 1 0" range="-.5 1"/>
          <geom type="sphere" size=".04" mass=".1"/>
          <camera name="eye" pos=".05 0 0" xyaxes="0 -1 0 .4 0 .9" fovy="60"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position joint="lift" kp="20" kv="1"/>
    <position joint="swing" kp="20" kv="1"/>
    <position joint="pan" kp="20" kv="1"/>
    <position joint="tilt" kp="20" kv="1"/>
  </actuator>
</mujoco>
"""
ANATOMY = """
name = "Crane"
model = "crane.xml"

[arm]
joints = ["lift", "swing"]
velocity = [2.0, 3.0]

[head]
joints = ["pan", "tilt"]
velocity = [4.0, 4.0]

[camera]
name = "eye"
width = 200
height = 150

[marker]
body = "jib"
position = [0.12, 0.0, 0.0]
"""
COUPLING = """
[head.coupling]
joint = "tilt"
by = "pan"
at = [-1.0, 1.0]
lower = [-0.5, -0.5]
upper = [0.8, 0.2]

[camera]"""

Robot = Callable[..., Path]
Change = tuple[str, str]


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    """Writes that robot, with one piece of text in its model or anatomy replaced by another, and gives the anatomy."""

    def write(mjcf: Change = ("", ""), anatomy: Change = ("", "")) -> Path:
        assert mjcf[0] in MJCF and anatomy[0] in ANATOMY
        (tmp_path / "crane.xml").write_text(MJCF.replace(*mjcf) if mjcf[0] else MJCF)
        (tmp_path / "crane.toml").write_text(ANATOMY.replace(*anatomy) if anatomy[0] else ANATOMY)
        return tmp_path / "crane.toml"

    return write


@pytest.fixture
def coupled() -> Change:
    """The change of the anatomy by which pan limits tilt."""
    return ("\n[camera]", COUPLING)
