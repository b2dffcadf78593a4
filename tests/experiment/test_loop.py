"""The frame loop: its order, what each part is handed, phases, and that a run can be repeated and go on to the byte."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from somatopy.analysis.runs import Run, load_run
from somatopy.analysis.summary import write_summary
from somatopy.bodies import MujocoBody
from somatopy.contract import same
from somatopy.experiment import Description, DescriptionError, Experiment, load_description, loop, recorder
from somatopy.experiment.checkpoint import FILE, locked, read_checkpoint
from somatopy.experiment.damage import NoDamage
from somatopy.experiment.recorder import prepare_folder
from somatopy.eyes import FiducialEye
from somatopy.percept import Percept

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
    for k in (0, 1, 2, 4, 5):  # between them is the border of the phases, where the body senses anew
        assert looks[k + 1][0][0] is steps[k][1]
    assert looks[4][0][0].time == steps[3][1].time and np.array_equal(looks[4][0][0].arm, steps[3][1].arm)


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

    def watch(running: Experiment) -> bool:
        seen.append((running.done, running.hits))
        return False

    assert experiment.run(folder, watch)
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


def test_drawing_is_not_counted_as_detecting(run_short: RunShort, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a picture takes 4 s and searching it 1 s, drawing is charged 4 s a frame, and detection 1 s."""
    now = [0.0]

    def slow(seconds: float, result: Any) -> Any:
        def take_time(*_: object, **__: object) -> Any:
            now[0] += seconds
            return result

        return take_time

    for module in [module for name, module in sys.modules.items() if name.startswith("somatopy")]:
        if hasattr(module, "perf_counter"):
            monkeypatch.setattr(module, "perf_counter", lambda: now[0])
    monkeypatch.setattr(MujocoBody, "picture", slow(4.0, np.zeros((240, 320, 3), np.uint8)))
    monkeypatch.setattr(FiducialEye, "detect", slow(1.0, {}))
    cost = run_short(eye={"kind": "fiducial", "skip": False}, phases=[{"frames": 10}]).cost
    assert cost is not None
    spent = cost["microseconds_per_frame"]
    assert (spent["render"], spent["detect"]) == pytest.approx((4e6, 1e6))
    assert sum(spent.values()) == pytest.approx(5e6)


def until(frame: int) -> Callable[[Experiment], bool]:
    return lambda running: running.done >= frame


def test_whoever_watches_may_stop_the_run(short: Short, tmp_path: Path) -> None:
    """The run says that it has not ended; all frames until then, the cost and a checkpoint are in the folder."""
    description = short()
    folder = prepare_folder(tmp_path / "run", description)
    assert not Experiment(description).run(folder, until(42))
    run = load_run(folder)
    assert column(run, "frame").ravel().tolist() == list(range(42))
    assert run.cost is not None and run.cost["frames"] == 42
    assert read_checkpoint(folder / FILE)["done"] == 42


def test_an_exception_loses_no_frame(short: Short, tmp_path: Path) -> None:
    """Whatever ends the run, the frames until then are in the folder."""
    description = short()
    folder = prepare_folder(tmp_path / "run", description)

    def fail(running: Experiment) -> bool:
        if running.done == 42:
            raise ZeroDivisionError
        return False

    with pytest.raises(ZeroDivisionError):
        Experiment(description).run(folder, fail)
    assert column(load_run(folder), "frame").ravel().tolist() == list(range(42))


def test_an_experiment_runs_once(short: Short, tmp_path: Path) -> None:
    """The second call is refused before it touches anything."""
    description = short(phases=[{"frames": 3}])
    experiment = Experiment(description)
    assert experiment.run(prepare_folder(tmp_path / "run", description))
    with pytest.raises(RuntimeError, match="has run already"):
        experiment.run(tmp_path)
    assert [entry.name for entry in tmp_path.iterdir()] == ["run"]


def test_a_folder_in_use_is_left_alone(short: Short, tmp_path: Path) -> None:
    """While another holds the lock nothing is written."""
    description = short(phases=[{"frames": 3}])
    folder = prepare_folder(tmp_path / "run", description)
    with locked(folder), pytest.raises(DescriptionError, match="Another process"):
        Experiment(description).run(folder)
    assert sorted(entry.name for entry in folder.rglob("*")) == [".lock", "frames"]


@pytest.mark.parametrize("frames", [(0, 5), (5, 0), (0, 0)])
def test_phases_without_frames(run_short: RunShort, frames: tuple[int, int]) -> None:
    """They are skipped and summarised like others; so is a run without any frame."""
    phases = [{"name": "a", "frames": frames[0]}, {"name": "b", "frames": frames[1], "damage": {"kind": "offset"}}]
    run = run_short(phases=phases)
    summary = write_summary(run)
    assert [phase["frames"] for phase in summary["phases"]] == list(frames)
    assert [phase["damage"] for phase in summary["phases"]] == ["none", "offset"]
    assert run.frames(["frame"]).num_rows == sum(frames)


# -- phases ----------------------------------------------------------------------------------------------------------


@pytest.fixture
def small_parts(monkeypatch: pytest.MonkeyPatch) -> int:
    """Parts and windows of 50 frames instead of 4,500."""
    for module in (loop, recorder):
        monkeypatch.setattr(module, "PART_FRAMES", 50)
    return 50


def parts_changed(before: dict[str, Any], after: dict[str, Any]) -> set[str]:
    """The parts of the paper's learner that differ between two of its states."""
    changed = {part for part in ("arm_map", "head_map") if (before[part]["codebook"] != after[part]["codebook"]).any()}
    return changed | (set() if same(before["links"], after["links"]) else {"links"})


def table_of(links: dict[str, np.ndarray]) -> np.ndarray:
    """All links between two maps of 100 units."""
    table = np.zeros((100, 100))
    table[links["link_pre"], links["link_post"]] = links["link_weight"]
    return table


def ends(run: Run) -> list[dict[str, Any]]:
    """The learner's state at the end of each phase."""
    return [read_checkpoint(run.path / f"phase-{k}.npz")["learner"] for k in range(len(run.description["phases"]))]


def test_each_phase_says_what_learns(run_short: RunShort) -> None:
    """Nothing, links alone, maps alone; a phase that says nothing restores all parts, whatever came before."""
    every = ["arm_map", "head_map", "links"]
    plastic: list[list[str] | None] = [None, [], ["links"], ["arm_map", "head_map"], None]
    phases = [{"name": str(k), "frames": 150} | ({} if p is None else {"plastic": p}) for k, p in enumerate(plastic)]
    states = ends(run_short(phases=phases))
    changes = [parts_changed(before, after) for before, after in pairwise(states)]
    assert changes == [set(every if parts is None else parts) for parts in plastic[1:]]


def test_a_learner_may_begin_afresh(run_short: RunShort) -> None:
    """No links, and start codes of its own that are a function of seed and phase alone."""
    found = {}
    for seed in (3, 4):
        for first in (100, 150):
            phases = [{"name": "a", "frames": first}]
            phases += [{"name": name, "frames": 5, "start": "afresh", "plastic": []} for name in "bc"]
            found[seed, first] = ends(run_short(f"{seed} {first}", seed=seed, phases=phases))
    learned, *fresh = found[3, 100]
    assert learned["links"]["link_weight"].size and not any(state["links"]["link_weight"].size for state in fresh)
    codes = [state["arm_map"]["codebook"] for state in (*fresh, *found[4, 100][1:], learned)]
    assert len({array.tobytes() for array in codes}) == 5
    assert all(array.min() >= 0 and array.max() <= 1 for array in codes[:4])
    for one, other in zip(fresh, found[3, 150][1:], strict=True):
        assert not parts_changed(one, other)


def test_shuffled_links_are_the_same_rows_in_other_places(run_short: RunShort) -> None:
    """Rows change places and keep what is in them; with learning off neither links nor codes change after that."""
    still = {"plastic": []}
    phases = [{"name": "a", "frames": 200}, {"name": "b", "frames": 1, "start": "shuffled", **still}]
    learned, shuffled, later = ends(run_short(phases=[*phases, {"name": "c", "frames": 60, **still}]))
    assert parts_changed(learned, shuffled) == {"links"}
    rows, moved = (sorted(row.tobytes() for row in table_of(state["links"])) for state in (learned, shuffled))
    assert rows == moved and len(set(rows)) > 5
    assert not parts_changed(shuffled, later)


def windows(run: Run) -> list[dict[str, np.ndarray]]:
    return [dict(np.load(path, allow_pickle=False)) for path in sorted((run.path / "maps").iterdir())]


def test_maps_are_kept_at_window_ends(short: Short, small_parts: int, tmp_path: Path) -> None:
    """Each file holds the learner's arrays as named and the frame; links rebuilt from it are the learner's table."""
    description, tables = short(phases=[{"frames": 170}]), []
    experiment = Experiment(description)

    def watch(running: Experiment) -> bool:
        if running.done % small_parts == 0:
            tables.append(running.learner.state())
        return False

    folder = prepare_folder(tmp_path / "run", description)
    experiment.run(folder, watch)
    assert [path.name for path in sorted((folder / "maps").iterdir())] == [f"window-0000{k}.npz" for k in range(3)]
    names = {"arm_codebook", "head_codebook", "arm_shape", "head_shape", "arm_limits", "head_limits", "frame"}
    for k, (kept, state) in enumerate(zip(windows(load_run(folder)), tables, strict=True)):
        assert set(kept) == names | {"link_pre", "link_post", "link_weight"}
        assert kept["frame"] == 50 * (k + 1)
        assert (kept["link_pre"].dtype, kept["link_post"].dtype) == (np.int32, np.int32)
        assert all(np.array_equal(values, kept[name]) for name, values in state["links"].items())
        assert (kept["link_weight"] != 0).all()
        for side, group in (("arm", experiment.body.arm), ("head", experiment.body.head)):
            assert np.array_equal(kept[f"{side}_codebook"], state[f"{side}_map"]["codebook"])
            assert kept[f"{side}_shape"].tolist() == [10, 10]
            assert np.allclose(kept[f"{side}_limits"], np.column_stack([group.lower, group.upper]))
    assert len(kept["link_pre"]) > 0


def test_with_learning_off_windows_are_alike(run_short: RunShort, small_parts: int) -> None:
    """A phase in which nothing is plastic: the same arrays at each of its window ends."""
    phases = [{"name": "a", "frames": 100}, {"name": "b", "frames": 150, "plastic": []}]
    kept = windows(run_short(phases=phases))
    assert [int(window.pop("frame")) for window in kept] == [50, 100, 150, 200, 250]
    last = [[window[name].tobytes() for name in sorted(window)] for window in kept]
    assert last[1] == last[2] == last[3] == last[4] != last[0]


def test_a_learner_without_maps_keeps_none(run_short: RunShort, small_parts: int) -> None:
    """No folder without anything in it."""
    run = run_short(learner={"kind": "random"}, phases=[{"frames": 120}])
    assert not (run.path / "maps").exists()


@pytest.mark.gl
@pytest.mark.parametrize("learner", ["nearest", "random"])
def test_pictures_spared_change_no_frame(run_short: RunShort, learner: str) -> None:
    """With gaze on the hand and with random gaze: the same sightings, and the same all else, skipping or not."""
    settings: dict[str, Any] = {"learner": {"kind": learner}, "phases": [{"frames": 250}]}
    spared, drawn = (run_short(str(skip), eye={"kind": "fiducial", "skip": skip}, **settings) for skip in (True, False))
    assert [path.read_bytes() for path in spared.parts] == [path.read_bytes() for path in drawn.parts]
    assert spared.frames(["hit"])["hit"].to_numpy().any()


# -- checkpoints -----------------------------------------------------------------------------------------------------

STAGES = [
    {"name": "a", "frames": 120},
    {"name": "none", "frames": 0},
    {"name": "b", "frames": 60, "damage": {"kind": "offset"}, "start": "afresh"},
    {"name": "c", "frames": 40, "start": "shuffled", "plastic": []},
    {"name": "d", "frames": 30, "plastic": ["links"]},
]
FIXED = {"kind": "fixed", "head": [0.3, 0.1]}


def go_on(folder: Path, frame: int) -> bool:
    """Build the experiment of a folder anew, go on from its checkpoint up to that frame; whether it has ended."""
    experiment = Experiment(load_description(folder / "experiment.toml"))
    experiment.restore_from(folder / FILE)
    return experiment.run(folder, until(frame))


def contents(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for kind in ("frames", "maps")
        for path in folder.glob(f"{kind}/*")
    }


def end_state(folder: Path) -> dict[str, Any]:
    """The last checkpoint without what is measured by the clock."""
    return {name: value for name, value in read_checkpoint(folder / FILE).items() if name not in ("seconds", "wall_s")}


@pytest.mark.parametrize(
    "tables",
    [
        {"phases": STAGES},
        {"body": {"motion": "dynamic"}},
        {"learner": {"kind": "random"}},
        {"learner": {"kind": "nearest"}, "phases": [*STAGES[:3], {"name": "c", "frames": 40, "plastic": []}]},
        {"learner": FIXED, "phases": STAGES[:3]},
        pytest.param({"body": {}, "eye": {"kind": "fiducial"}, "phases": [{"frames": 80}]}, marks=pytest.mark.gl),
    ],
    ids=["stages", "dynamic", "random", "nearest", "fixed", "rendered"],
)
def test_stopped_anywhere_it_goes_on_bit_for_bit(
    run_short: RunShort, short: Short, small_parts: int, tmp_path: Path, tables: dict[str, Any]
) -> None:
    """At the first frame, at and beside ends of parts and phases, anywhere: frames, maps and last state agree."""
    whole, broken = run_short("whole", **tables).path, tmp_path / "broken"
    description = short(**tables)
    stops = {*[1, 2, 49, 50, 51, 119, 120, 121, 180, 181], *np.random.default_rng(0).integers(1, 250, 4).tolist()}
    stops = {stop for stop in stops if stop < description.frames}
    Experiment(description).run(prepare_folder(broken, description), until(0))
    for stop in sorted(stops):
        assert not go_on(broken, stop)
    assert go_on(broken, 10**9)
    assert contents(broken) == contents(whole)
    assert same(end_state(broken), end_state(whole))


class Blow(NoDamage):
    """Knocks the camera aside for the length of a phase, and makes the arm's sensors noisy."""

    alters_ceiling = True

    def injure(self, body: MujocoBody) -> None:  # type: ignore[override]
        self.before = body.model.cam_pos.copy()
        body.model.cam_pos[:] += 0.02

    def heal(self, body: MujocoBody) -> None:  # type: ignore[override]
        body.model.cam_pos[:] = self.before

    def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
        return replace(percept, arm=percept.arm + rng.normal(0, 0.01, len(percept.arm)))


@pytest.mark.parametrize("stop", [50, 51, 75, 99, 100, 101])
def test_an_injured_body_goes_on_injured_and_a_healed_one_healed(
    short: Short, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stop: int
) -> None:
    """Wherever in a run or at its phases' borders it was stopped, each injury is there once and in its phase alone."""
    real = loop.build_damage
    monkeypatch.setattr(loop, "build_damage", lambda p, body: Blow() if p.name == "b" else real(p, body))
    phases = [{"name": name, "frames": 50} for name in "abc"]
    description, poses = short(phases=phases), {}
    for name, stops in (("whole", [10**9]), ("broken", [stop, 10**9])):
        folder = prepare_folder(tmp_path / name, description)
        for frame in stops:
            experiment = Experiment(description)
            if frame != stops[0]:
                experiment.restore_from(folder / FILE)
            experiment.run(folder, until(frame))
        poses[name] = experiment.body.model.cam_pos.copy()
    expected = contents(tmp_path / "whole")
    assert contents(tmp_path / "broken") == expected
    for border in ("phase-0.npz", "phase-1.npz"):
        shutil.copy(tmp_path / "whole" / border, tmp_path / "broken" / FILE)
        assert go_on(tmp_path / "broken", 10**9)
        assert contents(tmp_path / "broken") == expected
    assert np.array_equal(poses["broken"], poses["whole"])
    assert np.array_equal(poses["whole"], Experiment(description).body.model.cam_pos)


def test_an_injury_is_seen_from_the_first_frame_of_its_phase_to_the_last(
    short: Short, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The gaze error, computed from true poses, is the injured body's in all frames of the phase and in no other."""
    description, found = short(phases=[{"name": name, "frames": 5} for name in "abc"], learner=FIXED), {}
    for name, damage in (("hurt", Blow), ("intact", NoDamage)):
        monkeypatch.setattr(loop, "build_damage", lambda p, body, damage=damage: (NoDamage, damage)[p.name == "b"]())
        folder = prepare_folder(tmp_path / name, description)
        Experiment(description).run(folder)
        found[name] = column(load_run(folder), "gaze_error_rad").ravel()
    assert (found["hurt"] != found["intact"]).tolist() == [False] * 5 + [True] * 5 + [False] * 5


def test_what_a_kill_leaves_behind_is_cleared_away(run_short: RunShort, small_parts: int, tmp_path: Path) -> None:
    """Parts younger than the checkpoint, cut off or whole, and files written aside: all is written anew."""
    whole, broken = run_short("whole").path, tmp_path / "broken"
    description = load_description(whole / "experiment.toml")
    Experiment(description).run(prepare_folder(broken, description), until(130))
    checkpoint = (broken / FILE).read_bytes()
    go_on(broken, 260)
    (broken / FILE).write_bytes(checkpoint)
    frames = broken / "frames"
    assert len(list(frames.iterdir())) == 6
    newest = frames / "part-00005.parquet"
    newest.write_bytes(newest.read_bytes()[:-100])
    for aside in ("frames/part-00006.partial", "maps/window-00004.partial", "cost.json.partial", f"{FILE}.partial"):
        (broken / aside).write_bytes(b"half")
    (frames / ".nfs0001").write_bytes(b"not ours")
    assert go_on(broken, 10**9)
    assert (frames / ".nfs0001").read_bytes() == b"not ours"
    (frames / ".nfs0001").unlink()
    found = {name: data for name, data in contents(broken).items() if not name.endswith(".partial")}
    assert found == contents(whole)
    assert not list(frames.glob("*.partial"))


def test_checkpoints_come_by_the_clock_and_at_ends(run_short: RunShort, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every CHECKPOINT_S seconds at most, and at the end of each phase that has frames."""
    written: list[tuple[str, int]] = []
    real = loop.write_checkpoint

    def write(path: Path, state: dict[str, Any]) -> None:
        written.append((path.name, state["done"]))
        real(path, state)

    monkeypatch.setattr(loop, "write_checkpoint", write)
    phases = [{"name": "a", "frames": 6}, {"name": "none", "frames": 0}, {"name": "b", "frames": 4}]
    for every, expected in ((float("inf"), []), (-1.0, list(range(1, 11)))):
        monkeypatch.setattr(loop, "CHECKPOINT_S", every)
        written.clear()
        run = run_short(str(every), phases=phases)
        assert [done for name, done in written if name == FILE] == expected
        assert [pair for pair in written if pair[0] != FILE] == [("phase-0.npz", 6), ("phase-2.npz", 10)]
        assert (run.path / FILE).read_bytes() == (run.path / "phase-2.npz").read_bytes()


def test_time_and_hits_go_on_counting(run_short: RunShort, short: Short, tmp_path: Path) -> None:
    """The cost of a run in two pieces is that of both."""
    description, folder = short(), tmp_path / "broken"
    Experiment(description).run(prepare_folder(folder, description), until(200))
    first = load_run(folder).cost or {}
    experiment = Experiment(description)
    experiment.restore_from(folder / FILE)
    experiment.run(folder)
    second = load_run(folder).cost or {}
    assert second["frames"] == 300 and second["wall_s"] > first["wall_s"] > 0
    assert experiment.hits == column(load_run(folder), "hit").sum()


def test_a_checkpoint_of_another_experiment_is_refused(run_short: RunShort, short: Short) -> None:
    """Another learner or other map sizes: the file is named."""
    run = run_short(phases=[{"frames": 3}])
    for learner in ({"kind": "random"}, {"kind": "hebbian"}):
        with pytest.raises(DescriptionError, match=f"{run.path / FILE} does not fit the description"):
            Experiment(short(learner=learner)).restore_from(run.path / FILE)
