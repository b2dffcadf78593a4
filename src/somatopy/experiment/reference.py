"""The hit rate of a perfect observer without memory, who lacks the information that a damage takes away.

The ceiling asks whether any head posture sees the hand. If a joint's sensor is dead or noisy, no learner can know the
true posture, so that the ceiling cannot be reached. The reference is the hit rate of an observer without memory. The
observer knows the robot, and the arm postures to which babbling may have led. It considers those of them that feel like
the present one, and looks where the hand is seen in most of them:

    g(s) = argmax_g P(g sees the hand | s),  rate = E_s P(g(s) sees the hand | s),

where s is the arm posture as it is felt. A learner with memory, or with the efference copy of the command, can do
better.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from somatopy.percept import Floats

__all__ = ["Alike", "blurred", "memoryless", "unfelt"]

#: Arm postures (k, n_arm), rad, that feel as one arm posture does, (n_arm,), rad: drawn from what babbling makes of it.
Alike = Callable[[Floats], Floats]
_COUNT = 64


class Sees(Protocol):
    """Which of many head postures see the hand at an arm posture, such as `somatopy.experiment.ceiling.Vantages`."""

    def seeing(self, arm: Floats) -> NDArray[np.bool_]:
        """Whether each head posture sees the hand, shape (m,)."""
        ...


def memoryless(vantages: Sees, arms: ArrayLike, alike: Alike) -> NDArray[np.bool_]:
    """Whether the observer sees the hand, for each arm posture. The mean is the reference.

    The gaze is chosen by the postures that feel alike, and judged by the true posture. If few postures feel alike, the
    estimate is too low. It is never too high.

    Args:
        vantages: the head postures to choose from.
        arms: true arm postures, shape (n, n_arm), rad.
        alike: function that returns postures which feel like a true one. `unfelt` and `blurred` make such functions.

    Returns:
        Shape (n,).

    Example:
        >>> class Ahead:  # two gazes: one sees the hand on the left, one on the right
        ...     def seeing(self, arm): return np.array([arm[0] < 0, arm[0] >= 0])
        >>> arms = np.array([[-1.0], [1.0], [2.0]])
        >>> memoryless(Ahead(), arms, lambda arm: arms).tolist()
        [False, True, True]
    """
    hits = []
    for arm in np.asarray(arms, float):
        counts = np.sum([vantages.seeing(other) for other in alike(arm)], axis=0)
        hits.append(bool(vantages.seeing(arm)[counts.argmax()]))
    return np.array(hits, np.bool_)


def unfelt(joints: Sequence[int], babbled: ArrayLike, count: int = _COUNT) -> Alike:
    """Make a function that returns the postures which feel like a given one if some joints are not sensed.

    The angles of the sensed joints stay as they are. Those of the other joints are taken from the `count` babbled
    postures that are nearest in the sensed joints. Distances are measured in units of each joint's spread.

    Args:
        joints: indices of the joints that are not sensed, in the posture vector of the arm.
        babbled: arm postures from babbling, shape (m, n_arm), rad.
        count: number of postures to give.

    Example:
        >>> alike = unfelt([1], [[0.0, 1.0], [0.1, 2.0], [5.0, 9.0]], count=2)
        >>> alike(np.array([0.0, 7.0])).tolist()
        [[0.0, 1.0], [0.0, 2.0]]
    """
    known = np.array(babbled, float)
    felt = np.setdiff1d(np.arange(known.shape[1]), joints)
    spread = np.maximum(known.std(axis=0), 1e-12)[felt]
    count = min(count, len(known))
    tree = cKDTree(known[:, felt] / spread) if len(felt) else None

    def alike(arm: Floats) -> Floats:
        near = np.arange(count) if tree is None else np.atleast_1d(tree.query(arm[felt] / spread, count)[1])
        found = np.tile(arm, (count, 1))
        found[:, joints] = known[near][:, joints]
        return found

    return alike


def blurred(deviation: ArrayLike, babbled: ArrayLike, rng: np.random.Generator, count: int = _COUNT) -> Alike:
    """Make a function that returns the postures which feel like a given one if the joint sensors are noisy.

    The function adds noise to the given posture, which makes the felt one. Then it draws noise `count` times, and
    subtracts each from the felt posture. Results outside of the babbled range are left out. If all are outside, the
    result is the felt posture, moved into the range.

    Args:
        deviation: standard deviation of the noise, shape (n_arm,), or one for all, rad.
        babbled: arm postures from babbling, shape (m, n_arm), rad.
        rng: random numbers for the noise.
        count: number of postures to draw.

    Example:
        >>> alike = blurred(0.0, [[0.0, 1.0], [1.0, 2.0]], np.random.default_rng(0), count=2)
        >>> alike(np.array([0.5, 1.5])).tolist()
        [[0.5, 1.5], [0.5, 1.5]]
    """
    known, spread = np.array(babbled, float), np.asarray(deviation, float)
    low, high = known.min(axis=0), known.max(axis=0)

    def alike(arm: Floats) -> Floats:
        felt = arm + spread * rng.normal(size=arm.shape)
        drawn = felt - spread * rng.normal(size=(count, *arm.shape))
        inside = ((low <= drawn) & (drawn <= high)).all(axis=1)
        return np.asarray(drawn[inside] if inside.any() else np.clip(felt, low, high)[None])

    return alike
