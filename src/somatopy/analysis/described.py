"""What the analysis reads of experiment.toml; what is missing or wrong there is named, and nothing is imported."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

from somatopy.analysis.runs import Run, RunFolderError

__all__ = ["PROVENANCE", "kind_of", "leaves", "on_papers_robot", "phases_of", "remarks_of", "setting", "written_by"]

#: Keys of experiment.toml that say who wrote it, what to cite and what to know, and not what was run.
PROVENANCE = ("cite", "format", "remarks", "resumed", "versions", "written_by")


def setting(run: Run, *keys: str) -> Any:
    """A value of the description, by the keys that lead to it.

    Raises:
        RunFolderError: a key is missing.
    """
    value: Any = run.description
    for depth, key in enumerate(keys):
        if not isinstance(value, dict) or key not in value:
            where = f"[{'.'.join(keys[:depth])}] in " if depth else ""
            raise RunFolderError(f"{where}{run.path / 'experiment.toml'} lacks {key!r}: it does not describe a run.")
        value = value[key]
    return value


def kind_of(run: Run, part: str) -> str:
    """The kind of a part of the experiment: "body", "eye", "learner".

    Raises:
        RunFolderError: the part is not described, or its kind is no text.
    """
    kind = setting(run, part, "kind")
    if not isinstance(kind, str):
        raise _wrong(run, f"{part}.kind = {kind!r}", "a text")
    return kind


def on_papers_robot(run: Run) -> bool:
    """Whether a run is one of the simulated NAO, so that it can stand beside the paper's numbers: see its body."""
    body = run.description.get("body")
    return isinstance(body, dict) and body.get("kind") == "mujoco" and body.get("model", "nao") == "nao"


def remarks_of(run: Run) -> list[str]:
    """What interventions remarked on before the first frame, such as what stands for the paper's damage."""
    remarks = run.description.get("remarks", [])
    return [str(remark) for remark in remarks] if isinstance(remarks, list) else []


def phases_of(run: Run) -> list[dict[str, Any]]:
    """The phases of the description.

    Raises:
        RunFolderError: they are no tables, or their frames, interventions or trend breaks are none.
    """
    phases = setting(run, "phases")
    if not _are_tables(phases):
        raise _wrong(run, "phases", "a list of tables")
    for index, phase in enumerate(phases):
        done, breaks, frames = phase.get("interventions", []), phase.get("trend_breaks", []), phase.get("frames", 0)
        if not _are_tables(done) or not all(isinstance(entry.get("kind"), str) for entry in done):
            raise _wrong(run, f"phases.{index}.interventions", "a list of tables, each with its kind")
        if not isinstance(breaks, list) or not _increase([0, *breaks]):
            raise _wrong(run, f"phases.{index}.trend_breaks = {breaks!r}", "a list of windows in order, such as [7]")
        if not isinstance(frames, int):
            raise _wrong(run, f"phases.{index}.frames = {frames!r}", "a whole number")
    found: list[dict[str, Any]] = phases
    return found


def written_by(run: Run) -> list[str]:
    """By what the run was written, one line for each program that did: versions, commit, Python, platform."""
    later = run.description.get("resumed", [])
    tables = [run.description, *(later if _are_tables(later) else [])]
    return [line for table in tables if (line := _author(table))]


def leaves(value: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted keys of a description with their values; lists of plain values are values.

    Example:
        >>> dict(leaves({"seed": 3, "phases": [{"frames": 9, "trend_breaks": [7]}]}))
        {'seed': 3, 'phases.0.frames': 9, 'phases.0.trend_breaks': [7]}
    """
    items: Iterator[tuple[Any, Any]]
    if isinstance(value, dict):
        items = iter(value.items())
    elif isinstance(value, list) and any(isinstance(entry, dict) for entry in value):
        items = iter(enumerate(value))
    else:
        yield prefix, value
        return
    for key, entry in items:
        yield from leaves(entry, f"{prefix}.{key}" if prefix else str(key))


def _author(table: dict[str, Any]) -> str:
    found = [table[key] for key in ("versions", "written_by") if isinstance(table.get(key), dict)]
    start = [f"from frame {table['frame']} on"] if "frame" in table else []
    return ", ".join([*start, *(f"{name} {told}" for entries in found for name, told in entries.items())])


def _are_tables(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(entry, dict) for entry in value)


def _increase(values: list[Any]) -> bool:
    return all(isinstance(value, int) for value in values) and all(a < b for a, b in pairwise(values))


def _wrong(run: Run, what: str, needed: str) -> RunFolderError:
    return RunFolderError(f"{what} in {run.path / 'experiment.toml'} must be {needed}: it does not describe a run.")
