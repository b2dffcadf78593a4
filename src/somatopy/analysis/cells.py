"""The cells of a study: one row for each phase of each run, in one tidy table.

A *cell* is one run: a condition under a seed. Its measures are those of summary.json, with curves that are thinned to
one point a minute. What the table's columns mean is in `COLUMNS`, and in docs/studies.md.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from somatopy.analysis.bounds import ceiling_rates, ceiling_shares, ceilings_in_time, miss_distances
from somatopy.analysis.described import phases_of
from somatopy.analysis.relearning import of_phase
from somatopy.analysis.runs import Run, RunFolderError
from somatopy.analysis.summary import summarise
from somatopy.analysis.windows import moving_mean
from somatopy.clock import FRAMES_PER_MINUTE, WINDOW

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["CELLS", "COLUMNS", "COSTS", "FAILURES", "STUDY", "CellColumn", "StudyResult", "load_study", "measures"]

#: Files of a study folder: all rows, what ended with an error, and what is studied.
CELLS, FAILURES, STUDY = "cells.parquet", "failures.json", "study.toml"
#: In the folder of a study that is under way: the rows of each cell that ended since it was begun, one line a cell.
JOURNAL = "journal.jsonl"
_OF_A_ROW = ("condition", "seed", "phase")
#: What no row can be without, and its type.
_IN_EVERY_ROW = {"key": str, "condition": str, "seed": int, "phase": int, "frames": int}


class CellColumn(NamedTuple):
    """A column of the table of cells.

    Attributes:
        name: its name.
        type: "string", "int", "float", or a list of one of the last two.
        text: what it means, with the unit.
    """

    name: str
    type: str
    text: str


#: What every row has, whatever is studied. Factors of the study with other names stand beside, one column each.
COLUMNS = (
    CellColumn("key", "string", "the cell: a digest of its description and of the code that runs it"),
    CellColumn("description", "string", "a digest of its description alone"),
    CellColumn("code", "string", "a digest of the code and of the versions of the packages that it depends on"),
    CellColumn("condition", "string", "the name of its condition"),
    CellColumn("seed", "int", "its seed"),
    CellColumn("phase", "int", "index of the phase"),
    CellColumn("phase_name", "string", "name of the phase"),
    CellColumn("damage", "string", "kinds of damage in the phase, joined by +; none"),
    CellColumn("learner", "string", "kind of the learner"),
    CellColumn("eye", "string", "kind of the eye"),
    CellColumn("motion", "string", "dynamic or kinematic; null for a body without a choice"),
    CellColumn("frames", "int", "frames in the phase"),
    CellColumn("hits", "int", "frames in which the hand was detected"),
    CellColumn("rate", "float", "hits / frames"),
    CellColumn("ceiling", "float", "share of the phase's frames in which the hand could be seen; null if not computed"),
    CellColumn("efficiency", "float", "rate / ceiling"),
    CellColumn("reactive", "float", "reactive bound of the whole run, share of frames; null if not computed"),
    CellColumn("hits_per_window", "list of int", "hits in each full window of 4,500 frames"),
    CellColumn("ceiling_per_window", "list of float", "the ceiling in each full window"),
    CellColumn("slopes", "list of float", "slope of each trend segment, hits per window and window; null if too short"),
    CellColumn("intercepts", "list of float", "hits per window at the start of each trend segment"),
    CellColumn("line_starts", "list of float", "rate at the first window of each trend line"),
    CellColumn("line_ends", "list of float", "rate at the last window of each trend line"),
    CellColumn("arm_distortion_start", "float", "arm distortion at the first frame with 1,800 inputs, [0, 1] units"),
    CellColumn("arm_distortion_peak", "float", "its maximum in the phase"),
    CellColumn("arm_distortion_end", "float", "its value at the phase's last frame"),
    CellColumn("head_distortion_start", "float", "head distortion at the first frame with 1,800 inputs, [0, 1] units"),
    CellColumn("head_distortion_peak", "float", "its maximum in the phase"),
    CellColumn("head_distortion_end", "float", "its value at the phase's last frame"),
    CellColumn("arm_distortion", "list of float", "arm distortion at the end of each full minute of the phase"),
    CellColumn("head_distortion", "list of float", "head distortion at the end of each full minute of the phase"),
    CellColumn("gaze_error_deg", "float", "median angle between optical axis and hand, degrees"),
    CellColumn("hits_per_minute", "list of int", "hits in each full minute of the phase"),
    CellColumn("ceiling_per_minute", "list of float", "the ceiling in each full minute"),
    CellColumn("plateau", "float", "efficiency of the last third of the phase"),
    CellColumn("minutes_to_50", "float", "minutes until a running minute first has 50 % of the plateau; null if never"),
    CellColumn("minutes_to_90", "float", "the same for 90 %"),
    CellColumn("minutes_to_95", "float", "the same for 95 %"),
    CellColumn("level_before", "float", "plateau of the last phase before without damage; null if there is none"),
    CellColumn("dip", "float", "lowest running minute of the first five minutes, share of the level before"),
    CellColumn("minutes_back", "float", "minutes until five running minutes have 95 % of it and stay; null if never"),
    CellColumn("deficit_minutes", "float", "minutes of full sight lost in the phase against the level before"),
    CellColumn("retention", "float", "first minute of a phase whose damage is undone, share of the level before"),
    CellColumn("retention_minutes", "float", "minutes in it until a running minute has 95 % of that; null if never"),
    CellColumn("miss_distance_rad", "float", "mean distance, rad, from a head that misses to one that would see"),
)
#: What a row says of the computing; nothing else depends on it.
COSTS = (
    CellColumn("wall_s", "float", "wall time of the whole cell, s"),
    CellColumn("cpu_s", "float", "processor time of the whole cell, s"),
    CellColumn("peak_memory_bytes", "int", "most memory that the process which ran it had until then"),
    CellColumn("learner_us", "float", "wall time of the learner alone in a frame, microseconds, median over frames"),
    CellColumn("learner_bytes", "int", "bytes of the learner's state at the end of the run"),
    CellColumn("host", "string", "name of the machine"),
    CellColumn("finished", "string", "when it ended, in coordinated universal time"),
)
_FLOAT32 = ("ceiling_per_window", "ceiling_per_minute", "arm_distortion", "head_distortion")


def measures(run: Run) -> list[dict[str, Any]]:
    """What a run's rows in the table of cells say, one for each phase; without those columns that only a study knows.

    Raises:
        RunFolderError: see `summarise`.
    """
    summary = run.summary or summarise(run)
    names = [phase.get("name") for phase in phases_of(run)]
    ceilings = [*ceiling_rates(run)[1], *[None] * len(names)][: len(names)]
    shares = [*(ceiling_shares(run) or []), *[None] * len(names)][: len(names)]
    ends = np.cumsum([0, *(phase["frames"] for phase in summary["phases"])]).tolist()
    curves = {side: _curve(run, f"{side}_distance") for side in ("arm", "head")}
    errors = run.values("gaze_error_rad") if "gaze_error_rad" in run.columns else np.full(ends[-1], np.nan)
    hits, in_time, distances = run.values("hit"), ceilings_in_time(run), miss_distances(run)
    rows: list[dict[str, Any]] = []
    for k, (start, stop) in enumerate(pairwise(ends)):
        phase = summary["phases"][k]
        rows.append(
            {
                "seed": summary["seed"],
                "phase": k,
                "phase_name": names[k],
                "learner": summary["learner"],
                "eye": summary["eye"],
                "motion": summary["motion"],
                "reactive": summary["reactive_rate"],
                "ceiling": ceilings[k],
                "efficiency": _ratio(phase["rate"], ceilings[k]),
                "ceiling_per_window": _short(shares[k]),
                "gaze_error_deg": _median(errors[start:stop]),
                **{name: phase[name] for name in ("damage", "frames", "hits", "rate", "hits_per_window")},
                **_lines(phase["trends"]),
                **_distortions(phase, {side: curve(start, stop) for side, curve in curves.items()}),
                **of_phase(hits[start:stop], in_time[k], phase["damage"], rows),
                "miss_distance_rad": distances[k],
            }
        )
    return rows


def _lines(trends: Sequence[Mapping[str, Any] | None]) -> dict[str, list[float | None]]:
    def each(value: Callable[[Mapping[str, Any]], float]) -> list[float | None]:
        return [None if trend is None else value(trend) for trend in trends]

    return {
        "slopes": each(lambda trend: trend["slope"]),
        "intercepts": each(lambda trend: trend["intercept"]),
        "line_starts": each(lambda trend: trend["intercept"] / WINDOW),
        "line_ends": each(
            lambda trend: (trend["intercept"] + trend["slope"] * (trend["last"] - trend["first"])) / WINDOW
        ),
    }


def _distortions(phase: Mapping[str, Any], curves: Mapping[str, list[float | None]]) -> dict[str, Any]:
    marks = {
        f"{side}_distortion_{mark}": phase[f"{side}_distortion"][mark]
        for side in curves
        for mark in ("start", "peak", "end")
    }
    return {**marks, **{f"{side}_distortion": curve for side, curve in curves.items()}}


def _curve(run: Run, name: str) -> Callable[[int, int], list[float | None]]:
    """The moving mean of a column at the ends of the full minutes between two frames."""
    means = moving_mean(run.values(name)) if name in run.columns else np.empty(0)

    def minutes(start: int, stop: int) -> list[float | None]:
        return _short(means[start + FRAMES_PER_MINUTE - 1 : stop : FRAMES_PER_MINUTE].tolist())

    return minutes


def _short(values: Sequence[float] | None) -> list[float | None]:
    """Numbers as exact as the table keeps them; what is not known is None."""
    return [float(np.float32(value)) if np.isfinite(value) else None for value in values or ()]


def _ratio(rate: float | None, ceiling: float | None) -> float | None:
    return rate / ceiling if ceiling and rate is not None else None


def _median(angles: Any) -> float | None:
    known = angles[np.isfinite(angles)]
    return float(np.degrees(np.median(known))) if len(known) else None


# -- the table ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class StudyResult:
    """A study folder, opened.

    Attributes:
        path: the folder.
        table: one row for each phase of each finished cell, sorted by condition, seed and phase.
        failures: what ended with an error: condition, seed, cause.
        study: what is studied, as its file says it.
    """

    path: Path
    table: pa.Table
    failures: list[dict[str, Any]]
    study: dict[str, Any]

    @property
    def factors(self) -> dict[str, dict[str, Any]]:
        """What the study says of each condition, by factor; by name of the condition."""
        return {name: dict(entry["factors"]) for name, entry in self.study["conditions"].items()}

    @property
    def conditions(self) -> list[str]:
        """Names of the conditions that have finished cells, in the order of the study."""
        there = list(dict.fromkeys(self.table["condition"].to_pylist()))
        order = {name: k for k, name in enumerate(self.study.get("order", ()))}
        return sorted(there, key=lambda name: order.get(name, len(order)))

    def values(self, condition: str, measure: str, phase: int = 0, place: int | None = None) -> dict[int, Any]:
        """A measure by seed.

        Args:
            condition: name of the condition.
            measure: a column.
            phase: index of the phase.
            place: which entry, where the measure is a list; seeds whose list is too short are left out.

        Returns:
            By seed, in order; seeds for which it is not known are left out.

        Raises:
            RunFolderError: no such column.
        """
        if measure not in self.table.column_names:
            raise RunFolderError(f"The table has no column {measure!r}. Its columns: {self.table.column_names}.")
        found = {}
        for name, number, seed, value in zip(
            *(self.table[column].to_pylist() for column in ("condition", "phase", "seed", measure)), strict=True
        ):
            if name == condition and number == phase:
                if place is not None:
                    value = value[place] if value is not None and -len(value) <= place < len(value) else None
                if value is not None:
                    found[seed] = value
        return dict(sorted(found.items()))


def load_study(path: str | Path) -> StudyResult:
    """Open a study folder, also that of a study that is under way.

    Raises:
        RunFolderError: no study folder, or a broken file in it.
    """
    folder = Path(path)
    if not (folder / STUDY).is_file():
        raise RunFolderError(f"{folder} is not a study folder: it holds no {STUDY}.")
    with _readable(folder / STUDY, "Restore it from a copy, or run the study into its folder again, which writes it."):
        study = _plan(folder / STUDY)
    ended = [row for rows in journalled(folder) for row in rows]  # first: when the study ends they go to the table
    with _readable(folder / CELLS, "Restore it from a copy, or move it away: the study then runs its cells again."):
        table = read_cells(folder / CELLS) if (folder / CELLS).exists() else to_table([])
    with _readable(folder / JOURNAL, "Delete the lines that hold other values: their cells then run again."):
        table = _with(table, [row for row in ended if row["condition"] in study["conditions"]])
    with _readable(folder / FAILURES, "Delete it: the study writes it again when it goes on."):
        failures = _failures(folder / FAILURES)
    return StudyResult(folder, table, failures, study)


@contextmanager
def _readable(path: Path, mend: str) -> Iterator[None]:
    """Say of a file in a study folder why it cannot be read, and what to do."""
    import pyarrow as pa

    try:
        yield
    except (OSError, ValueError, TypeError, pa.ArrowException) as error:
        why = next(iter(str(error).splitlines()), type(error).__name__)
        raise RunFolderError(f"{path} cannot be read ({why.rstrip('.')}). {mend}") from error


def _plan(path: Path) -> dict[str, Any]:
    """What a study folder says of its study."""
    table = tomllib.loads(path.read_text(encoding="utf-8"))
    conditions, order = table.get("conditions"), table.get("order", [])
    known = isinstance(conditions, dict) and all(
        isinstance(entry, dict) and isinstance(entry.get("factors"), dict) for entry in conditions.values()
    )
    if not known or not isinstance(order, list) or not all(isinstance(name, str) for name in order):
        raise ValueError("it does not name the conditions of a study, each with its factors")
    return table


def _failures(path: Path) -> list[dict[str, Any]]:
    """What ended with an error."""
    found = json.loads(path.read_text(encoding="utf-8")) if path.exists() else []
    told = ("condition", "seed", "cause")
    if not isinstance(found, list) or not all(isinstance(e, dict) and e.keys() >= {*told} for e in found):
        raise ValueError(f"it is no list of cells, each with its {', '.join(told)}")
    return found


def journalled(folder: Path) -> list[list[dict[str, Any]]]:
    """The rows of each cell that ended since the study was begun; a line that a crash cut off is none.

    Raises:
        RunFolderError: a line holds something else; the message says which.
    """
    path = folder / JOURNAL
    with _readable(path, "Move it away: the cells in it then run again."):
        lines = path.read_bytes().splitlines(keepends=True) if path.exists() else []
    return [_cell_in(path, number, line) for number, line in enumerate(lines, 1) if line.endswith(b"\n")]


def _cell_in(path: Path, number: int, line: bytes) -> list[dict[str, Any]]:
    """The rows of the cell that a line of the journal is about."""
    try:
        rows = json.loads(line)
    except ValueError:
        rows = None
    if not (isinstance(rows, list) and rows) or not all(
        isinstance(row, dict) and all(isinstance(row.get(name), kind) for name, kind in _IN_EVERY_ROW.items())
        for row in rows
    ):
        raise RunFolderError(
            f"{path} cannot be read (line {number} holds no rows of a cell). Restore it from a copy, or delete that "
            "line: its cell then runs again."
        )
    return rows


def _with(table: pa.Table, rows: Sequence[Mapping[str, Any]]) -> pa.Table:
    """A table with rows that it may have already; each is there once."""
    there = [*zip(*(table[name].to_pylist() for name in _OF_A_ROW), strict=True)]
    if not rows and len({*there}) == len(there):
        return table
    found: dict[tuple[Any, ...], Mapping[str, Any]] = {}
    for row in (*table.to_pylist(), *rows):
        found.setdefault(tuple(row[name] for name in _OF_A_ROW), row)
    return to_table([*found.values()])


def to_table(rows: Sequence[Mapping[str, Any]]) -> pa.Table:
    """Rows as a table: the columns of a study's own first, then `COLUMNS`, then `COSTS`.

    A factor with numbers and texts, or truths, becomes text.
    """
    import pyarrow as pa

    known = [*COLUMNS, *COSTS]
    own = list(dict.fromkeys(name for row in rows for name in row if name not in {c.name for c in known}))
    rows = _alike(rows, own)
    fields = [(column.name, _arrow_type(column)) for column in known]
    order = sorted(rows, key=lambda row: (row["condition"], row["seed"], row["key"], row["phase"]))
    arrays = {name: pa.array([row.get(name) for row in order]) for name in own}
    arrays |= {name: pa.array([row.get(name) for row in order], kind) for name, kind in fields}
    return pa.table(arrays)


def read_cells(path: Path) -> pa.Table:
    """A table of cells. Columns that an older version did not know yet are all null.

    Raises:
        ValueError: a row does not say of which cell and phase it is and how long, or a column holds something else.
        OSError: the file cannot be read.
        pyarrow.ArrowException: it is no table, or a damaged one.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    with path.open("rb") as file:
        table = pq.ParquetFile(file).read()
    for name in _IN_EVERY_ROW:
        if name not in table.column_names or table[name].null_count:
            raise ValueError(f"its column {name!r} is missing or has gaps")
    for column in (*COLUMNS, *COSTS):
        kind = _arrow_type(column)
        if column.name not in table.column_names:
            table = table.append_column(column.name, pa.nulls(table.num_rows, kind))
        elif (found := table[column.name]).type != kind:
            try:
                table = table.set_column(table.column_names.index(column.name), column.name, found.cast(kind))
            except pa.ArrowException as error:
                raise ValueError(f"its column {column.name!r} holds {found.type} in place of {kind}") from error
    return table


def _alike(rows: Sequence[Mapping[str, Any]], factors: Sequence[str]) -> list[Mapping[str, Any]]:
    """Rows whose factors have values of one type each."""
    types: dict[str, set[type]] = {name: set() for name in factors}
    for row in rows:
        for name in factors:
            if (value := row.get(name)) is not None:
                types[name].add(float if type(value) is int else type(value))
    mixed = [name for name, found in types.items() if len(found) > 1]
    texts = [{name: str(row[name]) for name in mixed if row.get(name) is not None} for row in rows]
    return [{**row, **text} for row, text in zip(rows, texts, strict=True)]


def _arrow_type(column: CellColumn) -> Any:
    import pyarrow as pa

    plain = {"string": pa.string(), "int": pa.int64(), "float": pa.float64()}
    kind, _, inner = column.type.partition(" of ")
    if not inner:
        return plain[kind]
    return pa.list_(pa.float32() if column.name in _FLOAT32 else pa.int32() if inner == "int" else pa.float64())
