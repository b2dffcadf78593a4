"""The run folder as it is written: description, frames in parts, costs. It looks on and never steers."""

from __future__ import annotations

import json
import os
from datetime import datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import tomli_w

from somatopy.experiment.description import Description, DescriptionError
from somatopy.percept import JointGroup, Percept, Reading

__all__ = ["CITE", "PART_FRAMES", "Recorder", "frame_columns", "prepare_folder", "write_json"]

PART_FRAMES = 4500
CITE = (
    "G. Schillaci, V. V. Hafner, B. Lara: Online Learning of Visuo-Motor Coordination in a Humanoid Robot. "
    "A Biologically Inspired Model. IEEE ICDL-EpiRob, 2014.",
    "N. Rougier, Y. Boniface: Dynamic self-organising map. Neurocomputing 74(11), 1840-1847, 2011.",
)
_PACKAGES = ("somatopy", "numpy", "numba", "mujoco", "opencv-python-headless", "pyarrow")


def prepare_folder(out: str | Path | None, description: Description) -> Path:
    """Make the run folder: `out`, or runs/<time>_<name>_seed<k> if None.

    Raises:
        DescriptionError: it exists and is no empty folder, or cannot be written.
    """
    stamp = datetime.now().strftime("%Y%m%d-%H%M%S")
    folder = Path(out) if out is not None else Path("runs") / f"{stamp}_{description.name}_seed{description.seed}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise DescriptionError(f"The output folder {folder} is not empty. Name another with --out, or empty it.")
        (folder / "frames").mkdir()
    except FileExistsError as error:
        raise DescriptionError(f"The output folder {folder} is a file. Name another with --out.") from error
    except OSError as error:
        raise DescriptionError(
            f"Cannot write to the output folder {folder}: {error.strerror}. Name another with --out."
        ) from error
    return folder


def write_json(path: Path, table: dict[str, Any]) -> None:
    """Write `table` aside and rename it into place; NaN is refused."""
    _replace(path, json.dumps(table, indent=2, allow_nan=False) + "\n")


def _replace(path: Path, text: str) -> None:
    aside = path.with_name(path.name + ".partial")
    aside.write_text(text)
    os.replace(aside, path)


def frame_columns(arm: JointGroup, head: JointGroup, probes: dict[str, float]) -> dict[str, tuple[pa.DataType, str]]:
    """Name, type and meaning of each column in frames/, in order; one row a frame."""
    vectors = {
        "arm_{}_rad": (arm, "sensed arm posture"),
        "head_{}_rad": (head, "sensed head posture"),
        "arm_command_{}_rad": (arm, "final target of the arm movement under way"),
        "head_command_{}_rad": (head, "head target of the frame before, after the body's clipping"),
        "percept_{}_rad": (arm, "arm posture as the learner perceives it, after damage"),
    }
    columns: dict[str, tuple[pa.DataType, str]] = {
        "frame": (pa.int64(), "frame of the run, from 0"),
        "phase": (pa.int16(), "index of the phase, from 0"),
        "time_s": (pa.float64(), "robot time since reset, s"),
    }
    for pattern, (group, meaning) in vectors.items():
        columns |= {pattern.format(name): (pa.float64(), f"{meaning}, rad") for name in group.names}
    columns |= {
        "hit": (pa.bool_(), "whether the marker was detected"),
        "pixel_u": (pa.float64(), "column of the hand's centre in the image, px; NaN on a miss"),
        "pixel_v": (pa.float64(), "row of the hand's centre in the image, px; NaN on a miss"),
        "tag": (pa.int16(), "id of the tag that was read; -1 on a miss"),
        "tag_area": (pa.float64(), "area of that tag in the image, px^2; NaN on a miss"),
        "overlap": (pa.bool_(), "whether arm and head interpenetrate (their contact is off)"),
        "gaze_error_rad": (pa.float64(), "angle between the optical axis and the hand, rad; NaN where unknown"),
    }
    for name, value in probes.items():
        kind = pa.int64() if isinstance(value, int) else pa.float64()
        columns[name] = kind, _PROBES.get(name, "a probe of the learner")
    return columns


_PROBES = {
    "arm_winner": "winner in the arm map after the update",
    "head_winner": "winner in the head map after the update",
    "arm_distance": "distance from arm input to winner after the update, [0,1] units",
    "head_distance": "distance from head input to winner after the update, [0,1] units",
}


class Recorder:
    """Collects one row a frame and writes them in parts of `PART_FRAMES`, each aside and then renamed.

    A killed run loses the part in memory at most; `close` writes what there is.

    Args:
        folder: the run folder, with an empty frames/ in it.
        description: what is run; written at once as experiment.toml, with versions and what to cite.
        arm: names the arm's columns.
        head: names the head's columns.
        probes: keys and types of the learner's probes.
    """

    def __init__(
        self, folder: Path, description: Description, arm: JointGroup, head: JointGroup, probes: dict[str, float]
    ) -> None:
        self._folder = folder
        columns = frame_columns(arm, head, probes)
        self._schema = pa.schema(
            [pa.field(name, kind, metadata={"meaning": meaning}) for name, (kind, meaning) in columns.items()]
        )
        self._columns = {name: np.empty(PART_FRAMES, kind.to_pandas_dtype()) for name, (kind, _) in columns.items()}
        n = 2 * len(arm) + 2 * len(head) + len(arm)
        self._vectors = np.empty((PART_FRAMES, n))
        for k, name in enumerate(list(columns)[3 : 3 + n]):
            self._columns[name] = self._vectors[:, k]
        self._probes = tuple(probes)
        self._row = self._part = self._frame = 0
        (folder / "frames").mkdir(exist_ok=True)
        table = _without_none(description.model_dump(mode="json"))
        table |= {"cite": list(CITE), "versions": {name: version(name) for name in _PACKAGES}}
        _replace(folder / "experiment.toml", tomli_w.dumps(table))

    def record(self, phase: int, reading: Reading, percept: Percept, probes: dict[str, float]) -> None:
        """Take down one frame."""
        row, columns, seen = self._row, self._columns, percept.sighting
        columns["frame"][row] = self._frame
        columns["phase"][row] = phase
        columns["time_s"][row] = reading.time
        self._vectors[row] = np.concatenate(
            [reading.arm, reading.head, reading.arm_command, reading.head_command, percept.arm]
        )
        columns["hit"][row] = seen is not None
        columns["pixel_u"][row], columns["pixel_v"][row] = seen.pixel if seen else (np.nan, np.nan)
        columns["tag"][row] = seen.tag if seen else -1
        columns["tag_area"][row] = seen.area if seen else np.nan
        columns["overlap"][row] = reading.overlap
        columns["gaze_error_rad"][row] = reading.view.gaze_error if reading.view else np.nan
        for name in self._probes:
            columns[name][row] = probes[name]
        self._row += 1
        self._frame += 1
        if self._row == PART_FRAMES:
            self._write_part()

    def keep_maps(self, maps: dict[str, Any]) -> None:
        """Write what was learned so far, if there is anything, at the end of a window."""
        if not maps:
            return
        folder = self._folder / "maps"
        folder.mkdir(exist_ok=True)
        target = folder / f"window-{self._frame // PART_FRAMES - 1:05d}.npz"
        aside = target.with_suffix(".partial")
        with aside.open("wb") as file:
            np.savez_compressed(file, allow_pickle=False, frame=np.array(self._frame), **maps)
        os.replace(aside, target)

    def state(self) -> dict[str, Any]:
        """Counts, and the rows in memory."""
        rows = {name: column[: self._row].copy() for name, column in self._columns.items()}
        return {"part": self._part, "frame": self._frame, "row": self._row, "rows": rows}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from `state`; parts that were written after it are deleted."""
        self._part, self._frame, self._row = int(state["part"]), int(state["frame"]), int(state["row"])
        for name, rows in state["rows"].items():
            self._columns[name][: self._row] = rows
        for part in (self._folder / "frames").glob("part-*"):
            if part.suffix == ".partial" or int(part.stem.removeprefix("part-")) >= self._part:
                part.unlink()

    def close(self) -> None:
        """Write the rows that are still in memory."""
        if self._row:
            self._write_part()

    def _write_part(self) -> None:
        arrays = [pa.array(self._columns[field.name][: self._row], field.type) for field in self._schema]
        target = self._folder / "frames" / f"part-{self._part:05d}.parquet"
        aside = target.with_suffix(".partial")
        pq.write_table(pa.Table.from_arrays(arrays, schema=self._schema), aside, compression="zstd")
        os.replace(aside, target)
        self._part += 1
        self._row = 0


def _without_none(value: Any) -> Any:
    """TOML has no null: an absent key means the default."""
    if isinstance(value, dict):
        return {k: _without_none(v) for k, v in value.items() if v is not None}
    return [_without_none(v) for v in value] if isinstance(value, list) else value
