"""What a description can say of a body: its kind, its camera and its marker, and what is refused."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from somatopy.bodies import Mujoco, MujocoBody
from somatopy.percept import Marker
from somatopy.registry import BODIES


def described(**table: Any) -> Any:
    return BODIES.validated({"kind": "mujoco", **table})


def built(arm_speed: float = 0.8, **table: Any) -> MujocoBody:
    body = described(**table).build(SimpleNamespace(arm_speed=arm_speed))
    assert isinstance(body, MujocoBody)
    return body


def test_kind_is_found_by_its_name() -> None:
    """A table with the kind alone is the NAO with physics."""
    assert described() == Mujoco() == Mujoco(model="nao", motion="dynamic")
    assert described().kind == "mujoco"


def test_table_is_given_back_whole() -> None:
    """What is written into a description is read as the same settings."""
    settings = described(motion="kinematic", head_speed=2, camera={"fovy": 60}, marker={"size": 0.04})
    assert BODIES.validated(BODIES.dumped(settings)) == settings


def test_without_settings_it_is_the_body_as_python_makes_it() -> None:
    """To the last bit: same model, speeds, camera and marker."""
    assert built(motion="kinematic").fingerprint() == MujocoBody("nao", "kinematic").fingerprint()
    assert built().marker == Marker()


def test_speeds_are_those_of_babbling_and_of_the_settings() -> None:
    """The arm's comes from the experiment, the head's from the table."""
    body = built(arm_speed=0.3, motion="kinematic", head_speed=0.6)
    start = body.reset()
    reading = body.step(start.arm + 1, [1, -0.3])
    np.testing.assert_allclose(np.abs(reading.arm - start.arm).max(), 0.3 / 15)
    np.testing.assert_allclose(reading.head - start.head, [0.6 / 15, -0.6 / 15])


@pytest.mark.parametrize("fovy", [30.0, 90.0])
def test_field_of_view_is_the_cameras(fovy: float) -> None:
    """In degrees, vertical, in the model that is drawn and in the camera that the eye is told of."""
    body = built(motion="kinematic", camera={"fovy": fovy})
    assert body.camera.fovy == pytest.approx(np.deg2rad(fovy))
    assert body.model.camera("CameraBottom").fovy[0] == pytest.approx(fovy)
    assert body.model.camera("CameraTop").fovy[0] == pytest.approx(47.64)


def test_cube_grows_with_its_tags() -> None:
    """The mesh that is drawn has the cube's size, and the tags keep their share of it."""
    body = built(motion="kinematic", marker={"size": 0.1})
    assert body.marker == Marker(size=0.1, tag_size=0.08)
    corners = body.model.mesh("somatopy_marker").vertadr[0]
    np.testing.assert_allclose(np.abs(body.model.mesh_vert[corners : corners + 24]), 0.05, rtol=1e-6)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"motion": "magic"}, "'dynamic' or 'kinematic'"),
        ({"head_speed": 0}, "greater than 0"),
        ({"head_speed": float("nan")}, "greater than 0"),
        ({"camera": {"fovy": 180}}, "less than 180"),
        ({"camera": {"fov": 60}}, "fov"),
        ({"marker": {"size": -0.05}}, "greater than 0"),
        ({"marker": {"tag": 0.05}}, "tag"),
    ],
)
def test_unfit_setting_is_refused(table: dict[str, Any], message: str) -> None:
    """Values out of range and unknown keys, those of inner tables too."""
    with pytest.raises(ValidationError, match=message):
        described(**table)
