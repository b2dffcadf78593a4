"""Rays against shapes: MuJoCo's own ray caster is the judge."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from somatopy.eyes.rays import any_between
from somatopy.percept import Floats

SIZES = {"sphere": 1, "capsule": 2, "ellipsoid": 3, "cylinder": 2, "box": 3}


def scene(kind: str, rng: np.random.Generator) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """One shape of random size anywhere."""
    size, place, turn = rng.uniform(0.02, 0.2, SIZES[kind]), rng.normal(0, 0.2, 3), rng.normal(size=4)
    numbers = {"size": size, "pos": place, "quat": turn / np.linalg.norm(turn)}
    text = " ".join(f'{key}="{" ".join(map(str, value))}"' for key, value in numbers.items())
    model = mujoco.MjModel.from_xml_string(f'<mujoco><worldbody><geom type="{kind}" {text}/></worldbody></mujoco>')
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def between(model: mujoco.MjModel, data: mujoco.MjData, camera: Floats, point: Floats) -> bool:
    pose = np.concatenate([data.geom_xpos[0], data.geom_xmat[0]])[None]
    sizes = np.append(model.geom_size[0], model.geom_rbound[0])[None]
    if model.geom_type[0] == mujoco.mjtGeom.mjGEOM_SPHERE:
        sizes[0, :3] = sizes[0, 0]
    return any_between(pose, model.geom_type.astype(np.int64), sizes, camera, np.tile(point, (9, 1)), 0.0)


def distance_outside(model: mujoco.MjModel, data: mujoco.MjData, point: Floats) -> float:
    """At least how far a point is from the shape's bounding ball."""
    return float(np.linalg.norm(point - data.geom_xpos[0]) - model.geom_rbound[0])


@pytest.mark.parametrize("kind", SIZES)
def test_rays_from_outside_hit_what_mujoco_hits(kind: str) -> None:
    """Also those that end before the shape, graze it or look away: 2,000 rays at 40 shapes, both answers often."""
    rng, answers = np.random.default_rng(1), []
    for _ in range(40):
        model, data = scene(kind, rng)
        for _ in range(50):
            camera = data.geom_xpos[0] + rng.normal(0, 0.4, 3)
            if distance_outside(model, data, camera) <= 0:
                continue
            point = data.geom_xpos[0] + rng.normal(0, 0.15, 3)
            way = point - camera
            length = np.linalg.norm(way)
            hit = mujoco.mj_ray(model, data, camera, way / length, None, 1, -1, np.zeros(1, np.int32))
            answers.append(0 <= hit < length)
            assert between(model, data, camera, point) == answers[-1]
    assert len(answers) > 1000 and 0.1 < np.mean(answers) < 0.9


@pytest.mark.parametrize("kind", SIZES)
def test_shape_around_the_camera_hides_nothing(kind: str) -> None:
    """Insides are not drawn: from the middle of a shape one looks out, along its axes and askew."""
    rng = np.random.default_rng(2)
    for _ in range(50):
        model, data = scene(kind, rng)
        camera = data.geom_xpos[0] + 0.01 * rng.uniform(-1, 1, 3)
        assert not between(model, data, camera, camera + rng.normal(0, 1, 3))
        axis = data.geom_xmat[0].reshape(3, 3)[:, 2]
        assert not between(model, data, camera, camera + axis) and not between(model, data, camera, camera - axis)


def test_any_of_nine_points_counts() -> None:
    """A shape before only one of them hides; the ball around their middle keeps none from being looked at."""
    camera, points = np.zeros(3), np.zeros((9, 3))
    points[:, 2] = -1.0
    points[:8, 0] = np.linspace(-0.4, 0.3, 8)
    pose = np.array([[-0.2, 0, -0.5, 1, 0, 0, 0, 1, 0, 0, 0, 1.0]])
    kinds, sizes = np.array([2]), np.array([[0.02, 0.02, 0.02, 0.02]])
    assert any_between(pose, kinds, sizes, camera, points, 0.4)
    points[0, 0] = -0.3
    assert not any_between(pose, kinds, sizes, camera, points, 0.4)


@pytest.mark.parametrize("kind", SIZES)
def test_nine_points_of_a_square_are_hidden_where_one_of_them_is_alone(kind: str) -> None:
    """Shapes before, beside, behind and across a square, turned anyhow: what is passed over could not have hidden."""
    rng, answers = np.random.default_rng(3), []
    grid = np.array([(1, -1), (1, 1), (-1, 1), (-1, -1), (1, 0), (0, 1), (-1, 0), (0, -1), (0, 0)], float)
    for _ in range(40):
        model, data = scene(kind, rng)
        pose = np.concatenate([data.geom_xpos[0], data.geom_xmat[0]])[None]
        sizes = np.append(model.geom_size[0], model.geom_rbound[0])[None]
        if kind == "sphere":
            sizes[0, :3] = sizes[0, 0]
        for _ in range(50):
            half = rng.uniform(0.005, 0.1)
            axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
            points = data.geom_xpos[0] + rng.normal(0, 0.2, 3) + half * grid @ axes[:2]
            camera = data.geom_xpos[0] + rng.normal(0, 0.4, 3)
            alone = any(between(model, data, camera, point) for point in points)
            kinds = model.geom_type.astype(np.int64)
            answers.append(any_between(pose, kinds, sizes, camera, points, np.sqrt(2) * half))
            assert answers[-1] == alone
    assert 0.1 < np.mean(answers) < 0.9
