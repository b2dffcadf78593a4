"""Pictures that are not drawn: none of them would have shown a tag."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np
import pytest

from somatopy.bodies import MujocoBody
from somatopy.experiment.ceiling import Vantages
from somatopy.eyes import FiducialEye
from somatopy.eyes.frustum import may_be_seen, optics, part_with_tags
from somatopy.percept import Camera, Floats, Marker, View

CAMERA, MARKER = Camera("test", 320, 240, np.deg2rad(47.64)), Marker()
UPRIGHT = [1, 0, 0, 0, 1, 0, 0, 0, 1]


def marker_at(x: float, y: float, z: float) -> Floats:
    """A cube whose second tag looks back along the axis of a camera in the origin."""
    return np.array([x, y, z, *UPRIGHT], float)


def test_marker_before_the_camera_may_be_seen_and_others_not() -> None:
    """Behind, far to each side: no; in the middle, in each corner, half outside: maybe."""
    lens, cube = optics(CAMERA, MARKER)
    camera = marker_at(0, 0, 0)
    assert may_be_seen(camera, marker_at(0, 0, -0.3), lens, cube)
    assert not may_be_seen(camera, marker_at(0, 0, 0.3), lens, cube)
    for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        assert may_be_seen(camera, marker_at(0.13 * x, 0.09 * y, -0.3), lens, cube)
        assert not may_be_seen(camera, marker_at(0.4 * x, 0.4 * y, -0.3), lens, cube)


def test_end_faces_have_no_tag() -> None:
    """Seen along the axis that the four tags surround there is nothing to read."""
    lens, cube = optics(CAMERA, MARKER)
    along = np.array([0, 0, -0.3, 0, 0, 1, 0, 1, 0, -1, 0, 0], float)
    assert not may_be_seen(marker_at(0, 0, 0), along, lens, cube)


def cubes(rng: np.random.Generator, count: int) -> Iterator[Floats]:
    """Cubes around the view of a camera in the origin, turned anyhow."""
    for _ in range(count):
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        depth = rng.uniform(0.08, 1.0)
        place = depth * np.array([rng.uniform(-0.8, 0.8), rng.uniform(-0.6, 0.6), -1.0])
        yield np.concatenate([place, (turn * np.sign(np.linalg.det(turn))).ravel()])


def tags(marker: Floats) -> Iterator[Floats]:
    """Corners, going round, (4, 3) m, of the tags that are turned to a camera in the origin."""
    x, y, z = marker[3:].reshape(3, 3).T
    for normal, side in ((y, z), (z, -y), (-y, -z), (-z, y)):
        middle, half = marker[:3] + 0.5 * MARKER.size * normal, 0.5 * MARKER.tag_size
        if normal @ middle < 0:
            yield np.array([middle + half * (a * x + b * side) for a, b in ((1, 1), (1, -1), (-1, -1), (-1, 1))])


@pytest.mark.parametrize("size", [(320, 240), (160, 120), (240, 320)])
def test_part_holds_all_that_the_detector_looks_at(size: tuple[int, int]) -> None:
    """Around each tag in view: half a window of the threshold, 11 px, beyond outlines half a side away; or no picture.

    The part lies in the picture and is empty if and only if no tag may be seen.
    """
    camera, end, held = Camera("test", *size, np.deg2rad(47.64)), np.array(size) - 1, 0
    optic, origin = optics(camera, MARKER), marker_at(0, 0, 0)
    for marker in cubes(np.random.default_rng(4), 1500):
        left, top, right, bottom = part_with_tags(origin, marker, *optic)
        assert 0 <= left <= right <= size[0] and 0 <= top <= bottom <= size[1]
        assert may_be_seen(origin, marker, *optic) == (left < right and top < bottom)
        for x, y, z in (corners.T for corners in tags(marker)):
            pixels = np.array(camera.centre) + camera.focal * np.column_stack([x / -z, y / z])
            if (pixels >= 0).all() and (pixels <= end).all():
                reach = 11 + 0.125 * np.linalg.norm(pixels - np.roll(pixels, 1, axis=0), axis=1).sum()
                assert (np.array([left, top]) <= np.maximum(pixels.min(axis=0) - reach, 0)).all()
                assert (np.array([right, bottom]) > np.minimum(pixels.max(axis=0) + reach, end)).all()
                held += 1
    assert held > 300


def test_part_is_much_smaller_than_the_picture() -> None:
    """On the mean less than a third of it, where a tag may be seen."""
    optic = optics(CAMERA, MARKER)
    parts = [part_with_tags(marker_at(0, 0, 0), marker, *optic) for marker in cubes(np.random.default_rng(4), 500)]
    areas = [(right - left) * (bottom - top) for left, top, right, bottom in parts if right]
    assert len(areas) > 150 and np.mean(areas) < 320 * 240 / 3


@pytest.mark.parametrize("side", [20, 40, 80, 120, 160])
def test_tag_with_a_corner_outside_the_picture_is_never_read(side: int) -> None:
    """The fact that the test rests on, with a margin of a tenth of the picture: tags of all sizes over all borders."""
    rng, eye = np.random.default_rng(side), FiducialEye(CAMERA, MARKER)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    tag = np.pad(cv2.aruco.generateImageMarker(dictionary, 1, 60), 6, constant_values=255)
    square = np.array([[6, 6], [65, 6], [65, 65], [6, 65]], np.float32)
    read, inside = 0, 0
    for _ in range(300):
        turn, beyond, edge = rng.uniform(0, 2 * np.pi), rng.uniform(-0.15, 0.3) * side, rng.integers(4)
        axis = 0.5 * side * np.array([np.cos(turn), np.sin(turn)])
        around = np.array([a * axis + b * axis[::-1] * [-1, 1] for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
        way = ((-1, 0), (1, 0), (0, -1), (0, 1))[edge]
        middle = [159.5, 119.5] + ([159.5, 119.5][edge // 2] + beyond - (around @ way).max()) * np.array(way)
        warp = cv2.getPerspectiveTransform(square, (middle + around).astype(np.float32))
        image = cv2.warpPerspective(tag, warp, (320, 240), borderValue=200)
        found = bool(eye.detect(np.repeat(image[..., None], 3, axis=2)))
        read, inside = read + found, inside + (beyond < 0)
        assert not (found and beyond > 0)
    assert inside > 60 and read > (0.1 if side < 40 else 0.4) * inside


def postures(vantages: Vantages, rng: np.random.Generator, count: int) -> Iterator[tuple[Floats, Floats]]:
    """Arm and head postures: a third uniform, two thirds with the hand within or somewhat beyond the picture's edge."""
    body = vantages.body
    axes = -vantages.cameras[:, 5::3]
    for k in range(count):
        arm = rng.uniform(body.arm.lower, body.arm.upper)
        head = rng.uniform(body.head.lower, body.head.upper)
        if k % 3:
            ray = body.view(arm, head).marker[:3] - vantages.cameras[:, :3]
            nearest = ((axes * ray).sum(axis=1) / np.linalg.norm(ray, axis=1)).argmax()
            turn = rng.uniform(0, 2 * np.pi)
            head = vantages.heads[nearest] + rng.uniform(0.1, 0.7) * np.array([np.cos(turn), np.sin(turn)])
        yield arm, body.legal(head)


def is_out_of_picture(view: View, camera: Camera) -> bool:
    """Whether the ball around the cube is outside the cone around the picture's corners: no need to draw that."""
    corner = np.arctan(np.hypot(camera.width, camera.height) / 2 / camera.focal)
    distance = np.linalg.norm(view.marker[:3] - view.camera[:3])
    return bool(view.gaze_error > corner + np.arcsin(min(1.0, 0.5 * np.sqrt(3) * MARKER.size / distance)))


@pytest.mark.gl
def test_no_picture_with_a_tag_is_skipped() -> None:
    """Of 21,000 pictures, most with the hand near their edge, those skipped that can show the cube are searched."""
    body = MujocoBody("nao", "kinematic")
    eye, sizes = FiducialEye(body.camera, body.marker), optics(body.camera, body.marker)
    skipped = searched = 0
    for arm, head in postures(Vantages.of(body, (49, 15)), np.random.default_rng(5), 21_000):
        reading = body.place(arm, head)
        assert reading.view is not None and reading.image is not None
        if not may_be_seen(reading.view.camera, reading.view.marker, *sizes):
            skipped += 1
            if not is_out_of_picture(reading.view, body.camera):
                searched += 1
                assert not eye.detect(reading.image()), (arm, head)
    body.close()
    assert skipped > 10_000 and searched > 5_000
