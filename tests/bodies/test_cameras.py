"""Cameras of other models: whatever says how they are built, the geometric eye sees where MuJoCo draws."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from somatopy.bodies import BodyError, MujocoBody
from somatopy.bodies.rendering import Renderer
from somatopy.eyes import FiducialEye, GeometricEye

Robot = Callable[..., Path]

FOVY = 'fovy="60"'
SIZE = "width = 200\nheight = 150\n"
SENSOR = 'sensorsize="4 3" focal="4 4" resolution="320 240"'
OFF_CENTRE = 'sensorsize="4 3" focal="3 5" principal=".4 -.3" resolution="320 240"'
IN_PIXELS = 'sensorsize="4 3" focalpixel="200 220" principalpixel="-30 20" resolution="320 240"'


def with_camera(robot: Robot, camera: str, size: str = SIZE, fovy: float | None = None) -> MujocoBody:
    return MujocoBody(str(robot((FOVY, camera), (SIZE, size))), "kinematic", fovy=fovy)


@pytest.mark.gl
@pytest.mark.parametrize(
    ("camera", "size"),
    [
        (SENSOR, SIZE),
        (SENSOR, "width = 200\nheight = 200\n"),
        (OFF_CENTRE, SIZE),
        (OFF_CENTRE, "width = 200\nheight = 120\n"),
        (IN_PIXELS, ""),
    ],
)
def test_both_eyes_see_the_hand_at_the_same_pixel(robot: Robot, camera: str, size: str) -> None:
    """Unequal focal lengths, an axis beside the middle, pictures of another shape than the sensor's."""
    body = with_camera(robot, camera, size)
    drawn = FiducialEye(body.camera, body.marker, skip=False)
    skipping, known = FiducialEye(body.camera, body.marker), GeometricEye(body.camera, body.marker, body.occluders)
    rng, apart, postures = np.random.default_rng(0), [], 0
    for _ in range(120):
        arm, head = rng.uniform(body.arm.lower, body.arm.upper), rng.uniform(body.head.lower, body.head.upper)
        reading = body.place(arm, 0.5 * head)
        found, expected = drawn.look(reading), known.look(reading)
        assert skipping.look(body.place(arm, 0.5 * head)) == found
        postures += found is not None
        if found and expected and found.tag == expected.tag:
            apart.append(np.subtract(found.pixel, expected.pixel))
    body.close()
    assert len(apart) >= 0.7 * postures >= 6
    assert np.abs(np.mean(apart, axis=0)).max() < 0.8 and np.abs(apart).max() < 2


@pytest.mark.gl
def test_no_pixel_depends_on_what_is_left_out_beside_such_a_camera(robot: Robot) -> None:
    """Parts of any size and place are those of the picture in which all is drawn."""
    body, rng = with_camera(robot, OFF_CENTRE), np.random.default_rng(3)
    body.picture()
    everything, left_out = Renderer(body.model, "eye", 200, 150), 0
    everything._reaches = np.zeros(body.model.ngeom)
    for _ in range(60):
        body.place(rng.uniform(body.arm.lower, body.arm.upper), rng.uniform(body.head.lower, body.head.upper))
        (left, right), (top, bottom) = np.sort(rng.choice(201, 2, False)), np.sort(rng.choice(151, 2, False))
        part = body.picture(part=(left, top, right, bottom))
        np.testing.assert_array_equal(part, everything.render(body.data)[top:bottom, left:right])
        (renderer,) = body._renderers.values()
        left_out += everything._scene.ngeom - renderer._scene.ngeom
    assert left_out > 60
    everything.close()
    body.close()


@pytest.mark.parametrize("camera", [SENSOR, OFF_CENTRE, IN_PIXELS])
def test_field_of_view_that_is_asked_for_takes_the_sensors_place(robot: Robot, camera: str) -> None:
    """The camera is then the one that the same field of view makes of a plain camera."""
    asked, plain = with_camera(robot, camera, fovy=50.0).camera, with_camera(robot, 'fovy="50"').camera
    assert asked == plain and asked.intrinsics is None


def test_size_of_pictures_is_the_anatomys_else_the_cameras_else_the_usual(robot: Robot) -> None:
    """The focal length in pixels follows: the same sensor has more of them."""
    large = with_camera(robot, SENSOR, "").camera
    small = with_camera(robot, SENSOR, "width = 80\nheight = 60\n").camera
    assert (large.width, large.height, small.width, small.height) == (320, 240, 80, 60)
    assert large.focals == pytest.approx((320, 320)) and small.focals == pytest.approx((80, 80))
    for said in (FOVY, FOVY + ' resolution="1 1"'):
        usual = with_camera(robot, said, "").camera
        assert (usual.width, usual.height) == (320, 240)
    plain = with_camera(robot, FOVY + ' resolution="64 48"', "").camera
    assert (plain.width, plain.height) == (64, 48) and plain.focals == pytest.approx(2 * (24 / np.tan(np.pi / 6),))


@pytest.mark.parametrize(
    ("camera", "size", "message"),
    [
        ('fovy="1" projection="orthographic"', SIZE, r'camera \'eye\' .*orthographic.*projection="perspective"'),
        ('sensorsize="4 3" resolution="320 240"', SIZE, r"camera 'eye' .*no focal length.*focal=.*or fovy alone"),
        ('fovy="40" resolution="8000 10"', "", r"'eye' .*8000 x 10 px.*\[camera\] width = 320, height = 240"),
        (FOVY, "width = 200\n", r"camera: .*width and height stand together"),
    ],
)
def test_camera_that_can_be_no_eye_is_refused(robot: Robot, camera: str, size: str, message: str) -> None:
    """The sentence says what to write instead."""
    with pytest.raises(BodyError, match=message):
        with_camera(robot, camera, size)
