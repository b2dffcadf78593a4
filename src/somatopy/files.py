"""Files that are written whole or not at all, and the user's cache folder."""

from __future__ import annotations

import os
import secrets
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

__all__ = ["cache_folder", "is_aside", "write_whole"]

_ASIDE = ".partial"


def write_whole(path: str | os.PathLike[str], content: bytes | str | Callable[[IO[bytes]], Any]) -> None:
    """Write a file whole or not at all: aside first, then renamed into its place, and both are on the disk.

    Whoever reads `path` meanwhile, or after a crash at any moment, finds the old content or the new. Two writers at
    once do not meet: each writes aside under a name of its own.

    Args:
        path: the file; its folder must exist.
        content: bytes, text (written as UTF-8), or a function that writes to the open binary file.

    Raises:
        OSError: the file cannot be written; what was there stays.

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


@contextmanager
def _aside(path: Path) -> Iterator[IO[bytes]]:
    aside = path.with_name(f".{path.name}.{os.getpid()}-{secrets.token_hex(4)}{_ASIDE}")
    try:
        with aside.open("xb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        os.replace(aside, path)
    except BaseException:
        aside.unlink(missing_ok=True)
        raise
    _sync_folder(path.parent)


def _sync_folder(folder: Path) -> None:
    """Bring the renaming to the disk, where the system can open folders."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def is_aside(path: Path) -> bool:
    """Whether a file is one that a crash left aside, half written."""
    return path.name.startswith(".") and path.name.endswith(_ASIDE)


def cache_folder(name: str) -> Path | None:
    """The folder in the user's cache for one purpose; it may not exist yet. None where the user has no home."""
    try:
        root = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    except RuntimeError:
        return None
    return Path(root) / "somatopy" / name
