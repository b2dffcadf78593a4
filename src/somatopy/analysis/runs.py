"""Run folders: what an experiment knew (experiment.toml) and what it did (frames/, summary.json, cost.json)."""

from __future__ import annotations

import json
import os
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from somatopy.analysis.columns import ColumnOfRun, Role, described, vector_of, vectors_there
from somatopy.analysis.run_html import run_html
from somatopy.percept import Floats

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa
    import pyarrow.parquet as pq

__all__ = ["BAND", "FORMAT", "Run", "RunFolderError", "load_run", "writing"]

#: The format of run folders that the analysis reads, as experiment.toml names it.
FORMAT = 2
#: The study folder in a run folder that holds more seeds of the same experiment.
BAND = "band"


class RunFolderError(ValueError):
    """A run folder, or a file in it, cannot be used; the message says which, why, and what to do."""


@dataclass(frozen=True)
class Run:
    """A run folder, opened for reading; frames, summary and cost are read when asked for.

    A run that was killed is as good as any other: it has the parts that were finished. What a crash left behind under
    another name (`*.partial`) is ignored, whichever version wrote it.

    Attributes:
        path: the folder.
        description: experiment.toml as plain dictionaries.

    Example:
        >>> import tempfile, pyarrow, pyarrow.parquet
        >>> folder = Path(tempfile.mkdtemp())
        >>> _ = (folder / "experiment.toml").write_text("seed = 3")
        >>> (folder / "frames").mkdir()
        >>> part = pyarrow.table({"frame": [0, 1], "hit": [False, True]})
        >>> pyarrow.parquet.write_table(part, folder / "frames" / "part-00000.parquet")
        >>> run = load_run(folder)
        >>> run.columns
        ('frame', 'hit')
        >>> run.frames(["hit"])["hit"].to_pylist()
        [False, True]
    """

    path: Path
    description: dict[str, Any]

    @property
    def parts(self) -> tuple[Path, ...]:
        """The finished parts of frames/, in order.

        Raises:
            RunFolderError: a part in the middle is missing.
        """
        parts = sorted((self.path / "frames").glob("part-*.parquet"))
        for index, part in enumerate(parts):
            if part.name != f"part-{index:05d}.parquet":
                raise RunFolderError(
                    f"{self.path / 'frames'} lacks part-{index:05d}.parquet although {part.name} is there: frames are "
                    "missing in the middle. Restore that part, or move all later parts away to use what comes before."
                )
        return tuple(parts)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the recorded columns; empty while no part is finished."""
        return tuple(column.name for column in self.described_columns)

    @property
    def described_columns(self) -> tuple[ColumnOfRun, ...]:
        """The recorded columns with meaning, unit and role; empty while no part is finished."""
        return described(_open_part(self.parts[0]).schema_arrow) if self.parts else ()

    def unit(self, column: str) -> str:
        """Unit of a column; "" for pure numbers, and where there is no such column."""
        return next((found.unit for found in self.described_columns if found.name == column), "")

    def joints(self, sense: str, role: Role = "sensed") -> tuple[str, ...]:
        """Names of the joints of a sense, in the order of its vectors; empty where no such vector was recorded.

        Raises:
            RunFolderError: the folder was recorded in another format.
        """
        return tuple(column.label for column in self._vector(sense, role))

    def units(self, sense: str, role: Role = "sensed") -> tuple[str, ...]:
        """Units of the values of a sense, in the order of its vectors; angles have "rad"."""
        return tuple(column.unit for column in self._vector(sense, role))

    def postures(self, sense: str, role: Role = "sensed", start: int = 0, stop: int | None = None) -> Floats:
        """The vectors of a sense in the frames `start` to `stop` (excluded).

        Args:
            sense: "arm", "head", or another sense of the robot.
            role: "sensed"; "command" for its final target; "percept" for what the learner perceives, after damage.
            start: first frame, counted from 0 over the whole run.
            stop: the frame to stop before; the end of the run by default.

        Returns:
            Shape (frames, joints), in the unit of the columns: rad for angles. (0, 0) while no part is finished.

        Raises:
            RunFolderError: no such vector was recorded, the folder was recorded in another format, or it is damaged.
        """
        vector = self._vector(sense, role)
        if not vector:
            there = self.described_columns
            if there:
                raise RunFolderError(
                    f"{self.path} has no {role} vector of the sense {sense!r}. Those it has: {vectors_there(there)}."
                )
            return np.empty((0, 0))
        table = self.frames([column.name for column in vector], start, stop)
        return np.column_stack([table[column.name].to_numpy() for column in vector]).astype(np.float64)

    def check_format(self) -> None:
        """Make sure that the folder is in the format that the analysis reads.

        Raises:
            RunFolderError: it is not; the message says what to do.
        """
        found = self.description.get("format")
        if found != FORMAT:
            versions = self.description.get("versions")
            writer = versions.get("somatopy") if isinstance(versions, dict) else None
            raise RunFolderError(
                f"{self.path} was recorded in {'an older format' if found is None else f'format {found}'}, and this "
                f"version of somatopy reads format {FORMAT}: use the version that recorded it"
                f"{f' ({writer})' if writer else ''}, or run its experiment again."
            )

    def _vector(self, sense: str, role: Role) -> list[ColumnOfRun]:
        self.check_format()
        return vector_of(self.described_columns, sense, role)

    def frames(self, columns: Sequence[str] | None = None, start: int = 0, stop: int | None = None) -> pa.Table:
        """Read columns of the frames `start` to `stop` (excluded); parts outside are not read.

        Args:
            columns: names of columns, in the order wanted; all by default.
            start: first frame, counted from 0 over the whole run.
            stop: the frame to stop before; the end of the run by default.

        Returns:
            One row a frame. A run without a finished part gives no rows and, for lack of types, null columns.

        Raises:
            RunFolderError: a part is damaged or missing, or lacks a column.
            ValueError: `start` or `stop` is negative.
        """
        if start < 0 or (stop is not None and stop < 0):
            raise ValueError(f"start = {start} and stop = {stop} must not be negative: frames count from 0.")
        import pyarrow as pa

        tables: list[pa.Table] = []
        begin = 0
        for part in self.parts:
            file = _open_part(part)
            first, last = max(start - begin, 0), file.metadata.num_rows
            last = last if stop is None else min(last, stop - begin)
            if not tables or last > first:
                tables.append(_read_part(part, file, columns).slice(first, max(last - first, 0)))
            begin += file.metadata.num_rows
        try:
            return pa.concat_tables(tables) if tables else pa.table({name: pa.nulls(0) for name in columns or ()})
        except pa.ArrowInvalid as error:
            why = " ".join(str(error).split())
            raise RunFolderError(f"The parts in {self.path / 'frames'} do not belong to one run ({why}).") from error

    def to_pandas(self, columns: Sequence[str] | None = None, start: int = 0, stop: int | None = None) -> pd.DataFrame:
        """Columns of the frames `start` to `stop` (excluded) as a pandas table; its `attrs["units"]` has their units.

        Args:
            columns: names of columns, in the order wanted; all by default.
            start: first frame, counted from 0 over the whole run.
            stop: the frame to stop before; the end of the run by default.

        Returns:
            One row a frame, whose label is the frame's number from 0.

        Raises:
            ImportError: pandas is not installed.
            RunFolderError: a part is damaged or missing, or lacks a column.
            ValueError: `start` or `stop` is negative.
        """
        table: pd.DataFrame = self.frames(columns, start, stop).to_pandas()
        table.index = range(start, start + len(table))
        table.attrs["units"] = {name: self.unit(name) for name in table}
        return table

    def _repr_html_(self) -> str:
        """What a notebook shows: a row for each phase, with what came of it."""
        return run_html(str(self.path), self.description, self.summary)

    def values(self, column: str) -> NDArray[Any]:
        """All values of a column of numbers or truth values, shape (frames,).

        Raises:
            RunFolderError: there is no such column, or it holds something else.
        """
        found: NDArray[Any] = self.frames([column])[column].to_numpy()
        if len(found) and found.dtype.kind not in "biuf":
            raise RunFolderError(f"The column {column!r} in {self.path / 'frames'} must hold a number in every frame.")
        return found

    @property
    def summary(self) -> dict[str, Any] | None:
        """summary.json, or None where there is none (yet)."""
        return _read_json(self.path / "summary.json")

    @property
    def cost(self) -> dict[str, Any] | None:
        """cost.json (wall_s, frames_per_s, peak_memory_bytes), or None where there is none (yet)."""
        return _read_json(self.path / "cost.json")

    @property
    def ceiling(self) -> dict[str, Any] | None:
        """ceiling.json: what was possible at all, and without look-ahead; None where it was not computed."""
        return _read_json(self.path / "ceiling.json")

    @property
    def snapshots(self) -> tuple[Path, ...]:
        """The maps and links at window ends, in order; see `somatopy.analysis.snapshots`."""
        return tuple(sorted((self.path / "maps").glob("window-*.npz")))

    @property
    def band(self) -> Path | None:
        """The study folder with more seeds of the same experiment, or None where there is none (yet)."""
        folder = self.path / BAND
        return folder if (folder / "cells.parquet").exists() else None

    @property
    def controls(self) -> dict[str, Run]:
        """Runs of the same seed that show what less learning scores, by name."""
        return {
            entry.parent.name: load_run(entry.parent)
            for entry in sorted((self.path / "controls").glob("*/experiment.toml"))
        }


def load_run(path: str | os.PathLike[str]) -> Run:
    """Open a run folder.

    Args:
        path: the folder that holds experiment.toml.

    Raises:
        RunFolderError: no such folder, no experiment.toml in it, or one that is not TOML.
    """
    folder = Path(path)
    if not folder.is_dir():
        raise RunFolderError(f"{folder} is not a folder. Give the path of a run folder (it holds experiment.toml).")
    source = folder / "experiment.toml"
    if not source.is_file():
        inside = sorted(entry.parent.name for entry in folder.glob("*/experiment.toml"))
        hint = f" Run folders inside it: {', '.join(inside)}." if inside else ""
        raise RunFolderError(f"{folder} is not a run folder: it holds no experiment.toml.{hint}")
    try:
        return Run(folder, tomllib.loads(source.read_text(encoding="utf-8-sig")))
    except ValueError as error:
        raise RunFolderError(f"{source} is not valid TOML ({error}). Restore the file, or run again.") from error


@contextmanager
def writing(path: Path) -> Iterator[Path]:
    """Say in the words of a run folder why a file cannot be written."""
    try:
        yield path
    except OSError as error:
        raise RunFolderError(
            f"{path} cannot be written ({error.strerror or error}): nothing else may have that name, and its folder "
            "must be there and writable."
        ) from error


def _open_part(part: Path) -> pq.ParquetFile:
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        return pq.ParquetFile(part)
    except (pa.ArrowException, OSError) as error:
        raise _damaged(part, error) from error


def _read_part(part: Path, file: pq.ParquetFile, columns: Sequence[str] | None) -> pa.Table:
    import pyarrow as pa

    names = file.schema_arrow.names
    unknown = [name for name in columns or () if name not in names]
    if unknown:
        raise RunFolderError(f"{part} has no column {', '.join(map(repr, unknown))}. Its columns: {', '.join(names)}.")
    try:
        table = file.read(columns=columns)
        return table if columns is None else table.select(list(columns))
    except (pa.ArrowException, OSError, KeyError) as error:  # KeyError: a name stands there twice
        raise _damaged(part, error) from error


def _damaged(part: Path, error: Exception) -> RunFolderError:
    return RunFolderError(
        f"{part} is damaged ({str(error).splitlines()[0]}). Restore it from a copy, or move it and all later parts "
        "away to use what comes before, or run the experiment again: same description, same frames."
    )


def _read_json(path: Path) -> dict[str, Any] | None:
    if not path.is_file():
        return None
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise RunFolderError(f"{path} is not valid JSON ({error}). Delete it and analyse the run again.") from error
    if not isinstance(content, dict):
        raise RunFolderError(f"{path} holds no JSON object. Delete it and analyse the run again.")
    return content
