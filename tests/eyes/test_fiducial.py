"""The detector: what it finds in pictures made by hand, and how near to the true hand in those of the robot."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Annotated, Any

import cv2
import numpy as np
import pytest
from pydantic import TypeAdapter

from somatopy.bodies import MujocoBody
from somatopy.bodies.marker import SITE
from somatopy.eyes import Eye, FiducialEye
from somatopy.percept import Camera, Floats, Image, Marker, Part, Picture, Reading, View
from somatopy.registry import EYES

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


# -- only a part of the picture ----------------------------------------------------------------------------------------


def clutter(rng: np.random.Generator, size: tuple[int, int], things: int) -> Image:
    """Grey discs and bars of many sizes, on grey."""
    image = np.full((size[1], size[0], 3), rng.integers(0, 256), np.uint8)
    for k in range(things):
        grey, (u, v, u1, v1) = [int(rng.integers(0, 256))] * 3, rng.integers(0, [*size, *size]).tolist()
        if k % 2:
            cv2.circle(image, (u, v), int(rng.integers(3, 40)), grey, -1)
        else:
            cv2.line(image, (u, v), (u1, v1), grey, int(rng.integers(1, 12)))
    return image


def cube_in_clutter(rng: np.random.Generator, camera: Camera, things: int = 60) -> Reading:
    """A cube turned anyhow, within or across the picture's edge, some of its outline covered, and the true poses."""
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    depth = rng.uniform(0.1, 0.6)
    place = depth * np.array(
        [*(rng.uniform(-0.5, 0.5, 2) * np.array([camera.width, camera.height]) / camera.focal), -1]
    )
    image, dictionary = clutter(rng, (camera.width, camera.height), things), cv2.aruco.getPredefinedDictionary(0)
    x, y, z = turn.T
    for tag, (normal, side) in zip(MARKER.ids, ((y, z), (z, -y), (-y, -z), (-z, y)), strict=True):
        middle = place + 0.5 * MARKER.size * normal
        corners = [middle + 0.5 * MARKER.size * (a * x + b * side) for a, b in ((1, -1), (1, 1), (-1, 1), (-1, -1))]
        if normal @ middle < 0 and max(corner[2] for corner in corners) < -0.02:
            face = np.pad(cv2.aruco.generateImageMarker(dictionary, tag, 96), 12, constant_values=255)
            pixels = [np.array(camera.centre) + camera.focal * np.array([a / -c, b / c]) for a, b, c in corners]
            square = np.array([[0, 0], [119, 0], [119, 119], [0, 119]], np.float32)
            warp = cv2.getPerspectiveTransform(square, np.array(pixels, np.float32))
            flat = cv2.cvtColor(face, cv2.COLOR_GRAY2RGB)
            cv2.warpPerspective(
                flat, warp, (camera.width, camera.height), image, cv2.INTER_AREA, cv2.BORDER_TRANSPARENT
            )
    u, v = (np.array(camera.centre) + camera.focal * place[:2] / depth * [1, -1] + rng.normal(0, 25, 2)).astype(int)
    image[max(v, 0) : max(v + 9, 0), max(u, 0) : max(u + 9, 0)] = rng.integers(0, 256)
    view = View(np.array([0, 0, 0, *np.eye(3).ravel()]), np.concatenate([place, turn.ravel()]), np.empty((0, 12)))
    return replace(reading(image), view=view)


@pytest.mark.parametrize("things", [0, 60])
@pytest.mark.parametrize("size", [(320, 240), (160, 120), (640, 480), (240, 320)])
def test_answers_are_the_same_whether_a_part_or_the_whole_is_searched(size: tuple[int, int], things: int) -> None:
    """Bit for bit: hit, tag, pixel and area, also with other things that touch the tag, and at the picture's edge.

    In clutter this is very nearly so: see docs/eyes.md.
    """
    rng, camera = np.random.default_rng(9), Camera("test", *size, np.deg2rad(47.64))
    part, whole, hits = FiducialEye(camera, MARKER), FiducialEye(camera, MARKER, skip=False), 0
    for _ in range(250):
        seen = cube_in_clutter(rng, camera, things)
        found = whole.look(seen)
        assert part.look(seen) == found
        hits += found is not None
    assert 50 < hits < 200


def test_only_the_part_is_drawn_where_pictures_come_in_parts() -> None:
    """And the answer is that of the whole picture, which is not drawn."""
    rng, asked, eye = np.random.default_rng(10), [], FiducialEye(CAMERA, MARKER)
    for _ in range(50):
        seen = cube_in_clutter(rng, CAMERA)
        image: Any = seen.image

        def never() -> Image:
            raise AssertionError("the whole was drawn")

        def cut(part: Part, image: Any = image) -> Image:
            asked.append((part[2] - part[0]) * (part[3] - part[1]))
            return image()[part[1] : part[3], part[0] : part[2]]

        assert eye.look(replace(seen, image=Picture(never, cut))) == eye.look(seen)
    assert len(asked) > 25 and np.mean(asked) < 320 * 240 / 3


def test_a_picture_already_drawn_is_not_drawn_again_in_part() -> None:
    """Whoever looks on may have asked for the whole before."""
    rng, eye = np.random.default_rng(11), FiducialEye(CAMERA, MARKER)
    seen = next(seen for seen in (cube_in_clutter(rng, CAMERA) for _ in range(50)) if eye.look(seen))
    image: Any = seen.image
    picture = Picture(image, lambda part: np.zeros((part[3] - part[1], part[2] - part[0], 3), np.uint8))
    picture()
    assert eye.look(replace(seen, image=picture)) == eye.look(seen)


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
    ahead = cube_in_clutter(np.random.default_rng(11), CAMERA)
    with pytest.raises(ValueError, match=r"picture has shape .*was said to take \(240, 320, 3\)"):
        eye.look(replace(ahead, image=lambda: np.zeros(shape, np.uint8)))


def test_unknown_dictionary_is_answered_with_the_known_ones() -> None:
    """OpenCV's names."""
    with pytest.raises(ValueError, match=r"no tag dictionary 'DICT_9X9'. Available: .*DICT_4X4_50"):
        FiducialEye(CAMERA, Marker(dictionary="DICT_9X9"))


# -- in a description --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("skip", [True, False])
def test_kind_builds_it_for_a_bodys_camera_and_marker(skip: bool) -> None:
    """A body need know nothing else; without a view whole pictures are searched."""
    image = blank()
    paste(image, 3, 130, 90, 60)
    context: Any = SimpleNamespace(body=SimpleNamespace(camera=CAMERA, marker=MARKER))
    eye = EYES.settings("fiducial")(skip=skip).build(context)
    assert isinstance(eye, FiducialEye)
    found = eye.look(reading(image))
    assert found is not None and found.tag == 3


def test_settings_that_make_no_sense_are_refused() -> None:
    """A value of another type, and an unknown key."""
    for wrong in ({"skip": "now and then"}, {"skipped": True}):
        with pytest.raises(ValueError, match="skip"):
            TypeAdapter(Annotated[Any, EYES]).validate_python({"kind": "fiducial", **wrong})


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
