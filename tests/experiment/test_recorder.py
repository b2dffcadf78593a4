"""Frames as they are recorded: columns, parts, misses, and how recording goes on."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from somatopy.experiment import Frame, recorder
from somatopy.experiment.recorder import Recorder
from somatopy.percept import Column, JointGroup, Percept, Reading, Sighting

ARM = JointGroup(("a", "b"), np.full(2, -1.0), np.ones(2), np.ones(2))
HEAD = JointGroup(("yaw", "pitch"), np.full(2, -1.0), np.ones(2), np.ones(2))


class Recorded:
    """What a recorder asks of a session: its body's joints, and the columns of its parts."""

    columns = (Column("arm_winner", "int", "winner"), Column("arm_distance", "float", "distance, rad", "rad"))

    class body:
        arm, head = ARM, HEAD


VECTORS = (
    "arm.a", "arm.b", "head.yaw", "head.pitch",
    "arm_command.a", "arm_command.b", "head_command.yaw", "head_command.pitch",
    "arm_percept.a", "arm_percept.b", "head_percept.yaw", "head_percept.pitch",
)  # fmt: skip
COLUMNS = (
    ("frame", pa.int64()), ("phase", pa.int16()), ("time_s", pa.float64()),
    *((name, pa.float64()) for name in VECTORS),
    ("hit", pa.bool_()), ("pixel_u", pa.float64()), ("pixel_v", pa.float64()),
    ("tag", pa.int16()), ("tag_area", pa.float64()), ("overlap", pa.bool_()), ("gaze_error_rad", pa.float64()),
    ("arm_winner", pa.int64()), ("arm_distance", pa.float64()),
)  # fmt: skip


def frame(k: int) -> Frame:
    """A frame whose every number tells which it is; every third is a miss."""
    arm, head, target, aim = (np.array([k + part, k + part + 0.05]) for part in (0.1, 0.2, 0.3, 0.4))
    reading = Reading(k / 15, arm, head, target, aim, overlap=k % 2 == 0)
    seen = None if k % 3 == 0 else Sighting((k + 0.5, k + 0.6), k % 4, k + 0.7)
    percept = Percept(k / 15, arm + 100, head + 200, target + 100, aim, seen)
    probes = {"arm_winner": k, "arm_distance": k / 7}
    return Frame(k, int(k >= 10), k == 10, k == 9, reading, seen, percept, target, aim, aim, probes, {})


def a_recorder(folder: Path) -> Recorder:
    session: Any = Recorded()
    return Recorder(folder, session)


def take_down(writer: Recorder, first: int, last: int) -> None:
    for k in range(first, last):
        writer(frame(k))


@pytest.fixture
def record(tmp_path: Path) -> Callable[[int], list[Path]]:
    """Record that many frames; the phase changes at frame 10. The parts, in order."""

    def recorded(frames: int) -> list[Path]:
        writer = a_recorder(tmp_path / "frames")
        take_down(writer, 0, frames)
        writer.close()
        return sorted((tmp_path / "frames").iterdir())

    return recorded


def table(parts: list[Path]) -> pa.Table:
    return pa.concat_tables([pq.read_table(part) for part in parts])


def test_columns_are_named_typed_and_explained(record: Callable[[int], list[Path]]) -> None:
    """Names, order and types as documented; each field says what it means, its unit and its role."""
    schema = pq.read_schema(record(3)[0])
    assert [(field.name, field.type) for field in schema] == list(COLUMNS)
    told = {field.name: {key.decode(): value.decode() for key, value in field.metadata.items()} for field in schema}
    assert all(told[name]["meaning"] and told[name]["role"] for name, _ in COLUMNS)
    assert {name for name, said in told.items() if said["unit"] == "rad"} == {
        *VECTORS, "gaze_error_rad", "arm_distance"
    }  # fmt: skip
    assert {told[name]["role"] for name in VECTORS} == {"sensed", "command", "percept"}
    for name in VECTORS:
        before, _, joint = name.partition(".")
        assert (told[name]["sense"], told[name]["label"]) == (before.partition("_")[0], joint)


def test_every_number_lands_in_its_column(record: Callable[[int], list[Path]]) -> None:
    """A frame is recorded as it was; in particular the head command is the reading's, and the percept is changed."""
    found = table(record(20)).to_pydict()
    for k in range(20):
        reading, percept = frame(k).reading, frame(k).percept
        row = {name: values[k] for name, values in found.items()}
        vectors = reading.arm, reading.head, reading.arm_command, reading.head_command, percept.arm, percept.head
        assert [row[name] for name in VECTORS] == np.concatenate(vectors).tolist()
        assert (row["frame"], row["phase"], row["time_s"]) == (k, int(k >= 10), k / 15)
        assert (row["hit"], row["overlap"]) == (k % 3 != 0, k % 2 == 0)
        assert (row["arm_winner"], row["arm_distance"]) == (k, k / 7)
        if percept.sighting is not None:
            seen = percept.sighting
            assert (row["pixel_u"], row["pixel_v"], row["tag"], row["tag_area"]) == (*seen.pixel, seen.tag, seen.area)


def test_a_miss_is_nan_and_minus_one(record: Callable[[int], list[Path]]) -> None:
    """Pixel and area NaN, tag -1, exactly on misses; a gaze error without true poses is NaN; nothing is null."""
    found = table(record(20))
    missed = ~found["hit"].to_numpy()
    for name in ("pixel_u", "pixel_v", "tag_area"):
        assert np.array_equal(np.isnan(found[name].to_numpy()), missed)
    assert np.array_equal(found["tag"].to_numpy() == -1, missed)
    assert np.isnan(found["gaze_error_rad"].to_numpy()).all()
    assert all(column.null_count == 0 for column in found.columns)


def test_parts_hold_4500_frames_and_the_last_one_the_rest(record: Callable[[int], list[Path]]) -> None:
    """Whole parts of 5 minutes, then what is left; frames go on across the border and nothing is written aside."""
    parts = record(9100)
    assert [path.name for path in parts] == [f"part-0000{k}.parquet" for k in range(3)]
    assert [pq.read_metadata(path).num_rows for path in parts] == [4500, 4500, 100]
    assert table(parts)["arm_winner"].to_pylist() == list(range(9100))


@pytest.mark.parametrize(("frames", "parts"), [(0, 0), (1, 1), (4500, 1), (4501, 2)])
def test_no_part_without_frames(record: Callable[[int], list[Path]], frames: int, parts: int) -> None:
    """4,500 frames are one part, none are none."""
    assert len(record(frames)) == parts


def test_a_value_that_nobody_tells_is_named(tmp_path: Path) -> None:
    """The column was declared, and probes() leaves it out."""
    writer = a_recorder(tmp_path / "frames")
    with pytest.raises(ValueError, match="column 'arm_distance' is declared, but no probes"):
        writer(frame(0)._replace(probes={"arm_winner": 0}))


def test_a_part_is_five_minutes() -> None:
    """4,500 frames of 1/15 s, the paper's window."""
    assert recorder.PART_FRAMES / 15 == 300


def test_it_goes_on_where_it_stood(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From its state at any row: the same parts to the byte; what is younger than the state is deleted."""
    monkeypatch.setattr(recorder, "PART_FRAMES", 10)
    whole = tmp_path / "whole"
    writer = a_recorder(whole)
    take_down(writer, 0, 34)
    writer.close()
    expected = {path.name: path.read_bytes() for path in whole.iterdir()}
    assert len(expected) == 4
    for stop in (0, 1, 9, 10, 11, 30, 33, 34):
        folder = tmp_path / str(stop)
        writer = a_recorder(folder)
        take_down(writer, 0, stop)
        state = writer.state()
        take_down(writer, 70, 95)
        writer.close()
        writer = a_recorder(folder)
        writer.restore(state)
        assert len(list(folder.iterdir())) == stop // 10
        take_down(writer, stop, 34)
        writer.close()
        assert {path.name: path.read_bytes() for path in folder.iterdir()} == expected
