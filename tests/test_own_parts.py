"""An experiment of which every part is of one's own, run from the folder that holds it.

It is killed and resumed in processes of its own. All else is asked for in this one, which finds the parts in the folder
and has forgotten them when the test ends.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from somatopy import check_babbler, check_body, check_eye, check_intervention, check_learner, load_run
from somatopy.cli import main
from somatopy.experiment import DescriptionError, load_description, recorder, run_writer

EXAMPLE = Path(__file__).parents[1] / "examples" / "own_parts"
FILE = "own_parts.toml"
#: Three parts of frames, which are long enough to be killed after the first.
PART, INTACT, DROWSY = 800, 1800, 600
FRAMES = ("--phases.0.frames", f"{INTACT}", "--phases.1.frames", f"{DROWSY}")
#: The command with small parts.
COMMAND = f"""
import sys
from somatopy.cli import main
from somatopy.experiment import recorder, run_writer
run_writer.PART_FRAMES = recorder.PART_FRAMES = {PART}
sys.exit(main())
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the example."""
    copy = tmp_path_factory.mktemp("own") / "mine"
    shutil.copytree(EXAMPLE, copy, ignore=shutil.ignore_patterns("__pycache__", "runs"))
    return copy


def command(*args: str) -> list[str]:
    return [sys.executable, "-c", COMMAND, *args]


def in_a_process(folder: Path, *args: str) -> Any:
    """What a command in the folder prints as JSON, in a process that has met none of the parts."""
    done = subprocess.run(command(*args, "--json"), cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@contextmanager
def standing_in(folder: Path) -> Iterator[None]:
    """As if this process had begun in the folder, with small parts; its modules are forgotten afterwards."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr("sys.path", [*sys.path])
        for module in (run_writer, recorder):
            patch.setattr(module, "PART_FRAMES", PART)
        try:
            yield
        finally:
            for name in [name for name in sys.modules if name.partition(".")[0] == "planar"]:
                del sys.modules[name]


def printed(folder: Path, *args: str) -> str:
    """What a command in the folder prints."""
    with standing_in(folder), redirect_stdout(StringIO()) as out:
        assert main(args) == 0
    return out.getvalue()


def somatopy(folder: Path, *args: str) -> Any:
    """What a command in the folder prints as JSON."""
    return json.loads(printed(folder, *args, "--json"))


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
    summary = in_a_process(folder, "resume", "killed")
    assert parts_of(folder / "killed") == parts_of(whole) and len(parts_of(whole)) == 3
    assert (folder / "killed" / "summary.json").read_bytes() == (whole / "summary.json").read_bytes()
    assert [phase["frames"] for phase in summary["phases"]] == [INTACT, DROWSY]


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
    in_a_process(tmp_path, "report", "elsewhere")
    run = load_run(travelled)
    assert run.description["body"]["kind"] == "planar.body:PlanarArm"
    assert run.joints("arm") == ("shoulder", "elbow") and run.postures("arm").shape == (INTACT + DROWSY, 2)
    with pytest.raises(DescriptionError, match=r"body.kind = 'planar.body:PlanarArm' cannot be imported"):
        load_description(travelled / "experiment.toml")


def test_what_the_parts_record_is_in_the_frames(whole: Path) -> None:
    """The eye's column, with its unit; the drowsy head obeys late, and only in its phase."""
    run = load_run(whole)
    table = run.frames(["off_axis_deg", "hit", "phase"])
    assert run.unit("off_axis_deg") == "deg"
    seen = table["hit"].to_numpy()
    assert np.array_equal(seen, table["off_axis_deg"].to_numpy() <= 20.0)
    intact, drowsy = (seen[table["phase"].to_numpy() == phase] for phase in (0, 1))
    learned = intact[INTACT // 2 :].mean()
    assert learned > 0.5 and drowsy.mean() < learned


def test_settings_are_flags_and_show_in_the_help(folder: Path) -> None:
    """Also of parts that somatopy does not know."""
    for flag in ("--body.upper-arm", "--learner.forgetting"):
        table = flag[2:].partition(".")[0]
        assert flag in printed(folder, "run", FILE, "--help", table)
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
