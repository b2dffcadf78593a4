"""Stored arm movements: with one, a body gives the same bytes in less time; it ends its use by itself where it must."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from somatopy.bodies import ArmTrack, Diverged, MujocoBody, arm_track, kept_track
from somatopy.files import cache_folder
from somatopy.percept import Floats, Reading

Robot = Callable[..., Path]
FRAMES = 2000  # more than two stretches between stored states


def commands(body: MujocoBody, frames: int, seed: int = 0) -> Floats:
    """Arm targets up to a little beyond the limits, each held for 20 frames."""
    rng = np.random.default_rng(seed)
    drawn = [rng.uniform(body.arm.lower - 0.1, body.arm.upper + 0.1) for _ in range(-(-frames // 20))]
    return np.repeat(drawn, 20, axis=0)[:frames]


def gaze(body: MujocoBody, frame: int) -> Floats:
    return np.random.default_rng(frame // 6).uniform(body.head.lower - 0.1, body.head.upper + 0.1)


def bits(reading: Reading) -> bytes:
    """All that a reading says, but for the picture."""
    view = reading.view
    assert view is not None
    vectors = reading.arm, reading.head, reading.arm_command, reading.head_command, view.camera, view.marker
    return np.concatenate([[reading.time, reading.dt, reading.overlap], *vectors, view.occluders.ravel()]).tobytes()


def play(body: MujocoBody, arms: Floats, first: int, last: int) -> list[bytes]:
    return [bits(body.step(arms[frame], gaze(body, frame))) for frame in range(first, last)]


def same_state(a: MujocoBody, b: MujocoBody) -> bool:
    first, second = a.state(), b.state()
    return all(np.array_equal(first[key], second[key]) for key in first)


@pytest.fixture
def crane(robot: Robot) -> Callable[[], MujocoBody]:
    path = robot()
    return lambda: MujocoBody(path, arm_speed=0.5)


def test_nao_gives_the_same_bytes_with_a_track_and_without() -> None:
    """Every number of every reading, overlap and all occluders included, and the state in the end; two heads."""
    first = MujocoBody("nao")
    arms = commands(first, 1000)
    track = ArmTrack.of(first, arms)
    for speed in (None, 2.0):
        plain, led = MujocoBody("nao", head_speed=speed), MujocoBody("nao", head_speed=speed)
        assert led.use_track(track) and led.tracked and not plain.tracked
        expected = play(plain, arms, 0, len(arms))
        assert play(led, arms, 0, len(arms)) == expected
        assert led.tracked and same_state(led, plain)


def test_making_a_track_leaves_the_body_alone(crane: Any) -> None:
    """The arm is moved in another body."""
    body, other = crane(), crane()
    play(body, commands(body, 10), 0, 10), play(other, commands(body, 10), 0, 10)
    ArmTrack.of(body, commands(body, 30))
    assert same_state(body, other)


@pytest.mark.parametrize("at", [0, 1, 7, 899, 900, 901, 1350, 1999, 2000])
def test_state_with_a_track_is_that_without(crane: Any, at: int) -> None:
    """At any moment, so that a checkpoint made with one resumes without, and the other way round, to the last bit."""
    plain, led = crane(), crane()
    arms = commands(plain, FRAMES + 40)
    track = ArmTrack.of(plain, arms[:FRAMES])
    led.use_track(track)
    play(plain, arms, 0, at), play(led, arms, 0, at)
    assert same_state(led, plain)
    state, future = led.state(), play(plain, arms, at, at + 40)
    fresh, fresh_led = crane(), crane()
    fresh.restore(state), fresh_led.restore(state)
    assert play(fresh, arms, at, at + 40) == future
    assert fresh_led.use_track(track)
    assert play(fresh_led, arms, at, at + 40) == future
    led.restore(state)
    assert led.tracked and play(led, arms, at, at + 40) == future
    assert led.tracked == (at + 40 <= FRAMES)


def test_asking_for_states_again_and_again_changes_nothing(crane: Any) -> None:
    """Nor does asking at earlier moments, after the body was put back."""
    plain, led = crane(), crane()
    arms = commands(plain, FRAMES)
    led.use_track(ArmTrack.of(plain, arms))
    states, moments = {}, (100, 130, 890, 1000, 1005)
    for frame in range(1010):
        if frame in moments:
            states[frame] = led.state()
            assert same_state(led, plain)
        assert bits(led.step(arms[frame], gaze(led, frame))) == bits(plain.step(arms[frame], gaze(plain, frame)))
    for frame in (1000, 130, 1005, 100):
        led.restore(states[frame])
        plain.restore(states[frame])
        assert led.tracked and same_state(led, plain)
        assert play(led, arms, frame, frame + 5) == play(plain, arms, frame, frame + 5)


def other_target(body: MujocoBody, arms: Floats, frame: int) -> None:
    arms[frame:] = arms[frame:] - 0.2


def injury(body: MujocoBody, arms: Floats, frame: int) -> None:
    body.model.joint("lift").damping[0] += 0.5


def placed(body: MujocoBody, arms: Floats, frame: int) -> None:
    body.place([0.1, 0.1], [0.0, 0.0])


def dropped(body: MujocoBody, arms: Floats, frame: int) -> None:
    body.drop_track()


@pytest.mark.parametrize("change", [other_target, injury, placed, dropped])
@pytest.mark.parametrize("at", [3, 1234])
def test_use_ends_by_itself_where_the_movement_is_another(crane: Any, change: Any, at: int) -> None:
    """From that frame on physics moves the arm, as it would have without a track until then."""
    plain, led = crane(), crane()
    arms = commands(plain, FRAMES)
    led.use_track(ArmTrack.of(plain, arms))
    play(plain, arms, 0, at), play(led, arms, 0, at)
    for body in (plain, led):
        ours = arms.copy()
        change(body, ours, at)
    assert play(led, ours, at, at + 30) == play(plain, ours, at, at + 30)
    assert not led.tracked and same_state(led, plain)


def test_movement_that_is_longer_than_its_track_goes_on(crane: Any) -> None:
    """By physics, from where the track ends."""
    plain, led = crane(), crane()
    arms = commands(plain, 80)
    led.use_track(ArmTrack.of(plain, arms[:50]))
    assert play(led, arms, 0, 80) == play(plain, arms, 0, 80)
    assert not led.tracked


def test_reset_begins_the_track_anew(crane: Any) -> None:
    """It leads again from the start."""
    body = crane()
    arms = commands(body, 60)
    body.use_track(ArmTrack.of(body, arms))
    first = play(body, arms, 0, 30)
    body.reset()
    assert body.tracked and play(body, arms, 0, 30) == first


def test_track_of_another_moment_or_movement_is_refused(crane: Any) -> None:
    """Where the arm does not stand where the track's does; the body then goes on as it would have."""
    plain, led = crane(), crane()
    arms = commands(plain, 100)
    track, other = ArmTrack.of(plain, arms), ArmTrack.of(plain, commands(plain, 100, seed=1))
    play(plain, arms, 0, 40), play(led, arms, 0, 40)
    assert not led.use_track(other) and not led.tracked
    assert play(led, arms, 40, 60) == play(plain, arms, 40, 60)
    assert led.use_track(track)
    led.restore(crane().state())
    assert led.tracked
    led.restore(plain.state() | {"frame": np.int64(30)})
    assert not led.tracked


def test_arms_that_need_no_track_or_can_use_none_refuse_it(robot: Robot, crane: Any) -> None:
    """Kinematic ones, and those that the head moves."""
    track = ArmTrack.of(crane(), commands(crane(), 20))
    kinematic = MujocoBody(robot(), "kinematic")
    change = ("</worldbody>", '</worldbody><equality><joint joint1="lift" joint2="pan"/></equality>')
    coupled = MujocoBody(robot(mjcf=change))
    for body in (kinematic, coupled):
        assert not body.use_track(track) and not body.tracked
        assert kept_track(body, b"", 20, lambda: commands(crane(), 20)) is None
        with pytest.raises(ValueError, match=r"arm of Crane \(.*ic\) does not move by physics and alone"):
            ArmTrack.of(body, commands(body, 20))


def test_file_gives_the_track_back(crane: Any, tmp_path: Path) -> None:
    """Every array, to the last bit."""
    track = ArmTrack.of(crane(), commands(crane(), 950))
    track.save(tmp_path / "arm.npz")
    again = ArmTrack.load(tmp_path / "arm.npz")
    for name in ("targets", "places", "states", "setpoints"):
        assert getattr(again, name).tobytes() == getattr(track, name).tobytes()
        assert getattr(again, name).shape == getattr(track, name).shape


@pytest.fixture
def cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    folder = cache_folder("arm")
    assert folder is not None
    return folder


def test_track_is_made_once_and_kept(crane: Any, cache: Path) -> None:
    """The second time no one is asked for targets; another head's speed and eye do not matter to it."""
    asked = []

    def targets() -> Floats:
        asked.append(1)
        return commands(crane(), 30)

    first, second = (kept_track(crane(), b"seed 0", 30, targets) for _ in range(2))
    assert first is not None and second is not None
    assert first.places.tobytes() == second.places.tobytes()
    slow = MujocoBody(crane().anatomy, arm_speed=0.5, head_speed=0.3)
    assert kept_track(slow, b"seed 0", 30, targets) is not None
    assert len(asked) == 1 and len(list(cache.iterdir())) == 1


@pytest.mark.parametrize("what", ["key", "arm speed", "gear", "injury"])
def test_another_movement_has_another_track(robot: Robot, crane: Any, cache: Path, what: str) -> None:
    """Whatever the movement depends on is in its name."""
    body = crane()
    kept_track(body, b"seed 0", 30, lambda: commands(body, 30))
    if what == "arm speed":
        body = MujocoBody(body.anatomy, arm_speed=0.6)
    if what == "gear":  # slower than before, and still faster than the set-points
        body = MujocoBody(robot(anatomy=("velocity = [2.0, 3.0]", "velocity = [2.0, 0.6]")), arm_speed=0.5)
    if what == "injury":
        injury(body, np.zeros((0, 2)), 0)
    kept_track(body, b"seed 1" if what == "key" else b"seed 0", 30, lambda: commands(body, 30))
    assert len(list(cache.iterdir())) == 2


def test_longer_movement_serves_a_shorter_run(crane: Any, cache: Path) -> None:
    """Nobody is asked for targets, the run has the bytes that it has alone, and its states go on without the track."""
    arms = commands(crane(), FRAMES)
    assert kept_track(crane(), b"", FRAMES, lambda: arms) is not None
    plain, led = crane(), crane()
    assert led.share_arm(b"", 950, None)
    assert play(led, arms, 0, 950) == play(plain, arms, 0, 950)
    assert led.tracked and same_state(led, plain)
    fresh = crane()
    fresh.restore(led.state())
    assert play(fresh, arms, 950, 960) == play(plain, arms, 950, 960)


def test_shorter_movement_gives_way_to_a_longer_one(crane: Any, cache: Path) -> None:
    """It serves no longer run; where the longer one is computed, that is what is kept, in the same place."""
    arms = commands(crane(), 100)
    kept_track(crane(), b"", 50, lambda: arms[:50])
    assert kept_track(crane(), b"", 100, None) is None
    assert not crane().share_arm(b"", 51, None)
    longer = kept_track(crane(), b"", 100, lambda: arms)
    assert longer is not None and len(longer) == 100
    again = kept_track(crane(), b"", 50, None)
    assert again is not None and again.places.tobytes() == longer.places.tobytes()
    assert len(list(cache.iterdir())) == 1


def test_run_without_frames_has_no_track(crane: Any, cache: Path) -> None:
    """Nothing is computed, and nothing kept."""
    assert kept_track(crane(), b"", 0, lambda: np.empty((0, 2))) is None
    assert not crane().share_arm(b"", 0, lambda: np.empty(0))
    assert not cache.exists()


def test_arm_that_falls_apart_is_not_shared(
    robot: Robot, cache: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Its run goes on until it does: what it was before is recorded, and the message says when."""
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its log into the current folder
    lift = '<position joint="lift" kp="20" kv="1"/>'
    body = MujocoBody(robot(mjcf=(lift, '<position joint="lift" kp="1e13"/>')))
    arms = np.array([[0.9 * (-1) ** frame, 0.1] for frame in range(300)])
    assert not body.share_arm(b"", 300, lambda: arms)
    with pytest.raises(Diverged, match="of the joint 'lift' is huge"):
        play(body, arms, 0, 300)


@pytest.mark.parametrize("content", [b"", b"no zip", None])
def test_spoilt_file_is_made_anew(crane: Any, cache: Path, content: bytes | None) -> None:
    """An empty file, another one, and half of it."""
    expected = kept_track(crane(), b"", 30, lambda: commands(crane(), 30))
    file = next(cache.iterdir())
    file.write_bytes(file.read_bytes()[:500] if content is None else content)
    again = kept_track(crane(), b"", 30, lambda: commands(crane(), 30))
    assert again is not None and expected is not None and again.places.tobytes() == expected.places.tobytes()
    assert ArmTrack.load(file).places.tobytes() == expected.places.tobytes()


def test_without_a_cache_folder_it_is_made_each_time(crane: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is written, and nothing fails."""
    monkeypatch.setattr(arm_track, "cache_folder", lambda name: None)
    assert kept_track(crane(), b"", 30, lambda: commands(crane(), 30)) is not None
