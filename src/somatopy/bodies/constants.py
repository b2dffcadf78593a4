"""Copies the constants of a model, such as masses, to the parts that are stepped in its place."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Sequence
from copy import copy
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from somatopy._jit import jit

__all__ = ["Constants", "Watch", "places", "saved"]

_SORTS = {"body": "nbody", "jnt": "njnt", "geom": "ngeom", "actuator": "nu"}
_NUMBERS = (np.float64, np.float32, np.bool_)
#: Numbers of geoms that are whole: how they touch. Other whole numbers are places in the model, its own in each part.
_WHOLE = ("geom_contype", "geom_conaffinity", "geom_condim", "geom_priority")
_FAR = 4096  # bytes


def places(model: mujoco.MjModel, joints: Sequence[int], of: str) -> NDArray[np.int64]:
    """Indices of joints, in their order: in `qpos` if `of` is "qpos", in `qvel` if it is "dof"."""
    starts = {"qpos": model.jnt_qposadr, "dof": model.jnt_dofadr}[of]
    ends = np.append(starts[1:], {"qpos": model.nq, "dof": model.nv}[of])
    return np.concatenate([np.arange(starts[k], ends[k]) for k in joints]).astype(np.int64)


def saved(model: mujoco.MjModel) -> bytes:
    """All numbers of a model as bytes, except the size of pictures, which drawing changes."""
    model = copy(model)
    model.vis.global_.offwidth = model.vis.global_.offheight = 0
    content = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, content)
    return content.tobytes()


class Constants:
    """Keeps those constants of a part equal that it shares with the whole model.

    Args:
        whole: the whole model.
        part: the model of the part.
        joints: indices of the part's joints in the whole model, in the order of the part.
    """

    def __init__(self, whole: mujoco.MjModel, part: mujoco.MjModel, joints: Sequence[int]) -> None:
        self._options = whole.opt, part.opt
        rows = {"jnt": np.array(joints, np.int64)}
        for sort, find in (("body", "body"), ("geom", "geom"), ("actuator", "actuator")):
            mine, theirs = getattr(part, find), getattr(whole, find)
            rows[sort] = np.array([theirs(mine(k).name).id for k in range(getattr(part, _SORTS[sort]))], np.int64)
        self._shared = [
            (getattr(whole, name), rows[sort], getattr(part, name))
            for sort in _SORTS
            for name in _names(whole, f"{sort}_", getattr(whole, _SORTS[sort]))
        ]
        for prefix, size, of in (("dof_", whole.nv, "dof"), ("qpos", whole.nq, "qpos")):
            there = places(whole, joints, of)
            self._shared += [(getattr(whole, n), there, getattr(part, n)) for n in _names(whole, prefix, size)]
        part.stat.meaninertia = whole.stat.meaninertia

    @property
    def sources(self) -> list[NDArray[Any]]:
        """The arrays of the whole model that are copied."""
        return [_memory(self._options[0]), *(source for source, _, _ in self._shared)]

    def renew(self) -> bool:
        """Copy what has changed in the whole model. Returns whether anything had."""
        changed = [(rows, source, mine) for source, rows, mine in self._shared if (source[rows] != mine).any()]
        for rows, source, mine in changed:
            mine[:] = source[rows]
        return _renew_options(*self._options) or bool(changed)


def _names(model: mujoco.MjModel, prefix: str, size: int) -> Iterator[str]:
    for name in filter(lambda name: name.startswith(prefix), dir(model)):
        value = getattr(model, name)
        if isinstance(value, np.ndarray) and len(value) == size and (value.dtype in _NUMBERS or name in _WHOLE):
            yield name


def _memory(options: Any) -> NDArray[np.uint8]:
    """The bytes of a model's options: floats and vectors of them, of which `o_friction` is the last, then integers."""
    values = [getattr(options, name) for name in dir(options) if not name.startswith("_")]
    whole = 4 * sum(isinstance(value, int) for value in values)
    floats = 8 * sum(np.size(value) for value in values if not isinstance(value, int))
    last = options.o_friction.ctypes.data + options.o_friction.nbytes
    memory: Any = (ctypes.c_uint8 * (floats + whole)).from_address(last - floats)
    return np.frombuffer(memory, np.uint8)


def _renew_options(whole: Any, mine: Any) -> bool:
    changed = False
    for name in filter(lambda name: not name.startswith("_"), dir(whole)):
        value = getattr(whole, name)
        if np.array_equal(value, getattr(mine, name)):
            continue
        changed = True
        if isinstance(value, np.ndarray):
            getattr(mine, name)[:] = value
        else:
            setattr(mine, name, value)
    return changed


class Watch:
    """Notices that arrays have changed, by comparing the memory in which they lie.

    Args:
        arrays: arrays of one model. They lie near each other in memory.
    """

    def __init__(self, arrays: Sequence[NDArray[Any]]) -> None:
        self._spans = [_words(*span) for span in _spans(arrays)]
        self._seen = [span.copy() for span in self._spans]

    def changed(self) -> bool:
        """Whether any byte has changed since the last call."""
        if all(_same(now, seen) for now, seen in zip(self._spans, self._seen, strict=True)):
            return False
        self._seen = [span.copy() for span in self._spans]
        return True


def _spans(arrays: Sequence[NDArray[Any]]) -> list[list[int]]:
    """First and last address of stretches of memory that hold the arrays and hardly anything else."""
    spans: list[list[int]] = []
    for first, last in sorted((a.ctypes.data, a.ctypes.data + a.nbytes) for a in arrays if a.size):
        if spans and first - spans[-1][1] < _FAR:
            spans[-1][1] = max(spans[-1][1], last)
        else:
            spans.append([first, last])
    return spans


def _words(first: int, last: int) -> NDArray[np.uint64]:
    """The memory between two addresses, by eight bytes; MuJoCo's arrays begin at multiples of 64."""
    memory: Any = (ctypes.c_uint64 * -(-(last - first) // 8)).from_address(first)
    return np.frombuffer(memory, np.uint64)


@jit
def _same(now: NDArray[np.uint64], seen: NDArray[np.uint64]) -> bool:
    different = np.uint64(0)
    for k in range(now.size):
        different |= now[k] ^ seen[k]
    return bool(different == np.uint64(0))
