"""The physics of a frame: the compiled way is the way through Python, to the last bit."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from somatopy.bodies import Diverged, MujocoBody, engine, physics

Robot = Callable[..., Path]


def walk(body: MujocoBody, frames: int) -> bytes:
    """Random targets, each held for some frames, up to a little beyond the limits."""
    rng, passed = np.random.default_rng(0), []
    for frame in range(frames):
        if frame % 6 == 0:
            arm, head = (rng.uniform(group.lower - 0.1, group.upper + 0.1) for group in (body.arm, body.head))
        body.step(arm, head)
        passed.append(body.state()["physics"])
    return np.array(passed).tobytes()


@pytest.mark.parametrize("arm_speed", [0.8, None])
def test_compiled_physics_is_the_same_to_the_last_bit(arm_speed: float | None, monkeypatch: pytest.MonkeyPatch) -> None:
    """All of MuJoCo's state over 300 frames with contacts, at babbling speed and as fast as the joints go."""
    assert engine.function("mj_step")
    compiled = walk(MujocoBody("nao", arm_speed=arm_speed), 300)
    monkeypatch.setattr(physics, "function", lambda name: 0)
    assert walk(MujocoBody("nao", arm_speed=arm_speed), 300) == compiled


def test_function_that_is_not_there_is_0() -> None:
    """So that whoever asked can call through Python instead."""
    assert engine.function("mj_fly") == 0


def test_model_that_says_how_much_memory_it_takes_is_stepped_through_python(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """MuJoCo ends the process where that is too little, unless Python called it: its functions are not asked for."""

    def refuse(name: str) -> int:
        raise AssertionError(name)

    monkeypatch.setattr(physics, "function", refuse)
    with pytest.raises(AssertionError, match="mj_step"):
        MujocoBody(robot())
    body = MujocoBody(robot(mjcf=("<worldbody>", '<size memory="1M"/><worldbody>')))
    assert body.step([0.5, 0.0], [0.0, 0.0]).arm[0] > 0


# -- robots that come apart --------------------------------------------------------------------------------------------

LIFT = '<position joint="lift" kp="20" kv="1"/>'
#: A tail with a spring that its physics step is far too long for, and a servo so hard that the arm's is.
APART = {
    "wag": (
        '<body name="neck"',
        '<body name="tail"><joint name="wag" axis="0 0 1" stiffness="38" springref=".5"/>'
        '<geom type="capsule" fromto="0 0 0 -.1 0 0" size=".01" mass=".01"/></body><body name="neck"',
    ),
    "lift": (LIFT, '<position joint="lift" kp="1e13"/>'),
}


@pytest.fixture(params=["compiled", "through Python"])
def way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Both ways of stepping; MuJoCo writes its log into the current folder."""
    monkeypatch.chdir(tmp_path)
    if request.param == "through Python":
        monkeypatch.setattr(physics, "function", lambda name: 0)


def fall_apart(body: MujocoBody) -> str:
    """Move until the physics fails, and say what it said."""
    with pytest.raises(Diverged) as caught:
        for frame in range(300):
            body.step([0.9 * (-1) ** frame, 0.1], [1.0, 0.0])
    return str(caught.value)


@pytest.mark.usefixtures("way")
@pytest.mark.parametrize("joint", APART)
def test_physics_that_becomes_unstable_is_an_error(robot: Robot, joint: str) -> None:
    """MuJoCo starts such a robot anew and goes on; the body says which joint, what to try and when, and stops."""
    body = MujocoBody(robot(mjcf=APART[joint]))
    said = fall_apart(body)
    assert f"of the joint {joint!r} is huge or no number" in said
    assert "smaller physics step than" in said and "softer servos" in said and "kinematic" in said
    now = body.state()["frame"] / 15
    assert now <= float(said.split(" at ")[1].split(" s:")[0]) <= now + 1 / 15


@pytest.mark.usefixtures("way")
def test_body_that_fell_apart_stands_where_it_stood(robot: Robot) -> None:
    """Its state is that before the frame, so that nothing of what went wrong can be kept and gone on with."""
    body, states = MujocoBody(robot(mjcf=APART["wag"])), []
    with pytest.raises(Diverged):
        for frame in range(300):
            states.append(body.state())
            body.step([0.9 * (-1) ** frame, 0.1], [1.0, 0.0])
    assert len(states) > 1
    assert all(np.array_equal(value, body.state()[key]) for key, value in states[-1].items())
    with pytest.raises(Diverged):
        body.step([0.9 * (-1) ** (len(states) - 1), 0.1], [1.0, 0.0])
    body.reset()
    body.step([0.0, 0.0], [0.0, 0.0])
