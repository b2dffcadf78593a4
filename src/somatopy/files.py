"""Writing files whole or not at all, and the user's cache folder."""

from __future__ import annotations

import errno
import json
import os
import secrets
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

__all__ = ["cache_folder", "is_aside", "write_json", "write_whole"]

_ASIDE = ".partial"


def write_whole(path: str | os.PathLike[str], content: bytes | str | Callable[[IO[bytes]], Any]) -> None:
    """Write a file whole or not at all: under another name first, which is then changed to the right one.

    Other processes that read `path` meanwhile, or after a crash at any moment, find either the old or the new content.
    When the function returns, the new content is on the disk. Several processes may write the same file at once, since
    each first writes under a name of its own.

    Args:
        path: the file; its folder must exist.
        content: bytes, text (written as UTF-8), or a function that writes to the open binary file.

    Raises:
        OSError: the file cannot be written. The old content stays.

    Example:
        >>> from tempfile import TemporaryDirectory
        >>> folder = TemporaryDirectory()
        >>> write_whole(Path(folder.name) / "note.txt", "whole")
        >>> (Path(folder.name) / "note.txt").read_text()
        'whole'
        >>> folder.cleanup()
    """
    with _aside(Path(path)) as file:
        if callable(content):
            content(file)
        else:
            file.write(content.encode() if isinstance(content, str) else content)


def write_json(path: Path, table: Mapping[str, Any]) -> None:
    """Write a table as JSON, whole or not at all.

    Raises:
        ValueError: a number is NaN or infinite, which JSON cannot hold. The old content stays.
        OSError: the file cannot be written. The old content stays.
    """
    write_whole(path, json.dumps(table, indent=2, allow_nan=False) + "\n")


@contextmanager
def _aside(path: Path) -> Iterator[IO[bytes]]:
    aside = path.with_name(f".{path.name}.{os.getpid()}-{secrets.token_hex(4)}{_ASIDE}")
    try:
        with aside.open("xb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        if path.is_dir():
            raise IsADirectoryError(errno.EISDIR, "A folder has the name of the file. Move it away", str(path))
        os.replace(aside, path)
    except BaseException as error:
        aside.unlink(missing_ok=True)
        if isinstance(error, OSError) and error.errno is not None and error.filename is None:
            error.filename = str(path)  # a full disk names no file
        raise
    _sync_folder(path.parent)


def _sync_folder(folder: Path) -> None:
    """Write the new name to the disk, if the system can open folders."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def is_aside(path: Path) -> bool:
    """Whether a file is an unfinished one, which a crash has left behind."""
    return path.name.startswith(".") and path.name.endswith(_ASIDE)


def cache_folder(name: str) -> Path | None:
    """The folder of this name in the user's cache. It may not exist yet. None if the user has no home folder."""
    try:
        root = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    except RuntimeError:
        return None
    return Path(root) / "somatopy" / name
