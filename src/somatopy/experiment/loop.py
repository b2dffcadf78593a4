"""The frame, always in the same order, and the run through all phases."""

from __future__ import annotations

import resource
from collections.abc import Callable, Iterator
from pathlib import Path
from time import perf_counter

from somatopy.experiment.build import build_babbler, build_body, build_damage, build_eye, build_learner, stream
from somatopy.experiment.damage import Damage
from somatopy.experiment.description import Description
from somatopy.experiment.recorder import Recorder, write_json
from somatopy.percept import Percept

__all__ = ["Experiment"]


class Experiment:
    """Robot, eye, babbler, learner and damages of a description, ready to run once.

    Building it finds all that is wrong with a description, the camera included, before anything is written.

    Args:
        description: what to run.

    Attributes:
        description: the same.
        body: the robot.
        eye: what finds the marker.
        babbler: what moves the arm.
        learner: what moves the head.
        done: frames so far.
        hits: frames so far in which the marker was detected.
        seconds: wall time by part of the frame: physics, render, detect, babble, damage, learn, record.

    Raises:
        ValueError: the description does not fit the robot.
        NoGL: the eye needs pictures and no OpenGL works here.
    """

    def __init__(self, description: Description) -> None:
        self.description = description
        self.body = build_body(description)
        try:
            self._reading = self.body.reset(description.seed)
            self.eye = build_eye(description, self.body)
            self.babbler = build_babbler(description, self.body, self._reading.arm)
            self.learner = build_learner(description, self.body)
            self._damages = [build_damage(phase, self.body) for phase in description.phases]
            self._damage_rng = stream(description.seed, "damage")
            self.eye.look(self._reading)
        except BaseException:
            self.body.close()
            raise
        self.done = self.hits = 0
        self.seconds = dict.fromkeys(("physics", "render", "detect", "babble", "damage", "learn", "record"), 0.0)

    def run(self, folder: Path, watch: Callable[[Experiment], None] | None = None) -> None:
        """Run all phases, once, and write what happens.

        Args:
            folder: the run folder, as `prepare_folder` made it.
            watch: called after every frame; may raise to stop the run, which keeps what was recorded.

        Raises:
            RuntimeError: it has run already.
        """
        if self.done:
            raise RuntimeError("This experiment has run already; build a new one from its description.")
        recorder = Recorder(folder, self.description, self.body.arm, self.body.head, self.learner.probes())
        start, self.body.render_s = perf_counter(), 0.0
        try:
            for phase, damage in self._frames():
                self._frame(phase, damage, recorder)
                if watch is not None:
                    watch(self)
        finally:
            recorder.close()
            self.body.close()
            write_json(folder / "cost.json", self._cost(perf_counter() - start))

    def _frames(self) -> Iterator[tuple[int, Damage]]:
        """Phase index and damage of each frame; damages injure the body when a phase begins and heal it after."""
        for index, (phase, damage) in enumerate(zip(self.description.phases, self._damages, strict=True)):
            damage.injure(self.body)
            for _ in range(phase.frames):
                yield index, damage
            damage.heal(self.body)

    def _frame(self, phase: int, damage: Damage, recorder: Recorder) -> None:
        """One frame of 1/15 s. The order is an invariant of the experiment."""
        reading, rendered, clock = self._reading, self.body.render_s, _Clock(self.seconds)
        sighting = self.eye.look(reading)  # 1 sense
        clock.lap("detect")
        target = self.babbler.command(reading.time)  # 2 babble
        clock.lap("babble")
        percept = Percept(
            reading.time, reading.arm, reading.head, reading.arm_command, reading.head_command, sighting, reading.dt
        )
        percept = damage.sense(percept, self._damage_rng)  # 3 damage
        clock.lap("damage")
        self.learner.observe(percept)  # 4 to 7: normalise, maps learn, winners, links learn
        gaze = self.learner.gaze(percept)  # 8 gaze
        clock.lap("learn")
        recorder.record(phase, reading, percept, self.learner.probes())
        clock.lap("record")
        self._reading = self.body.step(target, gaze)  # 9 the body advances
        clock.lap("physics")
        self.seconds["render"] += self.body.render_s - rendered
        self.seconds["detect"] -= self.body.render_s - rendered
        self.done += 1
        self.hits += sighting is not None

    def _cost(self, wall: float) -> dict[str, object]:
        return {
            "wall_s": wall,
            "frames": self.done,
            "frames_per_s": self.done / wall if wall else None,
            "peak_memory_bytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
            "microseconds_per_frame": {k: 1e6 * v / max(1, self.done) for k, v in self.seconds.items()},
        }


class _Clock:
    """Adds the time since the last lap to a part's account."""

    def __init__(self, seconds: dict[str, float]) -> None:
        self._seconds = seconds
        self._last = perf_counter()

    def lap(self, part: str) -> None:
        now = perf_counter()
        self._seconds[part] += now - self._last
        self._last = now
