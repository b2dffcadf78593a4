"""Models that were made for other ends: what they bring is put right, or refused in one sentence with its mend."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest

from somatopy.bodies import BodyError, MujocoBody
from somatopy.bodies.foreign import check_servos, prepare, said
from somatopy.bodies.loading import compiled, parse
from somatopy.bodies.marker import SITE, add_marker
from somatopy.eyes import FiducialEye, GeometricEye
from somatopy.percept import Image, Marker

Robot = Callable[..., Path]
Change = tuple[str, str]

COMPILER, OPTION, LIGHT = '<compiler angle="radian"/>', '<option integrator="implicitfast"/>', '<light pos="1 0 2"/>'
POST, LIFT_RANGE = '<body name="post"', 'range="-1 1"'
BEGIN = OPTION + "\n  <worldbody>\n    " + LIGHT
PLANE = [(y, z) for y in np.linspace(-3, 0.5, 50) for z in np.linspace(-1, 1.5, 50)]

#: Postures of the plain robot's arm and head in which both eyes find the hand.
SEEN = [([-0.6, -1.5], [-0.4, -0.1]), ([-0.3, -1.5], [-0.9, -0.1]), ([-0.4, -1.4], [-0.8, 0.1])]


def kinematic(path: Path) -> MujocoBody:
    return MujocoBody(str(path), "kinematic")


def hits(body: MujocoBody) -> int:
    """In how many of `SEEN` the rendered eye finds the hand where the geometric eye does."""
    drawn, known = (
        FiducialEye(body.camera, body.marker, skip=False),
        GeometricEye(body.camera, body.marker, body.occluders),
    )
    count = 0
    for arm, head in SEEN:
        found, expected = drawn.look(body.place(arm, head)), known.look(body.place(arm, head))
        count += bool(found and expected and np.abs(np.subtract(found.pixel, expected.pixel)).max() < 2)
    return count


# -- what is put right -------------------------------------------------------------------------------------------------


def with_option(text: str) -> Change:
    return OPTION, OPTION + text


DARK = with_option('<visual><headlight active="0"/></visual>')
SAID = {
    "nothing": ("", ""),
    "discard and fuse": (COMPILER, '<compiler angle="radian" discardvisual="true" fusestatic="true"/>'),
    "tiny extent": with_option('<statistic extent="0.001"/>'),
    "huge extent": with_option('<statistic extent="1e7"/>'),
    "near far plane": with_option('<visual><map zfar="0.1"/></visual>'),
    "far near plane": with_option('<visual><map znear="5" zfar="1e9"/></visual>'),
    "fog": with_option('<visual><map fogstart="0.05" fogend="0.1" haze="1"/></visual>'),
    "headlight only": (LIGHT, ""),
    "no light at all": (BEGIN, DARK[1] + "<worldbody>"),
    "strong lights": (LIGHT, 12 * '<light pos="1 0 2" diffuse="4 4 4" ambient="2 2 2"/>'),
    "invisible geoms": with_option('<default><geom group="4" rgba="1 1 1 0"/></default>'),
    "scaled meshes": with_option('<default><mesh scale="0.001 0.001 0.001"/></default>'),
    "mirrors": with_option('<default><material rgba="1 0 0 0" reflectance="0.9" texrepeat="5 5"/></default>'),
    "turned sites": with_option('<default><site euler="1 1 1" pos="1 1 1"/></default>'),
    "many shapes": (POST, "".join(f'<geom size="0.01" pos="1.5 {y} {z}"/>' for y, z in PLANE) + POST),
}


@pytest.mark.gl
@pytest.mark.parametrize("change", SAID.values(), ids=SAID)
def test_hand_is_found_whatever_the_model_says_of_pictures(robot: Robot, change: Change) -> None:
    """The cube is in the model, before the far plane and behind the near one, lit, among the first shapes drawn."""
    body = kinematic(robot(change))
    assert hits(body) == len(SEEN)
    body.close()


@pytest.mark.gl
def test_picture_shows_no_sites_and_no_rays(robot: Robot) -> None:
    """A ball that is only a mark stands before the camera, and a ray in its view: not one pixel shows them."""
    marks = '<site name="mark" pos=".3 0 .65" size=".05"/><site name="ray" pos=".3 -1 .65" zaxis="0 1 0"/>'
    sensor = '<sensor><rangefinder site="ray"/></sensor><worldbody>'

    def picture(change: Change) -> Image:
        body = kinematic(robot(change))
        drawn = body.picture()
        body.close()
        return drawn

    light = f"<worldbody>\n    {LIGHT}"
    np.testing.assert_array_equal(picture((light, f"{sensor}{LIGHT}{marks}")), picture((light, light)))


URDF = """
<robot name="arm">
  <link name="base"/>
  <link name="boom">
    <inertial><mass value="1.5"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><geometry><cylinder radius=".02" length=".3"/></geometry></visual>
    <collision><geometry><cylinder radius=".02" length=".3"/></geometry></collision>
  </link>
  <link name="tool"/>
  <joint name="lift" type="revolute">
    <parent link="base"/><child link="boom"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="9" velocity="2"/>
  </joint>
  <joint name="flange" type="fixed"><parent link="boom"/><child link="tool"/><origin xyz="0 0 .2"/></joint>
</robot>"""


def test_marker_on_a_link_of_a_urdf_stays_where_it_was_put() -> None:
    """MuJoCo throws away what cannot touch and melts fixed links into others in every URDF that does not forbid it."""
    spec = mujoco.MjSpec.from_string(URDF)
    before = spec.copy().compile()
    prepare(spec, Path("arm.urdf"))
    add_marker(spec, "tool", np.array([0, 0, 0.1]), np.array([1.0, 0, 0]), Marker())
    after = spec.compile()
    assert after.body(after.geom(SITE).bodyid[0]).name == "tool"
    assert after.body_mass.sum() == before.body_mass.sum() == 1.5
    data = mujoco.MjData(after)
    mujoco.mj_kinematics(after, data)
    np.testing.assert_allclose(data.geom(SITE).xpos, [0, 0, 0.3], atol=1e-9)


# -- what is refused ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (('<camera name="eye"', '<site name="somatopy_marker"/><camera name="eye"'), "site 'somatopy_marker'"),
        (
            (
                '<geom type="sphere" size=".04" mass=".1"/>\n        <body name="face">',
                '<geom name="somatopy_marker" size=".04"/>\n        <body name="face">',
            ),
            "geom 'somatopy_marker'",
        ),
        (("<worldbody>", '<asset><material name="somatopy_marker"/></asset><worldbody>'), "material 'somatopy_marker'"),
        (
            (
                "<worldbody>",
                '<asset><mesh name="somatopy_marker" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/></asset><worldbody>',
            ),
            "mesh 'somatopy_marker'",
        ),
        (
            (
                "<worldbody>",
                '<asset><texture name="somatopy_marker" type="2d" builtin="flat" width="8" height="8"/></asset>'
                "<worldbody>",
            ),
            "texture 'somatopy_marker'",
        ),
        ((POST, '<body name="somatopy_body_2"/>' + POST), "body 'somatopy_body_2'"),
    ],
)
def test_names_that_are_ours_are_refused(robot: Robot, change: Change, named: str) -> None:
    """Whatever it is that has such a name."""
    with pytest.raises(BodyError, match=rf"The {named} of .*begins with somatopy_.*another name\."):
        kinematic(robot(change))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ((LIFT_RANGE, 'range="-1 1" limited="false"'), r"'lift' .*no limits.*range=\"low high\" limited=\"true\""),
        ((LIFT_RANGE, 'range="-inf inf"'), r"'lift' .*moves from -inf to inf.*finite limits.*range="),
        (('pos="0 0 .5"', 'pos="nan 0 .5"'), r"body 'post' .*has a pos that is no number"),
        (
            ('kp="20" kv="1"/>\n    <position joint="swing"', 'kp="nan" kv="1"/>\n    <position joint="swing"'),
            r"no number",
        ),
        ((OPTION, '<option timestep="0"/>'), r'physics step of .* is 0 s.*<option timestep="0.002"/>'),
        ((OPTION, '<option timestep="1e-7"/>'), r"physics step of .* is 1e-07 s.*10000 steps at most"),
        (
            ('<body name="jib" pos=".2 0 0">', '<body name="jib" pos="200 0 0">'),
            r"200 m from the camera 'eye'.*0\.001 0\.001",
        ),
        (("<worldbody>", '<asset><mesh name="m" file="m.stl"/></asset><worldbody>'), r"'m.stl'.*<compiler meshdir="),
        (("<worldbody>", '<worldbody><body name="jib"/>'), r"repeated name 'jib' in body"),
    ],
)
def test_model_that_would_spoil_a_run_is_refused(
    robot: Robot, change: Change, message: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """One paragraph: what, where, and what to write instead."""
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its log into the current folder
    with pytest.raises(BodyError, match=message) as caught:
        kinematic(robot(change))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["a\\tb", "$x$"])
def test_joint_that_no_figure_can_name_is_refused(robot: Robot, name: str) -> None:
    """A dot, a blank, a slash or letters of any alphabet may be in a name."""

    def renamed(new: str) -> MujocoBody:
        return kinematic(robot(('"lift"', f'"{new}"'.replace("\\t", "&#9;")), ('"lift"', f'"{new}"')))

    with pytest.raises(BodyError, match=r"joint .* figures cannot show"):
        renamed(name)
    assert renamed("arm/lift.é 1").arm.names[0] == "arm/lift.é 1"


@pytest.mark.parametrize(
    ("file", "mend"), [("package://my_arm/meshes/boom.stl", "strippath"), ("boom.stl", "meshdir"), ("", "")]
)
def test_file_that_a_urdf_names_and_nobody_has_is_answered_with_the_line_to_write(file: str, mend: str) -> None:
    """Where it is looked for, and what to write if it is elsewhere."""
    mesh = URDF.replace(
        '<collision><geometry><cylinder radius=".02" length=".3"/>', f'<collision><geometry><mesh filename="{file}"/>'
    )
    with pytest.raises(ValueError) as caught:
        mujoco.MjSpec.from_string(mesh).compile()
    words = said(caught.value, Path("robots/arm.urdf"))
    assert mend in words and "\n" not in words
    assert not file or ("boom.stl" in words and "looked for in robots" in words)


@pytest.mark.parametrize("folder", ["my_arm", "my_arm-main"])
def test_mesh_of_a_package_is_found_above_the_model(tmp_path: Path, folder: str) -> None:
    """A checkout of a ROS package is read as it is, whatever its folder is called, and from wherever."""
    model = tmp_path / folder / "urdf" / "arm.urdf"
    model.parent.mkdir(parents=True)
    cylinder = '<collision><geometry><cylinder radius=".02" length=".3"/>'
    model.write_text(URDF.replace(cylinder, '<collision><geometry><mesh filename="package://my_arm/meshes/boom.obj"/>'))
    with pytest.raises(BodyError, match=r"boom\.obj.*in a folder NAME"):
        compiled(parse(model), model)
    mesh = tmp_path / folder / "meshes" / "boom.obj"
    mesh.parent.mkdir()
    mesh.write_text("v 0 0 0\nv .3 0 0\nv 0 .02 0\nv 0 0 .02\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    model_read = compiled(parse(model), model)
    assert np.ptp(model_read.mesh_vert, axis=0).max() == pytest.approx(0.3, abs=0.02)


@pytest.mark.parametrize(("file", "before"), [("boxes.urdf", ""), ("boxes.xml", "<!-- <mujoco/> -->")])
def test_first_link_of_a_urdf_passes_through_what_carries_it(tmp_path: Path, file: str, before: str) -> None:
    """As the second passes through the first: MuJoCo lets neighbours touch only where one of them stands fixed.

    A URDF is what has the root <robot>, whatever its file is called.
    """
    box = '<collision><geometry><box size=".2 .2 .2"/></geometry></collision>'
    mass = '<inertial><mass value="1"/><inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial>'
    joint = '<parent link="{}"/><child link="{}"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="9"/>'
    links = "".join(f'<link name="{name}">{mass}{box}</link>' for name in "abcd")
    tied = [("fixed", "a", "b"), ("revolute", "b", "c"), ("revolute", "c", "d")]
    joints = "".join(f'<joint name="{b}{c}" type="{kind}">{joint.format(b, c)}</joint>' for kind, b, c in tied)
    path = tmp_path / file
    path.write_text(f'{before}<robot name="boxes">{links}{joints}</robot>')
    spec = parse(path)
    prepare(spec, path)
    model = compiled(spec, path)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    touching = {frozenset(model.body(model.geom_bodyid[g]).name for g in contact.geom) for contact in data.contact}
    assert touching == {
        frozenset("ad"),
        frozenset("bd"),
    }  # all four are in one place; the last is no neighbour of these


# -- servos that do not move their joints ------------------------------------------------------------------------------

LIFT = '<position joint="lift" kp="20" kv="1"/>'


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ((LIFT, LIFT + LIFT), r"joint 'lift' .*two position servos.*Delete one"),
        (
            (OPTION, '<option integrator="implicitfast"><flag actuation="disable"/></option>'),
            r"switched off.*kinematic",
        ),
        (
            (OPTION, '<option integrator="implicitfast" actuatorgroupdisable="0"/>'),
            r"switched off.*actuatorgroupdisable",
        ),
        ((OPTION, ""), r"brakes too hard \(kv=1\).*integrator Euler.*<option integrator=\"implicitfast\"/>"),
    ],
)
def test_servo_that_would_not_move_its_joint_is_refused_in_physics_alone(
    robot: Robot, change: Change, message: str
) -> None:
    """Else a whole run would go by before somebody saw that the arm hangs or trembles."""
    with pytest.raises(BodyError, match=message):
        MujocoBody(str(robot(change)), "dynamic")
    kinematic(robot(change)).close()


def test_set_points_are_not_held_within_a_range_of_the_servos_own(robot: Robot) -> None:
    """The joint's limits and the anatomy's speeds count: the arm gets to where it is told."""
    within = LIFT.replace("position", "general").replace(
        'kp="20" kv="1"', 'biastype="affine" gainprm="20" biasprm="0 -20 -1" actlimited="true" actrange="-.1 .1"'
    )
    inherited = LIFT.replace("kp", 'inheritrange="0.1" kp')
    bodies = [MujocoBody(str(robot((LIFT, servo))), "dynamic") for servo in (within, inherited, LIFT)]
    arms = [[body.step([-0.6, 0.0], [0.0, 0.0]).arm for _ in range(30)][-1] for body in bodies]
    np.testing.assert_array_equal(arms, [arms[2]] * 3)
    assert arms[0][0] == pytest.approx(-0.6, abs=0.05)


CHAIN = """
<mujoco>
  <option gravity="0 0 0" integrator="{integrator}" timestep="0.002"/>
  <worldbody>
    <body>
      <joint name="upper" axis="0 1 0" damping="{damping}"/>
      <geom type="capsule" fromto="0 0 0 .3 0 0" size=".03" mass="1"/>
      <body pos=".3 0 0">
        <joint name="lower" axis="0 1 0" armature=".001"/>
        <geom type="capsule" fromto="0 0 0 .2 0 0" size=".02" mass=".3"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="upper" joint="upper" kp="1" kv="{kv}"/>
    <position name="lower" joint="lower" kp="1" kv="{kv}"/>
  </actuator>
</mujoco>"""


@pytest.mark.parametrize(("integrator", "damping"), [("Euler", 0), ("Euler", 20), ("RK4", 0), ("implicitfast", 0)])
def test_servos_are_refused_if_a_small_push_grows(integrator: str, damping: float) -> None:
    """MuJoCo's own steps tell: a push that grows a million times is refused, one that dies away is not."""
    grew = []
    for kv in np.geomspace(0.1, 100, 31):
        model = mujoco.MjModel.from_xml_string(CHAIN.format(integrator=integrator, damping=damping, kv=kv))
        data = mujoco.MjData(model)
        data.qvel[:] = 1e-9, -1e-9
        for _ in range(500):
            mujoco.mj_step(model, data)
            if np.abs(data.qvel).max() > 1e-3:
                break
        grew.append(np.abs(data.qvel).max() > 1e-3)
        assert grew[-1] or np.abs(data.qvel).max() < 1e-9
        try:
            check_servos(model, ("upper", "lower"), Path("chain.xml"))
        except BodyError as error:
            assert grew[-1], kv
            assert integrator in str(error) and '<option integrator="implicitfast"/>' in str(error)
            assert "'lower'" in str(error) or "'upper'" in str(error)
        else:
            assert not grew[-1], kv
    assert any(grew) == (integrator != "implicitfast") and not all(grew)
