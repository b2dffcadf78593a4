"""somatopy run: a preset or a file into a run folder, and Ctrl-C in the middle."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from somatopy.analysis import load_run
from somatopy.cli import main
from somatopy.experiment import load_description, paper

MAPS = ["--learner.arm-map.shape", "5", "5", "--learner.head-map.shape", "5", "5"]
QUICK = ["--eye", "geometric", "--motion", "kinematic", *MAPS]
SHORT = ["--minutes", "0.05", "--damage-minutes", "0.02"]


def test_a_preset_into_a_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Exit code 0; standard output is the folder's path alone; the folder has frames, summary, cost and description."""
    out = tmp_path / "out"
    assert main(["run", "paper", *QUICK, *SHORT, "--seed", "5", "--out", str(out)]) == 0
    assert capsys.readouterr().out == f"{out}\n"
    run = load_run(out)
    assert run.frames(["frame"]).num_rows == 45 + 18
    assert run.summary is not None and run.summary["seed"] == 5 and run.cost is not None
    assert load_description(out / "experiment.toml").phases[1].damage == paper().phases[1].damage


def test_json_is_one_object_of_summary_and_cost(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Exactly one JSON object on standard output, equal to what the folder holds; progress goes to standard error."""
    out = tmp_path / "out"
    assert main(["run", "paper", *QUICK, *SHORT, "--json", "--out", str(out)]) == 0
    text, err = capsys.readouterr()
    printed, run = json.loads(text), load_run(out)
    assert run.summary is not None
    assert printed == {"folder": str(out), "cost": run.cost, **run.summary}
    assert "frames/s" in err and "hits" in err


def test_the_description_of_a_run_runs_again_to_the_same_bytes(tmp_path: Path) -> None:
    """`somatopy run <folder>/experiment.toml` repeats it; flags change the copy."""
    first, again, other = (tmp_path / name for name in ("first", "again", "other"))
    assert main(["run", "paper", *QUICK, *SHORT, "--out", str(first)]) == 0
    source = str(first / "experiment.toml")
    assert main(["run", source, "--out", str(again)]) == 0
    assert main(["run", source, "--seed", "9", "--out", str(other)]) == 0
    for name in ("frames/part-00000.parquet", "summary.json", "experiment.toml"):
        assert (first / name).read_bytes() == (again / name).read_bytes() != (other / name).read_bytes()


def test_an_empty_folder_may_exist(tmp_path: Path) -> None:
    """--out names the run folder itself."""
    assert main(["run", "paper", *QUICK, *SHORT, "--out", str(tmp_path)]) == 0
    assert (tmp_path / "summary.json").is_file()


def test_a_run_without_frames(tmp_path: Path) -> None:
    """0 minutes are legal."""
    out = tmp_path / "none"
    assert main(["run", "paper", *QUICK, "--minutes", "0", "--damage-minutes", "0", "--out", str(out)]) == 0
    assert [phase["frames"] for phase in (load_run(out).summary or {})["phases"]] == [0, 0]


@pytest.mark.parametrize("eye", ["geometric", pytest.param("fiducial", marks=pytest.mark.gl)])
def test_ctrl_c_keeps_every_frame_until_then(tmp_path: Path, eye: str) -> None:
    """SIGINT to the real command: exit code 130, no traceback, it says where the data is, and all rows are there."""
    out = tmp_path / ("a rather long folder name [with brackets] " * 3).strip()
    command = [sys.executable, "-c", "from somatopy.cli import main; raise SystemExit(main())"]
    args = ["run", "paper", *QUICK, "--eye", eye, "--out", str(out)]
    process = subprocess.Popen([*command, *args], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while not (out / "experiment.toml").exists():
        assert process.poll() is None, process.communicate()
        time.sleep(0.02)
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    printed, said = process.communicate(timeout=60)
    assert process.returncode == 130 and printed == "" and "Traceback" not in said
    assert str(out) in said
    count = int(re.findall(r"Interrupted after (\d+) frames", said)[0])
    run = load_run(out)
    assert count > 0 and run.frames(["frame"])["frame"].to_pylist() == list(range(count))
    assert run.cost is not None and run.cost["frames"] == count
