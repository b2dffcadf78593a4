"""Cameras, views and joint groups against geometry that is known by hand."""

from __future__ import annotations

from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from numpy.typing import ArrayLike

from somatopy.percept import Camera, JointGroup, Percept, Reading, View


def pose(position: ArrayLike, rotation: ArrayLike) -> np.ndarray:
    return np.concatenate([np.ravel(position), np.ravel(rotation)]).astype(float)


def view(marker: ArrayLike) -> View:
    """A camera at (1, 2, 3) that looks along the world's x, its own x along the world's -y."""
    looking = np.array([[0, 0, -1], [-1, 0, 0], [0, 1, 0]])
    return View(pose([1, 2, 3], looking), pose(marker, np.eye(3)), np.empty((0, 12)))


def test_focal_length_of_the_nao_camera() -> None:
    """47.64 degrees over 240 rows are 271.8 px, and half the height is seen at half the angle."""
    camera = Camera("bottom", 320, 240, np.deg2rad(47.64))
    assert camera.focal == pytest.approx(271.8, abs=0.1)
    assert np.arctan2(120, camera.focal) == pytest.approx(0.5 * camera.fovy)


def test_principal_point_counts_from_the_centre_of_the_first_pixel() -> None:
    """A picture of 320 x 240 has its centre between pixels 159 and 160, 119 and 120."""
    assert Camera("bottom", 320, 240, 1.0).centre == (159.5, 119.5)
    assert Camera("one", 1, 1, 1.0).centre == (0.0, 0.0)


@pytest.mark.parametrize(
    ("marker", "angle"),
    [([4, 2, 3], 0.0), ([2, 3, 3], 45.0), ([1, 2, 9], 90.0), ([0, 2, 2], 135.0), ([-5, 2, 3], 180.0)],
    ids=["ahead", "half left", "above", "behind and below", "behind"],
)
def test_gaze_error_is_the_angle_off_the_optical_axis(marker: ArrayLike, angle: float) -> None:
    """0 where the camera looks, 90 degrees beside it, 180 behind it, at any distance."""
    assert np.rad2deg(view(marker).gaze_error) == pytest.approx(angle, abs=1e-9)


def test_gaze_error_does_not_depend_on_the_roll_of_the_camera() -> None:
    """Turning the camera about its own axis leaves the angle as it was."""
    looked = view([3, 3, 4])
    turn = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]])
    rolled = View(pose(looked.camera[:3], looked.camera[3:].reshape(3, 3) @ turn), looked.marker, looked.occluders)
    assert rolled.gaze_error == pytest.approx(looked.gaze_error)


def test_length_of_a_joint_group_is_its_number_of_joints() -> None:
    """So that shapes can be checked against it."""
    assert len(JointGroup(("a", "b"), np.zeros(2), np.ones(2), np.ones(2))) == 2


def test_data_cannot_be_reassigned() -> None:
    """What one part hands to the next stays what it was."""
    nothing = np.zeros(2)
    for data in (Reading(0.0, nothing, nothing, nothing, nothing), Percept(0.0, nothing, nothing, nothing, nothing)):
        with pytest.raises(FrozenInstanceError):
            data.time = 1.0  # type: ignore[misc]
