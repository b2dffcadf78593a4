"""From description to parts: named random streams, and everything wrong found before a run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from somatopy.bodies import BodyError, MujocoBody
from somatopy.experiment import Description, DescriptionError
from somatopy.experiment.build import build_babbler, build_body, build_damage, build_learner, limits, stream
from somatopy.experiment.damage import JointOffset, NoDamage
from somatopy.experiment.description import OffsetDamage, Phase
from somatopy.learners import FixedGaze, HebbianLearner, RandomGaze

Short = Callable[..., Description]


@pytest.fixture(scope="module")
def body() -> MujocoBody:
    return MujocoBody("nao", motion="kinematic")


def commands(description: Description, body: MujocoBody, frames: int = 500) -> np.ndarray:
    babbler = build_babbler(description, body, body.reset().arm)
    return np.array([babbler.command(k / 15) for k in range(frames)])


def test_streams_depend_on_seed_and_name_alone() -> None:
    """Same seed and name: same numbers. Another seed or name: numbers that have nothing to do with them."""
    first = stream(3, "babbling").random(1000)
    assert np.array_equal(first, stream(3, "babbling").random(1000))
    for other in (stream(4, "babbling"), stream(3, "learner"), stream(3, "damage"), np.random.default_rng(3)):
        assert abs(np.corrcoef(first, other.random(1000))[0, 1]) < 0.13


def test_the_learner_does_not_shift_the_babbling(short: Short, body: MujocoBody) -> None:
    """Any learner, whatever it draws and whenever it is built: the same arm commands. Another seed: others."""
    reference = commands(short(), body)
    for choice in ({"kind": "random"}, {"kind": "fixed"}, {"kind": "hebbian", "arm_map": {"shape": [3, 3]}}):
        description = short(learner=choice)
        learner = build_learner(description, body)
        babbling = commands(description, body)
        learner.predict(np.zeros(4))
        assert np.array_equal(babbling, reference)
    assert not np.array_equal(commands(short(seed=4), body), reference)


def test_ranges_by_name_or_in_numbers(short: Short, body: MujocoBody) -> None:
    """`mechanical` is the joint limits, other names are the body's, numbers are themselves."""
    confined = np.array(body.anatomy.ranges["confined"])
    numbers = [[-0.1, 0.1], [0.2, 0.3], [-1.0, 1.0], [-1.0, -0.9]]
    for choice, bounds in (("mechanical", limits(body.arm)), ("confined", confined), (numbers, np.array(numbers))):
        babbler = build_babbler(short(babbling={"range": choice}), body, np.zeros(4))
        assert babbler.bounds == pytest.approx(bounds, abs=1e-12)  # type: ignore[attr-defined]


def test_learners_by_kind(short: Short, body: MujocoBody) -> None:
    """Each kind builds its class; map sizes and image size reach the paper's learner."""
    kinds = {"hebbian": HebbianLearner, "random": RandomGaze, "fixed": FixedGaze}
    for kind, cls in kinds.items():
        assert type(build_learner(short(learner={"kind": kind}), body)) is cls
    learner = build_learner(
        short(learner={"kind": "hebbian", "arm_map": {"shape": [4, 6]}, "head_map": {"shape": [3, 2]}}), body
    )
    assert isinstance(learner, HebbianLearner)
    assert learner.arm_map.codebook_.shape == (24, 4) and learner.head_map.codebook_.shape == (6, 2)
    assert (learner.links.n_pre, learner.links.n_post) == (24, 6)


def test_the_body_moves_its_arm_at_babbling_speed(short: Short) -> None:
    """A frame's arm movement is speed / 15 s; the head goes at its own limit or at head_speed."""
    robot = build_body(short(babbling={"speed": 0.3}, body={"motion": "kinematic", "head_speed": 0.6}))
    before = robot.reset()
    after = robot.step(limits(robot.arm)[:, 0], limits(robot.head)[:, 0])
    assert np.abs(after.arm - before.arm).max() == pytest.approx(0.3 / 15)
    assert np.abs(after.head - before.head).max() == pytest.approx(0.6 / 15)


def test_damages_by_kind(body: MujocoBody) -> None:
    """none and offset."""
    assert type(build_damage(Phase(), body)) is NoDamage
    assert type(build_damage(Phase(damage=OffsetDamage()), body)) is JointOffset


@pytest.mark.parametrize(
    ("tables", "build", "message"),
    [
        ({"babbling": {"range": "wide"}}, commands, r"babbling.range 'wide' .*choose one of mechanical, confined"),
        ({"babbling": {"range": [[0, 1]]}}, commands, r"babbling: .*LShoulderPitch.*LElbowRoll.*shape is \(1, 2\)"),
        (
            {"babbling": {"range": [[0, 1], [0, 1], [0, 9], [-1, -0.5]]}},
            commands,
            r"babbling: .*\[0, 9\] of LElbowYaw must lie inside its limits \[-2.0857, 2.0857\]",
        ),
        (
            {"learner": {"kind": "fixed", "head": [0, 2]}},
            build_learner,
            r"learner.head: HeadPitch = 2 lies outside its limits",
        ),
        (
            {"learner": {"kind": "fixed", "head": [0, 0, 0]}},
            build_learner,
            r"learner.head has 3 angles; there are 2 joints: HeadYaw, HeadPitch",
        ),
    ],
)
def test_what_does_not_fit_the_robot_is_named(
    short: Short, body: MujocoBody, tables: dict[str, Any], build: Callable[..., Any], message: str
) -> None:
    """Key, joint, value and limits."""
    with pytest.raises(DescriptionError, match=message):
        build(short(**tables), body)


def test_an_offset_needs_one_number_a_joint(body: MujocoBody) -> None:
    """The phase, both lengths and the joints are named."""
    with pytest.raises(DescriptionError, match=r"'hurt' has 2 offsets; the arm has 4 joints: LShoulderPitch, "):
        build_damage(Phase(name="hurt", damage=OffsetDamage(offset=(0.1, 0.2))), body)


def test_an_unknown_body_lists_the_known_ones(short: Short) -> None:
    """Neither a name nor a file."""
    with pytest.raises(BodyError, match=r"'robby' .*Known bodies: nao"):
        build_body(short(body={"model": "robby"}))
