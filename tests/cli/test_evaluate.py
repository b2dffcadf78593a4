"""somatopy evaluate: what a run has learned, for eyes and for programs."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from somatopy.cli import main
from somatopy.experiment import session
from somatopy.experiment.evaluate import evaluate
from somatopy.experiment.run_folder import CHECKPOINT

QUICK = ["--eye", "geometric", "--motion", "kinematic", "--minutes", "0.2", "--damage-minutes", "0.1"]
MAPS = ["--learner.arm-map.shape", "8", "8", "--learner.head-map.shape", "8", "8"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("runs") / "run"
    assert main(["run", "paper", *QUICK, *MAPS, "--out", str(path)]) == 0
    return path


def test_json_is_one_object(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Exactly what `evaluate` says, of as many postures as asked; the run folder stays as it was."""
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    assert main(["evaluate", str(folder), "--postures", "120", "--json"]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out) == evaluate(folder, 120) and out.count("\n") == 1 and err == ""
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


def test_text_says_the_same(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Shares in percent, angles in degrees, how many postures and which eye."""
    assert main(["evaluate", str(folder), "--postures", "120"]) == 0
    text, result = capsys.readouterr().out, evaluate(folder, 120)
    for words in (
        "120 arm postures",
        "learning off",
        "damage offset",
        "geometric eye",
        f"{result['rate']:.1%} of them",
        f"{result['efficiency']:.1%} of those that can be seen",
        f"{result['reachable']:.1%}",
        f"median {result['gaze_error_deg']['median']:.1f} degrees",
        f"95th percentile {result['gaze_error_deg']['p95']:.1f}",
    ):
        assert words in text


def test_where_nothing_can_be_seen_there_is_no_efficiency(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The text says n/a, the object null; a run is refused there, were it not for the patch."""
    monkeypatch.setattr(session, "require_sight", lambda *_: None)
    behind = ["--babbling.range", *["1.9", "2.0", "1.2", "1.3", "-0.1", "0.1", "-0.1", "-0.04"]]
    assert main(["run", "paper", *QUICK, *MAPS, *behind, "--out", str(tmp_path / "run")]) == 0
    capsys.readouterr()
    assert main(["evaluate", str(tmp_path / "run"), "--postures", "30"]) == 0
    assert "0.0% of them, n/a of those" in capsys.readouterr().out
    assert main(["evaluate", str(tmp_path / "run"), "--postures", "30", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["efficiency"] is None


def test_what_cannot_be_asked_is_told_in_one_paragraph(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 2: no checkpoint, a broken one, no postures."""
    for name, content in (("none", None), ("broken", b"PK")):
        shutil.copytree(folder, tmp_path / name)
        (tmp_path / name / CHECKPOINT).unlink()
        if content is not None:
            (tmp_path / name / CHECKPOINT).write_bytes(content)
    capsys.readouterr()
    for args, words in (
        ([str(tmp_path / "none")], [f"has no {CHECKPOINT}", "nothing was changed"]),
        ([str(tmp_path / "broken")], [CHECKPOINT, "no checkpoint that can be read"]),
        ([str(folder), "--postures", "0"], ["At least one posture", "not 0"]),
    ):
        assert main(["evaluate", *args]) == 2
        out, err = capsys.readouterr()
        assert out == "" and err.startswith("somatopy: ") and err.count("\n") == 1
        assert all(word in err for word in words), err
