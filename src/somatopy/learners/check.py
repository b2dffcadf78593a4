"""The laws of learners, tried on any implementation."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, replace
from numbers import Integral, Real

import numpy as np

from somatopy.contract import check_state, law, missing, refused, same, size
from somatopy.learners.base import Learner
from somatopy.percept import Floats, Percept, Sighting

__all__ = ["check_learner"]

Make = Callable[[Floats, Floats, tuple[int, int], np.random.Generator], Learner]

#: Limits that are neither symmetric nor alike, some without 0; the first n of them are a robot's.
_ARM = np.array([[-2.0, 2.0], [-0.3, 1.3], [0.2, 1.9], [-1.5, -0.1], [-1.0, 1.0], [0.0, 3.0], [-0.5, 0.5]])
_HEAD = np.array([[-2.0, 2.0], [-0.6, 0.5], [0.1, 0.9]])
_JOINTS = ((4, 2), (2, 1), (7, 3))
_IMAGE = (320, 240)
_FRAMES = 80


@dataclass(frozen=True)
class _Robot:
    """Makes learners for one number of joints, and percepts for them."""

    make: Make
    arm: Floats
    head: Floats

    def learner(self, seed: int = 1) -> Learner:
        return self.make(self.arm.copy(), self.head.copy(), _IMAGE, np.random.default_rng(seed))

    def percepts(self, frames: int = _FRAMES, hits: float = 0.5, beyond: float = 0.0) -> list[Percept]:
        """Babbling with the hand seen in that share of the frames, up to `beyond` times the range outside limits."""
        rng, arm, head = np.random.default_rng(0), _widened(self.arm, beyond), _widened(self.head, beyond)
        found = []
        for k in range(frames):
            sighting = (
                Sighting((rng.uniform(-20, 340), rng.uniform(-20, 260)), 1, 400.0) if rng.random() < hits else None
            )
            vectors = [rng.uniform(limits[:, 0], limits[:, 1]) for limits in (arm, head, arm, head)]
            found.append(Percept(k / 15, *vectors, sighting=sighting, dt=1 / 15))
        return found

    def live(self, learner: Learner, percepts: list[Percept]) -> list[Floats]:
        """Frames pass; what the learner commands in each."""
        gazes = []
        for percept in percepts:
            learner.observe(percept)
            gazes.append(np.array(learner.gaze(percept)))
        return gazes

    def play(self, learner: Learner, first: int, last: int) -> object:
        """All that a learner shows of some frames."""
        gazes = self.live(learner, self.percepts()[first:last])
        return gazes, self.predictions(learner), learner.probes(), learner.maps()

    def predictions(self, learner: Learner) -> list[Floats]:
        """Predictions all over the range of the arm, without a trace if `predict` is pure."""
        return [np.array(learner.predict(percept.arm)) for percept in self.percepts(25)]


def check_learner(make: Make, *, body_clips: bool = False, growth: int | None = 0) -> None:
    """Check that a learner keeps its contract, on robots with several numbers of joints.

    Args:
        make: a fresh learner from the limits of arm and head joints, (n, 2) rad, the image's width and height (px) and
            a generator for all its random numbers. A class with these four arguments will do.
        body_clips: whether it may ask for head postures outside the limits, as all bodies clip them.
        growth: bytes that its state may grow by between the frames 40 and 240; None for any number.

    Raises:
        ContractError: it breaks a law; the message says which, what was seen and how to fix it.

    Example:
        >>> from somatopy.learners import HebbianLearner
        >>> check_learner(HebbianLearner)
    """
    for n_arm, n_head in _JOINTS:
        robot = _Robot(make, _ARM[:n_arm], _HEAD[:n_head])
        _is_a_learner(robot)
        for hits in (0.0, 0.5, 1.0):
            _gazes_at_head_postures(robot, hits, body_clips)
        _predicts_purely(robot)
        _owns_what_it_keeps(robot)
        _draws_from_its_generator(robot)
        _shows_the_same_probes(robot)
        _keeps_its_maps_apart(robot)
        _learns_where_plastic(robot)
        check_state(robot.learner, robot.play)
        if growth is not None:
            _stays_small(robot, growth)


def _widened(limits: Floats, share: float) -> Floats:
    margin = share * (limits[:, 1:] - limits[:, :1])
    return np.hstack([limits[:, :1] - margin, limits[:, 1:] + margin])


def _is_a_learner(robot: _Robot) -> None:
    joints = f"{len(robot.arm)} arm and {len(robot.head)} head joints"
    with law(
        f"a learner can be made for {joints} and has all members of Learner", "see somatopy.learners.Learner"
    ) as holds:
        learner = robot.learner()
        lacks = missing(learner, Learner)
        holds(not lacks, "{} lacks {}", type(learner).__name__, ", ".join(lacks))
        holds(isinstance(learner.plastic, frozenset), "plastic is a {}, no frozenset", type(learner.plastic).__name__)


def _gazes_at_head_postures(robot: _Robot, hits: float, body_clips: bool) -> None:
    n, low, high = len(robot.head), robot.head[:, 0] - 1e-9, robot.head[:, 1] + 1e-9
    seen = {0.0: "never", 0.5: "now and then", 1.0: "always"}[hits]
    for beyond, where in ((0.0, "inside"), (1.0, "outside")):
        learner = robot.learner()
        with law(
            f"gaze and predict give finite head postures ({n},) with the hand {seen} seen and postures {where} the limits",
            "take None for a miss, normalise by the limits, and assume neither hits nor postures inside them",
        ) as holds:
            answers = [np.asarray(learner.predict(robot.arm.mean(axis=1)))]
            answers += [*robot.live(learner, robot.percepts(hits=hits, beyond=beyond)), *robot.predictions(learner)]
            for k, answer in enumerate(answers):
                holds(answer.shape == (n,) and answer.dtype.kind == "f", "{} as answer {}", answer, k)
                holds(np.isfinite(answer).all(), "{} as answer {}", answer, k)
        if beyond or body_clips:
            continue
        with law(
            "gaze and predict stay inside the head's limits while all percepts are inside theirs",
            "clip to head_limits, or say check_learner(..., body_clips=True)",
        ) as holds:
            for k, answer in enumerate(answers):
                holds((low <= answer).all() and (answer <= high).all(), "{} as answer {}", answer, k)


def _predicts_purely(robot: _Robot) -> None:
    asked, silent, percepts = robot.learner(), robot.learner(), robot.percepts()
    with law(
        "predict is pure: it draws nothing and changes nothing",
        "choose among equals by a fixed rule in predict, and write no attribute there",
    ) as holds:
        gazes = []
        for percept in percepts:
            gazes += robot.live(asked, [percept])
            first, second = asked.predict(percept.arm), asked.predict(percept.arm.tolist())
            holds(same(first, second), "{} and then {} for the arm posture {}", first, second, percept.arm)
        state = deepcopy(asked.state())
        robot.predictions(asked)
        holds(same(asked.state(), state), "state() is another after predict")
        holds(same(robot.live(silent, percepts), gazes), "gazes are others than those of a twin that never predicted")


def _owns_what_it_keeps(robot: _Robot) -> None:
    tampered, left, percepts = robot.learner(), robot.learner(), robot.percepts()
    with law("observe and gaze leave the percept alone", "work on copies of its arrays") as holds:
        for percept in percepts:
            given = _copied(percept)
            answers = tampered.observe(given), tampered.gaze(given), tampered.predict(given.arm)
            for name in ("arm", "head", "arm_command", "head_command"):
                before, after = getattr(percept, name), getattr(given, name)
                holds(same(before, after), "{} was {} and became {}", name, before, after)
                after[:] = np.nan
            for answer in answers[1:]:
                if np.asarray(answer).flags.writeable:
                    np.asarray(answer)[:] = np.nan
            robot.live(left, [percept])
    with law(
        "a learner keeps no array of a percept and gives none of its own away",
        "copy what you keep, and return copies from gaze and predict",
    ) as holds:
        holds(same(robot.predictions(tampered), robot.predictions(left)), "predictions changed when such arrays did")
        holds(same(robot.live(tampered, percepts), robot.live(left, percepts)), "gazes changed when such arrays did")


def _copied(percept: Percept) -> Percept:
    return replace(
        percept,
        arm=percept.arm.copy(),
        head=percept.head.copy(),
        arm_command=percept.arm_command.copy(),
        head_command=percept.head_command.copy(),
    )


def _draws_from_its_generator(robot: _Robot) -> None:
    with law(
        "one seed, one stream of gazes", "draw from the generator that is given, never from numpy.random or random"
    ) as holds:
        a, b = (robot.live(robot.learner(seed=3), robot.percepts()) for _ in range(2))
        different = [k for k in range(len(a)) if not same(a[k], b[k])]
        holds(not different, "two learners of one seed differ from frame {} on", different and different[0])


def _shows_the_same_probes(robot: _Robot) -> None:
    learner = robot.learner()
    with law(
        "probes have the same names and the same types, whole or float, before and after every frame",
        "set them all in __init__, with NaN or -1 where there is nothing yet",
    ) as holds:
        expected = {name: _kind(value) for name, value in learner.probes().items()}
        for percept in robot.percepts():
            robot.live(learner, [percept])
            found = {name: _kind(value) for name, value in learner.probes().items()}
            holds(found == expected, "{} at first, then {}", expected, found)


def _kind(value: object) -> str:
    if not isinstance(value, Real):
        raise TypeError(f"the probe {value!r} is no number")
    return "whole" if isinstance(value, Integral) else "float"


def _keeps_its_maps_apart(robot: _Robot) -> None:
    learner = robot.learner()
    with law("maps() are arrays that later learning leaves alone", "return copies of arrays by name, or {}") as holds:
        robot.live(learner, robot.percepts())
        maps = learner.maps()
        odd = [name for name, value in maps.items() if np.asarray(value).dtype.hasobject]
        holds(not odd, "{} cannot be saved as arrays", odd)
        before = deepcopy(maps)
        robot.live(learner, robot.percepts())
        holds(same(maps, before), "they changed")


def _learns_where_plastic(robot: _Robot) -> None:
    learner = robot.learner()
    parts = learner.plastic
    with law("each part may learn alone; plastic can be set at any time", "read plastic anew in each frame"):
        for part in sorted(parts):
            learner.plastic = frozenset({part})
            robot.live(learner, robot.percepts(20))
    with law(
        "with plastic empty nothing is learned", "ask plastic before anything that predict shows is changed"
    ) as holds:
        learner.plastic = frozenset()
        before = robot.predictions(learner)
        robot.live(learner, robot.percepts(beyond=0.5))
        holds(same(robot.predictions(learner), before), "predictions changed")
    with law("an unknown part is refused", "raise a ValueError that lists the parts") as holds:
        refusal = refused(lambda: setattr(learner, "plastic", frozenset({"no such part"})))
        holds(refusal or not parts, "plastic took 'no such part' beside {}", sorted(parts))


def _stays_small(robot: _Robot, growth: int) -> None:
    learner, percepts = robot.learner(), robot.percepts(240, hits=1.0)
    with law(
        f"its memory is bounded: the state grows by at most {growth} bytes from frame 40 to 240",
        "forget, or state the bound: check_learner(..., growth=bytes, or None for none)",
    ) as holds:
        robot.live(learner, percepts[:40])
        before = size(learner.state())
        robot.live(learner, percepts[40:])
        grown = size(learner.state()) - before
        holds(grown <= growth, "{} bytes more", grown)
