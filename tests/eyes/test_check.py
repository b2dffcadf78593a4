"""The laws of eyes: ours keep them, and an eye that breaks one is told which."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from somatopy.bodies import MujocoBody
from somatopy.contract import ContractError
from somatopy.eyes import FiducialEye, GeometricEye, check_eye
from somatopy.percept import Image, Reading, Sighting


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
        (Lenient, r"a reading without picture and view is refused.*look\(\) took one"),
    ],
)
def test_each_law_is_held(make: Any, message: str) -> None:
    """One eye that breaks each."""
    with pytest.raises(ContractError, match=message):
        check_eye(make, pictures())
