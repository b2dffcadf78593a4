"""Pictures of a run: what the robot's camera saw in some of its frames, drawn again from the recorded postures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from somatopy.bodies import BodyError
from somatopy.contract import Posable
from somatopy.experiment.context import Context
from somatopy.experiment.description import Description
from somatopy.eyes import FiducialEye
from somatopy.percept import Floats, Image
from somatopy.registry import BODIES, Settings

__all__ = ["Photograph", "photographs", "portrait", "posed"]


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


def photographs(
    body: Settings | Mapping[str, Any], arms: Sequence[ArrayLike], heads: Sequence[ArrayLike]
) -> list[Photograph]:
    """What the robot sees at these postures.

    Args:
        body: the robot, as a description has it.
        arms: arm postures, each (n_arm,), rad.
        heads: head postures, each (n_head,), rad.

    Raises:
        BodyError: the robot cannot be put into postures at once.
    """
    taken = []
    with posed(body) as robot:
        eye = FiducialEye(robot.camera, robot.marker, skip=False)
        for arm, head in zip(arms, heads, strict=True):
            seen = eye.look(robot.place(arm, head))
            image = robot.picture()
            taken.append(Photograph(image, eye.detect(image), seen.pixel if seen else None))
    return taken


def portrait(
    body: Settings | Mapping[str, Any], arm: ArrayLike, head: ArrayLike, size: tuple[int, int] = (720, 720)
) -> Image:
    """The robot in a posture, finely drawn, from the model's camera named `outside`, (height, width, 3).

    Raises:
        BodyError: the model has no such camera, or the robot cannot be put into postures at once.
    """
    with posed(body) as robot:
        robot.place(arm, head)
        if hasattr(robot, "model"):  # round shapes of many faces
            robot.model.vis.quality.numslices, robot.model.vis.quality.numstacks = 64, 32
        return np.array(robot.picture("outside", *size))


@contextmanager
def posed(body: Settings | Mapping[str, Any]) -> Iterator[Any]:
    """The robot without physics, to be put into postures; closed when the context ends.

    Args:
        body: the robot, as a description has it.

    Raises:
        BodyError: it cannot be put into postures at once.
    """
    settings = BODIES.validated(body)
    if hasattr(settings, "motion"):
        settings = settings.replaced(motion="kinematic")
    robot = settings.build(Context(Description()))
    try:
        if not isinstance(robot, Posable):
            raise BodyError(f"The body {settings.kind!r} cannot be put into postures at once: it has no place().")
        yield robot
    finally:
        robot.close()
