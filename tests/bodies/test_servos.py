"""Proposed servos: arms that they drive go where they are told, soon, without overshoot, and stay there."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from somatopy.bodies import Anatomy, MujocoBody, proposed_servos
from somatopy.bodies.additions import add

ANATOMY = """
name = "Random"
model = "random.xml"
arm = {{ joints = [{arm}] }}
head = {{ joints = ["pan", "tilt"] }}
camera = {{ name = "eye" }}
marker = {{ body = "b{last}", position = [0.0, 0.0, 0.1] }}

[add]
camera = {{}}

[add.neck]
body = "world"
position = [0.0, 1.0, 1.0]
joints = ["pan", "tilt"]
limits = [[-1.0, 1.0], [-1.0, 1.0]]

[add.servos]
"""


def random_arm(rng: np.random.Generator, folder: Path, joint: str = "", actuators: str = "") -> Path:
    """An anatomy without servos of an arm of two to four links, of 5 to 30 cm and 50 g to 1 kg each."""
    n = int(rng.integers(2, 5))
    body, end, last = "", "", 0.0
    for k in range(n):
        axis, length = ["1 0 0", "0 1 0", "0 0 1"][(k + rng.integers(2)) % 3], rng.uniform(0.05, 0.3)
        body += (
            f'<body name="b{k}" pos="0 0 {last}"><joint name="j{k}" axis="{axis}" range="-1.5 1.5" '
            f'damping="{rng.uniform(0, 0.2):.3f}" armature="{rng.uniform(0, 0.01):.4f}" {joint}/>'
            f'<geom type="capsule" fromto="0 0 0 0 0 {length}" size=".02" mass="{rng.uniform(0.05, 1)}"/>'
        )
        last, end = length, end + "</body>"
    (folder / "random.xml").write_text(
        f'<mujoco><compiler angle="radian"/><option timestep="{rng.choice([0.001, 0.002, 0.005])}"><flag '
        f'contact="disable"/></option><worldbody><body pos="0 0 1" euler="0 {rng.uniform(-2, 2)} 0">{body}{end}</body>'
        f"</worldbody><actuator>{actuators}</actuator></mujoco>"
    )
    names = ", ".join(f'"j{k}"' for k in range(n))
    path = folder / "random.toml"
    path.write_text(ANATOMY.format(arm=names, last=n - 1))
    return path


def with_proposal(path: Path) -> Path:
    """The anatomy with the proposed servos in it."""
    servos = proposed_servos(Anatomy.load(path))
    lines = [f"{name} = {{ kp = {s.kp}, kv = {s.kv}, force = {s.force} }}" for name, s in servos.items()]
    path.write_text(path.read_text() + "\n".join(lines))
    return path


def steps(path: Path, start: np.ndarray, goal: np.ndarray, seconds: float) -> np.ndarray:
    """Postures of arm and head while all servos are told at once to be elsewhere, shape (steps, n), rad."""
    anatomy = Anatomy.load(path)
    spec = mujoco.MjSpec.from_file(str(anatomy.model))
    add(spec, anatomy)
    model = spec.compile()
    data = mujoco.MjData(model)
    joints = [model.joint(name) for name in (*anatomy.arm.joints, *anatomy.head.joints)]
    places = np.array([joint.qposadr[0] for joint in joints])
    servos = [model.actuator(f"somatopy_servo_{joint.name}").id for joint in joints]
    data.qpos[places] = data.ctrl[servos] = start
    mujoco.mj_step(model, data, round(1.0 / model.opt.timestep))
    data.ctrl[servos] = goal
    seen = []
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)
        seen.append(data.qpos[places].copy())
    return np.array(seen)


@pytest.mark.parametrize("seed", range(8))
def test_arm_takes_a_step_soon_without_overshoot_and_holds(tmp_path: Path, seed: int) -> None:
    """0.3 rad at once in all joints: within .05 rad after half a second, under 5 % beyond, and no sag over .02 rad."""
    rng = np.random.default_rng(seed)
    path = with_proposal(random_arm(rng, tmp_path))
    n = len(Anatomy.load(path).arm.joints) + 2
    start = rng.uniform(-0.9, 0.6, n) * ([1.0] * (n - 2) + [0.5] * 2)
    move = 0.3 * rng.choice([-1.0, 1.0], n)
    seen = steps(path, start, start + move, 2.0)
    after = seen[len(seen) // 4 :]
    assert np.abs(after - start - move).max() < 0.05
    beyond = (seen - seen[-1]) * np.sign(move)
    assert beyond.max() < 0.05 * 0.3
    assert np.abs(seen[-1] - start - move).max() < 0.02
    assert np.abs(np.diff(seen[-100:], axis=0)).max() < 1e-5, "it comes to rest"


def test_body_babbles_with_the_proposal(tmp_path: Path) -> None:
    """In a body, the joints follow their ramping set-points closely."""
    body = MujocoBody(with_proposal(random_arm(np.random.default_rng(1), tmp_path)))
    reading, rng, worst = body.reset(), np.random.default_rng(0), 0.0
    for k in range(150):
        if k % 15 == 0:
            targets = rng.uniform(body.arm.lower, body.arm.upper), rng.uniform(body.head.lower, body.head.upper)
        before = reading
        reading = body.step(*targets)
        close = np.abs(before.arm_command - before.arm) < 0.01
        worst = max([worst, *np.abs(reading.arm - before.arm)[close & (before.arm_command == reading.arm_command)]])
    assert worst < 0.02
    assert body.arm_moves_alone


def test_gains_grow_with_what_a_joint_carries_and_holds(tmp_path: Path) -> None:
    """The first joint carries all others; friction and weight make a servo stiffer."""
    plain = proposed_servos(Anatomy.load(random_arm(np.random.default_rng(3), tmp_path)))
    rough = proposed_servos(Anatomy.load(random_arm(np.random.default_rng(3), tmp_path, joint='frictionloss="30"')))
    assert all(rough[name].kp >= plain[name].kp for name in plain)
    assert rough["j1"].kp >= 30 / 0.02 and (rough["j1"].force or 0) > 30
    assert list(plain)[-2:] == ["pan", "tilt"]


@pytest.mark.parametrize(
    ("joint", "actuators", "force"),
    [
        ('actuatorfrclimited="true" actuatorfrcrange="-90 80"', "", 80),
        ("", '<motor joint="j0" gear="-50" ctrlrange="-1 1" ctrllimited="true"/>', 50),
        ("", '<general joint="j0" gear="10" forcerange="-9 9" forcelimited="true"/>', 90),
        ("", '<motor joint="j0" gear="50" ctrlrange="-.001 .001" ctrllimited="true"/>', None),
    ],
)
def test_force_is_the_models_where_it_holds(tmp_path: Path, joint: str, actuators: str, force: float | None) -> None:
    """Limits of joint, motor and control, behind a gear; one that cannot hold the arm is none."""
    servo = proposed_servos(Anatomy.load(random_arm(np.random.default_rng(5), tmp_path, joint, actuators)))["j0"]
    assert servo.force is not None
    assert servo.force == force if force else servo.force > 1
