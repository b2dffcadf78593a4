"""Compilation with numba, typed, and working where no folder for the compiled code can be written."""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

import numba

__all__ = ["jit"]

P = ParamSpec("P")
R = TypeVar("R")


def jit(function: Callable[P, R]) -> Callable[P, R]:
    """Compile `function` when it is first called, without the interpreter lock and with NumPy's rules for division.

    The compiled code is kept on disk for the next process if numba finds a folder that it can write to, and is
    compiled anew in each process if it finds none.
    """
    try:
        return cast("Callable[P, R]", numba.njit(cache=True, nogil=True, error_model="numpy")(function))
    except RuntimeError:  # numba: "cannot cache function ...: no locator available for file ..."
        return cast("Callable[P, R]", numba.njit(cache=False, nogil=True, error_model="numpy")(function))
