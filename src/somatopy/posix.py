"""What experiments need of the operating system: locks on files, and the most memory that a process has used.

Linux and macOS have both, Windows has neither. Maps and links need neither, so that they work on Windows, too.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

__all__ = ["NotPosix", "alone", "peak_memory", "require"]

#: Modules of Python that only some systems have: locks on files, and the memory that a process uses.
_NEEDED = ("fcntl", "resource")


class NotPosix(RuntimeError):
    """The operating system lacks what experiments need."""


def require() -> None:
    """Do nothing where experiments can run.

    Raises:
        NotPosix: they cannot run on this operating system. The message says what is missing and where they can run.

    Example:
        >>> require()  # on Linux and on macOS
    """
    missing = [name for name in _NEEDED if find_spec(name) is None]
    if missing:
        raise NotPosix(
            f"Experiments cannot run on this operating system: it lacks file locks or memory accounting, so that "
            f"Python has no module {' and no module '.join(missing)} here. Linux and macOS have both. On Windows, "
            "install somatopy in the Windows Subsystem for Linux (WSL) or in a Linux container, and run experiments "
            "there. Maps and links work here as they are."
        )


@contextmanager
def alone(path: Path, wait: bool = False) -> Iterator[None]:
    """Hold a lock file; the lock goes with the process, however it ends.

    Args:
        path: the lock file; it is made if it is not there, and stays.
        wait: whether to wait until no other process holds it.

    Raises:
        BlockingIOError: another process holds it.
        NotPosix: this operating system has no such locks.
        OSError: the file cannot be made.

    Example:
        >>> import tempfile
        >>> with alone(Path(tempfile.mkdtemp()) / ".lock"):
        ...     print("nobody else is here")
        nobody else is here
    """
    require()
    import fcntl

    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        yield


def peak_memory() -> int:
    """The most memory that this process has used so far, bytes.

    Raises:
        NotPosix: this operating system does not tell it.
    """
    require()
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024  # Linux tells kilobytes
