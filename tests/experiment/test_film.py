"""Pictures of a run, drawn again: each shows what the eye finds at that posture, and the robot as it stood."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest

from somatopy.bodies import BodyError, MujocoBody
from somatopy.bodies.outside import Onlooker
from somatopy.experiment import Description, film
from somatopy.experiment.film import Replay, photographs, posed
from somatopy.eyes import FiducialEye, GeometricEye
from somatopy.registry import Settings

Short = Callable[..., Description]
Postures = list[tuple[np.ndarray, np.ndarray]]


@pytest.fixture(scope="module")
def body() -> MujocoBody:
    return MujocoBody("nao", motion="kinematic", arm_speed=None)


@pytest.fixture(scope="module")
def postures(body: MujocoBody) -> Postures:
    """Twelve legal postures of arm and head, the hand seen by the geometric eye in every other."""
    rng, eye = np.random.default_rng(0), GeometricEye(body.camera, body.marker, body.occluders)
    found: Postures = []
    while len(found) < 12:
        arm, head = (rng.uniform(group.lower, group.upper) for group in (body.arm, body.head))
        head = body.legal(head)
        if (eye.find(body.view(arm, head)) is not None) == (len(found) % 2 == 0):
            found.append((arm, head))
    return found


@pytest.mark.parametrize("motion", ["kinematic", "dynamic"])
def test_placed_is_where_it_was_told(motion: str, postures: Postures) -> None:
    """At once, exactly, at rest; true poses are those of `view`, but for the sag of a wrist that no one commands."""
    robot = MujocoBody("nao", motion=motion)  # type: ignore[arg-type]
    robot.reset()
    for arm, head in postures:
        for _ in range(3):
            robot.step(robot.arm.upper, robot.head.lower)
        reading = robot.place(arm, head)
        for got, told in ((reading.arm, arm), (reading.head, head)):
            assert np.array_equal(got, told)
        assert np.array_equal(reading.arm_command, arm) and np.array_equal(reading.head_command, head)
        view = robot.view(arm, head)
        assert reading.view is not None
        assert np.allclose(reading.view.camera, view.camera, rtol=0, atol=1e-9)
        assert np.allclose(reading.view.marker, view.marker, rtol=0, atol=1e-9 if motion == "kinematic" else 1e-3)
        assert not robot.data.qvel.any()


@pytest.mark.parametrize("motion", ["kinematic", "dynamic"])
def test_placed_it_stays(motion: str, body: MujocoBody) -> None:
    """Told to stay where it was placed, it does, within what servos give way to gravity."""
    robot = MujocoBody("nao", motion=motion)  # type: ignore[arg-type]
    arm, head = np.array([0.4, 0.2, -0.8, -0.6]), np.array([0.3, 0.1])
    robot.place(arm, head)
    for _ in range(10):
        reading = robot.step(arm, head)
    assert np.abs(reading.arm - arm).max() < 0.01 and np.abs(reading.head - head).max() < 0.01


def test_placing_clips_nothing_and_refuses_nonsense(body: MujocoBody) -> None:
    """Beyond the limits is where it stands, as recorded postures may be; wrong lengths and NaN are named."""
    far = np.array([3.0, 0.0, 0.0, -0.5])
    assert np.array_equal(body.place(far, [0, 0]).arm, far)
    with pytest.raises(ValueError, match=r"arm target has shape \(2,\)"):
        body.place([0, 0], [0, 0])
    with pytest.raises(ValueError, match=r"head target .* not finite"):
        body.place(far, [0, np.nan])


@pytest.mark.gl
def test_photographs_show_what_the_eye_finds(short: Short, postures: Postures) -> None:
    """Tags and the hand's pixel are those of the detector on the same posture, and are in the picture itself."""
    robot = MujocoBody("nao", motion="kinematic", arm_speed=None)
    eye = FiducialEye(robot.camera, robot.marker)
    taken = photographs(short().body, *zip(*postures, strict=True))
    assert len(taken) == len(postures)
    seen = 0
    for (arm, head), photograph in zip(postures, taken, strict=True):
        sighting = eye.look(robot.place(arm, head))
        assert photograph.image.shape == (240, 320, 3) and photograph.image.dtype == np.uint8
        found = eye.detect(photograph.image)
        assert list(found) == list(photograph.tags)
        assert all(np.array_equal(found[tag], photograph.tags[tag]) for tag in found)
        assert photograph.pixel == (sighting.pixel if sighting else None)
        assert (sighting is None) == (not photograph.tags)
        assert sighting is None or sighting.tag in photograph.tags
        seen += sighting is not None
    assert 4 <= seen <= 8
    assert len({photograph.image.tobytes() for photograph in taken}) == len(taken)
    robot.close()


@pytest.mark.gl
def test_photographs_are_of_the_recorded_posture_whatever_the_motion(short: Short, postures: Postures) -> None:
    """Physics or none, fast or slow babbling: the pictures of a posture are the same; none asked, none taken."""
    arms, heads = zip(*postures[:2], strict=True)
    one, other = (
        [photograph.image.tobytes() for photograph in photographs(body, arms, heads)]
        for body in (short().body, {"kind": "mujoco", "motion": "dynamic", "head_speed": 0.1})
    )
    assert one == other
    assert photographs(short().body, [], []) == []


def test_a_body_that_cannot_be_posed_is_refused_by_name() -> None:
    """It is closed all the same."""
    closed: list[object] = []

    class Rigid(Settings):
        own_kind = "rigid"

        def build(self, context: object) -> object:
            return SimpleNamespace(close=lambda: closed.append(self))

    for call in (lambda: photographs(Rigid(), [], []), lambda: posed(Rigid()).__enter__()):
        with pytest.raises(BodyError, match=r"body 'rigid' cannot be put into postures at once: it has no place\(\)"):
            call()
    assert len(closed) == 2


# -- a run, frame by frame ---------------------------------------------------------------------------------------------


def hurt(short: Short, *damages: dict[str, object]) -> dict[str, object]:
    """The table of an experiment whose second phase has these damages."""
    phases = [
        {"name": "intact", "frames": 2},
        {"name": "hurt", "frames": 2, "interventions": [*damages, {"kind": "plastic", "parts": []}]},
    ]
    return short(phases=phases).model_dump(mode="json")


@pytest.mark.gl
def test_a_still_is_what_the_eye_and_an_onlooker_see(short: Short, postures: Postures) -> None:
    """To the bit, as photographs of the same postures, and tags as the detector finds them."""
    (arm, head), robot = postures[0], MujocoBody("nao", motion="kinematic", arm_speed=None)
    (photograph,) = photographs(short().body, [arm], [head])
    onlooker = Onlooker(robot, None, (90, 80))
    with Replay(hurt(short), (90, 80)) as replay:
        still = replay.still(0, arm, head)
    assert np.array_equal(still.inside, photograph.image) and list(still.tags) == list(photograph.tags)
    assert all(np.array_equal(still.tags[tag], photograph.tags[tag]) for tag in still.tags) and still.tags
    assert np.array_equal(still.outside, onlooker.picture(arm, head)) and still.eye is None
    onlooker.close()
    robot.close()


@pytest.mark.gl
def test_injuries_are_seen_in_their_phase_alone(short: Short, postures: Postures) -> None:
    """From outside and through the eye; what only changes percepts or the learner changes no picture."""
    arm, head = postures[0]
    marker, felt = {"kind": "marker", "by": 0.05}, {"kind": "offset"}
    with Replay(hurt(short, felt, marker), (90, 80)) as replay:
        intact, injured, again = (replay.still(phase, arm, head) for phase in (0, 1, 0))
    assert np.array_equal(intact.inside, again.inside) and np.array_equal(intact.outside, again.outside)
    assert not np.array_equal(intact.inside, injured.inside)
    assert not np.array_equal(intact.outside, injured.outside)
    robot = MujocoBody("nao", motion="kinematic", arm_speed=None)
    robot.move_marker(0.05)
    robot.place(arm, head)
    assert np.array_equal(injured.inside, robot.picture())
    robot.close()
    with Replay(hurt(short, felt), (90, 80)) as replay:
        assert np.array_equal(replay.still(1, arm, head).inside, intact.inside)


def test_what_has_no_mujoco_model_is_not_filmed(short: Short, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is named, and closed."""
    closed: list[object] = []
    members = ("arm", "head", "camera", "marker", "reset", "step", "place", "picture")
    puppet = SimpleNamespace(**dict.fromkeys(members, print), close=lambda: closed.append(1))
    monkeypatch.setattr(film.BODIES, "validated", lambda _: SimpleNamespace(kind="puppet", build=lambda _: puppet))
    with pytest.raises(BodyError, match=r"'mujoco' cannot be filmed: films are drawn of robots with a MuJoCo model"):
        Replay(hurt(short))
    assert closed == [1]
