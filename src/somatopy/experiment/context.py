"""The context from which settings build their parts, and the random stream of each part."""

from __future__ import annotations

import zlib
from typing import Any

import numpy as np

from somatopy.clock import FRAME, FRAMES_PER_MINUTE
from somatopy.contract import Babbler, Body, Twin
from somatopy.experiment.ceiling import best_fixed_head
from somatopy.experiment.description import Description
from somatopy.percept import Floats, JointGroup, Robot

__all__ = ["Context", "stream"]

#: Arm postures by which the best fixed head posture is chosen.
_ENOUGH = 500


def stream(seed: int, name: str) -> np.random.Generator:
    """The random stream of one part, by name. Adding a part never changes the random numbers of another."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(zlib.crc32(name.encode()),)))


class Context:
    """The argument of `build(context)`: the parts that are already built, and what can be computed from them.

    The body is built first. Eye, babbler and learner follow, and the interventions come last. Each part gets a random
    stream of its own as `rng`.

    Args:
        description: the experiment.
        body: the robot. None while it is being built.
        rng: random numbers for the part that is being built.
        start: posture of the arm at time 0, shape (n_arm,), rad. Empty while the body is being built.

    Attributes:
        description: see above.
        rng: see above.
        start: see above.
    """

    def __init__(
        self,
        description: Description,
        body: Body | None = None,
        rng: np.random.Generator | None = None,
        start: Floats | None = None,
    ) -> None:
        self.description = description
        self._body = body
        self.rng = rng if rng is not None else stream(description.seed, "unnamed")
        self.start = start if start is not None else np.empty(0)

    def told(self, **more: Any) -> Context:
        """A copy of the context with further attributes. A part that is made of parts builds them from it."""
        context = Context(self.description, self._body, self.rng, self.start)
        vars(context).update(more)
        return context

    @property
    def arm_speed(self) -> float | None:
        """Speed of the arm's set-points, rad/s, if the babbler's settings give it."""
        return getattr(self.description.babbling, "speed", None)

    @property
    def body(self) -> Body:
        """The robot.

        Raises:
            ValueError: the robot is still being built.
        """
        if self._body is None:
            raise ValueError("a body is built before all other parts: it can ask the context for none of them")
        return self._body

    @property
    def arm(self) -> JointGroup:
        """The arm's joints."""
        return self.body.arm

    @property
    def robot(self) -> Robot:
        """What a learner knows of the robot: its senses, their limits, and the size of the camera's picture."""
        senses = {"arm": self.body.arm.space, "head": self.body.head.space}
        return Robot(senses, moves=("head",), camera=self.body.camera)

    def range(self, name: str) -> Floats:
        """A babbling range of the body by its name: low and high of each arm joint, shape (n_arm, 2), rad.

        Raises:
            ValueError: the body has no range of that name.
        """
        ranges = {"mechanical": self.arm.space.limits}
        if isinstance(self.body, Twin):
            ranges |= self.body.ranges
        if name not in ranges:
            raise ValueError(f"range {name!r} is unknown to this body; choose one of {', '.join(ranges)}")
        return ranges[name]

    def babbler(self, rng: np.random.Generator, start: Floats) -> Babbler:
        """A babbler of the description, with random numbers and a start posture of its own."""
        built: Babbler = self.description.babbling.build(Context(self.description, self.body, rng, start))
        return built

    def babbled(self, count: int) -> Floats:
        """Arm postures (count, n_arm), rad, from 30 minutes of babbling with random numbers of their own."""
        rng, arm = stream(self.description.seed, "sampled babbling"), self.arm
        posture = self.bounds().mean(axis=1)
        babbler = self.babbler(rng, posture)
        stride = np.minimum(self.arm_speed or np.inf, arm.velocity) * FRAME
        postures = np.empty((30 * FRAMES_PER_MINUTE, len(arm)))
        for k in range(len(postures)):
            posture = posture + np.clip(babbler.command(k * FRAME) - posture, -stride, stride)
            postures[k] = posture
        return postures[rng.choice(len(postures), count, replace=count > len(postures))]

    def bounds(self) -> Floats:
        """Low and high of each arm joint in the babbling range, or else its limits, shape (n_arm, 2), rad."""
        wanted = getattr(self.description.babbling, "range", "mechanical")
        return self.range(wanted) if isinstance(wanted, str) else np.array(wanted, float)

    def best_fixed_head(self) -> Floats:
        """The head posture that sees the hand in most babbled arm postures, shape (n_head,), rad.

        Raises:
            ValueError: the body has no model of itself.
        """
        if not isinstance(self.body, Twin):
            raise ValueError(
                "this body has no model of itself, so that the best head posture cannot be computed; "
                "say head = [...], one angle a joint"
            )
        return best_fixed_head(self.body, self.babbled(_ENOUGH))
