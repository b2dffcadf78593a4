"""The progress bar: what it shows, where, and that signals stop a run between two frames and no longer than it runs."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from somatopy.analysis import load_run
from somatopy.cli import progress
from somatopy.cli.progress import run_with_progress
from somatopy.experiment import Description, Experiment
from somatopy.experiment.checkpoint import FILE, read_checkpoint
from somatopy.experiment.recorder import prepare_folder

SIGNALS = (signal.SIGINT, signal.SIGTERM)


@pytest.fixture
def described() -> Description:
    table = {
        "name": "short",
        "body": {"motion": "kinematic"},
        "eye": {"kind": "geometric"},
        "learner": {"kind": "fixed", "head": [0.6, 0.3]},
        "phases": [{"name": "a", "frames": 60}, {"name": "b", "frames": 40}],
    }
    return Description.model_validate(table)


def test_it_shows_name_rates_and_hits_on_standard_error(
    described: Description, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """At the end all frames are done and the hit rate so far is that of the run; standard output is left alone."""
    experiment = Experiment(described)
    folder = prepare_folder(tmp_path / "run", described)
    run_with_progress(experiment, folder)
    out, err = capsys.readouterr()
    assert out == ""
    rate = load_run(folder).frames(["hit"])["hit"].to_numpy().mean()
    for word in ("short", "100 %", "frames/s", f"{rate:.1%} so far"):
        assert word in err.replace("\n", " "), err


def test_it_is_drawn_now_and_then_and_not_in_each_frame(
    described: Description, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At the end, and whenever the time between two drawings is over."""
    shown: list[int] = []
    monkeypatch.setattr(progress._Ticker, "show", lambda self, experiment: shown.append(experiment.done))
    run_with_progress(Experiment(described), prepare_folder(tmp_path / "seldom", described))
    assert shown[-1] == 100 and len(shown) < 20
    shown.clear()
    monkeypatch.setattr(progress, "_REFRESH_S", 0.0)
    run_with_progress(Experiment(described), prepare_folder(tmp_path / "often", described))
    assert shown == [*range(1, 101), 100]


def signalled(experiment: Experiment, number: int, frame: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Send a signal to this process in the middle of a frame."""
    look = experiment.eye.look

    def looking(reading: object) -> object:
        if experiment.done == frame:
            os.kill(os.getpid(), number)
        return look(reading)  # type: ignore[arg-type]

    monkeypatch.setattr(experiment.eye, "look", looking)


@pytest.mark.parametrize("number", SIGNALS)
@pytest.mark.parametrize("frame", [0, 30, 59, 60])
def test_a_signal_ends_the_run_after_the_frame(
    described: Description,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    number: int,
    frame: int,
) -> None:
    """The frame under way is finished and in the checkpoint; at the end of a phase, one more is begun at most."""
    experiment = Experiment(described)
    signalled(experiment, number, frame, monkeypatch)
    folder = prepare_folder(tmp_path / "run", described)
    with pytest.raises(KeyboardInterrupt):
        run_with_progress(experiment, folder)
    done = experiment.done
    assert done - frame in (1, 2)
    assert read_checkpoint(folder / FILE)["done"] == done == load_run(folder).frames(["frame"]).num_rows
    assert f"Interrupted after {done} frames. Go on with: somatopy resume {folder}\n" in capsys.readouterr().err


def test_a_signal_in_the_last_frame_comes_too_late(
    described: Description, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The run has ended and is not called interrupted."""
    experiment = Experiment(described)
    signalled(experiment, signal.SIGINT, 99, monkeypatch)
    run_with_progress(experiment, prepare_folder(tmp_path / "run", described))
    assert experiment.done == 100


@pytest.mark.parametrize("frame", [10**9, 5])
def test_signals_mean_afterwards_what_they_meant_before(
    described: Description, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, frame: int
) -> None:
    """Whether the run ended or was stopped."""
    before = [signal.getsignal(number) for number in SIGNALS]
    experiment = Experiment(described)
    signalled(experiment, signal.SIGTERM, frame, monkeypatch)
    folder = prepare_folder(tmp_path / "run", described)
    if frame < 100:
        with pytest.raises(KeyboardInterrupt):
            run_with_progress(experiment, folder)
    else:
        run_with_progress(experiment, folder)
    assert [signal.getsignal(number) for number in SIGNALS] == before
