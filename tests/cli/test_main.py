"""The command line as a whole: verbs, exit codes, and errors without tracebacks."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from unittest.mock import Mock

import pytest

from somatopy.bodies import MODELS, BodyError, rendering
from somatopy.cli import VERBS, main

GEOMETRIC = ["--eye", "geometric", "--motion", "kinematic"]
SHORT = ["--minutes", "0.01", "--damage-minutes", "0.01"]
Refused = Callable[..., str]


@pytest.fixture
def empty(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working folder."""
    work = tmp_path / "work"
    work.mkdir()
    monkeypatch.chdir(work)
    return work


@pytest.fixture
def refused(empty: Path, capsys: pytest.CaptureFixture[str]) -> Refused:
    """Call the command, which must refuse: exit code 2, one message on standard error, nothing written or printed."""

    def call(*args: str) -> str:
        before = sorted(empty.rglob("*"))
        assert main(args) == 2
        out, err = capsys.readouterr()
        assert out == "" and "Traceback" not in err
        assert sorted(empty.rglob("*")) == before
        assert err.startswith("somatopy: ") and err.endswith("\n")
        return err.removeprefix("somatopy: ").strip()

    return call


def test_alone_it_explains_itself(capsys: pytest.CaptureFixture[str]) -> None:
    """Without a verb: usage and wrong use; --help: the same and success. Every verb and an example are there."""
    for args, code in (([], 2), (["--help"], 0), (["-h"], 0)):
        assert main(args) == code
        out = capsys.readouterr().out
        assert out.startswith("usage: somatopy COMMAND") and "example: somatopy " in out
        assert all(f"  {verb} " in out for verb in VERBS)


def test_a_reader_may_leave(empty: Path) -> None:
    """As head does: nothing is said, the exit code is that of other programs."""
    command = [sys.executable, "-m", "somatopy", "run", "--help"]
    reading = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=empty)
    assert reading.stdout is not None and reading.stderr is not None
    reading.stdout.close()
    assert reading.stderr.read() == b""
    reading.stderr.close()
    assert reading.wait() == 141


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    """The installed one."""
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == version("somatopy") + "\n"


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_has_help_with_an_example(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Exit code 0, on standard output, a screen long; experiment commands name their tables of dotted keys."""
    assert main([verb, "--help"]) == 0
    out, err = capsys.readouterr()
    assert out.startswith(f"usage: somatopy {verb}") and f"example: somatopy {verb}" in out and err == ""
    assert len(out.splitlines()) <= 40
    assert ("--json" in out) == (verb != "demo") and ("--quiet" in out) == (verb != "list")
    if verb == "demo":
        assert "--out" in out and "--seed" in out and "--babbling.speed" not in out
    elif verb in ("reproduce", "run", "compare", "describe"):
        assert "--damage-minutes" in out and "body, eye, babbling, learner, phases" in out and "--help phases" in out
    elif verb == "study":
        assert "FILE" in out and "--dry-run" in out and "--babbling.speed" not in out
    elif verb == "check-body":
        assert "MODEL" in out and "--propose" in out and "--picture" in out
    elif verb != "list":
        assert "RUN" in out and "runs/" in out and "--babbling.speed" not in out


@pytest.mark.parametrize(
    ("args", "parts"),
    [
        (["dance"], ["'dance'", ", ".join(VERBS)]),
        (["repor", "x"], ["'repor'", "Did you mean report?"]),
        (["demo", "--sed", "1"], ["Unknown option --sed. Did you mean --seed?"]),
        (["demo", "--seed", "x"], ["--seed x cannot be read: it takes a whole number"]),
        (["demo", "extra"], ["'extra' was not expected here"]),
        (["resume"], ["RUN is missing", "somatopy resume runs/"]),
        (["evaluate", "x", "--postures", "many"], ["--postures many cannot be read: it takes a whole number"]),
        (["film", "x", "--frm", "1"], ["Unknown option --frm. Did you mean --from?"]),
        (["check-body"], ["MODEL is missing"]),
        (["study"], ["FILE is missing", "somatopy study speeds.toml"]),
        (["run", "paper", "--json", "yes"], ["'yes' was not expected here: --json takes no value"]),
        (["run", "paper", "--learner", "randm"], ["'randm'", "did you mean random?"]),
        (["run", "paper", "--damage", "mirored"], ["'mirored'", "did you mean mirrored?"]),
        (["run", "paper", "--help", "lerner"], ["'lerner'", "Did you mean learner?"]),
        (["compare", "--learners", "nearst"], ["'nearst'", "did you mean nearest?"]),
        (["describe", "papr"], ["'papr'", "Did you mean paper?"]),
        (["run"], ["paper", "description file", "somatopy run paper"]),
        (["run", "--seed", "1"], ["paper", "description file"]),
        (["run", "papr"], ["'papr'", "(paper, paper-wide, paper-2016, ", "description file"]),
        (["run", "."], ["'.'", "(paper, paper-wide, paper-2016, "]),
        (["run", "paper", "--sed", "1"], ["--sed", "--seed"]),
        (["run", "paper", "--babbling.sped", "1"], ["--babbling.sped", "--babbling.speed"]),
        (["run", "paper", "paper"], ["'paper' was not expected"]),
        (["reproduce", "paper"], ["'paper' was not expected"]),
        (["list", "--jsn"], ["--jsn", "--json, --debug"]),
        (["run", "paper", "--minutes", "nan"], ["at least 0, not nan"]),
        (["reproduce", "--minutes", "-1"], ["at least 0, not -1"]),
        (["reproduce", "--damage-minutes", "inf"], ["at least 0, not inf"]),
        (["run", "paper", "--damage", "rust"], ["'rust'", "none, paper or offset:a,b,c,d"]),
        (["run", "paper", "--damage", "offset:1,2"], ["2 offsets", "4 joints: LShoulderPitch"]),
        (["run", "paper", "--learner", "fixed", "--learner.head", "0", "9"], ["HeadPitch = 9", "limits ["]),
        (["run", "paper", "--babbling.range", "broad"], ["babbling: range 'broad'", "mechanical, confined, wide"]),
        (
            ["run", "paper", "--babbling.range", *["0", "9", "0", "1", "0", "1", "-1", "-.5"]],
            ["[0, 9] of LShoulderPitch", "limits ["],
        ),
        (
            ["run", "paper", "--babbling.range", *["1", "0", "0", "1", "0", "1", "-1", "-.5"]],
            ["[1, 0] of LShoulderPitch", "low end"],
        ),
        (["run", "paper", "--body.model", "robby"], ["'robby'", "Known bodies: nao"]),
        (["run", "paper", "--phases.0.plastic", "lynx"], ["'intact'", "'lynx'", "arm_map, head_map, links"]),
        (["run", "paper", "--learner", "nearest", "--phases.1.plastic", "links"], ["'damaged'", "'links'", "memory"]),
        (["run", "paper-shuffled", "--learner", "random"], ["'shuffled'", "learner has no links to shuffle"]),
        (["run", "paper-frozen", "--learner", "random"], ["'intact'", "'links'", "leave plastic away"]),
        (["resume", "none"], ["none is not a folder", "runs/first"]),
        (["evaluate", "none"], ["none is not a folder", "runs/first"]),
        (["resume", "."], [". is not a run folder", "experiment.toml", "runs/first"]),
    ],
)
def test_wrong_use_is_told_in_one_paragraph(refused: Refused, args: list[str], parts: list[str]) -> None:
    """Exit code 2 and what is wrong, before anything is written."""
    message = refused(*args, *(GEOMETRIC if args[0] == "run" and "paper" in args[1:2] else []))
    assert all(part in message for part in parts), message
    assert "\n" not in message


def test_a_file_may_start_from_a_preset(refused: Refused, empty: Path) -> None:
    """An unknown one is told with the near one; keys of the file are checked as ever."""
    for text, parts in (
        ("preset = 'papr'", ["mine.toml", "'papr'", "Did you mean paper?"]),
        ("preset = 'paper'\nsed = 1", ["mine.toml", "'sed'", "did you mean seed?"]),
    ):
        (empty / "mine.toml").write_text(text)
        message = refused("run", "mine.toml")
        assert all(part in message for part in parts), message


def test_wrong_description_files(refused: Refused, empty: Path) -> None:
    """No TOML, unknown keys in it: file, place and valid keys."""
    for text, parts in (
        ("seed = = 1", ["mine.toml", "not valid TOML", "line 1"]),
        ("sed = 1", ["mine.toml", "'sed'", "name, seed, body"]),
        (
            "[learner]\nkind = 'hebbian'\n[learner.arm_map]\neta = 1",
            ["learner.arm_map.eta", "kind, shape, learning_rate"],
        ),
        ("[[phases]]\nminutes = 1", ["phases.0.minutes", "name, frames, interventions, trend_breaks"]),
    ):
        (empty / "mine.toml").write_text(text)
        message = refused("run", "mine.toml")
        assert all(part in message for part in parts), message


def test_broken_robots(refused: Refused, empty: Path) -> None:
    """A model that is missing, broken or lacks a joint; an anatomy with an unknown key: file, reason, what there is."""
    anatomy = MODELS["nao"].read_text()
    nao = (MODELS["nao"].parent / "nao.xml").read_text()
    for model, table, parts in (
        (None, anatomy, ["nao.xml", "does not exist"]),
        ("<mujoco><worldbody>", anatomy, ["nao.xml", "MuJoCo cannot read"]),
        (nao, anatomy.replace("LElbowYaw", "LElbowJaw"), ["'LElbowJaw'", "does not exist", "LElbowYaw"]),
        (nao, anatomy.replace('"CameraBottom"', '"Camera"'), ["'Camera'", "CameraBottom"]),
        (nao, "colour = 'red'\n" + anatomy, ["robot.toml", "unknown key 'colour'", "there: name, model"]),
    ):
        (empty / "robot.toml").write_text(table)
        (empty / "nao.xml").unlink(missing_ok=True)
        if model is not None:
            (empty / "nao.xml").write_text(model)
        message = refused("run", "paper", "--body.model", "robot.toml", *GEOMETRIC)
        assert all(part in message for part in parts), message


def test_output_folders_that_cannot_be_used(refused: Refused, empty: Path) -> None:
    """Not empty, a file, below a file; the way out is named, and what is there stays."""
    (empty / "full").mkdir()
    (empty / "full" / "keep.txt").write_text("mine")
    (empty / "file").write_text("mine")
    for out, reason in (("full", "not empty"), ("file", "is a file"), ("file/below", "Not a directory")):
        message = refused("run", "paper", *GEOMETRIC, *SHORT, "--out", out)
        assert out in message and reason in message and "--out" in message
    assert (empty / "file").read_text() == (empty / "full" / "keep.txt").read_text() == "mine"


def test_without_opengl_it_says_what_to_install(refused: Refused, monkeypatch: pytest.MonkeyPatch) -> None:
    """The rendered eye on a machine without OpenGL: packages by name, before the run."""
    monkeypatch.setattr(rendering, "_BACKENDS", ())
    monkeypatch.setattr(rendering, "_context_class", rendering._context_class.__wrapped__)
    message = refused("reproduce", *SHORT)
    assert "OpenGL" in message and "apt-get install libegl1" in message


def test_a_package_that_is_missing_is_told_with_its_command(
    capsys: pytest.CaptureFixture[str], empty: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also one that the command line itself needs; a module that is none of somatopy's requirements is no wrong use."""
    from somatopy.cli import list as listing

    for module, code, said in (
        ("tyro", 2, 'the package tyro, which is not installed: pip install "somatopy[all]"'),
        ("somebodys_module", 1, "ModuleNotFoundError: No module named 'somebodys_module' (where: --debug)"),
    ):
        missing = ModuleNotFoundError(f"No module named {module!r}", name=module)
        monkeypatch.setattr(listing, "main", Mock(side_effect=missing))
        assert main(["list"]) == code
        err = capsys.readouterr().err
        assert said in err and err.count("\n") == 1


def test_a_wrong_opengl_is_told_in_one_sentence(empty: Path) -> None:
    """MuJoCo refuses to be imported then."""
    command = [sys.executable, "-m", "somatopy", "list"]
    environment = os.environ | {"MUJOCO_GL": "third"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert "MUJOCO_GL: third" in done.stderr and "egl or osmesa" in done.stderr and done.stderr.count("\n") == 1


def test_tracebacks_with_debug_only(capsys: pytest.CaptureFixture[str], empty: Path) -> None:
    """--debug shows where it happened, above the same message and with the same exit code."""
    args = ["run", "paper", "--minutes", "nan"]
    assert main(args) == main([*args, "--debug"]) == 2
    err = capsys.readouterr().err
    assert err.count("Traceback") == 1 and err.count("somatopy: Minutes must be finite") == 2


@pytest.mark.parametrize(
    ("error", "message"), [(ZeroDivisionError(), "ZeroDivisionError"), (KeyError("effort"), "KeyError: 'effort'")]
)
def test_what_is_no_wrong_use_fails_with_1(
    capsys: pytest.CaptureFixture[str], empty: Path, monkeypatch: pytest.MonkeyPatch, error: Exception, message: str
) -> None:
    """An error of the program or of a part: exit code 1, what it is, how to see where it was, no traceback."""
    from somatopy.cli import list as listing

    def broken(args: object) -> int:
        raise error

    monkeypatch.setattr(listing, "main", broken)
    assert main(["list"]) == 1
    assert capsys.readouterr().err == f"somatopy: {message} (where: --debug)\n"


def test_notes_of_an_error_are_told_behind_it(
    capsys: pytest.CaptureFixture[str], empty: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Which tell after how many frames it came, and how to go on."""
    from somatopy.cli import list as listing

    for error, said in (
        (ZeroDivisionError("by 0"), "by 0 (where: --debug). After 3 frames."),
        (BodyError("No."), "No. A"),
    ):
        error.add_note("After 3 frames.")
        monkeypatch.setattr(listing, "main", Mock(side_effect=error))
        main(["list"])
        assert said in capsys.readouterr().err


def test_the_installed_command_is_this_one(empty: Path) -> None:
    """As a process of its own: exit code and message arrive at the shell."""
    command = Path(sys.executable).with_name("somatopy")
    done = subprocess.run([command, "run", "paper", "--sed", "1"], capture_output=True, text=True, check=False)
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr.startswith("somatopy: Unknown option --sed.") and done.stderr.count("\n") == 1
