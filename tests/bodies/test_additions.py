"""What an anatomy adds to a model: it is where and what the file says, and robots that lack much run with physics."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest

from somatopy.bodies import Anatomy, BodyError, MujocoBody, check_body
from somatopy.bodies.additions import add

Robot = Callable[..., Path]

# A free base, degrees, motors, a keyframe, no camera, no head, joints without limits, a gripper that nobody names,
# defaults that would spoil what is added, and a handle by which a user drags the hand.
WILD = """
<mujoco model="wild">
  <compiler angle="degree"/>
  <option timestep=".004"/>
  <default>
    <general gear="7" ctrllimited="true" ctrlrange="-.1 .1" forcelimited="true" forcerange="-.2 .2"/>
    <joint damping=".3" stiffness="1" limited="true" range="-80 80"/>
    <geom type="capsule" mass=".2"/><camera fovy="11"/>
  </default>
  <worldbody>
    <light pos="0 0 3"/><geom type="plane" size="3 3 .1" mass="0"/>
    <body name="handle" mocap="true" pos="9 9 9"/>
    <body name="base" pos="0 0 .4">
      <freejoint/>
      <geom type="box" size=".1 .1 .05" mass="2"/>
      <body name="upper" pos="0 -.15 .1">
        <joint name="shoulder" axis="0 1 0" limited="false"/>
        <joint name="roll" axis="1 0 0"/>
        <geom fromto="0 0 0 .2 0 0" size=".03"/>
        <body name="lower" pos=".2 0 0">
          <joint name="elbow" axis="0 0 1" ref="10"/>
          <geom fromto="0 0 0 .2 0 0" size=".02"/>
          <body name="finger" pos=".2 0 0"><joint axis="0 0 1"/><geom fromto="0 0 0 .05 0 0" size=".01"/></body>
        </body>
      </body>
      <body name="tail" pos="-.1 0 0"><joint name="wag" axis="0 0 1"/><geom fromto="0 0 0 -.2 0 0" size=".02"/></body>
    </body>
  </worldbody>
  <tendon>
    <fixed name="bend"><joint joint="elbow" coef="2"/></fixed>
    <fixed name="both"><joint joint="elbow" coef="1"/><joint joint="wag" coef="1"/></fixed>
  </tendon>
  <equality><weld body1="handle" body2="lower"/></equality>
  <actuator>
    <motor name="m" joint="shoulder"/><velocity joint="roll" kv="1"/><general tendon="bend"/>
    <motor name="both" tendon="both"/><motor name="wag" joint="wag"/>
  </actuator>
  <sensor><actuatorfrc name="push" actuator="m"/><jointpos name="where" joint="shoulder"/></sensor>
  <keyframe>
    <key name="other" qpos="0 0 .4 1 0 0 0  0 0 0 0 0"/>
    <key name="lie" qpos=".5 .6 .2 .7071 0 0 .7071  .2 .1 .3 .4 .5"/>
  </keyframe>
</mujoco>
"""
TAMED = """
name = "Wild"
model = "wild.xml"
home = "lie"

[posture]
shoulder = 0.3
nod = 0.2

[arm]
joints = ["shoulder", "roll", "elbow"]
limits = [[-1.2, 1.2], [-1.0, 1.0], [-0.9, 1.4]]

[head]
joints = ["turn", "nod"]

[camera]
name = "eye"

[marker]
body = "lower"
position = [0.2, 0.0, 0.0]

[add]
fixed_base = true
freeze = "rest"

[add.neck]
body = "base"
position = [0.0, 0.1, 0.3]
forward = [1.0, -1.0, 0.0]
joints = ["turn", "nod"]
limits = [[-1.5, 1.5], [-0.8, 1.0]]

[add.camera]
fovy = 50.0

[add.servos]
shoulder = { kp = 200.0, kv = 8.0, force = 30.0 }
roll = { kp = 200.0, kv = 8.0 }
elbow = { kp = 60.0, kv = 2.0 }
"""


CONFINED = "[ranges]\nconfined = [[-1.2, 1.2], [-0.3, 1.0], [-0.9, 1.4]]\n\n[add]"  # as far as the limits, in degrees


@pytest.fixture
def wild(tmp_path: Path) -> Robot:
    """Writes that robot, with pieces of text in its model or anatomy replaced by others, and gives the anatomy."""

    def write(*changes: tuple[str, str], model: tuple[str, str] = ("", "")) -> Path:
        text = TAMED
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        assert model[0] in WILD
        (tmp_path / "wild.xml").write_text(WILD.replace(*model) if model[0] else WILD)
        (tmp_path / "wild.toml").write_text(text)
        return tmp_path / "wild.toml"

    return write


def added(path: Path) -> tuple[mujoco.MjSpec, mujoco.MjModel, mujoco.MjData]:
    """The spec with what the anatomy adds, what it compiles to, and its home posture."""
    anatomy = Anatomy.load(path)
    spec = mujoco.MjSpec.from_file(str(anatomy.model))
    home = add(spec, anatomy)
    assert home is not None
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key(home).id)
    mujoco.mj_forward(model, data)
    return spec, model, data


def test_model_stays_as_it_is_where_nothing_is_added(robot: Robot) -> None:
    """Not a byte of it changes."""
    anatomy = Anatomy.load(robot())
    spec, untouched = (mujoco.MjSpec.from_file(str(anatomy.model)) for _ in range(2))
    assert add(spec, anatomy) is None
    assert spec.to_xml() == untouched.to_xml()


def test_wild_robot_keeps_the_contract_of_bodies_with_physics(wild: Robot) -> None:
    """What no one wrote for us runs, and arm and head are stepped apart."""
    check_body(lambda: MujocoBody(wild(("[add]", CONFINED))), pictures=False)
    assert MujocoBody(wild(), motion="kinematic").reset().arm == pytest.approx([0.3, 0.1, 0.3])
    body = MujocoBody(wild())
    assert body.arm_moves_alone
    assert body.model.joint("shoulder").range.tolist() == pytest.approx([-1.2, 1.2])
    assert body.arm.lower.tolist() == pytest.approx([-1.2, -1.0, -0.9])
    assert body.arm.velocity.tolist() == [3.0, 3.0, 3.0]


def test_home_is_the_keyframe_and_over_it_the_posture(wild: Robot) -> None:
    """The base stands where the keyframe has it, although its joint is gone, and joints are where the two say."""
    body = MujocoBody(wild())
    reading = body.reset()
    assert reading.arm == pytest.approx([0.3, 0.1, 0.3]) and reading.head == pytest.approx([0.0, 0.2])
    for _ in range(30):
        reading = body.step(reading.arm_command, reading.head_command)
    assert body.data.body("base").xpos == pytest.approx([0.5, 0.6, 0.2], abs=1e-12)
    assert body.data.body("base").xmat.reshape(3, 3)[:, 0] == pytest.approx([0, 1, 0], abs=1e-4)
    assert reading.arm == pytest.approx([0.3, 0.1, 0.3], abs=0.02)
    assert (body.model.njnt, body.model.nkey, body.model.neq) == (5, 1, 0)


def test_bodies_stand_at_home_as_in_the_whole_model(wild: Robot) -> None:
    """Where a frozen tail and finger are, and the hand, the model itself tells."""
    _spec, _model, data = added(wild())
    whole = mujoco.MjModel.from_xml_string(WILD)
    truth = mujoco.MjData(whole)
    mujoco.mj_resetDataKeyframe(whole, truth, whole.key("lie").id)
    truth.joint("shoulder").qpos = 0.3
    mujoco.mj_kinematics(whole, truth)
    for name in ("base", "upper", "lower", "finger", "tail"):
        assert data.body(name).xpos == pytest.approx(truth.body(name).xpos, abs=1e-9)
        assert data.body(name).xquat == pytest.approx(truth.body(name).xquat, abs=1e-9)


def test_some_joints_freeze_and_others_stay(wild: Robot) -> None:
    """A list of names; the base stays free unless it is to be fixed."""
    listed = wild(('freeze = "rest"', 'freeze = ["wag"]'))
    assert {joint.name for joint in added(listed)[0].joints} == {
        *("shoulder", "roll", "elbow", "turn", "nod"),
        "somatopy_joint_4",
    }
    loose = wild(('fixed_base = true\nfreeze = "rest"', 'freeze = ["wag"]'))
    _spec, model, data = added(loose)
    assert model.body("base").jntnum[0] == 1
    assert data.body("base").xpos == pytest.approx([0.5, 0.6, 0.2])


@pytest.mark.parametrize(
    ("turns", "angles", "looks", "up"),
    [
        ('"pan", "tilt"', [0, 0], [1, 0, 0], [0, 0, 1]),
        ('"pan", "tilt"', [0.5, 0], [np.cos(0.5), np.sin(0.5), 0], [0, 0, 1]),
        ('"pan", "tilt"', [0, 0.5], [np.cos(0.5), 0, -np.sin(0.5)], [np.sin(0.5), 0, np.cos(0.5)]),
        ('"pan", "tilt"', [np.pi / 2, 0.5], [0, np.cos(0.5), -np.sin(0.5)], [0, np.sin(0.5), np.cos(0.5)]),
        ('"tilt", "roll"', [0, 0.5], [1, 0, 0], [0, -np.sin(0.5), np.cos(0.5)]),
        ('"tilt", "pan"', [0.5, np.pi / 2], [0, 1, 0], [np.sin(0.5), 0, np.cos(0.5)]),
    ],
)
def test_neck_turns_as_its_joints_say(
    wild: Robot, turns: str, angles: list[float], looks: list[float], up: list[float]
) -> None:
    """Pan to the left, tilt down, roll with the left side up; in the room, along x, with z up."""
    changes = [('body = "base"\n', 'body = "world"\n'), ("[1.0, -1.0, 0.0]", f"[2.0, 0.0, 0.0]\nturns = [{turns}]")]
    _spec, model, data = added(wild(*changes))
    for name, angle in zip(("turn", "nod"), angles, strict=True):
        data.joint(name).qpos = angle
    mujoco.mj_forward(model, data)
    seen = data.camera("eye").xmat.reshape(3, 3)
    assert -seen[:, 2] == pytest.approx(looks) and seen[:, 1] == pytest.approx(up)
    assert data.camera("eye").xpos == pytest.approx([0, 0.1, 0.3])
    assert model.camera("eye").fovy[0] == 50


def test_camera_on_a_body_looks_forward_in_its_frame(wild: Robot) -> None:
    """`up` need not be perpendicular; `forward` is exact."""
    camera = 'body = "tail"\nposition = [0.0, 0.0, 0.1]\nforward = [0.0, 0.0, -2.0]\nup = [1.0, 0.0, 1.0]\nfovy = 50.0'
    _spec, _model, data = added(wild(("fovy = 50.0", camera)))
    assert data.body("tail").xmat.reshape(3, 3).T @ data.camera("eye").xmat.reshape(3, 3) == pytest.approx(
        np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]), abs=1e-9
    )


def test_servos_replace_what_drives_their_joints_alone(wild: Robot) -> None:
    """Motors, velocity servos and tendons of these joints go, with their sensors; a tendon of others too stays.

    The handle lets the hand go, and the model's defaults do not reach what is added.
    """
    path = wild(('freeze = "rest"', ""))
    spec, model, _data = added(path)
    names = [model.actuator(k).name for k in range(model.nu)]
    servos = [f"somatopy_servo_{name}" for name in ("turn", "nod", "shoulder", "roll", "elbow")]
    assert sorted(names) == sorted(["both", "wag", *servos])
    assert [sensor.name for sensor in spec.sensors] == ["where"]
    assert (model.neq, model.nmocap) == (0, 0)
    shoulder = model.actuator("somatopy_servo_shoulder")
    assert shoulder.gainprm[0] == 200 and shoulder.biasprm[:3].tolist() == [0, -200, -8]
    assert shoulder.gear[0] == 1 and not shoulder.ctrllimited[0] and shoulder.forcerange.tolist() == [-30, 30]
    assert not model.actuator("somatopy_servo_roll").forcelimited[0]
    assert model.joint("turn").damping[0] == 0 and model.joint("turn").stiffness[0] == 0
    assert model.opt.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST


def test_rotor_of_a_motor_that_is_replaced_turns_on(wild: Robot) -> None:
    """Its inertia and damping behind the gear stay the joint's."""
    motor = '<motor name="m" joint="shoulder"'
    plain, heavy = (
        added(wild(model=(motor, motor + more)))[1] for more in ("", ' armature=".01" damping=".02" gear="3"')
    )
    difference = heavy.joint("shoulder").armature - plain.joint("shoulder").armature
    assert difference[0] == pytest.approx(0.01 * 9)
    assert heavy.joint("shoulder").damping[0] - plain.joint("shoulder").damping[0] == pytest.approx(0.02 * 9)


def test_robot_without_what_is_added_says_what_to_add(wild: Robot) -> None:
    """Each message has the table that mends it."""
    for change, message in (
        (("elbow = { kp = 60.0, kv = 2.0 }", ""), r'has no position servo.*\[add.servos\] "elbow" = \{ kp'),
        (("limits = [[-1.2, 1.2], [-1.0, 1.0], [-0.9, 1.4]]", ""), r"'shoulder' .*no limits.*limits = \[\[low"),
        (("[add.camera]\nfovy = 50.0", ""), r"camera 'eye' does not exist .*Available: none"),
    ):
        with pytest.raises(BodyError, match=message):
            MujocoBody(wild(change))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            ('freeze = "rest"', 'freeze = ["wig"]'),
            r"joint 'wig' does not exist.*wag, and 2 unnamed joints \(on 'base',",
        ),
        (('body = "base"', 'body = "bass"'), r"The body 'bass' does not exist .*Available: world, handle, base"),
        (("shoulder = 0.3", "shudder = 0.3"), r"The joint 'shudder' does not exist"),
        (("roll = { kp", "rool = { kp"), r"The joint 'rool' does not exist"),
        (("roll = { kp", "wag = { kp"), r"joint 'wag' in \[add.servos\] goes away by \[add\] freeze"),
        (('"turn", "nod"', '"wag", "nod"'), r"has a joint 'wag' already, so that none of this name can be added"),
    ],
)
def test_what_cannot_be_added_is_named(wild: Robot, change: tuple[str, str], message: str) -> None:
    """Names that do not exist, that exist already, or that go away."""
    with pytest.raises(BodyError, match=message):
        MujocoBody(wild(change))


URDF = """
<robot name="post">
  <link name="floor"/>
  <link name="post"><inertial><mass value="1"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><box size=".1 .1 .4"/></geometry></collision></link>
  <link name="arm"><inertial><origin xyz=".1 0 0"/><mass value=".5"/>
    <inertia ixx=".001" iyy=".002" izz=".002" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz=".15 0 0"/><geometry><box size=".1 .04 .04"/></geometry></collision></link>
  <link name="hand"/>
  <joint name="stand" type="fixed"><parent link="floor"/><child link="post"/><origin xyz="0 0 .2"/></joint>
  <joint name="lift" type="revolute"><parent link="post"/><child link="arm"/><origin xyz=".05 0 .1"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="20" velocity="2"/></joint>
  <joint name="wrist" type="fixed"><parent link="arm"/><child link="hand"/><origin xyz=".2 0 0"/></joint>
</robot>
"""
ON_POST = """
name = "Post"
model = "post.urdf"
arm = { joints = ["lift"] }
head = { joints = ["turn"] }
camera = { name = "eye" }
marker = { body = "hand", position = [0.05, 0.0, 0.0] }

[add]
neck = { body = "floor", position = [0.0, 0.0, 0.6], joints = ["turn"], limits = [[-1.0, 1.0]] }
camera = { fovy = 60 }
servos = { lift = { kp = 200, kv = 6 } }
"""


def test_robot_of_a_urdf_runs(tmp_path: Path) -> None:
    """It has no camera and no servos ever; links that are fixed to others keep their names."""
    (tmp_path / "post.urdf").write_text(URDF)
    (tmp_path / "post.toml").write_text(ON_POST)
    body = MujocoBody(tmp_path / "post.toml")
    for _ in range(30):
        reading = body.step([0.5], [-0.4])
    assert reading.arm == pytest.approx([0.5], abs=0.02) and reading.head == pytest.approx([-0.4], abs=0.01)
    hand = body.model.body("hand").id
    assert body.data.xpos[hand] == pytest.approx([0.05 + 0.2 * np.cos(0.5), 0, 0.3 - 0.2 * np.sin(0.5)], abs=0.01)
