"""The robots in examples/robots: each has its page, and as a body keeps every law; the page of the anatomy is whole."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from somatopy.bodies import Anatomy, MujocoBody, check_body
from somatopy.bodies.tables import AddedCamera, CameraTable, Coupling, Head, MarkerTable, Neck, Servo
from somatopy.eyes import FiducialEye, GeometricEye, check_eye
from somatopy.percept import Reading

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "examples" / "robots"
ROBOTS = sorted(path.stem for path in FOLDER.glob("*.toml"))
#: What a file can say: the tables of the format, and the tables in them.
TABLES = (Anatomy, Head, Coupling, CameraTable, MarkerTable, Neck, AddedCamera, Servo)


def page_of_the_format() -> str:
    """The whole anatomy file that docs/anatomy.md shows."""
    page = (ROOT / "docs" / "anatomy.md").read_text(encoding="utf-8")
    return page.split("```toml\n")[1].split("```")[0]


def test_the_page_of_the_format_shows_a_robot_that_works(tmp_path: Path) -> None:
    """Its file is read, builds a robot with physics, and its eye is where it says: on the mast, looking ahead."""
    path = tmp_path / "page.toml"
    path.write_text(page_of_the_format(), encoding="utf-8")
    with closing(MujocoBody(path)) as body:
        start = body.reset()
        assert body.head.names == ("pan", "tilt") and (body.camera.width, body.camera.height) == (640, 480)
        assert start.view is not None
        torso = body.data.body("torso").xpos
        np.testing.assert_allclose(start.view.camera[:3] - torso, [-0.03, 0, 0.35], atol=1e-9)
        np.testing.assert_allclose(-start.view.camera[5::3], [1, 0, 0], atol=1e-9)


def test_the_page_of_the_format_shows_every_key() -> None:
    """Also those that come later: a key without a line in the file is not documented."""
    shown = set(re.findall(r"^(?:# )?\[?(?:\w+\.)?(\w+)\]?", page_of_the_format(), re.MULTILINE))
    shown |= set(re.findall(r"(\w+) = ", page_of_the_format()))
    keys = {key for table in (*TABLES, type(Anatomy.model_fields["add"].default)) for key in table.model_fields}
    assert keys - shown == set()


@pytest.mark.parametrize("robot", ROBOTS)
def test_each_robot_has_its_page(robot: str) -> None:
    """The anatomy is valid; its page says how to install and run it, shows it, and the table has it."""
    anatomy = Anatomy.model_validate(tomllib.loads((FOLDER / f"{robot}.toml").read_text(encoding="utf-8")))
    page = (FOLDER / f"{robot}.md").read_text(encoding="utf-8")
    assert page.startswith(f"# {anatomy.name}\n")
    assert "pip install" in page and f"--body.model examples/robots/{robot}.toml" in page and "Licence" in page
    assert f"(img/{robot}.jpg)" in page and (FOLDER / "img" / f"{robot}.jpg").is_file()
    assert f"| [{anatomy.name}]({robot}.md) |" in (FOLDER / "README.md").read_text(encoding="utf-8")


@pytest.fixture(params=ROBOTS)
def body(request: pytest.FixtureRequest) -> Iterator[MujocoBody]:
    """Each robot, with physics."""
    with closing(MujocoBody(FOLDER / f"{request.param}.toml")) as made:
        yield made


@pytest.mark.robots
@pytest.mark.gl
def test_each_robot_keeps_the_laws_of_bodies(body: MujocoBody) -> None:
    """With physics and pictures."""
    check_body(body.another, pictures=True)


@pytest.mark.robots
@pytest.mark.gl
def test_both_eyes_keep_their_laws_on_each_robot(body: MujocoBody) -> None:
    """On postures from which the geometric eye says that the hand is seen, and as many from which it is not."""
    geometric = GeometricEye(body.camera, body.marker, body.occluders)
    arm, heads = body.reset().arm, np.random.default_rng(0).uniform(*body.head.space.limits.T, (600, len(body.head)))
    seen = [geometric.find(body.view(arm, head)) is not None for head in heads]
    some = [*heads[seen][:6], *heads[~np.array(seen)][:6]]

    def readings() -> Iterator[Reading]:
        return (body.place(arm, head) for head in some)

    check_eye(lambda: GeometricEye(body.camera, body.marker, body.occluders), readings())
    check_eye(lambda: FiducialEye(body.camera, body.marker), readings())


@pytest.mark.robots
def test_each_robot_babbles_where_it_is_told(body: MujocoBody) -> None:
    """Its servos bring it to targets in its range, but for what its load and the friction of its joints take."""
    for arm in np.random.default_rng(0).uniform(*body.ranges["confined"].T, (4, 4)):
        for _ in range(60):
            reading = body.step(arm, body.legal(np.zeros(len(body.head))))
        np.testing.assert_allclose(reading.arm, arm, atol=0.08)
