"""Servos of a model, as they come: behind gears, with filters, of joints that are neither arm nor head."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from somatopy.bodies import BodyError, MujocoBody

Robot = Callable[..., Path]
LIFT = '<position joint="lift" kp="20" kv="1"/>'
TAIL = (
    '<body name="neck" pos="0 0 .15">',
    '<body name="tail" pos="-.3 0 0"><joint name="wag" axis="0 1 0" range="-2 2" {joint}/><geom type="capsule" '
    'fromto="0 0 0 -.2 0 0" size=".02" mass=".3"/></body><body name="neck" pos="0 0 .15">',
)


def played(path: Path) -> np.ndarray:
    """Postures of the arm while it moves."""
    body = MujocoBody(path)
    body.reset()
    return np.array([body.step([0.5, -0.5], [0.1, 0.1]).arm for _ in range(20)])


@pytest.mark.parametrize(
    ("plain", "other"),
    [
        (LIFT, LIFT.replace("/>", ' timeconst=".3"/>')),
        (LIFT, '<position joint="lift" gear="2" kp="5" kv=".25"/>'),
        (LIFT, '<position joint="lift" gear="-2" kp="5" kv=".25"/>'),
        (
            LIFT.replace("/>", ' forcerange="-.2 .4"/>'),
            '<position joint="lift" gear="-2" kp="5" kv=".25" forcerange="-.2 .1"/>',
        ),
        (
            LIFT.replace("/>", ' armature=".04" damping=".4"/>'),
            '<position joint="lift" gear="2" kp="5" kv=".25" armature=".01" damping=".1"/>',
        ),
        ('<position joint="lift" kp="20" dampratio="1"/>', '<position joint="lift" gear="2" kp="5" dampratio="1"/>'),
        (LIFT, '<position joint="lift" kp="20" kv="1" ctrlrange="-.1 .1"/>'),
    ],
    ids=["filter", "gear", "reversed", "force", "rotor", "damping ratio", "control range"],
)
def test_servo_is_the_same_behind_a_gear_and_without_its_filter(robot: Robot, plain: str, other: str) -> None:
    """Set-points are angles of the joint, and already ramp."""
    assert np.allclose(played(robot(mjcf=(LIFT, other))), played(robot(mjcf=(LIFT, plain))), atol=1e-9)


@pytest.mark.parametrize(
    "servo",
    [
        '<position joint="wag" kp="900" kv="20"/>',
        '<position joint="wag" gear="3" kp="100" kv="2"/>',
        '<position joint="wag" gear="-3" kp="100" kv="2" timeconst=".5"/>',
        '<intvelocity joint="wag" gear="3" kp="100" kv="2" actrange="-9 9"/>',
    ],
    ids=["plain", "gear", "filter", "integral"],
)
def test_servo_of_another_joint_holds_it(robot: Robot, servo: str) -> None:
    """A tail stays where the keyframe has it, within what its weight makes it sag."""
    path = robot(mjcf=(TAIL[0], TAIL[1].format(joint='damping=".1"')), anatomy=('.xml"', '.xml"\nhome = "up"'))
    text = path.with_suffix(".xml").read_text().replace("</actuator>", f"{servo}</actuator>")
    key = '<keyframe><key name="up" qpos="0 0 1.2 0 0"/></keyframe>'
    path.with_suffix(".xml").write_text(text.replace("</mujoco>", f"{key}</mujoco>"))
    body = MujocoBody(path)
    reading = body.reset()
    for _ in range(60):
        body.step(reading.arm, reading.head)
    assert body.data.joint("wag").qpos[0] == pytest.approx(1.2, abs=0.01)


def test_ranges_always_have_the_names_that_presets_use(robot: Robot) -> None:
    """The anatomy's own go before."""
    body = MujocoBody(robot(), motion="kinematic")
    assert set(body.ranges) == {"mechanical", "confined", "wide"}
    for name in ("confined", "wide"):
        assert np.array_equal(body.ranges[name], body.arm.space.limits)
    narrow = MujocoBody(robot(anatomy=("[arm]", "[ranges]\nconfined = [[-0.1, 0.1], [0, 0.2]]\n\n[arm]")))
    assert narrow.ranges["confined"].tolist() == [[-0.1, 0.1], [0.0, 0.2]]
    assert narrow.ranges["wide"].tolist() == narrow.ranges["confined"].tolist()


def test_velocity_may_be_left_out(robot: Robot) -> None:
    """3 rad/s, and .5 m/s for slides."""
    slide = ('name="swing" axis="0 0 1"', 'name="swing" type="slide" axis="0 0 1"')
    body = MujocoBody(robot(mjcf=slide, anatomy=("velocity = [2.0, 3.0]", "")), motion="kinematic")
    assert body.arm.velocity.tolist() == [3.0, 0.5]


def test_joints_without_a_name_are_counted(robot: Robot) -> None:
    """And the message says where they are, and how to name them."""
    path = robot(mjcf=('name="lift" ', ""))
    path.with_suffix(".xml").write_text(path.with_suffix(".xml").read_text().replace(LIFT, ""))
    with pytest.raises(BodyError, match=r"Available: swing, pan, tilt, and an unnamed joint \(on 'boom'\); .*name="):
        MujocoBody(path)
    with pytest.raises(BodyError, match=r"camera 'eye' .*Available: an unnamed camera \(on 'face'\); to use one, give"):
        MujocoBody(robot(mjcf=('name="eye" ', "")))


def test_compiled_model_is_refused(robot: Robot) -> None:
    """Nothing can be put into it any more."""
    path = robot(anatomy=("crane.xml", "crane.mjb"))
    path.with_suffix(".mjb").write_bytes(b"\0")
    with pytest.raises(BodyError, match=r"crane.mjb is compiled .*Name the MJCF"):
        MujocoBody(path)
