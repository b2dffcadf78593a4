"""A check that any intervention keeps its contract."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from somatopy.clock import FRAME
from somatopy.contract import (
    Body,
    Intervention,
    Learner,
    Resumable,
    check_members,
    check_state,
    facts,
    law,
    same,
)
from somatopy.percept import Camera, Column, Floats, JointGroup, Marker, Percept, Reading, Sighting, View

__all__ = ["check_intervention"]

Make = Callable[[], Intervention]
_VECTORS = ("arm", "head", "arm_command", "head_command")


def check_intervention(make: Make, make_body: Callable[[], Body] | None = None) -> None:
    """Check that an intervention keeps its contract.

    Args:
        make: makes a fresh intervention.
        make_body: makes a fresh body that suits it. By default this is a simple body with four arm joints and two head
            joints, whose joints are always where they are told to be.

    Raises:
        ContractError: it breaks a law; the message says which, what was seen and how to fix it.

    Example:
        >>> from somatopy.interventions import JointOffset
        >>> check_intervention(lambda: JointOffset([0.1, 0.2, 0.0, -0.1]))
    """
    body = (make_body or _Puppet)()
    try:
        _describes_itself(make())
        frames = _frames(body)
        _senses_soundly(make, frames)
        _acts_soundly(make, frames)
        _draws_from_the_generator(make, frames)
        check_state(lambda seed: _Lived(make(), np.random.default_rng(seed), frames), _Lived.play)
        _undoes_what_it_holds(make(), body)
    finally:
        body.close()


@dataclass(frozen=True)
class _Frame:
    percept: Percept
    target: Floats
    gaze: Floats


@dataclass
class _Stage:
    """What an intervention may touch, for the check."""

    body: Body
    learner: Learner
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(3))

    def renew_learner(self) -> None:
        self.learner = _Pupil()


def _describes_itself(intervention: Intervention) -> None:
    check_members(intervention, Intervention)
    with law("alters_ceiling and moves_arm are True or False", "say what the intervention can change") as holds:
        for name in ("alters_ceiling", "moves_arm"):
            holds(isinstance(getattr(intervention, name), bool), "{} = {!r}", name, getattr(intervention, name))
    with law("probes() has the names of its columns, before the first frame too", "set them in __init__") as holds:
        names = [column.name for column in intervention.columns]
        holds(len(set(names)) == len(names), "the columns {}", names)
        holds(set(intervention.probes()) == set(names), "{} for the columns {}", intervention.probes(), names)


def _frames(body: Body) -> list[_Frame]:
    rng, found = np.random.default_rng(0), []
    for k in range(80):
        arm, head, target, gaze = (rng.uniform(g.lower, g.upper) for g in 2 * (body.arm, body.head))
        sighting = Sighting((99.0, 77.0), 1, 400.0) if k % 2 else None
        found.append(_Frame(Percept(k * FRAME, arm, head, target, gaze, sighting, FRAME), target, gaze))
    return found


@dataclass
class _Lived:
    """An intervention with its generator, as a session keeps both."""

    intervention: Intervention
    rng: np.random.Generator
    frames: list[_Frame]

    def play(self, first: int, last: int) -> object:
        """All that it makes of some frames."""
        return [
            (
                facts(self.intervention.sense(frame.percept, self.rng)),
                list(self.intervention.act(frame.target.copy(), frame.gaze.copy(), self.rng)),
                dict(self.intervention.probes()),
            )
            for frame in self.frames[first:last]
        ]

    def state(self) -> dict[str, Any]:
        return {"own": self.intervention.state(), "rng": self.rng.bit_generator.state}

    def restore(self, state: dict[str, Any]) -> None:
        self.intervention.restore(state["own"])
        self.rng.bit_generator.state = state["rng"]


def _senses_soundly(make: Make, frames: list[_Frame]) -> None:
    intervention, rng = make(), np.random.default_rng(1)
    before = [facts(frame.percept) for frame in frames]
    with law("sense leaves its percept alone", "make a new one: dataclasses.replace(percept, arm=...)") as holds:
        sensed = [intervention.sense(frame.percept, rng) for frame in frames]
        for old, frame in zip(before, frames, strict=True):
            holds(same(old, facts(frame.percept)), "{} became {}", old, frame.percept)
    with law("sense gives a percept of the same shapes, finite", "give arrays, and change their values only") as holds:
        for frame, after in zip(frames, sensed, strict=True):
            holds(isinstance(after, Percept), "{}", after)
            for name in _VECTORS:
                vector = getattr(after, name)
                fits = isinstance(vector, np.ndarray) and vector.shape == getattr(frame.percept, name).shape
                holds(fits and np.isfinite(vector).all(), "{} = {!r}", name, vector)


def _acts_soundly(make: Make, frames: list[_Frame]) -> None:
    intervention, rng = make(), np.random.default_rng(1)
    for frame in frames:
        with law("act leaves its arguments alone", "make new arrays: gaze = gaze + ...") as holds:
            target, gaze = frame.target.copy(), frame.gaze.copy()
            acted = intervention.act(target, gaze, rng)
            holds(same([target, gaze], [frame.target, frame.gaze]), "{} became {}", frame, (target, gaze))
        with law("act gives a target and a gaze of the same shapes, finite", "change values only") as holds:
            for old, new in zip((frame.target, frame.gaze), acted, strict=True):
                holds(np.shape(new) == old.shape and np.isfinite(new).all(), "{} for {}", new, old)
        with law("moves_arm is True where act changes the arm's target", "set it to True") as holds:
            untouched = np.array_equal(acted[0], frame.target)
            holds(intervention.moves_arm or untouched, "{} for {}", acted[0], frame.target)


def _draws_from_the_generator(make: Make, frames: list[_Frame]) -> None:
    with law("sense and act draw from the generator that they are given", "use rng and no other source") as holds:
        one, other = (_Lived(make(), np.random.default_rng(2), frames) for _ in range(2))
        for k in range(len(frames)):
            a, b = one.play(k, k + 1), other.play(k, k + 1)
            holds(same(a, b), "two equal generators gave {} and {} in frame {}", a, b, k)


def _undoes_what_it_holds(intervention: Intervention, body: Body) -> None:
    if not isinstance(body, Resumable):
        return
    stage = _Stage(body, _Pupil())
    body.reset(0)
    body.step(body.arm.lower, body.head.upper)
    state, plastic = deepcopy(body.state()), stage.learner.plastic
    intact, anew = _seen_from(body, state), _seen_anew(body)
    with law("alters_ceiling is True where holding changes what the camera can see", "set it to True") as holds:
        intervention.hold(stage)
        held = _seen_from(body, state)
        seen = all(same(a["view"], b["view"]) for a, b in zip(intact, held, strict=True) if _at_one_place(a, b))
        holds(intervention.alters_ceiling or seen, "the body has other poses in the same postures")
    with law("moves_arm is True where holding changes how the arm moves", "set it to True") as holds:
        arms = [[moment["arm"] for moment in moments] for moments in (intact, held)]
        holds(intervention.moves_arm or same(*arms), "the arm moves otherwise on the same commands")
    with law("release undoes all that hold did", "keep what hold replaces, and put it back") as holds:
        intervention.release(stage)
        holds(same(_seen_from(body, state), intact), "other readings from the same state on the same commands")
        holds(same(_seen_anew(body), anew), "other readings after a reset")
        holds(stage.learner.plastic == plastic, "{} learn, {} before", stage.learner.plastic, plastic)
    with law("hold can come again after release, as in a run that is resumed", "do all of it in hold") as holds:
        intervention.hold(stage)
        holds(same(_seen_from(body, state), held), "the second time the body behaves otherwise")
        intervention.release(stage)


def _at_one_place(a: dict[str, Any], b: dict[str, Any]) -> bool:
    """Whether arm and head are in the same postures at two moments."""
    return same([a["arm"], a["head"]], [b["arm"], b["head"]])


def _seen_from(body: Any, state: dict[str, Any]) -> list[dict[str, Any]]:
    """What a body senses in a state, and in 20 frames on the way from there to a third of its ranges.

    The middle of a range may be 0, where an arm that goes half of each way shows nothing.
    """
    arm, head = ((2 * group.lower + group.upper) / 3 for group in (body.arm, body.head))
    return [facts(body.restore(deepcopy(state))), *(facts(body.step(arm, head)) for _ in range(20))]


def _seen_anew(body: Body) -> list[dict[str, Any]]:
    """What a body senses at its start, and in the first frame."""
    return [facts(body.reset(0)), facts(body.step(body.arm.lower, body.head.upper))]


class _Puppet:
    """A body without physics or model: the joints are where they are told to be."""

    def __init__(self) -> None:
        arm, head = np.ones(4), np.ones(2)
        self.arm = JointGroup(("a", "b", "c", "d"), -arm, arm, 8 * arm)
        self.head = JointGroup(("pan", "tilt"), -head, head, 8 * head)
        self.camera, self.marker = Camera("eye", 320, 240, fovy=0.83), Marker()
        self._time, self._posture = 0.0, np.zeros(6)

    def reset(self, seed: int | None = None) -> Reading:
        self._time, self._posture = 0.0, np.zeros(6)
        return self._sense(0.0)

    def step(self, arm: ArrayLike, head: ArrayLike) -> Reading:
        self._time += FRAME
        self._posture = np.clip(np.concatenate([arm, head]), -1, 1)
        return self._sense(FRAME)

    def _sense(self, dt: float) -> Reading:
        arm, head = self._posture[:4], self._posture[4:]
        pose = np.concatenate([self._posture[:3], np.eye(3).ravel()])
        view = View(camera=pose, marker=pose + 0.1, occluders=np.empty((0, 12)))
        return Reading(self._time, arm.copy(), head.copy(), arm.copy(), head.copy(), dt, view=view)

    def state(self) -> dict[str, Any]:
        return {"time": self._time, "posture": self._posture.copy()}

    def restore(self, state: dict[str, Any]) -> Reading:
        self._time, self._posture = float(state["time"]), np.array(state["posture"])
        return self._sense(FRAME)

    def close(self) -> None:
        """Has nothing to release."""


class _Pupil:
    """A learner that has parts and links in name only."""

    parts: frozenset[str] = frozenset({"arm_map", "head_map", "links"})
    columns: Sequence[Column] = ()

    def __init__(self) -> None:
        self.plastic = self.parts

    def observe(self, percept: Percept) -> None:
        """Learns nothing."""

    def gaze(self, percept: Percept) -> Floats:
        return percept.head

    def predict(self, arm: ArrayLike) -> Floats:
        return np.zeros(2)

    def probes(self) -> dict[str, float]:
        return {}

    def maps(self) -> dict[str, Any]:
        return {}

    def shuffle(self, rng: np.random.Generator) -> None:
        """Has nothing to shuffle."""

    def state(self) -> dict[str, Any]:
        return {}

    def restore(self, state: dict[str, Any]) -> None:
        """Has nothing to restore."""
