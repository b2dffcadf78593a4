"""somatopy check-body: broken and unusual models, each with a sentence that says how to mend it, and its exit code."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from somatopy.bodies import MODELS, Anatomy, MujocoBody, rendering
from somatopy.cli import main
from somatopy.percept import Image

NAO = MODELS["nao"].with_name("nao.xml")
MJCF = """<mujoco model="clerk">
  <option integrator="implicitfast"/>
  <worldbody>
    <light pos="1 0 2"/>
    <body name="trunk" pos="0 0 .5">
      <geom type="box" size=".04 .06 .1"/>
      <body name="upper_arm" pos="0 .09 .08">
        <joint name="swing" axis="0 1 0" range="-100 60" damping=".1"/>
        <geom type="capsule" fromto="0 0 0 .12 0 0" size=".015" mass=".1"/>
        <body name="lower_arm" pos=".12 0 0">
          <joint name="spread" axis="0 0 1" range="-90 30" damping=".1"/>
          <geom type="capsule" fromto="0 0 0 .1 0 0" size=".012" mass=".05"/>
          <body name="hand" pos=".1 0 0">
            <joint name="turn" axis="1 0 0" range="-60 60" damping=".1"/>
            <geom name="palm" type="box" size=".02 .015 .01" pos=".02 0 0" mass=".03"/>
          </body>
        </body>
      </body>
      <body name="neck" pos="0 0 .15">
        <joint name="pan" axis="0 0 1" range="-80 80" damping=".1"/>
        <geom type="sphere" size=".03" mass=".1"/>
        <body name="face">
          <joint name="tilt" axis="0 1 0" range="-40 60" damping=".1"/>
          <geom type="sphere" size=".03" mass=".1"/>
          <camera name="gaze" pos=".04 0 0" xyaxes="0 -1 0 .4 0 .9" fovy="60"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position joint="swing" kp="20" kv="1"/> <position joint="spread" kp="20" kv="1"/>
    <position joint="turn" kp="5" kv=".3"/> <position joint="pan" kp="20" kv="1"/>
    <position joint="tilt" kp="20" kv="1"/>
  </actuator>
</mujoco>"""
ANATOMY = """
name = "Clerk"
model = "clerk.xml"
[arm]
joints = ["swing", "spread", "turn"]
[head]
joints = ["pan", "tilt"]
[camera]
name = "gaze"
[marker]
body = "hand"
position = [0.07, 0.0, 0.0]
"""
URDF = """<robot name="crane">
  {links}
  {joints}
</robot>"""
LINK = """<link name="{}"><inertial><mass value=".2"/>
  <inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><origin xyz=".1 0 0"/><geometry><box size=".15 .03 .03"/></geometry></collision></link>"""
LIMITED = """<joint name="{}_joint" type="revolute"><parent link="{}"/><child link="{}"/><origin xyz="{} 0 .02"/>
  <axis xyz="{}"/><limit lower="-1" upper="1" effort="20" velocity="2"/></joint>"""

Changes = tuple[tuple[str, str], ...]
Checked = Callable[..., tuple[int, str, str]]


@pytest.fixture
def checked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Checked:
    """Check a robot in an empty folder: exit code, what it said, the lines joined, and standard output as it is."""
    monkeypatch.chdir(tmp_path)

    def check(*args: str) -> tuple[int, str, str]:
        code = main(["check-body", *args])
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return code, " ".join((out + err).split()), out

    return check


def write(folder: Path, model: Changes = (), anatomy: Changes = ()) -> None:
    """The clerk, with pieces of text replaced in its model and anatomy."""
    texts = {"clerk.xml": (MJCF, model), "clerk.toml": (ANATOMY, anatomy)}
    for name, (text, changes) in texts.items():
        for old, new in changes:
            assert old in text, old
            text = text.replace(old, new)
        (folder / name).write_text(text)


def servos(*joints: str) -> Changes:
    """The changes that take the servos of joints away."""
    lines = re.findall(r'<position joint="\w+"[^>]*/>', MJCF)
    return tuple((line, "") for line in lines if any(f'"{joint}"' in line for joint in joints))


def test_a_sound_robot_has_nothing_wrong(checked: Checked, tmp_path: Path) -> None:
    """Shares of postures, physics, and the line to type; --json has the same."""
    write(tmp_path)
    code, said, out = checked("clerk.toml")
    assert code == 0 and "Wrong" not in said and "Note" not in said
    assert "somatopy run best --body.model clerk.toml --eye geometric" in out
    assert max(map(len, out.splitlines())) <= 100
    code, _, out = checked("clerk.toml", "--json")
    found = json.loads(out)
    assert code == 0 and found["runs"] and found["faults"] == [] and found["physics"]["diverged"] is None
    assert 0 < found["sight"]["fixed_rate"] < found["sight"]["rate"] <= 1
    assert f"can be seen in {found['sight']['rate']:.0%} of 300" in said
    assert f"sees it in {found['sight']['fixed_rate']:.0%}" in said


BROKEN: dict[str, tuple[Changes, Changes, tuple[str, ...]]] = {
    "a joint that the model does not have": ((), (('"turn"', '"twist"'),), ("'twist' does not exist", "turn")),
    "no limits, and none in the anatomy": (((' range="-100 60"', ""),), (), ("'swing'", "has no limits", "limits")),
    "a marker that does not move": (
        (),
        (('body = "hand"', 'body = "trunk"'),),
        ("'trunk'", "none of the arm's joints"),
    ),
    "a camera that no head moves": (
        (("<light", '<camera name="room"/><light'),),
        (('"gaze"', '"room"'),),
        ("'room'", "none of the head's joints", "[add.neck]"),
    ),
    "a marker hidden in the hand": (
        (('size=".02 .015 .01" pos=".02 0 0"', 'size=".08 .03 .03" pos=".02 0 0"'),),
        (),
        ("never seen", "inside a shape of 'hand'", "[marker] position"),
    ),
    "a camera that looks away": (
        (('xyaxes="0 -1 0 .4 0 .9" fovy="60"', 'xyaxes="0 1 0 0 0 1" fovy="20"'), ('"-100 60"', '"-60 60"')),
        (),
        ("never seen", "'gaze' looks elsewhere", "[add.neck]"),
    ),
    "a picture too small for the tags": (
        (),
        (('name = "gaze"', 'name = "gaze"\nwidth = 32\nheight = 24'),),
        ("never seen", "too small in a picture of 32 x 24", "width = 64, height = 48"),
    ),
    "XML that is cut off": ((("</worldbody>", ""),), (), ("clerk.xml", "MuJoCo cannot read")),
    "a mesh that is not there": (
        (
            (
                "<worldbody>",
                '<asset><mesh name="m" file="hand.stl"/></asset><worldbody>',
            ),
        ),
        (),
        ("hand.stl", "meshdir"),
    ),
    "an unknown key": ((), (("[camera]", "colour = 3\n[camera]"),), ("clerk.toml", "colour")),
}


@pytest.mark.parametrize("name", BROKEN)
def test_what_stops_a_robot_is_told_with_the_mend(checked: Checked, tmp_path: Path, name: str) -> None:
    """Exit code 1, and the sentence."""
    model, anatomy, parts = BROKEN[name]
    write(tmp_path, model, anatomy)
    code, said, _ = checked("clerk.toml")
    assert code == 1 and "This robot cannot run yet." in said
    assert all(part in said for part in parts), said


ODD: dict[str, tuple[Changes, Changes, tuple[str, ...]]] = {
    "no servos": (
        servos("swing", "spread", "turn", "pan", "tilt"),
        (),
        ("0 of 5", "Physics cannot move", "<position joint=", "--motion kinematic"),
    ),
    "a free joint": (
        (('<geom type="box" size=".04', '<freejoint name="loose"/><geom type="box" size=".04'),),
        (),
        ("'loose'", "fixed_base = true"),
    ),
    "a joint of the other arm": (
        (
            (
                '</body>\n      <body name="neck"',
                '</body><body name="lid"><joint name="lid" range="0 9"/><geom size=".01"/></body><body name="neck"',
            ),
            ("<actuator>", '<actuator><position joint="lid" kp="2" kv=".1"/>'),
        ),
        (('"turn"]', '"turn", "lid"]'),),
        ("'lid' does not move the marker", "[arm] joints"),
    ),
    "lengths in millimetres": (
        ((".12 0 0", "120 0 0"), (".1 0 0", "100 0 0")),
        (),
        ("millimetres", "divide each pos", 'scale="0.001'),
    ),
    "radians that are read as degrees": (
        (('"-100 60"', '"-1.7 1"'), ('"-90 30"', '"-1.5 .5"'), ('"-60 60"', '"-1 1"')),
        (),
        ("more than 2.7 degrees", '<compiler angle="radian"/>'),
    ),
    "a loop that an equality closes": (
        (("<actuator>", '<equality><connect body1="hand" body2="trunk" anchor="0 0 0"/></equality><actuator>'),),
        (),
        ("ties 'hand' to 'trunk'", "<equality>"),
    ),
    "a joint that follows another": (
        (("<actuator>", '<equality><joint joint1="turn" joint2="swing"/></equality><actuator>'),),
        (),
        ("'turn' follows the joint 'swing'", "<mimic>", "Leave one of them out"),
    ),
    "an arm whose hand has no name": (
        (('<body name="hand"', "<body"),),
        (('"hand"', '"lower_arm"'), (', "turn"]', "]")),
        ("swing, spread, turn look most like an arm", '<body name="hand">'),
    ),
    "something in the way": (
        (("<worldbody>", '<worldbody><body name="wall"><geom type="box" size=".3 .01 .3" pos=".2 .05 .5"/></body>'),),
        (),
        ("'lower_arm' touched 'wall'", "confined", '<exclude body1="lower_arm" body2="wall"/>'),
    ),
    "a joint without name": (
        (('<body name="neck"', '<body name="lid"><joint range="0 9"/><geom size=".01"/></body><body name="neck"'),),
        (),
        ("Without name", "1 of 6", "lid", "<joint name="),
    ),
}


@pytest.mark.parametrize("name", ODD)
def test_what_is_odd_is_noted_with_the_mend(checked: Checked, tmp_path: Path, name: str) -> None:
    """The sentence; the robot can run, but for the one a hundred metres long, which sees its hand nowhere."""
    model, anatomy, parts = ODD[name]
    write(tmp_path, model, anatomy)
    code, said, _ = checked("clerk.toml")
    assert "Note" in said and all(part in said for part in parts), said
    assert code == ("millimetres" in name)


@pytest.mark.parametrize(
    ("bodies", "part"),
    [
        ('<body name="stone"><geom size=".1"/></body>', "no hinge and no slide"),
        ('<body name="ball"><freejoint/><geom size=".1"/></body>', "no hinge and no slide"),
        ('<body name="door"><joint/><geom size=".1"/></body>', "Write names into the model"),
    ],
)
def test_a_model_that_has_no_arm(checked: Checked, tmp_path: Path, bodies: str, part: str) -> None:
    """No degrees of freedom, only six loose ones, none with a name: what to write, and no proposal."""
    (tmp_path / "thing.xml").write_text(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
    code, said, out = checked("thing.xml", "--propose")
    assert code == 1 and part in said and out == ""


@pytest.mark.parametrize(
    ("args", "part"),
    [
        (["gone.xml"], "neither a file nor a robot"),
        (["nao", "--propose"], "has an anatomy already"),
        (["clerk.xml", "--json", "--propose"], "Choose"),
        (["clerk.xml", "--picture", "robot.jpg"], "must be a PNG"),
    ],
)
def test_wrong_use(checked: Checked, tmp_path: Path, args: list[str], part: str) -> None:
    """Exit code 2."""
    write(tmp_path)
    code, said, out = checked(*args)
    assert code == 2 and part in said.replace("use --json", "Choose") and out == ""


# -- proposals ---------------------------------------------------------------------------------------------------------


def crane(folder: Path) -> None:
    names = ("slew", "boom", "jib", "tool")
    joints = [
        LIMITED.format(name, before, name, ".2" if k else "0", "0 1 0" if k % 2 else "0 0 1")
        for k, (before, name) in enumerate(zip(("base", *names), names, strict=False))
    ]
    joints.append(LIMITED.format("lid", "base", "lid", "-.3", "0 0 1"))  # which is neither of arm nor head
    links = "".join(map(LINK.format, ("base", *names, "lid")))
    (folder / "crane.urdf").write_text(URDF.format(links=links, joints="".join(joints)))


def bare(folder: Path, *changes: tuple[str, str]) -> None:
    write(folder, changes)


FOREIGN: dict[str, Callable[[Path], object]] = {
    "nao.xml": lambda folder: (folder / "nao.xml").write_text(NAO.read_text()),
    "crane.urdf": crane,
    "clerk.xml": lambda folder: bare(folder, *servos("swing", "turn", "tilt"), (' range="-100 60"', "")),
    "floating.xml": lambda folder: (folder / "floating.xml").write_text(
        MJCF.replace('<geom type="box" size=".04', '<freejoint name="loose"/><geom type="box" size=".04').replace(
            '<camera name="gaze" pos=".04 0 0" xyaxes="0 -1 0 .4 0 .9" fovy="60"/>', ""
        )
    ),
    "rail.xml": lambda folder: (folder / "rail.xml").write_text(
        """<mujoco><worldbody><geom type="plane" size="2 2 .1"/>
        <body name="cart" pos="0 0 .3"><joint name="rail" type="slide" axis="0 1 0"/>
        <geom type="box" size=".05 .05 .02"/>
        <body name="rod" pos="0 0 .03"><joint name="swing" axis="0 1 0" damping=".1"/>
        <geom type="capsule" fromto="0 0 0 .2 0 0" size=".01"/></body></body></worldbody></mujoco>"""
    ),
}


@pytest.mark.parametrize("name", FOREIGN)
def test_a_proposal_runs_as_it_is(checked: Checked, tmp_path: Path, name: str) -> None:
    """It parses, builds, sees its hand and moves for 100 frames by physics, staying near where it is sent."""
    FOREIGN[name](tmp_path)
    code, said, out = checked(name, "--propose")
    assert code == 0, said
    (tmp_path / "my.toml").write_text(out)
    body = MujocoBody("my.toml")
    low, high = body.ranges["confined"].T
    assert (body.arm.lower < low).all() and (low < high).all() and (high < body.arm.upper).all()
    target, head = 0.3 * low + 0.7 * high, 0.5 * (body.head.lower + body.head.upper)
    for _ in range(100):
        reading = body.step(target, head)
    assert np.abs(reading.arm - target).max() < 0.1 and np.abs(reading.head - head).max() < 0.1
    body.close()


def test_quiet_a_sound_proposal_stands_alone(checked: Checked, tmp_path: Path) -> None:
    """Nothing is said beside it. What stops a robot is an error, and is said."""
    write(tmp_path)
    code, said, out = checked("clerk.xml", "--propose", "--quiet")
    assert code == 0 and said == " ".join(out.split()) and tomllib.loads(out)["arm"]["joints"]
    (tmp_path / "thing.xml").write_text("<mujoco><worldbody/></mujoco>")
    code, said, out = checked("thing.xml", "--propose", "--quiet")
    assert (code, out) == (1, "") and "arm" in said


def test_a_proposal_leaves_a_model_as_it_is(checked: Checked, tmp_path: Path) -> None:
    """NAO's needs no neck, no camera and no servo, and its arm begins with the paper's joints."""
    (tmp_path / "nao.xml").write_text(NAO.read_text())
    (tmp_path / "my.toml").write_text(checked("nao.xml", "--propose")[2])
    mine, ours = Anatomy.load(tmp_path / "my.toml"), Anatomy.load(MODELS["nao"])
    assert mine.arm.joints[:4] == ours.arm.joints and mine.head.joints == ours.head.joints
    assert (mine.camera, mine.marker.body, mine.home) == (ours.camera, ours.marker.body, ours.home)
    assert mine.add.neck is None and mine.add.camera is None and mine.add.servos == {}


def test_an_anatomy_is_tried_on_another_model(checked: Checked, tmp_path: Path) -> None:
    """Whatever model it names."""
    write(tmp_path, (), (('"clerk.xml"', '"gone.xml"'),))
    assert checked("clerk.toml")[0] == 1
    code, said, _ = checked("clerk.xml", "--anatomy", "clerk.toml")
    assert code == 0 and "clerk.xml" in said


# -- the picture -------------------------------------------------------------------------------------------------------


@pytest.mark.gl
def test_the_picture_shows_robot_and_tags(checked: Checked, tmp_path: Path) -> None:
    """Outside and eye, twice: tags are outlined in the colour that nothing else has."""
    write(tmp_path)
    code, said, _ = checked("clerk.toml", "--picture", "clerk.png")
    assert code == 0 and "clerk.png" in said
    import cv2

    drawn: Image = cv2.imread("clerk.png")[..., ::-1]
    outlined = (np.abs(drawn.astype(int) - [0xE6, 0x00, 0x7E]).max(axis=2) < 8).sum()
    assert min(drawn.shape[:2]) > 500 and outlined > 200


def test_without_opengl_there_is_no_picture(checked: Checked, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One sentence, and everything else as ever."""
    monkeypatch.setattr(rendering, "_BACKENDS", ())
    monkeypatch.setattr(rendering, "_context_class", rendering._context_class.__wrapped__)
    write(tmp_path)
    code, said, _ = checked("clerk.toml", "--picture", "clerk.png")
    assert code == 0 and "No picture is drawn." in said and "OpenGL" in said and not Path("clerk.png").exists()
