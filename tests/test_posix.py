"""Locks that end with their process, memory in bytes, and one sentence where a system has neither."""

from __future__ import annotations

import resource
import subprocess
import sys
from pathlib import Path

import pytest

from somatopy import posix
from somatopy.posix import NotPosix, alone, peak_memory

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
    """In a sentence that says what works there and what to do, and nothing is made."""
    monkeypatch.setitem(sys.modules, "fcntl", None)
    with pytest.raises(NotPosix, match=r"Linux or macOS.*WSL.*Maps and links work here"), alone(tmp_path / ".lock"):
        pass
    assert not (tmp_path / ".lock").exists()
