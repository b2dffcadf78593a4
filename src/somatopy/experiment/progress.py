"""The progress bar of a run, with frames per second, time left and the present hit rate."""

from __future__ import annotations

from collections import deque
from time import perf_counter
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from somatopy.clock import FRAMES_PER_MINUTE
from somatopy.experiment.description import Description
from somatopy.experiment.frame import Frame
from somatopy.experiment.session import Session

__all__ = ["ProgressBar", "robot_time"]

_REFRESH_S = 0.2
#: Over how much wall time frames per second are averaged.
_AVERAGED_S = 10.0
#: Terminals with fewer columns than this are told less, so that no time is cut.
_WIDE = 100


class ProgressBar:
    """A progress bar on standard error, shown while the context lasts.

    Args:
        session: the session that runs.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        console = Console(stderr=True)
        self._wide = console.width >= _WIDE
        name = _cut(session.description.name, 20 if self._wide else 12)
        left = console.width - len(name) - (73 if self._wide else 63)  # all else takes so many columns at most
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(max(4, min(40, left))),
            TextColumn("{task.percentage:>3.0f} % {task.fields[rate]}"),
            TextColumn("hits {task.fields[hits]}"),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=console,
        )
        self._task: TaskID = self._bar.add_task(name, total=session.description.frames, rate="", hits="")
        self._at, self._done, self._hits = perf_counter(), session.done, session.hits
        self._shown = deque([(self._at, self._done)])

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
            self._shown.append((now, session.done))
            while len(self._shown) > 2 and now - self._shown[1][0] > _AVERAGED_S:
                self._shown.popleft()
            since, done = self._shown[0]
            rate = f"{(session.done - done) / (now - since):,.0f} frames/s"
            lately = f"{(session.hits - self._hits) / frames:.0%} now, " if self._wide else ""
            hits = f"{lately}{session.hits / session.done:.1%} so far"
            self._bar.update(self._task, completed=session.done, rate=rate, hits=hits)
        self._at, self._done, self._hits = now, session.done, session.hits


def _cut(text: str, length: int) -> str:
    return text if len(text) <= length else f"{text[: length - 1]}…"


def robot_time(description: Description) -> str:
    """How much robot time an experiment takes, phase by phase.

    Example:
        >>> from somatopy.experiment import paper
        >>> robot_time(paper())
        'Robot time: 304.3 minutes (phase 1, intact: 197.6; phase 2, damaged: 106.7).'
    """
    lengths = [_minutes(phase.frames) for phase in description.phases]
    parts = [f"phase {k}, {p.name}: {m}" for k, (p, m) in enumerate(zip(description.phases, lengths, strict=True), 1)]
    whole = _minutes(description.frames)
    return f"Robot time: {whole} minute{'' if whole == '1' else 's'} ({'; '.join(parts)})."


def _minutes(frames: int) -> str:
    """Minutes of robot time with one decimal, and more where they are few."""
    minutes = frames / FRAMES_PER_MINUTE
    return f"{minutes:,.1f}".removesuffix(".0") if minutes >= 1 or not frames else f"{minutes:.2g}"
