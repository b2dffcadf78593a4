"""What experiments need of the operating system and Windows lacks: locks on files, and a process's peak memory.

Linux and macOS have both. Maps and links ask for neither, so that they work on Windows too.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

__all__ = ["NotPosix", "alone", "peak_memory"]


class NotPosix(RuntimeError):
    """This system lacks what an experiment needs of it."""


@contextmanager
def alone(path: Path, wait: bool = False) -> Iterator[None]:
    """Hold a lock file; the lock goes with the process, however it ends.

    Args:
        path: the lock file; it is made if it is not there, and stays.
        wait: whether to wait until no other process holds it.

    Raises:
        BlockingIOError: another process holds it.
        NotPosix: this system has no such locks.
        OSError: the file cannot be made.

    Example:
        >>> import tempfile
        >>> with alone(Path(tempfile.mkdtemp()) / ".lock"):
        ...     print("nobody else is here")
        nobody else is here
    """
    try:
        import fcntl
    except ImportError as error:
        raise NotPosix(
            "Run folders and studies are guarded by locks that this system does not have (Python's module fcntl is "
            "missing). Run experiments on Linux or macOS; on Windows the Subsystem for Linux (WSL) will do. Maps and "
            "links work here."
        ) from error
    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        yield


def peak_memory() -> int:
    """Most memory that this process has had, bytes; macOS tells bytes, Linux kilobytes."""
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024
