"""The writer, which puts what a session does into its run folder while the session runs."""

from __future__ import annotations

import shutil
from array import array
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import tomli_w

from somatopy.experiment.belief import Beliefs
from somatopy.experiment.checkpoint import CHECKPOINT, size_of, write_checkpoint
from somatopy.experiment.description import DESCRIPTION, FORMAT
from somatopy.experiment.frame import PARTS, Frame
from somatopy.experiment.provenance import CITE, author_of, differences
from somatopy.experiment.recorder import PART_FRAMES, Recorder
from somatopy.experiment.session import Session
from somatopy.files import is_aside, write_json, write_whole
from somatopy.posix import peak_memory

__all__ = ["CHECKPOINT_S", "RunWriter"]

#: Wall time between two checkpoints.
CHECKPOINT_S = 20.0


class RunWriter:
    """The sink that writes a session's frames, maps, checkpoints and cost into its folder. `close` writes the rest.

    Args:
        path: the folder, locked by this process.
        session: the session whose frames it is called with.
        since: the checkpoint from which the session continues; None if it begins.
        maps: whether what was learned is stored at the end of each window.
    """

    def __init__(self, path: Path, session: Session, since: dict[str, Any] | None, maps: bool) -> None:
        self._path, self._session, self._maps = path, session, maps
        self._author = author_of(session.parts, session.description)
        self._recorder = Recorder(self._path / "frames", session)
        self._seconds, self._learned = 0.0, array("d")
        self._wall_before, self._began, self._first = 0.0, perf_counter(), session.done
        self._saved_at, self._saved, self._taken_in = perf_counter(), -1, True
        new = not (self._path / DESCRIPTION).exists()
        if new:
            self._begin()
        elif since and differences(since["written_by"], self._author):
            self._append()
        elif since:
            self._saved = session.done
        if since:
            self._recorder.restore(since["recorder"])
            for aside in filter(is_aside, [*self._path.iterdir(), *self._path.glob("maps/*")]):
                aside.unlink()
            self._wall_before, self._seconds = float(since["wall_s"]), float(since["record_s"])
        self._beliefs = Beliefs.of(session, since) if maps else None
        if new:
            self._save()

    def _begin(self) -> None:
        """Write the complete description, with versions, references to cite, and remarks of the interventions."""
        described = _without_none(self._session.description.model_dump(mode="json"))
        table = {"format": FORMAT, **described, **_author_tables(self._author)}
        remarks = {"remarks": self._session.remarks} if self._session.remarks else {}
        write_whole(self._path / DESCRIPTION, tomli_w.dumps(table | remarks | {"cite": list(CITE)}))

    def _append(self) -> None:
        """Add versions and code to the description, if those that continue the run differ from those that began it."""
        text = (self._path / DESCRIPTION).read_text(encoding="utf-8")
        entry = {"resumed": [{"frame": self._session.done, **_author_tables(self._author)}]}
        write_whole(self._path / DESCRIPTION, f"{text.rstrip()}\n\n{tomli_w.dumps(entry)}")

    def __call__(self, frame: Frame) -> None:
        start = perf_counter()
        self._taken_in = False
        self._recorder(frame)
        self._learned.append(frame.seconds["learn"])
        full = self._recorder.frames % PART_FRAMES == 0
        if full:
            self._keep_maps()
        if self._beliefs and (full or frame.ends):
            self._beliefs.note(self._session)
        self._taken_in = True
        now = perf_counter()
        self._seconds += now - start
        if full or frame.ends or now - self._saved_at > CHECKPOINT_S:
            self._save()

    def _keep_maps(self) -> None:
        """Write what was learned so far, if there is anything, at the end of a window."""
        maps = self._session.learner.maps() if self._maps else {}
        if maps:
            target = self._path / "maps" / f"window-{self._recorder.frames // PART_FRAMES - 1:05d}.npz"
            target.parent.mkdir(exist_ok=True)
            frame = np.array(self._recorder.frames)
            write_whole(target, lambda file: np.savez_compressed(file, allow_pickle=False, **{"frame": frame, **maps}))

    def _save(self) -> None:
        """Write a checkpoint, and keep it for good where a phase has ended.

        There is none of a frame that was not taken in as a whole, since what is missing of it would never be made up.
        The one that is kept comes first: who is stopped between the two writes both again.
        """
        session = self._session
        if not (session.resumable and session.whole and self._taken_in and self._recorder.frames == session.done):
            return
        state = {
            "description": session.description.model_dump(mode="json"),
            "written_by": self._author,
            "session": session.state(),
            "recorder": self._recorder.state(),
            "beliefs": self._beliefs.arrays if self._beliefs else {},
            "wall_s": self._wall(),
            "record_s": self._seconds,
        }
        kept = [f"phase-{index}.npz" for index, end in enumerate(session.ends) if end == session.done]
        first, *copies = (self._path / name for name in (*kept, CHECKPOINT))
        write_checkpoint(first, state)
        for copy in copies:
            with first.open("rb") as source:
                write_whole(copy, lambda file: shutil.copyfileobj(source, file))
        self._saved_at, self._saved = perf_counter(), session.done

    def close(self) -> None:
        """Write what is still in memory, a last checkpoint and the cost."""
        try:
            if self._saved != self._session.done:
                self._save()
        finally:
            self._recorder.close()
            if self._beliefs:
                self._beliefs.write(self._path)
        if self._session.done > self._first or not (self._path / "cost.json").exists():
            write_json(self._path / "cost.json", self._cost())

    def _wall(self) -> float:
        return self._wall_before + perf_counter() - self._began

    def _cost(self) -> dict[str, object]:
        wall, done = self._wall(), self._session.done
        seconds = self._session.seconds | {"record": self._seconds}
        return {
            "wall_s": wall,
            "frames": done,
            "frames_per_s": done / wall if wall else None,
            "peak_memory_bytes": peak_memory(),
            "microseconds_per_frame": {part: 1e6 * seconds[part] / max(1, done) for part in (*PARTS, "record")},
            "learner_us": 1e6 * float(np.median(self._learned)) if self._learned else None,
            "learner_bytes": size_of(self._session.learner.state()),
        }


def _author_tables(author: dict[str, Any]) -> dict[str, Any]:
    """Versions in a table of their own, and the rest in another."""
    return {"versions": author["versions"], "written_by": {k: v for k, v in author.items() if k != "versions"}}


def _without_none(value: Any) -> Any:
    """TOML has no null: an absent key means the default."""
    if isinstance(value, dict):
        return {k: _without_none(v) for k, v in value.items() if v is not None}
    return [_without_none(v) for v in value] if isinstance(value, list) else value
