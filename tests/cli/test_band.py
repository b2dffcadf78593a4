"""The band of reproduce: the same experiment under more seeds, in a process that ends with the run and can go on."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest

from somatopy.analysis import load_run
from somatopy.analysis.band import spread_of, verdict_rows, verdicts_of
from somatopy.analysis.cells import load_study
from somatopy.cli import main
from somatopy.cli.band import PLAN, Band
from somatopy.experiment import paper
from somatopy.experiment.changes import changed
from somatopy.studies.reading import load_plan, planned

ARGS = ["--eye", "geometric", "--motion", "kinematic", "--minutes", "0.2", "--damage-minutes", "0.1", "--seed", "4"]
SMALL = ["--learner.arm-map.shape", "6", "6", "--learner.head-map.shape", "6", "6"]

Captured = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What `reproduce --seeds 3` leaves."""
    out = tmp_path_factory.mktemp("reproduce") / "run"
    assert main(["reproduce", *ARGS, *SMALL, "--seeds", "3", "--out", str(out)]) == 0
    return out


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"eye": "geometric", "damage": "none", "minutes": 3},
        {"motion": "kinematic", "learner": "nearest", "babbling.range": "mechanical"},
        {"learner.arm_map.kind": "som", "phases.1.plastic": [], "learner.rule": "normalised", "body.head_speed": 0.3},
        {"damage": "offset:0.1,0.2,0.3,0.4", "phases.0.frames": 77, "control": "frozen"},
    ],
)
def test_the_plan_is_the_experiment_itself(changes: dict[str, Any], tmp_path: Path) -> None:
    """Whatever it is, read from its file again: with the geometric eye, and as long; its own seed comes last."""
    description = changed(paper().replaced(seed=7), changes)
    Band.planned(tmp_path, description, 3)
    (condition,) = planned(load_plan(tmp_path / PLAN)).conditions
    assert condition.seeds == (8, 9, 7)
    geometric = changed(description, {"eye": "geometric"})
    assert condition.experiment.replaced(seed=7, name="run") == geometric.replaced(name="run")


def test_one_seed_is_no_band(tmp_path: Path) -> None:
    """Nothing is planned, nothing runs, and waiting takes no time."""
    with Band.planned(tmp_path, paper(), 1) as band:
        assert band.wait() and not [*tmp_path.iterdir()]


def test_reproduce_leaves_a_band(folder: Path) -> None:
    """Three seeds of the shortened length, geometric; the run's own seed gives what the run itself gave."""
    result = load_study(folder / "band")
    (name,) = result.conditions
    assert {*result.values(name, "frames")} == {4, 5, 6}
    assert {*result.values(name, "frames").values()} == {180} and {*result.values(name, "frames", 1).values()} == {90}
    assert {*result.table["eye"].to_pylist()} == {"geometric"}
    phases = json.loads((folder / "summary.json").read_text())["phases"]
    assert [result.values(name, "hits", k)[4] for k in (0, 1)] == [phase["hits"] for phase in phases]
    assert not (folder / "band.log").exists()
    assert 'id="over-seeds"' in (folder / "report.html").read_text()


def test_resume_completes_a_band(folder: Path, capsys: Captured) -> None:
    """Of a band that was killed after one seed: the others run, the same rows come of it, and the table is printed."""
    cells = folder / "band" / "cells.parquet"
    before = pq.read_table(cells)
    pq.write_table(before.filter(pc.field("seed") == 5), cells)
    assert main(["resume", str(folder)]) == 0
    after = pq.read_table(cells)
    costs = ["wall_s", "cpu_s", "peak_memory_bytes", "finished", "learner_us"]
    assert after.drop_columns(costs) == before.drop_columns(costs)
    printed = capsys.readouterr().out
    assert "over 3 seeds, geometric eye" in printed and re.search(r"^learns .* cannot tell$", printed, re.MULTILINE)


def test_a_band_that_fails_leaves_the_report(folder: Path, capsys: Captured) -> None:
    """The report is written all the same; it is said where to read why, and what to do."""
    plan = (folder / PLAN).read_text()
    (folder / PLAN).write_text("sedes = 3\n" + plan)
    (folder / "report.html").unlink()
    assert main(["resume", str(folder)]) == 1
    said = capsys.readouterr().err
    log = folder / "band.log"
    assert f"The band of seeds failed: {log} says why. Try again: somatopy resume {folder}" in said
    assert "A study has no key 'sedes'" in log.read_text() and (folder / "report.html").exists()
    (folder / PLAN).write_text(plan)
    log.unlink()


def test_a_band_ends_with_its_run(tmp_path: Path) -> None:
    """An error in the run, or Ctrl-C, ends it; so does a kill, which can tell it nothing."""
    description = changed(paper(), {"motion": "kinematic", "minutes": 200})
    with pytest.raises(KeyboardInterrupt), Band.planned(tmp_path, description, 2) as band:
        raise KeyboardInterrupt
    assert band._process is not None and band._process.poll() is not None
    script = (
        "import sys, time; from pathlib import Path; from somatopy.cli.band import Band\n"
        "with Band(Path(sys.argv[1])) as band:\n    print(band._process.pid, flush=True); time.sleep(600)\n"
    )
    with subprocess.Popen([sys.executable, "-c", script, str(tmp_path)], stdout=subprocess.PIPE, text=True) as run:
        assert run.stdout is not None
        pid = int(run.stdout.readline())
        os.kill(run.pid, signal.SIGKILL)
    until = time.monotonic() + 60
    with suppress(ProcessLookupError):
        while time.monotonic() < until:
            os.kill(pid, 0)
            time.sleep(0.2)
        os.kill(pid, signal.SIGKILL)
        pytest.fail("The band went on without its run.")


def test_the_spread_reaches_from_the_lowest_to_the_highest_seed(folder: Path) -> None:
    """A band that is too short for a window has none, and its verdicts cannot tell; nor has a run without a band."""
    run = load_run(folder)
    assert spread_of(run) is None
    rows = verdict_rows(verdicts_of(run))
    assert rows and {row["verdict"] for row in rows if row["ours"] == "too short"} == {"cannot tell"}
    control = load_run(folder / "controls" / "random")
    assert spread_of(control) is None and verdicts_of(control) == []
