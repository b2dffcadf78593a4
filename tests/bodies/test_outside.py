"""A robot from outside: all that moves is in the picture, points lie where they are drawn, the robot stays as it is."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from tests.robots import Shape, joints, write_robot

from somatopy.bodies import MujocoBody
from somatopy.bodies.outside import Onlooker, standpoint

SIZE = (200, 160)


@pytest.fixture(params=["nao", "robot"])
def body(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[MujocoBody]:
    """A NAO, and an arm and a head that nothing joins, in an empty room."""
    made = "nao" if request.param == "nao" else write_robot(tmp_path, Shape(joints("yzx"), joints("zy")))
    robot = MujocoBody(made, motion="kinematic")
    yield robot
    robot.close()


def drawn(body: MujocoBody, count: int) -> list[tuple[np.ndarray, np.ndarray]]:
    rng = np.random.default_rng(1)
    return [
        (rng.uniform(body.arm.lower, body.arm.upper), rng.uniform(body.head.lower, body.head.upper))
        for _ in range(count)
    ]


def test_eye_and_hand_are_in_the_picture_in_every_posture(body: MujocoBody) -> None:
    """Of all postures that the camera was put up for; one posture alone brings it nearer."""
    postures = drawn(body, 12)
    at = standpoint(body, postures)
    onlooker = Onlooker(body, at, SIZE)
    for arm, head in postures:
        onlooker._shown.place(arm, head)
        view = body.view(arm, head)
        for point in (view.camera[:3], view.marker[:3]):
            assert (onlooker.pixel(point) > 0).all() and (onlooker.pixel(point) < SIZE).all()
    onlooker.close()
    np.testing.assert_allclose(np.linalg.norm(at.back), 1.0)
    (arm, head), hand = postures[0], body.view(*postures[0]).marker[:3]
    alone = standpoint(body, [(arm, head)])
    assert np.linalg.norm(alone.place - hand) < np.linalg.norm(at.place - hand) + 0.5


@pytest.mark.gl
def test_a_point_lies_where_it_is_drawn(body: MujocoBody) -> None:
    """The hand's marker, moved by an injury, changes the picture around its pixel, and nowhere else."""
    arm, head = 0.5 * (body.arm.lower + body.arm.upper), 0.5 * (body.head.lower + body.head.upper)
    at, hand = standpoint(body, [(arm, head)]), body.view(arm, head).marker[:3]
    taken, pixel = [], np.zeros(2)
    for by in (0.0, 0.01):
        undo = body.move_marker(by)
        onlooker = Onlooker(body, at, SIZE)
        taken.append(onlooker.picture(arm, head).astype(int))
        pixel = onlooker.pixel(hand)
        onlooker.close()
        undo()
    rows, columns = np.nonzero(np.abs(taken[0] - taken[1]).max(axis=2) > 20)
    assert len(rows) > 5
    assert np.hypot(columns - pixel[0], rows - pixel[1]).max() < 40
    assert np.abs([columns.mean(), rows.mean()] - pixel).max() < 15


@pytest.mark.gl
def test_the_robot_itself_stays_as_it_is() -> None:
    """Its posture, its model and what its own eye sees; the model's camera `outside` is used where none is put up."""
    body = MujocoBody("nao", motion="kinematic")
    before, place, picture = body.fingerprint(), body.data.qpos.copy(), body.picture()
    onlooker = Onlooker(body, None, SIZE)
    shown = onlooker.picture([0.4, 0.2, -0.8, -0.6], [0.3, 0.1])
    assert shown.shape == (SIZE[1], SIZE[0], 3) and shown.dtype == np.uint8
    assert body.fingerprint() == before and np.array_equal(body.data.qpos, place)
    assert np.array_equal(body.picture(), picture)
    body.place([0.4, 0.2, -0.8, -0.6], [0.3, 0.1])
    assert np.abs(body.picture("outside", *SIZE).astype(int) - shown).mean() < 3
    onlooker.close()
    body.close()
