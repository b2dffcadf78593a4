"""Anatomy files: what fits is read, and what does not is named, with what there is, before anything moves."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from somatopy.bodies import MODELS, Anatomy, BodyError, MujocoBody, anatomy_path

Robot = Callable[..., Path]
Change = tuple[str, str]
LIFT_SERVO = '<position joint="lift" kp="20" kv="1"/>'


def test_known_bodies_can_be_read() -> None:
    """Every body in the list has an anatomy, whose model stands beside it."""
    for name in MODELS:
        assert Anatomy.load(anatomy_path(name)).model.is_file()


def test_model_is_found_beside_the_anatomy(robot: Robot) -> None:
    """A relative path counts from the anatomy file, not from the working folder."""
    path = robot()
    assert Anatomy.load(path).model == path.parent / "crane.xml"


def test_a_posture_beyond_the_limits_is_refused(robot: Robot) -> None:
    """As one in degrees would be; a limit itself, and what rounding makes of it, is a posture."""
    with pytest.raises(
        BodyError, match=r"\[posture\] puts the joint 'lift' at 45, and its limits are -1 and 1\. Write"
    ):
        MujocoBody(robot(anatomy=('name = "Crane"', 'name = "Crane"\nposture = { lift = 45 }')), "kinematic")
    body = MujocoBody(robot(anatomy=('name = "Crane"', 'name = "Crane"\nposture = { lift = 1.0004 }')), "kinematic")
    assert body.reset().arm[0] == 1.0


def test_a_file_as_windows_writes_it_is_read(robot: Robot) -> None:
    """With a byte order mark, and with a carriage return at each end of line."""
    path = robot()
    plain = Anatomy.load(path)
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes().replace(b"\n", b"\r\n"))
    assert Anatomy.load(path) == plain


def test_unknown_body_is_answered_with_the_known_ones() -> None:
    """A slip in a name shows what there is."""
    with pytest.raises(BodyError, match=r"'noa' is neither a known body nor an anatomy file. Known bodies: nao"):
        anatomy_path("noa")
    with pytest.raises(BodyError, match="neither a known body nor an anatomy file"):
        anatomy_path("x" * 999)  # longer than any file's name


def test_a_model_in_place_of_an_anatomy_is_answered_with_the_command_that_makes_one(robot: Robot) -> None:
    """To name the model itself is the first thing that everyone tries."""
    model = Anatomy.load(robot()).model
    with pytest.raises(BodyError, match=r"is a robot's model.*somatopy check-body .*crane\.xml --propose > my"):
        Anatomy.load(anatomy_path(str(model)))


def test_every_error_of_a_description_is_a_value_error() -> None:
    """So that callers need one name."""
    assert issubclass(BodyError, ValueError)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (('name = "eye"\nwidth', 'name = "eye"\nwide'), r"unknown key 'camera\.wide'; .*there: name, width, height"),
        (('name = "Crane"', 'nmae = "Crane"'), r"name: a value is missing; unknown key 'nmae'.*did you mean name\?"),
        (("position = [0.12", "positon = [0.12"), r"there: body, position, axis \(did you mean position\?\)"),
        (("[head]", "[add.servos]\nlift = { kp = 1, kd = 1 }\n[head]"), r"'add\.servos\.lift\.kd'; .*there: kp, kv"),
        (("[2.0, 3.0]", "[2.0]"), r"arm: .*2 joints need as many velocities, not 1"),
        (("[2.0, 3.0]", "[2.0, -3.0]"), r"arm.velocity.1 = -3.0: must be greater than 0"),
        (("[2.0, 3.0]", "[2.0, nan]"), r"arm.velocity.1 = nan: must be .*finite"),
        (("[2.0, 3.0]", "[2.0, inf]"), r"arm.velocity.1 = inf: must be .*finite"),
        (('["lift", "swing"]', '["lift", "lift"]'), r"arm: .*a joint stands twice in \['lift', 'lift'\]"),
        (('["lift", "swing"]', '["lift", "pan"]'), r"arm or head, not to both: \['pan'\]"),
        (
            ('["pan", "tilt"]\nvelocity = [4.0, 4.0]', '["pan", "tilt", "roll", "nod"]'),
            r"head: .*one to 3 joints.*keep at most 3 of \['pan', 'tilt', 'roll', 'nod'\].*freeze",
        ),
        (("width = 200", "width = 0"), r"camera.width = 0: must be greater than 0"),
        (('name = "eye"', 'name = ""'), r"camera.name = '': must not be empty"),
        (('name = "Crane"', 'name = "Crane"\nhome = ""'), r"home = '': must not be empty"),
        (("width = 200", "width = 'wide'"), r"camera.width = 'wide': must be a whole number, not text"),
        (("width = 200", "width = true"), r"camera.width = True: must be a whole number, not true or false"),
        (("[0.12, 0.0, 0.0]", '[0.12, 0.0, "0"]'), r"marker.position.2 = '0': must be a number, not text"),
        (("[0.12, 0.0, 0.0]", "[0.12, 0.0]"), r"marker.position.2: a value is missing"),
        (("[0.12, 0.0, 0.0]", "[0.12, 0.0, inf]"), r"marker.position.2 = inf: must be .*finite"),
        (("[0.12, 0.0, 0.0]", "[0.12, 0.0, 0.0]\naxis = [0.0, 0.0, 0.0]"), r"marker: .*axis must not be zero"),
        (
            ("[camera]", "[ranges]\nnear = [[-0.5, 1.0]]\n\n[camera]"),
            r"the range 'near' needs one .*\['lift', 'swing'\], not 1",
        ),
        (("[arm]", "[arm"), r"is not valid TOML"),
    ],
)
def test_misfit_in_the_file_is_named(robot: Robot, change: Change, message: str) -> None:
    """The message has the file, the place in it and what is wrong there."""
    path = robot(anatomy=change)
    with pytest.raises(BodyError, match=message) as error:
        Anatomy.load(path)
    assert str(path) in str(error.value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            ('by = "pan"', 'by = "lift"'),
            r"coupling names 'lift', which is no head joint; head joints: \['pan', 'tilt'\]",
        ),
        (('by = "pan"', 'by = "tilt"'), r"coupling cannot limit 'tilt' by itself"),
        (("at = [-1.0, 1.0]", "at = [1.0, -1.0]"), r"at must increase"),
        (("at = [-1.0, 1.0]", "at = [-1.0, nan]"), r"head.coupling.at.1 = nan: must be .*finite"),
        (("at = [-1.0, 1.0]", "at = [1.0]"), r"head.coupling.at = \[1.0\]: .*at least 2"),
        (("at = [-1.0, 1.0]", "at = [-1.0, 0.0, 1.0]"), r"the same length, not 3, 2, 2"),
        (("upper = [0.8, 0.2]", "upper = [0.8, -0.6]"), r"lower must not exceed upper"),
    ],
)
def test_misfit_in_a_coupling_is_named(robot: Robot, coupled: Change, change: Change, message: str) -> None:
    """The same for the table by which one head joint limits another."""
    assert change[0] in coupled[1]
    with pytest.raises(BodyError, match=message):
        Anatomy.load(robot(anatomy=(coupled[0], coupled[1].replace(*change))))


@pytest.mark.parametrize(
    "change",
    [
        ("lower = [-0.5, -0.5]\nupper = [0.8, 0.2]", "lower = [-0.5, 0.5]\nupper = [0.4, 1.0]"),
        ("lower = [-0.5, -0.5]\nupper = [0.8, 0.2]", "lower = [1.1, 1.1]\nupper = [1.5, 1.5]"),
    ],
    ids=["no angle in common", "outside the joint's own range"],
)
def test_coupling_that_lets_nothing_pass_is_refused(robot: Robot, coupled: Change, change: Change) -> None:
    """Where no angle is legal throughout, set-points could get stuck; the message gives the two numbers."""
    path = robot(anatomy=(coupled[0], coupled[1].replace(*change)))
    with pytest.raises(BodyError, match=r"No angle of 'tilt' is allowed at every angle of 'pan'"):
        MujocoBody(path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("[camera]", "[add]\nfreeze = 'all'\n\n[camera]"), r"add.freeze.*'rest'"),
        (("[camera]", "[add]\nfreeze = ['swing']\n\n[camera]"), r"add.freeze names \['swing'\], which arm or head"),
        (("[camera]", "[add.camera]\nfovy = 50\n\n[camera]"), r"add: .*the camera has no place: say body = "),
        (
            ("[camera]", "[add.neck]\nbody = 'post'\njoints = ['nod']\nlimits = [[-1, 1]]\n\n[camera]"),
            r"name them in \[head\]",
        ),
        (
            ("[camera]", "[add.neck]\nbody = 'post'\njoints = ['tilt']\nlimits = [[1, -1]]\n\n[camera]"),
            r"low must be under",
        ),
        (
            ("[camera]", "[add.camera]\nbody = 'post'\nforward = [0, 0, 1]\n\n[camera]"),
            r"add.camera: .*forward \[0.0, 0.0, 1.0\] and up \[0.0, 0.0, 1.0\] must be two directions",
        ),
        (("[camera]", "[add.servos]\nlift = { kp = 0, kv = 1 }\n\n[camera]"), r"add.servos.lift.kp = 0: .*greater"),
        (("[camera]", "[add.servos]\nlift = { kp = 1 }\n\n[camera]"), r"add.servos.lift.kv: a value is missing"),
        (("velocity = [2.0, 3.0]", "limits = [[-1, 1]]"), r"limits needs one \[low, high\] for each of .*, not 1"),
        (('name = "Crane"', 'name = "Crane"\nposture = { lift = "up" }'), r"posture.lift = 'up': .*number, not text"),
        (('name = "Crane"', 'name = "Crane"\nposture = { "l i-ft" = "up" }'), r"posture.l i-ft = 'up': .*number"),
        (('name = "Crane"', 'name = "Crane"\nposture = 3'), r"posture = 3: must be a table of keys"),
        (
            ("[camera]", "[add.neck]\nbody = ''\njoints = []\nlimits = []\n\n[camera]"),
            r"add.neck.body = '': must not be",
        ),
    ],
)
def test_misfit_in_what_is_added_is_named(robot: Robot, change: Change, message: str) -> None:
    """The same for posture, limits and all of [add]."""
    with pytest.raises(BodyError, match=message):
        Anatomy.load(robot(anatomy=change))


def test_model_is_found_in_a_package_that_is_not_imported(
    robot: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Packages of robots import whole simulators, or refuse to."""
    folder = tmp_path / "cranes_for_tests" / "assets"
    folder.mkdir(parents=True)
    (folder.parent / "__init__.py").write_text("raise RuntimeError('imported')")
    path = robot(anatomy=('model = "crane.xml"', 'model = "assets/crane.xml"\npackage = "cranes_for_tests"'))
    path.with_suffix(".xml").rename(folder / "crane.xml")
    with pytest.raises(BodyError, match=r"'cranes_for_tests', which is not installed.*`pip install cranes-for-tests`"):
        Anatomy.load(path)
    monkeypatch.syspath_prepend(str(tmp_path))
    assert Anatomy.load(path).model == folder / "crane.xml"
    path.write_text(path.read_text().replace('"cranes_for_tests"', '"cranes_for_tests.assets"').replace("assets/", ""))
    assert Anatomy.load(path).model == folder / "crane.xml"
    (folder / "crane.xml").unlink()
    with pytest.raises(BodyError, match=r"cranes_for_tests.assets.crane.xml does not exist"):
        MujocoBody(path)


@pytest.mark.parametrize("content", [None, b"\xff\xfe\x00"], ids=["missing", "no text"])
def test_unreadable_anatomy_is_named(tmp_path: Path, content: bytes | None) -> None:
    """A missing file and a binary one give a message, not a traceback of the parser."""
    path = tmp_path / "odd.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(BodyError, match=r"odd\.toml"):
        Anatomy.load(path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (('"lift", "swing"', '"lift", "swung"'), r"The joint 'swung' .*Available: lift, swing, pan, tilt\."),
        (('"pan", "tilt"', '"pan", "nod"'), r"The joint 'nod' .*Available: lift, swing, pan, tilt\."),
        (('name = "eye"', 'name = "ear"'), r"The camera 'ear' .*Available: eye\."),
        (('body = "jib"', 'body = "hand"'), r"The body 'hand' .*Available: world, post, boom, jib, neck, face\."),
        (('model = "crane.xml"', 'model = "crane.xml"\nhome = "rest"'), r"The keyframe 'rest' .*Available: none\."),
        (('model = "crane.xml"', 'model = "crate.xml"'), r"The model .*crate.xml does not exist"),
    ],
)
def test_name_that_the_model_lacks_is_answered_with_those_it_has(robot: Robot, change: Change, message: str) -> None:
    """Joint, camera, body, keyframe and model file."""
    with pytest.raises(BodyError, match=message):
        MujocoBody(robot(anatomy=change))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("</mujoco>", ""), r"MuJoCo cannot read the model .*crane.xml"),
        (('type="sphere"', 'type="ball"'), r"MuJoCo cannot read the model .*crane.xml"),
        (('size=".04" mass=".1"', 'size="0" mass=".1"'), r"MuJoCo cannot compile the model .*crane.xml"),
        ((' axis="0 1 0" range="-1 1"', ' axis="0 1 0"'), r"joint 'lift' .*has no limits. Give it range="),
        (
            ('name="lift" axis="0 1 0" range="-1 1"', 'name="lift" type="ball"'),
            r"joint 'lift' .*neither a hinge nor a slide",
        ),
    ],
)
@pytest.mark.parametrize("motion", ["dynamic", "kinematic"])
def test_unfit_model_is_named(robot: Robot, change: Change, message: str, motion: str) -> None:
    """Broken MJCF, impossible shapes, joints that have no limits or are no hinge."""
    with pytest.raises(BodyError, match=message):
        MujocoBody(robot(mjcf=change), motion=motion)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "change",
    [(LIFT_SERVO, ""), (LIFT_SERVO, '<motor joint="lift"/>'), (LIFT_SERVO, '<velocity joint="lift" kv="1"/>')],
    ids=["none", "motor", "velocity servo"],
)
def test_physics_needs_position_servos_and_kinematics_none(robot: Robot, change: Change) -> None:
    """The message shows the servo to add, and the way without."""
    path = robot(mjcf=change)
    with pytest.raises(BodyError, match=r"joint 'lift' .*no position servo. Add <actuator><position joint=\"lift\""):
        MujocoBody(path)
    assert MujocoBody(path, motion="kinematic").reset().arm.tolist() == [0, 0]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"motion": "magic"}, r"Motion 'magic' is unknown; choose dynamic or kinematic"),
        ({"arm_speed": 0.0}, r"arm_speed must be a positive number of rad/s, not 0.0"),
        ({"head_speed": float("nan")}, r"head_speed must be a positive number of rad/s, not nan"),
        ({"arm_speed": float("inf")}, r"arm_speed must be"),
        ({"fovy": 180.0}, r"fovy must be between 0 and 180 degrees, not 180.0"),
    ],
)
def test_unfit_arguments_are_named(robot: Robot, arguments: dict[str, object], message: str) -> None:
    """Motion, speeds and field of view."""
    with pytest.raises(BodyError, match=message):
        MujocoBody(robot(), **arguments)  # type: ignore[arg-type]
