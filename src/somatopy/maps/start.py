"""Parameters that several maps have: how they are checked, start codes, and what fades while a map learns."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, wraps
from math import isfinite
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from somatopy._jit import jit

__all__ = [
    "NEGLIGIBLE",
    "Fading",
    "check_number",
    "check_units",
    "faded",
    "fading",
    "fading_rule",
    "ranges",
    "remembered",
    "start_codes",
]

Floats = NDArray[np.float64]
R = TypeVar("R")

MOST = 2**31 - 1  # units and ages are numbers of 32 bits
NEGLIGIBLE = 37.0  # exp(-37) is under 1e-16: what moves less than that does not move


def start_codes(init: ArrayLike, bounds: ArrayLike, units: int, dims: int, rng: np.random.Generator) -> Floats:
    """The first codes, shape (units, dims).

    Args:
        init: "uniform" draws them within `bounds`; an array (units, dims) gives them.
        bounds: range (low, high) for all dimensions, or one pair for each, shape (dims, 2).
        units: how many.
        dims: dimensions of the inputs.
        rng: draws them.

    Raises:
        ValueError: if init or bounds do not fit, or are not finite.
    """
    if isinstance(init, str):
        if init != "uniform":
            raise ValueError(f"init must be 'uniform' or an array (units, dims); got {init!r}")
        low, high = ranges(bounds, dims)
        return rng.uniform(low, high, (units, dims))
    codes = _numbers(init)
    if codes.shape != (units, dims):
        raise ValueError(f"init must have shape (units, dims), {(units, dims)} here; got {codes.shape}")
    if not np.isfinite(codes).all():
        raise ValueError("init must be finite; it holds a value that is not")
    return codes


def _numbers(values: ArrayLike) -> Floats:
    """A copy of the values as an array; what is no array of numbers becomes NaN, which fits nowhere."""
    try:
        return np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        return np.array(np.nan)


def ranges(bounds: ArrayLike, dims: int) -> tuple[Floats, Floats]:
    """Least and greatest value of all dimensions, or of each.

    Raises:
        ValueError: if bounds do not fit, or are not finite.
    """
    pairs = _numbers(bounds)
    fits = pairs.shape in ((2,), (dims, 2)) and np.isfinite(pairs).all()
    if not fits or not (pairs[..., 0] < pairs[..., 1]).all():
        raise ValueError(
            f"bounds must be finite (low, high) with low < high, or one such pair for each dimension, shape "
            f"({dims}, 2); got {bounds!r}"
        )
    return pairs[..., 0], pairs[..., 1]


def fading(name: str, value: Any, *, most: float = np.inf) -> tuple[float, float]:
    """First and last value of a parameter that is one number, or a pair of which the second is reached at the horizon.

    Raises:
        ValueError: if it is neither, or a number is not over 0 and at most `most`.
    """
    try:
        first, last = value if np.ndim(value) else (value, value)
        fits = all(0 < number <= most and isfinite(number) for number in (first, last))
    except (TypeError, ValueError):
        fits = False
    if not fits:
        limit = "" if most == np.inf else f" and at most {most:g}"
        raise ValueError(
            f"{name} must be a finite number over 0{limit}, or a pair (first, last) of such; got {value!r}"
        )
    return float(first), float(last)


def check_number(name: str, value: Any, *, over: float = 0.0, most: float = np.inf) -> None:
    """Refuse what is not a finite number over `over` and at most `most`.

    Raises:
        ValueError: the message has the name, the value and the valid range.
    """
    try:
        fits = over < value <= most and isfinite(value)
    except (TypeError, ValueError):
        fits = False
    if not fits:
        limit = "" if most == np.inf else f" and at most {most:g}"
        raise ValueError(f"{name} must be a finite number over {over:g}{limit}; got {value!r}")


def check_units(name: str, value: Any, *, least: int = 1) -> None:
    """Refuse what is not a whole number of units.

    Raises:
        ValueError: the message has the name, the value and the valid range.
    """
    if isinstance(value, bool) or not (isinstance(value, (int, np.integer)) and value >= least):
        raise ValueError(f"{name} must be a whole number, at least {least}; got {value!r}")
    if value > MOST:
        raise ValueError(f"{name} must be at most {MOST}; got {value!r}")


def remembered(rule: Callable[..., R]) -> Callable[..., R]:
    """Remember what a function makes of its arguments, told apart by their values and types.

    It is for functions that check parameters and bring them into the form that kernels take, a plain tuple (one with
    names takes three times as long on its way to a kernel): a map asks for each input, and its parameters seldom
    change. Where an argument can change in place, such as a list or an array, nothing
    is remembered, and the function is called each time.
    """
    known = lru_cache(maxsize=256, typed=True)(rule)

    @wraps(rule)
    def asked(*parameters: Any) -> R:
        try:
            return known(*parameters)
        except TypeError:  # a parameter that cannot be hashed
            return rule(*parameters)

    return asked


class Fading(NamedTuple):
    """What fades over the horizon, which is a number of inputs: the first values and the last ones."""

    first_rate: float
    last_rate: float
    first_width: float
    last_width: float
    horizon: float


@remembered
def fading_rule(learning_rate: Any, width: Any, horizon: Any) -> tuple[Any, ...]:
    """The values of a `Fading`; learning rate and width are each one number or a pair.

    Raises:
        ValueError: if one is not valid.
    """
    check_number("horizon", horizon)
    return *fading("learning_rate", learning_rate, most=1), *fading("width", width), float(horizon)


@jit
def faded(first: float, last: float, seen: float, horizon: float) -> float:
    """What fades from `first` to `last` over `horizon` inputs, after `seen` of them; it stays at `last`."""
    if first == last:
        return first
    return float(first * (last / first) ** min(seen / horizon, 1.0))
