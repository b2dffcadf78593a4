"""Contestants that take turns in one process, so that all meet the same machine: compare the ratios, not the times."""

from __future__ import annotations

import platform
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
Run = Callable[[Array], object]

MOST = 20_000  # samples of a turn
PACKAGES = ("somatopy", "numpy", "numba", "minisom", "numbasom", "minigng")


@dataclass
class Contestant:
    """One thing to measure.

    Attributes:
        group: what it is compared with: the first contestant of a group is the reference of the others.
        name: what it is.
        run: learns the samples (n, dims) it is given.
        count: samples of a turn; None for as many as fill a turn.
        before: what makes ready for a turn, and is not timed.
    """

    group: str
    name: str
    run: Run
    count: int | None = None
    before: Callable[[], object] = lambda: None

    def seconds(self, samples: Array) -> float:
        """CPU time of one turn."""
        self.before()
        began = process_time()
        self.run(samples)
        return process_time() - began

    def warm_up(self, inputs: Array, turn: float) -> None:
        """Compile, and choose how many samples fill a turn of so many seconds."""
        if self.count is not None:
            self.seconds(inputs[: self.count])
            return
        self.seconds(inputs[:2])
        self.count = 2
        while self.count < len(inputs) and self.seconds(inputs[: self.count]) < turn / 4:
            self.count = min(4 * self.count, len(inputs))


def measure(contestants: Sequence[Contestant], dims: int, turns: int, turn: float = 0.05) -> list[dict[str, Any]]:
    """Median microseconds of CPU a sample, over the turns, and how many times those of the group's reference.

    Each turn has inputs of its own, the same for all.
    """
    stream = np.random.default_rng(2)
    for contestant in contestants:
        contestant.warm_up(stream.random((MOST, dims)), turn)
    times: list[list[float]] = [[] for _ in contestants]
    for _ in range(turns):
        inputs = stream.random((MOST, dims))
        for taken, contestant in zip(times, contestants, strict=True):
            assert contestant.count is not None and contestant.count <= MOST
            taken.append(1e6 * contestant.seconds(inputs[: contestant.count]) / contestant.count)
    medians = [statistics.median(taken) for taken in times]
    reference: dict[str, float] = {}
    for contestant, median in zip(contestants, medians, strict=True):
        reference.setdefault(contestant.group, median)
    return [
        {"group": one.group, "name": one.name, "microseconds": median, "times": median / reference[one.group]}
        for one, median in zip(contestants, medians, strict=True)
    ]


def machine() -> dict[str, str]:
    """Processor and versions."""
    versions = {}
    for package in PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            versions[package] = "not installed"
    return {"processor": _processor(), "python": platform.python_version(), **versions}


def _processor() -> str:
    try:
        with open("/proc/cpuinfo") as file:
            return next(line.split(":")[1].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def uniform(count: int, dims: int) -> Array:
    """Inputs drawn from the unit cube; not the numbers that a map of random_state=0 starts with."""
    return np.random.default_rng(1).random((count, dims))
