"""A check that any babbler keeps its contract."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import ArrayLike

from somatopy.clock import FRAME
from somatopy.contract import Babbler, check_members, check_state, law, same
from somatopy.percept import Floats

__all__ = ["check_babbler"]

Make = Callable[[np.random.Generator], Babbler]


def check_babbler(make: Make, bounds: ArrayLike) -> None:
    """Check that a babbler keeps its contract.

    Args:
        make: makes a fresh babbler, given the generator for all its random numbers.
        bounds: low and high of each arm joint, shape (n_arm, 2), rad. Targets must stay inside.

    Raises:
        ContractError: it breaks a law; the message says which, what was seen and how to fix it.

    Example:
        >>> from somatopy.babbling import UniformBabbler
        >>> from somatopy.percept import JointGroup
        >>> arm = JointGroup(("a", "b"), np.array([-1.0, -1.0]), np.array([1.0, 1.0]), np.array([8.0, 8.0]))
        >>> check_babbler(lambda rng: UniformBabbler(arm, [[-1, 1], [0, 1]], 0.5, [0, 0], rng), [[-1, 1], [0, 1]])
    """
    check_members(_fresh(make), Babbler)
    _stays_inside(make, np.array(bounds, float))
    _has_one_target_at_a_time(make)
    check_state(lambda seed: _fresh(make, seed), lambda babbler, *frames: _commands(babbler, _times(*frames)))


def _fresh(make: Make, seed: int = 1) -> Babbler:
    return make(np.random.default_rng(seed))


def _times(first: int, last: int) -> Iterable[float]:
    return (k * FRAME for k in range(first, last))


def _commands(babbler: Babbler, times: Iterable[float]) -> list[Floats]:
    return [np.array(babbler.command(time)) for time in times]


def _stays_inside(make: Make, limits: Floats) -> None:
    uneven = np.cumsum(np.random.default_rng(0).exponential(0.5, 300))
    asked = {"every frame": _times(0, 2000), "at uneven times": uneven, "from an hour on": 3600 + uneven}
    for name, times in asked.items():
        with law(
            f"a babbler asked {name} gives finite targets ({len(limits)},) inside its bounds",
            "draw one number a joint between its bounds, at whatever time that does not decrease",
        ) as holds:
            for target in _commands(_fresh(make), times):
                fits = target.shape == (len(limits),)
                inside = fits and ((limits[:, 0] <= target) & (target <= limits[:, 1])).all()
                holds(inside, "{} with the bounds {}", target, limits.tolist())


def _has_one_target_at_a_time(make: Make) -> None:
    babbler = _fresh(make)
    for time in _times(0, 300):
        with law("asked again at the same time it says the same", "draw when a movement ends, not when asked") as holds:
            given, again = babbler.command(time), np.array(babbler.command(time))
            holds(same(np.array(given), again), "{} and then {} at {} s", given, again, time)
        with law("what a babbler returns belongs to the caller", "return a copy of the target") as holds:
            if given.flags.writeable:
                given[:] = np.nan
            holds(same(np.array(babbler.command(time)), again), "changing {} changed the next answer", again)
    with law("what a babbler returned stays as it was", "return a new array, or a copy of the target") as holds:
        given = babbler.command(300 * FRAME)
        before = np.array(given)
        _commands(babbler, _times(301, 900))
        holds(same(np.array(given), before), "{} became {} when later targets were asked", before, given)
