"""Pictures of a run: what the robot's camera saw in some of its frames, drawn again from the recorded postures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from somatopy.bodies import MujocoBody
from somatopy.experiment.description import Description
from somatopy.eyes import FiducialEye
from somatopy.percept import Floats, Image

__all__ = ["Photograph", "photographs", "portrait"]


@dataclass(frozen=True)
class Photograph:
    """A picture and what the detector found in it.

    Attributes:
        image: RGB, shape (height, width, 3).
        tags: corners of each tag, (4, 2) px, by its id.
        pixel: the hand's centre (u, v), px, or None on a miss.
    """

    image: Image
    tags: dict[int, Floats]
    pixel: tuple[float, float] | None


def photographs(description: Description, arms: Sequence[ArrayLike], heads: Sequence[ArrayLike]) -> list[Photograph]:
    """What the robot sees at these postures.

    Args:
        description: names the robot.
        arms: arm postures, each (n_arm,), rad.
        heads: head postures, each (n_head,), rad.
    """
    body = MujocoBody(description.body.model, motion="kinematic", arm_speed=None)
    eye = FiducialEye(body.camera, body.marker, skip=False)
    taken = []
    for arm, head in zip(arms, heads, strict=True):
        reading = body.place(arm, head)
        seen = eye.look(reading)
        image = body.picture()
        taken.append(Photograph(image, eye.detect(image), seen.pixel if seen else None))
    body.close()
    return taken


def portrait(description: Description, arm: ArrayLike, head: ArrayLike, size: tuple[int, int] = (720, 720)) -> Image:
    """The robot in a posture, finely drawn, from the model's camera named `outside`, (height, width, 3).

    Raises:
        BodyError: the model has no such camera.
    """
    body = MujocoBody(description.body.model, motion="kinematic", arm_speed=None)
    body.place(arm, head)
    body.model.vis.quality.numslices, body.model.vis.quality.numstacks = 64, 32
    image = np.array(body.picture("outside", *size))
    body.close()
    return image
