"""What a run folder's columns are, as their Parquet metadata tells; no name of a column is ever taken apart."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["ColumnOfRun", "Role", "described", "readable", "vector_of", "vectors_there"]

#: What a vector of joints can be: where they are, where they were sent, and where the learner perceives them to be.
Role = Literal["sensed", "command", "percept"]


@dataclass(frozen=True)
class ColumnOfRun:
    """A recorded column.

    Attributes:
        name: its name.
        role: what kind of thing it is, such as "sensed" or "probe".
        unit: unit of its values: "rad", or "1" for shares of a joint's whole range; "" for pure numbers.
        meaning: what its values mean.
        sense: the sense whose vector it belongs to, such as "arm"; "" for single values.
        label: which value of that vector it is: the joint's name; "" for single values.
    """

    name: str
    role: str = ""
    unit: str = ""
    meaning: str = ""
    sense: str = ""
    label: str = ""


def described(schema: pa.Schema) -> tuple[ColumnOfRun, ...]:
    """The columns of a part of frames/, in order; what their metadata does not tell is ""."""
    keys = ("role", "unit", "meaning", "sense", "label")
    told = [{k.decode(): v.decode(errors="replace") for k, v in (field.metadata or {}).items()} for field in schema]
    return tuple(
        ColumnOfRun(field.name, **{key: values.get(key, "") for key in keys})
        for field, values in zip(schema, told, strict=True)
    )


def vector_of(columns: Sequence[ColumnOfRun], sense: str, role: str) -> list[ColumnOfRun]:
    """The columns that make a sense's vector, in its order.

    Example:
        >>> columns = [ColumnOfRun("arm.elbow", "sensed", sense="arm", label="elbow"), ColumnOfRun("hit")]
        >>> [column.label for column in vector_of(columns, "arm", "sensed")]
        ['elbow']
    """
    return [column for column in columns if column.sense == sense != "" and column.role == role]


def vectors_there(columns: Sequence[ColumnOfRun]) -> str:
    """The senses that have vectors, and in which roles, for an error that says what there is.

    Example:
        >>> arm = [ColumnOfRun(f"{role}.elbow", role, sense="arm", label="elbow") for role in ("sensed", "command")]
        >>> vectors_there(arm), vectors_there([])
        ('arm (sensed, command)', 'none')
    """
    senses = {column.sense: dict[str, None]() for column in columns if column.sense}
    for column in columns:
        if column.sense:
            senses[column.sense][column.role] = None
    return ", ".join(f"{sense} ({', '.join(roles)})" for sense, roles in senses.items()) or "none"


def readable(unit: str) -> tuple[float, str]:
    """By what to multiply values of a unit for a reader, and what to write behind them: angles are shown in degrees.

    Example:
        >>> readable("m"), readable("rad")[1], round(readable("rad")[0], 2)
        ((1.0, 'm'), '°', 57.3)
    """
    return (math.degrees(1.0), "°") if unit == "rad" else (1.0, unit)
