"""The laws of babblers, tried on any implementation."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import ArrayLike

from somatopy.babbling.base import Babbler
from somatopy.contract import check_state, law, missing, same
from somatopy.percept import Floats

__all__ = ["check_babbler"]

Make = Callable[[np.random.Generator], Babbler]

_FRAME = 1 / 15


def check_babbler(make: Make, bounds: ArrayLike) -> None:
    """Check that a babbler keeps its contract.

    Args:
        make: a fresh babbler from a generator for all its random numbers.
        bounds: low and high of each arm joint that its targets may not leave, shape (n_arm, 2), rad.

    Raises:
        ContractError: it breaks a law; the message says which, what was seen and how to fix it.

    Example:
        >>> from somatopy.babbling import UniformBabbler
        >>> from somatopy.percept import JointGroup
        >>> arm = JointGroup(("a", "b"), np.array([-1.0, -1.0]), np.array([1.0, 1.0]), np.array([8.0, 8.0]))
        >>> check_babbler(lambda rng: UniformBabbler(arm, [[-1, 1], [0, 1]], 0.5, [0, 0], rng), [[-1, 1], [0, 1]])
    """
    limits = np.array(bounds, float)
    with law("a babbler has all members of Babbler", "see somatopy.babbling.Babbler") as holds:
        babbler = _fresh(make, 1)
        holds(not missing(babbler, Babbler), "{} lacks {}", type(babbler).__name__, missing(babbler, Babbler))
    _stays_inside(make, limits)
    _has_one_target_at_a_time(make)
    _draws_from_its_generator(make)
    check_state(lambda seed: _fresh(make, seed), lambda b, first, last: _commands(b, _times(first, last)))


def _fresh(make: Make, seed: int) -> Babbler:
    return make(np.random.default_rng(seed))


def _times(first: int, last: int) -> Iterable[float]:
    return (k * _FRAME for k in range(first, last))


def _commands(babbler: Babbler, times: Iterable[float]) -> list[Floats]:
    return [np.array(babbler.command(time)) for time in times]


def _stays_inside(make: Make, limits: Floats) -> None:
    uneven = np.cumsum(np.random.default_rng(0).exponential(0.5, 300))
    for name, times in (
        ("every frame", _times(0, 2000)),
        ("at uneven times", uneven),
        ("from an hour on", 3600 + uneven),
    ):
        with law(
            f"asked {name}, a babbler gives finite targets ({len(limits)},) inside its bounds",
            "draw targets between the bounds, one number a joint, at any time that does not decrease",
        ) as holds:
            for target in _commands(_fresh(make, 1), times):
                holds(target.shape == (len(limits),), "the shape {}", target.shape)
                inside = (limits[:, 0] <= target) & (target <= limits[:, 1])
                holds(inside.all(), "{} with the bounds {}", target, limits.tolist())


def _has_one_target_at_a_time(make: Make) -> None:
    babbler, twin = _fresh(make, 1), _fresh(make, 1)
    with law("asked again at the same time, a babbler says the same", "draw when a movement has ended, not when asked"):
        answers = [babbler.command(time) for time in _times(0, 300) for _ in range(2)]
        for first, second in zip(answers[::2], answers[1::2], strict=True):
            assert same(first, second), f"{first} and then {second}"
    with law("what a babbler returns belongs to the caller", "return a copy of the target") as holds:
        for time in _times(0, 300):
            expected = np.array(twin.command(time))
            given = np.asarray(twin.command(time))
            if given.flags.writeable:
                given[:] = np.nan
            holds(same(np.array(twin.command(time)), expected), "changing {} changed its next answer", expected)


def _draws_from_its_generator(make: Make) -> None:
    with law(
        "a babbler depends on the time and on its generator alone",
        "draw from the generator that is given, never from numpy.random or random, and look at no robot",
    ) as holds:
        a, b = (_commands(_fresh(make, 3), _times(0, 600)) for _ in range(2))
        different = [k for k in range(len(a)) if not same(a[k], b[k])]
        holds(not different, "two babblers of one seed differ from frame {} on", different and different[0])
