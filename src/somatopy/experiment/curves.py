"""Curves of a run as it goes on, for those who watch their experiments in TensorBoard or Weights & Biases."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from math import isfinite
from numbers import Integral
from pathlib import Path
from typing import Any, Self

from somatopy.experiment.frame import Frame

__all__ = ["Curves", "TensorBoard", "WandB"]


class Curves:
    """A sink that gathers frames, and gives their means once a minute of robot time and at the end of each phase.

    It gives `hit_rate`, the share of these frames in which the hand was seen, and `phase`, the index of the phase. It
    also gives the mean of each quantity that eye, learner and interventions record, over the frames that have a value.
    To send them somewhere else, derive a class from this one and define its method `write`.

    Args:
        every: frames from one point of the curves to the next, at least 1.

    Raises:
        ValueError: `every` is below 1.

    Example:
        >>> from somatopy import Session, paper
        >>> class Printed(Curves):
        ...     def write(self, frames, means):
        ...         print(frames, sorted(means))
        >>> phase = paper().phases[0].replaced(frames=30)
        >>> described = paper().replaced(eye={"kind": "geometric"}, body={"motion": "kinematic"}, phases=[phase])
        >>> with Session(described) as session, Printed() as curves:
        ...     session.attach(curves)
        ...     for _ in session:
        ...         pass
        30 ['arm_distance', ...'hit_rate', ...'phase'...]
    """

    def __init__(self, every: int = 900) -> None:
        if every < 1:
            raise ValueError(f"every = {every!r} must be at least 1: frames from one point of the curves to the next.")
        self.every = every
        self._begin()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __call__(self, frame: Frame) -> None:
        """A frame has passed."""
        self._frames += 1
        self._hits += frame.sighting is not None
        for name, value in frame.probes.items():
            if isfinite(value) and not isinstance(value, Integral):  # numbers of units have no mean
                total, count = self._sums.get(name, (0.0, 0))
                self._sums[name] = total + value, count + 1
        if frame.ends or self._frames == self.every:
            means = {name: total / count for name, (total, count) in self._sums.items()}
            self.write(frame.number + 1, {"hit_rate": self._hits / self._frames, "phase": frame.phase, **means})
            self._begin()

    def write(self, frames: int, means: Mapping[str, float]) -> None:
        """Take a point of each curve.

        Args:
            frames: frames of the experiment so far.
            means: the values by name.
        """
        raise NotImplementedError("A sink of curves needs a method write(frames, means).")

    def close(self) -> None:
        """Finish writing. The end of a `with` block calls it."""

    def _begin(self) -> None:
        self._frames, self._hits = 0, 0
        self._sums: dict[str, tuple[float, int]] = {}


class TensorBoard(Curves):
    """Curves in an event file, for `tensorboard --logdir FOLDER`. Nothing goes over a network.

    Needs the extra `tensorboard`: pip install "somatopy[tensorboard]".

    Args:
        folder: where the event file goes; it is made if it is not there.
        every: frames from one point of the curves to the next, at least 1.

    Raises:
        ImportError: the extra is not installed.
        ValueError: `every` is below 1.
    """

    def __init__(self, folder: str | Path, every: int = 900) -> None:
        super().__init__(every)
        self._events = _needed("tensorboard.compat.proto.event_pb2", "tensorboard")
        self._summaries = import_module("tensorboard.compat.proto.summary_pb2")
        files = import_module("tensorboard.summary.writer.event_file_writer")
        self._file: Any = files.EventFileWriter(str(folder))

    def write(self, frames: int, means: Mapping[str, float]) -> None:
        """Write a point of each curve; its step is the number of frames so far."""
        values = [self._summaries.Summary.Value(tag=name, simple_value=value) for name, value in means.items()]
        self._file.add_event(self._events.Event(step=frames, summary=self._summaries.Summary(value=values)))

    def close(self) -> None:
        """Write what is left, and close the file."""
        self._file.close()


class WandB(Curves):
    """Curves in a run of Weights & Biases. By default it is offline: nothing leaves the machine until `wandb sync`.

    Needs the extra `wandb`: pip install "somatopy[wandb]".

    Args:
        folder: where the run's files go; it is made if it is not there.
        project: the project that the run belongs to.
        name: the run's name; one is chosen if it is None.
        mode: "offline" or "online"; online needs an account there.
        every: frames from one point of the curves to the next, at least 1.

    Raises:
        ImportError: the extra is not installed.
        ValueError: `every` is below 1, or another `mode`.
    """

    def __init__(
        self,
        folder: str | Path,
        project: str = "somatopy",
        name: str | None = None,
        mode: str = "offline",
        every: int = 900,
    ) -> None:
        super().__init__(every)
        if mode not in ("offline", "online"):
            raise ValueError(f'mode = {mode!r} must be "offline" or "online".')
        wandb = _needed("wandb", "wandb")
        Path(folder).mkdir(parents=True, exist_ok=True)
        self._run: Any = wandb.init(project=project, name=name, mode=mode, dir=str(folder))

    def write(self, frames: int, means: Mapping[str, float]) -> None:
        """Log a point of each curve; its step is the number of frames so far."""
        self._run.log(dict(means), step=frames)

    def close(self) -> None:
        """Finish the run."""
        self._run.finish()


def _needed(module: str, extra: str) -> Any:
    try:
        return import_module(module)
    except ImportError as error:
        raise ImportError(f'{extra} is not installed. Install it: pip install "somatopy[{extra}]".') from error
