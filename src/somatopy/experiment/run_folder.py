"""The run folder, which records the description, frames, maps, checkpoints and cost of a session."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from datetime import datetime
from itertools import count
from pathlib import Path
from typing import Any, Self

from somatopy.experiment.belief import BELIEF
from somatopy.experiment.building import handed_over_again
from somatopy.experiment.checkpoint import CHECKPOINT, read_checkpoint
from somatopy.experiment.description import (
    DESCRIPTION,
    Description,
    DescriptionError,
    load_description,
    read_table,
    validated,
)
from somatopy.experiment.provenance import OWN_CODE, author_of, differences
from somatopy.experiment.run_writer import RunWriter
from somatopy.experiment.session import Session
from somatopy.posix import alone

__all__ = ["CHECKPOINT", "DESCRIPTION", "RunFolder"]

#: Recorded, but no reason to refuse: the code's digest tells whether frames could differ.
_COMMIT = "commit"
_LOCK = ".lock"
#: What a run writes before its first frame; a fork takes over frames, maps and checkpoints of its source.
_FIRST = (DESCRIPTION, CHECKPOINT, "phase-*.npz", "cost.json", BELIEF, "frames", "maps", _LOCK)


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
            folder._made = not os.path.exists(folder.path)  # false also for a name that is too long
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
        if not path.is_file():
            what = f"is not a run folder: it holds no {DESCRIPTION}" if self.path.is_dir() else "is not a folder"
            raise DescriptionError(f"{self.path} {what}. Give the path of a run folder, such as runs/first.")
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
                self._check_author(found["written_by"], author_of(session.parts, session.description), forked)
            session.restore(found["session"])
        except (KeyError, TypeError, ValueError, IndexError) as error:
            if isinstance(error, DescriptionError):
                raise
            raise DescriptionError(f"{self.path / name} does not fit the description of its run: {error}.") from error
        return found

    def _check_description(self, found: dict[str, Any], session: Session) -> None:
        changed = differences(found["description"], session.description.model_dump(mode="json"))
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

        Checkpoints are written at the start, every 20 seconds, with every part of the record, at the end of each phase,
        and at the end of the context. The last one is also written after an error, unless the error broke off a frame.
        If an error comes before anything was recorded, the folder is left empty; that of a fork, too.

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
            writer = RunWriter(self.path, session, since, maps)
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
