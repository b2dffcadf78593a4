"""The laws of bodies: ours keep them, and a body that breaks one is told which."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from somatopy.bodies import MujocoBody, check_body
from somatopy.contract import ContractError, Resumable, Twin
from somatopy.percept import Camera, JointGroup, Marker, Reading, Shapes, View


def stretched(body: MujocoBody) -> None:
    """An injury: the forearm is longer."""
    body.model.body("l_wrist").pos[0] += 0.01


@pytest.mark.parametrize("motion", ["kinematic", "dynamic"])
def test_the_nao_keeps_them(motion: Any) -> None:
    """With and without physics, those of a body that can be resumed and has a twin included."""
    body = MujocoBody("nao", motion=motion)
    assert isinstance(body, Resumable) and isinstance(body, Twin)
    check_body(lambda: MujocoBody("nao", motion=motion), pictures=False, injure=stretched)


@pytest.mark.gl
def test_its_pictures_do_too() -> None:
    """In the camera's size."""
    check_body(lambda: MujocoBody("nao", motion="kinematic"))


@pytest.mark.parametrize("motion", ["kinematic", "dynamic"])
def test_another_robot_keeps_them(robot: Callable[..., Path], coupled: Any, motion: Any) -> None:
    """Other numbers of joints, with head joints that limit each other."""
    check_body(lambda: MujocoBody(robot(anatomy=coupled), motion=motion), pictures=False)


class Device:
    """A sound body that can neither be resumed nor has a twin: joints that obey at once, within their limits."""

    arm = JointGroup(("a", "b", "c"), np.array([-1.0, 0.2, -2.0]), np.array([1.0, 1.0, 2.0]), np.full(3, 2.0))
    head = JointGroup(("pan", "tilt"), np.array([-1.0, -0.5]), np.array([1.0, 0.7]), np.full(2, 3.0))
    camera, marker = Camera("eye", 8, 6, 1.0), Marker()

    def reset(self, seed: int | None = None) -> Reading:
        self.rng = np.random.default_rng(seed)
        self.posture, self.frame = self.middle(), 0
        return self.sense(self.posture, dt=0.0)

    def step(self, arm: Any, head: Any) -> Reading:
        target = self.clip(self.checked(arm, head))
        self.posture = self.moved(target)
        self.frame += 1
        return self.sense(target, dt=0.1)

    def checked(self, arm: Any, head: Any) -> Any:
        if np.shape(arm) != (3,) or np.shape(head) != (2,) or not np.isfinite([*arm, *head]).all():
            raise ValueError("targets")
        return np.concatenate([arm, head])

    def middle(self) -> Any:
        return np.concatenate([0.5 * (group.lower + group.upper) for group in (self.arm, self.head)])

    def clip(self, target: Any) -> Any:
        bounds = [
            np.concatenate([getattr(group, end) for group in (self.arm, self.head)]) for end in ("lower", "upper")
        ]
        return np.clip(target, *bounds)

    def moved(self, target: Any) -> Any:
        return self.posture + np.clip(target - self.posture, -0.2, 0.2)

    def sense(self, target: Any, dt: float) -> Reading:
        arm, head = self.posture[:3].copy(), self.posture[3:].copy()
        pose = np.array([*arm, 1, 0, 0, 0, 1, 0, 0, 0, 1])
        view, image = View(pose, pose, np.empty((0, 12))), np.full((6, 8, 3), self.frame, np.uint8)
        return Reading(self.frame * 0.1, arm, head, target[:3], target[3:], dt, image=lambda: image, view=view)

    def close(self) -> None: ...


class Puppet(Device):
    """The same, which can be resumed."""

    def state(self) -> dict[str, Any]:
        return {"posture": self.posture.copy(), "frame": self.frame, "rng": self.rng.bit_generator.state}

    def restore(self, state: dict[str, Any]) -> Reading:
        self.posture, self.frame = state["posture"].copy(), state["frame"]
        self.rng.bit_generator.state = state["rng"]
        return self.sense(self.posture, dt=0.1)


class Imagined(Puppet):
    """A sound body with a twin: its arm's three angles place the marker, and its camera turns with its head."""

    occluders = Shapes(np.full(1, 2), np.full((1, 4), 0.1))
    length = 1.0

    def __init__(self) -> None:
        self.ranges = {"near": np.array([[-0.5, 0.5], [0.3, 0.7], [-1.0, 1.0]])}

    def sense(self, target: Any, dt: float) -> Reading:
        reading = super().sense(target, dt)
        return replace(reading, view=self.view(reading.arm, reading.head))

    def view(self, arm: Any, head: Any) -> View:
        upright, (c, s) = np.eye(3).ravel(), (np.cos(head[0]), np.sin(head[0]))
        turned = [c, -s, 0, s, c, 0, 0, 0, 1]
        marker = np.array([*(self.length * np.asarray(arm)), *upright])
        return View(np.array([0, 0, head[1], *turned]), marker, np.array([[1.0, 0, 0, *upright]]))

    def legal(self, head: Any) -> Any:
        return np.clip(head, self.head.lower, self.head.upper)

    def fingerprint(self) -> bytes:
        return repr(self.length).encode()

    def another(self) -> Any:
        second = type(self)()
        second.length = self.length
        return second


class Nameless(Puppet):
    head = replace(Puppet.head, names=("pan", "pan"))


class Inverted(Puppet):
    arm = replace(Puppet.arm, lower=Puppet.arm.upper, upper=Puppet.arm.lower)


class Strange(Puppet):
    camera: Any = None


class Pathless:
    def reset(self, seed: int | None = None) -> Any: ...


class Resumed(Puppet):
    def reset(self, seed: int | None = None) -> Reading:
        start = super().reset(seed)
        self.frame = 3
        return replace(start, time=0.3)


class Drifting(Puppet):
    resets = 0

    def middle(self) -> Any:
        self.resets += 1
        return super().middle() + 0.01 * self.resets


class Timeless(Puppet):
    def sense(self, target: Any, dt: float) -> Reading:
        return replace(super().sense(target, dt), dt=0.05 if dt else 0.0)


class Loose(Puppet):
    def clip(self, target: Any) -> Any:
        return target


class Ramping(Puppet):
    def sense(self, target: Any, dt: float) -> Reading:
        return replace(super().sense(target, dt), arm_command=self.posture[:3].copy())


class Bending(Puppet):
    def moved(self, target: Any) -> Any:
        return np.clip(super().moved(target) + np.array([0.05, 0, 0, 0, 0]), self.posture - 0.2, self.posture + 0.2)


class Hasty(Puppet):
    def moved(self, target: Any) -> Any:
        return target.copy()


class Swapped(Puppet):
    def moved(self, target: Any) -> Any:
        return super().moved(self.clip(target[[0, 1, 2, 4, 3]]))


class Noisy(Puppet):
    def moved(self, target: Any) -> Any:
        return self.clip(
            super().moved(target) - 0.01 * np.sign(target - self.posture) * np.random.default_rng().random()
        )


class Trusting(Puppet):
    def checked(self, arm: Any, head: Any) -> Any:
        return np.nan_to_num(np.concatenate([np.resize(arm, 3), np.resize(head, 2)]))


class Late(Puppet):
    def checked(self, arm: Any, head: Any) -> Any:
        self.rng.random()
        return super().checked(arm, head)


class Lending(Puppet):
    def sense(self, target: Any, dt: float) -> Reading:
        return replace(super().sense(target, dt), arm=self.posture[:3])


class InPlace(Lending):
    def moved(self, target: Any) -> Any:
        self.posture += np.clip(target - self.posture, -0.2, 0.2)
        return self.posture


class Turned(Puppet):
    def sense(self, target: Any, dt: float) -> Reading:
        reading = super().sense(target, dt)
        return replace(reading, view=View(np.ones(12), np.ones(12), np.empty((0, 12))))


class Sideways(Puppet):
    camera = Camera("eye", 6, 8, 1.0)


class Flickering(Puppet):
    def sense(self, target: Any, dt: float) -> Reading:
        rng = np.random.default_rng(0)
        return replace(super().sense(target, dt), image=lambda: rng.integers(0, 255, (6, 8, 3), np.uint8))


class Forgetful(Puppet):
    def restore(self, state: dict[str, Any]) -> Reading:
        return super().restore(state | {"frame": 0})


class Abrupt(Puppet):
    closed = False

    def close(self) -> None:
        if self.closed:
            raise RuntimeError("no connection")
        self.closed = True


class Vanishing(Puppet):
    def close(self) -> None:
        self.marker: Any = None


@pytest.mark.parametrize("make", [Puppet, Device, Imagined])
def test_other_sound_bodies_pass(make: Any) -> None:
    """Without MuJoCo: one that can be resumed, one that cannot, and one with a twin."""
    check_body(make)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (Pathless, "all members of Body.*Pathless lacks arm, camera, close, head, marker"),
        (Nameless, "are readable before reset and after close.*'pan', 'pan'"),
        (Inverted, "are readable before reset.*the limits"),
        (Strange, "are readable before reset.*Seen: None"),
        (Resumed, "one start at time 0.*the time 0.3"),
        (Drifting, "one seed, one start at time 0, whatever was before"),
        (Timeless, "time advances by it.*0.1.* s with dt = 0.05 s"),
        (Loose, "arm_command is the arm's target, clipped"),
        (Ramping, "arm_command is the arm's target, clipped, from the first step on"),
        (Bending, "no command takes a joint beyond its limits"),
        (Hasty, "no joint moves faster than its velocity limit"),
        (Swapped, r"joints move towards their targets.*of the way is left"),
        (Noisy, "one seed, one behaviour"),
        (Trusting, "targets of wrong length or not finite are refused.*step took the arm target"),
        (Late, "refused before anything moves.*refused too late"),
        (Lending, "readings and targets stay the caller's.*changed the body"),
        (InPlace, "readings and targets stay the caller's.*a later step changed a reading"),
        (Turned, "a view holds positions and rotation matrices"),
        (Sideways, r"image\(\) is the picture.*\(6, 8, 3\)"),
        (Flickering, r"image\(\) is the picture.*another picture the second time"),
        (Forgetful, r"restore\(state\) continues bit for bit"),
        (Vanishing, "are readable before reset and after close.*None"),
        (Abrupt, "close can be called twice.*RuntimeError: no connection"),
    ],
)
def test_each_law_is_held(make: Any, message: str) -> None:
    """One body that breaks each."""
    with pytest.raises(ContractError, match=message):
        check_body(make)


def test_pictures_are_left_alone_where_they_cannot_be_drawn() -> None:
    """pictures=False asks for none."""
    check_body(Flickering, pictures=False)


def test_every_body_is_closed_whatever_happens() -> None:
    """Also those of a check that failed."""
    made: list[Abrupt] = []

    class Counted(Abrupt, Hasty):
        def __init__(self) -> None:
            made.append(self)

    with pytest.raises(ContractError, match="velocity"):
        check_body(Counted)
    assert made and all(body.closed for body in made)


# -- bodies with a twin ------------------------------------------------------------------------------------------------


class Endless(Imagined):
    def __init__(self) -> None:
        self.ranges = {"far": np.array([[-5.0, 5.0], [0.3, 0.7], [-1.0, 1.0]])}


class Short(Imagined):
    def __init__(self) -> None:
        self.ranges = {"half": np.array([[-0.5, 0.5]])}


class Crossed(Imagined):
    def view(self, arm: Any, head: Any) -> View:
        return super().view(arm, head[::-1])

    def sense(self, target: Any, dt: float) -> Reading:
        return replace(super().sense(target, dt), view=Imagined.view(self, self.posture[:3], self.posture[3:]))


class Posing(Imagined):
    def view(self, arm: Any, head: Any) -> View:
        self.posture = np.concatenate([arm, head])
        return super().view(arm, head)


class Remembering(Imagined):
    def view(self, arm: Any, head: Any) -> View:
        seen = super().view(arm, head)
        return replace(seen, occluders=seen.occluders + 1e-3 * self.frame)

    def sense(self, target: Any, dt: float) -> Reading:
        self.frame, frame = 0, self.frame
        reading = super().sense(target, dt)
        self.frame = frame
        return replace(reading, time=0.1 * frame)


class Wild(Imagined):
    def legal(self, head: Any) -> Any:
        return np.array(head)


class Shrinking(Imagined):
    def legal(self, head: Any) -> Any:
        return 0.9 * np.clip(head, self.head.lower, self.head.upper)


class Grasping(Imagined):
    def legal(self, head: Any) -> Any:
        return np.clip(head, self.head.lower, self.head.upper, out=head)


class Single(Imagined):
    def another(self) -> Any:
        return self


class Weaker(Imagined):
    slow = 1.0

    def another(self) -> Any:
        second = super().another()
        second.slow = 0.5
        return second

    def moved(self, target: Any) -> Any:
        return self.posture + self.slow * np.clip(target - self.posture, -0.2, 0.2)


class Placed(Imagined):
    def fingerprint(self) -> bytes:
        return self.posture.tobytes()


class Healed(Imagined):
    def another(self) -> Any:
        return type(self)()


class Blind(Imagined):
    def fingerprint(self) -> bytes:
        return b""


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (Endless, "low and high of each arm joint, inside its limits.*'far'"),
        (Short, "low and high of each arm joint.*'half'"),
        (Crossed, "view at the sensed posture is the reading's view"),
        (Posing, "(view at the sensed posture|move nothing and change nothing)"),
        (Remembering, "(view at the sensed posture|view depends on more than the postures)"),
        (Wild, "legal clips a head posture to all limits"),
        (Shrinking, "leaves a legal one as it is"),
        (Grasping, "changed the posture that it was given"),
        (Single, "(move nothing and change nothing|another moves alike, by itself)"),
        (Weaker, "another moves alike, by itself.*moves otherwise"),
        (Placed, "equal bodies have one fingerprint, whatever they have done"),
        (Healed, "another has the injuries too"),
        (Blind, "an injury changes the fingerprint"),
    ],
)
def test_each_law_of_a_twin_is_held(make: Any, message: str) -> None:
    """One body that breaks each, with a longer arm as injury."""
    with pytest.raises(ContractError, match=message):
        check_body(make, injure=lambda body: setattr(body, "length", 1.5))


def test_injury_that_the_body_shows_passes() -> None:
    """The sound body with a twin shows it in its fingerprint, and in another one."""
    check_body(Imagined, injure=lambda body: setattr(body, "length", 1.5))


class Altered(Imagined):
    """A sound body that can be altered, though nobody can turn its camera."""

    def turn_camera(self, tilt: float, roll: float) -> Any:
        raise ValueError("the camera of this body cannot be turned")

    def stretch_arm(self, factor: float) -> Any:
        before = self.length
        self.length = before * factor
        return lambda: setattr(self, "length", before)

    def move_marker(self, by: float) -> Any:
        return self.stretch_arm(1 + by)

    def pace_arm(self, factor: float) -> Any:
        return self.stretch_arm(factor)


class Rounding(Altered):
    def stretch_arm(self, factor: float) -> Any:
        self.length *= factor
        return lambda: setattr(self, "length", self.length / factor + 1e-9)


class Unmoved(Altered):
    def move_marker(self, by: float) -> Any:
        return lambda: None


def test_a_sound_body_that_can_be_altered_passes() -> None:
    """An alteration that it refuses is not tried."""
    check_body(Altered)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (Rounding, r"what an alteration returns undoes it.*after move_marker\(0.05,\) was undone"),
        (Unmoved, r"what is altered counts in the fingerprint.*after move_marker\(0.05,\)"),
    ],
)
def test_each_law_of_alterations_is_held(make: Any, message: str) -> None:
    """One body that breaks each."""
    with pytest.raises(ContractError, match=message):
        check_body(make)
