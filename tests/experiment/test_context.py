"""What settings find when they build a part: named random streams, and everything wrong found before a run."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from somatopy.bodies import BodyError, MujocoBody
from somatopy.contract import Learner
from somatopy.experiment import Description, DescriptionError, Session
from somatopy.experiment.context import Context, stream
from somatopy.eyes import GeometricEye
from somatopy.interventions import JointOffset
from somatopy.learners import FixedGaze, HebbianLearner, NearestGaze, RandomGaze

Short = Callable[..., Description]


@pytest.fixture(scope="module")
def body() -> MujocoBody:
    return MujocoBody("nao", motion="kinematic")


def context(description: Description, body: MujocoBody, name: str = "babbling") -> Context:
    return Context(description, body, stream(description.seed, name), body.reset().arm)


def commands(description: Description, body: MujocoBody, frames: int = 500) -> np.ndarray:
    babbler = description.babbling.build(context(description, body))
    return np.array([babbler.command(k / 15) for k in range(frames)])


def built(description: Description, body: MujocoBody) -> Learner:
    learner: Learner = description.learner.build(context(description, body, "learner"))
    return learner


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
        learner = built(description, body)
        babbling = commands(description, body)
        learner.predict(np.zeros(4))
        assert np.array_equal(babbling, reference)
    assert not np.array_equal(commands(short(seed=4), body), reference)


def test_ranges_by_name_or_in_numbers(short: Short, body: MujocoBody) -> None:
    """`mechanical` is the joint limits, other names are the body's, numbers are themselves."""
    confined = np.array(body.anatomy.ranges["confined"])
    numbers = [[-0.1, 0.1], [0.2, 0.3], [-1.0, 1.0], [-1.0, -0.9]]
    for choice, bounds in (("mechanical", body.arm.space.limits), ("confined", confined), (numbers, np.array(numbers))):
        found = context(short(babbling={"range": choice}), body)
        assert found.bounds() == pytest.approx(bounds, abs=1e-12)
        assert found.description.babbling.build(found).bounds == pytest.approx(bounds, abs=1e-12)


def test_learners_by_kind(short: Short, body: MujocoBody) -> None:
    """Each kind builds its class; map sizes and image size reach the paper's learner."""
    kinds = {"hebbian": HebbianLearner, "random": RandomGaze, "fixed": FixedGaze, "nearest": NearestGaze}
    for kind, cls in kinds.items():
        assert type(built(short(learner={"kind": kind}), body)) is cls
    learner = built(
        short(learner={"kind": "hebbian", "arm_map": {"shape": [4, 6]}, "head_map": {"shape": [3, 2]}}), body
    )
    assert isinstance(learner, HebbianLearner)
    assert learner.arm_map.codebook_.shape == (24, 4) and learner.head_map.codebook_.shape == (6, 2)
    assert (learner.links.n_pre, learner.links.n_post) == (24, 6)


def test_the_body_moves_its_arm_at_babbling_speed(short: Short) -> None:
    """A frame's arm movement is speed / 15 s; the head goes at its own limit or at head_speed."""
    described = short(babbling={"speed": 0.3}, body={"motion": "kinematic", "head_speed": 0.6})
    robot = described.body.build(Context(described))
    before = robot.reset()
    after = robot.step(robot.arm.space.limits[:, 0], robot.head.space.limits[:, 0])
    assert np.abs(after.arm - before.arm).max() == pytest.approx(0.3 / 15)
    assert np.abs(after.head - before.head).max() == pytest.approx(0.6 / 15)


def test_the_context_hands_over_what_is_built_by_then(short: Short, body: MujocoBody) -> None:
    """The robot with both senses and the camera; while the body is built it says that there is none."""
    found = context(short(), body)
    assert set(found.robot.senses) == {"arm", "head"} and found.robot.moves == ("head",)
    assert found.robot.camera == body.camera and found.robot.arm.names == body.arm.names
    assert np.array_equal(found.robot.head.limits, np.column_stack([body.head.lower, body.head.upper]))
    assert found.told(learning_rate=0.3).learning_rate == 0.3  # type: ignore[attr-defined]
    with pytest.raises(ValueError, match="a body is built before all other parts"):
        _ = Context(short()).robot


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({"babbling": {"range": "broad"}}, r"babbling: range 'broad' .*choose one of mechanical, confined, wide"),
        ({"babbling": {"range": [[0, 1]]}}, r"babbling: .*LShoulderPitch.*LElbowRoll.*shape is \(1, 2\)"),
        (
            {"babbling": {"range": [[0, 1], [0, 1], [0, 9], [-1, -0.5]]}},
            r"babbling: .*\[0, 9\] of LElbowYaw must lie inside its limits \[-2.0857, 2.0857\]",
        ),
        ({"learner": {"kind": "fixed", "head": [0, 2]}}, r"learner: head: HeadPitch = 2 lies outside its limits"),
        (
            {"learner": {"kind": "fixed", "head": [0, 0, 0]}},
            r"learner: head has 3 angles; there are 2 joints: HeadYaw, HeadPitch",
        ),
        (
            {"learner": {"kind": "hebbian", "arm_map": "neural-gas"}},
            r"learner: arm_map must be a map on a lattice, such as dsom or som; NeuralGas is none",
        ),
        ({"learner": {"kind": "hebbian", "head_map": {"elasticity": -1}}}, r"learner: head_map: elasticity .*-1"),
        (
            {"phases": [{"name": "hurt", "damage": {"kind": "offset", "offset": [0.1, 0.2]}}]},
            r"phases.0 \('hurt'\): 2 offsets; the arm has 4 joints: LShoulderPitch, ",
        ),
    ],
)
def test_what_does_not_fit_the_robot_is_named(short: Short, tables: dict[str, Any], message: str) -> None:
    """Key, joint, value and limits, before anything runs."""
    with pytest.raises(DescriptionError, match=message):
        Session(short(**tables))


def test_interventions_by_kind(short: Short) -> None:
    """The short form of a damage is an intervention of its kind; none is none."""
    phases = [{"name": "a", "damage": {"kind": "none"}}, {"name": "b", "damage": {"kind": "offset"}}]
    with Session(short(phases=phases)) as session:
        assert [[type(part) for part in phase] for phase in session.interventions] == [[], [JointOffset]]


def test_an_unknown_body_lists_the_known_ones(short: Short) -> None:
    """Neither a name nor a file."""
    with pytest.raises(BodyError, match=r"'robby' .*Known bodies: nao"):
        Session(short(body={"model": "robby"}))


# -- controls that look before they start ----------------------------------------------------------------------------

NARROW = np.array([[0.5, 1.0], [0.2, 0.3], [-1.0, -0.5], [-1.0, -0.9]])


def start_codes(description: Description, body: MujocoBody) -> np.ndarray:
    """Start codes of the arm map, rad."""
    learner = built(description, body)
    assert isinstance(learner, HebbianLearner)
    low, high = body.arm.space.limits.T
    return low + learner.arm_map.codebook_ * (high - low)


def sampled(short: Short, seed: int = 3, **tables: Any) -> Description:
    return short(
        learner={"kind": "hebbian", "arm_codes": "sampled", "arm_map": {"shape": [30, 30]}}, seed=seed, **tables
    )


def test_sampled_codes_are_postures_met_while_babbling(short: Short, body: MujocoBody) -> None:
    """They spread as set-points do on straight ways between uniform targets, more in the middle than uniform ones."""
    codes = start_codes(sampled(short), body)
    low, high = body.arm.space.limits.T
    targets = np.random.default_rng(99).uniform(low, high, (2000, 4))
    ways = []
    for before, after in pairwise(targets):
        way, frames = after - before, np.arange(0, np.abs(after - before).max(), 0.8 / 15)[:, None]
        ways.append(before + np.sign(way) * np.minimum(frames, np.abs(way)))
    spread, expected = (12 * np.var(points, axis=0) / (high - low) ** 2 for points in (codes, np.concatenate(ways)))
    assert np.abs(spread - expected).max() < 0.1
    assert max(spread[[0, 2]]) < 0.85  # 1 if uniform; the joints of short ways wait for these at their targets


def test_sampled_codes_stay_in_the_babbling_range(short: Short, body: MujocoBody) -> None:
    """Also where the middle of the joint limits lies outside it; all codes are postures of their own."""
    codes = start_codes(sampled(short, babbling={"range": NARROW.tolist()}), body)
    every = context(short(babbling={"range": NARROW.tolist()}), body).babbled(27_000)
    for postures in (codes, every):
        assert (postures >= NARROW[:, 0] - 1e-9).all() and (postures <= NARROW[:, 1] + 1e-9).all()
    assert len(np.unique(codes, axis=0)) == 900


def test_sampled_codes_are_of_their_seed_and_of_no_run(short: Short, body: MujocoBody) -> None:
    """The same seed: the same codes. Another: none in common. The run's own babbling is not what they are from."""
    codes = start_codes(sampled(short), body)
    assert np.array_equal(codes, start_codes(sampled(short), body))
    assert not np.isin(codes, start_codes(sampled(short, seed=4), body)).any()
    robot = short().body.build(Context(short()))
    babbler = short().babbling.build(context(short(), robot))
    arms = np.array([robot.step(babbler.command(k / 15), [0, 0]).arm for k in range(5000)])
    assert not np.isclose(codes[:, None, 0], arms[None, :, 0], rtol=0, atol=1e-12).any()


def test_the_head_map_is_not_sampled(short: Short, body: MujocoBody) -> None:
    """It begins as in the paper's learner of the same seed."""
    one, plain = built(sampled(short), body), built(short(learner={"kind": "hebbian"}), body)
    assert isinstance(one, HebbianLearner) and isinstance(plain, HebbianLearner)
    assert np.array_equal(one.head_map.codebook_, plain.head_map.codebook_)
    assert not np.array_equal(one.arm_map.codebook_, plain.arm_map.codebook_)


def test_the_best_fixed_head_sees_the_hand_more_often_than_others(short: Short, body: MujocoBody) -> None:
    """It is legal, and on babbled postures it sees the hand at least as often as any of 20 random legal ones."""
    description = short(learner={"kind": "fixed"})
    head = built(description, body).predict(np.zeros(4))
    assert np.array_equal(body.legal(head), head)
    low, high = body.head.space.limits.T
    others = [body.legal(posture) for posture in np.random.default_rng(1).uniform(low, high, (20, 2))]
    eye = GeometricEye(body.camera, body.marker, body.occluders)
    arms = context(short(seed=77), body).babbled(400)
    best, *counts = (sum(eye.find(body.view(arm, each)) is not None for arm in arms) for each in (head, *others))
    assert best >= max(counts) and best > 40


@pytest.mark.parametrize(
    ("learner", "phase", "message"),
    [
        ("hebbian", {"plastic": ["lynx"]}, "'b'.*, plastic: .*'lynx' .*valid parts: arm_map, head_map, links"),
        ("nearest", {"plastic": ["links"]}, "'b'.*, plastic: .*'links' .*valid parts: memory"),
        ("random", {"plastic": ["links"]}, "'b'.*, plastic: .*'links' .*valid parts: none, so leave plastic away"),
        ("nearest", {"start": "shuffled"}, "'b'.*, shuffled: .*no links to shuffle; choose continue or afresh"),
    ],
)
def test_phases_ask_only_what_the_learner_can_do(
    short: Short, learner: str, phase: dict[str, Any], message: str
) -> None:
    """The phase, the intervention, what the learner has not and what there is are named; the rest is accepted."""
    with pytest.raises(DescriptionError, match=message):
        Session(short(learner={"kind": learner}, phases=[{"name": "a"}, {"name": "b", **phase}]))
    for fine in ({"plastic": []}, {"start": "afresh"}, {}):
        Session(short(learner={"kind": learner}, phases=[{"name": "a"}, {"name": "b", **fine}])).close()
