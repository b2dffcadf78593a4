"""Checkpoints: the whole simulated side as arrays and JSON in one file, and a lock on the run folder."""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from somatopy.experiment.description import DescriptionError

__all__ = ["FILE", "locked", "read_checkpoint", "write_checkpoint"]

FILE = "checkpoint.npz"
_PLAIN = "plain"


def write_checkpoint(path: Path, state: dict[str, Any]) -> None:
    """Write nested dictionaries of arrays and plain values aside, then rename: there is always one whole checkpoint.

    Args:
        path: the file, .npz.
        state: its keys are text without slashes; its values arrays, numbers, text, lists, or more of the same.
    """
    arrays: dict[str, np.ndarray[Any, Any]] = {}
    plain = _split(state, "state", arrays)
    aside = path.with_name(path.name + ".partial")
    with aside.open("wb") as file:
        np.savez(file, allow_pickle=False, **{_PLAIN: np.array(json.dumps([plain, list(arrays)]))}, **arrays)
    os.replace(aside, path)


def read_checkpoint(path: Path) -> dict[str, Any]:
    """What `write_checkpoint` wrote.

    Raises:
        DescriptionError: the file is missing, broken or no checkpoint.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            plain, names = json.loads(str(file[_PLAIN]))
            state: dict[str, Any] = plain
            for name in names:
                _, *tables, key = name.split("/")
                table = state
                for part in tables:
                    table = table[part]
                table[key] = file[name]
    except (OSError, ValueError, KeyError, TypeError, EOFError, RuntimeError, BadZipFile) as error:
        raise DescriptionError(f"{path} is no checkpoint that can be read: {error}.") from error
    return state


def _split(value: Any, path: str, arrays: dict[str, np.ndarray[Any, Any]]) -> Any:
    """Move arrays out of nested dictionaries, to `arrays` by their path; what is left is plain."""
    if isinstance(value, np.ndarray):
        arrays[path] = value
        return None
    if isinstance(value, dict):
        return {key: _split(item, f"{path}/{key}", arrays) for key, item in value.items()}
    return value.item() if isinstance(value, np.generic) else value


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the run folder for this process; the lock goes with the process, however it ends.

    Raises:
        DescriptionError: another process holds it.
    """
    with (folder / ".lock").open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise DescriptionError(f"Another process is running in {folder}. Wait for it, or end it first.") from error
        yield
