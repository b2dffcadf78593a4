"""The session, which runs an experiment frame by frame and writes no files."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from itertools import chain
from time import perf_counter
from typing import Any, Self

import numpy as np

from somatopy.clock import FRAME
from somatopy.contract import Babbler, Body, Eye, Intervention, Learner, Resumable, SharesArm
from somatopy.experiment.building import built, hand_over, said_of
from somatopy.experiment.context import Context, stream
from somatopy.experiment.description import Description, DescriptionError
from somatopy.experiment.frame import PARTS, Frame, Sink
from somatopy.experiment.look import require_sight
from somatopy.experiment.phases import PhaseInterventions, Place
from somatopy.experiment.probes import Probes
from somatopy.experiment.provenance import code_of
from somatopy.percept import Floats, Percept, Picture, Reading, Sighting
from somatopy.registry import HANDED_OVER, Settings

__all__ = ["Session"]


class Session:
    """An experiment that is ready to run, with its robot, eye, babbler, learner and interventions. It writes no files.

    Iterate over a session to run it. It yields one `Frame` after the other, until all phases have ended. The body has
    then already moved. You may stop at any frame, and take a `state()` between two frames. Faults of a description are
    found when the session is made, before anything runs. Sinks that you attach are called with each frame.

    Parts of your own can replace those of the description. Give a class, or a function that makes the part. A body, an
    eye or a babbler may also be a finished object. An eye is made from the body. A babbler is made from the arm's
    joints, the arm's start posture, shape (n_arm,), rad, and a generator of random numbers. A learner is made from a
    `Robot` and such a generator. A body and an intervention are made from nothing.

    Args:
        description: what to run.
        body: a robot of your own.
        eye: an eye of your own.
        babbler: a babbler of your own.
        learner: a learner of your own.
        interventions: interventions of your own: a list for each phase, by the phase's name. They apply after those of
            the description.

    Attributes:
        description: the description, with the parts that were given instead of its own.
        body: the robot.
        eye: what finds the marker.
        babbler: what moves the arm.
        learner: what moves the head.
        done: number of frames so far.
        hits: number of frames so far in which the marker was detected.
        seconds: wall time of all frames so far, by part of the frame.

    Raises:
        DescriptionError: the description, or a part, does not fit the robot or its contract.
        BodyError: the robot's model or anatomy does not fit.
        NoGL: the eye needs pictures and no OpenGL works here.

    Example:
        >>> from somatopy import paper
        >>> description = paper().replaced(body={"motion": "kinematic"}, eye={"kind": "geometric"})
        >>> with Session(description) as session:
        ...     frame = next(session)
        >>> frame.number, frame.begins, frame.gaze.shape
        (0, True, (2,))
    """

    def __init__(
        self,
        description: Description,
        *,
        body: Any = None,
        eye: Any = None,
        babbler: Any = None,
        learner: Any = None,
        interventions: Mapping[str, Iterable[Any]] | None = None,
    ) -> None:
        own = {"body": body, "eye": eye, "babbler": babbler, "learner": learner, "interventions": interventions}
        self.description = hand_over(description, **own)
        seed = self.description.seed
        with ExitStack() as undo:
            self.body: Body = built("body", Body, self.description.body, Context(self.description))
            undo.callback(self.body.close)
            self._reading = self.body.reset(seed)
            self._start = self._reading.arm
            self.eye: Eye = self._build("eye", Eye, self.description.eye, "eye")
            self.babbler: Babbler = self._build("babbling", Babbler, self.description.babbling, "babbling")
            with said_of("babbling"):
                require_sight(self._context("look"), self.eye)
            self.learner: Learner = self._build_learner("learner")
            self._phases = [self._build_phase(index) for index in range(len(self.description.phases))]
            self._probes = Probes(self.description.phases, self.body, self.eye, self.learner, self.interventions)
            self.columns = self._probes.columns
            self._try_drawing()
            undo.pop_all()
        self._sinks: list[Sink] = []
        self._drawn_for: list[Sink] = []
        self._drawn_late = 0.0
        self._held: int | None = None
        self._whole = True
        self._starts = np.cumsum([0, *(phase.frames for phase in self.description.phases)]).tolist()
        self.done = self.hits = 0
        self.seconds = dict.fromkeys(PARTS, 0.0)

    # -- one frame -----------------------------------------------------------------------------------------------------

    def __iter__(self) -> Iterator[Frame]:
        return self

    def __next__(self) -> Frame:
        """Run one frame of 1/15 s. All experiments have the same order of steps in a frame.

        Raises:
            StopIteration: all phases have ended.
            RuntimeError: an error has broken off the frame before.
        """
        if self.done == self._starts[-1]:
            raise StopIteration
        if not self._whole:
            raise RuntimeError(f"Frame {self.done} was broken off; restore() a state before going on.")
        self._whole = False
        index = self._enter() if self._held is None else self._held
        phase, reading = self._phases[index], self._reading
        began = perf_counter()
        sighting = self.eye.look(reading)  # 1 sense
        seen = perf_counter()
        target = self.babbler.command(reading.time)  # 2 babble
        babbled = perf_counter()
        percept = phase.sense(_percept(reading, sighting))  # 3 what interventions make of it
        sensed = perf_counter()
        self.learner.observe(percept)  # 4 to 7: normalise, maps learn, winners, links learn
        gaze = self.learner.gaze(percept)  # 8 gaze
        learned = perf_counter()
        probes, drawn = self._probes.of(self.learner, self.eye, phase.interventions), self._draw(reading)
        shown = perf_counter()
        try:
            self._reading = self.body.step(*phase.act(target, gaze))  # 9 the body advances, as interventions let it
        except ValueError as error:
            error.add_note(self._who_commands())
            raise
        stepped = perf_counter()
        seconds = {
            "physics": stepped - shown,
            "render": drawn,
            "detect": seen - began - (drawn - self._drawn_late),
            "babble": babbled - seen,
            "damage": sensed - babbled,
            "learn": learned - sensed,
        }
        first, last, clipped = self._starts[index], self._starts[index + 1] - 1, self._reading.head_command
        frame = Frame(  # in their order, which spares half of the time that names take
            self.done,
            index,
            self.done == first,
            self.done == last,
            reading,
            sighting,
            percept,
            target,
            gaze,
            clipped,
            probes,
            seconds,
        )
        self._count(frame)
        return frame

    def _who_commands(self) -> str:
        learner, babbling = self.description.learner.kind, self.description.babbling.kind
        return f"The learner {learner!r} gives the head's target, the babbling {babbling!r} gives the arm's."

    def _enter(self) -> int:
        """Begin the phase of the next frame; its index."""
        index = self.phase
        self._phases[index].begin()
        self._take_hold(index)
        return index

    def _draw(self, reading: Reading) -> float:
        """Draw the picture for sinks that need it, and tell how long drawing took, whoever asked for it."""
        picture, self._drawn_late = reading.image, 0.0
        if picture is None:
            return 0.0
        drawn = picture.seconds if isinstance(picture, Picture) else 0.0
        if self._drawn_for:
            start = perf_counter()
            picture()
            self._drawn_late = perf_counter() - start
        return drawn + self._drawn_late

    def _take_hold(self, index: int) -> None:
        if isinstance(self.body, SharesArm) and self._phases[index].move_arm:
            self.body.unshare_arm()
        self._phases[index].hold()
        self._held = index
        if isinstance(self.body, Resumable):
            self._reading = self.body.restore(self.body.state())  # sensed again: as it is now

    def _count(self, frame: Frame) -> None:
        """Count a frame, end its phase if it is the last one, and show it to the sinks."""
        self.done += 1
        self.hits += frame.sighting is not None
        for part, took in frame.seconds.items():
            self.seconds[part] += took
        if frame.ends:
            self._let_go()
        self._whole = True
        for sink in self._sinks:
            sink(frame)

    @property
    def phase(self) -> int:
        """Index of the phase to which the next frame belongs. After the last frame it is that of the last phase."""
        return self._phase_of(min(self.done, max(self._starts[-1] - 1, 0)))

    @property
    def reached(self) -> int:
        """Index of the phase to which the last frame belongs. Before the first frame it is that of the first phase."""
        return self._phase_of(max(self.done - 1, 0))

    def _phase_of(self, frame: int) -> int:
        return min(bisect_right(self._starts, frame), len(self._phases)) - 1

    @property
    def ends(self) -> list[int]:
        """For each phase, the number of the frame after its last one."""
        return list(self._starts[1:])

    # -- looking on, stopping, going on --------------------------------------------------------------------------------

    def attach(self, sink: Sink, pictures: bool = False) -> None:
        """Call a sink with every frame from now on. This happens after the body has moved, before the frame is yielded.

        Args:
            sink: function that is called with each frame. Its result is ignored.
            pictures: whether the sink needs the frame's picture, `frame.reading.image()`. It is then drawn before the
                body moves.
        """
        self._sinks.append(sink)
        if pictures:
            self._drawn_for.append(sink)

    def detach(self, sink: Sink) -> None:
        """Stop calling a sink."""
        self._sinks.remove(sink)
        if sink in self._drawn_for:
            self._drawn_for.remove(sink)

    @property
    def whole(self) -> bool:
        """Whether `state` can be called: between any two frames, unless an error has broken off a frame."""
        return self._whole

    @property
    def interventions(self) -> list[list[Intervention]]:
        """The interventions of each phase."""
        return [phase.interventions for phase in self._phases]

    @property
    def remarks(self) -> list[str]:
        """What interventions remark on, each once, in phases that last. A run prints it before its first frame."""
        phases = zip(self.description.phases, self.interventions, strict=True)
        said = (getattr(each, "remark", "") for phase, listed in phases if phase.frames for each in listed)
        return list(dict.fromkeys(filter(None, said)))

    @property
    def parts(self) -> list[object]:
        """Body, eye, babbler, learner and all interventions."""
        return [self.body, self.eye, self.babbler, self.learner, *chain.from_iterable(self.interventions)]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Undo the changes of interventions, and close the body. A second call does nothing."""
        try:
            self._let_go()
        finally:
            self.body.close()

    @contextmanager
    def holding(self, phase: int) -> Iterator[None]:
        """Put the interventions of a phase into force while the context lasts.

        Args:
            phase: index of the phase. If another phase has begun, its interventions are in force again afterwards.
        """
        before = self._held
        if phase == before:
            yield
            return
        self._let_go()
        self._take_hold(phase)
        try:
            yield
        finally:
            self._let_go()
            if before is not None:
                self._take_hold(before)

    def _let_go(self) -> None:
        """Undo what the interventions of a phase hold."""
        if self._held is not None:
            self._phases[self._held].release()
            self._held = None

    def sense(self, percept: Percept) -> Percept:
        """A percept after the interventions in force have changed it."""
        return percept if self._held is None else self._phases[self._held].sense(percept)

    def feel(self, arms: Floats) -> Floats:
        """Arm postures as the learner would feel them in the phase of the last frame, shape (k, n_arm), rad.

        Time and head posture are those of that frame. Nothing changes, and no random numbers are used up.

        Args:
            arms: the true arm postures, shape (k, n_arm), rad.
        """
        now, phase = self._reading, self._phases[self.reached]
        percepts = [Percept(now.time, arm, now.head, arm, now.head_command) for arm in arms]
        return np.array([percept.arm for percept in phase.feel(percepts)])

    @property
    def resumable(self) -> bool:
        """Whether `state` and `restore` are possible. This depends on the body."""
        return isinstance(self.body, Resumable)

    def state(self) -> dict[str, Any]:
        """Everything that is needed to continue bit for bit, as arrays and plain values.

        Raises:
            DescriptionError: the body cannot be resumed.
        """
        return {
            "body": self._resumable_body().state(),
            "babbler": self.babbler.state(),
            "learner": self.learner.state(),
            "interventions": {str(index): parts.state() for index, parts in enumerate(self._phases)},
            "done": self.done,
            "hits": self.hits,
            "seconds": dict(self.seconds),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Return to a `state()` of the same description, with its interventions in force.

        Raises:
            DescriptionError: the body cannot be resumed.
        """
        body = self._resumable_body()
        self._let_go()
        self._whole = False
        self.done, self.hits, self.seconds = int(state["done"]), int(state["hits"]), dict(state["seconds"])
        self._reading = body.restore(state["body"])
        self.babbler.restore(state["babbler"])
        self.learner.restore(state["learner"])
        for index, start in enumerate(self._starts[:-1]):
            if start < self.done:
                self._phases[index].restore(state["interventions"][str(index)])
            else:  # has not begun; in a fork it may be another phase than where the state comes from
                self._phases[index] = self._build_phase(index)
        if self._starts[self.phase] < self.done < self._starts[-1]:
            self._phases[self.phase].hold()
            self._held = self.phase
            self._reading = body.restore(state["body"])  # sensed again: as it is now
        self._whole = True

    def _resumable_body(self) -> Resumable:
        if not isinstance(self.body, Resumable):
            kind = self.description.body.kind
            raise DescriptionError(f"The body {kind!r} has no state() and restore(): its runs cannot be resumed.")
        return self.body

    # -- one arm movement for all runs of a seed -----------------------------------------------------------------------

    def share_arm(self, compute: bool = False) -> bool:
        """Take the arm's movement from the user's cache, if the movement of this seed is stored there.

        Babbling depends on nothing but the clock, so that runs with other learners have the same movement. No bit of
        any frame changes. The session stops using the stored movement when an intervention changes the body or the
        arm's target.

        Args:
            compute: whether to compute and store the movement if it is not in the cache.

        Returns:
            Whether a stored movement is used. It can be used if the arm moves by physics and independently of the head,
            and if no intervention has begun that can change the arm's movement.
        """
        body, babbling = self.body, self.description.babbling
        if not isinstance(body, SharesArm):
            return False
        ranges = {name: np.asarray(limits).tolist() for name, limits in getattr(body, "ranges", {}).items()}
        said = self.description.model_dump_json(include={"seed", "babbling"}), code_of([self.babbler]), ranges
        targets = self._arm_targets if compute else None
        began = [phase for phase, start in zip(self._phases, self._starts, strict=False) if start < self.done]
        if babbling.kind.startswith(HANDED_OVER) or any(phase.move_arm for phase in began):
            return False
        return body.share_arm(repr(said).encode(), self.description.frames, targets)

    def _arm_targets(self) -> Floats:
        """What the babbler will say in each frame, shape (frames, n_arm), rad."""
        babbler: Babbler = self._build("babbling", Babbler, self.description.babbling, "babbling")
        return np.array([babbler.command(frame * FRAME) for frame in range(self.description.frames)])

    # -- building ------------------------------------------------------------------------------------------------------

    def _context(self, name: str) -> Context:
        return Context(self.description, self.body, stream(self.description.seed, name), self._start)

    def _build(self, key: str, contract: type, settings: Settings, name: str) -> Any:
        return built(key, contract, settings, self._context(name))

    def _build_learner(self, name: str) -> Any:
        return self._build("learner", Learner, self.description.learner, name)

    def renew_learner(self, name: str) -> None:
        """Replace the learner by a fresh one that has learned nothing.

        Args:
            name: name of the random stream for the fresh learner.
        """
        self.learner = self._build_learner(name)

    def _try_drawing(self) -> None:
        """Draw a picture if frames will need them: a machine that cannot says so before anything runs."""
        if getattr(self.eye, "needs_pictures", False) and self._reading.image is not None:
            self._reading.image()

    def _build_phase(self, index: int) -> PhaseInterventions:
        phase, places = self.description.phases[index], []
        for number, settings in enumerate(phase.interventions):
            name = f"phase {index} intervention {number}"
            key = f"phases.{index} ({phase.name!r})"
            intervention = self._build(key, Intervention, settings, name)
            place = Place(self, intervention, stream(self.description.seed, name), f"learner of phase {index}")
            with said_of(f"{key}, {settings.kind}"):
                intervention.check(place)
            places.append(place)
        return PhaseInterventions(places)


def _percept(reading: Reading, sighting: Sighting | None) -> Percept:
    """What the learner is told, in arrays of its own: one that works in place must not change what is recorded."""
    return Percept(
        reading.time,
        reading.arm.copy(),
        reading.head.copy(),
        reading.arm_command.copy(),
        reading.head_command.copy(),
        sighting,
        reading.dt,
    )
