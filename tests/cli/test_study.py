"""somatopy study: a file becomes a folder with a table."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from somatopy.analysis.cells import CELLS
from somatopy.cli import main

FILE = """
seed = 3
ceilings = false
[every]
motion = "kinematic"
minutes = 0.2
damage_minutes = 0.1
learner.arm_map.shape = [5, 5]
learner.head_map.shape = [5, 5]
[grid]
damage = ["none", "paper"]
"""

SEARCH = """
[search]
loss = "losses_for_cli:flat"
trials = 2
[search.space]
babbling.speed = { low = 0.2, high = 0.8 }
"""

Captured = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the file stands, and the study that it describes."""
    path = tmp_path_factory.mktemp("study")
    (path / "file.toml").write_text(FILE, encoding="utf-8")
    assert main(["study", str(path / "file.toml"), "--out", str(path / "out"), "--processes", "1"]) == 0
    return path


def test_a_study_that_has_ended_is_told_again(folder: Path, capsys: Captured) -> None:
    """Nothing runs; the comparison is printed, the rest goes to standard error, the eye is said."""
    capsys.readouterr()
    before = (folder / "out" / CELLS).read_bytes()
    args = ["study", str(folder / "file.toml"), "--out", str(folder / "out")]
    assert main(args) == 0
    printed = capsys.readouterr()
    assert "damage none" in printed.out and "hand seen" in printed.out
    assert printed.err.startswith("Eye: geometric, a model of the detector. With --eye fiducial")
    assert f"Table of all cells: {folder / 'out' / CELLS}" in printed.err
    assert main([*args, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert {*found} == {"folder", "cells", "failures"} and found["failures"] == []
    assert [(row["damage"], row["seed"], row["phase"]) for row in found["cells"]] == [
        *(("none", 3, 0), ("none", 3, 1)),
        *(("none", 3, 0), ("offset", 3, 1)),
    ]
    assert pq.read_table(folder / "out" / CELLS).to_pylist() == found["cells"]
    assert (folder / "out" / CELLS).read_bytes() == before


def test_a_check_runs_a_sample_again(folder: Path, capsys: Captured) -> None:
    """Exit 0 if it gives the same, 1 if not; in words or as JSON."""
    capsys.readouterr()
    args = ["study", str(folder / "file.toml"), "--out", str(folder / "out"), "--check", "--processes", "1"]
    assert main(args) == 0
    said = capsys.readouterr().out
    assert said.count("equal bit for bit") == 2 and said.endswith("0 stale, 0 unfinished, 2 run again\n")


def test_a_check_that_finds_a_difference(folder: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch) -> None:
    """It ends with 1."""
    from somatopy.studies.recheck import Check, Rerun

    found = Check([("a", 1)], [], [Rerun("a", 1, {"hits": 2.0})])
    monkeypatch.setattr("somatopy.cli.study.recheck", lambda *_: found)
    args = ["study", str(folder / "file.toml"), "--out", str(folder / "out"), "--check"]
    assert main(args) == 1
    assert capsys.readouterr().out.splitlines()[:2] == ["stale: a, seed 1", "a, seed 1: differs: hits by up to 2"]
    assert main([*args, "--json"]) == 1
    assert json.loads(capsys.readouterr().out) == found.table()


def test_failures_are_named_and_end_with_1(folder: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each with its condition, seed and cause."""
    from somatopy.analysis.cells import StudyResult, load_study

    failure = {"condition": "a", "seed": 3, "key": "k", "cause": "ValueError: no"}
    whole = load_study(folder / "out")
    failed = StudyResult(whole.path, whole.table, [failure], whole.study)
    monkeypatch.setattr("somatopy.cli.study.perform", lambda *_, **__: failed)
    assert main(["study", str(folder / "file.toml")]) == 1
    assert "failed: a, seed 3: ValueError: no" in capsys.readouterr().err


def test_a_dry_run_runs_nothing(folder: Path, capsys: Captured) -> None:
    """It says cells, frames, hours, memory and disk."""
    args = ["study", str(folder / "file.toml"), "--out", str(folder / "new"), "--dry-run"]
    assert main(args) == 0
    said = dict(line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines())
    assert said["cells"] == "2" and said["frames"] == "360" and {"CPU", "wall", "memory", "disk"} <= {*said}
    assert main([*args, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["cells"] == 2
    assert not (folder / "new").exists()


@pytest.mark.parametrize(
    ("args", "said"),
    [
        (("none.toml",), "Cannot read the study none.toml: No such file or directory."),
        (("FILE", "--check"), "--check looks at a study folder: name it with --out."),
        (("FILE", "--check", "--out", "none"), "none is not the folder of a study that has run: it holds no cells."),
        (("FILE", "--processes", "0"), "--processes 0: at least one process must work."),
    ],
)
def test_wrong_use(
    args: tuple[str, ...],
    said: str,
    folder: Path,
    tmp_path: Path,
    capsys: Captured,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Exit 2, and one sentence."""
    monkeypatch.chdir(tmp_path)
    capsys.readouterr()
    assert main(["study", *(str(folder / "file.toml") if arg == "FILE" else arg for arg in args)]) == 2
    assert f"somatopy: {said}" in capsys.readouterr().err


def test_a_search_is_told(tmp_path: Path, capsys: Captured) -> None:
    """Where it is and where its losses are; what it cannot do is refused before anything runs."""
    sought = FILE.replace("damage_minutes = 0.1", "damage_minutes = 0").partition("[grid]")[0] + SEARCH
    (tmp_path / "search.toml").write_text(sought, encoding="utf-8")
    (tmp_path / "losses_for_cli.py").write_text("def flat(result, condition):\n    return 0.5\n", encoding="utf-8")
    args = ["study", str(tmp_path / "search.toml"), "--out", str(tmp_path / "out"), "--processes", "1"]
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path)
        patch.setattr("sys.path", [*sys.path])
        for flag in ("--check", "--dry-run"):
            assert main([*args, flag]) == 2
            assert "neither --check nor --dry-run" in capsys.readouterr().err
        assert main(args) == 0
    printed = capsys.readouterr()
    assert printed.out == f"{tmp_path / 'out'}\n"
    assert f"Loss of each proposal: {tmp_path / 'out' / 'losses.json'}" in printed.err
    losses = json.loads((tmp_path / "out" / "losses.json").read_text())
    assert losses == {"loss": "losses_for_cli:flat", "losses": {"trial 000": 0.5, "trial 001": 0.5}}
