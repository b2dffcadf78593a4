"""The dynamic self-organising map of Rougier and Boniface."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from somatopy.maps.lattice import Lattice
from somatopy.maps.lattice_kernels import DSOM_PRESETS, learn_dsom
from somatopy.maps.sheet import LatticeMap
from somatopy.maps.start import check_number, start_codes

__all__ = ["DSOM"]

DEFAULTS = {"rougier": (0.1, 0.1), "schillaci2016": (0.2, 1.5), "printed": (0.1, 0.1)}


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
        elasticity: :math:`\eta`, over 0: how strongly units are coupled. With `rougier` order needs a large one, about
            1.75 for data of two dimensions, .7 of three, .35 to .5 of four; much more, and the map collapses. None is
            the preset's: .1, which gives next to no order, or 1.5 for `schillaci2016`.
        preset: how equations 1 and 2 are normalised: "rougier", "schillaci2016" or "printed".
        lattice: "rectangular" or "hexagonal"; see `Lattice`.
        periodic: whether opposite borders of the lattice touch.
        bounds: range (low, high) of the start codes, for all dimensions or one pair for each, shape (dims, 2).
        init: "uniform" draws the start codes within `bounds`; an array (units, dims) gives them, units row by row.
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

    COUNTERS = ("running_max_squared", "samples_seen")
    FIXED = (*LatticeMap.FIXED, "preset")

    def __init__(
        self,
        shape: Sequence[int] = (30, 30),
        learning_rate: float | None = None,
        elasticity: float | None = None,
        preset: str = "rougier",
        lattice: str = "rectangular",
        periodic: bool = False,
        bounds: ArrayLike = (0, 1),
        init: ArrayLike = "uniform",
        dtype: str = "float64",
        missing: str = "error",
        random_state: int | np.random.Generator | None = None,
    ) -> None:
        self.shape = shape
        self.learning_rate = learning_rate
        self.elasticity = elasticity
        self.preset = preset
        self.lattice = lattice
        self.periodic = periodic
        self.bounds = bounds
        self.init = init
        self.dtype = dtype
        self.missing = missing
        self.random_state = random_state

    def _start(self, dims: int, rng: np.random.Generator) -> dict[str, NDArray[Any]]:
        if self.preset not in DSOM_PRESETS:
            raise ValueError(f"unknown preset {self.preset!r}; valid presets: {list(DSOM_PRESETS)}")
        self._rule()
        codes = start_codes(self.init, self.bounds, self._asked_lattice().units, dims, rng)
        return {"codebook": codes, "running_max_squared": np.array(0.0)}

    def _measured(self, lattice: Lattice) -> NDArray[np.float64]:
        return lattice.geometry(normalised=self._fixed["preset"] != "schillaci2016")

    def _run(self, samples: NDArray[Any]) -> int:
        sheet, (missing, rule) = self._sheet, self._ruled()
        return learn_dsom(
            sheet.codes,
            self._geometry,
            sheet.dims,
            missing,
            self._memory,
            sheet.work,
            samples,
            *rule,
        )

    def _rule(self) -> tuple[float, float, int]:
        """Learning rate and elasticity, the preset's own where they are not given, and the preset's place."""
        preset = self._fixed["preset"] if self.__sklearn_is_fitted__() else self.preset
        own = DEFAULTS[preset]
        rate = own[0] if self.learning_rate is None else self.learning_rate
        elasticity = own[1] if self.elasticity is None else self.elasticity
        check_number("learning_rate", rate, most=1)
        check_number("elasticity", elasticity)
        return float(rate), float(elasticity), DSOM_PRESETS.index(preset)
