"""The cube of tags: drawn where its pose says, each face with its own tag, upright along the cube's x axis."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import mujoco
import numpy as np
import pytest

from somatopy.bodies.marker import SITE, add_marker, tag_atlas
from somatopy.bodies.rendering import Renderer
from somatopy.percept import Floats, Image, Marker

WIDTH, HEIGHT, FOVY = 320, 240, 47.64
SCENE = f"""
<mujoco>
  <statistic extent="1"/>
  <worldbody>
    <light pos=".5 0 1" dir="-.3 0 -1"/>
    <camera name="eye" pos="0 0 .2" fovy="{FOVY}"/>
    <body name="hand"><freejoint/><geom type="sphere" size=".01" mass="1"/></body>
  </worldbody>
</mujoco>"""


def face_corners(marker: Marker, face: int) -> Floats:
    """Tag corners in the cube's frame from the words of `Marker`: +y, +z, -y, -z, upper edge along +x, clockwise."""
    up, normal = np.eye(3)[0], np.array([[0, 1, 0], [0, 0, 1], [0, -1, 0], [0, 0, -1]])[face]
    right = np.cross(up, normal)
    edge = 0.5 * marker.tag_size
    around = [(1, -1), (1, 1), (-1, 1), (-1, -1)]
    return np.array([0.5 * marker.size * normal + edge * (a * up + b * right) for a, b in around])


def facing(face: int, roll: float, tilt: tuple[float, float]) -> Floats:
    """Rotation of a cube whose face looks at the camera above it, then rolls about the line of sight and tilts."""
    up, normal = np.eye(3)[0], np.array([[0, 1, 0], [0, 0, 1], [0, -1, 0], [0, 0, -1]])[face]
    upright = np.array([np.cross(up, normal), up, normal])
    turns = [cv2.Rodrigues(np.array(v, float))[0] for v in ([tilt[0], tilt[1], 0], [0, 0, roll])]
    return np.asarray(turns[0] @ turns[1] @ upright)


def detect(image: Image, dictionary: str = "DICT_4X4_50") -> dict[int, Floats]:
    tags = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    corners, ids, _ = cv2.aruco.ArucoDetector(tags).detectMarkers(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))
    return {} if ids is None else {int(k): c[0].astype(float) for k, c in zip(ids.ravel(), corners, strict=True)}


class Scene:
    """A free cube 20 cm under a camera that looks down."""

    def __init__(self, marker: Marker) -> None:
        spec = mujoco.MjSpec.from_string(SCENE)
        add_marker(spec, "hand", np.zeros(3), np.array([1.0, 0, 0]), marker)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.renderer = Renderer(self.model, "eye", WIDTH, HEIGHT)

    def draw(self, rotation: Floats, position: tuple[float, float, float] = (0, 0, 0)) -> Image:
        self.data.qpos[:3] = position
        mujoco.mju_mat2Quat(self.data.qpos[3:], rotation.ravel())
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)
        return self.renderer.render(self.data)

    def project(self, points: Floats) -> Floats:
        """Pixels of points in the cube's frame, by the pinhole model; the camera's axes are the world's."""
        site = self.data.site(SITE)
        seen = points @ site.xmat.reshape(3, 3).T + site.xpos - [0, 0, 0.2]
        focal = 0.5 * HEIGHT / np.tan(0.5 * np.deg2rad(FOVY))
        u, v = seen[:, 0] / -seen[:, 2], -seen[:, 1] / -seen[:, 2]
        return np.column_stack([0.5 * (WIDTH - 1) + focal * u, 0.5 * (HEIGHT - 1) + focal * v])


@pytest.fixture
def scene() -> Iterator[Scene]:
    made = Scene(Marker())
    yield made
    made.renderer.close()


@pytest.mark.gl
@pytest.mark.parametrize("face", range(4))
def test_each_face_shows_its_tag_where_geometry_says(scene: Scene, face: int) -> None:
    """Id, order of the corners and their pixels, turned, tilted and off the centre; the detector rounds to pixels."""
    rng, errors = np.random.default_rng(face), []
    for roll in np.deg2rad([0, 90, 180, 270, *rng.uniform(0, 360, 12)]):
        image = scene.draw(facing(face, roll, tuple(rng.uniform(-0.4, 0.4, 2))), (*rng.uniform(-0.02, 0.02, 2), 0.0))
        tags = detect(image)
        assert face in tags
        errors.append(np.linalg.norm(tags[face] - scene.project(face_corners(Marker(), face)), axis=1))
    assert np.mean(errors) < 1.0 and np.max(errors) < 2.5


@pytest.mark.gl
def test_edges_that_two_faces_share_show_both_tags(scene: Scene) -> None:
    """Seen edge on, the cube shows two neighbours, each within its own corners."""
    for face in range(4):
        turn = cv2.Rodrigues(np.array([0.0, np.pi / 4, 0.0]))[0]
        tags = detect(scene.draw(turn @ facing(face, 0.0, (0.0, 0.0))))
        neighbours = [k for k in range(4) if k in tags]
        assert len(neighbours) == 2 and face in neighbours
        for k in neighbours:
            assert np.abs(tags[k] - scene.project(face_corners(Marker(), k))).max() < 1.5


@pytest.mark.gl
@pytest.mark.parametrize("end", [1.0, -1.0])
def test_the_two_end_faces_show_no_tag(scene: Scene, end: float) -> None:
    """Along the cube's x axis there is nothing to find."""
    rotation = np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]]) if end < 0 else np.array([[0, 0, -1], [0, 1, 0], [1, 0, 0]])
    assert not detect(scene.draw(rotation.astype(float)))


@pytest.mark.gl
def test_other_sizes_ids_and_dictionaries_are_drawn() -> None:
    """The cube is what the Marker says."""
    marker = Marker(size=0.06, tag_size=0.036, ids=(7, 3, 11, 20), dictionary="DICT_4X4_100")
    other = Scene(marker)
    for face in range(4):
        tags = detect(other.draw(facing(face, 0.3, (0.1, 0.2))), "DICT_4X4_100")
        assert set(tags) == {marker.ids[face]}
        assert np.abs(tags[marker.ids[face]] - other.project(face_corners(marker, face))).max() < 1.5
    other.renderer.close()


@pytest.mark.parametrize("axis", [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, 0, -2), (1, 2, 3), (-1, 1e-6, 0)])
def test_cube_lies_along_its_axis(axis: tuple[float, float, float]) -> None:
    """Its x axis is the axis that is named, of any length, and its pose is a rotation."""
    spec = mujoco.MjSpec.from_string(SCENE)
    add_marker(spec, "hand", np.array([0.1, 0.2, 0.3]), np.array(axis, float), Marker())
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    for pose in (data.site(SITE), data.geom(SITE)):
        rotation = pose.xmat.reshape(3, 3)
        np.testing.assert_allclose(pose.xpos, [0.1, 0.2, 0.3], atol=1e-9)
        np.testing.assert_allclose(rotation.T @ rotation, np.eye(3), atol=1e-9)
        np.testing.assert_allclose(rotation[:, 0], np.array(axis) / np.linalg.norm(axis), atol=1e-5)


def test_cube_weighs_nothing_and_touches_nothing() -> None:
    """The robot moves as it would without it."""
    spec = mujoco.MjSpec.from_string(SCENE)
    before = spec.copy().compile()
    add_marker(spec, "hand", np.zeros(3), np.array([1.0, 0, 0]), Marker())
    after = spec.compile()
    np.testing.assert_array_equal(after.body_mass, before.body_mass)
    np.testing.assert_array_equal(after.body_inertia, before.body_inertia)
    cube = after.geom(SITE)
    assert cube.contype[0] == 0 and cube.conaffinity[0] == 0


def test_atlas_keeps_the_white_margin_around_each_tag() -> None:
    """Four square pictures side by side: white edge, then the tag's black border."""
    marker = Marker()
    atlas = tag_atlas(marker)
    face = atlas.shape[0]
    assert atlas.shape == (face, 4 * face, 3)
    margin = round(0.5 * face * (1 - marker.tag_size / marker.size))
    for k in range(4):
        picture = atlas[:, k * face : (k + 1) * face, 0]
        assert (picture[: margin - 1] == 255).all() and (picture[:, : margin - 1] == 255).all()
        assert (picture[margin + 1, margin + 1 : face - margin - 1] == 0).all()
