"""Files that are written whole or not at all, and the user's cache folder."""

from __future__ import annotations

import errno
import json
import os
import stat
import subprocess
import sys
import threading
from pathlib import Path
from typing import IO, Any

import pytest

from somatopy.files import cache_folder, is_aside, write_json, write_whole


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"\x00\xff", b"\x00\xff"),
        ("W\u00f6rter\n", "W\u00f6rter\n".encode()),
        ("", b""),
        (lambda file: file.write(b"by a function"), b"by a function"),
    ],
)
def test_what_is_written_is_there_and_nothing_else(tmp_path: Path, content: Any, expected: bytes) -> None:
    """Bytes, text as UTF-8 with its line ends, and what a function writes; new, and in the place of another file."""
    path = tmp_path / "file"
    for _ in range(2):
        write_whole(path, content)
        assert path.read_bytes() == expected and names(tmp_path) == ["file"]
        path.write_bytes(b"a longer content that was there before")


def test_a_path_may_be_text(tmp_path: Path) -> None:
    """As everywhere in Python."""
    write_whole(str(tmp_path / "file"), "x")
    assert (tmp_path / "file").read_text() == "x"


def test_json_replaces_as_a_whole_and_refuses_nan(tmp_path: Path) -> None:
    """The old file stays if the new one cannot be written; no reader meets NaN."""
    path = tmp_path / "table.json"
    write_json(path, {"a": 1})
    with pytest.raises(ValueError, match="JSON"):
        write_json(path, {"a": float("nan")})
    assert json.loads(path.read_text()) == {"a": 1}
    assert [entry.name for entry in tmp_path.iterdir()] == ["table.json"]


@pytest.mark.parametrize("error", [OSError("the disk is full"), ValueError("no"), KeyboardInterrupt()])
@pytest.mark.parametrize("before", [None, b"old"])
def test_a_writer_that_fails_leaves_what_was_there(tmp_path: Path, before: bytes | None, error: BaseException) -> None:
    """The old content or none, no file aside, and its error passes; Ctrl-C too."""
    path = tmp_path / "file"
    if before is not None:
        path.write_bytes(before)

    def fail(file: IO[bytes]) -> None:
        file.write(b"half of the ")
        raise error

    with pytest.raises(type(error)):
        write_whole(path, fail)
    assert names(tmp_path) == ([] if before is None else ["file"])
    assert before is None or path.read_bytes() == before


def test_what_cannot_be_renamed_leaves_what_was_there(tmp_path: Path) -> None:
    """A folder stands in the place: it stays as it is, and nothing is left aside."""
    (tmp_path / "file").mkdir()
    (tmp_path / "file" / "inside").write_text("x")
    with pytest.raises(IsADirectoryError, match=r"Move it away: .*file"):
        write_whole(tmp_path / "file", "new")
    assert names(tmp_path) == ["file"] and names(tmp_path / "file") == ["inside"]


def test_a_folder_that_does_not_exist_is_an_error(tmp_path: Path) -> None:
    """It is not made in silence."""
    with pytest.raises(FileNotFoundError):
        write_whole(tmp_path / "none" / "file", "x")
    assert names(tmp_path) == []


def test_readers_see_the_old_content_while_the_new_is_written(tmp_path: Path) -> None:
    """What is written so far stands aside, in the same folder, under a name that says so."""
    path, seen = tmp_path / "file", []
    path.write_text("old")

    def write(file: IO[bytes]) -> None:
        file.write(b"new")
        file.flush()
        aside = [name for name in tmp_path.iterdir() if name != path]
        seen.append((path.read_text(), [(is_aside(name), name.read_text()) for name in aside]))

    write_whole(path, write)
    assert seen == [("old", [(True, "new")])] and path.read_text() == "new"


@pytest.mark.parametrize("size", [3, 100_000])
def test_file_and_folder_reach_the_disk_in_order(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, size: int) -> None:
    """The whole content first, under the name aside; then the renaming; then the folder that holds the name.

    A content so small that it fits a buffer is no exception.
    """
    real_sync, real_replace, calls = os.fsync, os.replace, []

    def fsync(handle: int) -> None:
        status = os.fstat(handle)
        kind = "folder" if stat.S_ISDIR(status.st_mode) else "file"
        calls.append((kind, status.st_size if kind == "file" else os.path.samestat(status, tmp_path.stat())))
        real_sync(handle)

    def replace(source: Any, target: Any) -> None:
        calls.append(("rename", is_aside(Path(source))))
        real_replace(source, target)

    monkeypatch.setattr(os, "fsync", fsync)
    monkeypatch.setattr(os, "replace", replace)
    write_whole(tmp_path / "file", lambda file: file.write(bytes(size)))
    assert calls == [("file", size), ("rename", True), ("folder", True)]


def test_a_system_that_opens_no_folders_is_no_obstacle(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The file is there; only its name may be lost in a crash."""
    real = os.open

    def refuse(path: Any, *arguments: Any, **more: Any) -> int:
        if Path(path) == tmp_path:
            raise PermissionError("folders are not opened here")
        return real(path, *arguments, **more)

    monkeypatch.setattr(os, "open", refuse)
    write_whole(tmp_path / "file", "x")
    assert (tmp_path / "file").read_text() == "x" and names(tmp_path) == ["file"]


@pytest.mark.parametrize("mask", [0o022, 0o077, 0o002])
def test_permissions_follow_the_umask(tmp_path: Path, mask: int) -> None:
    """As those of any file that Python opens, not only for the owner as those of temporary files."""
    before = os.umask(mask)
    try:
        write_whole(tmp_path / "whole", "x")
        (tmp_path / "plain").write_text("x")
    finally:
        os.umask(before)
    modes = [stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("whole", "plain")]
    assert modes[0] == modes[1] == 0o666 & ~mask


def test_threads_that_write_one_file_do_not_meet(tmp_path: Path) -> None:
    """All stand in the middle of writing at once; the last content is whole, nothing is left aside."""
    path, barrier, errors = tmp_path / "file", threading.Barrier(8), []

    def write(letter: bytes) -> None:
        def halves(file: IO[bytes]) -> None:
            file.write(letter * 5000)
            barrier.wait(timeout=60)
            file.write(letter * 5000)

        try:
            write_whole(path, halves)
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=write, args=(b"%d" % k,)) for k in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    content = path.read_bytes()
    assert errors == [] and content == content[:1] * 10_000 and names(tmp_path) == ["file"]


def test_processes_that_write_one_file_do_not_meet(tmp_path: Path) -> None:
    """Each writes it 100 times while it is read: every reading is one of the contents, whole."""
    path = tmp_path / "file"
    write_whole(path, "0" * 10_000)
    code = "import sys; from somatopy.files import write_whole\n"
    code += "for _ in range(100): write_whole(sys.argv[1], sys.argv[2] * 10_000)"
    writers = [subprocess.Popen([sys.executable, "-c", code, str(path), letter]) for letter in "12"]
    seen = set()
    while any(writer.poll() is None for writer in writers):
        content = path.read_text()
        assert content == content[:1] * 10_000
        seen.add(content[0])
    assert [writer.returncode for writer in writers] == [0, 0]
    assert seen <= set("012") and names(tmp_path) == ["file"]


def test_a_process_that_is_killed_leaves_a_file_aside_that_is_known_as_such(tmp_path: Path) -> None:
    """The old content stays; whoever cleans up knows what is half written, and the next writing is not disturbed."""
    path = tmp_path / "file"
    path.write_text("old")
    code = "import os, sys; from somatopy.files import write_whole\n"
    code += "write_whole(sys.argv[1], lambda file: (file.write(b'half'), file.flush(), os.kill(os.getpid(), 9)))"
    done = subprocess.run([sys.executable, "-c", code, str(path)], check=False)
    assert done.returncode == -9 and path.read_text() == "old"
    left = [name for name in tmp_path.iterdir() if name != path]
    assert [is_aside(name) for name in left] == [True]
    write_whole(path, "new")
    assert path.read_text() == "new"


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        (".summary.json.123-0a1b2c3d.partial", True),
        ("summary.json", False),
        ("summary.json.partial", False),
        (".hidden", False),
        ("part-00000.parquet", False),
    ],
)
def test_only_what_was_left_aside_counts_as_such(name: str, expected: bool) -> None:
    """In any folder; a user's own hidden file, or one called partial, is not taken for it."""
    assert is_aside(Path(name)) is expected
    assert is_aside(Path("a.partial") / name) is expected


# -- the cache -------------------------------------------------------------------------------------------------------


def test_the_cache_is_where_the_user_has_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In XDG_CACHE_HOME, or else in .cache of the home folder; a folder for each purpose, which is not yet made."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert cache_folder("ceilings") == tmp_path / "cache" / "somatopy" / "ceilings"
    for nothing in ("", None):
        if nothing is None:
            monkeypatch.delenv("XDG_CACHE_HOME")
        else:
            monkeypatch.setenv("XDG_CACHE_HOME", nothing)
        monkeypatch.setattr(Path, "home", lambda: tmp_path / "me")
        assert cache_folder("arms") == tmp_path / "me" / ".cache" / "somatopy" / "arms"
    assert names(tmp_path) == []


def test_a_user_without_a_home_has_no_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever asks then works without one."""

    def homeless() -> Path:
        raise RuntimeError("could not determine home directory")

    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(Path, "home", homeless)
    assert cache_folder("ceilings") is None


def test_a_full_disk_is_told_with_the_file(tmp_path: Path) -> None:
    """The system names none. The old content stays, and nothing beside it."""
    file = tmp_path / "note.txt"
    file.write_text("old")

    def fill(file: IO[bytes]) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(OSError, match=rf"No space left on device: '{file}'"):
        write_whole(file, fill)
    assert file.read_text() == "old" and [*tmp_path.iterdir()] == [file]
