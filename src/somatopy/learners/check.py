"""The laws of learners, tried on any implementation."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, replace
from numbers import Integral, Real

import numpy as np

from somatopy.clock import FRAME
from somatopy.contract import (
    Believing,
    Learner,
    check_members,
    check_seed,
    check_state,
    facts,
    law,
    refused,
    same,
    size,
)
from somatopy.percept import Camera, Floats, Percept, Robot, Sighting, Space

__all__ = ["check_learner"]

Make = Callable[[Robot, np.random.Generator], Learner]

#: Limits that are neither symmetric nor alike, some without 0; the first n of them are a robot's.
_ARM = np.array([[-2.0, 2.0], [-0.3, 1.3], [0.2, 1.9], [-1.5, -0.1], [-1.0, 1.0], [0.0, 3.0], [-0.5, 0.5]])
_HEAD = np.array([[-2.0, 2.0], [-0.6, 0.5], [0.1, 0.9]])
_JOINTS = ((4, 2), (2, 1), (7, 3))
_CAMERA = Camera("eye", 320, 240, fovy=0.83)
_VECTORS = ("arm", "head", "arm_command", "head_command")


def check_learner(make: Make, *, body_clips: bool = False, growth: int | None = 0) -> None:
    """Check that a learner keeps its contract, on robots with several numbers of joints.

    Args:
        make: a fresh learner from a robot and a generator for all its random numbers. A class with these two
            arguments will do.
        body_clips: whether it may ask for head postures outside the limits, as all bodies clip them.
        growth: bytes that its state may grow by between the frames 40 and 240; None for any number.

    Raises:
        ContractError: it breaks a law; the message says which, what was seen and how to fix it.

    Example:
        >>> from somatopy.learners import HebbianLearner
        >>> check_learner(HebbianLearner, growth=200 * 16)  # a link takes 16 bytes, and each frame may bring a new one
    """
    for n_arm, n_head in _JOINTS:
        robot = _Trial(make, _ARM[:n_arm], _HEAD[:n_head])
        with law(f"it can be made for {n_arm} arm and {n_head} head joints", "take all sizes from the robot's senses"):
            learner = robot.learner()
        check_members(learner, Learner)
        _gazes_at_head_postures(robot, body_clips)
        check_seed(robot.learner, robot.gazes)
        _predicts_purely(robot)
        if isinstance(learner, Believing):
            _believes_purely(robot)
        _owns_what_it_keeps(robot)
        _shows_itself_evenly(robot)
        _learns_where_plastic(robot)
        check_state(robot.learner, robot.play)
        if growth is not None:
            _stays_small(robot, growth)


@dataclass(frozen=True)
class _Trial:
    """Makes learners for one number of joints, and percepts for them."""

    make: Make
    arm: Floats
    head: Floats

    def learner(self, seed: int = 1) -> Learner:
        arm, head = (
            Space([f"{part}{k}" for k in range(len(limits))], *limits.T)
            for part, limits in (("arm", self.arm), ("head", self.head))
        )
        return self.make(Robot({"arm": arm, "head": head}, ("head",), _CAMERA), np.random.default_rng(seed))

    def percepts(self, frames: int = 80, hits: float = 0.5, beyond: float = 0.0) -> list[Percept]:
        """Random postures up to `beyond` times the range outside limits, the hand seen in that share of them."""
        rng, found = np.random.default_rng(0), []
        for k in range(frames):
            seen = Sighting((rng.uniform(-20, 340), rng.uniform(-20, 260)), 1, 400.0) if rng.random() < hits else None
            units = (rng.uniform(-beyond, 1 + beyond, len(limits)) for limits in 2 * (self.arm, self.head))
            arm, head, arm_command, head_command = (
                limits[:, 0] + unit * (limits[:, 1] - limits[:, 0])
                for limits, unit in zip(2 * (self.arm, self.head), units, strict=True)
            )
            found.append(Percept(k * FRAME, arm, head, arm_command, head_command, seen, FRAME))
        return found

    def live(self, learner: Learner, percepts: list[Percept]) -> list[Floats]:
        """Frames pass; what the learner commands in each."""
        gazes = []
        for percept in percepts:
            learner.observe(percept)
            gazes.append(np.array(learner.gaze(percept)))
        return gazes

    def predictions(self, learner: Learner) -> list[Floats]:
        """Predictions all over the arm's range."""
        return [np.array(learner.predict(percept.arm)) for percept in self.percepts(25)]

    def gazes(self, learner: Learner, first: int, last: int) -> object:
        """What a learner commands in some frames."""
        return self.live(learner, self.percepts()[first:last])

    def play(self, learner: Learner, first: int, last: int) -> object:
        """All that a learner shows of some frames."""
        gazes = self.gazes(learner, first, last)
        return gazes, self.predictions(learner), learner.probes(), learner.maps()


def _gazes_at_head_postures(robot: _Trial, body_clips: bool) -> None:
    for seen, hits in {"never": 0.0, "now and then": 0.5, "always": 1.0}.items():
        answers = _answers(robot, hits, 0.0, f"with the hand {seen} seen")
        _answers(robot, hits, 1.0, f"with the hand {seen} seen and postures outside the limits")
        with law(
            "gaze and predict stay inside the head's limits while all percepts are inside theirs",
            "clip to the head's limits, or say check_learner(..., body_clips=True)",
        ) as holds:
            for answer in answers:
                inside = (robot.head[:, 0] - 1e-9 <= answer) & (answer <= robot.head[:, 1] + 1e-9)
                holds(body_clips or inside.all(), "{} with the limits {}", answer, robot.head.tolist())


def _answers(robot: _Trial, hits: float, beyond: float, when: str) -> list[Floats]:
    """All gazes and predictions of a learner's life, from before its first frame."""
    with law(
        f"gaze and predict give finite head postures ({len(robot.head)},) {when}",
        "take None for a miss and the sizes from the limits; divide by nothing that can be 0",
    ) as holds:
        learner = robot.learner()
        answers = [*robot.predictions(learner), *robot.live(learner, robot.percepts(hits=hits, beyond=beyond))]
        answers += robot.predictions(learner)
        for answer in answers:
            shaped = answer.shape == (len(robot.head),) and answer.dtype.kind == "f"
            holds(shaped and np.isfinite(answer).all(), "{!r}", answer)
    return answers


def _predicts_purely(robot: _Trial) -> None:
    asked, silent, percepts, gazes = robot.learner(), robot.learner(), robot.percepts(), []
    with law("predict is pure: it draws nothing and changes nothing", "choose among equals by a fixed rule") as holds:
        for percept in percepts:
            gazes += robot.live(asked, [percept])
            first, second = asked.predict(percept.arm), asked.predict(percept.arm.tolist())
            holds(same(first, second), "{} and then {} for the arm posture {}", first, second, percept.arm)
        state = deepcopy(asked.state())
        robot.predictions(asked)
        holds(same(asked.state(), state), "state() is another after predict")
        holds(same(robot.live(silent, percepts), gazes), "gazes are others than those of a twin that never predicted")


def _believes_purely(robot: _Trial) -> None:
    asked, silent, percepts, gazes = robot.learner(), robot.learner(), robot.percepts(), []
    arms, looks = np.array([p.arm for p in percepts[:5]]), np.array([p.head for p in percepts])
    with law(
        f"belief gives an array ({len(arms)}, {len(looks)}) of values from 0 to 1 for as many arm postures and gazes",
        "divide by the largest value, or take a probability; give 0 where nothing is known",
    ) as holds:
        for start in range(-10, len(percepts), 10):
            gazes += robot.live(asked, percepts[start : start + 10] if start >= 0 else [])
            values = _belief(asked, arms, looks)
            shaped = values.shape == (len(arms), len(looks)) and values.dtype.kind == "f"
            right, least, most = (shaped and ((values >= 0) & (values <= 1)).all()), values.min(), values.max()
            holds(right, "shape {} of {}, from {} to {}", values.shape, values.dtype, least, most)
    with law("belief is pure: it draws nothing and changes nothing", "work on copies, as predict does") as holds:
        state, given = deepcopy(asked.state()), (arms.copy(), looks.copy())
        first, answer = _belief(asked, arms, looks).copy(), _belief(asked, arms, looks)
        if answer.flags.writeable:
            answer[:] = 2.0
        holds(same((arms, looks), given), "the postures that it was given became others")
        for arm, together in zip(arms, first, strict=True):
            alone = _belief(asked, [arm.tolist()], looks.tolist())[0]
            seen = together[0], alone[0], arm
            holds(same(alone, together), "{} at first, then {} alone and from lists, for the arm posture {}", *seen)
        holds(same(asked.state(), state), "state() is another after belief")
        holds(same(robot.live(silent, percepts), gazes), "gazes are others than those of a twin that was never asked")


def _belief(learner: object, arms: object, gazes: object) -> Floats:
    return np.asarray(learner.belief(arms, gazes))  # type: ignore[attr-defined]


def _owns_what_it_keeps(robot: _Trial) -> None:
    tampered, left, percepts = robot.learner(), robot.learner(), robot.percepts()
    with law("observe and gaze leave the percept alone", "work on copies of its arrays") as holds:
        for percept in percepts:
            given = replace(percept, **{name: getattr(percept, name).copy() for name in _VECTORS})
            tampered.observe(given)
            arrays = [np.asarray(tampered.gaze(given)), np.asarray(tampered.predict(given.arm))]
            holds(same(facts(given), facts(percept)), "{} became {}", percept, given)
            for array in (*arrays, *(getattr(given, name) for name in _VECTORS)):
                if array.flags.writeable:
                    array[:] = np.nan
            robot.live(left, [percept])
    with law("arrays taken and given stay the caller's", "copy them in observe, and return copies") as holds:
        for show in (robot.predictions, lambda learner: robot.live(learner, percepts)):
            holds(same(show(tampered), show(left)), "overwriting percepts or answers changed what came later")
        lent = [left.gaze(percepts[-1]), left.predict(percepts[-1].arm)]
        before = deepcopy(lent)
        robot.play(left, 0, len(percepts))
        holds(same(lent, before), "{} became {} when later frames passed", before, lent)


def _shows_itself_evenly(robot: _Trial) -> None:
    learner = robot.learner()
    with law(
        "probes have the names and types of columns, int or float, in every frame and before the first",
        "declare columns = (Column(name, type, meaning), ...); set all in __init__, with -1 or NaN if there is nothing",
    ) as holds:
        expected = {column.name: column.type for column in learner.columns}
        holds(len(expected) == len(learner.columns), "one name for two columns: {}", [c.name for c in learner.columns])
        found = {name: _kind(value) for name, value in learner.probes().items()}
        holds(found == expected, "{} for the columns {}", found, expected)
        for percept in robot.percepts():
            robot.live(learner, [percept])
            found = {name: _kind(value) for name, value in learner.probes().items()}
            holds(found == expected, "{} at first, then {}", expected, found)
    with law("maps() are arrays that later frames leave alone", "return copies of arrays by name, or {}") as holds:
        maps = learner.maps()
        holds(all(isinstance(a, np.ndarray) and not a.dtype.hasobject for a in maps.values()), "{}", maps)
        before = deepcopy(maps)
        robot.live(learner, robot.percepts())
        holds(same(maps, before), "they changed")


def _kind(value: object) -> str:
    if not isinstance(value, Real):
        raise TypeError(f"the probe {value!r} is no number")
    return "bool" if isinstance(value, bool | np.bool_) else "int" if isinstance(value, Integral) else "float"


def _learns_where_plastic(robot: _Trial) -> None:
    learner = robot.learner()
    parts = learner.parts
    with law("parts is a frozenset of names, and all of them are plastic at first", "see Plastic") as holds:
        holds(isinstance(parts, frozenset) and all(isinstance(part, str) for part in parts), "{!r}", parts)
        holds(learner.plastic == parts, "{} are plastic, of {}", learner.plastic, parts)
    with law("each part may learn alone", "read plastic anew in each frame"):
        for part in sorted(parts):
            learner.plastic = frozenset({part})
            robot.live(learner, robot.percepts(20))
    with law("with plastic empty nothing is learned", "ask plastic before you change what predict shows") as holds:
        learner.plastic = frozenset()
        before = robot.predictions(learner)
        robot.live(learner, robot.percepts(beyond=0.5))
        holds(same(robot.predictions(learner), before), "predictions changed")
    with law("an unknown part is refused where there are parts", "raise a ValueError that lists them") as holds:
        refusal = refused(lambda: setattr(learner, "plastic", frozenset({"no such part"})))
        holds(refusal or not parts, "plastic took 'no such part' beside {}", sorted(parts))


def _stays_small(robot: _Trial, growth: int) -> None:
    learner, percepts = robot.learner(), robot.percepts(240, hits=1.0)
    with law(
        f"memory is bounded: the state grows by at most {growth} bytes from frame 40 to 240",
        "forget, or state the bound: check_learner(..., growth=bytes), None for no bound",
    ) as holds:
        robot.live(learner, percepts[:40])
        before = size(learner.state())
        robot.live(learner, percepts[40:])
        grown = size(learner.state()) - before
        holds(grown <= growth, "{} bytes more", grown)
