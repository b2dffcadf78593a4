"""The columns in which frames are recorded."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from somatopy.contract import Body
from somatopy.percept import Column, JointGroup

__all__ = ["BEFORE", "BEHIND", "check_names", "vector_columns"]

#: Columns before the vectors.
BEFORE = (
    Column("frame", "int", "frame of the run, from 0", role="clock"),
    Column("phase", "int", "index of the phase, from 0", role="clock"),
    Column("time_s", "float", "robot time since reset, s", "s", "clock"),
)
#: Columns behind the vectors, before those that parts declare.
BEHIND = (
    Column("hit", "bool", "whether the marker was detected", role="sighting"),
    Column("pixel_u", "float", "column of the hand's centre in the image, px; NaN on a miss", "px", "sighting"),
    Column("pixel_v", "float", "row of the hand's centre in the image, px; NaN on a miss", "px", "sighting"),
    Column("tag", "int", "id of the tag that was read; -1 on a miss", role="sighting"),
    Column("tag_area", "float", "area of that tag in the image, px^2; NaN on a miss", "px^2", "sighting"),
    Column("overlap", "bool", "whether arm and head interpenetrate (their contact is off)", role="body"),
    Column(
        "gaze_error_rad",
        "float",
        "angle between the optical axis and the hand, rad; NaN where unknown",
        "rad",
        "body",
    ),
)
#: Vectors of a sense: what follows its name, the role, the meaning.
_VECTORS = (
    ("", "sensed", "sensed {} posture"),
    ("_command", "command", ""),
    ("_percept", "percept", "{} posture as the learner perceives it, after interventions"),
)
_COMMANDS = {
    "arm": "final target of the arm movement under way",
    "head": "head target of the frame before, after the body's clipping",
}


def vector_columns(body: Body) -> list[tuple[Column, str, str]]:
    """The columns of all vectors of a frame, each with its sense and the name of its joint.

    Their order is: sensed arm and head, commands of arm and head, percepts of arm and head.
    """
    senses: dict[str, JointGroup] = {"arm": body.arm, "head": body.head}
    return [
        (_vector(sense, f"{sense}{behind}.{name}", role, meaning, unit), sense, name)
        for behind, role, meaning in _VECTORS
        for sense, group in senses.items()
        for name, unit in zip(group.names, group.units, strict=True)
    ]


def _vector(sense: str, name: str, role: str, meaning: str, unit: str) -> Column:
    said = _COMMANDS[sense] if role == "command" else meaning.format(sense)
    return Column(name, "float", f"{said}, {unit}", unit, role)


def check_names(columns: Iterable[tuple[str, Column]]) -> None:
    """Check that no two columns have the same name.

    Args:
        columns: pairs of the part that declares a column, and the column.

    Raises:
        ValueError: two columns have the same name. The message names the parts that declare them.
    """
    every = [("a frame", column) for column in (*BEFORE, *BEHIND)] + list(columns)
    twice = [name for name, count in Counter(column.name for _, column in every).items() if count > 1]
    if twice:
        owners = " and ".join(dict.fromkeys(owner for owner, column in every if column.name == twice[0]))
        raise ValueError(f"the column {twice[0]!r} is declared twice, by {owners}; give one of them another name")
