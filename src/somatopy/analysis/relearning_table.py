"""Learners and damages beside each other: how fast each learns, what each damage costs it, and how it comes back.

One table, of which a terminal and the page show the same cells. It is there for studies whose conditions have a damage
among their factors, as those of `somatopy compare`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from math import sqrt
from textwrap import fill
from typing import Any, NamedTuple

import numpy as np

from somatopy.analysis.cells import StudyResult
from somatopy.analysis.comparison_table import NONE
from somatopy.analysis.forks import against_forks, forks
from somatopy.analysis.phases import kind_name

__all__ = ["LEGEND", "Entry", "Relearning", "named_conditions", "relearning", "relearning_text"]

INTACT = "intact"
#: What one decimal would round to 100.
_WHOLE = 99.95
Rows = Sequence[Mapping[str, Any]]


class Head(NamedTuple):
    """A column of the table.

    Attributes:
        group: what stands above it and its neighbours.
        name: what stands above it alone.
        column: of the table of cells.
        scale: by what to multiply.
        form: format of a number.
        known: a column that is null where the measure does not apply; where it is not, null means never.
        healed: whether it tells of the phase in which the damage is undone.
    """

    group: str
    name: str
    column: str
    scale: float = 1.0
    form: str = ".1f"
    known: str | None = None
    healed: bool = False


_AFTER, _FORK = "after the damage", "% of the fork in window"
#: In the order of the table; what is lost, and how long, is counted against the undamaged fork.
HEADS = (
    Head("level", "%", "plateau", 100),
    *(Head("minutes to", f"{k} %", f"minutes_to_{k}", known="plateau") for k in (50, 90, 95)),
    Head(_AFTER, "dip %", "dip", 100, ".0f"),
    Head(_AFTER, "back", "fork_minutes_back", known="fork_1"),
    Head(_AFTER, "lost", "fork_deficit_minutes", form=".2f"),
    *(Head(_FORK, str(k), f"fork_{k}", 100) for k in (1, 2, 3)),
    Head(_FORK, "4-6", "fork_4_to_6", 100),
    Head("undone", "kept", "retention", 100, ".0f", healed=True),
    Head("undone", "back", "retention_minutes", known="retention", healed=True),
    Head("miss", "rad", "miss_distance_rad", form=".2f"),
    Head("learner", "us", "learner_us", form=".0f"),
    Head("learner", "kB", "learner_bytes", 1e-3, ".0f"),
)
#: Where no run of the study is undamaged, they are counted against the level before.
_WITHOUT_FORKS = {
    "fork_minutes_back": Head(_AFTER, "back", "minutes_back", known="dip"),
    "fork_deficit_minutes": Head(_AFTER, "lost", "deficit_minutes", form=".2f"),
}
_BEFORE = "the level before"
LEGEND = (
    "Each cell is the mean over seeds, and below it ± half of its 95 % interval (Student's t). Where some seeds never "
    "get there, the mean is that of the others, and below it stands how many they are. Minutes are robot time. Windows "
    "have five minutes.",
    "level: the efficiency of the last third of the phase.",
    "minutes to: how long it takes until a running minute has this share of the level.",
    "dip: the lowest running minute of the first five after the damage, as a share of the level before. In the row "
    "none it shows what chance alone makes.",
    "back: how long it takes until five running minutes, and all later ones, have 95 % of {level}.",
    "lost: by how many minutes of seeing the hand the run is behind {behind}.",
    "The fork is the same run without the damage. A run below 90 % of it in windows 4 to 6 is called lost.",
    "undone: the first minute after the damage is undone, as a share of the level before; and how long it takes until "
    "a running minute has 95 % of that level.",
    "miss: how far a head that misses is from the nearest head posture that would see the hand.",
    "us, kB: the microseconds that the learner alone takes in a frame, and the size of its state.",
)


class Cell(NamedTuple):
    """Two short texts: a mean, and its interval or how many seeds got there."""

    mean: str
    below: str


@dataclass(frozen=True)
class Entry:
    """A row: a learner under a damage, or before any.

    Attributes:
        learner: what is compared, without the damage.
        damage: the damage's name, or "intact" for the first phase.
        cells: one a head.
    """

    learner: str
    damage: str
    cells: tuple[Cell, ...]


@dataclass(frozen=True)
class Relearning:
    """The whole table.

    Attributes:
        heads: group and name of each column of which something is known.
        entries: learner by learner, the intact phase first; with a cell for each head.
        legend: what the columns mean.
    """

    heads: tuple[tuple[str, str], ...]
    entries: tuple[Entry, ...]
    legend: tuple[str, ...]

    def groups(self) -> list[tuple[str, list[str]]]:
        """What stands above neighbouring columns, with the names of these."""
        same = groupby(self.heads, key=lambda head: head[0])
        return [(group, [name for _, name in heads]) for group, heads in same]

    def learners(self) -> list[tuple[str, list[Entry]]]:
        """Each learner with its rows."""
        return [(name, list(rows)) for name, rows in groupby(self.entries, key=lambda entry: entry.learner)]


def relearning(result: StudyResult) -> Relearning | None:
    """The table of a study; None where its conditions have no damage among their factors, or nothing has a level."""
    named = named_conditions(result)
    if not named or not result.conditions:
        return None
    rows, heads = against_forks(result).table.to_pylist(), _heads(result)
    entries = []
    for learner in dict.fromkeys(each for each, _ in named.values()):
        conditions = {name: damage for name, (each, damage) in named.items() if each == learner}
        first = [row for row in rows if row["condition"] in conditions and row["phase"] == 0]
        order = [*conditions]  # all have the same first phase: the first condition that has a seed tells of it
        first.sort(key=lambda row: order.index(row["condition"]), reverse=True)
        intact = [*{row["seed"]: row for row in first}.values()]
        entries.append(Entry(learner, INTACT, tuple(_cell(head, intact, ()) for head in heads)))
        for name, damage in conditions.items():
            damaged, healed = ([r for r in rows if r["condition"] == name and r["phase"] == k] for k in (1, 2))
            if any(row["frames"] for row in damaged):
                entries.append(Entry(learner, damage, tuple(_cell(head, damaged, healed) for head in heads)))
    table = _without_empty(heads, entries, bool(forks(result)))
    return table if ("level", "%") in table.heads else None


def _heads(result: StudyResult) -> tuple[Head, ...]:
    return HEADS if forks(result) else tuple(_WITHOUT_FORKS.get(head.column, head) for head in HEADS)


def named_conditions(result: StudyResult) -> dict[str, tuple[str, str]]:
    """Learner and damage of each condition that has a damage among its factors; all other factors are the learner."""
    found = {}
    for name in result.conditions:
        factors = result.factors.get(name, {})
        if "damage" in factors:
            others = [str(value) for key, value in factors.items() if key != "damage"]
            found[name] = (", ".join(map(kind_name, others)) or "all", str(factors["damage"]))
    return found


def _without_empty(heads: Sequence[Head], entries: Sequence[Entry], forked: bool) -> Relearning:
    against = {"level": "the fork's", "behind": "its fork"} if forked else dict.fromkeys(("level", "behind"), _BEFORE)
    kept = [k for k in range(len(heads)) if any(entry.cells[k].mean != NONE for entry in entries)]
    return Relearning(
        heads=tuple((heads[k].group, heads[k].name) for k in kept),
        entries=tuple(Entry(e.learner, e.damage, tuple(e.cells[k] for k in kept)) for e in entries),
        legend=tuple(text.format(**against) for text in LEGEND),
    )


def _cell(head: Head, damaged: Rows, healed: Rows) -> Cell:
    rows = healed if head.healed else damaged
    values = [head.scale * row[head.column] for row in rows if row[head.column] is not None]
    applies = len(values) if head.known is None else sum(row[head.known] is not None for row in rows)
    if not applies:
        return Cell(NONE, "")
    some = f"{len(values)}/{applies}" if len(values) < applies else ""
    return Cell(_number(float(np.mean(values)), head.form) if values else "never", some or _half(values, head.form))


def _half(values: Sequence[float], form: str) -> str:
    """Half of the interval of the mean."""
    from scipy.special import stdtrit

    n = len(values)
    if n < 2:
        return ""
    return f"±{_number(float(np.std(values, ddof=1) * stdtrit(n - 1, 0.975) / sqrt(n)), form)}"


def _number(value: float, form: str) -> str:
    """A number in few letters: from 100 on a whole one, and no sign before what is rounded to nothing."""
    text = format(value, form if abs(value) < _WHOLE else ".0f")
    return (text if text.strip("-0.") else text.lstrip("-")).replace("-", "−")


# -- text --------------------------------------------------------------------------------------------------------------

#: Columns of a terminal.
WIDTH = 120


def relearning_text(table: Relearning) -> str:
    """The table for a terminal of 120 columns: a learner is a heading, and each damage has two lines."""
    names = max(len(entry.damage) for entry in table.entries) + 4
    widths = [
        max(len(name), *(len(text) for entry in table.entries for text in entry.cells[k])) + 1
        for k, (_, name) in enumerate(table.heads)
    ]
    first = 0
    for group, heads in table.groups():  # no narrower than its name
        widths[first] += max(0, len(group) + 1 - sum(widths[first : first + len(heads)]))
        first += len(heads)
    lines = [_groups(table, names, widths), _line("", [name for _, name in table.heads], names, widths)]
    for learner, entries in table.learners():
        lines += ["", learner]
        for entry in entries:
            lines.append(_line(f"  {entry.damage}", [cell.mean for cell in entry.cells], names, widths))
            if any(cell.below for cell in entry.cells):
                lines.append(_line("", [cell.below for cell in entry.cells], names, widths))
    return "\n".join([*lines, "", *(fill(text, WIDTH - 1) for text in table.legend)])


def _line(name: str, texts: Sequence[str], names: int, widths: Sequence[int]) -> str:
    return (name.ljust(names) + "".join(text.rjust(w) for text, w in zip(texts, widths, strict=True))).rstrip()


def _groups(table: Relearning, names: int, widths: Sequence[int]) -> str:
    """Names of groups, each over the middle of its columns."""
    line, first = " " * names, 0
    for group, heads in table.groups():
        room = sum(widths[first : first + len(heads)])
        line += group.rjust((room + len(group) + 1) // 2).ljust(room)
        first += len(heads)
    return line.rstrip()
