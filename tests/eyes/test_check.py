"""The laws of eyes: ours keep them, and an eye that breaks one is told which."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from somatopy.bodies import MujocoBody
from somatopy.contract import ContractError
from somatopy.eyes import FiducialEye, GeometricEye, check_eye
from somatopy.percept import Column, Image, Reading, Sighting


@pytest.fixture(scope="module")
def body() -> Iterator[MujocoBody]:
    body = MujocoBody("nao", motion="kinematic")
    yield body
    body.close()


def babbled(body: MujocoBody) -> Iterator[Reading]:
    """Readings while arm and head move from one random posture to the next; the body stands still in between."""
    rng, reading = np.random.default_rng(0), body.reset()
    for k in range(60):
        if k % 10 == 0:
            arm, head = (rng.uniform(group.lower, group.upper) for group in (body.arm, body.head))
        yield reading
        reading = body.step(arm, head)


def test_the_geometric_eye_keeps_them(body: MujocoBody) -> None:
    """From poses."""
    check_eye(lambda: GeometricEye(body.camera, body.marker, body.occluders), babbled(body))


@pytest.mark.gl
def test_the_fiducial_eye_keeps_them(body: MujocoBody) -> None:
    """From pictures."""
    check_eye(lambda: FiducialEye(body.camera, body.marker), babbled(body))


def pictures() -> list[Reading]:
    """A bright spot somewhere, or none."""
    zero, found = np.zeros(2), []
    for k in range(6):
        image = np.zeros((24, 32, 3), np.uint8)
        image[k, 2 * k] = 255 * (k % 2)
        found.append(Reading(k / 15, zero, zero, zero, zero, image=lambda image=image: image))
    return found


class Spot:
    """A sound eye for them."""

    def look(self, reading: Reading) -> Any:
        if reading.image is None:
            raise ValueError("needs pictures")
        return self.find(reading.image()[..., 0])

    def find(self, image: Image) -> Any:
        v, u = np.unravel_index(image.argmax(), image.shape)
        return Sighting((float(u), float(v)), 0, 1.0) if image[v, u] else None


class Blind:
    pass


class Closed(Spot):
    def find(self, image: Image) -> Any:
        return None


class Painting(Spot):
    def find(self, image: Image) -> Any:
        found = super().find(image)
        image[0, 0] = 7
        return found


class Turning(Spot):
    def look(self, reading: Reading) -> Any:
        reading.head[:] += 1.0
        return super().look(reading)


class Pairs(Spot):
    def find(self, image: Image) -> Any:
        found = super().find(image)
        return found and found.pixel


class Unbounded(Spot):
    def find(self, image: Image) -> Any:
        return super().find(image) and Sighting((np.inf, 0.0), 0, 1.0)


class Flat(Spot):
    def find(self, image: Image) -> Any:
        return super().find(image) and Sighting((1.0, 0.0), 0, 0.0)


class Lagging(Spot):
    last: Any = None

    def find(self, image: Image) -> Any:
        before, self.last = self.last, super().find(image)
        return before


class Lenient(Spot):
    def look(self, reading: Reading) -> Any:
        return None if reading.image is None else super().look(reading)


class Counting(Spot):
    """A sound eye that records how bright its spot was, how many pixels were, and whether any was."""

    columns: Any = (
        Column("brightness", "float", "of the brightest pixel"),
        Column("bright", "int", "pixels of that brightness"),
        Column("lit", "bool", "whether it is not dark"),
    )

    def find(self, image: Image) -> Any:
        self.seen = image.max() / 255, int((image == image.max()).sum()), bool(image.any())
        return super().find(image)

    def probes(self) -> Any:
        return dict(zip(("brightness", "bright", "lit"), self.seen, strict=True))


class Twice(Counting):
    columns = (*Counting.columns, Column("lit", "bool", "the same again"))


class Mute(Spot):
    columns = Counting.columns


class Chatty(Counting):
    def probes(self) -> Any:
        return {**super().probes(), "more": 0.0}


class Silent(Counting):
    def probes(self) -> Any:
        return {"lit": self.seen[2]}


class Fractional(Counting):
    def probes(self) -> Any:
        return {**super().probes(), "bright": 0.5}


class Truthful(Counting):
    def probes(self) -> Any:
        return {**super().probes(), "bright": True}


class Numeric(Counting):
    def probes(self) -> Any:
        return {**super().probes(), "lit": 1}


def test_an_eye_with_columns_of_its_own_passes() -> None:
    """Floats, ints and truth values, NumPy's as well."""
    check_eye(Counting, pictures())


def test_another_sound_eye_passes() -> None:
    """One that finds bright spots."""
    check_eye(Spot, pictures())


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (Blind, "all members of Eye.*Blind lacks look"),
        (Closed, r"seen in some readings and not in others\. Seen: the marker in 0 of 6"),
        (Painting, "leaves the reading alone, its picture too.*the picture changed"),
        (Turning, "leaves the reading alone.*a vector or pose of the reading changed"),
        (Pairs, r"None on a miss, else a Sighting.*Seen: \(2.0, 1.0\)"),
        (Unbounded, "None on a miss, else a Sighting, finite"),
        (Flat, "with an area over 0"),
        (Lagging, "an eye is pure: one reading, one answer"),
        (Twice, r"each column has a name of its own\. Seen: columns brightness, bright, lit, lit"),
        (Mute, "all members of Recorded.*Mute lacks probes"),
        (Chatty, "for each of the columns and no other.*brightness, bright, lit, more for the columns"),
        (Silent, "for each of the columns and no other.*Seen: lit for the columns brightness, bright, lit"),
        (Fractional, "of the type that its column declares.*bright is 0.5, declared as int"),
        (Truthful, "of the type that its column declares.*bright is True, declared as int"),
        (Numeric, "of the type that its column declares.*lit is 1, declared as bool"),
        (Lenient, r"a reading without picture and view is refused.*look\(\) took one"),
    ],
)
def test_each_law_is_held(make: Any, message: str) -> None:
    """One eye that breaks each."""
    with pytest.raises(ContractError, match=message):
        check_eye(make, pictures())
