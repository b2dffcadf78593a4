"""Whether neighbours on the map are neighbours in input space, and the other way round."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.distance import cdist

from somatopy.maps.base import Map
from somatopy.maps.distances import squared_distances
from somatopy.maps.inputs import unmasked
from somatopy.maps.quality.looking import BLOCK, blocks, codes_of, topology_of
from somatopy.maps.start import check_units

__all__ = ["topographic_error", "topographic_product", "trustworthiness"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

DECIMALS, SAME = 9, 1e-9  # distances that differ by less are alike: those of a hexagonal lattice are rounded


def topographic_error(trained: Map, X: ArrayLike) -> float:
    """Share of the inputs X (n, dims) whose two nearest units are not neighbours, from 0 to 1.

    Neighbours are what `topology_.adjacent` says: on a hexagonal lattice the six around a unit, on a rectangular one
    all that touch it, corners too; on a graph what an edge joins. Of units equally near, the first counts as nearer.

    Source: K. Kiviluoto, Topology preservation in self-organizing maps, ICNN 1996.

    Raises:
        ValueError: if the map has no topology or a single unit.

    Example:
        >>> from somatopy.maps import SOM
        >>> folded = SOM(shape=(3,), init=[[0.0], [2.0], [1.0]]).initialise(1)
        >>> topographic_error(folded, [[0.1], [0.9], [1.2], [1.9]])
        0.5
    """
    topology, apart, inputs = topology_of(trained, "topographic error"), 0, 0
    for block, distances in blocks(trained, X, lambda rows: np.concatenate(list(trained.transform_chunks(rows)))):
        if distances.shape[1] < 2:
            raise ValueError("the topographic error compares the two nearest units; this map has one")
        every, first = np.arange(len(distances)), distances.argmin(axis=1)
        distances[every, first] = np.inf
        apart += int((~topology.adjacent(first, distances.argmin(axis=1))).sum())
        inputs += len(block)
    return apart / inputs


def topographic_product(trained: Map) -> float:
    r"""How well the neighbourhoods of all sizes agree between map and input space: 0 if they do.

    With :math:`n^A_k(j)` the k-th nearest unit to j within the map, :math:`n^V_k(j)` the one whose code is k-th
    nearest, and distances :math:`d^A, d^V` in the map and between codes,

    .. math::
        P = \frac{1}{N (N - 1)} \sum_j \sum_{k=1}^{N-1} \frac{1}{2k} \sum_{l=1}^{k} \log \left(
            \frac{d^V(j, n^A_l(j))}{d^V(j, n^V_l(j))} \cdot \frac{d^A(j, n^A_l(j))}{d^A(j, n^V_l(j))} \right)

    Below 0 the map has too few dimensions for its codes and is folded into their space, above 0 it has too many. It
    tells dimensions, not order: where map and codes change places its sign does, so that shuffled units have 0 in the
    mean, too; `topographic_error` finds these out. The paper leaves open which of units equally near comes first: here
    the one that is nearer in the other space, so that the numbering of the units does not matter. Takes time as units
    squared, memory as units.

    Source: H.-U. Bauer, K. R. Pawelzik, Quantifying the neighborhood preservation of self-organizing feature maps,
    IEEE Transactions on Neural Networks 3(4), 1992.

    Raises:
        ValueError: if the map has no topology or a single unit, if two units have the same code, or no path of edges
            joins two units: the product has no value then.
    """
    topology, codes = topology_of(trained, "topographic product"), codes_of(trained)
    if len(codes) < 2:
        raise ValueError(f"the topographic product compares pairs of units; this map has {len(codes)}")
    sizes = np.arange(1, len(codes))
    total = 0.0
    for unit in range(len(codes)):
        inside, outside = topology.distances(unit), cdist(codes[unit : unit + 1], codes)[0]
        others = np.delete(np.arange(len(codes)), unit)
        inside, outside = inside[others], outside[others]
        _check_comparable(unit, others, inside, outside)
        # a unit's distances, in the order of those in the map and of those between codes
        near = np.lexsort((outside, np.round(np.log(inside), DECIMALS)))
        like = np.lexsort((inside, np.round(np.log(outside), DECIMALS)))
        ratios = np.log(outside[near] / outside[like] * (inside[near] / inside[like]))
        total += float((ratios.cumsum() / (2 * sizes)).sum())
    return total / (len(codes) * (len(codes) - 1))


def _check_comparable(unit: int, others: Integers, inside: Floats, outside: Floats) -> None:
    if not outside.all():
        twin = others[outside.argmin()]
        raise ValueError(
            f"units {unit} and {twin} have the same code, so that the topographic product has no value; "
            "topographic_error has one"
        )
    if not np.isfinite(inside).all():
        far = others[inside.argmax()]
        raise ValueError(
            f"nothing joins units {unit} and {far}, so that the topographic product has no value; "
            "topographic_error and trustworthiness have one"
        )


def trustworthiness(trained: Map, X: ArrayLike, neighbours: int = 5) -> float:
    r"""Whether inputs that are near each other on the map are near each other, from 0 to 1 (they all are).

    .. math::
        1 - \frac{2}{n k (2n - 3k - 1)} \sum_i \sum_{j \in U_k(i)} (r(i, j) - k)

    where :math:`U_k(i)` are those of the k inputs nearest to i on the map that are not among the k nearest in input
    space, and :math:`r(i, j)` is the rank of j among the inputs by distance from i. An input lies on the map where its
    winner does, so that many are equally near there: the mean over all their orders is taken. Inputs that are equally
    near in input space share the best of their ranks, so that a map that keeps all distances has 1. Takes time as
    inputs squared, memory as inputs.

    Source: J. Venna, S. Kaski, Neighborhood preservation in nonlinear projection methods: an experimental study,
    ICANN 2001; and as `sklearn.manifold.trustworthiness`, which takes equally near ones in an arbitrary order.

    Args:
        trained: a map with a topology.
        X: inputs, shape (n, dims).
        neighbours: k, from 1 to less than half of n.

    Raises:
        ValueError: if the map has no topology, k does not fit, or two inputs have no coordinate that is known of both.
    """
    check_units("neighbours", neighbours)
    topology = topology_of(trained, "trustworthiness")
    winners = np.concatenate([winners for _, winners in blocks(trained, X, trained.predict)])
    samples, count = np.asarray(unmasked(X), dtype=np.float64), len(winners)
    if 2 * neighbours >= count:
        raise ValueError(f"neighbours must be less than half of the inputs, {count / 2:g}; got {neighbours}")
    penalty = 0.0
    for unit in np.unique(winners):
        shares = _shares(np.round(topology.distances(int(unit))[winners], DECIMALS), neighbours)
        near, members = np.flatnonzero(shares), np.flatnonzero(winners == unit)
        for ranked in _sorted_gaps(samples, members, near):
            penalty += float(shares[near] @ _excess(*ranked, neighbours))
    return 1 - penalty * 2 / (count * neighbours * (2 * count - 3 * neighbours - 1))


def _shares(away: Floats, k: int) -> Floats:
    """How much of each input is among the k nearest on the map, those equally near having equal shares of the rest."""
    border = np.partition(away, k)[k]  # the input itself is first
    inside, tied = away < border, away == border
    itself = int(border > 0)
    rest, sharing = k - (inside.sum() - itself), tied.sum() - (1 - itself)
    shares: Floats = inside + tied * (rest / sharing)
    return shares


def _sorted_gaps(samples: Floats, members: Integers, near: Integers) -> Iterator[tuple[Floats, Floats]]:
    """For each member: its distances from all inputs, sorted, itself first as -1; those of the ones that are near."""
    step = max(1, 4 * BLOCK // len(samples))
    for chosen in np.split(members, np.arange(step, len(members), step)):
        gaps = _gaps(samples[chosen], samples)
        gaps[np.arange(len(chosen)), chosen] = -1.0
        if np.isnan(gaps).any():
            row, other = np.argwhere(np.isnan(gaps))[0]
            raise ValueError(f"X[{chosen[row]}] and X[{other}] have no coordinate that is known of both")
        yield from ((np.sort(row), row[near]) for row in gaps)


def _gaps(a: Floats, b: Floats) -> Floats:
    gaps: Floats = np.sqrt(squared_distances(a, b))
    return gaps


def _excess(ordered: Floats, gaps: Floats, k: int) -> Floats:
    """By how much the ranks of these distances exceed k; of equal ones, all have the rank of the first."""
    nearer = np.searchsorted(ordered, gaps * (1 - SAME), "left")  # counts the input itself, so that ranks start at 1
    excess: Floats = np.maximum(nearer - k, 0).astype(np.float64)
    return excess
