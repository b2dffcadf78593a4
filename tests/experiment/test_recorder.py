"""The run folder as it is written: columns, parts, misses, and what a kill leaves behind."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from somatopy.analysis.runs import Run, load_run
from somatopy.experiment import Description, DescriptionError, recorder
from somatopy.experiment.recorder import Recorder, prepare_folder, write_json
from somatopy.percept import JointGroup, Percept, Reading, Sighting

Short = Callable[..., Description]
RunShort = Callable[..., Run]

ARM = JointGroup(("a", "b"), np.full(2, -1.0), np.ones(2), np.ones(2))
HEAD = JointGroup(("yaw", "pitch"), np.full(2, -1.0), np.ones(2), np.ones(2))
PROBES = {"arm_winner": -1, "arm_distance": float("nan")}
COLUMNS = (
    ("frame", pa.int64()), ("phase", pa.int16()), ("time_s", pa.float64()),
    ("arm_a_rad", pa.float64()), ("arm_b_rad", pa.float64()),
    ("head_yaw_rad", pa.float64()), ("head_pitch_rad", pa.float64()),
    ("arm_command_a_rad", pa.float64()), ("arm_command_b_rad", pa.float64()),
    ("head_command_yaw_rad", pa.float64()), ("head_command_pitch_rad", pa.float64()),
    ("percept_a_rad", pa.float64()), ("percept_b_rad", pa.float64()),
    ("hit", pa.bool_()), ("pixel_u", pa.float64()), ("pixel_v", pa.float64()),
    ("tag", pa.int16()), ("tag_area", pa.float64()), ("overlap", pa.bool_()), ("gaze_error_rad", pa.float64()),
    ("arm_winner", pa.int64()), ("arm_distance", pa.float64()),
)  # fmt: skip


def frame(k: int) -> tuple[Reading, Percept]:
    """A frame whose every number tells which it is; every third is a miss."""
    arm, head, target, aim = (np.array([k + part, k + part + 0.05]) for part in (0.1, 0.2, 0.3, 0.4))
    reading = Reading(k / 15, arm, head, target, aim, overlap=k % 2 == 0)
    sighting = None if k % 3 == 0 else Sighting((k + 0.5, k + 0.6), k % 4, k + 0.7)
    return reading, Percept(k / 15, arm + 100, head, target + 100, aim, sighting)


@pytest.fixture
def record(short: Short, tmp_path: Path) -> Callable[[int], Run]:
    """Record that many frames; the phase changes at frame 10."""

    def recorded(frames: int) -> Run:
        folder = prepare_folder(tmp_path / "run", short())
        writer = Recorder(folder, short(), ARM, HEAD, PROBES)
        for k in range(frames):
            reading, percept = frame(k)
            writer.record(int(k >= 10), reading, percept, {"arm_winner": k, "arm_distance": k / 7})
        writer.close()
        return load_run(folder)

    return recorded


def test_columns_are_named_typed_and_explained(record: Callable[[int], Run]) -> None:
    """Names, order and types as documented; each field says what it means, and angles say rad."""
    schema = pq.read_schema(record(3).parts[0])
    assert [(field.name, field.type) for field in schema] == list(COLUMNS)
    meanings = {field.name: field.metadata[b"meaning"].decode() for field in schema}
    assert all(meanings.values())
    assert all(("rad" in meaning) == name.endswith("_rad") for name, meaning in meanings.items())


def test_every_number_lands_in_its_column(record: Callable[[int], Run]) -> None:
    """A frame is recorded as it was; in particular the head command is the reading's, and the percept is damaged."""
    table = record(20).frames().to_pydict()
    for k in range(20):
        reading, percept = frame(k)
        row = {name: values[k] for name, values in table.items()}
        vectors = [*reading.arm, *reading.head, *reading.arm_command, *reading.head_command, *percept.arm]
        assert [row[name] for name, _ in COLUMNS[3:13]] == vectors
        assert (row["frame"], row["phase"], row["time_s"]) == (k, int(k >= 10), k / 15)
        assert (row["hit"], row["overlap"]) == (k % 3 != 0, k % 2 == 0)
        assert (row["arm_winner"], row["arm_distance"]) == (k, k / 7)
        if percept.sighting is not None:
            seen = percept.sighting
            assert (row["pixel_u"], row["pixel_v"], row["tag"], row["tag_area"]) == (*seen.pixel, seen.tag, seen.area)


def test_a_miss_is_nan_and_minus_one(record: Callable[[int], Run]) -> None:
    """Pixel and area NaN, tag -1, exactly on misses; a gaze error without true poses is NaN; nothing is null."""
    table = record(20).frames()
    missed = ~table["hit"].to_numpy()
    for name in ("pixel_u", "pixel_v", "tag_area"):
        assert np.array_equal(np.isnan(table[name].to_numpy()), missed)
    assert np.array_equal(table["tag"].to_numpy() == -1, missed)
    assert np.isnan(table["gaze_error_rad"].to_numpy()).all()
    assert all(column.null_count == 0 for column in table.columns)


def test_parts_hold_4500_frames_and_the_last_one_the_rest(record: Callable[[int], Run]) -> None:
    """Whole parts of 5 minutes, then what is left; frames go on across the border and nothing is written aside."""
    run = record(9100)
    assert [path.name for path in run.parts] == [f"part-0000{k}.parquet" for k in range(3)]
    assert [pq.read_metadata(path).num_rows for path in run.parts] == [4500, 4500, 100]
    assert run.frames(["arm_winner"])["arm_winner"].to_pylist() == list(range(9100))
    assert len(list((run.path / "frames").iterdir())) == 3


def test_no_part_without_frames(record: Callable[[int], Run]) -> None:
    """4,500 frames are one part, none are none."""
    assert len(record(4500).parts) == 1


def test_nothing_recorded(record: Callable[[int], Run]) -> None:
    """A run that was stopped before its first frame opens all the same."""
    run = record(0)
    assert run.parts == () and run.frames(["hit"]).num_rows == 0


def test_learners_without_maps_have_no_probes(run_short: RunShort) -> None:
    """Winners and distances are columns of the paper's learner, not of the controls; all else is alike."""
    probes = {"arm_winner", "head_winner", "arm_distance", "head_distance"}
    learned = set(run_short("hebbian", phases=[{"frames": 3}]).columns)
    assert probes <= learned
    for kind in ("random", "fixed"):
        assert set(run_short(kind, learner={"kind": kind}, phases=[{"frames": 3}]).columns) == learned - probes


def test_the_folder_says_what_ran(record: Callable[[int], Run]) -> None:
    """experiment.toml has the versions of what computed, and what to cite."""
    description = record(1).description
    assert {"somatopy", "numpy", "mujoco"} <= description["versions"].keys()
    assert any("Schillaci" in text and "2014" in text for text in description["cite"])


KILLED = """
import sys
from somatopy.experiment import Experiment, load_description, recorder
recorder.PART_FRAMES = 40
description = load_description(sys.argv[1])
Experiment(description).run(recorder.prepare_folder(sys.argv[2], description))
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


# -- the folder itself -----------------------------------------------------------------------------------------------


def test_a_new_or_empty_folder_is_taken(short: Short, tmp_path: Path) -> None:
    """Parents are made; a folder that exists may be used while it is empty."""
    for out in (tmp_path / "new" / "deep", tmp_path / "empty"):
        if out.name == "empty":
            out.mkdir()
        assert prepare_folder(out, short()) == out and (out / "frames").is_dir()


def test_the_default_folder_is_named_after_the_run(
    short: Short, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """runs/<time>_<name>_seed<k> in the working folder."""
    monkeypatch.chdir(tmp_path)
    folder = prepare_folder(None, short(seed=12))
    assert folder.parent == Path("runs") and folder.name.endswith("_short_seed12")


def test_folders_that_cannot_be_used(short: Short, tmp_path: Path) -> None:
    """Not empty, a file, below a file: the path and the way out are named, and nothing is changed."""
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "keep.txt").write_text("mine")
    (tmp_path / "file").write_text("mine")
    before = sorted(tmp_path.rglob("*"))
    for out, reason in (("full", "not empty"), ("file", "is a file"), ("file/below", "Not a directory")):
        with pytest.raises(DescriptionError, match=rf"{tmp_path / out}.* {reason}.*--out"):
            prepare_folder(tmp_path / out, short())
    assert sorted(tmp_path.rglob("*")) == before


def test_json_replaces_as_a_whole_and_refuses_nan(tmp_path: Path) -> None:
    """The old file stays if the new one cannot be written; no reader meets NaN."""
    path = tmp_path / "table.json"
    write_json(path, {"a": 1})
    with pytest.raises(ValueError, match="JSON"):
        write_json(path, {"a": float("nan")})
    assert json.loads(path.read_text()) == {"a": 1}
    assert [entry.name for entry in tmp_path.iterdir()] == ["table.json"]


def test_a_part_is_five_minutes() -> None:
    """4,500 frames of 1/15 s, the paper's window."""
    assert recorder.PART_FRAMES / 15 == 300


# -- maps, and going on ----------------------------------------------------------------------------------------------


def a_recorder(folder: Path, description: Description) -> Recorder:
    return Recorder(folder, description, ARM, HEAD, PROBES)


def take_down(writer: Recorder, first: int, last: int) -> None:
    for k in range(first, last):
        reading, percept = frame(k)
        writer.record(0, reading, percept, {"arm_winner": k, "arm_distance": k / 7})


def test_it_goes_on_where_it_stood(short: Short, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From its state at any row: the same parts to the byte; what is younger than the state is deleted."""
    monkeypatch.setattr(recorder, "PART_FRAMES", 10)
    whole = prepare_folder(tmp_path / "whole", short())
    writer = a_recorder(whole, short())
    take_down(writer, 0, 34)
    writer.close()
    expected = {path.name: path.read_bytes() for path in (whole / "frames").iterdir()}
    assert len(expected) == 4
    for stop in (0, 1, 9, 10, 11, 30, 33, 34):
        folder = prepare_folder(tmp_path / str(stop), short())
        writer = a_recorder(folder, short())
        take_down(writer, 0, stop)
        state = writer.state()
        take_down(writer, 70, 95)
        writer.close()
        writer = a_recorder(folder, short())
        writer.restore(state)
        assert len(list((folder / "frames").iterdir())) == stop // 10
        take_down(writer, stop, 34)
        writer.close()
        assert {path.name: path.read_bytes() for path in (folder / "frames").iterdir()} == expected


def test_maps_are_kept_as_arrays_with_their_frame(
    short: Short, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Numbered by window, readable without pickle; nothing is written where there is nothing to keep."""
    monkeypatch.setattr(recorder, "PART_FRAMES", 10)
    folder = prepare_folder(tmp_path / "run", short())
    writer = a_recorder(folder, short())
    take_down(writer, 0, 10)
    writer.keep_maps({})
    assert not (folder / "maps").exists()
    for window in (1, 2):
        take_down(writer, 10 * window, 10 * window + 10)
        writer.keep_maps({"codebook": np.full((3, 2), window)})
    assert sorted(path.name for path in (folder / "maps").iterdir()) == ["window-00001.npz", "window-00002.npz"]
    with np.load(folder / "maps" / "window-00002.npz", allow_pickle=False) as kept:
        assert int(kept["frame"]) == 30 and np.array_equal(kept["codebook"], np.full((3, 2), 2))


def test_the_description_is_there_as_a_whole_or_not_at_all(
    short: Short, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A kill while it is written, when a run begins or goes on, leaves no half of it: it could never be resumed."""
    folder = prepare_folder(tmp_path / "run", short())

    def fail(*args: object) -> None:
        raise OSError("killed")

    with monkeypatch.context() as patch:
        patch.setattr(recorder.os, "replace", fail)
        with pytest.raises(OSError, match="killed"):
            a_recorder(folder, short())
    assert not (folder / "experiment.toml").exists()
    a_recorder(folder, short())
    before = (folder / "experiment.toml").read_bytes()
    with monkeypatch.context() as patch:
        patch.setattr(recorder.os, "replace", fail)
        with pytest.raises(OSError, match="killed"):
            a_recorder(folder, short(seed=9))
    assert (folder / "experiment.toml").read_bytes() == before
