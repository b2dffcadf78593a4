"""The codes that a map starts with: drawn, taken from a table, or spread over its plane of greatest variance."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eigh
from sklearn.utils.extmath import randomized_svd, svd_flip

from somatopy.maps.lattice import Lattice
from somatopy.maps.start import ranges, start_codes

__all__ = ["filled", "first_codes"]

Array = NDArray[Any]
Floats = NDArray[np.float64]

MOST_EXACT = 500  # dimensions of which the whole covariance is worked on
UNIT_RANGE = (0, 1)  # of drawn codes where neither bounds nor data say more


def first_codes(
    init: ArrayLike, bounds: ArrayLike | None, units: int | Lattice, samples: Array, rng: np.random.Generator
) -> Floats:
    """The first codes, shape (units, dims).

    Args:
        init: an array (units, dims) gives them; "sample" takes rows of the samples; "pca" spreads a lattice over the
            plane in which the samples vary most; "uniform" draws within `bounds`. "auto" is "pca" for a lattice and
            "sample" for other units where there are samples, and "uniform" where there are none.
        bounds: range (low, high) for all dimensions, or one pair for each, shape (dims, 2); None is the range of the
            samples, and 0 to 1 where there are none.
        units: how many, or the lattice on which they lie.
        samples: what will be learned, shape (n, dims); n is 0 where learning starts without data. Values may be NaN.
        rng: draws what is drawn.

    Raises:
        ValueError: if init or bounds do not fit, or init needs samples and there are none.
    """
    count, dims = units.units if isinstance(units, Lattice) else units, samples.shape[1]
    if bounds is not None:
        ranges(bounds, dims)
    if isinstance(init, str):
        way = _way(init, isinstance(units, Lattice), len(samples) > 0)
        if way == "pca" and isinstance(units, Lattice):
            return _spread(filled(samples), units, rng)
        if way == "sample":
            return filled(samples)[np.resize(rng.permutation(len(samples)), count)]
        if bounds is None and len(samples):
            table = filled(samples)
            return rng.uniform(table.min(axis=0), table.max(axis=0), (count, dims))
        init = way
    return start_codes(init, UNIT_RANGE if bounds is None else bounds, count, dims, rng)


def _way(init: str, on_lattice: bool, with_data: bool) -> str:
    """What a name of `init` means here."""
    valid = ["auto", "pca", "sample", "uniform"] if on_lattice else ["auto", "sample", "uniform"]
    if init not in valid:
        raise ValueError(f"init must be one of {valid}, or an array (units, dims); got {init!r}")
    if init == "auto":
        return ("pca" if on_lattice else "sample") if with_data else "uniform"
    if init != "uniform" and not with_data:
        raise ValueError(
            f"init={init!r} takes the start codes from a table, and learning starts without one here. Call fit(X) "
            'first, or make the map with init="uniform" and the bounds of your inputs'
        )
    return init


def filled(samples: Array) -> Floats:
    """Samples (n, dims) in double precision; what is missing has the mean of its column."""
    table = samples.astype(np.float64)
    absent = np.isnan(table)
    if absent.any():
        known = np.where(absent, 0.0, table).sum(axis=0) / np.maximum((~absent).sum(axis=0), 1)
        table[absent] = np.broadcast_to(known, table.shape)[absent]
    return table


def _spread(table: Floats, lattice: Lattice, rng: np.random.Generator) -> Floats:
    """A lattice laid out along the directions in which the table (n, dims) varies most.

    It reaches one standard deviation to both sides along each. The longest axis has the first direction; an axis whose
    ends touch is a circle in two directions. Axes for which no direction is left are laid out along none.
    """
    mean, places = table.mean(axis=0), _unfolded(lattice)
    directions = min(places.shape[1], *table.shape)
    if not directions:
        return np.tile(mean, (lattice.units, 1))
    deviations, axes = _principal(table - mean, directions, rng)
    codes: Floats = mean + places[:, :directions] @ (deviations[:, None] * axes)
    return codes


def _principal(centred: Floats, directions: int, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Standard deviations and unit vectors (directions, dims) of greatest variance, the greatest first."""
    rows, dims = centred.shape
    if dims <= MOST_EXACT:
        variances, axes = _greatest(centred.T @ centred / rows, directions)
        return np.sqrt(np.maximum(variances, 0.0)), svd_flip(None, axes, u_based_decision=False)[1]
    _, sizes, axes = randomized_svd(centred, directions, random_state=int(rng.integers(2**31)))
    return sizes / np.sqrt(rows), axes


def _greatest(covariance: Floats, count: int) -> tuple[Floats, Floats]:
    """The greatest eigenvalues, the greatest first, and their unit vectors, shape (count, dims)."""
    dims = len(covariance)
    values, vectors = eigh(covariance, subset_by_index=[dims - count, dims - 1])
    if len(values) < count:  # where many are equal, LAPACK can lose all of those that are asked for
        values, vectors = eigh(covariance)
    return values[: -count - 1 : -1], vectors[:, : -count - 1 : -1].T


def _unfolded(lattice: Lattice) -> Floats:
    """Coordinates of the units from -1 to 1, shape (units, directions), those along the longest axis first."""
    columns = []
    for axis in np.argsort(-np.array(lattice.shape), kind="stable"):
        along = lattice.positions[:, axis]
        if lattice.shape[axis] == 1:
            continue
        if lattice.periodic:
            angle = 2 * np.pi * along / (lattice.shape[axis] * lattice.cell[axis])
            columns += [np.cos(angle), np.sin(angle)]
        else:
            columns.append(2 * (along - along.min()) / np.ptp(along) - 1)
    return np.stack(columns, axis=1) if columns else np.zeros((lattice.units, 0))
