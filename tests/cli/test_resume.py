"""somatopy resume: real runs are killed and interrupted, and end as if nothing had happened."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from somatopy.analysis import load_run
from somatopy.cli import main
from somatopy.experiment import provenance, recorder, run_writer
from somatopy.experiment.checkpoint import read_checkpoint
from somatopy.experiment.run_folder import CHECKPOINT

PART, FRAMES = 120, 330
QUICK = [
    *["--eye", "geometric", "--motion", "kinematic", "--phases.0.frames", "200", "--phases.1.frames", "130"],
    *["--learner.arm-map.shape", "8", "8", "--learner.head-map.shape", "8", "8"],
]
DYNAMIC = [*QUICK, "--motion", "dynamic"]
Unbroken = Callable[..., dict[str, bytes]]


def results(folder: Path) -> dict[str, bytes]:
    """All that a run computes; what it costs is no part of it."""
    files = "summary.json", "ceiling.json", "belief.npz", "sight.npz"
    found = [*folder.glob("frames/*"), *folder.glob("maps/*.npz"), *map(folder.joinpath, files)]
    return {str(path.relative_to(folder)): path.read_bytes() for path in found}


@pytest.fixture(autouse=True)
def small_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three parts are 330 frames, in this process too."""
    for module in (run_writer, recorder):
        monkeypatch.setattr(module, "PART_FRAMES", PART)


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """The folder of the run of these options that nothing stopped: each is run once, and nobody writes there."""
    folders: dict[tuple[str, ...], Path] = {}

    def run(*args: str) -> Path:
        if args not in folders:
            folder = tmp_path_factory.mktemp("kept") / "run"
            assert main(["run", "paper", *args, "--out", str(folder)]) == 0
            folders[args] = folder
        return folders[args]

    return run


@pytest.fixture
def unbroken(kept: Callable[..., Path], capsys: pytest.CaptureFixture[str]) -> Unbroken:
    """What the run of these options leaves behind if nothing stops it."""

    def run(*args: str) -> dict[str, bytes]:
        found = results(kept(*args))
        capsys.readouterr()
        assert len([name for name in found if name.startswith("frames")]) == 3
        return found

    return run


# -- killed ----------------------------------------------------------------------------------------------------------

#: Reads command lines, runs each in a process of its own, and tells its number, its frames as they pass, and its end.
#: A run before has loaded all kernels, so that the processes that follow need not.
SERVER = f"""
import json, os, sys
import somatopy.cli.run, somatopy.cli.resume
from somatopy.experiment import recorder, run_writer, session
run_writer.PART_FRAMES = recorder.PART_FRAMES = {PART}
run_writer.CHECKPOINT_S = 0.004
told = os.dup(1)
os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
os.dup2(1, 2)
somatopy.cli.main(sys.argv[1:])
frame = session.Session.__next__
def telling(self):
    found = frame(self)
    os.write(told, f"{{self.done}}\\n".encode())
    return found
session.Session.__next__ = telling
for line in sys.stdin:
    child = os.fork()
    if child == 0:
        os._exit(somatopy.cli.main(json.loads(line)))
    os.write(told, f"process {{child}}\\n".encode())
    os.write(told, f"end {{os.waitpid(child, 0)[1]}}\\n".encode())
"""


class Server:
    """Starts commands that can be killed at a frame, without the seconds that a new interpreter takes."""

    def __init__(self, *first: str) -> None:
        command = [sys.executable, "-c", SERVER, *first]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert self._process.stdin is not None and self._process.stdout is not None
        self._in, self._out = self._process.stdin, self._process.stdout

    def run(self, args: list[str], kill_after: int, pause: float) -> tuple[int, int]:
        """Run a command and kill it some seconds after so many frames; its exit status and the last frame it told."""
        self._in.write(json.dumps(args) + "\n")
        self._in.flush()
        child, last, frames = 0, 0, 0
        for line in self._out:
            word, *number = line.split()
            if word == "end":
                return int(number[0]), last
            if word == "process":
                child = int(number[0])
            else:
                last, frames = int(word), frames + 1
                if frames == kill_after or (frames < kill_after and last == FRAMES):
                    time.sleep(pause)
                    os.kill(child, signal.SIGKILL)
        raise AssertionError("the server has ended")

    def close(self) -> None:
        self._in.close()
        self._process.wait(timeout=60)
        self._out.close()


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    running = Server(*new(tmp_path_factory.mktemp("first") / "run", QUICK))
    yield running
    running.close()


@pytest.mark.parametrize(("args", "kills"), [(QUICK, 20), (DYNAMIC, 5)], ids=["kinematic", "dynamic"])
def test_killed_at_random_moments_it_ends_alike(
    server: Server, unbroken: Unbroken, tmp_path: Path, args: list[str], kills: int
) -> None:
    """SIGKILL again and again, while frames, parts, checkpoints, ceiling or summary are made; then to the end.

    A run that ends in spite of all that is compared, and another begun.
    """
    expected, rng, folder = unbroken(*args), np.random.default_rng(7), tmp_path / "killed"
    killed, frames = 0, []
    while killed < kills:
        command = ["resume", str(folder)] if (folder / "experiment.toml").exists() else new(folder, args)
        status, last = server.run(command, int(rng.integers(1, 100)), rng.choice([0, 0.001, 0.004, 0.02]))
        assert status in (0, signal.SIGKILL)
        killed += status == signal.SIGKILL
        frames.append(last)
        if status == 0:
            assert results(folder) == expected
            shutil.rmtree(folder)
    assert len(set(frames)) >= kills // 2
    assert main(["resume", str(folder)] if folder.exists() else new(folder, args)) == 0
    assert results(folder) == expected


def new(folder: Path, args: list[str]) -> list[str]:
    """The command that begins a run; a folder in which none has begun is put away."""
    shutil.rmtree(folder, ignore_errors=True)
    return ["run", "paper", *args, "--out", str(folder)]


# -- processes of their own ------------------------------------------------------------------------------------------

#: The command with small parts, a checkpoint a frame, and a pause in each, so that it goes on for half a minute if
#: nobody stops it: however busy the machine is, a signal comes before its end.
SLOW = f"""
import sys, time
from somatopy.cli import main
from somatopy.experiment import recorder, run_writer, session
run_writer.PART_FRAMES = recorder.PART_FRAMES = {PART}
run_writer.CHECKPOINT_S = 0.05
frame = session.Session.__next__
def slow(self):
    time.sleep(0.1)
    return frame(self)
session.Session.__next__ = slow
raise SystemExit(main())
"""


def begun(folder: Path, *args: str) -> subprocess.Popen[str]:
    """A run in a process of its own, with a checkpoint and frames behind it."""
    command = [sys.executable, "-c", SLOW, "run", "paper", *args, "--out", str(folder)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while not (folder / CHECKPOINT).exists() or read_checkpoint(folder / CHECKPOINT)["session"]["done"] < 3:
        assert process.poll() is None, process.communicate()
        time.sleep(0.02)
    return process


@pytest.mark.parametrize(
    ("number", "args"),
    [
        (signal.SIGINT, DYNAMIC),
        (signal.SIGTERM, QUICK),
        pytest.param(signal.SIGINT, [*QUICK, "--eye", "fiducial"], marks=pytest.mark.gl),
    ],
    ids=["SIGINT", "SIGTERM", "SIGINT, rendered"],
)
def test_interrupted_it_says_how_to_go_on(
    number: int, args: list[str], unbroken: Unbroken, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 128 and the signal, no traceback, all frames until then; the command named leads to the same end."""
    folder = tmp_path / "a folder [with brackets], a space and a $"
    process = begun(folder, *args)
    process.send_signal(number)
    printed, said = process.communicate(timeout=60)
    assert process.returncode == 128 + number and printed == "" and "Traceback" not in said
    message = said.splitlines()[-1]
    text, _, command = message.partition(" Go on with: ")
    count = int(text.removeprefix("somatopy: Interrupted after ").removesuffix(" frames."))
    assert 0 < count < FRAMES
    run = load_run(folder)
    assert run.frames(["frame"])["frame"].to_pylist() == list(range(count))
    assert run.cost is not None and run.cost["frames"] == count and run.summary is None
    program, *words = shlex.split(command)
    assert program == "somatopy" and words == ["resume", str(folder)]
    assert main(words) == 0
    assert capsys.readouterr().out == f"{folder}\n"
    assert results(folder) == unbroken(*args)


def test_one_process_a_folder(unbroken: Unbroken, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """While a run goes on, a second one in its folder is refused and disturbs nothing; once it is killed, it may."""
    folder = tmp_path / "run"
    process = begun(folder, *QUICK)
    try:
        assert main(["resume", str(folder)]) == 2
        assert f"Another process is running in {folder}" in capsys.readouterr().err
        assert main(new(tmp_path / "other", QUICK)) == 0
        assert process.poll() is None
    finally:
        process.kill()
        process.communicate()
    assert (folder / CHECKPOINT).exists() and not (folder / "summary.json").exists()
    capsys.readouterr()
    assert main(["resume", str(folder)]) == 0
    assert results(folder) == unbroken(*QUICK)


# -- in this process -------------------------------------------------------------------------------------------------


def everything(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file() and path.name != ".lock"}


@pytest.fixture
def finished(kept: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    """A folder of one's own with a run that has ended."""
    folder = shutil.copytree(kept(*QUICK), tmp_path / "finished")
    capsys.readouterr()
    return folder


def test_a_finished_run_stays_as_it_is(finished: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """No byte changes, its cost included; what was deleted of the analysis is made again, and --json prints it."""
    before = everything(finished)
    assert main(["resume", str(finished)]) == 0
    assert capsys.readouterr().out == f"{finished}\n"
    assert everything(finished) == before
    for name in ("summary.json", "ceiling.json", "frames/part-00002.parquet"):
        (finished / name).unlink()
    assert main(["resume", str(finished), "--json"]) == 0
    table: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert everything(finished) == before
    run = load_run(finished)
    assert table == {"folder": str(finished), **(run.summary or {}), "cost": run.cost}


def test_without_a_checkpoint_it_refuses_and_deletes_nothing(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """However many frames were written; with the checkpoint back in its place the run goes on from there."""
    expected = results(finished)
    checkpoint = (finished / CHECKPOINT).read_bytes()
    for gone in (CHECKPOINT, "summary.json", "ceiling.json"):
        (finished / gone).unlink()
    before = everything(finished)
    assert main(["resume", str(finished)]) == 2
    out, err = capsys.readouterr()
    assert out == "" and f"{finished} has no {CHECKPOINT}" in err and "nothing was changed" in err
    assert everything(finished) == before
    (finished / CHECKPOINT).write_bytes(checkpoint)
    assert main(["resume", str(finished)]) == 0
    assert results(finished) == expected


def test_from_the_end_of_a_phase(finished: Path) -> None:
    """The checkpoint that a phase leaves behind for good takes the place of the last one."""
    expected = results(finished)
    (finished / CHECKPOINT).write_bytes((finished / "phase-0.npz").read_bytes())
    assert main(["resume", str(finished)]) == 0
    assert results(finished) == expected


def test_there_is_a_checkpoint_from_the_first_moment(tmp_path: Path) -> None:
    """A run that was killed before its first frame goes on from there."""
    folder = tmp_path / "run"
    command = [sys.executable, "-c", DEAD, *new(folder, QUICK)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 9, done.stderr
    assert read_checkpoint(folder / CHECKPOINT)["session"]["done"] == 0
    assert main(["resume", str(folder)]) == 0
    assert load_run(folder).frames(["frame"]).num_rows == FRAMES


#: The command, in a process that dies in its first frame.
DEAD = """
import os
from somatopy.cli import main
from somatopy.experiment.session import Session
Session.__next__ = lambda self: os._exit(9)
raise SystemExit(main())
"""


def test_an_edited_description_is_refused_by_name(finished: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Exit code 2, the key that was edited, and nothing changed."""
    file = finished / "experiment.toml"
    file.write_text(file.read_text().replace("seed = 0", "seed = 5"))
    before = everything(finished)
    for verb in ("resume", "evaluate"):
        assert main([verb, str(finished)]) == 2
        assert "is not what this run began with: seed differs." in capsys.readouterr().err
    assert everything(finished) == before


def test_other_versions_need_anyway(
    finished: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The message names the option, and the option lets the run go on."""
    monkeypatch.setattr(provenance, "versions", lambda: {"somatopy": "99"})
    for verb in ("resume", "evaluate"):
        assert main([verb, str(finished)]) == 2
        assert "--anyway" in capsys.readouterr().err
    assert main(["evaluate", str(finished), "--postures", "3", "--anyway"]) == 0
    (finished / CHECKPOINT).write_bytes((finished / "phase-0.npz").read_bytes())
    assert main(["resume", str(finished), "--anyway"]) == 0
    assert load_run(finished).description["resumed"][0]["versions"] == {"somatopy": "99"}


def test_an_older_format_is_refused_in_one_sentence(finished: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """By every command on run folders."""
    file = finished / "experiment.toml"
    file.write_text(file.read_text().replace("format = 2\n", ""))
    before = everything(finished)
    for verb in ("resume", "evaluate", "report"):
        assert main([verb, str(finished)]) == 2
        out, err = capsys.readouterr()
        assert out == "" and err.count("\n") == 1 and "format" in err and str(finished) in err
    assert everything(finished) == before


# -- a frame that is stuck -------------------------------------------------------------------------------------------

STUCK = """
import signal
import time
from somatopy.bodies import MujocoBody

class Stuck(MujocoBody):
    # One of its frames never ends.

    frames = 0

    def __init__(self):
        super().__init__("nao", "kinematic")

    def step(self, arm, head):
        self.frames += 1
        if self.frames == FIRST:
            told = signal.getsignal(signal.SIGINT)
            signal.signal(signal.SIGINT, lambda *args: (told(*args), open("told", "w").close()))
            open("stuck", "w").close()
            time.sleep(600)
        return super().step(arm, head)
"""


def wait_for(process: subprocess.Popen[str], file: Path) -> None:
    """Until a process has made a file."""
    while not file.exists():
        assert process.poll() is None, process.communicate()
        time.sleep(0.02)


@pytest.mark.parametrize("first", [1, 40])
def test_a_second_interrupt_breaks_a_stuck_frame(tmp_path: Path, first: int) -> None:
    """The first one waits for the frame; after the second the folder is whole, and the message says what to do."""
    (tmp_path / "stuck_body.py").write_text(STUCK.replace("FIRST", str(first)))
    args = ["--body.kind", "stuck_body:Stuck", "--eye", "geometric", "--learner", "random", "--out", "run"]
    command = [sys.executable, "-c", "from somatopy.cli import main; raise SystemExit(main())", "run", "paper", *args]
    process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    wait_for(process, tmp_path / "stuck")
    process.send_signal(signal.SIGINT)
    wait_for(process, tmp_path / "told")  # two signals that come before the process runs are one
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(timeout=0.3)
    process.send_signal(signal.SIGINT)
    printed, said = process.communicate(timeout=60)
    assert process.returncode == 130 and printed == "" and "Traceback" not in said
    message = " ".join(said.split())
    assert f"Broken off in frame {first - 1}" in message
    if first == 1:
        assert "before anything was recorded" in message and not (tmp_path / "run").exists()
    else:
        assert message.endswith("Go on with: somatopy resume run")
        assert load_run(tmp_path / "run").frames(["frame"])["frame"].to_pylist() == list(range(first - 1))
        assert read_checkpoint(tmp_path / "run" / CHECKPOINT)["session"]["done"] == 0


def test_what_cannot_be_resumed_is_left_alone(
    finished: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """No folder, no description, a broken one, a broken checkpoint, another experiment's: exit code 2 and why."""
    other = tmp_path / "other"
    assert main(["run", "paper", *QUICK, "--learner.arm-map.shape", "7", "7", "--out", str(other)]) == 0
    for folder in ("no toml", "bad toml", "cut", "empty", "text", "foreign"):
        shutil.copytree(finished, tmp_path / folder)
    (tmp_path / "no toml" / "experiment.toml").unlink()
    (tmp_path / "bad toml" / "experiment.toml").write_text("seed = = 1")
    (tmp_path / "cut" / CHECKPOINT).write_bytes((finished / CHECKPOINT).read_bytes()[:-200])
    (tmp_path / "empty" / CHECKPOINT).write_bytes(b"")
    (tmp_path / "text" / CHECKPOINT).write_text("state")
    (tmp_path / "foreign" / CHECKPOINT).write_bytes((other / CHECKPOINT).read_bytes())
    capsys.readouterr()
    for folder, words in {
        "none": ["is not a folder", "Give the path of a run folder"],
        "no toml": ["is not a run folder", "experiment.toml", "Give the path"],
        "bad toml": ["not valid TOML", "line 1"],
        "cut": [CHECKPOINT, "no checkpoint that can be read"],
        "empty": [CHECKPOINT, "no checkpoint that can be read"],
        "text": [CHECKPOINT, "no checkpoint that can be read"],
        "foreign": ["is not what this run began with", "learner.arm_map.shape differs"],
    }.items():
        before = everything(tmp_path)
        assert main(["resume", str(tmp_path / folder)]) == 2
        out, err = capsys.readouterr()
        assert out == "" and err.startswith("somatopy: ") and err.count("\n") == 1
        assert all(word in err for word in (*words, str(tmp_path / folder))), err
        assert everything(tmp_path) == before
