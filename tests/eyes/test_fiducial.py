"""The detector: what it finds in pictures made by hand, and how near to the true hand in those of the robot."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import cv2
import numpy as np
import pytest

from somatopy.bodies import MujocoBody
from somatopy.bodies.marker import SITE
from somatopy.eyes import Eye, FiducialEye
from somatopy.percept import Camera, Floats, Image, Marker, Reading

CAMERA = Camera("test", 320, 240, np.deg2rad(47.64))
MARKER = Marker()
WITHOUT_FAULT = 5.0  # px; farther off is no error of rounding


def reading(image: Image | None) -> Reading:
    nothing = np.zeros(1)
    return Reading(0.0, nothing, nothing, nothing, nothing, image=None if image is None else lambda: image)


def blank() -> Image:
    return np.full((240, 320, 3), 200, np.uint8)


def paste(image: Image, tag: int, left: int, top: int, side: int) -> None:
    """A tag on a white card whose black square begins at the pixel (left, top)."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    edge = side // 5
    image[top - edge : top + side + edge, left - edge : left + side + edge] = 255
    picture = cv2.aruco.generateImageMarker(dictionary, tag, side)
    image[top : top + side, left : left + side] = picture[..., None]


@pytest.fixture
def eye() -> FiducialEye:
    return FiducialEye(CAMERA, MARKER)


# -- pictures made by hand ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("tag", MARKER.ids)
def test_tag_seen_squarely_is_the_hand_behind_it(eye: FiducialEye, tag: int) -> None:
    """In the middle of the picture hand and tag have one pixel; id and area are the tag's."""
    image, side = blank(), 60
    paste(image, tag, 130, 90, side)
    found = eye.look(reading(image))
    assert found is not None and found.tag == tag
    np.testing.assert_allclose(found.pixel, (159.5, 119.5), atol=1.0)
    assert found.area == pytest.approx(side**2, rel=0.1)


@pytest.mark.parametrize("turns", range(4))
def test_hand_lies_behind_a_tag_at_the_side(eye: FiducialEye, turns: int) -> None:
    """Off the axis the hand, half a cube farther away, appears nearer to the middle; also for tags on their heads."""
    tag, image, side = blank()[:150, :150], blank(), 60
    paste(tag, 1, 45, 45, side)
    image[50:200, 170:320] = np.rot90(tag, turns)
    found = eye.look(reading(image))
    distance = MARKER.tag_size * CAMERA.focal / side
    nearer = distance / (distance + 0.5 * MARKER.size)
    assert found is not None
    np.testing.assert_allclose(found.pixel, [159.5 + 85 * nearer, 119.5 + 5 * nearer], atol=3.0)


def test_corners_begin_at_the_tags_own_upper_left(eye: FiducialEye) -> None:
    """They turn with the tag, clockwise."""
    image = blank()
    paste(image, 2, 130, 90, 60)
    upright = eye.detect(image)[2]
    np.testing.assert_allclose(upright, [[130, 90], [189, 90], [189, 149], [130, 149]], atol=1.5)
    turned = eye.detect(np.ascontiguousarray(np.rot90(image, 2)))[2]
    np.testing.assert_allclose(turned, [319, 239] - upright, atol=1.5)


@pytest.mark.parametrize("order", [(0, 3), (3, 0)])
def test_largest_tag_counts(eye: FiducialEye, order: tuple[int, int]) -> None:
    """Of two tags, whatever their ids and places."""
    image = blank()
    paste(image, order[0], 40, 60, 80)
    paste(image, order[1], 220, 150, 40)
    assert set(eye.detect(image)) == set(order)
    found = eye.look(reading(image))
    assert found is not None and found.tag == order[0]


def test_the_larger_of_two_equal_tags_counts(eye: FiducialEye) -> None:
    """A reflection of the same tag does not replace it."""
    image = blank()
    paste(image, 1, 220, 150, 40)
    paste(image, 1, 40, 60, 80)
    found = eye.look(reading(image))
    assert found is not None and found.area == pytest.approx(80**2, rel=0.1)


def test_tags_that_are_not_on_the_cube_are_not_seen(eye: FiducialEye) -> None:
    """The same dictionary has other ids."""
    image = blank()
    paste(image, 17, 130, 90, 60)
    assert eye.look(reading(image)) is None


def test_ids_of_the_marker_are_reported() -> None:
    """Not places in the list of ids."""
    image = blank()
    paste(image, 17, 130, 90, 60)
    found = FiducialEye(CAMERA, Marker(ids=(5, 17, 2, 9))).look(reading(image))
    assert found is not None and found.tag == 17


def test_nothing_is_seen_in_noise_and_blocks(eye: FiducialEye) -> None:
    """No false positive in uniform pictures, pixel noise and random black and white blocks."""
    rng = np.random.default_rng(0)
    pictures = [np.full((240, 320), k, np.uint8) for k in (0, 128, 255)]
    pictures += [rng.integers(0, 256, (240, 320), dtype=np.uint8) for _ in range(20)]
    pictures += [np.kron(rng.integers(0, 2, (24, 32)), np.full((10, 10), 255)).astype(np.uint8) for _ in range(100)]
    assert not any(eye.look(reading(np.repeat(p[..., None], 3, axis=2))) for p in pictures)


def test_same_picture_gives_the_same_answer(eye: FiducialEye) -> None:
    """An eye is pure: what it saw before does not matter."""
    first, second = blank(), blank()
    paste(first, 0, 130, 90, 60)
    paste(second, 3, 30, 50, 33)
    before = eye.look(reading(first))
    eye.look(reading(second))
    assert eye.look(reading(first)) == before == FiducialEye(CAMERA, MARKER).look(reading(first))
    assert isinstance(eye, Eye)


# -- bad input ---------------------------------------------------------------------------------------------------------


def test_body_without_camera_is_named(eye: FiducialEye) -> None:
    """The message says what to do."""
    with pytest.raises(ValueError, match=r"takes no pictures.*Use another eye"):
        eye.look(reading(None))


@pytest.mark.parametrize("shape", [(480, 640, 3), (240, 320), (240, 320, 4)])
def test_picture_of_another_size_is_named(eye: FiducialEye, shape: tuple[int, ...]) -> None:
    """With both shapes."""
    with pytest.raises(ValueError, match=r"picture has shape .*was said to take \(240, 320, 3\)"):
        eye.look(reading(np.zeros(shape, np.uint8)))


def test_unknown_dictionary_is_answered_with_the_known_ones() -> None:
    """OpenCV's names."""
    with pytest.raises(ValueError, match=r"no tag dictionary 'DICT_9X9'. Available: .*DICT_4X4_50"):
        FiducialEye(CAMERA, Marker(dictionary="DICT_9X9"))


# -- the robot's own pictures ------------------------------------------------------------------------------------------


@pytest.fixture
def nao() -> Iterator[MujocoBody]:
    body = MujocoBody("nao", "kinematic", arm_speed=None)
    yield body
    body.close()


def wander(body: MujocoBody, frames: int, seed: int) -> Iterator[Reading]:
    """Readings on the way between random postures with the arm in front and the head turned towards it."""
    rng = np.random.default_rng(seed)
    for frame in range(frames):
        if frame % 3 == 0:
            arm = rng.uniform([-0.6, -0.31, -2.0, -1.54], [1.2, 0.8, 0.2, -0.3])
            head = rng.uniform([-0.3, -0.3], [0.9, 0.5])
        yield body.step(arm, head)


def true_pixel(reading: Reading, camera: Camera) -> Floats:
    """Where the hand's centre is in the picture, by the pinhole model; not a number where it is behind the camera."""
    view: Any = reading.view
    x, y, z = view.camera[3:].reshape(3, 3).T @ (view.marker[:3] - view.camera[:3])
    if z >= 0:
        return np.full(2, np.nan)
    return np.array([0.5 * (camera.width - 1) - camera.focal * x / z, 0.5 * (camera.height - 1) + camera.focal * y / z])


@pytest.mark.gl
def test_hand_is_found_where_it_truly_is(nao: MujocoBody) -> None:
    """The detector rounds corners to pixels: half a pixel is usual, more than two rare, and nothing is far off."""
    eye, errors, tags = FiducialEye(nao.camera, nao.marker), [], set()
    for seen in wander(nao, 900, seed=3):
        found = eye.look(seen)
        if found is not None:
            tags.add(found.tag)
            errors.append(np.linalg.norm(found.pixel - true_pixel(seen, nao.camera)))
    assert len(errors) > 80 and len(tags) >= 3
    assert np.median(errors) < 1.0
    assert np.mean(np.array(errors) < 2.0) > 0.96
    assert max(errors) < WITHOUT_FAULT


@pytest.mark.gl
def test_nothing_is_seen_where_the_cube_is_out_of_view(nao: MujocoBody) -> None:
    """Not one false positive: 150 pictures without the cube in them, and 150 of a robot that wears none."""
    eye, without = FiducialEye(nao.camera, nao.marker), 0
    for seen in wander(nao, 400, seed=4):
        u, v = true_pixel(seen, nao.camera)
        if not (-200 < u < 520 and -200 < v < 440):
            without += 1
            assert eye.look(seen) is None
    nao.model.geom(SITE).group = 5
    assert without > 60
    assert not any(eye.look(seen) for seen in wander(nao, 150, seed=5))
