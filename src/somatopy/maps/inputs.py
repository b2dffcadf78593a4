"""What maps take: real numbers that are finite, not too large, and missing only where they may be."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from somatopy.maps.kernels import LARGEST, LARGEST_SINGLE

__all__ = ["LIMITS", "MISSING", "no_numbers", "real", "refusal", "restored", "unmasked", "unusable"]

Array = NDArray[Any]

LIMITS = {"float64": LARGEST, "float32": LARGEST_SINGLE}
MISSING = {"error": False, "ignore": True}  # whether values may be missing


def unmasked(values: Any) -> Any:
    """The values, but NaN in the place of each that a masked array hides: it was not observed."""
    if not isinstance(values, np.ma.MaskedArray):
        return values
    return np.ma.filled(values.astype(np.float64), np.nan)


def no_numbers(X: Any) -> str:
    """What to do about columns of a pandas table that hold no numbers; nothing where there are none."""
    kept = getattr(X, "select_dtypes", None)
    names = [] if kept is None else [str(name) for name in kept(exclude=["number", "bool"]).columns]
    if not names:
        return ""
    return (
        f"These columns hold no numbers: {', '.join(names)}. Leave them out, X.select_dtypes('number'), or encode "
        "them, as OneHotEncoder of scikit-learn does."
    )


def real(x: ArrayLike) -> Array:
    """An array, perhaps not a copy, if it is not one of complex numbers."""
    given = np.asarray(unmasked(x))
    if given.dtype.kind == "c":
        raise ValueError(f"inputs are real numbers; got complex ones, {x!r}")
    return given


def unusable(samples: Array, missing: bool) -> NDArray[np.bool_]:
    """Which values of the samples (..., dims) keep them from being learned; some may be missing, but not all."""
    refused: NDArray[np.bool_] = ~(np.abs(samples) <= LIMITS[samples.dtype.name])
    if missing:
        absent = np.isnan(samples)
        refused &= ~absent | absent.all(axis=-1, keepdims=True)
    return refused


def refusal(samples: Array, missing: bool) -> ValueError:
    """The error for samples that are not usable, naming the first value that is not."""
    place = tuple(np.argwhere(unusable(samples, missing))[0])
    rule = "finite or NaN, not all of an input NaN" if missing else 'finite (missing="ignore" allows NaN)'
    return ValueError(
        f"input[{', '.join(map(str, place))}] is {samples[place]}: values must be {rule}, and at most "
        f"{LIMITS[samples.dtype.name]:g} in size; nothing has changed"
    )


def restored(name: str, values: ArrayLike, dtype: np.dtype[Any]) -> Array:
    """A copy of one array of a state, in the type that the map has for it."""
    given = np.asarray(values)
    if not np.can_cast(given.dtype, dtype, "same_kind"):
        raise ValueError(f"the restored {name} must be of a kind that fits {dtype}; got {given.dtype}")
    copied: Array = given.astype(dtype, copy=True)
    if not np.isfinite(copied).all():
        raise ValueError(f"the restored {name} must be finite; it holds a value that is not")
    return copied
