"""A check that any eye keeps its contract."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace
from numbers import Integral, Real
from typing import Any

import numpy as np

from somatopy.contract import Eye, Recorded, check_members, facts, law, refused, same
from somatopy.percept import Column, Image, Reading, Sighting

__all__ = ["check_eye"]

Look = tuple[Reading, Sighting | None]


def check_eye(make: Callable[[], Eye], readings: Iterable[Reading]) -> None:
    """Check that an eye keeps its contract on some readings, and that its columns, if any, can be recorded.

    Args:
        make: makes a fresh eye.
        readings: readings of a body, some with the marker in view and some without. A generator that steps the body
            will do, since they are used one by one. Pictures that the eye asks for are kept.

    Raises:
        ContractError: it breaks a law; the message says which, what was seen and how to fix it.

    Example:
        >>> from somatopy.eyes import GeometricEye
        >>> from somatopy.percept import Camera, Marker, Shapes, View
        >>> import numpy as np
        >>> here = np.array([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1.0])
        >>> ahead, behind = (np.array([0, 0, z, 0, 0, 1, -1, 0, 0, 0, -1, 0]) for z in (-0.2, 0.2))
        >>> views, zero = [View(here, marker, np.empty((0, 12))) for marker in (ahead, behind)], np.zeros(2)
        >>> readings = [Reading(0.0, zero, zero, zero, zero, view=view) for view in views]
        >>> nothing = Shapes(np.empty(0, np.int64), np.empty((0, 4)))
        >>> check_eye(lambda: GeometricEye(Camera("eye", 320, 240, fovy=0.83), Marker(), nothing), readings)
    """
    eye = make()
    check_members(eye, Eye)
    records = _has_columns(eye)
    looks = [_look(eye, reading, records) for reading in readings]
    seen = sum(answer is not None for _, answer in looks)
    with law("the marker is seen in some readings and not in others", "give the check readings of both kinds") as holds:
        holds(0 < seen < len(looks), "the marker in {} of {}", seen, len(looks))
    _remembers_nothing(make, looks)
    with law("a reading without picture and view is refused", "raise a ValueError that says what is needed") as holds:
        holds(refused(lambda: eye.look(replace(looks[0][0], image=None, view=None))), "look() took one")


def _has_columns(eye: Any) -> bool:
    """Whether the eye has columns of its own in the record of frames; then they must be sound."""
    if not (hasattr(eye, "columns") or hasattr(eye, "probes")):
        return False
    check_members(eye, Recorded)
    names = [column.name for column in eye.columns]
    with law("each column has a name of its own", "rename one") as holds:
        holds(len(set(names)) == len(names), "columns {}", ", ".join(names))
    return True


def _probed(eye: Any) -> None:
    """Check the values of the eye's own columns after a look."""
    columns, values = {column.name: column for column in eye.columns}, eye.probes()
    with law("probes() gives a value for each of the columns and no other", "see Recorded") as holds:
        holds(values.keys() == columns.keys(), "{} for the columns {}", ", ".join(values), ", ".join(columns))
    with law("a probe is of the type that its column declares", "declare the other type, or convert it") as holds:
        for name, value in values.items():
            holds(_fits(columns[name], value), "{} is {!r}, declared as {}", name, value, columns[name].type)


def _fits(column: Column, value: object) -> bool:
    """Whether a value may stand in a column; a number that is missing is NaN."""
    if column.type == "bool" or isinstance(value, bool | np.bool_):
        return column.type == "bool" and isinstance(value, bool | np.bool_)
    return isinstance(value, Integral if column.type == "int" else Real)


def _look(eye: Eye, reading: Reading, records: bool) -> Look:
    """The answer, and the reading with its picture kept so that it can be looked at again."""
    drawn: list[Image] = []
    image = reading.image

    def draw() -> Image:
        if image is not None and not drawn:
            drawn.extend((image(), image().copy()))
        return drawn[0]

    kept = replace(reading, image=None if image is None else draw)
    with law("an eye leaves the reading alone, its picture too", "work on a copy: reading.image().copy()") as holds:
        before = facts(reading)
        answer = eye.look(kept)
        holds(same(facts(reading), before), "a vector or pose of the reading changed")
        holds(not drawn or same(*drawn), "the picture changed")
    with law("an eye gives None on a miss, else a Sighting, finite, with an area over 0", "see Sighting") as holds:
        holds(answer is None or _is_sound(answer), "{}", answer)
    if records:
        _probed(eye)
    return kept, answer


def _is_sound(sighting: object) -> bool:
    if not isinstance(sighting, Sighting):
        return False
    return all(map(math.isfinite, (*sighting.pixel, sighting.tag, sighting.area))) and sighting.area > 0


def _remembers_nothing(make: Callable[[], Eye], looks: list[Look]) -> None:
    eye = make()
    with law("an eye is pure: one reading, one answer", "keep nothing from one look to the next") as holds:
        for reading, answer in reversed(looks):
            for again in (eye.look(reading), eye.look(reading)):
                holds(again == answer, "at {} s {}, later {}", reading.time, answer, again)
