"""Which joints move a body, and where the tree of moving bodies branches."""

from __future__ import annotations

import mujoco
import pytest

from somatopy.bodies import MODELS
from somatopy.bodies.joint_tree import moved_by, segments
from somatopy.bodies.survey import read_model


@pytest.fixture(scope="module")
def nao() -> mujoco.MjModel:
    return read_model(MODELS["nao"].with_name("nao.xml"))


def test_joints_that_move_a_body_come_from_the_world_on(nao: mujoco.MjModel) -> None:
    """Those above it and its own, and no others."""
    assert moved_by(nao, nao.body("LElbow").id) == ("LShoulderPitch", "LShoulderRoll", "LElbowYaw")
    assert moved_by(nao, 0) == ()


def test_segments_hold_each_joint_once(nao: mujoco.MjModel) -> None:
    """Head and two arms part at the trunk, which nothing moves."""
    found = [joints for joints in segments(nao) if joints]
    assert sorted(len(joints) for joints in found) == [2, 5, 5]
    assert sorted(joint for joints in found for joint in joints) == list(range(nao.njnt))
