"""Every damage in an experiment: resumed, undone, the same for all learners, with its own movement and ceiling."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.robots import Shape, joints, write_robot

from somatopy.api import run
from somatopy.babbling import UniformBabbler
from somatopy.bodies import MujocoBody
from somatopy.contract import same
from somatopy.experiment import Description, DescriptionError, Session
from somatopy.experiment.ceiling import EVERY, Vantages, reachable
from somatopy.experiment.frame import Frame
from somatopy.interventions import SUITE, check_intervention
from somatopy.learners import FixedGaze
from somatopy.percept import Camera, JointGroup, Marker, Reading
from somatopy.registry import INTERVENTIONS

Short = Callable[..., Description]
MOVE = {"longer-arm", "arm-speed", "babbling-range"}
ALTER = {"camera-tilt", "camera-roll", "marker-5cm", "marker-15cm", "longer-arm"}
LENGTH = 12
#: A gaze that sees the hand in most of the first frames.
SEES = (0.174, 0.176)


def phases(damage: Any, length: int = LENGTH) -> dict[str, Any]:
    """Intact, damaged and healed, of a learner that needs no time."""
    names = {"intact": "none", "damaged": damage, "healed": "none"}
    table = [{"name": name, "frames": length, "damage": done} for name, done in names.items()]
    return {"phases": table, "learner": {"kind": "fixed", "head": SEES}}


def shown(frame: Frame) -> list[Any]:
    """What is sensed and told in a frame, before and after damages."""
    reading, percept = frame.reading, frame.percept
    assert reading.view is not None
    seen = [] if percept.sighting is None else [*percept.sighting.pixel, percept.sighting.area]
    vectors = [reading.arm, reading.head, percept.arm, percept.head, percept.arm_command, percept.head_command]
    return [*vectors, reading.view.camera, reading.view.marker, reading.view.occluders, frame.target, seen]


def played(described: Description) -> tuple[list[Frame], dict[str, Any]]:
    """All frames, and the state in the middle of the second phase."""
    frames, state = [], {}
    with Session(described) as session:
        for frame in session:
            frames.append(frame)
            if session.done == LENGTH + 5:
                state = session.state()
    return frames, state


def unhurt(frame: Frame) -> bool:
    """Whether what is perceived is what the body senses."""
    reading, percept = frame.reading, frame.percept
    names = ("arm", "head", "arm_command", "head_command")
    return percept.sighting is frame.sighting and same(
        [getattr(percept, name) for name in names], [getattr(reading, name) for name in names]
    )


@pytest.mark.parametrize("name", SUITE)
def test_each_lasts_for_its_phase_goes_on_bit_for_bit_and_is_undone(name: str, short: Short) -> None:
    """Resumed in the damaged phase by another session; percepts, poses and ways of the arm are hurt there alone."""
    described = short(**phases(SUITE[name]))
    (frames, state), (intact, _) = played(described), played(short(**phases("none")))
    with Session(described) as session:
        session.restore(state)
        assert [same(shown(next(session)), shown(frame)) for frame in frames[LENGTH + 5 :]].count(False) == 0
        [[], [damage], []] = session.interventions
    assert (damage.moves_arm, damage.alters_ceiling) == (name in MOVE, name in ALTER)
    hurt = [not same(shown(a), shown(b)) for a, b in zip(frames, intact, strict=True)]
    middle = hurt[LENGTH : 2 * LENGTH]
    assert any(middle) and not any(hurt[:LENGTH]) and sum(frame.sighting is not None for frame in intact) > LENGTH
    assert all(map(unhurt, [*frames[:LENGTH], *frames[2 * LENGTH :]]))
    assert same([f.target for f in frames], [f.target for f in intact])
    arms = [[frame.reading.arm for frame in run] for run in (frames, intact)]
    if name not in {"arm-speed", "babbling-range"}:  # kinematic arms move alike whatever their length
        assert same(*arms) and not any(hurt[2 * LENGTH :])


@pytest.mark.parametrize("name", ["arm-speed", "babbling-range"])
def test_an_arm_that_babbles_otherwise_does_as_it_is_told(name: str, short: Short) -> None:
    """Half as fast at most, or in the middle half of its range; then as fast and as far as before."""
    described = short(**phases(SUITE[name], 400))
    bounds = np.array([[-0.5, 1.1], [0.0, 1.25], [-0.65, 0.9], [-1.54, -0.08]])
    described = described.replaced(babbling={"kind": "uniform", "range": bounds.tolist(), "speed": 0.6})
    with Session(described) as session:
        frames = list(session)
    arms, told = (np.array([getattr(f.reading, key) for f in frames]) for key in ("arm", "arm_command"))
    speeds = np.abs(np.diff(arms, axis=0)).max(axis=1) * 15
    fastest = [speeds[400 * k + 1 : 400 * (k + 1) - 1].max() for k in range(3)]
    assert np.allclose(fastest, [0.6, 0.3 if name == "arm-speed" else 0.6, 0.6])
    wide = [np.ptp(told[400 * k + 1 : 400 * (k + 1)], axis=0) / np.ptp(bounds, axis=1) for k in range(3)]
    assert (wide[0] > 0.5).all() and (wide[2] > 0.5).all()
    assert (wide[1] <= 0.5).all() == (name == "babbling-range")
    inside = np.abs(told[402:800] - bounds.mean(axis=1)) <= np.ptp(bounds, axis=1) / (
        4 if name == "babbling-range" else 2
    )
    assert inside.all()


@pytest.mark.parametrize("name", ["arm-speed", "babbling-range", "offset-0.8"])
def test_all_learners_of_a_seed_meet_the_same(name: str, short: Short) -> None:
    """Whatever else is done to them in that phase, and so whatever number the damage has there."""
    table = phases(SUITE[name])
    table["phases"][1] |= {"plastic": ["links"], "start": "afresh"}
    del table["learner"]
    one, other = played(short(**table))[0], played(short(**phases(SUITE[name])))[0]
    assert same([f.reading.arm for f in one], [f.reading.arm for f in other])
    assert same([f.percept.arm for f in one], [f.percept.arm for f in other])
    again = played(short(**phases(SUITE[name]), seed=4))[0]
    assert not same([f.percept.arm for f in one], [f.percept.arm for f in again])


def test_the_ceiling_of_an_injured_phase_is_that_of_the_injured_body(short: Short, tmp_path: Path) -> None:
    """Counted apart, with a body that is changed by hand; intact phases, and runs without injury, have their own."""
    learner = {"learner": {"kind": "fixed", "head": SEES}}
    damages = {
        "none": "none",
        "sensed": SUITE["offset-1.7"],
        "marker": SUITE["marker-15cm"],
        "long": {"kind": "longer-arm", "factor": 1.5},
    }
    found = {}
    for name, damage in damages.items():
        table = [{"name": "a", "frames": 300}, {"name": "b", "frames": 450, "damage": damage}]
        opened = run(short(phases=table, **learner), tmp_path / name, progress=False, maps=False)
        assert opened.ceiling is not None
        found[name] = [phase["rate"] for phase in opened.ceiling["phases"]]
        arms = opened.postures("arm")[300::EVERY]
    assert found["none"] == found["sensed"] and {rates[0] for rates in found.values()} == {found["none"][0]}
    with closing(MujocoBody("nao", motion="kinematic")) as body:
        for name, alter in {"marker": lambda: body.move_marker(0.15), "long": lambda: body.stretch_arm(1.5)}.items():
            undo = alter()
            expected = reachable(Vantages.of(body), arms).mean()
            undo()
            assert found[name][1] == pytest.approx(expected) and found[name][1] != found["none"][1]


def test_with_physics_the_intact_phase_has_the_movement_that_is_kept(short: Short) -> None:
    """The same bits as without damage, whether or not the movement is shared; in a longer arm's phase others."""
    tables = [short(**phases(damage), body={"motion": "dynamic"}) for damage in (SUITE["longer-arm"], "none")]
    arms = []
    for described, shares in ((tables[0], False), (tables[0], True), (tables[1], True)):
        with Session(described) as session:
            assert session.share_arm(compute=True) if shares else True
            arms.append(np.array([frame.reading.arm for frame in session]))
    assert same(arms[0], arms[1])
    assert same(arms[0][: LENGTH + 1], arms[2][: LENGTH + 1]) and not same(arms[0][LENGTH + 1], arms[2][LENGTH + 1])


def test_two_at_once_and_two_in_a_row(short: Short) -> None:
    """In one phase the second acts on what the first has made; a phase later each stands alone."""
    gain, shift = {"kind": "gain", "gain": 0.5}, SUITE["offset-0.8"]
    table = [
        {"name": "both", "frames": 3, "interventions": [gain, shift]},
        {"name": "first", "frames": 3, "damage": gain},
        {"name": "second", "frames": 3, "damage": shift},
        {"name": "turned", "frames": 3, "damage": SUITE["camera-tilt"]},
        {"name": "turned and long", "frames": 3, "interventions": [SUITE["camera-roll"], SUITE["longer-arm"]]},
        {"name": "healed", "frames": 3},
    ]
    with Session(short(phases=table)) as session:
        healthy = session.body.fingerprint()  # type: ignore[attr-defined]
        frames = list(session)
        assert session.body.fingerprint() == healthy  # type: ignore[attr-defined]
        middle = session.body.arm.space.limits.mean(axis=1)
    felt = [(f.percept.arm - middle, f.reading.arm - middle) for f in frames]
    shifts = np.array([percept - true for percept, true in felt[6:9]])
    assert np.allclose(shifts, shifts[0]) and np.linalg.norm(shifts[0]) == pytest.approx(0.8)
    assert all(np.allclose(percept, 0.5 * true + shifts[0]) for percept, true in felt[:3])
    assert all(np.allclose(percept, 0.5 * true) for percept, true in felt[3:6])
    assert all(map(unhurt, frames[9:]))


# -- other robots ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("motion", ["kinematic", "dynamic"])
def test_every_damage_fits_an_arm_of_hinges_and_slides(motion: Any, tmp_path: Path, short: Short) -> None:
    """All laws of interventions hold of it, as built from its settings, on eight joints and a head of three."""
    anatomy = write_robot(tmp_path, Shape(joints("yzxyzxyz", 0.4, slides="15"), joints("zyx", slides="2")))
    described = short(**phases("none") | {"body": {"model": str(anatomy), "motion": motion}})
    described = described.replaced(learner={"kind": "random"})
    names = SUITE if motion == "kinematic" else ["longer-arm", "arm-speed", "marker-15cm"]
    with Session(described) as session:
        context = session._context("damage")
        for name in names:
            settings = INTERVENTIONS.validated(SUITE[name])
            check_intervention(
                lambda settings=settings: settings.build(context),  # type: ignore[misc]
                lambda: session.body.another(),  # type: ignore[attr-defined]
            )


class Stick:
    """A body of one joint each that has no model of itself."""

    def __init__(self) -> None:
        self.arm = JointGroup(("a",), np.array([-1.0]), np.array([1.0]), np.array([8.0]))
        self.head = JointGroup(("pan",), np.array([-1.0]), np.array([1.0]), np.array([8.0]))
        self.camera, self.marker = Camera("eye", 320, 240, 0.83), Marker()

    def reset(self, seed: int | None = None) -> Reading:
        return Reading(0.0, *(np.zeros(1) for _ in range(4)))

    def step(self, arm: Any, head: Any) -> Reading:
        return Reading(1 / 15, np.asarray(arm), np.asarray(head), np.asarray(arm), np.asarray(head))

    def close(self) -> None: ...


class Blind:
    def __init__(self, body: Any) -> None: ...

    def look(self, reading: Reading) -> None:
        return None


MODEL = "the body Stick has no model of itself that can be changed"
PLACES = "joints change places only where an arm has two or more, and this one has a alone"
JOINTS = r"the arm has no joint [12]; name one of its joints or its number: a \(0\)"
REFUSED = {
    **dict.fromkeys(ALTER, MODEL),
    **dict.fromkeys(("swapped", "permuted"), PLACES),
    **dict.fromkeys(("dead-joint-1", "dead-joint-2"), JOINTS),
    "arm-speed": "arm-speed: the arm of the body Stick has a speed that cannot be changed",
}


@pytest.mark.parametrize("name", SUITE)
def test_what_a_body_cannot_take_is_refused_before_the_first_frame(name: str, short: Short) -> None:
    """In a sentence that names phase, damage and reason; all others go."""
    own: Any = {"body": Stick, "eye": Blind, "learner": lambda robot, rng: FixedGaze([0.0])}
    described = short(phases=phases(SUITE[name])["phases"])
    if name not in REFUSED:
        with Session(described, **own) as session:
            assert len(list(session)) == 3 * LENGTH
        return
    with pytest.raises(DescriptionError, match=rf"phases\.1 \('damaged'\).*{REFUSED[name]}"):
        Session(described, **own)


class Staring:
    """A babbler without settings."""

    def __init__(self, arm: JointGroup, start: Any, rng: np.random.Generator) -> None:
        self.inner = UniformBabbler(arm, arm.space.limits, 0.8, start, rng)
        self.command, self.state, self.restore = self.inner.command, self.inner.state, self.inner.restore


@pytest.mark.parametrize(("name", "lacks"), [("arm-speed", "speed"), ("babbling-range", "range")])
def test_babbling_that_has_no_such_setting_is_refused(name: str, lacks: str, short: Short) -> None:
    """By its name."""
    with pytest.raises(DescriptionError, match=rf"the babbling '.*Staring' has no {lacks} that could be changed"):
        Session(short(**phases(SUITE[name])), babbler=Staring)
