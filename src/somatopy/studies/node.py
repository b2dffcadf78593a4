"""What Ray workers do on a machine of the cluster: they run each cell in a process of its own, and clean up.

This module imports little, because each CPU has a Ray worker beside the process that does the work.
"""

from __future__ import annotations

import shutil
import socket
import tempfile
import time
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from somatopy.studies.local import Local
from somatopy.studies.task import Task

__all__ = ["remove", "run_cell"]

_PROCESS: list[Local] = []


def run_cell(task: list[Any], scratch: str, needed: dict[str, str]) -> tuple[list[dict[str, Any]] | None, str, str]:
    """Run a cell in the process of this Ray worker.

    Args:
        task: a `Task`, as plain data.
        scratch: name of the study's folders on machines.
        needed: versions of packages.

    Returns:
        The rows of the cell, None if it failed; why it failed; the machine.
    """
    node = _node()
    there = {name: _version(name) for name in needed}
    if wrong := [f"{name} {there[name]} instead of {needed[name]}" for name in needed if there[name] != needed[name]]:
        return None, f"{socket.gethostname()} has {', '.join(wrong)}; install the same versions there", node
    folder = _folder(scratch, node)
    folder.mkdir(parents=True, exist_ok=True)
    if not _PROCESS:
        _PROCESS.append(Local(folder, 1))
    _PROCESS[0].submit(Task(*task))
    outcome = _PROCESS[0].next()
    return outcome.rows, outcome.cause, node


def remove(scratch: str, name: str, pause: float) -> None:
    """Remove what a study has written on this machine.

    Args:
        scratch: name of the study's folders on machines.
        name: what is removed; all if "".
        pause: how long to wait before, s.
    """
    time.sleep(pause)
    folder = _folder(scratch, _node())
    shutil.rmtree(folder / name, ignore_errors=True)
    if not name and folder.parent.exists() and not any(folder.parent.iterdir()):
        shutil.rmtree(folder.parent, ignore_errors=True)


def _folder(scratch: str, node: str) -> Path:
    """What the Ray workers of one machine share; one machine may be two of a cluster."""
    return Path(tempfile.gettempdir()) / scratch / node[:12]


def _node() -> str:
    import ray

    return str(ray.get_runtime_context().get_node_id())


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"
