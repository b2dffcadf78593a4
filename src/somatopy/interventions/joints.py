"""What damages of the arm share: finding joints by name, scaling their values, and drawing random directions."""

from __future__ import annotations

from collections.abc import Sequence
from zlib import crc32

import numpy as np

from somatopy.percept import Floats, JointGroup

__all__ = ["Joint", "drawn", "numbered", "scale"]

#: A joint by its name, or by its number from 0 on.
Joint = int | str


def numbered(arm: JointGroup, joints: Sequence[Joint]) -> list[int]:
    """Indices of joints in an arm's vectors.

    Args:
        arm: the arm's joints.
        joints: the joints, each by its name or its number, from 0.

    Raises:
        ValueError: the arm has no such joint.

    Example:
        >>> arm = JointGroup(("lift", "turn"), np.zeros(2), np.ones(2), np.ones(2))
        >>> numbered(arm, ["turn", 0])
        [1, 0]
    """
    known: dict[Joint, int] = {name: k for k, name in enumerate(arm.names)}
    known |= {k: k for k in range(len(arm))}
    for joint in joints:
        if joint not in known:
            named = ", ".join(f"{name} ({k})" for k, name in enumerate(arm.names))
            raise ValueError(f"the arm has no joint {joint!r}; name one of its joints or its number: {named}")
    return [known[joint] for joint in joints]


def scale(arm: JointGroup) -> Floats:
    """How much a damage of 1 is in each joint, shape (n_arm,): 1 rad for a hinge, the whole range in m for a slide.

    Example:
        >>> scale(JointGroup(("lift", "turn"), np.array([0.0, -2.0]), np.array([0.1, 2.0]), np.ones(2), ("m", "rad")))
        array([0.1, 1. ])
    """
    return np.where([unit == "rad" for unit in arm.units], 1.0, arm.upper - arm.lower)


def drawn(arm: JointGroup, norm: float, seed: int, draw: int) -> Floats:
    """An offset of the arm's vector in a random direction, shape (n_arm,), each value in its joint's unit.

    It depends on the arguments alone, so that all learners of one seed get the same offset, and so does a resumed run.

    Args:
        arm: the arm's joints.
        norm: Euclidean length of the offset, rad. The whole range of a slide counts as 1 rad.
        seed: the experiment's.
        draw: another number gives another direction.

    Example:
        >>> arm = JointGroup(("a", "b"), -np.ones(2), np.ones(2), np.ones(2))
        >>> round(float(np.linalg.norm(drawn(arm, 0.3, seed=0, draw=0))), 9)
        0.3
    """
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(crc32(b"direction of a damage"), draw)))
    direction = rng.normal(size=len(arm))
    return np.asarray(norm * scale(arm) * direction / np.linalg.norm(direction))
