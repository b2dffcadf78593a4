"""The session: the order of a frame, what each part is handed, phases and interventions; it writes nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

from somatopy.babbling import UniformBabbler
from somatopy.bodies import Anatomy, MujocoBody, anatomy_path
from somatopy.clock import FRAME
from somatopy.contract import same
from somatopy.experiment import Description, DescriptionError, Frame, Session
from somatopy.experiment.frame import PARTS
from somatopy.eyes import FiducialEye, GeometricEye
from somatopy.interventions import NoIntervention
from somatopy.learners import FixedGaze, NearestGaze, Plastic, RandomGaze
from somatopy.percept import Camera, Column, Floats, JointGroup, Marker, Percept, Picture, Reading, Robot, Sighting

Short = Callable[..., Description]
Calls = list[tuple[str, tuple[Any, ...], Any]]

OFFSET = np.array([0.1265, 1.1411, 1.2295, -0.2242])
ORDER = [
    "eye.look",
    "babbler.command",
    "intervention.sense",
    "learner.observe",
    "learner.gaze",
    "intervention.act",
    "body.step",
]


class Spy:
    """Stands before a part and notes what is called with which arguments, and what comes back."""

    def __init__(self, name: str, part: Any, calls: Calls) -> None:
        self.__dict__.update(name=name, part=part, calls=calls)

    def __getattr__(self, name: str) -> Any:
        value = getattr(self.part, name)
        if not callable(value):
            return value

        def called(*args: Any) -> Any:
            result = value(*args)
            self.calls.append((f"{self.name}.{name}", args, result))
            return result

        return called

    def __setattr__(self, name: str, value: Any) -> None:
        setattr(self.part, name, value)


class Shift(NoIntervention):
    """Shifts the sensed arm and both commands, and says so in a column."""

    moves_arm = True
    columns = (Column("shift", "float", "by how much commands were shifted, rad"),)

    def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
        return replace(percept, arm=percept.arm + OFFSET)

    def act(self, target: Floats, gaze: Floats, rng: np.random.Generator) -> tuple[Floats, Floats]:
        return target + 0.01, gaze - 0.02

    def probes(self) -> dict[str, float]:
        return {"shift": 0.01}


@pytest.fixture
def spied(short: Short) -> Iterator[tuple[Session, Calls]]:
    """A session of 4 frames and 3 with an intervention, and all calls between its parts."""
    calls: Calls = []
    description = short(phases=[{"name": "a", "frames": 4}, {"name": "b", "frames": 3}])
    with Session(description, interventions={"b": [lambda: Spy("intervention", Shift(), calls)]}) as session:
        for name in ("body", "eye", "babbler", "learner"):
            setattr(session, name, Spy(name, getattr(session, name), calls))
        calls.clear()
        yield session, calls


def named(calls: Calls, name: str) -> list[tuple[tuple[Any, ...], Any]]:
    return [(args, result) for called, args, result in calls if called == name]


def test_a_frame_has_one_order(spied: tuple[Session, Calls]) -> None:
    """Sense, babble, intervene, learn, gaze, intervene, advance: in each of the frames, and nothing twice."""
    session, calls = spied
    list(session)
    steps = [name for name, _, _ in calls if name in ORDER]
    plain = [name for name in ORDER if not name.startswith("intervention")]
    assert steps == plain * 4 + ORDER * 3


def test_a_frame_is_given_out_after_the_body_has_advanced(spied: tuple[Session, Calls]) -> None:
    """When a frame arrives, the sinks have seen it and nothing of the next frame has happened."""
    session, calls = spied
    seen: list[Frame] = []
    session.attach(seen.append)
    for k, frame in enumerate(session, start=1):
        assert seen[-1] is frame and len(seen) == k == session.done
        assert len(named(calls, "body.step")) == len(named(calls, "eye.look")) == k


def test_each_part_is_handed_what_the_one_before_gave(spied: tuple[Session, Calls]) -> None:
    """One reading feeds eye, babbler and percept; the changed percept feeds the learner; targets feed the body."""
    session, calls = spied
    frames = list(session)
    looks, commands, observes, gazes, steps = (named(calls, name) for name in ORDER if "intervention" not in name)
    senses, acts = named(calls, "intervention.sense"), named(calls, "intervention.act")
    for k, frame in enumerate(frames):
        (reading,), sighting = looks[k]
        assert frame.reading is reading and frame.sighting is sighting
        assert commands[k][0] == (reading.time,) and frame.target is commands[k][1]
        percept = observes[k][0][0]
        assert frame.percept is percept and gazes[k][0][0] is percept and frame.gaze is gazes[k][1]
        assert (percept.time, percept.dt, percept.sighting) == (reading.time, reading.dt, sighting)
        for vector in ("head", "arm_command", "head_command"):
            assert np.array_equal(getattr(percept, vector), getattr(reading, vector))
        changed = k >= 4
        assert np.allclose(percept.arm - reading.arm, changed * OFFSET)
        assert np.allclose(steps[k][0][0] - frame.target, changed * 0.01)
        assert np.allclose(steps[k][0][1] - frame.gaze, changed * -0.02)
        assert np.array_equal(frame.clipped, steps[k][1].head_command)
    assert [sensed for _, sensed in senses] == [frame.percept for frame in frames[4:]]
    assert all(
        args[0] is frame.target and args[1] is frame.gaze for (args, _), frame in zip(acts, frames[4:], strict=True)
    )
    for k in (0, 1, 2, 4, 5):  # between them is the border of the phases, where the body senses anew
        assert looks[k + 1][0][0] is steps[k][1]
    assert looks[4][0][0].time == steps[3][1].time and np.array_equal(looks[4][0][0].arm, steps[3][1].arm)


def test_an_intervention_lasts_as_long_as_its_phase(spied: tuple[Session, Calls]) -> None:
    """It begins and takes hold before the first of its frames, and lets go after the last, before that is given out."""
    session, calls = spied
    for frame in session:
        released = [name for name, _, _ in calls if name == "intervention.release"]
        assert len(released) == (frame.number == 6)
        assert (frame.begins, frame.ends) == (frame.number in (0, 4), frame.number in (3, 6))
        assert frame.phase == int(frame.number >= 4)
    events = [name for name, _, _ in calls if name.startswith("intervention.")]
    each = ["intervention.sense", "intervention.probes", "intervention.act"]
    assert events == ["intervention.begin", "intervention.hold", *each * 3, "intervention.release"]


def test_interventions_apply_in_their_order_with_streams_of_their_own(short: Short) -> None:
    """Sensing and commanding pass through them one after the other; each place of each phase draws other numbers."""
    drawn: dict[str, list[float]] = {}
    passed: list[str] = []

    def noting(name: str) -> Callable[[], NoIntervention]:
        class Noting(NoIntervention):
            def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
                drawn.setdefault(name, []).append(rng.random())
                passed.append(name)
                return percept

        return Noting

    def draws(**more: Any) -> dict[str, list[float]]:
        drawn.clear()
        phases = [{"name": "a", "frames": 2}, {"name": "b", "frames": 2}]
        given = {"a": [noting("a0"), noting("a1")], "b": [noting("b0")]}
        with Session(short(phases=phases, **more), interventions=given) as session:
            list(session)
        return {name: list(values) for name, values in drawn.items()}

    first = draws()
    assert passed == ["a0", "a1"] * 2 + ["b0"] * 2
    assert len({number for numbers in first.values() for number in numbers}) == 6
    assert draws() == first
    assert not {n for ns in draws(seed=4).values() for n in ns} & {n for ns in first.values() for n in ns}


@pytest.mark.parametrize("seed", [3, 4])
def test_each_part_has_the_seed_and_a_stream_of_its_own(short: Short, seed: int) -> None:
    """The body is told the seed; babbler, learner and each fresh learner draw what no other draws, again and again."""
    seeds: list[int | None] = []

    class Told(Drawing):
        def reset(self, seed: int | None = None) -> Reading:
            seeds.append(seed)
            return super().reset(seed)

    def draws(seed: int) -> list[float]:
        drawn: list[float] = []

        def babbler(arm: JointGroup, start: Floats, rng: np.random.Generator) -> UniformBabbler:
            drawn.append(rng.random())
            return UniformBabbler(arm, arm.space.limits, 0.8, start, rng)

        def learner(robot: Robot, rng: np.random.Generator) -> FixedGaze:
            drawn.append(rng.random())
            return FixedGaze([0.0, 0.0])

        phases = [{"name": "a", "frames": 1}, *({"name": name, "frames": 1, "start": "afresh"} for name in "bc")]
        body, eye = Told(lambda seconds: None), Searching(lambda seconds: None, looks=False)
        with Session(short(phases=phases, seed=seed), body=body, eye=eye, babbler=babbler, learner=learner) as session:
            list(session)
        return drawn

    first = draws(seed)
    assert len({*first}) == 4 and draws(seed) == first and not {*draws(seed + 1)} & {*first}
    assert seeds == [seed, seed, seed + 1]


def test_a_phase_without_frames_has_no_effect(short: Short) -> None:
    """Its interventions are never begun, wherever it stands, and what they remark on is not said."""

    class Told(NoIntervention):
        remark = "This phase lasts."

    class Never(NoIntervention):
        remark = "This phase never comes."

        def begin(self, stage: Any) -> None:
            raise AssertionError("it was begun")

        hold = release = begin

    phases = [{"name": name, "frames": frames} for name, frames in (("a", 0), ("b", 2), ("c", 0), ("d", 1), ("e", 0))]
    given = {name: [Never] for name in "ace"} | {"d": [Told]}
    with Session(short(phases=phases), interventions=given) as session:
        assert session.remarks == ["This phase lasts."]
        assert (session.phase, session.reached) == (1, 1)
        assert [frame.phase for frame in session] == [1, 1, 3]
        assert (session.phase, session.reached, session.ends) == (3, 3, [0, 2, 2, 3, 3])


def test_the_parts_of_a_frame_take_all_its_time(short: Short) -> None:
    """Each part has its time, none is negative, and their sums are the session's."""
    with Session(short(phases=[{"frames": 20}])) as session:
        frames = list(session)
    for frame in frames:
        assert set(frame.seconds) == set(PARTS) and min(frame.seconds.values()) >= 0
    for part in PARTS:
        assert session.seconds[part] == pytest.approx(sum(frame.seconds[part] for frame in frames))


class Drawing:
    """A body whose pictures are drawn as slowly as a test wants, and that senses nothing else."""

    def __init__(self, clock: Callable[[float], None], picture: Callable[..., Any] = Picture) -> None:
        joints = JointGroup(("a", "b"), -np.ones(2), np.ones(2), np.ones(2))
        self.arm = self.head = joints
        self.camera, self.marker = Camera("eye", 4, 3, 1.0), Marker()
        self._clock, self._picture, self._time = clock, picture, 0.0

    def reset(self, seed: int | None = None) -> Reading:
        return self._sense()

    def step(self, arm: ArrayLike, head: ArrayLike) -> Reading:
        self._time += FRAME
        return self._sense()

    def _sense(self) -> Reading:
        zero = np.zeros(2)
        return Reading(self._time, zero, zero, zero, zero, FRAME, image=self._picture(self._draw))

    def _draw(self) -> np.ndarray:
        self._clock(4.0)
        return np.zeros((3, 4, 3), np.uint8)

    def close(self) -> None:
        """Has nothing to release."""


class Searching:
    """An eye that takes a second over each picture, or looks at none."""

    def __init__(self, clock: Callable[[float], None], looks: bool = True) -> None:
        self._clock, self._looks = clock, looks

    def look(self, reading: Reading) -> Sighting | None:
        if self._looks and reading.image is not None:
            reading.image()
        self._clock(1.0)
        return None


@pytest.fixture
def passing(monkeypatch: pytest.MonkeyPatch) -> Callable[[float], None]:
    """Lets time pass on the only clock that there is."""
    import somatopy.experiment.session as session_module
    import somatopy.percept as percept_module

    now = [0.0]
    for module in (session_module, percept_module):
        monkeypatch.setattr(module, "perf_counter", lambda: now[0])

    def passes(seconds: float) -> None:
        now[0] += seconds

    return passes


@pytest.mark.parametrize(("looks", "sink"), [(True, False), (True, True), (False, True), (False, False)])
def test_drawing_is_counted_as_drawing_whoever_asks(
    short: Short, passing: Callable[[float], None], looks: bool, sink: bool
) -> None:
    """Where a picture takes 4 s and searching it 1 s: 4 s of drawing if anyone wants it, and 1 s of detection."""
    body, eye = Drawing(passing), Searching(passing, looks)
    described = short(learner={"kind": "random"}, phases=[{"frames": 3}])
    with Session(described, body=body, eye=eye) as session:
        if sink:
            session.attach(lambda frame: frame.reading.image(), pictures=True)
        seconds = [frame.seconds for frame in session]
    for found in seconds:
        assert found["detect"] == pytest.approx(1.0)
        assert found["render"] == pytest.approx(4.0 if looks or sink else 0.0)
        assert sum(found.values()) == pytest.approx(found["detect"] + found["render"])


@pytest.mark.gl
def test_pictures_are_drawn_in_time_for_a_sink_that_needs_them(short: Short) -> None:
    """A sink that says so finds the picture of its frame; else a picture is refused once the body has moved on."""
    described = short(phases=[{"frames": 3}])
    for needs in (True, False):
        shapes: list[Any] = []

        def look(frame: Frame, shapes: list[Any] = shapes) -> None:
            assert frame.reading.image is not None
            shapes.append(frame.reading.image().shape)

        with Session(described) as session:
            session.attach(look, pictures=needs)
            if needs:
                list(session)
                assert shapes == [(240, 320, 3)] * 3
            else:
                with pytest.raises(RuntimeError, match="was not taken before the body moved on"):
                    next(session)


def test_a_session_writes_nothing(short: Short, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither where it runs nor in the user's cache."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    with Session(short(phases=[{"frames": 5}])) as session:
        list(session)
        session.state()
    assert list(tmp_path.rglob("*")) == []


# -- states ------------------------------------------------------------------------------------------------------------

STAGES = [
    {"name": "a", "frames": 40},
    {"name": "none", "frames": 0, "damage": {"kind": "offset"}},
    {"name": "b", "frames": 20, "damage": {"kind": "offset"}, "start": "afresh"},
    {"name": "c", "frames": 15, "start": "shuffled", "plastic": []},
    {"name": "d", "frames": 10, "plastic": ["links"]},
]


class Jolt(NoIntervention):
    """Noise of the senses that remembers, an injury of the model, and columns of both."""

    alters_ceiling = True
    columns = (Column("jolts", "int", "jolts so far"),)

    def __init__(self) -> None:
        self.jolts = 0

    def hold(self, stage: Any) -> None:
        self.before = stage.body.model.cam_pos.copy()
        stage.body.model.cam_pos[:] += 0.02

    def release(self, stage: Any) -> None:
        stage.body.model.cam_pos[:] = self.before

    def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
        self.jolts += 1
        return replace(percept, arm=percept.arm + rng.normal(0, 0.01 * self.jolts, len(percept.arm)))

    def probes(self) -> dict[str, float]:
        return {"jolts": self.jolts}

    def state(self) -> dict[str, Any]:
        return {"jolts": self.jolts}

    def restore(self, state: dict[str, Any]) -> None:
        self.jolts = int(state["jolts"])


def shown(frame: Frame) -> object:
    """All of a frame but clocks and functions."""
    reading, percept = frame.reading, frame.percept
    vectors = [reading.arm, reading.head, reading.arm_command, reading.head_command, percept.arm, frame.gaze]
    view = [] if reading.view is None else [reading.view.camera, reading.view.marker, reading.view.occluders]
    seen = frame.sighting and (*frame.sighting.pixel, frame.sighting.tag, frame.sighting.area)
    return [*vectors, *view, frame.target, frame.clipped], seen, dict(frame.probes), frame[:4]


@pytest.mark.parametrize("motion", ["kinematic", "dynamic"])
def test_a_state_between_any_two_frames_is_whole(short: Short, motion: str) -> None:
    """At 50 moments, borders of phases among them, another session goes on from the state bit for bit."""
    described, jolted = short(phases=STAGES, body={"motion": motion}), {"b": [Jolt], "d": [Jolt]}
    states, frames = [], []
    with Session(described, interventions=jolted) as session:
        states.append(session.state())
        for frame in session:
            frames.append(shown(frame))
            states.append(session.state())
    assert len(frames) == 85
    moments = {0, 1, 39, 40, 41, 59, 60, 61, 74, 75, 76, 84, 85}
    moments |= set(np.random.default_rng(0).permutation(86)[:45].tolist())
    with Session(described, interventions=jolted) as session:
        for moment in sorted(moments, key=lambda k: (k * 37) % 86)[:50]:
            session.restore(states[moment])
            assert session.done == moment
            for k in range(moment, min(moment + 12, 85)):
                assert same(shown(next(session)), frames[k])
            without_clocks = session.state() | {"seconds": None}
            assert same(without_clocks, states[session.done] | {"seconds": None})


def test_restoring_injures_once_and_heals_when_it_leaves(short: Short) -> None:
    """Restored within, before and after the phase of an injury, in any order: the model is as it is there."""
    phases = [{"name": name, "frames": 4} for name in "abc"]
    with Session(short(phases=phases), interventions={"b": [Jolt]}) as session:
        assert isinstance(session.body, MujocoBody)
        states, healthy = [session.state()], session.body.model.cam_pos.copy()
        for _ in session:
            states.append(session.state())
        for moment in (6, 5, 2, 7, 9, 6, 4, 8, 6):
            session.restore(states[moment])
            assert np.allclose(session.body.model.cam_pos - healthy, 0.02 * (4 < moment < 8))


def test_the_state_of_a_frame_that_was_broken_off_is_not_whole(short: Short) -> None:
    """After an error within a frame the session says so; restored, it is whole again."""
    with Session(short(phases=[{"frames": 9}])) as session:
        next(session)
        state, observe = session.state(), session.learner.observe
        session.learner.observe = lambda percept: 1 / 0  # type: ignore[method-assign]
        with pytest.raises(ZeroDivisionError):
            next(session)
        assert not session.whole and session.done == 1
        with pytest.raises(RuntimeError, match=r"Frame 1 was broken off; restore\(\) a state"):
            next(session)
        session.learner.observe = observe  # type: ignore[method-assign]
        session.restore(state)
        assert session.whole and next(session).number == 1


# -- parts of one's own ------------------------------------------------------------------------------------------------


class Stick:
    """A body that is no MuJoCo model and cannot be resumed: joints are where they are told to be."""

    def __init__(self) -> None:
        self.arm = JointGroup(("a",), np.array([-1.0]), np.array([1.0]), np.array([8.0]))
        self.head = JointGroup(("pan",), np.array([-1.0]), np.array([1.0]), np.array([8.0]))
        self.camera, self.marker = Camera("eye", 320, 240, 0.83), Marker()
        self.closed = 0

    def reset(self, seed: int | None = None) -> Reading:
        self._time = -FRAME
        return self.step([0.0], [0.0])

    def step(self, arm: ArrayLike, head: ArrayLike) -> Reading:
        self._time += FRAME
        arm, head = (np.clip(np.asarray(values, float), -1, 1) for values in (arm, head))
        return Reading(self._time, arm, head, arm, head, FRAME)

    def close(self) -> None:
        self.closed += 1


class Near:
    """Sees the hand where arm and head point the same way."""

    def __init__(self, body: Any) -> None:
        self.body = body

    def look(self, reading: Reading) -> Sighting | None:
        apart = float(reading.arm[0] - reading.head[0])
        return Sighting((159.5 + 100 * apart, 119.5), 0, 100.0) if abs(apart) < 0.5 else None


class Swing:
    """Babbles to and fro."""

    def __init__(self, arm: JointGroup, start: Floats, rng: np.random.Generator) -> None:
        self.phase = rng.random()

    def command(self, time: float) -> Floats:
        return np.array([np.sin(time + self.phase)])

    def state(self) -> dict[str, Any]:
        return {"phase": self.phase}

    def restore(self, state: dict[str, Any]) -> None:
        self.phase = float(state["phase"])


class Copycat(Plastic):
    """Looks where the arm is."""

    def __init__(self, robot: Robot, rng: np.random.Generator, gain: float = 1.0) -> None:
        self.gain = gain

    def observe(self, percept: Percept) -> None:
        """Learns nothing."""

    def gaze(self, percept: Percept) -> Floats:
        return self.gain * percept["arm"]

    def predict(self, arm: ArrayLike) -> Floats:
        return self.gain * np.asarray(arm, float)

    def state(self) -> dict[str, Any]:
        return {}

    def restore(self, state: dict[str, Any]) -> None:
        """Has nothing to restore."""


class Scribbler(FixedGaze):
    """Works in place on the arrays that it is given."""

    def __init__(self, robot: Robot, rng: np.random.Generator) -> None:
        super().__init__([0.2, 0.1])

    def observe(self, percept: Percept) -> None:
        for vector in (percept.arm, percept.head, percept.arm_command, percept.head_command):
            vector[:] = 7.0


def test_a_learner_that_works_in_place_changes_nothing_that_was_sensed(short: Short) -> None:
    """Its body moves, and is recorded, as that of one which leaves its percepts alone."""

    def readings(**own: Any) -> list[list[Any]]:
        phases = [{"frames": 20, "name": "intact"}]
        with Session(short(phases=phases, learner={"kind": "fixed", "head": [0.2, 0.1]}), **own) as session:
            senses = ("arm", "head", "arm_command", "head_command")
            return [[getattr(frame.reading, sense) for sense in senses] for frame in session]

    assert same(readings(learner=Scribbler), readings())


def test_all_parts_may_be_ones_own(short: Short) -> None:
    """A body without model and state, an eye, a babbler and a learner run; what needs a state or a twin says no."""
    described = short(phases=[{"name": "a", "frames": 30}])
    with Session(described, body=Stick, eye=Near, babbler=Swing, learner=Copycat) as session:
        frames = list(session)
        assert 0 < sum(frame.sighting is not None for frame in frames) <= 30
        assert not session.resumable
        with pytest.raises(DescriptionError, match=r"Stick' has no state\(\) and restore\(\)"):
            session.state()
        kinds = [getattr(session.description, key).kind.split(":")[1] for key in ("body", "eye", "babbling", "learner")]
        assert kinds == ["Stick", "Near", "Swing", "Copycat"]
        body = session.body
    assert body.closed == 1  # type: ignore[attr-defined]


def test_parts_may_be_handed_over_as_classes_functions_or_instances(short: Short) -> None:
    """The same frames, however they come; settings of a class are keys of the description."""
    described, found = short(phases=[{"name": "a", "frames": 20}]), []
    for body, eye, learner in (
        (Stick, Near, Copycat),
        (lambda: Stick(), lambda body: Near(body), lambda robot, rng: Copycat(robot, rng)),
        (Stick(), Near(None), Copycat),
    ):
        with Session(described, body=body, eye=eye, babbler=Swing, learner=learner) as session:
            found.append([shown(frame) for frame in session])
    assert same(found[0], found[1]) and same(found[0], found[2])
    with Session(described, body=Stick, eye=Near, babbler=Swing, learner=Copycat) as session:
        assert session.description.learner.gain == 1.0  # type: ignore[attr-defined]


def test_a_geometric_eye_needs_a_body_that_knows_itself(short: Short) -> None:
    """The refusal names the body, and nothing stays open."""
    body = Stick()
    with pytest.raises(DescriptionError, match=r"^eye: .*Stick.*no model of itself"):
        Session(short(), body=body, babbler=Swing, learner=Copycat)
    assert body.closed == 1


@pytest.mark.parametrize(
    ("part", "given", "message"),
    [
        ("learner", lambda robot, rng: object(), r"learner: a object lacks columns, gaze, maps, observe"),
        ("learner", FixedGaze, r"learner: .*cannot be made: a learner is made from \(robot, rng\)"),
        ("learner", 7, r"learner: .*is no learner: it is 7, which is neither a part nor makes one"),
        ("body", lambda: object(), r"body: a object lacks arm, camera, close"),
        ("eye", lambda body: object(), r"eye: a object lacks look"),
        ("babbler", lambda arm, start, rng: object(), r"babbling: a object lacks command, restore, state"),
        ("interventions", {"intact": [lambda: object()]}, r"phases.0 \('intact'\): a object lacks act"),
        ("interventions", {"later": [NoIntervention]}, r"there is no phase 'later'; phases: intact, damaged"),
    ],
)
def test_what_is_no_part_is_refused_before_anything_runs(short: Short, part: str, given: Any, message: str) -> None:
    """The part and what it lacks are named."""
    with pytest.raises(DescriptionError, match=message):
        Session(short(), **{part: given})


@pytest.mark.parametrize("given", [{"intact": Shift}, [Shift], Shift])
def test_interventions_are_lists_by_phase(short: Short, given: Any) -> None:
    """What is anything else is refused with an example."""
    with pytest.raises(DescriptionError, match=r"interventions: must be lists by .*, such as \{'intact': \[\.\.\.\]\}"):
        Session(short(), interventions=given)


class Loud(Copycat):
    """A learner with columns whose names are taken."""

    def probes(self) -> dict[str, float]:
        return {column.name: 0.0 for column in self.columns}


@pytest.mark.parametrize("name", ["hit", "frame", "arm.LElbowYaw", "arm_percept.LElbowYaw", "gaze_error_rad"])
def test_a_column_name_that_is_taken_is_refused(short: Short, name: str) -> None:
    """A probe cannot overwrite what is recorded of a frame; both owners are named."""

    class Taking(Loud):
        columns = (Column(name, "float", "mine"),)

    with pytest.raises(DescriptionError, match=rf"column '{name}' is declared twice, by .* and the learner"):
        Session(short(), learner=Taking)


def test_two_interventions_of_a_kind_cannot_write_one_column(short: Short) -> None:
    """In one phase the second would overwrite what the first records; in two phases they share it."""
    phases = [{"name": name, "frames": 2} for name in "ab"]
    with pytest.raises(DescriptionError, match=r"column 'shift' is declared twice, by the .*Shift intervention;"):
        Session(short(phases=phases), interventions={"a": [Shift, Shift]})
    with Session(short(phases=phases), interventions={"a": [Shift], "b": [Shift]}) as session:
        assert [column.name for column in session.columns].count("shift") == 1


def test_the_parts_columns_are_in_every_frame(short: Short) -> None:
    """Those of learner, eye and interventions; in other phases an intervention's are what stands for nothing."""

    class Counting(GeometricEye):
        columns = (Column("looks", "int", "looks so far"),)
        looks = 0

        def look(self, reading: Reading) -> Sighting | None:
            self.looks += 1
            return super().look(reading)

        def probes(self) -> dict[str, float]:
            return {"looks": self.looks}

    phases = [{"name": name, "frames": 2} for name in "abc"]
    eye = lambda body: Counting(body.camera, body.marker, body.occluders)  # noqa: E731
    with Session(short(phases=phases), eye=eye, interventions={"b": [Shift], "c": [Jolt]}) as session:
        probes = [dict(frame.probes) for frame in session]
        names = {column.name for column in session.columns}
    assert names == {"arm_winner", "head_winner", "arm_distance", "head_distance", "looks", "shift", "jolts"}
    assert all(set(found) == names for found in probes)
    assert [found["looks"] for found in probes] == [1, 2, 3, 4, 5, 6]
    assert [found["jolts"] for found in probes] == [-1, -1, -1, -1, 1, 2]
    assert [found["shift"] for found in probes[2:4]] == [0.01, 0.01] and np.isnan(probes[0]["shift"])


@pytest.mark.parametrize("kind", [RandomGaze, NearestGaze])
def test_what_is_importable_is_recorded_by_its_name(short: Short, kind: type) -> None:
    """Our own by their kinds."""
    with Session(short(), learner=kind) as session:
        assert session.description.learner.kind == {RandomGaze: "random", NearestGaze: "nearest"}[kind]


def test_an_eye_that_needs_pictures_finds_out_at_once_that_there_are_none(
    short: Short, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What drawing raises comes while the session is built, before a frame; the body is closed."""
    closed: list[object] = []
    monkeypatch.setattr(MujocoBody, "close", lambda self: closed.append(self))

    def fail(self: object, *args: object, **more: object) -> None:
        raise RuntimeError("no OpenGL here")

    monkeypatch.setattr(MujocoBody, "picture", fail)
    with pytest.raises(RuntimeError, match="no OpenGL here"):
        Session(short(eye={"kind": "fiducial"}))
    assert len(closed) == 1
    assert FiducialEye.needs_pictures


# -- one arm movement for all runs of a seed ---------------------------------------------------------------------------


@pytest.mark.parametrize("learner", ["hebbian", "random", "fixed"])
def test_the_arm_moves_the_same_whatever_moves_the_head(short: Short, learner: str) -> None:
    """With physics: all that is sensed of the arm, its commands, and what the learner perceives, to the last bit."""
    described = short(body={"motion": "dynamic"}, learner={"kind": learner}, phases=[{"frames": 600}])
    with Session(short(body={"motion": "dynamic"}, learner={"kind": "nearest"}, phases=[{"frames": 600}])) as session:
        expected = [arm_of(frame) for frame in session]
    with Session(described) as session:
        assert all(same(arm_of(frame), one) for frame, one in zip(session, expected, strict=True))


def arm_of(frame: Frame) -> list[Floats]:
    return [frame.reading.arm, frame.reading.arm_command, frame.percept.arm, frame.percept.arm_command, frame.target]


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder for what is kept between runs."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache"


def test_a_shared_arm_changes_no_bit(short: Short, own_cache: Path) -> None:
    """Computed, found again by another learner, and left where an intervention moves the arm: the same frames."""
    phases = [{"name": name, "frames": 150} for name in "abc"]
    for learner in ("hebbian", "random"):
        for parts in ({}, {"interventions": {"b": [Shift], "c": [Jolt]}}):
            described = short(body={"motion": "dynamic"}, learner={"kind": learner}, phases=phases)
            found = {}
            for shares in (False, True):
                with Session(described, **parts) as session:
                    assert session.share_arm(compute=True) is True if shares else True
                    frames, states = [], []
                    for frame in session:
                        frames.append(shown(frame))
                        if frame.number % 50 == 0:
                            states.append(session.state() | {"seconds": None})
                    found[shares] = frames, states
            assert same(found[False], found[True])
    assert len(list((own_cache / "somatopy" / "arm").iterdir())) == 1


def test_a_shared_arm_is_one_that_fits(short: Short, own_cache: Path) -> None:
    """Nothing is computed unless asked for; another seed, range or speed has another movement, and less needs less."""
    phases = [{"name": "a", "frames": 60}]
    dynamic = {"motion": "dynamic"}
    with Session(short(body=dynamic, phases=phases)) as session:
        assert not session.share_arm()
        assert session.share_arm(compute=True) and session.share_arm()
    with Session(short(body=dynamic, phases=[{"name": "a", "frames": 20}, {"name": "b", "frames": 30}])) as session:
        assert session.share_arm()
    for change in (
        {"seed": 4},
        {"babbling": {"speed": 0.5}},
        {"babbling": {"range": "confined"}},
        {"phases": [{"name": "a", "frames": 61}]},
        {"body": {"motion": "kinematic"}},
    ):
        with Session(short(**({"body": dynamic, "phases": phases} | change))) as session:
            assert not session.share_arm()
    with Session(short(body=dynamic, phases=phases, learner={"kind": "random"}), body=Stick, eye=Near) as session:
        assert not session.share_arm(compute=True)


def test_a_range_that_is_edited_has_a_movement_of_its_own(short: Short, own_cache: Path) -> None:
    """Its name stays, and so does all else that the description says."""
    described = short(body={"motion": "dynamic"}, babbling={"range": "confined"}, phases=[{"frames": 30}])
    anatomy = Anatomy.load(anatomy_path("nao"))
    narrow = tuple((0.5 * (low + high), high) for low, high in anatomy.ranges["confined"])
    edited = anatomy.model_copy(update={"ranges": {"confined": narrow}})
    for robot in (anatomy, edited):
        with Session(described, body=MujocoBody(robot, arm_speed=described.babbling.speed)) as session:
            assert not session.share_arm()
            assert session.share_arm(compute=True)
            for _ in range(2):
                next(session)
            assert session.body.tracked


def test_a_session_with_a_shared_arm_goes_on_from_its_states(short: Short, own_cache: Path) -> None:
    """With the movement or without it, from a state that was taken with it or without it."""
    described = short(body={"motion": "dynamic"}, phases=[{"frames": 120}])
    with Session(described) as session:
        session.share_arm(compute=True)
        states = [session.state()] + [session.state() for _ in session]
    with Session(described) as session:
        expected = [shown(frame) for frame in session]
    for moment in (0, 1, 59, 119):
        for shares in (True, False):
            with Session(described) as session:
                session.restore(states[moment])
                assert not shares or session.share_arm()
                assert all(same(shown(frame), expected[frame.number]) for frame in session)


class Grips(NoIntervention):
    """Counts how often it holds; refuses where it is told to."""

    def __init__(self, fails: bool = False) -> None:
        self.held, self.fails = 0, fails

    def hold(self, stage: Any) -> None:
        if self.fails:
            raise RuntimeError("it slipped")
        self.held += 1

    def release(self, stage: Any) -> None:
        self.held -= 1


def test_what_was_held_is_released_where_another_fails(short: Short) -> None:
    """The phase's first intervention does not go on holding when its second one fails."""
    first = Grips()
    with Session(short(), interventions={"damaged": [lambda: first, lambda: Grips(fails=True)]}) as session:
        for _ in range(200):
            next(session)
        with pytest.raises(RuntimeError, match="it slipped"):
            next(session)
        assert first.held == 0
    assert first.held == 0


def test_a_session_that_was_half_restored_does_not_go_on(short: Short) -> None:
    """An error within `restore` leaves it broken off, until another state is restored."""
    with Session(short()) as session:
        next(session)
        state = session.state()
        with pytest.raises(KeyError):
            session.restore({key: value for key, value in state.items() if key != "learner"})
        assert not session.whole
        with pytest.raises(RuntimeError, match="broken off"):
            next(session)
        session.restore(state)
        assert next(session).number == 1


def test_pictures_are_drawn_as_long_as_a_sink_asks_for_them(short: Short) -> None:
    """After it is detached, none is drawn."""
    seen: list[Frame] = []
    with Session(short()) as session:
        drawn: list[int] = []
        next(session)
        session.attach(seen.append, pictures=True)
        session._reading = replace(session._reading, image=lambda: drawn.append(session.done))
        next(session)
        session.detach(seen.append)
        session._reading = replace(session._reading, image=lambda: drawn.append(session.done))
        next(session)
    assert drawn == [1]


class MovesArm(NoIntervention):
    moves_arm = True


@pytest.mark.parametrize("until", [10, 20])
def test_no_arm_is_shared_after_one_was_moved(short: Short, until: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run that is resumed in a phase whose intervention moves the arm, or after it, asks for no stored movement."""
    phases = [{"name": name, "frames": 10} for name in ("a", "b", "c")]
    own = {"interventions": {"b": [MovesArm]}}
    with Session(short(body={"motion": "dynamic"}, phases=phases), **own) as session:
        asked: list[Any] = []
        monkeypatch.setattr(session.body, "share_arm", lambda *args: asked.append(args) or True, raising=True)
        assert session.share_arm() and len(asked) == 1
        for _ in range(until + 1):
            next(session)
        assert not session.share_arm() and len(asked) == 1
