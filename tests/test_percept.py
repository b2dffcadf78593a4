"""Cameras and views against geometry that is known by hand; senses, columns, pictures and percepts."""

from __future__ import annotations

from dataclasses import FrozenInstanceError, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

from somatopy.percept import Camera, Column, JointGroup, Percept, Picture, Reading, Robot, Space, View


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


def test_a_picture_is_drawn_once_and_its_parts_are_cut_from_it() -> None:
    """However often whole and parts are asked for."""
    rows = np.arange(60, dtype=np.uint8).reshape(4, 5, 3)
    drawn: list[int] = []
    picture = Picture(lambda: drawn.append(1) or rows)  # type: ignore[func-returns-value]
    assert not picture.comes_in_parts
    np.testing.assert_array_equal(picture.part(1, 0, 4, 3), rows[0:3, 1:4])
    assert picture() is rows and picture() is rows and picture.part(0, 0, 5, 4).shape == rows.shape
    assert len(drawn) == 1 and picture.seconds > 0


def test_a_picture_that_comes_in_parts_draws_only_what_is_asked_for() -> None:
    """The part alone while the whole is not drawn, and nothing once it is; both count as drawing."""
    asked: list[object] = []

    def draw(part: object = "whole") -> np.ndarray:
        asked.append(part)
        return np.zeros((2, 2, 3), np.uint8)

    picture = Picture(draw, draw)
    picture.part(1, 2, 3, 4)
    before = picture.seconds
    assert picture.comes_in_parts and asked == [(1, 2, 3, 4)] and before > 0
    picture()
    picture.part(0, 0, 1, 1)
    assert asked == [(1, 2, 3, 4), "whole"] and picture.seconds > before


# -- senses ----------------------------------------------------------------------------------------------------------


def space(**changes: Any) -> Space:
    return Space(**{"names": ["yaw", "pitch"], "lower": [-2.0, -0.6], "upper": [2.0, 0.5], **changes})


def test_a_space_is_what_it_was_made_from() -> None:
    """Names, limits of each value and unit; radians where nobody says."""
    head = space()
    assert (head.names, head.lower.tolist(), head.upper.tolist(), head.unit) == (
        ("yaw", "pitch"),
        [-2.0, -0.6],
        [2.0, 0.5],
        "rad",
    )
    assert len(head) == 2 and head.limits.tolist() == [[-2.0, 2.0], [-0.6, 0.5]]
    assert space(unit="m").unit == "m"


def test_later_changes_of_its_arrays_do_not_reach_a_space() -> None:
    """It copies them, and gives none away that could be changed."""
    lower, upper = np.array([-2.0, -0.6]), np.array([2.0, 0.5])
    head = space(lower=lower, upper=upper)
    lower[:], upper[:] = -9, 9
    head.limits[:] = 7
    assert head.limits.tolist() == [[-2.0, 2.0], [-0.6, 0.5]]
    for limits in (head.lower, head.upper):
        with pytest.raises(ValueError, match="read-only"):
            limits[0] = 0.0
    with pytest.raises(FrozenInstanceError):
        head.unit = "m"  # type: ignore[misc]


@pytest.mark.parametrize(
    "changes",
    [
        {"names": ["yaw"]},
        {"lower": [-2.0]},
        {"upper": [2.0, 0.5, 1.0]},
        {"lower": -2.0, "upper": 2.0},
        {"lower": [[-2.0, -0.6]], "upper": [[2.0, 0.5]]},
        {"lower": [2.0, -0.6], "upper": [-2.0, 0.5]},
        {"lower": [-2.0, 0.5]},
        {"upper": [np.nan, 0.5]},
    ],
)
def test_limits_that_do_not_fit_are_refused(changes: dict[str, Any]) -> None:
    """Another number of them than of names, equal or swapped ones, NaN: names and both limits are in the message."""
    with pytest.raises(
        ValueError, match=r"a lower limit below an upper one for each of its names \['yaw'.*; got .* and "
    ):
        space(**changes)


def test_a_joint_group_is_a_space_of_its_postures() -> None:
    """Names and limits in the same order, in radians; speeds are not a learner's business."""
    group = JointGroup(("a", "b"), np.array([-1.0, 0.0]), np.array([1.0, 2.0]), np.array([8.0, 9.0]))
    assert (group.space.names, group.space.unit) == (("a", "b"), "rad")
    assert group.space.limits.tolist() == [[-1.0, 1.0], [0.0, 2.0]]


def test_a_robots_arm_and_head_are_senses_of_it() -> None:
    """By name as by attribute, whatever else it senses."""
    arm, head, torso = space(names="ab"), space(), Space(("lean",), [-0.1], [0.1])
    robot = Robot({"torso": torso, "head": head, "arm": arm}, ("head",), Camera("eye", 320, 240, 0.83))
    assert robot.arm is robot.senses["arm"] is arm and robot.head is robot.senses["head"] is head
    assert robot.senses["torso"] is torso and robot.moves == ("head",)


def test_columns_of_parts_are_probes_without_a_unit() -> None:
    """Unless they say otherwise; equal ones are equal."""
    column = Column("winner", "int", "the winner")
    assert (column.unit, column.role) == ("", "probe")
    assert column == Column("winner", "int", "the winner") != replace(column, unit="rad")


@pytest.mark.parametrize("unknown", ["integer", "", float])
def test_a_column_of_an_unknown_type_is_refused(unknown: Any) -> None:
    """When it is made, and so before a run begins; the error names the column, the value and what is valid."""
    with pytest.raises(ValueError, match="'winner'") as caught:
        Column("winner", unknown, "the winner")
    assert repr(unknown) in str(caught.value) and "one of 'float', 'int', 'bool'" in str(caught.value)


# -- pictures --------------------------------------------------------------------------------------------------------


class Drawing:
    """Draws numbered pixels, and remembers what it was asked for."""

    def __init__(self) -> None:
        self.pixels = np.arange(4 * 6 * 3, dtype=np.uint8).reshape(4, 6, 3)
        self.asked: list[Any] = []

    def whole(self) -> Any:
        self.asked.append("whole")
        return self.pixels.copy()

    def part(self, part: tuple[int, int, int, int]) -> Any:
        self.asked.append(part)
        left, top, right, bottom = part
        return self.pixels[top:bottom, left:right].copy()


def test_a_picture_is_drawn_once_and_not_before_it_is_asked_for() -> None:
    """The same array each time, parts are cut from it; drawing takes time, looking again takes none."""
    drawing = Drawing()
    picture = Picture(drawing.whole)
    assert drawing.asked == [] and picture.seconds == 0.0
    first = picture()
    took = picture.seconds
    assert took > 0 and picture() is first
    assert np.array_equal(picture.part(1, 2, 5, 4), drawing.pixels[2:4, 1:5])
    assert drawing.asked == ["whole"] and picture.seconds == took


def test_a_part_is_drawn_alone_where_that_is_possible() -> None:
    """The whole is not drawn for it, and the time counts; once the whole is there, parts are cut from it."""
    drawing = Drawing()
    picture = Picture(drawing.whole, drawing.part)
    assert picture.comes_in_parts and not Picture(drawing.whole).comes_in_parts
    assert np.array_equal(picture.part(1, 2, 5, 4), drawing.pixels[2:4, 1:5])
    assert drawing.asked == [(1, 2, 5, 4)]
    before = picture.seconds
    assert before > 0
    whole = picture()
    assert picture.seconds > before and np.array_equal(whole, drawing.pixels)
    assert np.array_equal(picture.part(0, 0, 6, 1), drawing.pixels[:1])
    assert drawing.asked == [(1, 2, 5, 4), "whole"]


def test_without_parts_a_part_is_cut_from_the_whole() -> None:
    """Which is drawn for it, once."""
    drawing = Drawing()
    picture = Picture(drawing.whole)
    for _ in range(2):
        assert np.array_equal(picture.part(0, 1, 2, 3), drawing.pixels[1:3, :2])
    assert drawing.asked == ["whole"]


# -- percepts --------------------------------------------------------------------------------------------------------


def test_a_percept_has_a_vector_for_each_sense() -> None:
    """By name: the attributes, the efference copies, and further senses; the very same arrays."""
    arm, head, arm_command, head_command, torso = (np.full(2, float(k)) for k in range(5))
    percept = Percept(0.0, arm, head, arm_command, head_command, more={"torso": torso})
    assert percept["arm"] is percept.arm is arm and percept["head"] is percept.head is head
    assert percept["arm_command"] is arm_command and percept["head_command"] is head_command
    assert percept["torso"] is torso


@pytest.mark.parametrize("sense", ["legs", "sighting", "time", "more", ""])
def test_a_sense_that_is_not_there_is_answered_with_those_that_are(sense: str) -> None:
    """What is no vector is no sense either."""
    zero = np.zeros(2)
    percept = Percept(0.0, zero, zero, zero, zero, more={"torso": zero})
    expected = f"This percept has no sense {sense!r}; it has arm, head, arm_command, head_command, torso."
    with pytest.raises(KeyError) as caught:
        percept[sense]
    assert caught.value.args == (expected,)


def test_percepts_share_no_further_senses() -> None:
    """Nobody can add one to all percepts that have none."""
    zero = np.zeros(2)
    with pytest.raises(TypeError):
        Percept(0.0, zero, zero, zero, zero).more["torso"] = zero  # type: ignore[index]
    with pytest.raises(KeyError):
        Percept(0.0, zero, zero, zero, zero)["torso"]
