"""The run folder: what a run leaves in it, how it goes on from it to the byte, and what it refuses."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from somatopy.analysis.runs import Run, load_run
from somatopy.analysis.summary import write_summary
from somatopy.bodies import Diverged
from somatopy.contract import same
from somatopy.experiment import Description, DescriptionError, RunFolder, Session, provenance, recorder, run_writer
from somatopy.experiment.checkpoint import read_checkpoint, write_checkpoint
from somatopy.experiment.run_folder import CHECKPOINT
from somatopy.interventions import NoIntervention
from somatopy.learners import FixedGaze
from somatopy.percept import Percept, Robot

Short = Callable[..., Description]
RunShort = Callable[..., Run]

OFFSET = np.array([0.1265, 1.1411, 1.2295, -0.2242])
ARM = ("LShoulderPitch", "LShoulderRoll", "LElbowYaw", "LElbowRoll")


def column(run: Run, *names: str) -> np.ndarray:
    return np.column_stack([run.frames([name])[name].to_numpy() for name in names])


def test_the_learner_perceives_the_shift_and_the_body_never_feels_it(run_short: RunShort) -> None:
    """Recorded percepts are the sensed posture in phase 0, shifted and unclipped in phase 1; the arm is the same."""
    damaged = run_short("damaged")
    intact = run_short("intact", phases=[{"name": "a", "frames": 200}, {"name": "b", "frames": 100}])
    arm = column(damaged, *(f"arm.{name}" for name in ARM))
    percept = column(damaged, *(f"arm_percept.{name}" for name in ARM))
    expected = np.repeat([np.zeros(4), OFFSET], [200, 100], axis=0)
    assert np.abs(percept - arm - expected).max() < 1e-12
    assert np.array_equal(arm, column(intact, *(f"arm.{name}" for name in ARM)))


def test_one_seed_gives_every_learner_the_same_arm_movement(run_short: RunShort) -> None:
    """Open loop: the commands are identical whatever moves the head, and so is the arm without physics."""
    names = [f"{kind}.{joint}" for kind in ("arm_command", "arm") for joint in ARM]
    runs = [run_short(kind, learner={"kind": kind}) for kind in ("random", "fixed")] + [run_short("hebbian")]
    first, *others = (column(run, *names) for run in runs)
    assert len(np.unique(first[:, 0])) > 3
    assert all(np.array_equal(first, other) for other in others)
    heads = [column(run, "head.HeadYaw") for run in runs]
    assert not np.array_equal(heads[0], heads[1]) and not np.array_equal(heads[0], heads[2])
    assert not np.array_equal(column(run_short("other seed", seed=4), *names), first)


@pytest.mark.gl
def test_physics_changes_no_arm_command(run_short: RunShort) -> None:
    """The same with physics and the rendered eye: commands are identical for two learners."""
    settings: dict[str, Any] = {"body": {}, "eye": {"kind": "fiducial"}, "phases": [{"frames": 90}]}
    names = [f"arm_command.{joint}" for joint in ARM]
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


ALL = 10**9


def play(session: Session, folder: RunFolder, until: int = ALL, since: dict[str, Any] | None = None) -> bool:
    """Run and record up to that frame; whether the session has ended."""
    with folder.recording(session, since):
        while session.done < until and next(session, None) is not None:
            pass
    return session.done == session.description.frames


def start(description: Description, path: Path, until: int = ALL, **parts: Any) -> bool:
    """Begin a run in a new folder."""
    with Session(description, **parts) as session:
        return play(session, RunFolder.new(path, session.description), until)


def go_on(path: Path, until: int = ALL, **parts: Any) -> bool:
    """Build the session of a folder anew, go on from its checkpoint up to that frame; whether it has ended."""
    folder = RunFolder(path)
    with Session(folder.description(**parts)) as session:
        return play(session, folder, until, folder.restore(session))


def test_the_cost_counts_every_part(run_short: RunShort) -> None:
    """Frames, speed, memory, and the time of each part, which add up to less than the whole."""
    cost = run_short().cost
    assert cost is not None and cost["frames"] == 300
    assert {"wall_s", "frames_per_s", "peak_memory_bytes"} <= cost.keys()
    spent = cost["microseconds_per_frame"]
    assert set(spent) == {"physics", "render", "detect", "babble", "damage", "learn", "record"}
    assert sum(spent.values()) * 300e-6 < cost["wall_s"]


def test_who_owns_the_loop_may_stop_it(short: Short, tmp_path: Path) -> None:
    """All frames until then, the cost and a checkpoint are in the folder."""
    assert not start(short(), tmp_path / "run", 42)
    run = load_run(tmp_path / "run")
    assert column(run, "frame").ravel().tolist() == list(range(42))
    assert run.cost is not None and run.cost["frames"] == 42
    assert read_checkpoint(run.path / CHECKPOINT)["session"]["done"] == 42


@pytest.mark.parametrize("inside", [True, False])
def test_an_exception_loses_no_frame(short: Short, tmp_path: Path, inside: bool) -> None:
    """Whatever ends the run, within a frame or between two, the frames until then are there, and it can go on."""
    folder = tmp_path / "run"
    with pytest.raises(ZeroDivisionError), Session(short()) as session:
        observe = session.learner.observe

        def fail(percept: Percept) -> None:
            if session.done == 42:
                raise ZeroDivisionError
            observe(percept)

        if inside:
            session.learner.observe = fail  # type: ignore[method-assign]
        with RunFolder.new(folder, session.description).recording(session):
            for _ in session:
                if session.done == 42 and not inside:
                    raise ZeroDivisionError
    assert column(load_run(folder), "frame").ravel().tolist() == list(range(42))
    assert read_checkpoint(folder / CHECKPOINT)["session"]["done"] == (0 if inside else 42)
    start(short(), tmp_path / "whole")
    assert go_on(folder) and contents(folder) == contents(tmp_path / "whole")


class Wild(NoIntervention):
    """Joints push themselves on, so that physics falls apart."""

    moves_arm = True

    def hold(self, stage: Any) -> None:
        self.before = stage.body.model.dof_damping.copy()
        stage.body.model.dof_damping[:] = -1e4

    def release(self, stage: Any) -> None:
        stage.body.model.dof_damping[:] = self.before


def test_physics_that_falls_apart_stops_the_run_with_everything_saved(
    short: Short, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The run ends with the frames before, and can go on from the last checkpoint; nothing runs on as if well."""
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its log into the current folder
    phases = [{"name": "a", "frames": 20}, {"name": "b", "frames": 200}]
    with pytest.raises(Diverged, match=r"of the joint .* is huge or no number"):
        start(short(body={"motion": "dynamic"}, phases=phases), tmp_path / "run", interventions={"b": [Wild]})
    frames = column(load_run(tmp_path / "run"), "frame").ravel().tolist()
    assert 20 <= len(frames) < 220 and frames == list(range(len(frames)))
    assert np.abs(np.diff(load_run(tmp_path / "run").postures("arm"), axis=0)).max() < 0.6
    assert read_checkpoint(tmp_path / "run" / CHECKPOINT)["session"]["done"] == 20


@pytest.mark.parametrize("existed", [True, False])
def test_a_run_without_a_frame_leaves_its_folder_as_it_was(short: Short, tmp_path: Path, existed: bool) -> None:
    """So that the same command can be given again."""
    folder = tmp_path / "run"
    if existed:
        folder.mkdir()
    with pytest.raises(ZeroDivisionError), Session(short()) as session:
        session.learner.observe = lambda percept: 1 / 0  # type: ignore[method-assign]
        play(session, RunFolder.new(folder, session.description))
    assert folder.exists() == existed and not list(folder.glob("*"))
    assert start(short(), folder)


def test_a_folder_that_holds_a_run_is_not_begun_anew(run_short: RunShort, short: Short) -> None:
    """Without the checkpoint from which to go on, no byte of the run that is there is overwritten or removed."""
    run = run_short()
    before = contents(run.path)
    with (
        Session(short()) as session,
        pytest.raises(DescriptionError, match="holds a run already; nothing was changed"),
        RunFolder(run.path).recording(session),
    ):
        next(session)
    assert contents(run.path) == before


def test_a_checkpoint_that_another_process_has_left_behind_is_not_gone_on_from(short: Short, tmp_path: Path) -> None:
    """Somebody else resumes the run between the reading of its checkpoint and the first frame: nothing is lost."""
    folder = RunFolder(tmp_path / "run")
    start(short(), folder.path, 20)
    with Session(folder.description()) as session:
        since = folder.restore(session)
        go_on(folder.path, 40)
        before = contents(folder.path)
        with pytest.raises(DescriptionError, match=r"stands at frame 40, .* at frame 20: another process"):
            play(session, folder, ALL, since)
    assert contents(folder.path) == before
    assert go_on(folder.path)


def test_a_folder_in_use_is_left_alone(short: Short, tmp_path: Path) -> None:
    """While another holds the lock nothing is written."""
    description = short(phases=[{"frames": 3}])
    folder = RunFolder.new(tmp_path / "run", description)
    with folder.locked(), Session(description) as session:
        with pytest.raises(DescriptionError, match="Another process"):
            play(session, folder)
        assert session.done == 0
    assert sorted(entry.name for entry in folder.path.rglob("*")) == [".lock"]


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
    for module in (run_writer, recorder):
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
    return [
        read_checkpoint(run.path / f"phase-{k}.npz")["session"]["learner"]
        for k in range(len(run.description["phases"]))
    ]


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
    tables: list[dict[str, Any]] = []
    folder = tmp_path / "run"
    with (
        Session(short(phases=[{"frames": 170}])) as session,
        RunFolder.new(folder, session.description).recording(session),
    ):
        for _ in session:
            if session.done % small_parts == 0:
                tables.append(session.learner.state())
        groups = {"arm": session.body.arm, "head": session.body.head}
    assert [path.name for path in sorted((folder / "maps").iterdir())] == [f"window-0000{k}.npz" for k in range(3)]
    names = {"arm_codebook", "head_codebook", "arm_shape", "head_shape", "arm_limits", "head_limits", "frame"}
    for k, (kept, state) in enumerate(zip(windows(load_run(folder)), tables, strict=True)):
        assert set(kept) == names | {"link_pre", "link_post", "link_weight"}
        assert kept["frame"] == 50 * (k + 1)
        assert (kept["link_pre"].dtype, kept["link_post"].dtype) == (np.int32, np.int32)
        assert all(np.array_equal(values, kept[name]) for name, values in state["links"].items())
        assert (kept["link_weight"] != 0).all()
        for side, group in groups.items():
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


def contents(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for kind in ("frames", "maps")
        for path in folder.glob(f"{kind}/*")
    } | {path.name: path.read_bytes() for path in folder.glob("belief.npz")}


def end_state(folder: Path) -> dict[str, Any]:
    """The last checkpoint without what is measured by the clock."""
    found = read_checkpoint(folder / CHECKPOINT)
    return {**found, "session": found["session"] | {"seconds": None}, "wall_s": None, "record_s": None}


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
    start(description, broken, 0)
    for stop in sorted(stops):
        assert not go_on(broken, stop)
    assert go_on(broken)
    assert contents(broken) == contents(whole)
    assert same(end_state(broken), end_state(whole))


class Blow(NoIntervention):
    """Knocks the camera aside for the length of a phase, and makes the arm's sensors noisy."""

    alters_ceiling = True

    def hold(self, stage: Any) -> None:
        self.before = stage.body.model.cam_pos.copy()
        stage.body.model.cam_pos[:] += 0.02

    def release(self, stage: Any) -> None:
        stage.body.model.cam_pos[:] = self.before

    def sense(self, percept: Percept, rng: np.random.Generator) -> Percept:
        return replace(percept, arm=percept.arm + rng.normal(0, 0.01, len(percept.arm)))


BLOW: dict[str, Any] = {"interventions": {"b": [lambda: Blow()]}}


@pytest.mark.parametrize("stop", [50, 51, 75, 99, 100, 101])
def test_an_injured_body_goes_on_injured_and_a_healed_one_healed(short: Short, tmp_path: Path, stop: int) -> None:
    """Wherever in a run or at its phases' borders it was stopped, each injury is there once and in its phase alone."""
    description = short(phases=[{"name": name, "frames": 50} for name in "abc"])
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    assert start(description, whole, **BLOW)
    start(description, broken, stop, **BLOW)
    assert go_on(broken, **BLOW)
    expected = contents(whole)
    assert contents(broken) == expected
    for border in ("phase-0.npz", "phase-1.npz"):
        shutil.copy(whole / border, broken / CHECKPOINT)
        assert go_on(broken, **BLOW)
        assert contents(broken) == expected


def test_an_injury_is_seen_from_the_first_frame_of_its_phase_to_the_last(short: Short, tmp_path: Path) -> None:
    """The gaze error, computed from true poses, is the injured body's in all frames of the phase and in no other."""
    description, found = short(phases=[{"name": name, "frames": 5} for name in "abc"], learner=FIXED), {}
    for name, parts in (("hurt", BLOW), ("intact", {})):
        start(description, tmp_path / name, **parts)
        found[name] = column(load_run(tmp_path / name), "gaze_error_rad").ravel()
    assert (found["hurt"] != found["intact"]).tolist() == [False] * 5 + [True] * 5 + [False] * 5


class Hoards(FixedGaze):
    """A learner whose state holds what no checkpoint can."""

    def __init__(self, robot: Robot, rng: np.random.Generator) -> None:
        super().__init__([0.0, 0.0])
        self.seen: list[np.ndarray] = []

    def observe(self, percept: Percept) -> None:
        self.seen.append(percept.arm)

    def state(self) -> dict[str, Any]:
        return {"seen": self.seen}


def test_a_state_that_cannot_be_written_is_named_and_loses_no_frame(short: Short, tmp_path: Path) -> None:
    """The checkpoint of the beginning stays, and the frames so far are recorded."""
    with pytest.raises(TypeError, match=r"because of session\.learner\.seen: .*lists of numbers or text"):
        start(short(), tmp_path / "run", 7, learner=Hoards)
    assert len(load_run(tmp_path / "run").frames(["frame"])) == 7
    assert RunFolder(tmp_path / "run").checkpoint()["session"]["done"] == 0


def test_what_a_kill_leaves_behind_is_cleared_away(run_short: RunShort, small_parts: int, tmp_path: Path) -> None:
    """Parts younger than the checkpoint, cut off or whole, and files written aside: all is written anew."""
    whole, broken = run_short("whole").path, tmp_path / "broken"
    start(RunFolder(whole).description(), broken, 130)
    checkpoint = (broken / CHECKPOINT).read_bytes()
    go_on(broken, 260)
    (broken / CHECKPOINT).write_bytes(checkpoint)
    frames = broken / "frames"
    assert len(list(frames.iterdir())) == 6
    newest = frames / "part-00005.parquet"
    newest.write_bytes(newest.read_bytes()[:-100])
    aside = [".part-00006.parquet.7-ab.partial", ".window-00004.npz.7-ab.partial", f".{CHECKPOINT}.7-ab.partial"]
    for folder, name in zip((frames, broken / "maps", broken), aside, strict=True):
        (folder / name).write_bytes(b"half")
    (frames / ".nfs0001").write_bytes(b"not ours")
    assert go_on(broken)
    assert (frames / ".nfs0001").read_bytes() == b"not ours"
    (frames / ".nfs0001").unlink()
    assert contents(broken) == contents(whole)
    assert not list(broken.rglob("*.partial"))


def checkpoints(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The frames at which checkpoints are written from now on."""
    written: list[int] = []
    real = run_writer.write_checkpoint

    def write(path: Path, state: dict[str, Any]) -> None:
        written.append(state["session"]["done"])
        real(path, state)

    monkeypatch.setattr(run_writer, "write_checkpoint", write)
    return written


def test_checkpoints_come_by_the_clock_and_at_ends(run_short: RunShort, monkeypatch: pytest.MonkeyPatch) -> None:
    """At frame 0, every CHECKPOINT_S seconds at most, and at the end of each phase, of one without frames too."""
    written = checkpoints(monkeypatch)
    phases = [{"name": "a", "frames": 6}, {"name": "none", "frames": 0}, {"name": "b", "frames": 4}]
    for every, expected in ((float("inf"), [0, 6, 10]), (-1.0, list(range(11)))):
        monkeypatch.setattr(run_writer, "CHECKPOINT_S", every)
        written.clear()
        path = run_short(str(every), phases=phases).path
        assert written == expected
        ends = {name: read_checkpoint(path / name)["session"]["done"] for name in ("phase-0.npz", "phase-1.npz")}
        assert ends == {"phase-0.npz": 6, "phase-1.npz": 6}
        assert (path / CHECKPOINT).read_bytes() == (path / "phase-2.npz").read_bytes()


def test_a_checkpoint_comes_with_every_part(
    run_short: RunShort, small_parts: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So that no finished part is ever younger than the last checkpoint, but for a moment."""
    written = checkpoints(monkeypatch)
    run_short(phases=[{"frames": 170}])
    assert written == [0, 50, 100, 150, 170]


def test_time_and_hits_go_on_counting(short: Short, tmp_path: Path) -> None:
    """The cost of a run in two pieces is that of both."""
    folder = RunFolder(tmp_path / "broken")
    start(short(), folder.path, 200)
    first = load_run(folder.path).cost or {}
    with Session(folder.description()) as session:
        play(session, folder, ALL, folder.restore(session))
    second = load_run(folder.path).cost or {}
    assert second["frames"] == 300 and second["wall_s"] > first["wall_s"] > 0
    assert session.hits == column(load_run(folder.path), "hit").sum()


# -- what is refused ---------------------------------------------------------------------------------------------------


def refusal(path: Path, **options: Any) -> str:
    """What is said when the session of a folder is to go on; the folder stays as it was."""
    before = {file: file.read_bytes() for file in path.rglob("*") if file.is_file()}
    folder = RunFolder(path)
    with pytest.raises(DescriptionError) as caught, Session(folder.description()) as session:
        folder.restore(session, **options)
    assert {file: file.read_bytes() for file in path.rglob("*") if file.is_file()} == before
    return str(caught.value)


def test_an_edited_description_is_refused(short: Short, tmp_path: Path) -> None:
    """The keys that differ from what the run began with are named."""
    start(short(), tmp_path / "run", 30)
    file = tmp_path / "run" / "experiment.toml"
    text = file.read_text(encoding="utf-8")
    for before, after, keys in (
        ("seed = 3", "seed = 4", ["seed"]),
        ("elasticity", "learning_rate = 0.3 #", ["learner.arm_map.learning_rate", "learner.head_map.learning_rate"]),
        ("frames = 100", "frames = 101", ["phases.1.frames"]),
        ('offset = "paper"', "offset = [0.1, 0.2, 0.3, 0.4]", ["phases.1.interventions.0.offset"]),
        ('kind = "hebbian"', 'kind = "hebbian"\nlink_rate = 0.5 #', ["learner.link_rate"]),
    ):
        if before == "elasticity":
            changed = text.replace('preset = "rougier"', 'preset = "rougier"\nlearning_rate = 0.3')
        elif before == 'kind = "hebbian"':
            changed = text.replace("link_rate = 0.01", "link_rate = 0.5")
        else:
            changed = text.replace(before, after)
        assert changed != text
        file.write_text(changed, encoding="utf-8")
        said = refusal(tmp_path / "run")
        assert said.startswith(f"{file} is not what this run began with: {', '.join(keys)} differ")
    file.write_text(text, encoding="utf-8")
    assert go_on(tmp_path / "run")


def test_another_version_or_code_is_refused_unless_asked_for(
    short: Short, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What differs is named; gone on with all the same, both authors stand in the description, the old one first."""
    start(short(), tmp_path / "run", 30)
    before = load_run(tmp_path / "run").description
    folder, real = RunFolder(tmp_path / "run"), provenance.versions()
    monkeypatch.setattr(provenance, "versions", lambda: real | {"mujoco": "9.9.9"})
    said = refusal(folder.path)
    assert "versions.mujoco differs" in said and "--anyway" in said
    for stop in (40, ALL):
        with Session(folder.description()) as session:
            play(session, folder, stop, folder.restore(session, anyway=True))
    after = load_run(folder.path).description
    assert {key: after[key] for key in before} == before
    assert [entry["frame"] for entry in after["resumed"]] == [30]
    assert after["resumed"][0]["versions"]["mujoco"] == "9.9.9"
    monkeypatch.setattr(provenance, "versions", lambda: real)
    monkeypatch.setattr(provenance, "written_by", lambda parts: {"code": "other"})
    assert "code" in refusal(folder.path)


def test_the_commit_is_recorded_where_the_sources_have_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the repository in which somatopy itself is kept, and whether it was changed since; else there is none."""
    home = tmp_path / "src" / "somatopy"
    home.mkdir(parents=True)
    (home / "__init__.py").touch()
    monkeypatch.setattr(provenance, "_HOME", home)
    commit = provenance._commit.__wrapped__
    git = ["git", "-C", str(tmp_path), "-c", "user.name=a", "-c", "user.email=a@b.c"]
    subprocess.run([*git, "init", "--quiet"], check=True)
    assert commit() is None
    subprocess.run([*git, "add", "."], check=True)
    subprocess.run([*git, "commit", "--quiet", "--message", "first"], check=True)
    assert re.fullmatch("[0-9a-f]{40}", commit())
    (home / "__init__.py").write_text("CHANGED = 1")
    assert re.fullmatch("[0-9a-f]{40}-dirty", commit())


def test_another_commit_of_the_same_code_goes_on(short: Short, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A commit that changes no code that frames depend on is written down, and is no reason to refuse."""
    folder, real = RunFolder(tmp_path / "run"), provenance.written_by
    monkeypatch.setattr(provenance, "written_by", lambda parts: real(parts) | {"commit": "a"})
    start(short(), folder.path, 10)
    monkeypatch.setattr(provenance, "written_by", lambda parts: real(parts) | {"commit": "b"})
    go_on(folder.path)
    assert load_run(folder.path).description["resumed"][0]["written_by"]["commit"] == "b"


def test_without_a_checkpoint_nothing_is_deleted(run_short: RunShort) -> None:
    """Frames are there and none can be gone on from: refused, whatever is lost stays lost."""
    path = run_short().path
    (path / CHECKPOINT).unlink()
    assert f"{path} has no {CHECKPOINT}" in refusal(path)


def test_a_checkpoint_that_cannot_be_read_is_refused(run_short: RunShort) -> None:
    """The file is named."""
    path = run_short(phases=[{"frames": 3}]).path
    (path / CHECKPOINT).write_bytes(b"half")
    assert f"{path / CHECKPOINT} is no checkpoint that can be read" in refusal(path)


def test_a_checkpoint_of_another_experiment_is_refused(run_short: RunShort, tmp_path: Path) -> None:
    """Parts whose state is another's: the file is named, also where the description was made to agree."""
    path, other = run_short("one", phases=[{"frames": 3}]).path, run_short("two", learner={"kind": "random"}).path
    found = read_checkpoint(other / CHECKPOINT)
    write_checkpoint(path / CHECKPOINT, found | {"description": read_checkpoint(path / CHECKPOINT)["description"]})
    assert f"{path / CHECKPOINT} does not fit the description" in refusal(path)


def test_the_folder_says_who_wrote_it(run_short: RunShort) -> None:
    """Versions of what computed, code, Python, platform, and what to cite."""
    description = run_short(phases=[{"frames": 1}]).description
    assert description["format"] == 2
    assert {"somatopy", "numpy", "mujoco"} <= description["versions"].keys()
    assert {"code", "python", "platform"} <= description["written_by"].keys()
    assert any("Schillaci" in text and "2014" in text for text in description["cite"])


SLASHES = """
<mujoco><worldbody>
  <body name="head" pos="0 0 1"><joint name="neck/yaw" axis="0 0 1" range="-60 60"/>
    <joint name="neck/pitch" axis="0 1 0" range="-30 30"/><geom type="sphere" size=".05" mass="1"/>
    <camera name="eye" pos=".1 0 0" xyaxes="0 -1 0 0 0 1" fovy="45"/></body>
  <body name="arm" pos=".3 0 .8"><joint name="arm/a" axis="0 0 1" range="-60 60"/>
    <geom type="capsule" size=".02" fromto="0 0 0 .2 0 0" mass="1"/>
    <body name="hand" pos=".2 0 0"><joint name="arm_command/a" axis="0 1 0" range="-60 60"/>
      <geom type="sphere" size=".02" mass="1"/></body></body>
</worldbody></mujoco>
"""
ANATOMY = """
name = "Slashes"
model = "slashes.xml"
[arm]
joints = ["arm/a", "arm_command/a"]
velocity = [8.0, 8.0]
[head]
joints = ["neck/yaw", "neck/pitch"]
velocity = [8.0, 8.0]
[camera]
name = "eye"
[marker]
body = "hand"
position = [0.05, 0.0, 0.0]
"""


def test_joints_may_have_any_name(short: Short, tmp_path: Path) -> None:
    """With slashes, and like other columns: a run is recorded, goes on from its checkpoint, and is read again."""
    (tmp_path / "slashes.xml").write_text(SLASHES)
    (tmp_path / "slashes.toml").write_text(ANATOMY)
    body = {"model": str(tmp_path / "slashes.toml"), "motion": "kinematic"}
    description = short(body=body, phases=[{"frames": 40}])
    start(description, tmp_path / "whole")
    start(description, tmp_path / "broken", 17)
    assert go_on(tmp_path / "broken")
    assert contents(tmp_path / "broken") == contents(tmp_path / "whole")
    run = load_run(tmp_path / "broken")
    assert run.joints("arm") == ("arm/a", "arm_command/a")
    assert run.postures("arm").shape == (40, 2) and np.ptp(run.postures("arm"), axis=0).min() > 0


# -- killed ------------------------------------------------------------------------------------------------------------

KILLED = """
import sys
from somatopy.experiment import RunFolder, Session, load_description, recorder, run_writer
recorder.PART_FRAMES = run_writer.PART_FRAMES = 40
with Session(load_description(sys.argv[1])) as session:
    with RunFolder.new(sys.argv[2], session.description).recording(session):
        for frame in session:
            pass
"""


def test_a_killed_run_leaves_its_finished_parts(run_short: RunShort, tmp_path: Path) -> None:
    """SIGKILL in mid-run: the parts are readable, whole, in order, and equal to the same frames of an unkilled run."""
    whole = run_short("whole", phases=[{"frames": 80}])
    source, out = tmp_path / "long.toml", tmp_path / "killed"
    text = (whole.path / "experiment.toml").read_text(encoding="utf-8")
    source.write_text(text.replace("frames = 80", "frames = 100_000_000"), encoding="utf-8")
    process = subprocess.Popen([sys.executable, "-c", KILLED, str(source), str(out)])
    try:
        while not (out / "frames" / "part-00001.parquet").exists():
            assert process.poll() is None, "the run ended too early"
            time.sleep(0.01)
    finally:
        process.kill()
        process.wait()
    run = load_run(out)
    frames = run.frames()
    assert frames.num_rows >= 80 and frames.num_rows % 40 == 0
    assert frames["frame"].to_pylist() == list(range(frames.num_rows))
    for name in whole.columns:
        killed, unkilled = (some.frames([name], stop=80)[name].to_numpy() for some in (run, whole))
        np.testing.assert_array_equal(killed, unkilled, err_msg=name)
    assert run.summary is None and run.cost is None
    assert read_checkpoint(out / CHECKPOINT)["session"]["done"] >= frames.num_rows - 40


# -- the folder itself -------------------------------------------------------------------------------------------------


def test_a_new_or_empty_folder_is_taken(short: Short, tmp_path: Path) -> None:
    """Parents are made; a folder that exists may be used while it is empty."""
    (tmp_path / "empty").mkdir()
    for out in (tmp_path / "new" / "deep", tmp_path / "empty"):
        assert RunFolder.new(out, short()).path == out and out.is_dir()


def test_the_default_folder_is_named_after_the_run(
    short: Short, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """runs/<time>_<name>_seed<k> in the working folder; runs that start in one second have folders of their own."""
    monkeypatch.chdir(tmp_path)
    folders = [RunFolder.new(None, short(seed=12)).path for _ in range(4)]
    assert len(set(folders)) == 4
    for folder in folders:
        assert folder.is_dir() and folder.parent == Path("runs") and "_short_seed12" in folder.name


def test_folders_that_cannot_be_used(short: Short, tmp_path: Path) -> None:
    """Not empty, a file, below a file, too long a name: the path and the way out are named, and nothing is changed."""
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "keep.txt").write_text("mine")
    (tmp_path / "file").write_text("mine")
    before = sorted(tmp_path.rglob("*"))
    refused = {"full": "not empty", "file": "is a file", "file/below": "Not a directory", "x" * 300: "name too long"}
    for out, reason in refused.items():
        with pytest.raises(DescriptionError, match=rf"{tmp_path / out}.* {reason}.*--out"):
            RunFolder.new(tmp_path / out, short())
    assert sorted(tmp_path.rglob("*")) == before


def test_one_process_at_a_time(tmp_path: Path) -> None:
    """A second holder is refused with the folder's name; after the first, whether it failed or not, it may."""
    folder = RunFolder(tmp_path)
    refused = pytest.raises(DescriptionError, match=f"Another process is running in {tmp_path}")
    with folder.locked(), refused, folder.locked():
        pass
    with pytest.raises(ZeroDivisionError), folder.locked():
        raise ZeroDivisionError
    with folder.locked():
        pass


HOLD = """
import sys, time
from somatopy.experiment import RunFolder
with RunFolder(sys.argv[1]).locked():
    print("held", flush=True)
    time.sleep(600)
"""


def test_the_lock_ends_with_its_process(tmp_path: Path) -> None:
    """Another process is kept out, and let in when the first is killed; other folders are free all the time."""
    (tmp_path / "other").mkdir()
    with subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path)], stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None and process.stdout.readline() == "held\n"
            with pytest.raises(DescriptionError, match="Another process"), RunFolder(tmp_path).locked():
                pass
            with RunFolder(tmp_path / "other").locked():
                pass
        finally:
            process.kill()
    with RunFolder(tmp_path).locked():
        pass


@pytest.mark.parametrize("when", ["begins", "goes on"])
def test_the_description_is_there_as_a_whole_or_not_at_all(
    short: Short, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, when: str
) -> None:
    """A kill while it is written, when a run begins or goes on, leaves no half of it: it could never be resumed."""
    path = tmp_path / "run"
    if when == "goes on":
        start(short(), path, 20)
        real = provenance.versions()
        monkeypatch.setattr(provenance, "versions", lambda: real | {"numpy": "0"})
    before = (path / "experiment.toml").read_bytes() if path.exists() else None

    def fail(*args: object) -> None:
        raise OSError("killed")

    with Session(short()) as session, monkeypatch.context() as patch:
        folder = RunFolder(path) if path.exists() else RunFolder.new(path, session.description)
        since = folder.restore(session, anyway=True) if before else None
        patch.setattr("os.replace", fail)
        with pytest.raises(OSError, match="killed"):
            play(session, folder, since=since)
    if before is None:
        assert not path.exists()
    else:
        assert (path / "experiment.toml").read_bytes() == before
