"""An experiment of which every part is of one's own, run from the folder that holds it, in processes of its own."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from somatopy import check_babbler, check_body, check_eye, check_intervention, check_learner, load_run
from somatopy.experiment import DescriptionError, load_description

EXAMPLE = Path(__file__).parents[1] / "examples" / "own_parts"
FILE = "own_parts.toml"
#: One part of frames and a rest, which are long enough to be killed in between.
FRAMES = ("--phases.0.frames", "4800", "--phases.1.frames", "600")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the example."""
    copy = tmp_path_factory.mktemp("own") / "mine"
    shutil.copytree(EXAMPLE, copy, ignore=shutil.ignore_patterns("__pycache__", "runs"))
    return copy


def command(*args: str) -> list[str]:
    return [sys.executable, "-c", "import sys; from somatopy.cli import main; sys.exit(main())", *args]


def somatopy(folder: Path, *args: str) -> Any:
    """What a command in the folder prints as JSON."""
    done = subprocess.run(command(*args, "--json"), cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def whole(folder: Path) -> Path:
    """A run that nobody disturbed."""
    somatopy(folder, "run", FILE, *FRAMES, "--out", "whole")
    return folder / "whole"


def parts_of(run: Path) -> list[bytes]:
    return [file.read_bytes() for file in sorted((run / "frames").iterdir())]


def test_a_killed_run_is_resumed_to_the_byte(folder: Path, whole: Path) -> None:
    """Killed in mid-run, resumed by its folder alone: the same frames, the same summary."""
    process = subprocess.Popen(
        command("run", FILE, *FRAMES, "--out", "killed"), cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    )
    try:
        while not (folder / "killed" / "frames" / "part-00000.parquet").exists():
            assert process.poll() is None, "the run ended too early"
            time.sleep(0.005)
    finally:
        process.kill()
        process.communicate()
    assert not (folder / "killed" / "summary.json").exists()
    summary = somatopy(folder, "resume", "killed")
    assert parts_of(folder / "killed") == parts_of(whole)
    assert (folder / "killed" / "summary.json").read_bytes() == (whole / "summary.json").read_bytes()
    assert [phase["frames"] for phase in summary["phases"]] == [4800, 600]


def test_it_is_evaluated_and_reported(folder: Path, whole: Path) -> None:
    """Like a run of ours: its ceiling, its damage by the name of its place, its page."""
    found = somatopy(folder, "evaluate", "whole", "--postures", "50")
    assert found["damage"] == "planar.drowsy:Drowsy" and found["reachable"] > 0.9
    page = somatopy(folder, "report", "whole")
    assert (folder / page["report"]).is_file()


def test_the_report_imports_no_part(folder: Path, whole: Path, tmp_path: Path) -> None:
    """A folder that has travelled to where nobody knows the parts is opened and reported all the same."""
    travelled = tmp_path / "elsewhere"
    shutil.copytree(whole, travelled)
    somatopy(tmp_path, "report", "elsewhere")
    run = load_run(travelled)
    assert run.description["body"]["kind"] == "planar.body:PlanarArm"
    assert run.joints("arm") == ("shoulder", "elbow") and run.postures("arm").shape == (5400, 2)
    with pytest.raises(DescriptionError, match=r"body.kind = 'planar.body:PlanarArm' cannot be imported"):
        load_description(travelled / "experiment.toml")


def test_what_the_parts_record_is_in_the_frames(whole: Path) -> None:
    """The eye's column, with its unit; the drowsy head obeys late, and only in its phase."""
    run = load_run(whole)
    table = run.frames(["off_axis_deg", "hit", "phase"])
    assert run.unit("off_axis_deg") == "deg"
    seen = table["hit"].to_numpy()
    assert np.array_equal(seen, table["off_axis_deg"].to_numpy() <= 20.0)
    rates = [seen[table["phase"].to_numpy() == phase].mean() for phase in (0, 1)]
    assert rates[0] > 0.5 > 0 and rates[1] < rates[0]


def test_settings_are_flags_and_show_in_the_help(folder: Path) -> None:
    """Also of parts that somatopy does not know."""
    for flag in ("--body.upper-arm", "--learner.forgetting"):
        table = flag[2:].partition(".")[0]
        asked = command("run", FILE, "--help", table)
        assert flag in subprocess.run(asked, cwd=folder, capture_output=True, text=True, check=True).stdout
    summary = somatopy(
        folder, "run", FILE, "--phases.0.frames", "3", "--phases.1.frames", "0", "--eye.angle", "180", "--out", "wide"
    )
    assert summary["phases"][0]["hits"] == 3


def test_every_part_keeps_its_contract(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The checks that we ship are silent about all five."""
    monkeypatch.syspath_prepend(str(folder))
    from planar.babbler import Waves  # type: ignore[import-not-found]
    from planar.body import PlanarArm  # type: ignore[import-not-found]
    from planar.drowsy import Drowsy  # type: ignore[import-not-found]
    from planar.eye import Cone  # type: ignore[import-not-found]
    from planar.learner import QuadraticGaze  # type: ignore[import-not-found]

    body = PlanarArm()
    check_body(PlanarArm)
    check_babbler(lambda rng: Waves(body.arm, np.zeros(2), rng), body.arm.space.limits)
    check_learner(QuadraticGaze)
    check_intervention(Drowsy, PlanarArm)
    readings = [body.step([0.0, 1.0], [pan, 0.7]) for pan in np.linspace(-1.5, 1.5, 40)]
    check_eye(lambda: Cone(body), readings)
