"""Calls MuJoCo's functions from compiled code, so that no Python runs between the physics steps of a frame.

MuJoCo's Python package contains MuJoCo's C library. The functions are looked up in that library by name, and called
with the addresses of model and data. Where a name cannot be found, `function` returns 0, and the caller uses Python.
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, cast

import mujoco
from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.extending import intrinsic

__all__ = ["call", "function"]


@cache
def function(name: str) -> int:
    """The address of MuJoCo's C function `name(model, data)`, or 0 if it cannot be found."""
    library = _library()
    found = getattr(library, name, None)
    return 0 if found is None else ctypes.cast(found, ctypes.c_void_p).value or 0


@cache
def _library() -> ctypes.CDLL | None:
    """The library that MuJoCo's Python package has loaded; opened again, it is the same one."""
    version, folder = mujoco.mj_versionString(), Path(mujoco.__file__).parent
    name = {"darwin": f"libmujoco.{version}.dylib", "win32": "mujoco.dll"}.get(sys.platform, f"libmujoco.so.{version}")
    try:
        return ctypes.CDLL(str(folder / name))
    except OSError:
        return None


def _call(typing: Any, function: Any, model: Any, data: Any) -> tuple[Any, Callable[..., Any]]:
    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        address = ir.IntType(64)
        kind = ir.FunctionType(ir.VoidType(), [address, address])
        builder.call(builder.inttoptr(arguments[0], kind.as_pointer()), arguments[1:])
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.int64), code


#: In compiled code: call the function at an address with the addresses of a model and its data.
call = cast("Callable[[int, int, int], None]", intrinsic(_call))
