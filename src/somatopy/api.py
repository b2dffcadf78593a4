"""Run, resume or fork an experiment in one call."""

from __future__ import annotations

import shlex
import shutil
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

from somatopy.analysis import load_run
from somatopy.analysis.runs import Run
from somatopy.analysis.summary import write_summary
from somatopy.contract import Modelled, Twin
from somatopy.experiment import Description, DescriptionError, RunFolder, Session
from somatopy.experiment.ceiling import EVERY, ceiling
from somatopy.experiment.frame import Sink
from somatopy.experiment.missed import miss_distances
from somatopy.experiment.progress import ProgressBar, robot_time
from somatopy.experiment.provenance import line_of
from somatopy.experiment.run_folder import CHECKPOINT
from somatopy.experiment.sight import write_sight
from somatopy.files import write_json
from somatopy.posix import require

__all__ = ["Interrupted", "begin", "finish", "fork", "play", "reopen", "resume", "run"]

#: Parts of your own, as `Session` takes them: body, eye, babbler, learner, interventions.
Parts = Any


class Interrupted(KeyboardInterrupt):
    """The run was stopped by Ctrl-C or SIGTERM. The message says how to continue it.

    Attributes:
        signal: the number of the signal: 2 for Ctrl-C, 15 for SIGTERM.
    """

    def __init__(self, message: str = "", number: int = signal.SIGINT) -> None:
        super().__init__(message)
        self.signal = int(number)


def run(
    description: Description,
    out: str | Path | None = None,
    *,
    progress: bool = True,
    ceiling: bool = True,
    every: int = EVERY,
    maps: bool = True,
    sinks: Sequence[Sink] = (),
    **parts: Parts,
) -> Run:
    """Run an experiment, and analyse it at the end.

    Args:
        description: what to run.
        out: the run folder, new or empty; runs/<time>_<name>_seed<k> if None.
        progress: whether to show the progress on standard error.
        ceiling: whether the ceiling of the run is computed at its end.
        every: the ceiling looks at one frame out of so many.
        maps: whether the learned maps are stored at the end of each window.
        sinks: objects that are called with each `Frame`, such as a `TensorBoard`.
        parts: parts of your own, by the names `body`, `eye`, `babbler`, `learner` and `interventions`; see `Session`.

    Returns:
        The run folder, opened, with its summary.

    Raises:
        DescriptionError: the description does not fit the robot, or the folder cannot be used. Nothing has run then.
        BodyError: the robot's model or anatomy does not fit.
        NoGL: the eye needs pictures and no OpenGL works here.
        NotPosix: the operating system has no file locks, as Windows.
        Interrupted: on Ctrl-C or SIGTERM, with a checkpoint written.
    """
    with begin(description, out, **parts) as (session, folder):
        _attach(session, sinks)
        play(session, folder, progress=progress, maps=maps)
        return finish(session, folder.path, bounds=ceiling, every=every, maps=maps)


def resume(
    folder: str | Path,
    *,
    progress: bool = True,
    ceiling: bool = True,
    every: int = EVERY,
    maps: bool = True,
    anyway: bool = False,
    sinks: Sequence[Sink] = (),
    **parts: Parts,
) -> Run:
    """Continue an interrupted or killed run bit for bit, and analyse it at the end. A finished run is only analysed.

    Args:
        folder: the run folder.
        progress: whether to show the progress on standard error.
        ceiling: whether the ceiling of the run is computed at its end.
        every: the ceiling looks at one frame out of so many.
        maps: whether the learned maps are stored at the end of each window.
        anyway: whether to go on even if versions or code differ from those that wrote the folder.
        sinks: objects that are called with each `Frame` from here on.
        parts: parts of your own that the run began with and that cannot be imported; see `Session`.

    Raises:
        DescriptionError: the folder is no run folder, its checkpoint is broken or belongs to another description,
            version or code, or another process runs in it.
        Interrupted: on Ctrl-C or SIGTERM, with a checkpoint written.
    """
    with reopen(folder, anyway=anyway, **parts) as (session, opened, since):
        _attach(session, sinks)
        play(session, opened, since, progress=progress, maps=maps)
        return finish(session, opened.path, bounds=ceiling, every=every, maps=maps)


def fork(
    folder: str | Path,
    description: Description,
    phase: int = 0,
    out: str | Path | None = None,
    *,
    progress: bool = True,
    ceiling: bool = True,
    every: int = EVERY,
    maps: bool = True,
    anyway: bool = False,
    **parts: Parts,
) -> Run:
    """Continue a run after one of its phases with other phases, so that one training serves many continuations.

    Args:
        folder: a run folder whose phase `phase` has ended.
        description: the new experiment. It must equal the old one up to the end of that phase.
        phase: the last phase to take over.
        out: the new run folder, new or empty; runs/<time>_<name>_seed<k> if None.
        progress: whether to show the progress on standard error.
        ceiling: whether the ceiling of the run is computed at its end.
        every: the ceiling looks at one frame out of so many.
        maps: whether the learned maps are stored at the end of each window.
        anyway: whether to go on even if versions or code differ from those that wrote the folder.
        parts: parts of your own, as `Session` takes them.

    Raises:
        DescriptionError: that phase does not exist or has not ended, or the descriptions differ before it ends.
    """
    require()
    source = RunFolder(folder)
    with Session(description, **parts) as session:
        new, old = session.description, source.description(forked=True, **parts)
        if phase not in range(len(old.phases)):
            valid = ", ".join(f"{k} ({each.name!r})" for k, each in enumerate(old.phases))
            raise DescriptionError(f"{folder} has no phase {phase!r} to fork after; choose one of {valid}.")
        before, after = (  # as plain data: what stands for a part that was handed over is made anew each time
            description.replaced(name=new.name, phases=description.phases[: phase + 1]).model_dump(mode="json")
            for description in (old, new)
        )
        if before != after:
            raise DescriptionError(f"The description differs from that of {folder} before the end of phase {phase}.")
        end = f"phase-{phase}.npz"
        if not (source.path / end).exists():
            raise DescriptionError(
                f"Phase {phase} of {folder} has not ended: there is no {end}. Resume that run first."
            )
        since = source.restore(session, end, anyway=anyway, forked=True)
        target = RunFolder.new(out, new)
        with target.emptied_if_nothing_ran(session):
            _take_over(source.path, target.path, since["recorder"]["parts"], phase)
            play(session, target, since, progress=progress, maps=maps)
        return finish(session, target.path, bounds=ceiling, every=every, maps=maps)


def _take_over(old: Path, new: Path, windows: int, phase: int) -> None:
    """Copy frames, maps and checkpoints that were written up to the end of a phase."""
    taken = [
        *sorted((old / "frames").glob("part-*.parquet"))[:windows],
        *sorted((old / "maps").glob("window-*.npz"))[:windows],
        *(end for k in range(phase + 1) if (end := old / f"phase-{k}.npz").exists()),
    ]
    for file in taken:
        copy = new / file.relative_to(old)
        copy.parent.mkdir(exist_ok=True)
        shutil.copy2(file, copy)


@contextmanager
def begin(
    description: Description, out: str | Path | None = None, **parts: Parts
) -> Iterator[tuple[Session, RunFolder]]:
    """A new session and its folder. The session is closed when the context ends."""
    require()
    with Session(description, **parts) as session:
        yield session, RunFolder.new(out, session.description)


@contextmanager
def reopen(
    folder: str | Path, *, anyway: bool = False, **parts: Parts
) -> Iterator[tuple[Session, RunFolder, dict[str, Any]]]:
    """The session of a run folder at its last checkpoint, and that checkpoint. Arguments as in `resume`."""
    require()
    opened = RunFolder(folder)
    description = opened.description(**parts)
    opened.checkpoint()  # before a body is built, which takes longer
    with Session(description) as session:
        yield session, opened, opened.restore(session, anyway=anyway)


def play(
    session: Session,
    folder: RunFolder,
    since: dict[str, Any] | None = None,
    *,
    progress: bool = True,
    maps: bool = True,
    whole: str | Path | None = None,
) -> None:
    """Run a session to its end, and record it.

    Ctrl-C and SIGTERM stop it between two frames. A second Ctrl-C breaks off a frame that hangs.

    Args:
        session: the session to run.
        folder: its folder.
        since: the checkpoint from which the session continues.
        progress: whether to show the progress on standard error.
        maps: whether the learned maps are stored at the end of each window.
        whole: the folder that a message names for continuing, if this run is part of something larger.

    Raises:
        Interrupted: on Ctrl-C or SIGTERM; a checkpoint has been written.
        Exception: whatever a part raises, with notes that say after how many frames, and how to go on.
    """
    session.share_arm()
    if progress and whole is None:
        print(robot_time(session.description), file=sys.stderr)
    if progress:
        for remark in session.remarks:
            print(remark, file=sys.stderr)
    bar, named = ProgressBar(session) if progress else nullcontext(), Path(whole or folder.path)
    came: list[int] = []
    try:
        with _stoppable(came), folder.recording(session, since, maps=maps), bar:
            for _ in session:
                if came:
                    break
    except KeyboardInterrupt:
        raise Interrupted(_broken_off(session, folder, named), *came[:1]) from None
    except DescriptionError:
        raise
    except (Exception, SystemExit) as cause:
        error = RuntimeError("A part called sys.exit") if isinstance(cause, SystemExit) else cause
        error.add_note(f"This came after {_counted(session.done)}{line_of(cause)}.")
        if session.resumable and (folder.path / CHECKPOINT).exists():
            error.add_note(f"What was recorded is kept. Once the cause is mended, {_go_on(named, 'go on')}")
        if error is not cause:
            raise error from cause
        raise
    if session.done < session.description.frames:
        raise Interrupted(f"Interrupted after {_counted(session.done)}. {_go_on(named)}", *came[:1])


def _attach(session: Session, sinks: Sequence[Sink]) -> None:
    for sink in sinks:
        session.attach(sink)


def _broken_off(session: Session, folder: RunFolder, named: Path) -> str:
    """What to say where a frame was not waited for."""
    if not (folder.path / CHECKPOINT).exists():
        return f"Broken off in frame {session.done}, before anything was recorded."
    if session.resumable:
        return f"Broken off in frame {session.done}; the last checkpoint is older. {_go_on(named)}"
    return f"Broken off in frame {session.done}. This body cannot be resumed; what was recorded is in {named}."


def _counted(frames: int) -> str:
    return "1 frame" if frames == 1 else f"{frames} frames"


def _go_on(folder: Path, words: str = "Go on") -> str:
    return f"{words} with: somatopy resume {shlex.quote(str(folder))}"


@contextmanager
def _stoppable(came: list[int]) -> Iterator[None]:
    """Note in `came` that Ctrl-C or SIGTERM came. Only the main thread may ask for signals: in others nobody does."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}

    def note(number: int, frame: FrameType | None) -> None:
        if came:
            raise KeyboardInterrupt
        came.append(number)

    for number in before:
        signal.signal(number, note)
    try:
        yield
    finally:
        for number, handler in before.items():
            if handler is not None:  # one that was not installed from Python cannot be put back
                signal.signal(number, handler)


def finish(
    session: Session,
    folder: Path,
    *,
    bounds: bool = True,
    every: int = EVERY,
    maps: bool = True,
    whole: str | Path | None = None,
) -> Run:
    """Do what follows the last frame: compute the ceiling, if the body has a model of itself, and the summary.

    Args:
        session: the session that has run.
        folder: its folder.
        bounds: whether ceiling and reactive bound are computed.
        every: the ceiling looks at one frame out of so many.
        maps: whether to store what could be seen in single frames (sight.npz).
        whole: the folder that a message names for continuing, if this run is part of something larger.

    Raises:
        Interrupted: on Ctrl-C. All frames are recorded.
    """
    opened = load_run(folder)
    try:
        if bounds and isinstance(session.body, Twin):
            _write_bounds(session, opened, every, maps)
        write_summary(opened)
    except KeyboardInterrupt:
        raise Interrupted(f"Interrupted after the last frame. {_go_on(Path(whole or folder))}") from None
    return opened


def _write_bounds(session: Session, opened: Run, every: int, maps: bool) -> None:
    bodies = _bodies_by_phase(session)
    phase = opened.values("phase")
    arms, heads, hits = (
        [np.ascontiguousarray(values[phase == index]) for index in range(len(bodies))]
        for values in (opened.postures("arm"), opened.postures("head"), opened.values("hit").astype(bool))
    )
    try:
        table = ceiling(bodies, arms, every=every)
        for found, distance in zip(table["phases"], miss_distances(bodies, arms, heads, hits), strict=True):
            found["miss_distance_rad"] = distance
        write_json(opened.path / "ceiling.json", table)
        if maps:
            write_sight(opened.path, bodies, arms)
    finally:
        for body in bodies:
            if body is not session.body:
                body.close()


def _bodies_by_phase(session: Session) -> list[Modelled]:
    """The body in each phase: another one, injured, where an intervention changes what it can see."""
    bodies: list[Any] = []
    for index, phase in enumerate(session.description.phases):
        if phase.frames and any(intervention.alters_ceiling for intervention in session.interventions[index]):
            with session.holding(index):
                bodies.append(session.body.another())  # type: ignore[attr-defined]
        else:
            bodies.append(session.body)
    return bodies
