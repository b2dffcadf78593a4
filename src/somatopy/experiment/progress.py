"""The progress bar of a run, with frames per second, time left and the present hit rate."""

from __future__ import annotations

from time import perf_counter
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from somatopy.experiment.frame import Frame
from somatopy.experiment.session import Session

__all__ = ["ProgressBar"]

_REFRESH_S = 0.2


class ProgressBar:
    """A progress bar on standard error, shown while the context lasts.

    Args:
        session: the session that runs.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.percentage:>3.0f} % {task.fields[rate]}"),
            TextColumn("hits {task.fields[hits]}"),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=Console(stderr=True),
        )
        description = session.description
        self._task: TaskID = self._bar.add_task(description.name, total=description.frames, rate="", hits="")
        self._at, self._done, self._hits = perf_counter(), session.done, session.hits

    def __enter__(self) -> Self:
        self._bar.start()
        self._session.attach(self)
        return self

    def __exit__(self, *_: object) -> None:
        self._session.detach(self)
        self._show()
        self._bar.stop()

    def __call__(self, frame: Frame) -> None:
        """A frame has passed; the bar is drawn anew now and then."""
        if perf_counter() - self._at >= _REFRESH_S:
            self._show()

    def _show(self) -> None:
        now, session = perf_counter(), self._session
        frames = session.done - self._done
        if frames:
            rate = f"{frames / (now - self._at):,.0f} frames/s"
            hits = f"{(session.hits - self._hits) / frames:.0%} now, {session.hits / session.done:.1%} so far"
            self._bar.update(self._task, completed=session.done, rate=rate, hits=hits)
        self._at, self._done, self._hits = now, session.done, session.hits
