"""Checkpoints: nested states, stored as arrays and JSON in one file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from somatopy.experiment.description import DescriptionError
from somatopy.files import write_whole

__all__ = ["CHECKPOINT", "read_checkpoint", "size_of", "write_checkpoint"]

#: The file's name in a run folder.
CHECKPOINT = "checkpoint.npz"
_PLAIN = "plain"
#: Stands in the place of an array, with the array's number.
_ARRAY = "array in this file, by its number"


def write_checkpoint(path: Path, state: dict[str, Any]) -> None:
    """Write nested dictionaries of arrays and plain values to a file, whole or not at all.

    Args:
        path: the file, .npz.
        state: a dictionary whose keys are text. Its values are arrays, numbers, text, lists of numbers or text, or
            dictionaries of the same sort.

    Raises:
        TypeError: the state holds something else; the message says where.
    """
    arrays: list[np.ndarray[Any, Any]] = []
    try:
        plain = json.dumps(_parted(state, arrays))
    except TypeError as error:
        raise TypeError(
            f"{path} cannot be written, because of {_unfit(state)}: {error}. A state() may hold arrays, numbers, text, "
            "lists of numbers or text, and dictionaries of these."
        ) from error
    named = {f"array-{number}": array for number, array in enumerate(arrays)}
    write_whole(path, lambda file: np.savez(file, allow_pickle=False, **{_PLAIN: np.array(plain)}, **named))


def read_checkpoint(path: Path) -> dict[str, Any]:
    """Read what `write_checkpoint` has written.

    Raises:
        DescriptionError: the file is missing, broken or no checkpoint.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            state = _joined(json.loads(str(file[_PLAIN])), file)
    except Exception as error:  # a damaged archive raises errors of a dozen kinds
        raise DescriptionError(f"{path} is no checkpoint that can be read: {_why(error)}. {_mend(path)}") from error
    if not isinstance(state, dict):
        raise DescriptionError(f"{path} is no checkpoint that can be read: it holds no table. {_mend(path)}")
    return state


def _why(error: Exception) -> str:
    """What is wrong with a file; NumPy advises to unpickle whatever it does not know."""
    return "it is no file of NumPy's" if "pickle" in str(error) else str(error).rstrip(".")


def _mend(path: Path) -> str:
    """How to go on without a checkpoint: the end of a phase is one, too."""
    ends = sorted(path.parent.glob("phase-*.npz"), key=lambda end: (len(end.name), end.name))
    others = [end.name for end in ends if end != path]
    if not others:
        return "Restore it from a copy, or run the experiment again into another folder."
    return f"Restore it from a copy, or copy {others[-1]} over it: the run then goes on from the end of that phase."


def size_of(state: Any) -> int:
    """Size of a state in bytes: that of its arrays, and eight bytes for each plain value.

    Example:
        >>> size_of({"weights": np.zeros((3, 2)), "rng": {"seed": 5, "kind": "PCG64"}})
        64
    """
    if isinstance(state, np.ndarray):
        return state.nbytes
    if isinstance(state, dict | list | tuple):
        return sum(map(size_of, state.values() if isinstance(state, dict) else state))
    return 8


def _parted(value: Any, arrays: list[np.ndarray[Any, Any]]) -> Any:
    """The value with its arrays moved to `arrays`, and a note in the place of each."""
    if isinstance(value, np.ndarray):
        if value.dtype.hasobject:
            raise TypeError("it is an array of objects")
        arrays.append(value)
        return {_ARRAY: len(arrays) - 1}
    if isinstance(value, dict):
        return {key: _parted(item, arrays) for key, item in value.items()}
    return value.item() if isinstance(value, np.generic) else value


def _unfit(value: Any, where: str = "") -> str | None:
    """Dotted keys of the first value that is neither an array nor plain; None if all are."""
    if isinstance(value, dict):
        return next((found for key, item in value.items() if (found := _unfit(item, f"{where}.{key}"))), None)
    try:
        json.dumps(_parted(value, []))
    except TypeError:
        return where.removeprefix(".")
    return None


def _joined(value: Any, file: Any) -> Any:
    """The value with its arrays back in their places."""
    if not isinstance(value, dict):
        return value
    if _ARRAY in value:
        return file[f"array-{int(value[_ARRAY])}"]
    return {key: _joined(item, file) for key, item in value.items()}
