"""The run folder, which records the description, frames, maps, checkpoints and cost of a session."""

from __future__ import annotations

import json
import shutil
from array import array
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from datetime import datetime
from itertools import count
from pathlib import Path
from time import perf_counter
from typing import Any, Self

import numpy as np
import tomli_w
from pydantic import BaseModel

from somatopy.experiment.belief import BELIEF, Beliefs
from somatopy.experiment.building import handed_over_again
from somatopy.experiment.checkpoint import read_checkpoint, size_of, write_checkpoint
from somatopy.experiment.description import (
    FORMAT,
    Description,
    DescriptionError,
    load_description,
    read_table,
    validated,
)
from somatopy.experiment.frame import PARTS, Frame
from somatopy.experiment.provenance import CITE, OWN_CODE, differences, versions, written_by
from somatopy.experiment.recorder import PART_FRAMES, Recorder
from somatopy.experiment.session import Session
from somatopy.files import is_aside, write_whole
from somatopy.posix import alone, peak_memory
from somatopy.registry import HANDED_OVER, Settings

__all__ = ["CHECKPOINT", "CHECKPOINT_S", "DESCRIPTION", "RunFolder", "write_json"]

DESCRIPTION, CHECKPOINT = "experiment.toml", "checkpoint.npz"
#: Wall time between two checkpoints.
CHECKPOINT_S = 20.0
#: Recorded, but no reason to refuse: the code's digest tells whether frames could differ.
_COMMIT = "commit"
_LOCK = ".lock"
#: What a run writes before its first frame; a fork takes over frames, maps and checkpoints of its source.
_FIRST = (DESCRIPTION, CHECKPOINT, "phase-*.npz", "cost.json", BELIEF, "frames", "maps", _LOCK)


def write_json(path: Path, table: Mapping[str, Any]) -> None:
    """Write a table as JSON, whole or not at all. NaN is refused."""
    write_whole(path, json.dumps(table, indent=2, allow_nan=False) + "\n")


class RunFolder:
    """A folder that records an experiment, and from which the experiment can continue.

    Args:
        path: the folder.

    Attributes:
        path: see above.

    Example:
        >>> import tempfile
        >>> from somatopy import paper
        >>> phases = [{"name": "short", "frames": 3}]
        >>> short = paper().replaced(body={"motion": "kinematic"}, eye={"kind": "geometric"}, phases=phases)
        >>> out = tempfile.TemporaryDirectory()
        >>> with Session(short) as session:
        ...     folder = RunFolder.new(out.name, session.description)
        ...     with folder.recording(session):
        ...         frames = sum(1 for frame in session)
        >>> frames, sorted(entry.name for entry in folder.path.glob("*") if entry.suffix)
        (3, ['belief.npz', 'checkpoint.npz', 'cost.json', 'experiment.toml', 'phase-0.npz'])
        >>> out.cleanup()
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._made = False

    @classmethod
    def new(cls, out: str | Path | None, description: Description) -> Self:
        """Make an empty folder for a run.

        Args:
            out: the folder, new or empty. With None it is runs/<time>_<name>_seed<k>, with a number behind it if that
                exists.
            description: the experiment, which gives name and seed.

        Raises:
            DescriptionError: `out` is not empty, is no folder, or cannot be written.
        """
        if out is not None:
            folder = cls(out)
            folder._made = not folder.path.exists()
            _prepare(folder.path)
            return folder
        stamp = datetime.now().strftime("%Y%m%d-%H%M%S")
        wanted = f"{stamp}_{description.name}_seed{description.seed}"
        for number in count(1):
            path = Path("runs") / (wanted if number == 1 else f"{wanted}_{number}")
            with suppress(FileExistsError), _said_of_folder(path):
                path.mkdir(parents=True)
                folder = cls(path)
                folder._made = True
                return folder
        raise AssertionError("unreachable")

    # -- reading -------------------------------------------------------------------------------------------------------

    def description(self, *, forked: bool = False, **parts: Any) -> Description:
        """The description in the folder, together with the parts that were given to the run in Python.

        Args:
            forked: whether the parts may include interventions that only a fork of the run has.
            parts: parts by the names `body`, `eye`, `babbler`, `learner` and `interventions`; see `Session`.

        Raises:
            DescriptionError: the folder is no run folder, a part that cannot be imported was not given, or another part
                was given.
        """
        path = self.path / DESCRIPTION
        given = {name: part for name, part in parts.items() if part is not None}
        if not given:
            return load_description(path)
        return validated(handed_over_again(read_table(path), given, forked), str(path))

    def checkpoint(self, name: str = CHECKPOINT) -> dict[str, Any]:
        """Read a checkpoint of the run.

        Raises:
            DescriptionError: there is no such checkpoint, or it cannot be read.
        """
        if not (self.path / name).exists():
            raise DescriptionError(
                f"{self.path} has no {name}, so that the run cannot be continued; nothing was changed. Restore that "
                "file from a copy, or run the experiment again into another folder. A run whose body has no state() "
                "and restore() never has one: it cannot be resumed."
            )
        return read_checkpoint(self.path / name)

    def restore(
        self, session: Session, name: str = CHECKPOINT, *, anyway: bool = False, forked: bool = False
    ) -> dict[str, Any]:
        """Put a session of the folder's description into the state of a checkpoint.

        Args:
            session: a session that was made from `description`.
            name: name of the checkpoint's file.
            forked: whether the session's description may differ after the moment of the checkpoint.
            anyway: whether to go on even if versions or code differ from those that wrote the folder.

        Returns:
            The checkpoint, which `recording` takes as `since`.

        Raises:
            DescriptionError: the checkpoint is broken or belongs to another description, or versions or code differ.
        """
        found = self.checkpoint(name)
        try:
            if not forked:
                self._check_description(found, session)
            if not anyway:
                self._check_author(found["written_by"], _author(session), forked)
            session.restore(found["session"])
        except (KeyError, TypeError, ValueError, IndexError) as error:
            if isinstance(error, DescriptionError):
                raise
            raise DescriptionError(f"{self.path / name} does not fit the description of its run: {error}.") from error
        return found

    def _check_description(self, found: dict[str, Any], session: Session) -> None:
        changed = differences(found["description"], _plain(session.description))
        if changed:
            raise DescriptionError(
                f"{self.path / DESCRIPTION} is not what this run began with: {', '.join(changed)} "
                f"{'differs' if len(changed) == 1 else 'differ'}. Put back what was there, or run the changed "
                "experiment into a folder of its own."
            )

    def _check_author(self, before: dict[str, Any], now: dict[str, Any], forked: bool) -> None:
        others = [key for key in differences(before, now) if key != _COMMIT]
        if forked:  # parts that only one of the two experiments has are no difference
            others = [key for key in others if not key.startswith(OWN_CODE) or (key in before and key in now)]
        if others:
            raise DescriptionError(
                f"{self.path} was written by another version of the programs: {', '.join(others)} "
                f"{'differs' if len(others) == 1 else 'differ'}. "
                "What follows could differ from what the run would have been. Go on all the same with --anyway "
                "(anyway=True in Python); a run that is resumed so says it in its experiment.toml."
            )

    # -- writing -------------------------------------------------------------------------------------------------------

    @contextmanager
    def recording(self, session: Session, since: dict[str, Any] | None = None, *, maps: bool = True) -> Iterator[None]:
        """Record the frames of a session while the context lasts.

        Checkpoints are written at the start, every `CHECKPOINT_S` seconds, with every part of the record, at the end of
        each phase, and at the end of the context. The last one is also written after an error, unless the error broke
        off a frame. If an error comes before anything was recorded, the folder is left empty; that of a fork, too.

        Args:
            session: the session whose frames are recorded.
            since: the checkpoint from which the session continues, as `restore` returned it.
            maps: whether the learned maps are stored at the end of each window.

        Raises:
            DescriptionError: another process runs in this folder, or has continued the run since the checkpoint. Or the
                folder already holds a run, and no checkpoint is given.
            NotPosix: the operating system has no file locks, as Windows.
        """
        with self.locked(), self.emptied_if_nothing_ran(session):
            self._check_newest(since)
            writer = _Writer(self, session, since, maps)
            session.attach(writer)
            try:
                yield
            finally:
                session.detach(writer)
                writer.close()

    def _check_newest(self, since: dict[str, Any] | None) -> None:
        if since is None and (self.path / DESCRIPTION).exists():
            raise DescriptionError(
                f"{self.path} holds a run already; nothing was changed. Give recording() the checkpoint from which it "
                "goes on, or take a new folder."
            )
        if since is None or not (self.path / CHECKPOINT).exists():
            return
        newest, read = (int(found["session"]["done"]) for found in (self.checkpoint(), since))
        if newest != read:
            raise DescriptionError(
                f"{self.path} stands at frame {newest}, and the checkpoint that was read at frame {read}: another "
                "process went on with this run in the meantime; nothing was changed. Resume it again."
            )

    def begin(self, session: Session) -> None:
        """Write the complete description, with versions, references to cite, and remarks of the interventions."""
        table = {"format": FORMAT, **_without_none(_plain(session.description)), **_author_tables(session)}
        remarks = {"remarks": session.remarks} if session.remarks else {}
        write_whole(self.path / DESCRIPTION, tomli_w.dumps(table | remarks | {"cite": list(CITE)}))

    def append(self, session: Session) -> None:
        """Add versions and code to the description, if those that continue the run differ from those that began it."""
        text = (self.path / DESCRIPTION).read_text(encoding="utf-8")
        entry = {"resumed": [{"frame": session.done, **_author_tables(session)}]}
        write_whole(self.path / DESCRIPTION, f"{text.rstrip()}\n\n{tomli_w.dumps(entry)}")

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Lock the folder for this process while the context lasts. However the process ends, the lock ends, too."""
        with ExitStack() as held:
            try:
                held.enter_context(alone(self.path / _LOCK))
            except BlockingIOError as error:
                raise DescriptionError(
                    f"Another process is running in {self.path}. Wait for it, or end it first."
                ) from error
            yield

    @contextmanager
    def emptied_if_nothing_ran(self, session: Session) -> Iterator[None]:
        """After an error before the first frame of a new run or of a fork, remove what was written in the context.

        The folder itself is removed, too, where it was made here. A run that goes on keeps what it has.

        Args:
            session: the session that is to run.
        """
        new, first = not (self.path / DESCRIPTION).exists(), session.done
        before = {*self._written()} - {self.path / _LOCK}
        try:
            yield
        except BaseException:
            if new and session.done == first:
                for entry in {*self._written()} - before:
                    with suppress(OSError):
                        shutil.rmtree(entry) if entry.is_dir() else entry.unlink()
                with suppress(OSError):
                    if self._made:
                        self.path.rmdir()
            raise

    def _written(self) -> list[Path]:
        """What is there of what a run or a fork has written before its first frame."""
        return [path for name in _FIRST for path in self.path.glob(name)]


class _Writer:
    """The sink that writes a session's frames, maps, checkpoints and cost into its folder."""

    def __init__(self, folder: RunFolder, session: Session, since: dict[str, Any] | None, maps: bool) -> None:
        self._path, self._session, self._maps = folder.path, session, maps
        self._author = _author(session)
        self._recorder = Recorder(self._path / "frames", session)
        self._seconds, self._learned = 0.0, array("d")
        self._wall_before, self._began, self._first = 0.0, perf_counter(), session.done
        self._saved_at, self._saved = perf_counter(), -1
        new = not (self._path / DESCRIPTION).exists()
        if new:
            folder.begin(session)
        elif since and differences(since["written_by"], self._author):
            folder.append(session)
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

    def __call__(self, frame: Frame) -> None:
        start = perf_counter()
        self._recorder(frame)
        self._learned.append(frame.seconds["learn"])
        full = self._recorder.frames % PART_FRAMES == 0
        if full:
            self._keep_maps()
        if self._beliefs and (full or frame.ends):
            self._beliefs.note(self._session)
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
        """Write a checkpoint, and keep it for good where a phase has ended."""
        session = self._session
        if not (session.resumable and session.whole and self._recorder.frames == session.done):
            return
        state = {
            "description": _plain(session.description),
            "written_by": self._author,
            "session": session.state(),
            "recorder": self._recorder.state(),
            "beliefs": self._beliefs.arrays if self._beliefs else {},
            "wall_s": self._wall(),
            "record_s": self._seconds,
        }
        write_checkpoint(self._path / CHECKPOINT, state)
        for index, end in enumerate(session.ends):
            if end == session.done:
                with (self._path / CHECKPOINT).open("rb") as source:
                    write_whole(self._path / f"phase-{index}.npz", lambda file: shutil.copyfileobj(source, file))
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


def _prepare(path: Path) -> None:
    """Make the folder that was asked for, if it is not there and empty."""
    with _said_of_folder(path):
        if path.exists() and not path.is_dir():
            raise DescriptionError(f"The output folder {path} is a file. Name another with --out.")
        path.mkdir(parents=True, exist_ok=True)
        if any(path.iterdir()):
            raise DescriptionError(f"The output folder {path} is not empty. Name another with --out, or empty it.")


@contextmanager
def _said_of_folder(path: Path) -> Iterator[None]:
    try:
        yield
    except FileExistsError:
        raise
    except OSError as error:
        raise DescriptionError(
            f"Cannot write to the output folder {path}: {error.strerror}. Name another with --out."
        ) from error


def _plain(description: Description) -> dict[str, Any]:
    """A description as JSON has it."""
    table: dict[str, Any] = description.model_dump(mode="json")
    return table


def _author(session: Session) -> dict[str, Any]:
    """Versions, code, commit, Python and platform."""
    return {"versions": versions(), **written_by([*session.parts, *_named(session.description)])}


def _named(value: Any) -> Iterator[Settings]:
    """All settings in a description whose part is named and not handed over: the module that is named counts, too."""
    if isinstance(value, Settings) and not value.kind.startswith(HANDED_OVER):
        yield value
    if isinstance(value, Settings):
        inner: Iterable[Any] = vars(value).values()
    elif isinstance(value, BaseModel):
        inner = (entry for _, entry in value)
    else:
        inner = value if isinstance(value, tuple) else ()
    for entry in inner:
        yield from _named(entry)


def _author_tables(session: Session) -> dict[str, Any]:
    author = _author(session)
    return {"versions": author.pop("versions"), "written_by": author}


def _without_none(value: Any) -> Any:
    """TOML has no null: an absent key means the default."""
    if isinstance(value, dict):
        return {k: _without_none(v) for k, v in value.items() if v is not None}
    return [_without_none(v) for v in value] if isinstance(value, list) else value
