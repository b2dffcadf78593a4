"""Measures how far a head that misses the hand is from the nearest posture that would see it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from somatopy.contract import Modelled
from somatopy.experiment.ceiling import Bools, Vantages
from somatopy.percept import Floats

__all__ = ["miss_distance", "miss_distances"]

#: Missed frames of a phase that are looked at.
_MOST = 500


def miss_distances(
    bodies: Sequence[Modelled], arms: Sequence[Floats], heads: Sequence[Floats], hits: Sequence[Bools]
) -> list[float | None]:
    """`miss_distance` of each phase, over its missed frames. Of more than 500 it takes 500, evenly spread.

    Args:
        bodies: the robot in each phase.
        arms: for each phase the sensed arm posture in each frame, shape (frames, n_arm), rad.
        heads: for each phase the sensed head posture in each frame, shape (frames, n_head), rad.
        hits: for each phase whether the hand was seen in each frame, shape (frames,).
    """
    made: dict[int, Vantages] = {}
    found = []
    for body, arm, head, hit in zip(bodies, arms, heads, hits, strict=True):
        missed = np.flatnonzero(~hit)
        some = missed[np.linspace(0, len(missed) - 1, min(_MOST, len(missed))).astype(int)]
        if len(some) and id(body) not in made:
            made[id(body)] = Vantages.of(body)
        found.append(miss_distance(made[id(body)], arm[some], head[some]) if len(some) else None)
    return found


def miss_distance(vantages: Vantages, arms: Floats, heads: Floats) -> float | None:
    """Mean distance from the head to the nearest head posture that sees the hand, over the frames with such a posture.

    Args:
        vantages: a grid of head postures. Its spacing limits how exact the result is.
        arms: arm postures in frames without a hit, shape (n, n_arm), rad.
        heads: head postures in the same frames, shape (n, n_head), rad.

    Returns:
        The Euclidean distance, rad. None if the hand could be seen in none of these frames.

    Example:
        >>> from somatopy.bodies import MujocoBody
        >>> vantages = Vantages.of(MujocoBody("nao", motion="kinematic"), shape=(25, 9))
        >>> arm = np.array([0.4, 0.0, -1.0, -0.9])
        >>> head = vantages.heads[vantages.seeing(arm)].max(axis=0) + 0.5
        >>> bool(miss_distance(vantages, arm[None], head[None]) >= 0.5 * np.sqrt(2))
        True
    """
    found = []
    for arm, head in zip(arms, heads, strict=True):
        seeing = vantages.heads[vantages.seeing(arm)]
        if len(seeing):
            found.append(np.linalg.norm(seeing - head, axis=1).min())
    return float(np.mean(found)) if found else None
