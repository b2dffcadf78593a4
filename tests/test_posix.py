"""Locks that end with their process, memory in bytes, and one sentence where a system has neither."""

from __future__ import annotations

import resource
import subprocess
import sys
from pathlib import Path

import pytest

import somatopy
from somatopy import posix
from somatopy.cli import main
from somatopy.posix import NotPosix, alone, peak_memory, require

#: What a system is told that lacks a module.
WORDS = r"no module {} here\. Linux and macOS have both\. On Windows, .*\(WSL\).*container.* Maps and links work here"
HOLDS = """
import sys, time
from pathlib import Path
from somatopy.posix import alone
with alone(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


def test_a_lock_keeps_others_out_until_its_process_is_gone(tmp_path: Path) -> None:
    """Whoever does not wait is told at once; a process that is killed holds nothing."""
    lock = tmp_path / ".lock"
    with subprocess.Popen([sys.executable, "-c", HOLDS, str(lock)], stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout is not None and other.stdout.readline() == "held\n"
        with pytest.raises(BlockingIOError), alone(lock):
            pass
        other.kill()
    with alone(lock, wait=True), pytest.raises(BlockingIOError), alone(lock):
        pass


def test_a_lock_ends_with_its_context(tmp_path: Path) -> None:
    """Also where an error ends it."""
    with pytest.raises(KeyError), alone(tmp_path / ".lock"):
        raise KeyError
    with alone(tmp_path / ".lock"):
        pass


@pytest.mark.parametrize(("platform", "factor"), [("darwin", 1), ("linux", 1024)])
def test_memory_is_told_in_bytes(monkeypatch: pytest.MonkeyPatch, platform: str, factor: int) -> None:
    """macOS tells bytes, other systems kilobytes."""
    usage = type("Usage", (), {"ru_maxrss": 5000})
    monkeypatch.setattr(resource, "getrusage", lambda who: usage)
    monkeypatch.setattr(posix.sys, "platform", platform)
    assert peak_memory() == 5000 * factor


def test_a_system_without_locks_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In one paragraph: what is missing, which systems have it, what to do, what works there. Nothing is made."""
    for module in ("fcntl", "resource"):
        with monkeypatch.context() as patch:
            patch.setitem(sys.modules, module, None)
            for asked in (require, peak_memory, lambda: alone(tmp_path / ".lock").__enter__()):
                with pytest.raises(NotPosix, match=WORDS.format(module)):
                    asked()
    assert [*tmp_path.iterdir()] == []
    require()


@pytest.mark.parametrize("call", ["run", "study", "resume", "fork"])
def test_functions_refuse_before_anything_is_made(call: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also before a session is built, which could say less of what is wrong."""
    monkeypatch.setitem(sys.modules, "fcntl", None)
    described, folder = somatopy.paper(), tmp_path / "run"
    calls = {
        "run": lambda: somatopy.run(described, folder),
        "study": lambda: somatopy.study({"a": described}, out=folder),
        "resume": lambda: somatopy.resume(folder),
        "fork": lambda: somatopy.fork(folder, described),
    }
    with pytest.raises(NotPosix, match=WORDS.format("fcntl")):
        calls[call]()
    assert [*tmp_path.iterdir()] == []


@pytest.mark.parametrize("verb", [["run", "paper"], ["reproduce"], ["demo"], ["compare", "--processes", "1"]])
def test_commands_say_it_in_one_paragraph(
    verb: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Wrong use, without a traceback."""
    monkeypatch.setitem(sys.modules, "fcntl", None)
    assert main([*verb, "--quiet", "--out", str(tmp_path / "out")]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("somatopy: Experiments cannot run") and err.count("\n") == 1
    assert [*tmp_path.iterdir()] == []
