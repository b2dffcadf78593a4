"""somatopy run: a preset or a file into a run folder."""

from __future__ import annotations

import json
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
