"""The frame, always in the same order, and the run through all phases."""

from __future__ import annotations

import os
import resource
import shutil
from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from somatopy.experiment.build import (
    build_babbler,
    build_body,
    build_damage,
    build_eye,
    build_learner,
    check_phases,
    limits,
    stream,
)
from somatopy.experiment.checkpoint import FILE, locked, read_checkpoint, write_checkpoint
from somatopy.experiment.damage import Damage
from somatopy.experiment.description import Description, DescriptionError, Fiducial, OwnLearner
from somatopy.experiment.recorder import PART_FRAMES, Recorder, write_json
from somatopy.learners import HebbianLearner, Learner
from somatopy.percept import Floats, Percept

__all__ = ["CHECKPOINT_S", "Experiment", "MakeLearner"]

MakeLearner = Callable[[Floats, Floats, tuple[int, int], np.random.Generator], Learner]

#: Wall time between two checkpoints.
CHECKPOINT_S = 20.0


class Experiment:
    """Robot, eye, babbler, learner and damages of a description, ready to run.

    Building it finds all that is wrong with a description, the camera included, before anything is written.

    Args:
        description: what to run.
        learner: makes a learner of your own from arm limits (n_arm, 2) and head limits (n_head, 2), rad, image size
            (width, height), px, and its random numbers; the description's learner if None.

    Attributes:
        description: the same, naming the learner that was handed over.
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

    def __init__(self, description: Description, learner: MakeLearner | None = None) -> None:
        if learner is not None:
            own = OwnLearner(name=getattr(learner, "__qualname__", type(learner).__name__))
            description = description.model_copy(update={"learner": own})
        self.description = description
        self._own_learner = learner
        self.body = build_body(description)
        try:
            self._reading = self.body.reset(description.seed)
            self.eye = build_eye(description, self.body)
            self.babbler = build_babbler(description, self.body, self._reading.arm)
            self.learner = self._build_learner("learner")
            check_phases(description, self.learner)
            self._damages = [build_damage(phase, self.body) for phase in description.phases]
            self._damage_rng = stream(description.seed, "damage")
            if isinstance(description.eye, Fiducial):
                self.body.picture()
        except BaseException:
            self.body.close()
            raise
        self._has_run = False
        self._plastic = self.learner.plastic
        self._recorded: dict[str, Any] = {"part": 0, "frame": 0, "row": 0, "rows": {}}
        self._began, self._wall_before = perf_counter(), 0.0
        self.done = self.hits = 0
        self.seconds = dict.fromkeys(("physics", "render", "detect", "babble", "damage", "learn", "record"), 0.0)

    def run(self, folder: Path, watch: Callable[[Experiment], bool] | None = None) -> bool:
        """Run all phases from where the experiment stands, and write what happens.

        A checkpoint is written every `CHECKPOINT_S` seconds, at the end of each phase and when the run is stopped.

        Args:
            folder: the run folder, as `prepare_folder` made it.
            watch: called after every frame; says whether to stop.

        Returns:
            Whether all phases have ended.

        Raises:
            DescriptionError: another process runs in this folder.
            RuntimeError: this object has run already.
        """
        if self._has_run:
            raise RuntimeError("This experiment has run already; build a new one from its description.")
        self._has_run = True
        with locked(folder):
            recorder = Recorder(folder, self.description, self.body.arm, self.body.head, self.learner.probes())
            recorder.restore(self._recorded)
            self._began, self.body.render_s, start = perf_counter(), 0.0, self.done
            try:
                return all(self._phase(index, folder, recorder, watch) for index in range(len(self._damages)))
            finally:
                recorder.close()
                self.body.close()
                if self.done > start or not (folder / "cost.json").exists():
                    write_json(folder / "cost.json", self._cost())

    def _phase(self, index: int, folder: Path, recorder: Recorder, watch: Callable[[Experiment], bool] | None) -> bool:
        """What is left of one phase; whether it has ended."""
        first, last = self._span(index)
        if self.done >= last:
            return True
        self._prepare(index, afresh=self.done == first)
        saved = perf_counter()
        while self.done < last:
            self._frame(index, recorder)
            if self.done % PART_FRAMES == 0:
                recorder.keep_maps(self.learner.maps())
            stop = watch is not None and watch(self)
            if stop or perf_counter() - saved > CHECKPOINT_S:
                write_checkpoint(folder / FILE, self.state(recorder))
                saved = perf_counter()
            if stop and self.done < last:
                return False
        self._damages[index].heal(self.body)
        write_checkpoint(folder / f"phase-{index}.npz", self.state(recorder))
        shutil.copyfile(folder / f"phase-{index}.npz", folder / (FILE + ".partial"))
        os.replace(folder / (FILE + ".partial"), folder / FILE)
        return True

    def _span(self, index: int) -> tuple[int, int]:
        """First frame of a phase, and the one after its last."""
        first = sum(phase.frames for phase in self.description.phases[:index])
        return first, first + self.description.phases[index].frames

    def _prepare(self, index: int, afresh: bool) -> None:
        """Say which parts learn in a phase; if it begins here, injure the body and change the learner."""
        phase = self.description.phases[index]
        if afresh:
            self._damages[index].injure(self.body)
            self._reading = self.body.restore(self.body.state())  # sensed again: as it is now
        if afresh and phase.start == "afresh":
            self.learner = self._build_learner(f"learner of phase {index}")
        if afresh and phase.start == "shuffled" and isinstance(self.learner, HebbianLearner):
            self.learner.shuffle_links(stream(self.description.seed, "shuffle"))
        if phase.plastic is not None:
            self.learner.plastic = frozenset(phase.plastic)
        else:
            self.learner.plastic = self._plastic

    def _build_learner(self, name: str) -> Learner:
        body = self.body
        if self._own_learner is None:
            return build_learner(self.description, body, name)
        image = body.camera.width, body.camera.height
        return self._own_learner(limits(body.arm), limits(body.head), image, stream(self.description.seed, name))

    @property
    def damage(self) -> Damage:
        """The damage of the last phase that the experiment has reached."""
        return [damage for k, damage in enumerate(self._damages) if self._span(k)[0] <= self.done][-1]

    @property
    def parts(self) -> int:
        """Finished parts of frames/ up to where the experiment stands."""
        return int(self._recorded["part"])

    def state(self, recorder: Recorder) -> dict[str, Any]:
        """All that a bit-exact continuation needs, as arrays and plain values."""
        return {
            "body": self.body.state(),
            "babbler": self.babbler.state(),
            "learner": self.learner.state(),
            "damage_rng": self._damage_rng.bit_generator.state,
            "recorder": recorder.state(),
            "done": self.done,
            "hits": self.hits,
            "seconds": self.seconds,
            "wall_s": self._wall(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Stand where a `state()` of the same description stood, the body injured as it was there."""
        self.done, self.hits = int(state["done"]), int(state["hits"])
        for index, damage in enumerate(self._damages):
            first, last = self._span(index)
            if first < self.done < last:
                damage.injure(self.body)
        self._reading = self.body.restore(state["body"])
        self.babbler.restore(state["babbler"])
        self.learner.restore(state["learner"])
        self._damage_rng.bit_generator.state = state["damage_rng"]
        self._recorded = state["recorder"]
        self.seconds, self._wall_before = dict(state["seconds"]), float(state["wall_s"])

    def restore_from(self, checkpoint: Path) -> None:
        """Stand where a checkpoint of the same description stood.

        Raises:
            DescriptionError: it cannot be read, or another description's parts are in it.
        """
        state = read_checkpoint(checkpoint)
        try:
            self.restore(state)
        except (KeyError, TypeError, ValueError) as error:
            raise DescriptionError(f"{checkpoint} does not fit the description of its run: {error}.") from error

    def _frame(self, phase: int, recorder: Recorder) -> None:
        """One frame of 1/15 s. The order is an invariant of the experiment."""
        reading, rendered, clock = self._reading, self.body.render_s, _Clock(self.seconds)
        sighting = self.eye.look(reading)  # 1 sense
        clock.lap("detect")
        target = self.babbler.command(reading.time)  # 2 babble
        clock.lap("babble")
        percept = Percept(
            reading.time, reading.arm, reading.head, reading.arm_command, reading.head_command, sighting, reading.dt
        )
        percept = self._damages[phase].sense(percept, self._damage_rng)  # 3 damage
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

    def _wall(self) -> float:
        return self._wall_before + perf_counter() - self._began

    def _cost(self) -> dict[str, object]:
        wall = self._wall()
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
