"""somatopy reproduce: the paper from end to end, shortened."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from somatopy.analysis.claims import CLAIMS
from somatopy.cli import main
from somatopy.experiment import Session

SMALL = ["--learner.arm-map.shape", "10", "10", "--learner.head-map.shape", "10", "10"]
SUMMARY = {"seed", "eye", "motion", "learner", "ceiling_rate", "reactive_rate", "phases"}
PHASE = {
    "damage", "frames", "hits", "rate", "hits_per_window", "efficiency_per_window", "trends",
    "arm_distortion", "head_distortion",
}  # fmt: skip


@pytest.mark.gl
def test_end_to_end(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Physics, pictures, detector, learner, damage, analysis: table beside the paper's numbers, figure, summary."""
    out = tmp_path / "run"
    assert (
        main(["reproduce", "--minutes", "0.2", "--damage-minutes", "0.1", "--seeds", "1", *SMALL, "--out", str(out)])
        == 0
    )
    printed, said = capsys.readouterr()
    assert "paper" in printed.splitlines()[0] and "this run" in printed.splitlines()[0]
    assert "177,823" in printed and "+12.147" in printed and "-80.286" in printed
    assert "180" in printed and "90" in printed
    assert str(out) in said and str(out / "report.html") in said
    for name in ("figure3.png", "figure3.svg"):
        assert (out / "figures" / name).stat().st_size > 1000
    summary = json.loads((out / "summary.json").read_text())
    assert set(summary) == SUMMARY
    assert [summary[key] for key in ("seed", "eye", "motion", "learner")] == [0, "fiducial", "dynamic", "hebbian"]
    assert [(phase["damage"], phase["frames"]) for phase in summary["phases"]] == [("none", 180), ("offset", 90)]
    assert all(set(phase) == PHASE for phase in summary["phases"])
    for name in ("random", "fixed", "frozen"):
        beside = json.loads((out / "controls" / name / "summary.json").read_text())
        assert (beside["seed"], beside["eye"], beside["motion"]) == (0, "geometric", "dynamic")
        assert [phase["frames"] for phase in beside["phases"]] == [180, 90]
    assert (out / "report.html").stat().st_size > 100_000
    assert {"wall_s", "frames_per_s", "peak_memory_bytes"} <= json.loads((out / "cost.json").read_text()).keys()


def test_json_replaces_the_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One JSON object on standard output and nothing else; the figure is drawn all the same."""
    out = tmp_path / "run"
    args = [
        "--eye",
        "geometric",
        "--motion",
        "kinematic",
        "--minutes",
        "0.1",
        "--damage-minutes",
        "0",
        "--seeds",
        "1",
        *SMALL,
    ]
    assert main(["reproduce", *args, "--json", "--out", str(out)]) == 0
    table = json.loads(capsys.readouterr().out)
    assert set(table) == SUMMARY | {"folder", "cost", "controls", "claims"}
    for name in ("random", "fixed", "frozen"):
        assert table["controls"][name] == json.loads((out / "controls" / name / "summary.json").read_text())
    assert set(table["claims"]) == {claim.key for claim in CLAIMS}
    assert (out / "figures" / "figure3.png").is_file()


def test_what_fails_before_its_first_frame_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """No folder that is "not empty" at the next try."""

    def failing(self: Session) -> None:
        raise ZeroDivisionError("by zero")

    monkeypatch.setattr(Session, "__next__", failing)
    for verb in (["reproduce"], ["run", "paper"]):
        assert main([*verb, "--eye", "geometric", "--motion", "kinematic", "--out", str(tmp_path / "run")]) == 1
        assert (
            "somatopy: ZeroDivisionError: by zero (where: --debug). This came after 0 frames" in capsys.readouterr().err
        )
        assert not (tmp_path / "run").exists()


def test_an_interrupted_reproduction_is_brought_to_its_end(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Stopped in the middle of a control, `resume` gives the same controls and table as an unbroken one."""
    args = [
        "--eye",
        "geometric",
        "--motion",
        "kinematic",
        "--minutes",
        "0.2",
        "--damage-minutes",
        "0.1",
        "--seeds",
        "1",
        *SMALL,
    ]
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    assert main(["reproduce", *args, "--out", str(whole)]) == 0
    table = capsys.readouterr().out
    shutil.copytree(whole, broken)
    shutil.rmtree(broken / "controls" / "frozen")
    for left in ("summary.json", "ceiling.json"):
        (broken / "controls" / "fixed" / left).unlink()
    (broken / "controls" / "frozen").mkdir()
    capsys.readouterr()
    assert main(["resume", str(broken)]) == 0
    assert capsys.readouterr().out == table
    for name in ("random", "fixed", "frozen"):
        part = Path("controls", name, "frames", "part-00000.parquet")
        assert (whole / part).read_bytes() == (broken / part).read_bytes()
