"""Whether the hand can be seen at all, how often, from where, and why not."""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice
from typing import Any

import mujoco
import numpy as np
import pytest

from somatopy.bodies import MODELS, Anatomy, MujocoBody
from somatopy.experiment import Description, DescriptionError, Session, session
from somatopy.experiment.ceiling import Vantages, reachable
from somatopy.experiment.look import confined, outlook, why_unseen
from somatopy.eyes import GeometricEye
from somatopy.percept import Floats, Reading

Short = Callable[..., Description]
BEHIND = {"range": [[1.9, 2.0], [1.2, 1.3], [-0.1, 0.1], [-0.1, -0.04]]}


class Blind:
    """An eye of one's own that finds nothing."""

    def look(self, reading: Reading) -> None:
        return None


@pytest.fixture(scope="module")
def body() -> MujocoBody:
    return MujocoBody("nao", motion="kinematic")


@pytest.fixture(scope="module")
def vantages(body: MujocoBody) -> Vantages:
    return Vantages.of(body, (25, 9))


def drawn(body: MujocoBody, count: int, seed: int = 0) -> Floats:
    return np.random.default_rng(seed).uniform(body.arm.lower, body.arm.upper, (count, len(body.arm)))


def sees(body: MujocoBody, arm: Floats, head: Floats) -> bool:
    return GeometricEye(body.camera, body.marker, body.occluders).find(body.view(arm, head)) is not None


def test_rates_agree_with_the_eye_asked_one_by_one(body: MujocoBody, vantages: Vantages) -> None:
    """The share that can be seen is the ceiling's; the best fixed head sees as often as it says, and no other more."""
    arms = drawn(body, 60)
    found = outlook(vantages, arms)
    assert found.rate == reachable(vantages, arms).mean()
    assert found.fixed_rate == np.mean([sees(body, arm, found.fixed_head) for arm in arms])
    others = vantages.heads[:: len(vantages.heads) // 7]
    assert all(found.fixed_rate >= np.mean([sees(body, arm, head) for arm in arms]) for head in others)
    assert 0 < found.fixed_rate < found.rate < 1


def test_each_arm_posture_that_can_be_seen_has_a_head_that_sees_it(body: MujocoBody, vantages: Vantages) -> None:
    """And no other has."""
    arms = drawn(body, 40, 1)
    found = outlook(vantages, arms)
    assert [sees(body, arm, head) for arm, head in zip(arms, found.heads, strict=True)] == (found.seen > 0).tolist()


def test_in_a_confined_range_the_hand_is_seen_more_often(body: MujocoBody, vantages: Vantages) -> None:
    """Inside the limits; of postures drawn anew three of four are seen, and more than in all of the limits."""
    low, high = np.array(confined(vantages)).T
    assert (body.arm.lower < low).all() and (low < high).all() and (high < body.arm.upper).all()
    within = np.random.default_rng(5).uniform(low, high, (200, 4))
    share = reachable(vantages, within).mean()
    assert share > 0.75 and share > reachable(vantages, drawn(body, 200, 5)).mean()


def test_a_hand_that_is_never_seen_has_no_confined_range() -> None:
    """Its camera has too few pixels."""
    assert confined(Vantages.of(coarse(), (25, 9))) is None


def coarse() -> MujocoBody:
    """NAO with a camera of 24 x 18 pixels."""
    anatomy = Anatomy.load(MODELS["nao"])
    camera = anatomy.camera.model_copy(update={"width": 24, "height": 18})
    return MujocoBody(anatomy.model_copy(update={"camera": camera}), motion="kinematic")


def look_up(body: MujocoBody) -> None:
    """Turn the eye about its axis to the right by 130 degrees, so that it looks at the ceiling."""
    camera, half = body.model.camera(body.camera.name).id, np.deg2rad(65)
    mujoco.mju_mulQuat(
        body.model.cam_quat[camera], body.model.cam_quat[camera].copy(), np.array([np.cos(half), np.sin(half), 0, 0])
    )


def test_why_a_hand_is_never_seen(body: MujocoBody) -> None:
    """A camera that looks up, one of a few pixels, a hand that is thicker than the cube."""
    arms = np.random.default_rng(0).uniform(*np.array(body.ranges["confined"]).T, (20, 4))
    away, thick = body.another(), body.another()
    look_up(away)
    hand = np.flatnonzero(thick.model.geom_bodyid == thick.model.body("l_wrist").id)
    thick.model.geom_size[hand] = 0.12
    thick.model.geom_rbound[hand] = 0.24
    thick = thick.another()
    assert why_unseen(away, arms) == "aside"
    assert why_unseen(thick, arms) == "hidden"
    assert why_unseen(coarse(), arms) == "small"


def test_a_session_refuses_a_hand_that_is_never_seen(short: Short) -> None:
    """One sentence that names the way out; an eye of one's own may see what ours does not."""
    with pytest.raises(DescriptionError, match=r"never seen.*babbling.range.*somatopy check-body nao") as caught:
        Session(short(babbling=BEHIND))
    assert "\n" not in str(caught.value)
    Session(short(babbling=BEHIND), eye=Blind()).close()


def test_a_hand_that_is_seldom_seen_is_not_refused(short: Short) -> None:
    """Through a camera so narrow that a few head postures would miss it."""
    Session(short(body={"motion": "kinematic", "camera": {"fovy": 9.0}})).close()


def test_looking_disturbs_nothing(short: Short, monkeypatch: pytest.MonkeyPatch) -> None:
    """Frames are the same in every bit with and without."""

    def played() -> Floats:
        with Session(short()) as running:
            frames = list(islice(running, 40))
        return np.array([np.hstack([f.target, f.gaze, f.reading.arm, f.reading.head]) for f in frames])

    looked = played()
    monkeypatch.setattr(session, "require_sight", lambda *_: None)
    assert np.array_equal(looked, played())


def test_a_babbler_of_ones_own_is_not_moved_on(short: Short) -> None:
    """One that is handed over as it is, whose `range` is something else than intervals; the hand is never seen."""
    babbler = Counting()
    with pytest.raises(DescriptionError, match="never seen"):
        Session(short(body={"motion": "kinematic", "camera": {"fovy": 0.5}}), babbler=babbler)
    assert babbler.asked == 0


class Counting:
    """Counts how often it is asked."""

    range = 0.5

    def __init__(self) -> None:
        self.asked = 0

    def command(self, time: float) -> Floats:
        self.asked += 1
        return np.array([1.0, 0.3, -1.0, -0.8])

    def state(self) -> dict[str, Any]:
        return {}

    def restore(self, state: dict[str, Any]) -> None:
        pass
