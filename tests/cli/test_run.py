"""somatopy run: a preset or a file into a run folder."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from somatopy.analysis import load_run
from somatopy.cli import main
from somatopy.cli.options import parse
from somatopy.experiment import load_description, paper
from somatopy.experiment.progress import robot_time

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
    assert load_description(out / "experiment.toml").phases[1].interventions == paper().phases[1].interventions


def test_json_is_one_object_of_summary_and_cost(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Exactly one JSON object on standard output, equal to what the folder holds; progress goes to standard error."""
    out = tmp_path / "out"
    assert main(["run", "paper", *QUICK, *SHORT, "--json", "--out", str(out)]) == 0
    text, err = capsys.readouterr()
    printed, run = json.loads(text), load_run(out)
    assert run.summary is not None
    assert printed == {"folder": str(out), "cost": run.cost, **run.summary}
    assert all(phase["efficiency_per_window"] == [] for phase in printed["phases"]) and 0 < printed["ceiling_rate"] <= 1
    assert "frames/s" in err and "hits" in err


def test_what_a_part_prints_is_not_the_result(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Neither when its module is imported, nor while it runs or is asked: standard output stays one JSON object."""
    (tmp_path / "chatty.py").write_text("""
from somatopy.learners import FixedGaze
print("imported")

class Chatty(FixedGaze):
    def __init__(self, robot, rng):
        super().__init__([0.1, 0.1])

    def observe(self, percept):
        print("observed")

    def predict(self, arm):
        print("asked")
        return super().predict(arm)
""")
    monkeypatch.syspath_prepend(tmp_path)
    out = str(tmp_path / "out")
    assert main(["run", "paper", *QUICK[:4], *SHORT, "--learner", "chatty:Chatty", "--json", "--out", out]) == 0
    text, err = capsys.readouterr()
    assert json.loads(text)["learner"] == "chatty:Chatty" and "imported" in err and "observed" in err
    for verb in (["resume"], ["evaluate", "--postures", "3"]):
        assert main([*verb, out, "--json"]) == 0
        text, err = capsys.readouterr()
        assert json.loads(text) and ("asked" in err) == (verb[0] == "evaluate")


def test_a_run_folder_runs_again_to_the_same_bytes(tmp_path: Path) -> None:
    """`somatopy run <folder>` repeats it, by its experiment.toml or by its name alone; flags change the copy."""
    first, again, other = (tmp_path / name for name in ("first", "again", "other"))
    assert main(["run", "paper", *QUICK, *SHORT, "--out", str(first)]) == 0
    assert main(["run", str(first), "--out", str(again)]) == 0
    assert main(["run", str(first / "experiment.toml"), "--seed", "9", "--out", str(other)]) == 0
    for name in ("frames/part-00000.parquet", "summary.json", "experiment.toml"):
        assert (first / name).read_bytes() == (again / name).read_bytes() != (other / name).read_bytes()


def test_an_empty_folder_may_exist(tmp_path: Path) -> None:
    """--out names the run folder itself."""
    assert main(["run", "paper", *QUICK, *SHORT, "--out", str(tmp_path)]) == 0
    assert (tmp_path / "summary.json").is_file()


def test_a_run_without_frames_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """0 minutes in all: nothing is written, and it is said what to give."""
    for minutes in (["--minutes", "0"], ["--minutes", "0", "--damage-minutes", "0"]):
        assert main(["run", "paper", *QUICK, *minutes, "--out", str(tmp_path / "none")]) == 2
        assert "0 frames in all" in (said := capsys.readouterr().err) and "--minutes 5" in said
    assert not (tmp_path / "none").exists()


def test_robot_time_is_said_first_unless_quiet(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """In all and phase by phase, by number and name; with --quiet nothing is said, and a path printed."""
    assert robot_time(paper()) == "Robot time: 304.3 minutes (phase 1, intact: 197.6; phase 2, damaged: 106.7)."
    ten = parse(["--minutes", "10"], paper(), "", "").description
    assert robot_time(ten) == "Robot time: 10 minutes (phase 1, intact: 6.5; phase 2, damaged: 3.5)."
    one = parse(["--minutes", "1"], paper(), "", "").description
    assert robot_time(one).startswith("Robot time: 1 minute (")
    assert main(["run", "paper", *QUICK, *SHORT, "--out", str(tmp_path / "loud")]) == 0
    assert capsys.readouterr().err.startswith("Robot time: 0.07 minutes (phase 1, intact: 0.05; phase 2")
    assert main(["run", "paper", *QUICK, *SHORT, "--quiet", "--out", str(tmp_path / "quiet")]) == 0
    assert capsys.readouterr() == (f"{tmp_path / 'quiet'}\n", "")
    assert main(["resume", str(tmp_path / "quiet")]) == 0
    assert "is finished: all its 63 frames had been recorded" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["random", "fixed", "nearest", "sampled", "links-only"])
def test_controls_are_presets(name: str, tmp_path: Path) -> None:
    """Each by its name, with the same flags as the experiment itself."""
    out = tmp_path / name
    maps = MAPS if name in ("sampled", "links-only") else []
    assert (
        main(["run", f"paper-{name}", "--eye", "geometric", "--motion", "kinematic", *maps, *SHORT, "--out", str(out)])
        == 0
    )
    assert load_description(out / "experiment.toml").name == f"paper-{name}"
    assert load_run(out).frames(["frame"]).num_rows == 45 + 18


def test_all_that_a_run_leaves_behind(tmp_path: Path) -> None:
    """The folder's files, as documented; nothing is left aside."""
    out = tmp_path / "out"
    assert main(["run", "paper", *QUICK, *SHORT, "--out", str(out)]) == 0
    assert {str(path.relative_to(out)) for path in out.rglob("*") if path.is_file()} == {
        *["experiment.toml", "frames/part-00000.parquet", "checkpoint.npz", "phase-0.npz", "phase-1.npz", ".lock"],
        *["summary.json", "ceiling.json", "cost.json", "belief.npz", "sight.npz"],
    }
