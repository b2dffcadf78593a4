"""Compilation with numba: typed, kept on disk for the next process, and working where no folder can be written.

A compiled kernel contains the kernels that it calls, from other files too, but numba looks only at the file of the
kernel itself to tell whether what it kept is still true. Here compiled code is kept under a digest of all sources of
somatopy that hold kernels, so that an edit in any of them is seen by all. Numba's own cache, and with it that of every
other package, stays as it is.
"""

from __future__ import annotations

import hashlib
import pickle
import re
import shutil
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

import numba
from numba.core.caching import FunctionCache, IndexDataCacheFile

__all__ = ["jit", "jit_inlined"]

P = ParamSpec("P")
R = TypeVar("R")

PREFIX = "somatopy-"  # leads the names of our folders, so that only ours are ever removed


def jit(function: Callable[P, R]) -> Callable[P, R]:
    """Compile `function` when it is first called, without the interpreter lock and with NumPy's rules for division.

    The compiled code is kept on disk for the next process if numba finds a folder that it can write to, and is
    compiled anew in each process if it finds none.
    """
    return _kept(function, numba.njit(nogil=True, error_model="numpy")(function))


def jit_inlined(function: Callable[P, R]) -> Callable[P, R]:
    """Compile as `jit` does, and make the code a part of every kernel that calls it.

    It is for short loops inside longer ones. Left to itself, the compiler often calls them, and passing arrays then
    takes as long as the loop.
    """
    return _kept(function, numba.njit(nogil=True, error_model="numpy", forceinline=True)(function))


def _kept(function: Callable[P, R], kernel: Any) -> Callable[P, R]:
    """A kernel, with its compiled code kept on disk where that is possible."""
    if hasattr(kernel, "enable_caching"):  # NUMBA_DISABLE_JIT gives the function itself back
        with suppress(RuntimeError):  # numba: "cannot cache function ...: no locator available for file ..."
            kernel._cache = KernelCache(function)
    return cast("Callable[P, R]", kernel)


class KernelCache(FunctionCache):
    """Numba's cache of one kernel, in a folder of its own under the digest of all kernels' sources.

    Raises:
        RuntimeError: if there is no folder that can be written to.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        chosen, locator = self._cache_path, self._impl.locator
        self._cache_path = str(Path(chosen) / f"{PREFIX}{digest_at_start()}")
        self._cache_file = KernelFiles(self._cache_path, self._impl.filename_base, locator.get_source_stamp())
        remove_older(chosen)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep compiled code, unless a source was edited since this process started: its kernels may be a mixture."""
        if source_digest() != digest_at_start():
            return
        with suppress(OSError):  # a full disk, or another process that removed the folder just now
            Path(self._cache_path).mkdir(parents=True, exist_ok=True)
            super().save_overload(sig, data)  # type: ignore[no-untyped-call]


class KernelFiles(IndexDataCacheFile):
    """One file for each compiled signature, written whole.

    Numba's index gives signatures numbers, and two processes that start at once may give two signatures the same
    number. Here the name of a file is a digest of what it is for, and the file says so again.
    """

    def __init__(self, folder: str, kernel: str, stamp: Any) -> None:
        super().__init__(folder, kernel, stamp)  # type: ignore[no-untyped-call]
        self._kernel = kernel

    def save(self, key: Any, data: Any) -> None:
        """Keep what was compiled for a key."""
        self._save_data(self._file_name(key), (self._source_stamp, key, data))  # type: ignore[no-untyped-call]

    def load(self, key: Any) -> Any:
        """What was compiled for a key from the same source; None if nothing, or nothing readable, was kept."""
        try:
            stamp, kept, data = self._load_data(self._file_name(key))  # type: ignore[no-untyped-call]
        except (OSError, EOFError, ValueError, pickle.UnpicklingError):
            return None
        return data if (stamp, kept) == (self._source_stamp, key) else None

    def flush(self) -> None:
        """Forget all signatures of this kernel."""
        for file in Path(self._cache_path).glob(f"{self._kernel}.*.nbc"):
            file.unlink(missing_ok=True)

    def _file_name(self, key: Any) -> str:
        what = hashlib.sha256(repr((numba.__version__, key)).encode()).hexdigest()
        return f"{self._kernel}.{what[:16]}.nbc"


def source_digest() -> str:
    """A digest of all sources of somatopy that hold compiled kernels, or what these import, as they are now."""
    package, digest = Path(__file__).parent, hashlib.sha256()
    texts = {file: file.read_bytes() for file in package.rglob("*.py")}
    kernels = [file for file, text in texts.items() if b"@jit" in text]
    imported = {
        package.joinpath(*name.decode().split(".")).with_suffix(".py")
        for file in kernels
        for name in re.findall(rb"^from somatopy\.([\w.]+) import", texts[file], re.MULTILINE)
    }
    for file in sorted({*kernels, *(imported & texts.keys())}):
        digest.update(str(file.relative_to(package)).encode() + b"\0" + texts[file] + b"\0")
    return digest.hexdigest()[:16]


@cache
def digest_at_start() -> str:
    """The same as it was when this process defined its first kernel."""
    return source_digest()


@cache
def remove_older(folder: str) -> None:
    """Remove our folders of other digests, once for each folder that holds some."""
    for other in Path(folder).glob(f"{PREFIX}*"):
        if other.name != f"{PREFIX}{digest_at_start()}":
            shutil.rmtree(other, ignore_errors=True)
