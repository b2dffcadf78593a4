"""The NAO model against the robot's published figures, and the servos' behaviour. Needs no OpenGL.

`python tests/bodies/test_nao_model.py` prints how physics steps of several lengths agree with 1/1200 s.
"""

from __future__ import annotations

import tomllib
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

NAO = Path(str(files("somatopy"))) / "bodies" / "nao"
FPS = 15
Floats = NDArray[np.float64]

ARM = ("ShoulderPitch", "ShoulderRoll", "ElbowYaw", "ElbowRoll")
LEFT_ARM = tuple("L" + name for name in ARM)
HEAD = ("HeadYaw", "HeadPitch")
X, Y, Z = (1, 0, 0), (0, 1, 0), (0, 0, 1)

# joint: axis, origin in the parent (m), range (rad), torque limit (Nm), no-load speed (rad/s), gear ratio
JOINTS = {
    "HeadYaw": (Z, (0, 0, 0.1265), (-2.08567, 2.08567), 1.547, 7.46, 150.27),
    "HeadPitch": (Y, (0, 0, 0), (-0.671952, 0.514872), 1.532, 6.47, 173.22),
    "LShoulderPitch": (Y, (0, 0.098, 0.1), (-2.08567, 2.08567), 1.329, 7.46, 150.27),
    "LShoulderRoll": (Z, (0, 0, 0), (-0.314159, 1.32645), 1.7835, 6.47, 173.22),
    "LElbowYaw": (X, (0.105, 0.015, 0), (-2.08567, 2.08567), 1.547, 7.46, 150.27),
    "LElbowRoll": (Z, (0, 0, 0), (-1.54462, -0.0349066), 1.532, 6.47, 173.22),
    "LWristYaw": (X, (0.05595, 0, 0), (-1.82387, 1.82387), 0.4075, 17.4, 50.61),
    "RShoulderPitch": (Y, (0, -0.098, 0.1), (-2.08567, 2.08567), 1.329, 7.46, 150.27),
    "RShoulderRoll": (Z, (0, 0, 0), (-1.32645, 0.314159), 1.7835, 6.47, 173.22),
    "RElbowYaw": (X, (0.105, -0.015, 0), (-2.08567, 2.08567), 1.547, 7.46, 150.27),
    "RElbowRoll": (Z, (0, 0, 0), (0.0349066, 1.54462), 1.532, 6.47, 173.22),
    "RWristYaw": (X, (0.05595, 0, 0), (-1.82387, 1.82387), 0.4075, 17.4, 50.61),
}
SPEED_LIMIT = {150.27: 8.26797, 173.22: 7.19407, 50.61: 24.6229}  # rad/s, by gear ratio
MASSES = {
    "torso": 1.04956, "Neck": 0.07842, "Head": 0.60533,
    "LShoulder": 0.09304, "LBicep": 0.15777, "LElbow": 0.06483, "LForeArm": 0.07761, "l_wrist": 0.18533,
    "LPelvis": 0.06981, "LHip": 0.14053, "LThigh": 0.38968, "LTibia": 0.30142, "LAnklePitch": 0.13416,
    "l_ankle": 0.17184,
}  # fmt: skip
# posture: left hand effector in the torso's frame (m)
EFFECTOR = {
    "StandZero": (0.2185, 0.1109, 0.0877),
    "StandInit": (0.1187, 0.1331, -0.0443),
    "Stand": (0.0637, 0.1323, -0.1005),
    "Crouch": (0.0902, 0.0611, -0.0556),
}
CAMERAS = [("CameraTop", (0.05871, 0, 0.06364), 0.0209435), ("CameraBottom", (0.05071, 0, 0.01774), 0.692896)]


def _other_side(name: str) -> str:
    return {"L": "R", "l": "r"}.get(name[0], name[0]) + name[1:]


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(NAO / "nao.xml"))


@pytest.fixture
def data(model: mujoco.MjModel) -> mujoco.MjData:
    return mujoco.MjData(model)


def _pose(model: mujoco.MjModel, data: mujoco.MjData, key: str = "StandInit", **angles: float) -> None:
    mujoco.mj_resetDataKeyframe(model, data, model.key(key).id)
    for name, angle in angles.items():
        data.joint(name).qpos = angle
        data.ctrl[model.actuator(name).id] = angle
    mujoco.mj_forward(model, data)


def _touching(model: mujoco.MjModel, data: mujoco.MjData) -> set[frozenset[str]]:
    return {frozenset(model.body(model.geom_bodyid[g]).name for g in c.geom) for c in data.contact}


# -- geometry ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", JOINTS)
def test_joint_is_where_and_as_the_robot_has_it(model: mujoco.MjModel, name: str) -> None:
    """Axis, origin, range, torque limit and servo range of every joint are the published ones."""
    axis, origin, limits, torque, speed, _ = JOINTS[name]
    joint, servo = model.joint(name), model.actuator(name)
    np.testing.assert_allclose(joint.axis, axis, atol=1e-12)
    np.testing.assert_allclose(model.body(joint.bodyid[0]).pos, origin, atol=1e-12)
    np.testing.assert_allclose(joint.pos, 0)
    np.testing.assert_allclose(joint.range, limits)
    np.testing.assert_allclose(servo.ctrlrange, limits)
    np.testing.assert_allclose(model.jnt_actfrcrange[joint.id], (-torque, torque))
    np.testing.assert_allclose(servo.forcerange, (-torque, torque))
    assert joint.damping[0] == pytest.approx(torque / speed, rel=2e-3)
    assert model.jnt_actgravcomp[joint.id]
    assert servo.trnid[0] == joint.id


def test_joints_come_head_first_then_left_then_right_arm(model: mujoco.MjModel) -> None:
    """Joints and servos share one order, without any leg joint."""
    assert [model.joint(k).name for k in range(model.njnt)] == list(JOINTS)
    assert [model.actuator(k).name for k in range(model.nu)] == list(JOINTS)


@pytest.mark.parametrize("key", EFFECTOR)
def test_hand_effector_is_where_forward_kinematics_says(model: mujoco.MjModel, data: mujoco.MjData, key: str) -> None:
    """In four postures the left hand's effector is at its check value, the right hand's at the mirror image."""
    _pose(model, data, key)
    torso, wrist = data.body("torso"), data.body("l_wrist")
    effector = wrist.xpos + wrist.xmat.reshape(3, 3) @ (0.05775, 0, -0.01231) - torso.xpos
    np.testing.assert_allclose(effector, EFFECTOR[key], atol=1e-4)
    np.testing.assert_allclose(data.site("LHand").xpos - torso.xpos, effector, atol=1e-12)
    np.testing.assert_allclose(data.site("RHand").xpos - torso.xpos, effector * (1, -1, 1), atol=1e-12)


def test_zero_pose_points_the_arms_forward(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """With all joints at zero the effector is at the sum of the link offsets, and all frames are parallel."""
    mujoco.mj_kinematics(model, data)
    np.testing.assert_allclose(data.site("LHand").xpos - data.body("torso").xpos, (0.2187, 0.113, 0.08769), atol=1e-9)
    np.testing.assert_allclose(data.body("l_wrist").xmat, data.body("torso").xmat, atol=1e-12)


def test_robot_stands_flat_on_the_floor(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Torso height is that of StandInit; both feet are level, an ankle's height above the floor."""
    _pose(model, data)
    assert data.body("torso").xpos[2] == pytest.approx(0.3199, abs=1e-4)
    assert data.body("Head").xpos[2] == pytest.approx(0.3199 + 0.1265, abs=1e-4)
    for foot in ("l_ankle", "r_ankle"):
        assert data.body(foot).xpos[2] == pytest.approx(0.04519, abs=1e-4)
        np.testing.assert_allclose(data.body(foot).xmat.reshape(3, 3), np.eye(3), atol=1e-9)


def test_mirrored_postures_give_mirrored_bodies(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Any left arm posture, mirrored, puts each right arm body and its centre of mass at the mirror image."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        for name in [n for n in JOINTS if n.startswith("L")]:
            angle = rng.uniform(*JOINTS[name][2])
            data.joint(name).qpos = angle
            data.joint(_other_side(name)).qpos = angle if "Pitch" in name else -angle
        mujoco.mj_kinematics(model, data)
        for body in ("LBicep", "LForeArm", "l_wrist"):
            left, right = data.body(body), data.body(_other_side(body))
            np.testing.assert_allclose(right.xpos, left.xpos * (1, -1, 1), atol=1e-12)
            np.testing.assert_allclose(right.xipos, left.xipos * (1, -1, 1), atol=1e-12)


@pytest.mark.parametrize(("camera", "position", "pitch"), CAMERAS)
def test_camera_is_mounted_and_built_as_published(
    model: mujoco.MjModel, data: mujoco.MjData, camera: str, position: tuple[float, ...], pitch: float
) -> None:
    """Position and downward pitch in the head's frame, image right along -y; 47.64 degrees are 271.8 px at 240 rows."""
    mujoco.mj_forward(model, data)
    head, rotation = data.body("Head"), data.camera(camera).xmat.reshape(3, 3)
    np.testing.assert_allclose(data.camera(camera).xpos - head.xpos, position, atol=1e-9)
    np.testing.assert_allclose(-rotation[:, 2], (np.cos(pitch), 0, -np.sin(pitch)), atol=1e-5)
    np.testing.assert_allclose(rotation[:, 0], (0, -1, 0), atol=1e-9)
    focal = 120 / np.tan(np.deg2rad(model.camera(camera).fovy[0]) / 2)
    assert focal == pytest.approx(271.8, abs=0.1)


# -- masses ------------------------------------------------------------------------------------------------------------


def test_masses_are_those_of_version_5(model: mujoco.MjModel) -> None:
    """Every link has its published mass, left and right alike; the whole robot weighs 5.305 kg."""
    for name, mass in MASSES.items():
        assert model.body(name).mass[0] == pytest.approx(mass)
        assert model.body(_other_side(name)).mass[0] == pytest.approx(mass)
    assert model.body_mass.sum() == pytest.approx(5.305, abs=1e-3)


def test_inertias_are_possible_and_symmetric(model: mujoco.MjModel) -> None:
    """Principal moments are positive, obey the triangle inequality, and agree between left and right."""
    for name in MASSES:
        moments = model.body(name).inertia
        assert moments.min() > 0
        assert moments.sum() >= 2 * moments.max()
        np.testing.assert_allclose(np.sort(model.body(_other_side(name)).inertia), np.sort(moments), rtol=1e-6)


def test_horizontal_arm_needs_its_published_torque(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """The stretched arm loads the shoulder with .54 Nm; the servo carries it without sag, as motor torque."""
    _pose(model, data, "StandZero")
    mujoco.mj_step(model, data, 720)
    np.testing.assert_allclose(data.qpos, model.key("StandZero").qpos, atol=1e-3)
    assert -data.joint("LShoulderPitch").qfrc_actuator[0] == pytest.approx(0.54, abs=0.005)


# -- contact and view --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("key", EFFECTOR)
def test_standing_postures_touch_nothing(model: mujoco.MjModel, data: mujoco.MjData, key: str) -> None:
    """The standing postures are free of contact, in the keyframe and after half a second of holding it."""
    _pose(model, data, key)
    assert data.ncon == 0
    mujoco.mj_step(model, data, 180)
    assert data.ncon == 0


def test_keyframes_command_their_own_postures(model: mujoco.MjModel) -> None:
    """Each keyframe's set-points are its joint angles, and lie inside the joint ranges."""
    for k in range(model.nkey):
        np.testing.assert_array_equal(model.key_ctrl[k], model.key_qpos[k])
        assert (model.key_qpos[k] >= model.jnt_range[:, 0]).all()
        assert (model.key_qpos[k] <= model.jnt_range[:, 1]).all()


def test_shoulder_roll_is_free_at_every_pitch(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """The straight arm's upper part reaches its whole documented range without touching the torso."""
    for pitch in np.linspace(-2.08, 2.08, 27):
        for roll in np.linspace(-0.314, 1.326, 15):
            _pose(model, data, "StandZero", LShoulderPitch=pitch, LShoulderRoll=roll)
            assert frozenset({"torso", "LBicep"}) not in _touching(model, data)


def test_torso_stops_an_arm_that_is_pushed_into_it(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """A hand commanded into the belly touches the torso and stays outside: less than 5 mm deep."""
    _pose(model, data, LShoulderPitch=1.0, LShoulderRoll=0.3, LElbowYaw=-1.2, LElbowRoll=-1.0)
    data.ctrl[[model.actuator(n).id for n in LEFT_ARM]] = 1.0, -0.3, -0.3, -1.5
    mujoco.mj_step(model, data, 720)
    assert any("torso" in pair for pair in _touching(model, data))
    assert data.contact.dist.min() > -0.005


def test_only_arms_touch(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Whatever the posture, arms touch torso, thighs or each other: never the head, and no arm itself."""
    rng = np.random.default_rng(1)
    arms = [{f"{s}Bicep", f"{s}ForeArm", f"{s.lower()}_wrist"} for s in "LR"]
    allowed = {frozenset({a, b}) for a in arms[0] | arms[1] for b in ("torso", "LThigh", "RThigh")}
    allowed |= {frozenset({a, b}) for a in arms[0] for b in arms[1]}
    seen: set[frozenset[str]] = set()
    for _ in range(1000):
        data.qpos = rng.uniform(*model.jnt_range.T)
        mujoco.mj_forward(model, data)
        seen |= _touching(model, data)
    assert seen
    assert seen <= allowed


@pytest.mark.parametrize(("camera", "position", "pitch"), CAMERAS)
def test_nothing_of_the_robot_is_in_the_camera(
    model: mujoco.MjModel, camera: str, position: tuple[float, ...], pitch: float
) -> None:
    """Torso and arms at rest stay out of the near plane (1 mm, 1.24 mm to its corners) at all legal head postures."""
    spec = mujoco.MjSpec.from_file(str(NAO / "nao.xml"))
    point = {"contype": 0, "conaffinity": 0, "mass": 0}
    spec.body("Head").add_geom(name="eye", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[1e-4, 0, 0], pos=position, **point)
    model = spec.compile()
    data, fromto = mujoco.MjData(model), np.zeros(6)
    coupling = _anatomy()["head"]["coupling"]
    head = model.body("Head").id
    seen = [g for g in range(model.ngeom) if model.geom_group[g] == 2 and model.geom_bodyid[g] != head]
    for yaw in np.linspace(-2.08, 2.08, 27):
        for share in (0.0, 0.5, 1.0):
            low, high = (np.interp(yaw, coupling["at"], coupling[k]) for k in ("lower", "upper"))
            _pose(model, data, HeadYaw=float(yaw), HeadPitch=float(low + share * (high - low)))
            eye = model.geom("eye").id
            assert min(mujoco.mj_geomDistance(model, data, eye, g, 0.05, fromto) for g in seen) > 0.002


@pytest.mark.parametrize(("camera", "position", "pitch"), CAMERAS)
def test_the_face_does_not_hide_the_view(
    model: mujoco.MjModel, data: mujoco.MjData, camera: str, position: tuple[float, ...], pitch: float
) -> None:
    """No ray of the picture, from the near plane on, meets a shape of the head."""
    _pose(model, data)
    centre, rotation = data.camera(camera).xpos, data.camera(camera).xmat.reshape(3, 3)
    drawn, hit = np.array([0, 0, 1, 0, 0, 0], np.uint8), np.array([-1], np.int32)
    for u in np.linspace(-0.588, 0.588, 21):
        for v in np.linspace(-0.441, 0.441, 17):
            ray = rotation @ (u, v, -1.0)
            mujoco.mj_ray(model, data, centre + 0.001 * ray, ray, drawn, 1, -1, hit, None)
            assert hit[0] < 0 or model.body(model.geom_bodyid[hit[0]]).name != "Head"


def test_hand_stays_inside_the_marker_cube(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Seen at right angles to the cube's four side faces, no shape of the hand sticks out through any."""
    mujoco.mj_forward(model, data)
    centre = data.site("LHand").xpos
    drawn, hit = np.array([0, 0, 1, 0, 0, 0], np.uint8), np.array([-1], np.int32)
    for angle in np.arange(4) * np.pi / 2:
        normal, side = np.array((0, np.cos(angle), np.sin(angle))), np.array((0, -np.sin(angle), np.cos(angle)))
        for x in np.linspace(-0.024, 0.024, 13):
            for y in np.linspace(-0.0249, 0.0249, 13):
                start = centre + (x, 0, 0) + y * side + 0.06 * normal
                distance = mujoco.mj_ray(model, data, start, -normal, drawn, 1, -1, hit, None)
                assert distance < 0 or distance >= 0.06 - 0.025


# -- servos ------------------------------------------------------------------------------------------------------------


def test_servos_are_damped_critically_or_more(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Back-EMF and servo damping reach 2 sqrt(kp I) at the largest inertia of random postures, within a percent."""
    rng, inertia = np.random.default_rng(2), np.zeros(model.nv)
    for _ in range(500):
        data.qpos = rng.uniform(*model.jnt_range.T)
        mujoco.mj_forward(model, data)
        inertia = np.maximum(inertia, np.diag(_mass_matrix(model, data)))
    kp, kv = model.actuator_gainprm[:, 0], -model.actuator_biasprm[:, 2]
    assert (model.dof_damping + kv >= 0.99 * 2 * np.sqrt(kp * inertia)).all()


def _mass_matrix(model: mujoco.MjModel, data: mujoco.MjData) -> Floats:
    """Joint-space inertia, column by column: the torques of unit accelerations."""
    columns = np.zeros((model.nv, model.nv))
    for torque, acceleration in zip(columns, np.eye(model.nv), strict=True):
        mujoco.mj_mulM(model, data, torque, acceleration)
    return columns


@pytest.mark.parametrize("name", [n for n in JOINTS if n[0] != "R"])
def test_full_speed_step_neither_overshoots_nor_breaks_a_limit(
    model: mujoco.MjModel, data: mujoco.MjData, name: str
) -> None:
    """A step through most of the range arrives within .5 s of the ramp's end; torque and no-load speed hold."""
    _, _, (low, high), torque, no_load, gear = JOINTS[name]
    _pose(model, data, "StandZero", RShoulderRoll=-1.0)
    start, goal = 0.85 * low + 0.15 * high, 0.15 * low + 0.85 * high
    if name == "LShoulderPitch":
        data.joint("LShoulderRoll").qpos = data.ctrl[model.actuator("LShoulderRoll").id] = 0.3
    servo, joint = model.actuator(name).id, data.joint(name)
    joint.qpos = start
    pace = SPEED_LIMIT[gear] * model.opt.timestep
    data.ctrl[servo] = start
    highest, fastest, hardest = start, 0.0, 0.0
    for _ in range(int((goal - start) / pace) + 180):
        data.ctrl[servo] = min(goal, data.ctrl[servo] + pace)
        mujoco.mj_step(model, data)
        highest = max(highest, joint.qpos[0])
        fastest, hardest = max(fastest, abs(joint.qvel[0])), max(hardest, abs(joint.qfrc_actuator[0]))
    assert highest < goal + 1e-3
    assert joint.qpos[0] == pytest.approx(goal, abs=2e-3)
    assert fastest < min(1.02 * no_load, SPEED_LIMIT[gear])
    assert hardest <= torque + 1e-9


def _ramping(steps: int) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """The model with `steps` physics steps a frame; servo commands are speeds of set-points (rad/s)."""
    spec = mujoco.MjSpec.from_file(str(NAO / "nao.xml"))
    for servo in spec.actuators:
        servo.dyntype, servo.ctrllimited = mujoco.mjtDyn.mjDYN_INTEGRATOR, False
    spec.option.timestep = 1 / (FPS * steps)
    model = spec.compile()
    return model, mujoco.MjData(model)


def _play(setpoints: Floats, steps: int) -> Floats:
    """Joint angles at frame ends while the set-points, shape (frames + 1, joints), are ramped through."""
    model, data = _ramping(steps)
    data.qpos = setpoints[0]
    angles = []
    for before, after in pairwise(setpoints):
        data.act, data.ctrl = before, (after - before) * FPS
        mujoco.mj_step(model, data, steps)
        angles.append(data.qpos.copy())
    return np.array(angles)


def _babble(model: mujoco.MjModel, frames: int, seed: int) -> Floats:
    """Set-points of random left-arm targets at .8 rad/s, and of full-speed head steps every half second."""
    rng = np.random.default_rng(seed)
    start = model.key("StandInit").qpos
    arm, head = ([model.joint(n).id for n in names] for names in (LEFT_ARM, HEAD))
    stride = np.zeros(model.nq)
    stride[arm], stride[head] = 0.8 / FPS, np.array((8.26797, 7.19407)) / FPS
    low, high = 0.95 * model.jnt_range.T
    setpoints, target = [start], start.copy()
    for frame in range(frames):
        if np.allclose(setpoints[-1][arm], target[arm]):
            target[arm] = rng.uniform(low[arm], high[arm])
        if frame % 8 == 0:
            target[head] = rng.uniform(low[head], high[head])
        setpoints.append(setpoints[-1] + np.clip(target - setpoints[-1], -stride, stride))
    return np.array(setpoints)


def test_ramps_are_followed_closely(model: mujoco.MjModel) -> None:
    """At .8 rad/s the arm lags behind its set-point by less than .03 rad, contact aside."""
    setpoints = _babble(model, 600, seed=0)
    lag = np.abs(_play(setpoints, 24) - setpoints[1:])[:, [model.joint(n).id for n in LEFT_ARM]]
    assert np.quantile(lag, 0.9) < 0.03


def _disagreement(steps: int, frames: int, seed: int) -> tuple[float, float]:
    """Largest difference (rad) of arm and of head between `steps` physics steps a frame and 1/1200 s."""
    model, _ = _ramping(steps)
    setpoints = _babble(model, frames, seed)
    difference = np.abs(_play(setpoints, steps) - _play(setpoints, 80)).max(axis=0)
    arm, head = ([model.joint(n).id for n in names] for names in (LEFT_ARM, HEAD))
    return float(difference[arm].max()), float(difference[head].max())


def test_physics_step_is_short_enough(model: mujoco.MjModel) -> None:
    """The model's step divides 1/15 s and agrees with 1/1200 s within .01 rad: ramps, contacts, head steps."""
    steps = 1 / (FPS * model.opt.timestep)
    assert steps == pytest.approx(round(steps), abs=1e-6)
    assert max(_disagreement(round(steps), frames=900, seed=0)) < 0.01


# -- anatomy -----------------------------------------------------------------------------------------------------------


def _anatomy() -> dict[str, Any]:
    return tomllib.loads((NAO / "anatomy.toml").read_text())


def test_head_coupling_is_symmetric_and_within_the_joint_range(model: mujoco.MjModel) -> None:
    """The 13-point table mirrors in yaw, spans the yaw range, and stays inside the pitch range (rounding aside)."""
    coupling = _anatomy()["head"]["coupling"]
    at, lower, upper = (np.array(coupling[key]) for key in ("at", "lower", "upper"))
    assert at.shape == lower.shape == upper.shape == (13,)
    np.testing.assert_array_equal(at, -at[::-1])
    np.testing.assert_array_equal(lower, lower[::-1])
    np.testing.assert_array_equal(upper, upper[::-1])
    assert (np.diff(at) > 0).all()
    low, high = model.joint(coupling["joint"]).range
    assert (lower >= low - 1e-3).all()
    assert (upper <= high + 1e-3).all()
    assert (np.abs(at[[0, -1]]) >= np.abs(model.joint(coupling["by"]).range)).all()


def test_anatomy_names_what_the_model_has(model: mujoco.MjModel) -> None:
    """Joints, camera, body and keyframe of the anatomy exist; speeds are the limits of each joint's gear."""
    anatomy = _anatomy()
    for part, names in (("arm", LEFT_ARM), ("head", HEAD)):
        assert tuple(anatomy[part]["joints"]) == names
        assert anatomy[part]["velocity"] == [SPEED_LIMIT[JOINTS[name][5]] for name in names]
    assert anatomy["camera"]["name"] in [model.camera(k).name for k in range(model.ncam)]
    assert model.key(anatomy["home"]).id == 0
    np.testing.assert_allclose(anatomy["marker"]["position"], model.site("LHand").pos)
    assert model.body(anatomy["marker"]["body"]).id == model.site("LHand").bodyid[0]


def test_babbling_ranges_lie_inside_the_joint_limits(model: mujoco.MjModel) -> None:
    """Every named range has one ordered interval a joint, inside that joint's limits."""
    for ranges in _anatomy()["ranges"].values():
        for name, (low, high) in zip(LEFT_ARM, ranges, strict=True):
            assert model.joint(name).range[0] <= low < high <= model.joint(name).range[1]


if __name__ == "__main__":
    for steps in (10, 15, 18, 19, 20, 24, 30, 40):
        arm, head = np.max([_disagreement(steps, frames=1500, seed=seed) for seed in range(6)], axis=0)
        print(f"1/{FPS * steps} s: arm {arm:.4f} rad, head {head:.4f} rad")
