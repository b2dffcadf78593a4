"""MujocoBody: what no command can do to it, repeatability, lifelike motion, and another robot than the NAO."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from somatopy.bodies import Motion, MujocoBody, physics
from somatopy.clock import FRAME
from somatopy.percept import Floats, Marker, Picture, Reading

Robot = Callable[..., Path]
Commands = Callable[[int, np.random.Generator], Floats]

# LShoulderPitch, LShoulderRoll, LElbowYaw, LElbowRoll, HeadYaw, HeadPitch, as published for the NAO
LOWER = np.array([-2.08567, -0.314159, -2.08567, -1.54462, -2.08567, -0.671952])
UPPER = np.array([2.08567, 1.32645, 2.08567, -0.0349066, 2.08567, 0.514872])
VELOCITY = np.array([8.26797, 7.19407, 8.26797, 7.19407, 8.26797, 7.19407])
TORQUE = np.array([1.329, 1.7835, 1.547, 1.532, 1.547, 1.532])
ROUNDING = 1e-9

FORWARD, RAISED = [0.2, 0.3, 0.0, -0.6], [-0.4, 0.9, 0.4, -1.2]
INTO_TORSO = [1.5, -0.2, 0.0, -1.2]
INTO_HEAD = [-1.55, -0.31, 0.0, -1.29]


@pytest.fixture(params=["dynamic", "kinematic"])
def motion(request: pytest.FixtureRequest) -> Any:
    return request.param


@pytest.fixture
def nao(motion: Motion) -> Iterator[MujocoBody]:
    body = MujocoBody("nao", motion)
    yield body
    body.close()


def posture(reading: Reading) -> Floats:
    return np.concatenate([reading.arm, reading.head])


def command(reading: Reading) -> Floats:
    return np.concatenate([reading.arm_command, reading.head_command])


def bits(reading: Reading) -> bytes:
    """All that a reading says, but for the picture."""
    view = reading.view
    assert view is not None
    numbers = [reading.time, reading.dt, reading.overlap]
    return np.concatenate([posture(reading), command(reading), numbers, view.camera, view.marker]).tobytes()


def walk(body: MujocoBody, seed: int, frames: int) -> list[Reading]:
    rng = np.random.default_rng(seed)
    return [body.step(rng.uniform(-2, 2, 4), rng.uniform(-2, 2, 2)) for _ in range(frames)]


def hold(body: MujocoBody, arm: Any, head: Any = (0.0, 0.0), seconds: float = 4.0) -> Reading:
    for _ in range(round(seconds / FRAME)):
        reading = body.step(arm, head)
    return reading


# -- no command, whatever it is, leads beyond the limits -------------------------------------------------------------


def jumping(_: int, rng: np.random.Generator) -> Floats:
    return rng.choice([-1e9, 1e9, 0.0, 1.0, -1.0], 6)


def held(frame: int, _: np.random.Generator) -> Floats:
    return np.random.default_rng(frame // 10).choice([-1e9, 1e9], 6)


def anywhere(frame: int, _: np.random.Generator) -> Floats:
    return np.random.default_rng(frame // 3).uniform(-2.5, 2.5, 6)


def along_the_edge(frame: int, _: np.random.Generator) -> Floats:
    """Yaw sweeps while pitch is told to be at its end."""
    rng = np.random.default_rng(frame // 12)
    return np.append(rng.uniform(-2, 2, 5), rng.choice([-1e9, 1e9]))


def beyond_coupling(body: MujocoBody, head: Floats) -> float:
    """How far a head posture leaves the pitch limits of its yaw; negative inside."""
    table = body.anatomy.head.coupling
    assert table is not None
    low, high = (np.interp(head[0], table.at, values) for values in (table.lower, table.upper))
    return float(max(low - head[1], head[1] - high))


@pytest.mark.parametrize("commands", [jumping, held, anywhere, along_the_edge])
@pytest.mark.parametrize("arm_speed", [None, 0.8])
def test_no_command_leads_beyond_the_limits_in_any_physics_step(
    commands: Commands, arm_speed: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Position, velocity, motor torque and pitch by yaw, at each of the steps within a frame, at full speed."""
    monkeypatch.setattr(physics, "function", lambda name: 0)  # each physics step is to be seen
    body, step = MujocoBody("nao", "dynamic", arm_speed), mujoco.mj_step
    seen: dict[str, list[Any]] = {name: [] for name in (*body.arm.names, *body.head.names)}

    def spy(model: mujoco.MjModel, data: mujoco.MjData) -> None:
        joints = [data.joint(k) for k in range(model.njnt) if model.joint(k).name in seen]
        before = [(joint.qpos[0], joint.qvel[0]) for joint in joints]
        step(model, data)
        for joint, values in zip(joints, before, strict=True):
            seen[joint.name].append((*values, joint.qfrc_actuator[0]))

    monkeypatch.setattr(mujoco, "mj_step", spy)
    rng, readings = np.random.default_rng(0), [body.reset()]
    for frame in range(300):
        target = commands(frame, rng)
        readings.append(body.step(target[:4], target[4:]))
        assert beyond_coupling(body, readings[-1].head_command) <= ROUNDING
    angles, velocities, torques = np.array(list(seen.values())).transpose(2, 1, 0)
    assert len(angles) >= 300 * 10
    assert (angles >= LOWER - ROUNDING).all() and (angles <= UPPER + ROUNDING).all()
    assert (np.abs(velocities) <= VELOCITY * (1 + ROUNDING)).all()
    assert (np.abs(torques) <= TORQUE * (1 + ROUNDING)).all()
    assert max(beyond_coupling(body, head) for head in angles[:, 4:]) <= 0
    travel = np.diff([posture(reading) for reading in readings], axis=0)
    assert (np.abs(travel) <= VELOCITY * FRAME * (1 + ROUNDING)).all()


@pytest.mark.parametrize("commands", [jumping, held, anywhere, along_the_edge])
def test_no_command_leads_beyond_the_limits_in_kinematic_motion(commands: Commands) -> None:
    """The same for joints that are where the set-points are, and for the commands that readings report."""
    body, rng = MujocoBody("nao", "kinematic", arm_speed=None), np.random.default_rng(0)
    before = posture(body.reset())
    for frame in range(1000):
        target = commands(frame, rng)
        reading = body.step(target[:4], target[4:])
        for angles in (posture(reading), command(reading)):
            assert (angles >= LOWER - ROUNDING).all() and (angles <= UPPER + ROUNDING).all()
            assert beyond_coupling(body, angles[4:]) <= ROUNDING
        assert (np.abs(posture(reading) - before) <= VELOCITY * FRAME * (1 + ROUNDING)).all()
        before = posture(reading)


@pytest.mark.parametrize("target", [[1.5, 0.1], [-9.0, 9.0], [1.9, 0.5]])
def test_reported_commands_are_the_clipped_targets(motion: Motion, target: list[float]) -> None:
    """From the first frame of a long way on, when set-points and joints are still far from there."""
    body = MujocoBody("nao", motion, arm_speed=0.3, head_speed=0.3)
    reading = body.step([9.0, 0.2, -9.0, -1.0], target)
    np.testing.assert_allclose(reading.arm_command, [UPPER[0], 0.2, LOWER[2], -1.0], atol=1e-5)
    np.testing.assert_array_equal(reading.head_command, body.legal(target))
    assert np.abs(reading.head - reading.head_command).max() > 1


def test_views_are_those_of_the_posture_itself(nao: MujocoBody) -> None:
    """Beyond the limits too nothing is clipped: other poses than at the limit, the same as of a body put there."""
    for head in ([0.5, 0.2], [2.6, 0.0], [0.0, 1.0], [1.9, 0.5]):
        asked, there = nao.view(RAISED, head), nao.place(RAISED, head).view
        assert there is not None
        for name in ("camera", "marker", "occluders"):
            np.testing.assert_array_equal(getattr(asked, name), getattr(there, name))
        at_the_limit = nao.view(RAISED, nao.legal(head)).camera
        assert (np.abs(at_the_limit - asked.camera).max() > 0.05) == bool((nao.legal(head) != head).any())


def test_velocity_limits_are_the_robots(nao: MujocoBody) -> None:
    """The group tells what the body holds."""
    np.testing.assert_allclose(np.concatenate([nao.arm.velocity, nao.head.velocity]), VELOCITY, rtol=1e-6)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_target_that_is_no_number_moves_nothing(nao: MujocoBody, bad: float) -> None:
    """It is refused, and the body is where it was."""
    before = nao.state()
    for arm, head in (([0, 0, bad, 0], [0, 0]), ([0, 0, 0, 0], [bad, 0])):
        with pytest.raises(ValueError, match="not finite"):
            nao.step(arm, head)
    after = nao.state()
    assert all(np.array_equal(before[key], after[key]) for key in before)


@pytest.mark.parametrize(("arm", "head"), [([0, 0, 0], [0, 0]), ([0, 0, 0, 0], [[0, 0]]), ([0, 0, 0, 0], 0.0)])
def test_target_of_wrong_shape_is_named(nao: MujocoBody, arm: Any, head: Any) -> None:
    """The message gives its shape and the joints that there are."""
    with pytest.raises(ValueError, match=r"target has shape \(.*joints: \['(LShoulderPitch|HeadYaw)'"):
        nao.step(arm, head)


# -- repeatability -----------------------------------------------------------------------------------------------------


def test_reset_begins_anew(nao: MujocoBody) -> None:
    """After any motion the same commands give the same readings to the last bit, whatever the seed."""
    first = [bits(nao.reset()), *map(bits, walk(nao, 1, 30))]
    again = [bits(nao.reset(seed=5)), *map(bits, walk(nao, 1, 30))]
    assert first == again


def test_two_bodies_are_the_same_robot(nao: MujocoBody, motion: Motion) -> None:
    """Same commands, same bits."""
    assert [*map(bits, walk(nao, 2, 30))] == [*map(bits, walk(MujocoBody("nao", motion), 2, 30))]


@pytest.mark.parametrize("fresh", [True, False], ids=["fresh body", "same body"])
def test_state_continues_to_the_last_bit(nao: MujocoBody, motion: Motion, fresh: bool) -> None:
    """Also from the middle of a movement; and taking it changes nothing."""
    walk(nao, 3, 17)
    now = bits(nao.step(FORWARD, [1.0, 0.2]))
    state = nao.state()
    goes_on = [*map(bits, walk(nao, 4, 40))]
    other = MujocoBody("nao", motion) if fresh else nao
    restored = other.restore(state)
    assert posture(restored).tobytes() == np.frombuffer(now)[:6].tobytes()
    assert [*map(bits, walk(other, 4, 40))] == goes_on


def test_readings_keep_what_they_saw(nao: MujocoBody) -> None:
    """A reading is a copy: later frames do not change it."""
    reading = nao.step(FORWARD, [0.5, 0.1])
    before = bits(reading)
    walk(nao, 5, 5)
    assert bits(reading) == before


def test_time_counts_frames(nao: MujocoBody) -> None:
    """15 frames are one second; the first reading has no frame before it."""
    first = nao.reset()
    assert (first.time, first.dt) == (0.0, 0.0)
    last = walk(nao, 6, 15)[-1]
    assert last.time == pytest.approx(1.0) and last.dt == pytest.approx(1 / 15)


def test_a_body_can_be_closed_twice(nao: MujocoBody) -> None:
    """With nothing drawn yet, too."""
    nao.close()
    nao.close()


# -- pictures ----------------------------------------------------------------------------------------------------------


def test_nothing_is_drawn_unless_someone_looks(nao: MujocoBody) -> None:
    """A picture that no one asked for has taken no time."""
    for reading in walk(nao, 7, 3):
        assert isinstance(reading.image, Picture)
        assert reading.image.seconds == 0.0


def test_picture_of_a_moment_that_is_gone_is_refused(nao: MujocoBody, motion: Motion) -> None:
    """After a step, after a reset and another step, and after the restoring of another state of the same age."""
    reading = nao.step(FORWARD, [0, 0])
    assert reading.image is not None
    other = MujocoBody("nao", motion)
    other.step(RAISED, [0, 0])
    for move_on in (lambda: nao.step(FORWARD, [0, 0]), nao.reset, lambda: nao.restore(other.state())):
        move_on()
        with pytest.raises(RuntimeError, match="picture of frame 1 was not taken before the body moved on"):
            reading.image()


def test_unknown_camera_is_answered_with_the_known_ones(nao: MujocoBody) -> None:
    """Before any OpenGL is needed."""
    with pytest.raises(ValueError, match=r"camera 'Rear' does not exist. Available: .*CameraTop, CameraBottom"):
        nao.picture("Rear")


@pytest.mark.gl
def test_picture_is_drawn_once_and_kept(nao: MujocoBody) -> None:
    """The second look gives the same array, also when the body has moved on."""
    reading = nao.step(FORWARD, [0, 0.2])
    assert isinstance(reading.image, Picture)
    image, spent = reading.image(), reading.image.seconds
    assert image.shape == (240, 320, 3) and image.dtype == np.uint8 and spent > 0
    nao.step(RAISED, [1, 0])
    assert reading.image() is image and reading.image.seconds == spent


@pytest.mark.gl
def test_pictures_follow_the_body_and_any_camera(nao: MujocoBody) -> None:
    """Another posture looks different, the same one the same, from each camera, in any size, after closing too."""
    before = nao.picture("outside", 640, 480)
    hold(nao, FORWARD, seconds=1.0)
    assert nao.picture("outside", 640, 480).shape == (480, 640, 3)
    assert (nao.picture("outside", 640, 480) != before).any()
    nao.close()
    nao.reset()
    assert (nao.picture("outside", 640, 480) == before).all()
    assert nao.picture("CameraTop", 100, 80).shape == (80, 100, 3)


# -- lifelike motion ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("start", "end"), [(FORWARD, RAISED), (RAISED, [0.8, 0.2, -0.5, -0.3])])
def test_arm_follows_a_slow_ramp_closely(start: list[float], end: list[float]) -> None:
    """At .8 rad/s each joint is within .03 rad of its set-point, and does not sag when it has arrived."""
    body = MujocoBody("nao", arm_speed=0.8)
    hold(body, start)
    way = np.subtract(end, start)
    for frame in range(1, 45):
        travelled = np.minimum(0.8 * frame * FRAME, np.abs(way))
        reading = body.step(end, [0, 0])
        assert np.abs(reading.arm - (start + np.sign(way) * travelled)).max() < 0.03
    assert np.abs(hold(body, end, seconds=2.0).arm - end).max() < 0.01


def test_torso_stops_the_arm_in_physics_alone() -> None:
    """The servos push in vain, with little give; the kinematic arm, which knows no contact, passes."""
    solid, ghost = MujocoBody("nao", "dynamic"), MujocoBody("nao", "kinematic")
    assert np.abs(hold(ghost, INTO_TORSO).arm - INTO_TORSO).max() < ROUNDING
    mujoco.mj_collision(ghost.model, ghost.data)
    assert min(ghost.data.contact.dist) < -0.03
    assert np.abs(hold(solid, INTO_TORSO).arm - INTO_TORSO).max() > 0.1
    mujoco.mj_collision(solid.model, solid.data)
    assert -0.005 < min(solid.data.contact.dist) < 0.0


def test_arm_passes_the_head_and_is_noticed(nao: MujocoBody) -> None:
    """Their overlap is told, exerts no force, and ends when they part."""
    assert not nao.reset().overlap
    reading = hold(nao, INTO_HEAD, seconds=6.0)
    assert reading.overlap
    np.testing.assert_allclose(posture(reading), [*INTO_HEAD, 0, 0], atol=0.01)
    mujoco.mj_forward(nao.model, nao.data)
    assert nao.data.ncon > 0 and (nao.data.contact.efc_address < 0).all()
    assert not hold(nao, FORWARD, seconds=6.0).overlap


def test_contact_of_other_parts_is_no_overlap(nao: MujocoBody) -> None:
    """The arm at the torso touches it, and that is not told as arm and head in each other."""
    reading = hold(nao, INTO_TORSO)
    mujoco.mj_collision(nao.model, nao.data)
    assert nao.data.ncon > 0 and not reading.overlap


# -- the twin: poses, limits and a second body -------------------------------------------------------------------------


def test_ranges_are_the_anatomys_and_the_joint_limits(nao: MujocoBody) -> None:
    """One [low, high] for each arm joint, by name."""
    assert list(nao.ranges) == ["mechanical", "confined", "wide"]
    np.testing.assert_array_equal(nao.ranges["mechanical"], np.column_stack([LOWER, UPPER])[:4])
    np.testing.assert_array_equal(nao.ranges["confined"][0], [-0.5, 1.1])


def test_view_clips_nothing(nao: MujocoBody) -> None:
    """The camera turns on beyond the head's limits, as it does within: by the angle that was asked for."""
    arm, beyond = [0.0, 0.0, 0.0, -0.5], UPPER[4] + 0.4
    ahead, turned = (nao.view(arm, [yaw, 0.0]).camera[3:].reshape(3, 3) for yaw in (0.0, beyond))
    angle = np.arccos(0.5 * (np.trace(turned @ ahead.T) - 1))
    assert angle == pytest.approx(beyond)


def test_fingerprint_tells_bodies_apart(robot: Robot) -> None:
    """Another motion, speed, marker, field of view or anatomy is another body; equal ones in other folders are not."""
    bodies = [
        MujocoBody("nao"),
        MujocoBody("nao", "kinematic"),
        MujocoBody("nao", arm_speed=0.7),
        MujocoBody("nao", head_speed=1.0),
        MujocoBody("nao", marker=Marker(size=0.06)),
        MujocoBody("nao", fovy=50.0),
        MujocoBody(robot()),
    ]
    assert len({body.fingerprint() for body in bodies}) == len(bodies)


def test_fingerprint_does_not_depend_on_the_folder(robot: Robot, tmp_path: Path) -> None:
    """The same files elsewhere are the same robot."""
    here, there = robot(), tmp_path / "elsewhere"
    there.mkdir()
    for name in ("crane.toml", "crane.xml"):
        shutil.copy(tmp_path / name, there / name)
    assert MujocoBody(here).fingerprint() == MujocoBody(there / here.name).fingerprint()


@pytest.mark.gl
def test_fingerprint_does_not_depend_on_what_was_drawn(nao: MujocoBody) -> None:
    """Looking at a body leaves it the same body."""
    before = nao.fingerprint()
    nao.picture("outside", 640, 480)
    assert nao.fingerprint() == before


def test_another_has_the_injuries_and_shares_nothing(nao: MujocoBody) -> None:
    """A joint shifted in the model is shifted in the second body, which then moves and is injured by itself."""
    nao.model.body("LShoulder").pos[1] += 0.02
    walk(nao, 8, 5)
    second, state = nao.another(), nao.state()
    assert second.model.body("LShoulder").pos[1] == nao.model.body("LShoulder").pos[1]
    second.model.body("LShoulder").pos[1] += 0.01
    walk(second, 9, 5)
    second.close()
    assert all(np.array_equal(value, nao.state()[key]) for key, value in state.items())
    assert second.fingerprint() != nao.fingerprint()


# -- another robot -----------------------------------------------------------------------------------------------------


def test_another_robot_works_as_well(robot: Robot, motion: Motion) -> None:
    """Without keyframe and coupling, with its own camera: it starts at 0, moves at the speed told, and arrives."""
    body = MujocoBody(robot(), motion, arm_speed=0.5, head_speed=1.0)
    start = body.reset()
    assert posture(start).tolist() == [0, 0, 0, 0]
    assert body.arm.names == ("lift", "swing") and body.head.names == ("pan", "tilt")
    assert body.arm.lower.tolist() == [-1, -1.5] and body.arm.velocity.tolist() == [2, 3]
    assert (body.camera.width, body.camera.height) == (200, 150) and np.rad2deg(body.camera.fovy) == pytest.approx(60)
    half = hold(body, [-0.5, -1.0], [1.0, 9.0], seconds=1.0)
    np.testing.assert_allclose(half.arm, [-0.5, -0.5], atol=0.05)
    end = hold(body, [-0.5, -1.0], [1.0, 9.0])
    np.testing.assert_allclose(posture(end), [-0.5, -1.0, 1.0, 1.0], atol=0.02)
    assert end.head_command.tolist() == [1.0, 1.0]


def test_camera_and_marker_of_another_robot_are_where_its_joints_put_them(robot: Robot) -> None:
    """Forward kinematics by hand: a boom of .2 m, the cube .12 m behind its end, the camera .05 m off the neck."""
    body = MujocoBody(robot(), "kinematic")
    view = hold(body, [0.0, -np.pi / 6], [np.pi / 3, 0.0]).view
    assert view is not None
    np.testing.assert_allclose(view.marker[:3], [0.2 + 0.12 * np.cos(np.pi / 6), -0.06, 0.5], atol=1e-9)
    np.testing.assert_allclose(view.camera[:3], [0.025, 0.05 * np.sin(np.pi / 3), 0.65], atol=1e-9)


def test_arm_and_head_speeds_stay_below_the_limits_of_the_joints(robot: Robot, motion: Motion) -> None:
    """A speed above a joint's limit is that limit."""
    body = MujocoBody(robot(), motion, arm_speed=100.0)
    reading = body.step([1.0, 0.5], [1.5, 1.0])
    assert (np.abs(reading.arm) <= np.array([2.0, 3.0]) * FRAME + ROUNDING).all()
    assert (np.abs(reading.head) <= 4.0 * FRAME + ROUNDING).all()


def test_servo_is_found_beside_other_actuators_of_the_joint(robot: Robot) -> None:
    """A damper on the same joint is not taken for its servo."""
    servo = '<position joint="lift" kp="20" kv="1"/>'
    body = MujocoBody(robot(mjcf=(servo, f'{servo}<velocity joint="lift" kv="0.1"/>')))
    np.testing.assert_allclose(hold(body, [-0.5, -0.4], [0.3, 0.2]).arm, [-0.5, -0.4], atol=0.02)


def test_joints_that_are_neither_arm_nor_head_hold_still(robot: Robot) -> None:
    """Their servos keep the start posture."""
    body = MujocoBody(robot(anatomy=('["lift", "swing"]\nvelocity = [2.0, 3.0]', '["swing"]\nvelocity = [3.0]')))
    hold(body, [-1.0], [0.5, 0.5])
    assert body.data.joint("lift").qpos[0] == pytest.approx(0, abs=0.03)


def test_start_posture_outside_the_coupled_limits_is_brought_inside(robot: Robot, coupled: tuple[str, str]) -> None:
    """Also a start at which the head's joints forbid each other is legal from the first reading on."""
    key = '<keyframe><key name="rest" qpos="0 0 1 .9"/></keyframe></mujoco>'
    path = robot(mjcf=("</mujoco>", key), anatomy=coupled)
    path.write_text(path.read_text().replace('model = "crane.xml"', 'model = "crane.xml"\nhome = "rest"'))
    body = MujocoBody(path)
    np.testing.assert_allclose(body.reset().head, [1.0, 0.2])
    np.testing.assert_allclose(hold(body, [0, 0], [-1.0, 0.9]).head, [-1.0, 0.8], atol=0.02)
