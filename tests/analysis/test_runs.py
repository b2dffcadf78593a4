"""Run folders open, also after a kill, and what cannot be read is named."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from somatopy.analysis import summarise
from somatopy.analysis.runs import RunFolderError, load_run


def test_description_and_frames(make_run: Any) -> None:
    """The description is the TOML as it stands, and frames come back in order over all parts."""
    hits = np.arange(25) % 3 == 0
    run = make_run(hits, part_frames=10)
    assert run.description["seed"] == 7
    assert [phase["frames"] for phase in run.description["phases"]] == [25]
    assert run.frames(["frame"])["frame"].to_pylist() == list(range(25))
    assert run.frames(["hit"])["hit"].to_pylist() == hits.tolist()


def test_columns_come_in_the_order_asked_for(make_run: Any) -> None:
    """Only the columns asked for are in the table, in that order; without a choice, all are."""
    run = make_run(np.ones(5))
    assert run.frames(["hit", "frame"]).column_names == ["hit", "frame"]
    assert tuple(run.frames().column_names) == run.columns == ("frame", "phase", "hit")


@pytest.mark.parametrize(
    ("start", "stop"), [(0, 25), (3, 7), (9, 11), (10, 20), (24, 99), (25, None), (40, 50), (7, 3)]
)
def test_a_range_equals_a_slice_of_all(make_run: Any, start: int, stop: int | None) -> None:
    """Frames start..stop are those of the whole run sliced, wherever the borders of parts lie."""
    run = make_run(np.ones(25), part_frames=10)
    assert run.frames(["frame"], start, stop)["frame"].to_pylist() == list(range(25))[start:stop]


def test_a_range_does_not_read_parts_outside(make_run: Any) -> None:
    """A part outside the range may even have damaged pages."""
    run = make_run(np.ones(3000), part_frames=1000, distances={"noise": np.random.default_rng(0).random(3000)})
    _scramble(run.parts[2])
    assert run.frames(["noise"], 0, 2000).num_rows == 2000


def test_negative_range_is_refused(make_run: Any) -> None:
    """Counting from the end is not offered, and said so."""
    with pytest.raises(ValueError, match=r"start = -1 and stop = None must not be negative"):
        make_run(np.ones(3)).frames(["hit"], start=-1)


ASIDES = (".part-00004.parquet.12-0a1b2c3d.partial", "part-00004.parquet.partial", "part-00004.partial")


@pytest.mark.parametrize("aside", ASIDES)
def test_killed_run_gives_its_finished_parts(make_run: Any, aside: str) -> None:
    """What a crash left aside in frames/ is ignored, however damaged, by whichever version it was written."""
    run = make_run(np.ones(100), part_frames=10, recorded=40)
    (run.path / "frames" / aside).write_bytes(b"PAR1 half a part")
    assert run.frames(["hit"]).num_rows == 40


@pytest.mark.parametrize("aside", [".{}.12-0a1b2c3d.partial", "{}.partial"])
def test_what_a_crash_left_aside_is_not_read(rich_copy: Any, aside: str) -> None:
    """Half a summary, cost, ceiling or snapshot under another name changes nothing."""
    before = rich_copy.summary, rich_copy.cost, rich_copy.ceiling, rich_copy.snapshots, list(rich_copy.controls)
    for name in ("summary.json", "cost.json", "ceiling.json", "maps/window-00099.npz", "controls/late"):
        path = rich_copy.path / name
        path.with_name(aside.format(path.name)).write_bytes(b"{ half")
    again = load_run(rich_copy.path)
    assert (again.summary, again.cost, again.ceiling, again.snapshots, list(again.controls)) == before


def test_run_killed_before_its_first_part(make_run: Any) -> None:
    """A run without frames is a run: no rows, no columns, no summary, no cost."""
    run = make_run(np.ones(100), recorded=0)
    assert (run.frames(["hit"]).num_rows, run.columns, run.summary, run.cost) == (0, (), None, None)


def test_summary_and_cost_are_read(make_run: Any) -> None:
    """Both are what their JSON says, as of now."""
    run = make_run(np.ones(3))
    (run.path / "summary.json").write_text(json.dumps({"seed": 7}))
    (run.path / "cost.json").write_text(json.dumps({"wall_s": 1.5}))
    assert (run.summary, run.cost) == ({"seed": 7}, {"wall_s": 1.5})


def test_no_such_folder(tmp_path: Path) -> None:
    """A path that is not a folder is named, with what to give instead."""
    with pytest.raises(RunFolderError, match=r"nowhere is not a folder. Give the path of a run folder"):
        load_run(tmp_path / "nowhere")


def test_folder_of_runs_is_not_a_run(make_run: Any, tmp_path: Path) -> None:
    """A folder without experiment.toml is refused, and the runs inside it are listed."""
    make_run(np.ones(3), folder="first")
    with pytest.raises(RunFolderError, match=r"holds no experiment.toml. Run folders inside it: first\.$"):
        load_run(tmp_path)


def test_broken_description(make_run: Any) -> None:
    """A description that is not TOML is named with the place of the error."""
    run = make_run(np.ones(3))
    (run.path / "experiment.toml").write_text("seed = = 3")
    with pytest.raises(RunFolderError, match=r"experiment\.toml is not valid TOML \(.*line 1.*\)"):
        load_run(run.path)


@pytest.mark.parametrize("content", [b"", b"not a parquet file", b"PAR1" + bytes(64) + b"PAR1"])
def test_damaged_part_is_named(make_run: Any, content: bytes) -> None:
    """A part that is no Parquet file is named, with three ways on."""
    run = make_run(np.ones(30), part_frames=10)
    run.parts[1].write_bytes(content)
    with pytest.raises(RunFolderError, match=r"part-00001\.parquet is damaged \(.*\)\. Restore .* move .* run the exp"):
        run.frames(["hit"])


def test_truncated_part_is_named(make_run: Any) -> None:
    """Half a file is damaged, too."""
    run = make_run(np.ones(30), part_frames=10)
    run.parts[2].write_bytes(run.parts[2].read_bytes()[:-20])
    with pytest.raises(RunFolderError, match=r"part-00002\.parquet is damaged"):
        run.frames(["hit"])


def test_missing_part_is_named(make_run: Any) -> None:
    """A gap would shift every window behind it, so it is an error and not a shorter run."""
    run = make_run(np.ones(30), part_frames=10)
    run.parts[1].unlink()
    with pytest.raises(RunFolderError, match=r"lacks part-00001\.parquet although part-00002\.parquet is there"):
        run.frames(["hit"])


def test_unknown_column_lists_the_known(make_run: Any) -> None:
    """A column that was not recorded is named, and those that were are listed."""
    with pytest.raises(RunFolderError, match=r"has no column 'hits'. Its columns: frame, phase, hit\."):
        make_run(np.ones(3)).frames(["hits"])


def test_postures_are_told_by_metadata_alone(make_run: Any, vector_columns: Any) -> None:
    """Each role gives its own vector, whatever the joints are called and in whichever order the columns stand."""
    joints = ("arm_command.x", "percept", "head.yaw_rad")
    values = {role: np.random.default_rng(k).random((25, 3)) for k, role in enumerate(("sensed", "command", "percept"))}
    columns: dict[str, Any] = {}
    for role in ("percept", "command", "sensed"):
        columns |= vector_columns("arm", joints, values[role], role)
    columns |= vector_columns("head", ["arm"], np.zeros((25, 1)), unit="m")
    run = make_run(np.ones(25), distances=columns, part_frames=10)
    for role, expected in values.items():
        np.testing.assert_array_equal(run.postures("arm", role), expected)
        np.testing.assert_array_equal(run.postures("arm", role=role, start=7, stop=21), expected[7:21])
        assert run.joints("arm", role) == joints and run.units("arm", role) == ("rad",) * 3
    assert run.postures("head").shape == (25, 1) and run.joints("head") == ("arm",) and run.units("head") == ("m",)
    assert run.postures("arm", start=99).shape == (0, 3)


def test_units_are_those_of_the_metadata(make_run: Any) -> None:
    """A column's unit is what it says; a column without one, and one that is not there, have none."""
    columns = {"arm_distance": (np.ones(3), {"unit": "rad"}), "mine": np.ones(3)}
    run = make_run(np.ones(3), distances=columns)
    assert [run.unit(name) for name in ("arm_distance", "mine", "nowhere")] == ["rad", "", ""]


def test_a_vector_that_was_not_recorded_is_named(rich_run: Any) -> None:
    """Sense and role are named, and the vectors that there are; before the first part there is nothing to miss."""
    there = r"Those it has: arm \(sensed, command, percept\), head \(sensed, command\)\.$"
    with pytest.raises(RunFolderError, match=rf"has no sensed vector of the sense 'leg'\. {there}"):
        rich_run.postures("leg")
    with pytest.raises(RunFolderError, match=rf"has no percept vector of the sense 'head'\. {there}"):
        rich_run.postures("head", "percept")
    assert rich_run.joints("leg") == ()


def test_postures_before_the_first_part_are_empty(make_run: Any) -> None:
    """A run killed at once has no joints and no postures."""
    run = make_run(np.ones(100), recorded=0)
    assert run.postures("arm").shape == (0, 0) and run.joints("arm") == ()


@pytest.mark.parametrize(("line", "what"), [("", "an older format"), ("format = 3\n", "format 3")])
def test_other_formats_open_but_are_not_analysed(make_run: Any, line: str, what: str) -> None:
    """Frames can be read; postures and summary are refused in one sentence that says what to do."""
    run = make_run(np.ones(3))
    text = (run.path / "experiment.toml").read_text().replace("format = 2\n", line)
    (run.path / "experiment.toml").write_text(text + '[versions]\nsomatopy = "0.9.1"\n')
    other = load_run(run.path)
    assert other.frames(["hit"]).num_rows == 3
    told = rf"was recorded in {what}, and .* reads format 2: use the version that recorded it \(0\.9\.1\), or run its"
    for ask in (lambda: other.postures("arm"), lambda: other.joints("head"), lambda: summarise(other)):
        with pytest.raises(RunFolderError, match=told):
            ask()


def test_broken_summary_is_named(make_run: Any) -> None:
    """A summary that is not JSON is named, with what to do."""
    run = make_run(np.ones(3))
    (run.path / "summary.json").write_text("{")
    with pytest.raises(RunFolderError, match=r"summary\.json is not valid JSON .* Delete it"):
        _ = run.summary


def _scramble(part: Path) -> None:
    content = bytearray(part.read_bytes())
    content[4:2000] = bytes(1996)
    part.write_bytes(bytes(content))
