"""Runs that differ in nothing but their seed, together: a study made of run folders."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from somatopy.analysis.cells import StudyResult, measures, to_table
from somatopy.analysis.described import PROVENANCE, setting
from somatopy.analysis.runs import Run

__all__ = ["Group", "as_study", "grouped"]


@dataclass
class Group:
    """Runs of one description, whatever their names and seeds.

    Attributes:
        runs: name and folder, by seed.
        twice: names of further runs whose seed another run of the group has; they do not count.
    """

    runs: dict[int, tuple[str, Run]] = field(default_factory=dict)
    twice: list[str] = field(default_factory=list)

    @property
    def name(self) -> str:
        """What the group is called: after its first run."""
        first = next(iter(self.runs.values()))[0]
        more = len(self.runs) - 1
        return f"{first} and {more} more" if more else first


def grouped(named: Iterable[tuple[str, Run]]) -> list[Group]:
    """Group runs by their descriptions, in the order of their first runs.

    Args:
        named: runs, each with its name.

    Raises:
        RunFolderError: a description has no seed.
    """
    groups: dict[str, Group] = {}
    for name, run in named:
        group, seed = groups.setdefault(_said(run), Group()), int(setting(run, "seed"))
        if seed in group.runs:
            group.twice.append(name)
        else:
            group.runs[seed] = (name, run)
    return list(groups.values())


def _said(run: Run) -> str:
    """What was run, without seed, name and provenance."""
    told = {key: value for key, value in run.description.items() if key not in (*PROVENANCE, "name", "seed")}
    return json.dumps(told, sort_keys=True, default=str)


def as_study(groups: Sequence[Group]) -> StudyResult:
    """A study whose conditions are groups of runs. It stands in no folder: its path is the first run's.

    Raises:
        RunFolderError: see `measures`.
    """
    rows = [
        {"key": name, "condition": group.name, **row}
        for group in groups
        for name, run in group.runs.values()
        for row in measures(run)
    ]
    paths = [run.path for group in groups for _, run in group.runs.values()]
    return StudyResult(next(iter(paths), Path()), to_table(rows), [], {"order": [group.name for group in groups]})
