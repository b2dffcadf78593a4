"""Measure whether `best` reaches the same on other descriptions of a robot and behind other cameras: docs/best.md.

usage: python docs/measure_invariance.py

A NAO without physics, the range of `paper-wide`, 20 minutes, the same arm movements for all. Takes about two minutes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from somatopy import Session
from somatopy.bodies import MujocoBody
from somatopy.clock import WINDOW
from somatopy.experiment.ceiling import EVERY, Vantages, reachable
from somatopy.experiment.description import Description
from somatopy.experiment.presets import paper_wide
from somatopy.learners import BestLearner
from somatopy.percept import Floats, Percept, Robot, Space

SEEDS, WINDOWS = range(3), 4


@dataclass(frozen=True)
class Described:
    """The same joints in another order, with other signs and zeros: value k is sign[k] x[order[k]] + zero[k]."""

    order: tuple[int, ...]
    sign: tuple[float, ...]
    zero: tuple[float, ...]

    def told(self, values: Floats) -> Floats:
        told: Floats = np.array(self.sign) * values[list(self.order)] + np.array(self.zero)
        return told

    def meant(self, told: Floats) -> Floats:
        values = np.empty_like(told)
        values[list(self.order)] = (told - np.array(self.zero)) * np.array(self.sign)
        return values

    def space(self, space: Space) -> Space:
        ends = np.sort([self.told(space.lower), self.told(space.upper)], axis=0)
        return Space([space.names[k] for k in self.order], *ends)


ARM = Described((0, 1, 2, 3), (1, 1, 1, 1), (0, 0, 0, 0))
HEAD = Described((0, 1), (1, 1), (0, 0))


class Elsewhere(BestLearner):
    """The learner on a robot whose joints are described otherwise."""

    def __init__(self, robot: Robot, rng: np.random.Generator, arm: Described, head: Described) -> None:
        self._arm, self._head = arm, head
        senses = {"arm": arm.space(robot.arm), "head": head.space(robot.head)}
        super().__init__(replace(robot, senses=senses), rng)

    def observe(self, percept: Percept) -> None:
        arm, target = self._arm.told(percept.arm), self._arm.told(percept.arm_command)
        head, command = self._head.told(percept.head), self._head.told(percept.head_command)
        self._percept = replace(percept, arm=arm, head=head, arm_command=target, head_command=command)
        super().observe(self._percept)

    def gaze(self, percept: Percept) -> Floats:
        return self._head.meant(super().gaze(self._percept))


def nao(fovy: float | None = None, finer: int = 1) -> MujocoBody:
    """A NAO without physics, its picture `finer` times as many pixels wide and high."""
    body = MujocoBody("nao", motion="kinematic", fovy=fovy)
    size = {"width": finer * body.camera.width, "height": finer * body.camera.height}
    camera = body.anatomy.camera.model_copy(update=size)
    return MujocoBody(body.anatomy.model_copy(update={"camera": camera}), motion="kinematic", fovy=fovy)


#: What is measured: a body, and how its arm and head are described.
CASES: dict[str, tuple[Callable[[], MujocoBody], Described, Described]] = {
    "as it is": (nao, ARM, HEAD),
    "arm joints in another order": (nao, replace(ARM, order=(2, 0, 3, 1)), HEAD),
    "second arm joint turned round": (nao, replace(ARM, sign=(1, -1, 1, 1)), HEAD),
    "zero of the third arm joint shifted by .7 rad": (nao, replace(ARM, zero=(0, 0, 0.7, 0)), HEAD),
    "yaw of the head turned round": (nao, ARM, replace(HEAD, sign=(-1, 1))),
    "pitch of the head turned round": (nao, ARM, replace(HEAD, sign=(1, -1))),
    "picture of 640 x 480": (lambda: nao(finer=2), ARM, HEAD),
    "field of view of 45 degrees": (lambda: nao(fovy=45), ARM, HEAD),
    "field of view of 75 degrees": (lambda: nao(fovy=75), ARM, HEAD),
}


def described(seed: int) -> Description:
    phase = paper_wide().phases[0].replaced(frames=WINDOWS * WINDOW)
    return paper_wide().replaced(seed=seed, eye={"kind": "geometric"}, phases=[phase])


def efficiency(seed: int, body: MujocoBody, arm: Described, head: Described) -> Floats:
    """Hits by what can be seen, in the first window and in the later ones, percent, shape (2,)."""

    def learner(robot: Robot, rng: np.random.Generator) -> Elsewhere:
        return Elsewhere(robot, rng, arm, head)

    vantages = Vantages.of(body)
    with Session(described(seed), body=body, learner=learner) as session:
        frames = [(frame.sighting is not None, frame.reading.arm) for frame in session]
    hits, arms = np.array([hit for hit, _ in frames]), np.array([arm for _, arm in frames])
    seen = reachable(vantages, arms[::EVERY])
    parts = slice(WINDOW), slice(WINDOW, None)
    sampled = slice(WINDOW // EVERY), slice(WINDOW // EVERY, None)
    return np.array([100 * hits[a].mean() / seen[b].mean() for a, b in zip(parts, sampled, strict=True)])


def main() -> None:
    """A row for each case: both efficiencies, mean over seeds, and how far the second is from the first case's."""
    print("| | first 5 minutes | minutes 5 to 20 | minutes 5 to 20 minus the first row, seed by seed |")
    print("|---|---|---|---|")
    first = None
    for name, (make, arm, head) in CASES.items():
        found = np.array([efficiency(seed, make(), arm, head) for seed in SEEDS])
        first = found if first is None else first
        apart = ", ".join(f"{value:+.1f}" for value in found[:, 1] - first[:, 1])
        start, later = found.mean(axis=0)
        print(f"| {name} | {start:.1f} | {later:.1f} | {apart} |", flush=True)


if __name__ == "__main__":
    main()
