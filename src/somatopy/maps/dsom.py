"""The dynamic self-organising map of Rougier and Boniface."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp, sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.metrics import pairwise_distances
from sklearn.utils.validation import check_is_fitted

from somatopy._jit import jit
from somatopy.maps.first_codes import filled, first_codes
from somatopy.maps.kernels import all_usable, least_and_greatest, nearest_now, read_sample, squared_distances, unit_at
from somatopy.maps.lattice import Lattice
from somatopy.maps.lattice_kernels import (
    GAINS,
    LEAST,
    TABLES,
    columns_in_reach,
    pull_by_gaussian,
    pull_row,
    rows_in_reach,
)
from somatopy.maps.sheet import LatticeMap, Sheet
from somatopy.maps.start import NEGLIGIBLE, check_number, remembered

__all__ = ["DSOM"]

Array = NDArray[Any]
Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

DEFAULTS = {"rougier": (0.1, 0.1), "schillaci2016": (0.2, 1.5), "printed": (0.1, 0.1)}  # learning rate, elasticity
ROUGIER, SCHILLACI, PRINTED = range(3)  # their places
# Cells that the neighbourhood spans: less leaves disorder, more pulls the map together (measured in docs/maps/dsom.md).
SPAN, MOST_ELASTIC = 0.8, 1.5
MOST_ROWS = 2000  # that stand for units, and as many for inputs
DOUBLE = np.dtype(np.float64)


class DSOM(LatticeMap):
    r"""Dynamic self-organising map: a lattice that keeps learning, since nothing in its rule decays with time.

    For each input :math:`v`, with the winner :math:`s` the unit nearest to it, all codes move by

    .. math::
        \Delta w_i = \varepsilon \, \|v - w_i\|_\Omega \, h_\eta(i, s, v) \, (v - w_i)
        \qquad (1)

        h_\eta(i, s, v) = \exp\left(-\frac{1}{\eta^2} \frac{\|p_i - p_s\|^2}{\|v - w_s\|_\Omega^2}\right)
        \qquad (2)

    and none moves on an exact hit, :math:`v = w_s`. :math:`\|\cdot\|_\Omega` is the Euclidean distance divided by the
    greatest one met so far between any unit and any input; lattice positions :math:`p` run from 0 to 1 along each axis,
    divided by the square root of the number of axes longer than 1, so that opposite corners are 1 apart.

    These are the normalisations of the preset `rougier`, the program of the map's authors. There are two more:

    * `schillaci2016`, the library that the first author of the 2014 paper published: lattice positions in cells,
      distances as they are, the ratio in (2) not squared,
      :math:`h = \exp(-\|p_i - p_s\| / (\eta^2 \|v - w_s\|))`. All units move at once (that program moves them in
      turn, and those behind the winner see its moved code).
    * `printed`, as (2) stands in Schillaci, Hafner and Lara (2014), with each unit's own distance
      :math:`\|v - w_i\|_\Omega` in the place of the winner's. It widens the neighbourhood of far units and lets the
      map collapse: an ablation, not a map to use.

    A step never goes beyond the input: where distances are not divided by their maximum, the gain is held at 1.

    Sources: N. P. Rougier, Y. Boniface, Dynamic self-organising map, Neurocomputing 74(11), 2011; G. Schillaci,
    V. V. Hafner, B. Lara, Online learning of visuo-motor coordination in a humanoid robot, ICDL-EpiRob 2014, eq. 1, 2.

    Args:
        shape: units along each lattice axis, one to four numbers.
        learning_rate: :math:`\varepsilon`, in (0, 1]; None is the preset's, .1, or .2 for `schillaci2016`.
        elasticity: :math:`\eta`, over 0: how strongly units are coupled. None: with `rougier`, `fit` chooses it from
            the rows, so that the neighbourhood spans .8 cells once the map has learned; otherwise it is the preset's,
            .1, which gives next to no order, or 1.5 for `schillaci2016`. Order needs about 1.75 for uniform data of
            two dimensions, .7 of three, .35 to .5 of four; with much more the map collapses.
        preset: how equations 1 and 2 are normalised: "rougier", "schillaci2016" or "printed".
        lattice: "rectangular" or "hexagonal"; see `Lattice`.
        periodic: whether opposite borders of the lattice touch.
        bounds: range (low, high) in which start codes are drawn, for all dimensions or one pair for each, shape
            (dims, 2); None is the range of the rows where `fit` starts, and 0 to 1 otherwise.
        init: "pca" spreads the start codes over the plane in which the rows vary most, "sample" takes rows, "uniform"
            draws them within `bounds`; an array (units, dims) gives them, units row by row. "auto" is "pca" where
            `fit` starts, and "uniform" where `partial_fit` or `learn_one` do, since they know no table.
        epochs: passes of `fit` over the rows, in a new random order each; None is as many as make 500 inputs a unit.
        dtype: precision, "float64" or "float32".
        missing: "error" refuses inputs with NaN; "ignore" uses the coordinates that were observed.
        random_state: seed or NumPy Generator of the start codes.

    Example:
        >>> import numpy as np
        >>> inputs = np.random.default_rng(0).random((5000, 2))
        >>> dsom = DSOM(shape=(8, 8), elasticity=1.75, random_state=0)
        >>> winner = dsom.learn_one(inputs[0])
        >>> unit, distance = dsom.partial_fit(inputs[1:]).winner([0.5, 0.5])
        >>> distance < 0.1
        True
        >>> dsom.codebook_.shape
        (64, 2)
    """

    COUNTERS = ("running_max_squared", "samples_seen", "elasticity")
    FIXED = (*LatticeMap.FIXED, "preset")

    def __init__(
        self,
        shape: Sequence[int] = (30, 30),
        learning_rate: float | None = None,
        elasticity: float | None = None,
        preset: str = "rougier",
        lattice: str = "rectangular",
        periodic: bool = False,
        bounds: ArrayLike | None = None,
        init: ArrayLike = "auto",
        dtype: str = "float64",
        missing: str = "error",
        random_state: int | np.random.Generator | None = None,
        epochs: int | None = None,
    ) -> None:
        self.shape = shape
        self.learning_rate = learning_rate
        self.elasticity = elasticity
        self.preset = preset
        self.lattice = lattice
        self.periodic = periodic
        self.bounds = bounds
        self.init = init
        self.epochs = epochs
        self.dtype = dtype
        self.missing = missing
        self.random_state = random_state

    def _start_from(self, samples: Array, rng: np.random.Generator) -> dict[str, Array]:
        dsom_rule(self.preset, self.learning_rate, self.elasticity)
        codes = first_codes(self.init, self.bounds, self._lattice_of_parameters(), samples, rng)
        return {"codebook": codes, "running_max_squared": np.array(0.0), "elasticity": np.array(0.0)}

    def _kernel_geometry(self, lattice: Lattice) -> Floats:
        return lattice.geometry(normalised=self._fixed["preset"] != "schillaci2016")

    def _planned(self, samples: Array, rng: np.random.Generator) -> int:
        if self.elasticity is None and self._fixed["preset"] == "rougier":
            self._memory[2] = suited_elasticity(filled(samples), self._lattice, rng)
        return super()._planned(samples, rng)

    def _mend(self) -> str:
        return f"{super()._mend()}, or lower the elasticity, which is {self.elasticity_:.3g} and holds units together"

    @property
    def elasticity_(self) -> float:
        """The elasticity that the map learns with: the one that is set, chosen by `fit`, or the preset's."""
        check_is_fitted(self)
        return float(self._for_kernel()[-1][1])

    def _run(self, samples: Array, find: bool) -> tuple[int, int, float]:
        codes, geometry, missing, memory, work, rule = self._for_kernel()
        return learn_dsom(codes, geometry, missing, memory, work, samples, rule, find)

    def _for_kernel(self) -> tuple[Any, ...]:
        """What `learn_dsom` takes: codes, geometry, missing, memory, work and rule."""
        sheet, elasticity = self._sheet, self.elasticity
        if elasticity is None and self._memory[2]:
            elasticity = float(self._memory[2])
        rule = dsom_rule(self._fixed["preset"], self.learning_rate, elasticity)
        return sheet.codes, self._geometry, self._allows_missing(), self._memory, sheet.work, rule

    def for_kernel(self) -> tuple[Any, ...] | None:
        """The same, for a kernel that lets several maps learn; None if this map learns otherwise or singly precise."""
        own = self.__dict__
        return self._for_kernel() if own.get("_input_dtype") is DOUBLE and "learn_and_find" not in own else None

    @property
    def sheet(self) -> Sheet:
        """The codes as kernels take them, the map's own."""
        return self._sheet


def suited_elasticity(table: Floats, lattice: Lattice, rng: np.random.Generator) -> float:
    r"""The elasticity with which a map of the preset `rougier` is ordered on a table (n, dims) and does not collapse.

    In equation 2 the neighbourhood has the radius :math:`\eta \delta`, with :math:`\delta = \|v - w_s\|_\Omega`. Here
    it spans `SPAN` cells of the lattice for the inputs that move the map: inputs move it in proportion to
    :math:`\delta^2`, so that theirs is the mean :math:`\langle \delta^3 \rangle / \langle \delta^2 \rangle`. Where a
    few inputs are far from all others it is large, and the elasticity small.

    As many rows as there are units (half of the rows, if there are fewer) stand for the codes. Above `MOST_ELASTIC`
    lattices of two axes twist or collapse on any data.
    """
    rows = table[rng.permutation(len(table))[: 2 * MOST_ROWS]]
    cut = max(min(lattice.units, len(rows) // 2), 1)
    if cut == len(rows):
        return DEFAULTS["rougier"][1]
    distances = pairwise_distances(rows[cut:], rows[:cut])
    nearest, farthest = distances.min(axis=1), float(distances.max())
    if not nearest.any():
        return DEFAULTS["rougier"][1]
    moving = float((nearest**3).sum() / (nearest**2).sum()) / farthest
    return min(SPAN * float(lattice.geometry(normalised=True)[:, 1].mean()) / moving, MOST_ELASTIC)


class DSOMRule(NamedTuple):
    """Parameters of `DSOM` as its kernel knows them; the preset is its place in `DEFAULTS`."""

    learning_rate: float
    elasticity: float
    preset: int


@remembered
def dsom_rule(preset: Any, learning_rate: Any, elasticity: Any) -> tuple[Any, ...]:
    """The values of a `DSOMRule`, the preset's own where they are not given.

    Raises:
        ValueError: if one is not valid.
    """
    if preset not in list(DEFAULTS):
        raise ValueError(f"unknown preset {preset!r}; valid presets: {list(DEFAULTS)}")
    rate = DEFAULTS[preset][0] if learning_rate is None else learning_rate
    eta = DEFAULTS[preset][1] if elasticity is None else elasticity
    check_number("learning_rate", rate, most=1)
    check_number("elasticity", eta)
    return float(rate), float(eta), list(DEFAULTS).index(preset)


@jit
def _pull_each(
    codes: Array,
    geometry: Floats,
    x: Array,
    squared: Array,
    at: int,
    rows: Integers,
    apart: Floats,
    tables: Array,
    rate: float,
    scale: float,
    own: bool,
) -> None:
    """Pull the codes around lane `at` by rate * their distance * exp(-lattice distance / scale).

    By their `own` distance the exponential is exp(-lattice distance^2 / (scale * their distance^2)), of all codes.
    """
    lanes = codes.shape[2]
    row, column, limit = at // lanes, at % lanes, np.inf if own else (NEGLIGIBLE * scale) ** 2
    found, shift = rows_in_reach(geometry, row, limit, rows, apart), geometry[-1, 3]
    for i in range(found):
        other = rows[i]
        centre = column + (shift * ((row % 2) - (other % 2)) if shift > 0.0 else 0.0)
        start, stop = columns_in_reach(geometry, centre, limit, tables[0])
        for lane in range(start, stop):
            away, distance = apart[i] + tables[0, lane], squared[other * lanes + lane]
            decay = away / max(scale * distance, LEAST) if own else sqrt(away) / scale
            tables[GAINS, lane] = min(sqrt(distance) * rate * exp(-decay), 1.0)
        pull_row(codes, x, other, start, stop, tables[GAINS])


@jit
def learn_dsom(
    codes: Array,
    geometry: Floats,
    missing: bool,
    memory: Floats,
    work: Array,
    samples: Array,
    parameters: tuple[Any, ...],
    find: bool,
) -> tuple[int, int, float]:
    """Learn the samples in their order (equations 1 and 2, as `DSOM` states them).

    Args:
        codes: the codebook, (padded dims, rows, lanes); changed.
        geometry: of the lattice; normalised unless the preset counts in cells.
        missing: whether values of the samples may be missing.
        memory: greatest squared distance between any unit and any input so far, and number of inputs; changed.
        work: scratch.
        samples: shape (n, dims), n at least 1.
        parameters: the values of a `DSOMRule`.
        find: whether to find the winner after the last update too.

    Returns:
        The winner of the last sample before its update; -1, and nothing has changed, if a value is not usable. Then
        the winner of the last sample after its update, and its distance, if that was asked for.
    """
    if not all_usable(samples, missing):
        return -1, -1, 0.0
    rule, columns = DSOMRule(*parameters), int(geometry[-1, 0])
    padded, rows, lanes = codes.shape
    flat, x, at = codes.reshape(padded, rows * lanes), np.zeros(padded, codes.dtype), 0
    found, apart, tables = np.empty(rows, np.int64), np.empty(rows), np.empty((TABLES, lanes), codes.dtype)
    for t in range(samples.shape[0]):
        read_sample(samples, t, x)
        squared_distances(flat, x, samples.shape[1], work)
        at, farthest = least_and_greatest(work)
        memory[0] = max(memory[0], farthest)
        memory[1] += 1.0
        closest = float(work[at])
        if closest == 0.0:
            continue
        pace, squared_elasticity = rule.learning_rate / sqrt(memory[0]), rule.elasticity * rule.elasticity
        if rule.preset == ROUGIER:
            scale = max(squared_elasticity * (closest / memory[0]), LEAST)
            pull_by_gaussian(codes, geometry, x, work, at, found, apart, tables, pace, scale, True)
        elif rule.preset == SCHILLACI:
            scale = max(squared_elasticity * sqrt(closest), LEAST)
            _pull_each(codes, geometry, x, work, at, found, apart, tables, rule.learning_rate, scale, False)
        else:
            scale = squared_elasticity / memory[0]
            _pull_each(codes, geometry, x, work, at, found, apart, tables, pace, scale, True)
    unit, distance = nearest_now(codes, columns, x, samples.shape[1], work) if find else (-1, 0.0)
    return unit_at(at, lanes, columns), unit, distance
