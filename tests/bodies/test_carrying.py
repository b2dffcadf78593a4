"""The arm carries the marker, the head the camera, and neither both."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from somatopy.bodies import BodyError, MujocoBody

Robot = Callable[..., Path]
WAIST = (
    '<body name="post" pos="0 0 .5">',
    '<body name="post" pos="0 0 .5"><joint name="waist" range="-1 1"/><geom size=".05"/>',
)
BOOM, JIB_END = '<body name="boom">', '<geom type="capsule" fromto="0 0 0 .1 0 0" size=".02" mass=".02"/>'
IN_HAND = (JIB_END, JIB_END + '<camera name="wrist"/>')


@pytest.mark.parametrize(
    ("mjcf", "anatomy", "message"),
    [
        (
            ("", ""),
            ('body = "jib"', 'body = "face"'),
            r"'face' moves with none of the arm's joints \['lift', 'swing'\]",
        ),
        (("", ""), ('body = "jib"', 'body = "post"'), r"'post' moves with none of .*no joint moves it"),
        (
            IN_HAND,
            ('name = "eye"', 'name = "wrist"'),
            r"camera 'wrist', on the body 'jib', moves with none of the head",
        ),
        (WAIST, ('["pan", "tilt"]', '["waist", "tilt"]'), r"'jib' moves with the head's joints \['waist'\].*\[head\]"),
        (WAIST, ('["lift", "swing"]', '["waist", "swing"]'), r"'eye', .*moves with the arm's joints \['waist'\]"),
    ],
    ids=["marker on head", "marker on post", "eye in hand", "waist as head", "waist as arm"],
)
@pytest.mark.parametrize("motion", ["dynamic", "kinematic"])
def test_other_chains_are_refused(
    robot: Robot, mjcf: tuple[str, str], anatomy: tuple[str, str], message: str, motion: str
) -> None:
    """One sentence says what moves with what, and another what to write."""
    with pytest.raises(BodyError, match=message):
        MujocoBody(robot(mjcf=mjcf, anatomy=anatomy), motion=motion)  # type: ignore[arg-type]


def test_waist_that_is_neither_arm_nor_head_is_allowed(robot: Robot) -> None:
    """It carries both, but nobody commands it."""
    assert MujocoBody(robot(mjcf=WAIST), motion="kinematic").reset().arm.tolist() == [0, 0]
