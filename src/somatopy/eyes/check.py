"""The laws of eyes, tried on any implementation."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from copy import deepcopy
from dataclasses import replace

from somatopy.contract import law, missing, refused, same
from somatopy.eyes.base import Eye
from somatopy.percept import Image, Reading, Sighting

__all__ = ["check_eye"]


def check_eye(make: Callable[[], Eye], readings: Iterable[Reading]) -> None:
    """Check that an eye keeps its contract on some readings, in at least one of which it must see the marker.

    Args:
        make: a fresh eye.
        readings: a body's, with and without the marker in view. They are looked at one by one, so that a generator
            that steps the body may give them; a picture that the eye asks for is kept.

    Raises:
        ContractError: it breaks a law; the message says which, what was seen and how to fix it.

    Example:
        >>> from somatopy.eyes import GeometricEye
        >>> from somatopy.percept import Camera, Marker, Shapes, View
        >>> import numpy as np
        >>> here = np.array([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1.0])
        >>> ahead = np.array([0, 0, -0.2, 0, 0, 1, -1, 0, 0, 0, -1, 0])
        >>> behind = np.array([0, 0, 0.2, 0, 0, 1, -1, 0, 0, 0, -1, 0])
        >>> views, zero = [View(here, marker, np.empty((0, 12))) for marker in (ahead, behind)], np.zeros(2)
        >>> nothing = Shapes(np.empty(0, np.int64), np.empty((0, 4)))
        >>> check_eye(
        ...     lambda: GeometricEye(Camera("eye", 320, 240, fovy=0.83), Marker(), nothing),
        ...     [Reading(0.0, zero, zero, zero, zero, view=view) for view in views],
        ... )
    """
    with law("an eye has all members of Eye", "see somatopy.eyes.Eye") as holds:
        eye = make()
        holds(not missing(eye, Eye), "{} lacks {}", type(eye).__name__, missing(eye, Eye))
    looks = [_look(eye, reading) for reading in readings]
    seen = sum(answer is not None for _, answer in looks)
    with law("in some readings the marker is seen and in some it is not", "give it readings of both kinds") as holds:
        holds(0 < seen < len(looks), "the marker in {} of {}", seen, len(looks))
    _answers_without_memory(make, looks)
    with law(
        "a reading without picture and view is refused", "raise a ValueError that says what the eye needs"
    ) as holds:
        bare = replace(looks[0][0], image=None, view=None)
        holds(refused(lambda: eye.look(bare)), "look() took one")


def _look(eye: Eye, reading: Reading) -> tuple[Reading, Sighting | None]:
    """A reading that can be looked at again, and the answer: twice the same, well formed, and nothing changed by it."""
    drawn: list[Image] = []
    image = reading.image

    def draw() -> Image:
        if image is not None and not drawn:
            drawn.extend((image(), image().copy()))
        return drawn[0]

    kept = replace(reading, image=draw if image is not None else None)
    with law("an eye leaves the reading alone, its picture too", "work on a copy, for example image().copy()") as holds:
        before = _vectors(reading)
        answer = eye.look(kept)
        holds(same(_vectors(reading), before), "a vector of the reading changed")
        holds(not drawn or same(drawn[0], drawn[1]), "the picture changed")
    with law(
        "an eye gives None on a miss, else a Sighting with finite pixel, whole tag and area over 0", "see Sighting"
    ) as holds:
        holds(answer is None or _is_sound(answer), "{}", answer)
    return kept, answer


def _vectors(reading: Reading) -> dict[str, object]:
    view = {} if reading.view is None else vars(reading.view)
    return deepcopy({name: value for name, value in vars(reading).items() if name not in ("image", "view")} | view)


def _is_sound(sighting: object) -> bool:
    if not isinstance(sighting, Sighting):
        return False
    u, v = sighting.pixel
    return math.isfinite(u) and math.isfinite(v) and sighting.tag == int(sighting.tag) and 0 < sighting.area < math.inf


def _answers_without_memory(make: Callable[[], Eye], looks: list[tuple[Reading, Sighting | None]]) -> None:
    with law(
        "an eye is pure: the same reading gives the same answer", "keep nothing from one look to the next"
    ) as holds:
        eye = make()
        for reading, answer in reversed(looks):
            for name, again in (("another eye", eye.look(reading)), ("when asked again", eye.look(reading))):
                holds(again == answer, "at time {} {}, and {} {}", reading.time, answer, name, again)
