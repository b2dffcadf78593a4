"""What can be changed of a body: by geometry, to the last bit undone, and known to twin, copy and eye."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.robots import Shape, joints, write_robot

from somatopy.bodies import MujocoBody
from somatopy.contract import Alterable, same
from somatopy.eyes import GeometricEye
from somatopy.percept import Floats, Shapes

ANGLES = 0.2, -0.1
ALTER: dict[str, Callable[[MujocoBody], Any]] = {
    "camera": lambda body: body.turn_camera(*ANGLES),
    "marker": lambda body: body.move_marker(0.05),
    "longer": lambda body: body.stretch_arm(1.2),
    "slow": lambda body: body.pace_arm(0.5),
}


@pytest.fixture(scope="module")
def nao() -> MujocoBody:
    return MujocoBody("nao", motion="kinematic")


def postures(body: MujocoBody, count: int = 12) -> list[tuple[Floats, Floats]]:
    rng = np.random.default_rng(3)
    return [tuple(rng.uniform(g.lower, g.upper) for g in (body.arm, body.head)) for _ in range(count)]  # type: ignore[misc]


def axes(pose: Floats) -> Floats:
    """Position and then the three axes of a pose, shape (4, 3)."""
    return np.vstack([pose[:3], pose[3:].reshape(3, 3).T])


@pytest.mark.parametrize(("tilt", "roll"), [(0.2, 0.0), (-0.3, 0.0), (0.0, 0.4), (0.2, -0.1)])
def test_a_turned_camera_looks_further_up_and_leans(nao: MujocoBody, tilt: float, roll: float) -> None:
    """From the same place, by the angles that were said, at any posture of the head; the marker stays."""
    for arm, head in postures(nao):
        before = nao.view(arm, head)
        undo = nao.turn_camera(tilt, roll)
        after = nao.view(arm, head)
        undo()
        place, right, up, back = axes(before.camera)
        now = axes(after.camera)
        assert np.allclose(now[0], place) and same(after.marker, before.marker)
        assert np.allclose(-now[3], np.sin(tilt) * up - np.cos(tilt) * back)
        raised = np.cos(tilt) * up + np.sin(tilt) * back
        assert np.allclose(now[2], np.cos(roll) * raised - np.sin(roll) * right)


@pytest.mark.parametrize("by", [0.05, 0.15, -0.02])
def test_a_moved_marker_goes_along_its_axis(nao: MujocoBody, by: float) -> None:
    """As turned as before; camera and occluders stay."""
    for arm, head in postures(nao):
        before = nao.view(arm, head)
        undo = nao.move_marker(by)
        after = nao.view(arm, head)
        undo()
        assert np.allclose(axes(after.marker)[0], axes(before.marker)[0] + by * axes(before.marker)[1])
        assert same(after.marker[3:], before.marker[3:]) and same(after.camera, before.camera)
        assert same(after.occluders, before.occluders)


@pytest.mark.parametrize("factor", [1.2, 0.8])
def test_a_longer_arm_is_similar_to_the_arm(nao: MujocoBody, factor: float) -> None:
    """At each posture its shapes and the marker are farther from the shoulder in proportion; all else stays.

    Capsules (3) and cylinders (5) are longer, nothing is thicker, and the ball around a capsule encloses it. The hand
    has its shape, and its marker where it was on it.
    """
    of_hand = nao.model.geom_bodyid[nao._occluders.geoms] == nao.model.body("l_wrist").id
    shoulder = nao.data.body("LShoulder").xpos.copy()
    sizes = nao.occluders.sizes.copy()
    for arm, head in postures(nao):
        before = nao.view(arm, head)
        undo = nao.stretch_arm(factor)
        after, grown = nao.view(arm, head), nao.occluders.sizes.copy()
        undo()
        assert np.allclose(after.marker[:3] - shoulder, factor * (before.marker[:3] - shoulder))
        assert np.allclose(after.marker[3:], before.marker[3:]) and same(after.camera, before.camera)
        moved = (after.occluders != before.occluders).any(axis=1)
        assert of_hand.sum() >= 4 and moved[of_hand].all()
        long = moved & ~of_hand & np.isin(nao.occluders.kinds, (3, 5))
        assert 4 <= long.sum() < moved.sum() < len(moved) and same(grown[~long], sizes[~long])
        assert np.allclose(grown[long, 1], factor * sizes[long, 1]) and same(grown[:, 0], sizes[:, 0])
        capsules = long & (nao.occluders.kinds == 3)
        assert capsules.any() and np.allclose(grown[capsules, 3], grown[capsules, :2].sum(axis=1))
        places = after.occluders[:, :3] - shoulder
        arm_only = moved & ~of_hand
        assert np.allclose(places[arm_only], factor * (before.occluders[arm_only, :3] - shoulder))
        on_hand = [view.occluders[of_hand, :3] - view.marker[:3] for view in (before, after)]
        assert np.allclose(*on_hand)
        assert same(after.occluders[~moved], before.occluders[~moved])
    assert same(nao.occluders.sizes, sizes)


def test_a_longer_arm_of_another_robot_is_similar_too(tmp_path: Path) -> None:
    """Of six hinges on a trunk: the marker goes away from the shoulder in proportion, the camera stays."""
    shape = Shape(joints("yzxyzy", 0.5), joints("zy", 0.5), shoulder=(0.1, 0.05, -0.1))
    body = MujocoBody(write_robot(tmp_path, shape), motion="kinematic")
    model = body.model
    shoulder = model.joint(body.arm.names[0]).bodyid[0]
    base = body.data.xpos[shoulder].copy()
    for arm, head in postures(body):
        before = body.view(arm, head)
        undo = body.stretch_arm(1.3)
        after = body.view(arm, head)
        undo()
        assert np.allclose(after.marker[:3] - base, 1.3 * (before.marker[:3] - base))
        assert same(after.camera, before.camera) and np.allclose(after.marker[3:], before.marker[3:])


@pytest.mark.parametrize("factor", [0.5, 2.0, 100.0])
@pytest.mark.parametrize("speed", [0.8, None])
def test_a_paced_arm_moves_as_much_faster_within_its_limits(factor: float, speed: float | None) -> None:
    """In each frame; the head moves as before. It is the movement of a body that was made with that speed."""
    body, paced = (MujocoBody("nao", motion="kinematic", arm_speed=speed) for _ in range(2))
    start = body.reset().arm
    paced.reset()
    undo = paced.pace_arm(factor)
    one, other = (each.step(each.arm.upper, each.head.upper) for each in (body, paced))
    expected = np.minimum(factor * (np.minimum(body.arm.velocity, speed or np.inf)), body.arm.velocity) / 15
    assert np.allclose(other.arm, np.minimum(start + expected, body.arm.upper), atol=1e-9)
    assert same(one.head, other.head)
    assert same(paced.another().step(body.arm.upper, body.head.upper).arm, other.arm)
    undo()
    paced.reset()
    assert same(paced.step(body.arm.upper, body.head.upper).arm, one.arm)


@pytest.mark.parametrize("name", ALTER)
@pytest.mark.parametrize("motion", ["kinematic", "dynamic"])
def test_what_is_changed_is_known_everywhere_and_undone_to_the_last_bit(name: str, motion: Any) -> None:
    """By fingerprint and copy; undone, all that the model and the body say is as before."""
    body = MujocoBody("nao", motion=motion)
    assert isinstance(body, Alterable)
    intact, (arm, head) = body.fingerprint(), postures(body, 1)[0]
    views = [body.view(arm, head)]
    undo = ALTER[name](body)
    views.append(body.view(arm, head))
    copy = body.another()
    assert body.fingerprint() == copy.fingerprint() != intact
    assert same(vars(copy.view(arm, head)), vars(views[1]))
    assert same(copy.occluders.sizes, body.occluders.sizes)
    undo()
    assert body.fingerprint() == intact
    assert same(vars(body.view(arm, head)), vars(views[0]))
    assert same(body.occluders.sizes, body.another().occluders.sizes)


def test_an_eye_that_was_there_before_sees_the_longer_arm(nao: MujocoBody) -> None:
    """It holds the sizes that change in place, and says what an eye of the longer body says; one of old sizes not."""
    stale = Shapes(nao.occluders.kinds, nao.occluders.sizes.copy())
    eye, old = (GeometricEye(nao.camera, nao.marker, shapes) for shapes in (nao.occluders, stale))
    undo = nao.stretch_arm(1.5)
    other = nao.another()
    anew = GeometricEye(other.camera, other.marker, other.occluders)
    rng, (low, high) = np.random.default_rng(3), nao.arm.space.limits.T
    views = [nao.view(rng.uniform(low, high), rng.uniform([0.0, -0.3], [1.2, 0.4])) for _ in range(6000)]
    found = [[each.find(view) for view in views] for each in (eye, anew, old)]
    undo()
    assert found[0] == found[1] != found[2] and any(found[0])


def test_the_longer_arm_moves_by_physics_as_one_that_was_made_so() -> None:
    """Altered on the way it goes on to the last bit as its copy, put into the same state; and not as the intact one."""
    body, intact = MujocoBody("nao"), MujocoBody("nao")
    for _ in range(5):
        body.step(body.arm.upper, body.head.upper)
    state = body.state()
    body.stretch_arm(1.2)
    other = body.another()
    other.restore(state)
    intact.restore(state)
    arms = [[each.step(each.arm.upper, each.head.lower).arm for _ in range(20)] for each in (body, other, intact)]
    assert same(arms[0], arms[1]) and not same(arms[0], arms[2])
    assert np.abs(np.array(arms[0]) - arms[2]).max() < 0.05


def test_a_camera_that_follows_something_cannot_be_turned() -> None:
    """Its frame is not its own."""
    body = MujocoBody("nao", motion="kinematic")
    body.model.cam_mode[body.model.camera(body.anatomy.camera.name).id] = 1
    with pytest.raises(ValueError, match="'CameraBottom' follows something; only one with"):
        body.turn_camera(0.1, 0.0)
