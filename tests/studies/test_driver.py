"""Whole studies in processes: the same rows as plain runs, whatever happens to driver and workers in between."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import somatopy
from somatopy.analysis.cells import COSTS, StudyResult, load_study, measures
from somatopy.api import run
from somatopy.studies import Condition, Study, load_plan, planned
from somatopy.studies.driver import perform
from somatopy.studies.local import Outcome
from somatopy.studies.task import Task

DRIVE = """
import sys
from somatopy.cli import main
sys.exit(main())
"""
#: Two learners, a damage or none, two seeds; the learner of one's own is slow enough to be interrupted.
FILE = """
seeds = 2
ceilings = false
[every]
motion = "kinematic"
minutes = 1
damage_minutes = 0.5
learner = "{own}:Counted"
[grid]
damage = ["none", "paper"]
"""

Described = Callable[..., Any]


def told(result: StudyResult) -> list[dict[str, Any]]:
    """Rows without what they cost and without digests."""
    left_out = {column.name for column in COSTS}
    return [{k: v for k, v in row.items() if k not in left_out} for row in result.table.to_pylist()]


def measured(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    left_out = {"key", "description", "code", "condition"}
    return [{k: v for k, v in row.items() if k not in left_out} for row in rows]


def plain(one: Any, seed: int, folder: Path, **how: Any) -> list[dict[str, Any]]:
    return measures(run(one.replaced(seed=seed), folder, progress=False, maps=False, **how))


# -- the same as a plain run -------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def conditions(described: Described) -> dict[str, Any]:
    """Two that share their first phase, one that has the description of another, and one alone."""
    paper = described()
    return {"paper": paper, "none": described(damage="none"), "again": paper, "alone": described(babbling__speed=0.4)}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the study runs."""
    return tmp_path_factory.mktemp("study") / "s"


@pytest.fixture(scope="module")
def result(conditions: dict[str, Any], folder: Path) -> StudyResult:
    """The study, with one seed, in this machine's processes."""
    study = Study("s", tuple(Condition(name, one, (4,), {"x": name}) for name, one in conditions.items()))
    return perform(study, folder, processes=1, progress=False)


def test_rows_are_those_of_plain_runs(conditions: dict[str, Any], result: StudyResult, tmp_path: Path) -> None:
    """Forked from a first phase that they share, or run alone: every measure agrees to the last bit."""
    assert not result.failures and result.conditions == [*conditions]
    for name in ("paper", "none", "alone"):
        rows = [row for row in told(result) if row["condition"] == name]
        expected = plain(conditions[name], 4, tmp_path / name)
        assert measured(rows) == [{"x": name, **row} for row in expected]
    assert result.values("paper", "ceiling", 1)[4] > 0


def test_what_is_described_alike_runs_once_and_appears_twice(result: StudyResult) -> None:
    """Under both names, with all that it measured and cost."""
    rows = {name: [row for row in result.table.to_pylist() if row["condition"] == name] for name in ("paper", "again")}
    assert [{**row, "condition": "again", "x": "again"} for row in rows["paper"]] == rows["again"]
    assert len({row["key"] for row in result.table.to_pylist()}) == 3


def test_a_folder_holds_what_is_wanted_and_nothing_else(result: StudyResult) -> None:
    """No run folders, no journal."""
    there = {entry.name for entry in result.path.iterdir() if not entry.name.startswith(".")}
    assert there == {"cells.parquet", "study.toml", "failures.json"}


def test_other_names_and_new_seeds_run_only_what_is_new(
    result: StudyResult, conditions: dict[str, Any], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And rows that a study no longer has come back when it has them again."""
    before = told(result)
    asked = []

    class Asked:
        """Runs nothing, and notes what it should run."""

        capacity = 1

        def submit(self, task: Any) -> None:
            asked.append((task.experiment["seed"], task.training is not None))
            raise KeyboardInterrupt

        def next(self) -> Any:
            raise AssertionError

        def close(self) -> None:
            pass

    def performed(*conditions: Condition) -> StudyResult:
        return perform(Study("s", conditions), folder, progress=False, backend=lambda scratch: Asked())

    renamed = performed(Condition("renamed", conditions["paper"], (4,)))
    assert not asked and measured(told(renamed)) == measured(
        [{k: v for k, v in row.items() if k != "x"} for row in before if row["condition"] == "paper"]
    )
    with pytest.raises(somatopy.api.Interrupted, match="2 of 3 cells have ended, and are kept in"):
        performed(Condition("paper", conditions["paper"], (4, 5)), Condition("none", conditions["none"], (4,)))
    assert asked == [(5, False)]
    again = performed(*(Condition(name, one, (4,), {"x": name}) for name, one in conditions.items()))
    assert told(again) == before


def test_physics_with_a_stored_arm_and_a_shared_phase(described: Described, in_process: Any, tmp_path: Path) -> None:
    """Rows of dynamic runs are those of plain runs, too."""
    short = {"motion": "dynamic", "minutes": 0.2, "damage_minutes": 0.2}
    ones = {"paper": described(**short), "none": described(damage="none", **short)}
    study = Study("s", tuple(Condition(name, one, (1,)) for name, one in ones.items()), ceilings=False)
    result = perform(study, tmp_path / "s", backend=in_process, progress=False)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))  # no stored arm there
        expected = {name: plain(one, 1, tmp_path / name, ceiling=False) for name, one in ones.items()}
    for name in ones:
        assert measured([row for row in told(result) if row["condition"] == name]) == expected[name]


# -- cells that fail ---------------------------------------------------------------------------------------------------


def test_failing_cells_end_no_other_and_are_run_again(
    own: Path, described: Described, in_process: Any, tmp_path: Path
) -> None:
    """One raises, one ends its process, one is killed, one brings the interpreter down."""
    names = ("Leaves", "Killed", "Raises", "Counted", "Crashes")
    ones = {name: described(learner=f"{own.stem}:{name}", minutes=0.1, damage_minutes=0.1) for name in names}
    study = Study("s", tuple(Condition(name, one, (0,)) for name, one in ones.items()), ceilings=False)
    result = perform(study, tmp_path / "s", processes=1, progress=False)
    causes = {failure["condition"]: failure["cause"] for failure in result.failures}
    assert causes["Raises"].startswith("ValueError: this learner has had enough. This came after ")
    assert causes["Raises"].endswith(f" of {own.name}.")
    assert causes["Leaves"].startswith("its process ended with code 3")
    assert causes["Killed"].startswith("its process was ended by SIGKILL; there may have been too little memory")
    assert causes["Crashes"].startswith("its process was ended by SIGSEGV (Fatal Python error: Segmentation fault")
    assert {failure["seed"] for failure in result.failures} == {0} and len(causes) == 4
    assert result.conditions == ["Counted"]
    own.with_name("mended").touch()
    begun = own.with_name("log").read_text()
    mended = perform(study, tmp_path / "s", backend=in_process, progress=False)
    assert mended.failures == [] and mended.conditions == [*names]
    assert own.with_name("log").read_text() == begun
    assert load_study(tmp_path / "s").failures == []


# -- studies that are stopped ------------------------------------------------------------------------------------------


@contextmanager
def started(own: Path, folder: Path, processes: int, slow: float) -> Iterator[subprocess.Popen[str]]:
    """A study in a process of its own, whose learner takes its time: so many seconds a frame, of 1350 in a cell."""
    process = subprocess.Popen(
        [
            sys.executable,
            "-c",
            DRIVE,
            "study",
            str(own.parent / "file.toml"),
            "--out",
            str(folder),
            "--processes",
            str(processes),
        ],
        env={**os.environ, "SLOW": str(slow), "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def wait_for(found: Callable[[], bool]) -> None:
    until = time.monotonic() + 120
    while not found():
        assert time.monotonic() < until, "waited in vain"
        time.sleep(0.02)


def noted(own: Path) -> list[list[str]]:
    """Process and time, s, of the frames that learners have noted."""
    log = own.with_name("log")
    return [line.split() for line in log.read_text().splitlines()] if log.exists() else []


def is_alive(number: str) -> bool:
    try:
        return "zombie" not in Path(f"/proc/{number}/status").read_text()
    except OSError:
        return False


@pytest.fixture(scope="module")
def undisturbed(own: Path, in_process: Any) -> list[dict[str, Any]]:
    """The rows of a study that nobody stopped."""
    (own.parent / "file.toml").write_text(FILE.format(own=own.stem), encoding="utf-8")
    study = planned(load_plan(own.parent / "file.toml"))
    result = perform(study, own.parent / "undisturbed", backend=in_process, progress=False)
    assert len(result.table) == 8
    return told(result)


@pytest.fixture
def log(own: Path) -> Path:
    """The file in which learners write, empty."""
    own.with_name("log").unlink(missing_ok=True)
    return own.with_name("log")


def went_on(own: Path, folder: Path, in_process: Any) -> list[dict[str, Any]]:
    """Rows of the study once it has gone on to its end; each cell has met its last frame once."""
    result = perform(planned(load_plan(own.parent / "file.toml")), folder, backend=in_process, progress=False)
    assert not result.failures
    assert sum(float(when) > 89 for _, when in noted(own)) == 4
    return told(result)


def test_a_killed_study_goes_on(own: Path, log: Path, undisturbed: list[Any], in_process: Any, tmp_path: Path) -> None:
    """The driver is killed after its first cell: its workers end with it, and no finished cell runs again."""
    folder = tmp_path / "s"
    journal = folder / "journal.jsonl"
    with started(own, folder, 1, 0.002) as process:
        wait_for(lambda: process.poll() is not None or (journal.exists() and b"\n" in journal.read_bytes()))
        assert process.poll() is None
        process.kill()
        wait_for(lambda: not any(is_alive(number) for number, _ in noted(own)))
    ended = journal.read_bytes().count(b"\n")
    assert 1 <= ended < 4 and len(set(load_study(folder).table["key"].to_pylist())) == ended
    with journal.open("ab") as file:
        file.write(b'[{"key": "torn')
    assert went_on(own, folder, in_process) == undisturbed


def test_ctrl_c_stops_a_study_that_goes_on(
    own: Path, log: Path, undisturbed: list[Any], in_process: Any, tmp_path: Path
) -> None:
    """It says how; the workers have left checkpoints, so that no frame is computed twice."""
    folder = tmp_path / "s"
    with started(own, folder, 2, 0.05) as process:  # however late the second worker starts, the first is under way
        wait_for(lambda: process.poll() is not None or len(noted(own)) == 2)
        time.sleep(0.2)
        assert process.poll() is None
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=60)[1]
    assert process.returncode == 130
    assert "of 4 cells have ended, and are kept" in said and f"Go on with the same command and --out {folder}." in said
    assert "Traceback" not in said
    assert not any(is_alive(number) for number, _ in noted(own))
    assert [when for _, when in noted(own)] == ["0.0", "0.0"]
    assert went_on(own, folder, in_process) == undisturbed
    assert sum(when == "0.0" for _, when in noted(own)) == 2


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_interrupt_also_where_they_were_ignored(
    number: signal.Signals, described: Described, tmp_path: Path
) -> None:
    """As a shell ignores Ctrl-C for what it starts in the background; afterwards all is as it was."""

    class Told:
        capacity = 1

        def __init__(self, scratch: Path) -> None: ...

        def submit(self, task: Task) -> None: ...

        def forget(self, trunk: str) -> None: ...

        def next(self) -> Outcome:
            os.kill(os.getpid(), number)
            raise AssertionError("the signal came too late")

        def close(self) -> None: ...

    study = Study("told", (Condition("all", described(), (0,)),))
    before = signal.signal(number, signal.SIG_IGN)
    try:
        with pytest.raises(somatopy.api.Interrupted) as caught:
            perform(study, tmp_path / "told", backend=Told, progress=False)
        assert caught.value.signal == number
        assert signal.getsignal(number) == signal.SIG_IGN
    finally:
        signal.signal(number, before)
