"""The frame loop: its order, what each part is handed, phases, and that a run can be repeated to the byte."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from somatopy.analysis.runs import Run, load_run
from somatopy.analysis.summary import write_summary
from somatopy.experiment import Description, Experiment, loop
from somatopy.experiment.recorder import prepare_folder

Short = Callable[..., Description]
RunShort = Callable[..., Run]
Calls = list[tuple[str, tuple[Any, ...], Any]]

OFFSET = np.array([0.1265, 1.1411, 1.2295, -0.2242])
ARM = ("LShoulderPitch", "LShoulderRoll", "LElbowYaw", "LElbowRoll")
FRAME = [
    "eye.look",
    "babbler.command",
    "damage.sense",
    "learner.observe",
    "learner.gaze",
    "recorder.record",
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


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch, short: Short, tmp_path: Path) -> Calls:
    """All calls between the parts in a run of 4 intact and 3 damaged frames."""
    noted: Calls = []
    for name in ("body", "eye", "babbler", "learner", "damage"):
        real = getattr(loop, f"build_{name}")
        monkeypatch.setattr(loop, f"build_{name}", lambda *args, name=name, real=real: Spy(name, real(*args), noted))
    recorder = loop.Recorder
    monkeypatch.setattr(loop, "Recorder", lambda *args: Spy("recorder", recorder(*args), noted))
    description = short(phases=[{"name": "a", "frames": 4}, {"name": "b", "frames": 3, "damage": {"kind": "offset"}}])
    experiment = Experiment(description)
    noted.clear()
    experiment.run(prepare_folder(tmp_path / "spied", description))
    return noted


def named(calls: Calls, name: str) -> list[tuple[tuple[Any, ...], Any]]:
    return [(args, result) for called, args, result in calls if called == name]


def test_a_frame_has_one_order(calls: Calls) -> None:
    """Sense, babble, damage, learn, gaze, record, advance: in each of the frames, and nothing twice."""
    steps = [name for name, _, _ in calls if name in FRAME]
    assert steps == FRAME * 7


def test_each_part_is_handed_what_the_one_before_gave(calls: Calls) -> None:
    """One reading feeds eye, babbler and percept; the damaged percept feeds the learner; targets feed the body."""
    looks, commands, senses, observes, gazes, steps = (named(calls, name) for name in FRAME if "record" not in name)
    for k in range(7):
        (reading,), sighting = looks[k]
        assert commands[k][0] == (reading.time,)
        percept, sensed = senses[k][0][0], senses[k][1]
        for vector in ("arm", "head", "arm_command", "head_command"):
            assert np.array_equal(getattr(percept, vector), getattr(reading, vector))
        assert (percept.time, percept.dt, percept.sighting) == (reading.time, reading.dt, sighting)
        assert observes[k][0][0] is sensed and gazes[k][0][0] is sensed
        assert steps[k][0][0] is commands[k][1] and steps[k][0][1] is gazes[k][1]
    for k in range(6):
        assert looks[k + 1][0][0] is steps[k][1]


def test_the_damage_of_a_phase_lasts_as_long_as_the_phase(calls: Calls) -> None:
    """It injures before the first of its frames, senses in all of them, and heals after the last."""
    events = [name for name, _, _ in calls if name.startswith("damage.")]
    assert events == [
        "damage.injure", *["damage.sense"] * 4, "damage.heal", "damage.injure", *["damage.sense"] * 3, "damage.heal"
    ]  # fmt: skip
    shifts = [sensed.arm - args[0].arm for args, sensed in named(calls, "damage.sense")]
    assert np.allclose(shifts, np.repeat([np.zeros(4), OFFSET], [4, 3], axis=0))


def column(run: Run, *names: str) -> np.ndarray:
    return np.column_stack([run.frames([name])[name].to_numpy() for name in names])


def test_the_learner_perceives_the_shift_and_the_body_never_feels_it(run_short: RunShort) -> None:
    """Recorded percepts are the sensed posture in phase 0, shifted and unclipped in phase 1; the arm is the same."""
    damaged = run_short("damaged")
    intact = run_short("intact", phases=[{"name": "a", "frames": 200}, {"name": "b", "frames": 100}])
    arm = column(damaged, *(f"arm_{name}_rad" for name in ARM))
    percept = column(damaged, *(f"percept_{name}_rad" for name in ARM))
    expected = np.repeat([np.zeros(4), OFFSET], [200, 100], axis=0)
    assert np.abs(percept - arm - expected).max() < 1e-12
    assert np.array_equal(arm, column(intact, *(f"arm_{name}_rad" for name in ARM)))


def test_one_seed_gives_every_learner_the_same_arm_movement(run_short: RunShort) -> None:
    """Open loop: the commands are identical whatever moves the head, and so is the arm without physics."""
    names = [f"{kind}_{joint}_rad" for kind in ("arm_command", "arm") for joint in ARM]
    runs = [run_short(kind, learner={"kind": kind}) for kind in ("random", "fixed")] + [run_short("hebbian")]
    first, *others = (column(run, *names) for run in runs)
    assert len(np.unique(first[:, 0])) > 3
    assert all(np.array_equal(first, other) for other in others)
    heads = [column(run, "head_HeadYaw_rad") for run in runs]
    assert not np.array_equal(heads[0], heads[1]) and not np.array_equal(heads[0], heads[2])
    assert not np.array_equal(column(run_short("other seed", seed=4), *names), first)


@pytest.mark.gl
def test_physics_changes_no_arm_command(run_short: RunShort) -> None:
    """The same with physics and the rendered eye: commands are identical for two learners."""
    settings: dict[str, Any] = {"body": {}, "eye": {"kind": "fiducial"}, "phases": [{"frames": 90}]}
    names = [f"arm_command_{joint}_rad" for joint in ARM]
    runs = [run_short("one", **settings), run_short("two", learner={"kind": "fixed"}, **settings)]
    assert np.array_equal(*(column(run, *names) for run in runs))


def bytes_of(run: Run) -> dict[str, bytes]:
    write_summary(run)
    return {path.name: path.read_bytes() for path in (*run.parts, run.path / "summary.json")}


def test_the_same_description_gives_the_same_bytes(run_short: RunShort) -> None:
    """frames/ and summary.json are a function of the description; another seed gives other frames."""
    first, again, other = (bytes_of(run_short(name, seed=seed)) for name, seed in (("a", 3), ("b", 3), ("c", 4)))
    assert first == again
    assert first["part-00000.parquet"] != other["part-00000.parquet"]


@pytest.mark.gl
def test_physics_and_rendering_repeat_to_the_byte(run_short: RunShort) -> None:
    """The same of the dynamic body and the detector on pictures."""
    settings = {"body": {"motion": "dynamic"}, "eye": {"kind": "fiducial"}}
    first, again = (bytes_of(run_short(name, **settings)) for name in "ab")
    assert first == again
    assert first != bytes_of(run_short("c", seed=4, **settings))


def test_frames_and_hits_are_counted(short: Short, tmp_path: Path) -> None:
    """`done` and `hits` follow the run frame by frame; time accounts cover every part."""
    description, seen = short(), []
    experiment = Experiment(description)
    folder = prepare_folder(tmp_path / "run", description)
    experiment.run(folder, lambda running: seen.append((running.done, running.hits)))
    hits = column(load_run(folder), "hit").ravel()
    assert [done for done, _ in seen] == list(range(1, 301))
    assert [count for _, count in seen] == np.cumsum(hits).tolist()
    assert 0 < experiment.hits < 300
    cost = load_run(folder).cost
    assert cost is not None and cost["frames"] == 300
    assert {"wall_s", "frames_per_s", "peak_memory_bytes"} <= cost.keys()
    assert set(cost["microseconds_per_frame"]) == {
        *["physics", "render", "detect", "babble", "damage", "learn", "record"]
    }
    assert sum(cost["microseconds_per_frame"].values()) * 300e-6 < cost["wall_s"]


def test_whoever_watches_may_stop_the_run(short: Short, tmp_path: Path) -> None:
    """An exception ends the run after the frame; all frames until then, and the cost, are in the folder."""
    description = short()
    folder = prepare_folder(tmp_path / "run", description)

    def stop(running: Experiment) -> None:
        if running.done == 42:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Experiment(description).run(folder, stop)
    run = load_run(folder)
    assert column(run, "frame").ravel().tolist() == list(range(42))
    assert run.cost is not None and run.cost["frames"] == 42


@pytest.mark.parametrize("frames", [(0, 5), (5, 0), (0, 0)])
def test_phases_without_frames(run_short: RunShort, frames: tuple[int, int]) -> None:
    """They are skipped and summarised like others; so is a run without any frame."""
    phases = [{"name": "a", "frames": frames[0]}, {"name": "b", "frames": frames[1], "damage": {"kind": "offset"}}]
    run = run_short(phases=phases)
    summary = write_summary(run)
    assert [phase["frames"] for phase in summary["phases"]] == list(frames)
    assert [phase["damage"] for phase in summary["phases"]] == ["none", "offset"]
    assert run.frames(["frame"]).num_rows == sum(frames)
