"""What a model has, found from its tree of bodies and its names."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from somatopy.bodies import MODELS, BodyError
from somatopy.bodies.survey import home_data, read_model, survey

JOINT = '<joint name="{}" axis="0 1 0" range="-1 1"/>'
GEOM = '<geom size=".02" pos=".05 0 0"/>'


def chain(names: str, end: str = "", body: str = "link") -> str:
    """Bodies one in the other, 10 cm apart, each with a joint of one of the names; `end` stands in the last."""
    text = end
    for name in reversed(names.split()):
        text = f'<body name="{name}_{body}" pos=".1 0 0">{JOINT.format(name)}{GEOM}{text}</body>'
    return text


def model(bodies: str, more: str = "") -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{bodies}</worldbody>{more}</mujoco>")


@pytest.fixture(scope="module")
def nao() -> mujoco.MjModel:
    return read_model(MODELS["nao"].with_name("nao.xml"))


def test_nao_has_two_arms_a_head_and_three_cameras(nao: mujoco.MjModel) -> None:
    """The left arm comes first; what the anatomy says of arm, head and camera is among what was found."""
    found = survey(nao)
    left, right, *_ = found.arms
    assert left.joints == ("LShoulderPitch", "LShoulderRoll", "LElbowYaw", "LElbowRoll", "LWristYaw")
    assert right.joints == tuple(name.replace("L", "R", 1) for name in left.joints)
    assert (left.base, left.tip, right.tip) == ("torso", "l_wrist", "r_wrist")
    assert {(head.joints, head.camera) for head in found.heads} == {
        (("HeadYaw", "HeadPitch"), "CameraTop"),
        (("HeadYaw", "HeadPitch"), "CameraBottom"),
    }
    assert [camera.name for camera in found.cameras] == ["outside", "CameraTop", "CameraBottom"]
    assert found.home == "StandInit" and all(joint.servo and joint.limits for joint in found.joints)


def test_reach_is_measured_along_the_links() -> None:
    """Three links of 10 cm and a geom 5 cm beyond the last joint, whatever the posture is."""
    straight = model(chain("a b c"))
    bent = model(chain("a b c"), '<keyframe><key name="home" qpos=".3 -.8 .9"/></keyframe>')
    assert survey(straight).arms[0].reach == pytest.approx(0.25)
    assert survey(bent).arms[0].reach == pytest.approx(0.25)


def test_a_branch_ends_an_arm_and_fingers_are_none() -> None:
    """Two fingers on a palm are chains of their own; one jaw in line with the arm is cut off it."""
    fingers = f'<body name="palm" pos=".1 0 0">{GEOM}{chain("index_finger")}{chain("thumb_finger")}</body>'
    assert survey(model(chain("s e w x", fingers))).arms[0].joints == ("s", "e", "w", "x")
    assert survey(model(chain("s e w x", fingers))).arms[0].tip == "palm"
    assert survey(model(chain("s e w x finger_joint"))).arms[0].joints == ("s", "e", "w", "x")


def test_a_long_chain_gives_its_last_seven_joints() -> None:
    """A snake of ten hinges."""
    names = "a b c d e f g h i j"
    assert survey(model(chain(names))).arms[0].joints == tuple(names.split()[-7:])


def test_free_and_ball_joints_are_no_part_of_an_arm() -> None:
    """What is behind them is."""
    free = model(f'<body name="trunk"><freejoint name="float"/>{GEOM}{chain("s e w x")}</body>')
    found = survey(free)
    assert found.arms[0].joints == ("s", "e", "w", "x")
    assert found.joint("float").kind == "free" and found.joint("float").limits is None


def test_joints_without_names_make_no_arm() -> None:
    """An anatomy could not name them."""
    nameless = chain("s e w x").replace('name="e" ', "")
    assert survey(model(nameless)).arms == ()


def test_the_arm_of_which_a_head_is_none_is_one_that_can_carry_a_marker() -> None:
    """The proposal takes that arm, and a joint cannot be of both."""
    nameless = chain("s e w x", body="arm").replace('<body name="x_arm"', "<body")
    neck = chain("pan tilt", '<camera name="eye"/>')
    found = survey(model(nameless + neck))
    assert [arm.tip for arm in found.arms] == ["", "tilt_link"] and found.heads == ()


def test_a_camera_that_follows_or_sits_on_the_arm_is_no_eye() -> None:
    """Nor is one that only the trunk moves under the arm; the one on a neck is."""
    head = chain("pan tilt", '<camera name="eye"/>')
    arm = chain("s e w x", '<camera name="wrist_camera"/>')
    tracking = head.replace('name="eye"', 'name="eye" mode="trackcom"')
    trunk = f'<body name="trunk">{JOINT.format("waist")}{GEOM}<camera name="chest"/>%s</body>'
    assert [head.camera for head in survey(model(trunk % (arm + head))).heads] == ["eye"]
    assert survey(model(trunk % (arm + tracking))).heads == ()


def test_of_a_long_neck_one_joint_pans_and_one_tilts() -> None:
    """By the directions of their axes to the camera, which looks along the world's x."""
    turns = {"roll": "1 0 0", "pan": "0 0 1", "roll_more": "1 0 .1", "tilt": "0 1 0", "slant": "1 1 1"}
    camera = '<camera name="eye" xyaxes="0 -1 0 0 0 1"/>'
    neck = chain(" ".join(turns), camera)
    for name, axis in turns.items():
        neck = neck.replace(JOINT.format(name), JOINT.format(name).replace("0 1 0", axis))
    assert survey(model(chain("s e w x") + neck)).heads[0].joints == ("pan", "tilt")


def test_only_plain_position_servos_count() -> None:
    """A motor is none, nor is a servo with a gear or a filter."""
    more = """<actuator><position joint="a" kp="5"/><motor joint="b"/><position joint="c" kp="5" gear="2"/>
              <position joint="d" kp="5" timeconst=".1"/></actuator>"""
    found = survey(model(chain("a b c d"), more))
    assert [found.joint(name).servo for name in "abcd"] == [True, False, False, False]


def test_the_model_stays_as_it_is(nao: mujoco.MjModel) -> None:
    """Not a byte of it changes."""
    before = np.empty(mujoco.mj_sizeModel(nao), np.uint8)
    after = before.copy()
    mujoco.mj_saveModel(nao, None, before)
    survey(nao)
    mujoco.mj_saveModel(nao, None, after)
    assert (before == after).all()


def test_home_is_inside_the_limits() -> None:
    """Also where a joint's zero is not."""
    bent = model(chain("a b").replace("-1 1", ".5 1"))
    assert home_data(bent, None).qpos == pytest.approx(np.deg2rad([0.5, 0.5]))


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (None, ["does not exist"]),
        ("<mujoco><worldbody>", ["MuJoCo cannot read", "Correct the line"]),
        (
            '<mujoco><asset><mesh name="m" file="gone.stl"/></asset><worldbody/></mujoco>',
            ["gone.stl", "meshdir", "Put the file there"],
        ),
        (
            '<mujoco><worldbody><body name="b"><joint/></body></worldbody></mujoco>',
            ["mass and inertia", "<inertial mass="],
        ),
        (
            f'<mujoco><worldbody>{chain("a b")}</worldbody><keyframe><key name="h" qpos="0 nan"/></keyframe></mujoco>',
            ["keyframe 'h'", "qpos that is no number"],
        ),
        ('<mujoco><option gravity="0 0 nan"/></mujoco>', ["<option/>", "gravity that is no number"]),
        (f"<mujoco><worldbody>{chain('Zoë')}</worldbody></mujoco>", ["not in UTF-8", "Save the file as UTF-8"]),
    ],
)
def test_models_that_cannot_be_read_say_how_to_mend_them(
    tmp_path: Path, text: str | None, parts: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """File, reason and mend."""
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its log into the current folder
    path = tmp_path / "robot.xml"
    if text is not None:
        path.write_text(text, encoding="latin-1")
    with pytest.raises(BodyError) as caught:
        read_model(path)
    assert all(part in str(caught.value) for part in ["robot.xml", *parts]), str(caught.value)


def test_what_is_no_file_of_a_model_is_told_what_one_is_called(tmp_path: Path) -> None:
    """MuJoCo goes by the ending of a name; a folder has none."""
    (tmp_path / "robot.txt").write_text(f"<mujoco><worldbody>{chain('a')}</worldbody></mujoco>")
    with pytest.raises(BodyError, match=r"call it robot\.xml \(MJCF\) or robot\.urdf\.$"):
        read_model(tmp_path / "robot.txt")
    with pytest.raises(BodyError, match=r"is a folder\. Name the file in it"):
        read_model(tmp_path)
