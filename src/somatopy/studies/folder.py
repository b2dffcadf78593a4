"""The study folder: the study, the rows of all finished cells, and failures. Only the driver writes to it."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from datetime import datetime
from pathlib import Path
from typing import IO, Any

import pyarrow as pa
import pyarrow.parquet as pq
import tomli_w

from somatopy.analysis.cells import CELLS, COLUMNS, COSTS, FAILURES, JOURNAL, STUDY, journalled, read_cells, to_table
from somatopy.analysis.runs import RunFolderError
from somatopy.experiment.description import DescriptionError
from somatopy.files import write_whole
from somatopy.posix import alone, require
from somatopy.studies.plan import Cell, Study

__all__ = ["StudyFolder", "plain"]

_SCRATCH = "work"
#: Rows of cells that are none of the study's any more, such as those of older code.
OTHERS = "others.parquet"
#: What a row says of a cell, whatever a study calls it.
_MEASURED = tuple(column.name for column in (*COLUMNS, *COSTS) if column.name != "condition")

Rows = list[dict[str, Any]]


class StudyFolder:
    """A folder that holds a study, and from which the study can continue.

    Cells that have ended since the table was last written are in a journal, one line for each. So no crash loses a
    finished cell.

    Args:
        path: the folder, new, empty, or that of a study.

    Attributes:
        path: see above.
        scratch: the folder in which running cells have their run folders.

    Raises:
        DescriptionError: the folder cannot be written, or holds something else.
        NotPosix: the operating system has no file locks, as Windows.
    """

    def __init__(self, path: str | Path | None, name: str) -> None:
        require()
        stamp = datetime.now().strftime("%Y%m%d-%H%M%S")
        self.path = Path(path) if path is not None else Path("runs") / f"{stamp}_{_in_a_path(name)}"
        self.scratch = self.path / _SCRATCH
        self._journal: IO[bytes] | None = None
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            others = [entry.name for entry in self.path.iterdir() if not entry.name.startswith(".")]
        except OSError as error:
            raise DescriptionError(
                f"Cannot write to the study folder {self.path}: {error.strerror}. Name another with --out."
            ) from error
        if others and not {STUDY, CELLS} & {*others}:
            raise DescriptionError(
                f"The folder {self.path} is not empty and holds no study. Name another with --out, or empty it."
            )

    @contextmanager
    def opened(self, study: Study) -> Iterator[dict[str, Rows]]:
        """Lock the folder for this process, and record what happens in it.

        Yields:
            The rows of each finished cell, by key, including cells that other studies have left in the folder.

        Raises:
            DescriptionError: another process has locked it, or its table cannot be read.
        """
        with ExitStack() as held:
            try:
                held.enter_context(alone(self.path / ".lock"))
            except BlockingIOError as error:
                raise DescriptionError(f"Another study is running in {self.path}. Wait for it, or end it.") from error
            self.rows = self.kept()
            self._write_plan(study)
            self._write_tables(study)
            self.scratch.mkdir(exist_ok=True)
            try:
                with (self.path / JOURNAL).open("wb") as self._journal:
                    yield self.rows
            finally:
                self._write_tables(study)
                (self.path / JOURNAL).unlink()

    def kept(self) -> dict[str, Rows]:
        """The rows of each finished cell, by key, read from the files. Nothing is written.

        Raises:
            DescriptionError: a file cannot be read.
        """
        return {**self._tabled(OTHERS), **self._tabled(CELLS), **self._journalled()}

    def append(self, cell: Cell, rows: Rows) -> None:
        """Record the rows of a cell that has ended."""
        whole = [{"key": cell.key, "description": cell.description, "code": cell.code, **row} for row in rows]
        self.rows[cell.key] = whole
        named = [{**_named(cell), **row} for row in whole]
        assert self._journal is not None
        self._journal.write(json.dumps(named).encode() + b"\n")
        self._journal.flush()
        os.fsync(self._journal.fileno())

    def write_failures(self, failures: Sequence[Mapping[str, Any]]) -> None:
        """Record the failures."""
        write_whole(self.path / FAILURES, json.dumps(failures, indent=2) + "\n")

    def _write_plan(self, study: Study) -> None:
        table = {
            "name": study.name,
            "order": [condition.name for condition in study.conditions],
            "conditions": {
                condition.name: {
                    "seeds": list(condition.seeds),
                    "factors": {key: _column(value) for key, value in condition.factors.items()},
                    "experiment": plain(condition.experiment.model_dump(mode="json", exclude={"seed"})),
                }
                for condition in study.conditions
            },
        }
        write_whole(self.path / STUDY, tomli_w.dumps(table))

    def _write_tables(self, study: Study) -> None:
        """Write the rows of the study's cells, named, and apart from them those of other cells."""
        cells = study.cells()
        named = [{**_named(cell), **row} for cell in cells for row in self.rows.get(cell.key, ())]
        keys = {cell.key for cell in cells}
        others = [row for key, rows in self.rows.items() if key not in keys for row in rows]
        if others or (self.path / OTHERS).exists():  # all rows first: a crash in between loses none
            self._write(OTHERS, [{"condition": "", **row} for rows in self.rows.values() for row in rows])
        self._write(CELLS, named)
        if (self.path / OTHERS).exists():
            self._write(OTHERS, [{"condition": "", **row} for row in others])

    def _write(self, name: str, rows: Rows) -> None:
        table = to_table(rows)
        write_whole(self.path / name, lambda file: pq.write_table(table, file, compression="zstd"))

    def _tabled(self, name: str) -> dict[str, Rows]:
        path = self.path / name
        found: dict[str, Rows] = {}
        if not path.exists():
            return found
        try:
            for row in read_cells(path).to_pylist():
                rows = found.setdefault(row["key"], [])
                if row["phase"] not in [other["phase"] for other in rows]:  # cells that are described alike run once
                    rows.append({column: row[column] for column in _MEASURED if column in row})
        except (OSError, ValueError, pa.ArrowException) as error:
            raise DescriptionError(_unreadable(path, error)) from error
        return found

    def _journalled(self) -> dict[str, Rows]:
        """Cells that ended since the table was written; a line that a crash cut off is none."""
        try:
            lines = journalled(self.path)
        except RunFolderError as error:
            raise DescriptionError(str(error)) from error
        return {
            rows[0]["key"]: [{name: row[name] for name in _MEASURED if name in row} for row in rows] for rows in lines
        }


def _named(cell: Cell) -> dict[str, Any]:
    """What a study calls a cell: its factors and its condition."""
    return {**{key: _column(value) for key, value in cell.factors.items()}, "condition": cell.condition}


def _in_a_path(name: str) -> str:
    """A name as one word of a path: no folders of its own, and nothing that a shell would take apart."""
    return re.sub(r"[^\w.+-]+", "-", name).strip("-.")[:100] or "study"


def _unreadable(path: Path, error: Exception) -> str:
    why = next(iter(str(error).splitlines()), type(error).__name__)
    return (
        f"{path} cannot be read ({why}). Restore it from a copy, or move it away: the study then runs all its cells "
        "again."
    )


def _column(value: Any) -> str | float | int | bool | None:
    """What the table and the plan say of a factor: a number or a text."""
    return value if isinstance(value, str | float | int | bool) else json.dumps(value, default=str)


def plain(value: Any) -> Any:
    """A table without keys that are None, since TOML has no null. An absent key means the default."""
    if isinstance(value, dict):
        return {key: plain(entry) for key, entry in value.items() if entry is not None}
    return [plain(entry) for entry in value] if isinstance(value, list) else value
