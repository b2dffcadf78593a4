"""A progress bar with frames per second, time left and the live hit rate; Ctrl-C and SIGTERM stop between frames."""

from __future__ import annotations

import shlex
import signal
import sys
from pathlib import Path
from time import perf_counter
from types import FrameType

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from somatopy.experiment import Experiment

__all__ = ["run_with_progress"]

_REFRESH_S = 0.2


def run_with_progress(experiment: Experiment, folder: Path, whole: Path | None = None) -> None:
    """Run it into `folder`, as `prepare_folder` made it, and show how far it is.

    Args:
        experiment: what to run.
        folder: the run folder.
        whole: the folder to name for going on, where this run is part of a greater whole.

    Raises:
        KeyboardInterrupt: on Ctrl-C, once the frame under way, the parts and a checkpoint are written.
    """
    console = Console(stderr=True)
    interrupted = False

    def interrupt(number: int, frame: FrameType | None) -> None:
        nonlocal interrupted
        interrupted = True

    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} % {task.fields[rate]}"),
        TextColumn("hits {task.fields[hits]}"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=console,
    )
    before = {number: signal.signal(number, interrupt) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        with bar:
            task = bar.add_task(experiment.description.name, total=experiment.description.frames, rate="", hits="")
            ticker = _Ticker(bar, task, experiment)

            def watch(running: Experiment) -> bool:
                ticker.tick(running)
                return interrupted

            ended = experiment.run(folder, watch)
            ticker.show(experiment)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if not ended:
        command = f"somatopy resume {shlex.quote(str(whole or folder))}"
        print(f"Interrupted after {experiment.done} frames. Go on with: {command}", file=sys.stderr)
        raise KeyboardInterrupt


class _Ticker:
    """Updates the bar now and then, with the rates since the last update and over the last window."""

    def __init__(self, bar: Progress, task: TaskID, experiment: Experiment) -> None:
        self._bar, self._task = bar, task
        self._at, self._done, self._hits = perf_counter(), experiment.done, experiment.hits

    def tick(self, experiment: Experiment) -> None:
        if perf_counter() - self._at >= _REFRESH_S:
            self.show(experiment)

    def show(self, experiment: Experiment) -> None:
        now, frames = perf_counter(), experiment.done - self._done
        if frames:
            rate = f"{frames / (now - self._at):,.0f} frames/s"
            hits = f"{(experiment.hits - self._hits) / frames:.0%} now, {experiment.hits / experiment.done:.1%} so far"
            self._bar.update(self._task, completed=experiment.done, rate=rate, hits=hits)
        self._at, self._done, self._hits = now, experiment.done, experiment.hits
