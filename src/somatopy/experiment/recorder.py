"""Records frames: a sink that writes them into the folder frames/, in parts of one window each."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from somatopy.clock import WINDOW
from somatopy.experiment.columns import BEFORE, BEHIND, vector_columns
from somatopy.experiment.frame import Frame
from somatopy.experiment.session import Session
from somatopy.files import is_aside, write_whole
from somatopy.percept import Column

__all__ = ["PART_FRAMES", "Recorder"]

PART_FRAMES = WINDOW
_TYPES: dict[str, Any] = {
    "float": (pa.float64(), np.float64),
    "int": (pa.int64(), np.int64),
    "bool": (pa.bool_(), bool),
}
_SMALL = {"phase": (pa.int16(), np.int16), "tag": (pa.int16(), np.int16)}


class Recorder:
    """Collects one row for each frame. It writes them in parts of `PART_FRAMES` rows, each whole or not at all.

    A run that is killed loses at most the part that is still in memory. `close` writes that part.

    Args:
        folder: the folder for the parts. It is made if it does not exist.
        session: the session whose frames are recorded, and which names the columns.

    Attributes:
        frames: number of frames recorded so far.
        parts: number of parts written so far.
    """

    def __init__(self, folder: Path, session: Session) -> None:
        self._folder = folder
        vectors = vector_columns(session.body)
        self._schema = pa.schema(
            [
                *map(_field, BEFORE),
                *(_field(column, sense=sense, label=name) for column, sense, name in vectors),
                *map(_field, (*BEHIND, *session.columns)),
            ]
        )
        self._columns = {
            column.name: np.empty(PART_FRAMES, _type(column)[1]) for column in (*BEFORE, *BEHIND, *session.columns)
        }
        self._vectors = np.empty((PART_FRAMES, len(vectors)))
        self._columns |= {column.name: self._vectors[:, k] for k, (column, _, _) in enumerate(vectors)}
        self._probes = [(column.name, self._columns[column.name]) for column in session.columns]
        self._scalars = [self._columns[column.name] for column in (*BEFORE, *BEHIND)]
        self._row = self.parts = self.frames = 0
        folder.mkdir(exist_ok=True)

    def __call__(self, frame: Frame) -> None:
        """Record one frame."""
        row, reading, percept, seen = self._row, frame.reading, frame.percept, frame.sighting
        vectors = reading.arm, reading.head, reading.arm_command, reading.head_command, percept.arm, percept.head
        np.concatenate(vectors, out=self._vectors[row])
        u, v, tag, area = (*seen.pixel, seen.tag, seen.area) if seen else _MISS
        error = reading.view.gaze_error if reading.view else np.nan
        values = frame.number, frame.phase, reading.time, seen is not None, u, v, tag, area, reading.overlap, error
        for column, value in zip(self._scalars, values, strict=True):
            column[row] = value
        try:
            for name, column in self._probes:
                column[row] = frame.probes[name]
        except KeyError as error:
            raise ValueError(f"The column {error} is declared, but no probes() gives its value.") from error
        self._row += 1
        self.frames += 1
        if self._row == PART_FRAMES:
            self._write_part()

    def state(self) -> dict[str, Any]:
        """The numbers of frames and parts, and the rows that are still in memory."""
        rows = {name: column[: self._row].copy() for name, column in self._columns.items()}
        return {"parts": self.parts, "frames": self.frames, "row": self._row, "rows": rows}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from `state`. This deletes parts that were written later, and unfinished files left by a crash."""
        self.parts, self.frames, self._row = int(state["parts"]), int(state["frames"]), int(state["row"])
        for name, rows in state["rows"].items():
            self._columns[name][: self._row] = rows
        for file in self._folder.iterdir():
            number = file.stem.removeprefix("part-")
            if is_aside(file) or (file.name.startswith("part-") and number.isdigit() and int(number) >= self.parts):
                file.unlink()

    def close(self) -> None:
        """Write the rows that are still in memory."""
        if self._row:
            self._write_part()

    def _write_part(self) -> None:
        arrays = [pa.array(self._columns[field.name][: self._row], field.type) for field in self._schema]
        table = pa.Table.from_arrays(arrays, schema=self._schema)
        target = self._folder / f"part-{self.parts:05d}.parquet"
        write_whole(target, lambda file: pq.write_table(table, file, compression="zstd"))
        self.parts += 1
        self._row = 0


_MISS = np.nan, np.nan, -1, np.nan


def _type(column: Column) -> Any:
    return _SMALL.get(column.name) or _TYPES[column.type]


def _field(column: Column, **more: str) -> Any:
    metadata = {"meaning": column.meaning, "unit": column.unit, "role": column.role, **more}
    return pa.field(column.name, _type(column)[0], metadata=metadata)
