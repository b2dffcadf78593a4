"""The self-organising map of Kohonen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from somatopy.maps.lattice_kernels import learn_som
from somatopy.maps.sheet import LatticeMap
from somatopy.maps.start import fading_schedule, start_codes

__all__ = ["SOM"]


class SOM(LatticeMap):
    r"""Self-organising map: a lattice that unfolds over its inputs while its neighbourhood shrinks.

    For each input :math:`v`, with the winner :math:`s` the unit nearest to it, all codes move by

    .. math::
        \Delta w_i = \varepsilon(t) \, \exp\left(-\frac{\|p_i - p_s\|^2}{2 \sigma(t)^2}\right) (v - w_i)

    with lattice positions :math:`p` in cells. Learning rate :math:`\varepsilon` and width :math:`\sigma` fade from a
    first value :math:`a` to a last one :math:`b` as :math:`a (b / a)^{t / T}` with the number :math:`t` of inputs seen
    so far, and stay at the last one from the horizon :math:`T` on: `partial_fit` goes on where learning stands.

    Source: T. Kohonen, Self-organized formation of topologically correct feature maps, Biological Cybernetics 43, 1982;
    the Gaussian and the fading as in H. Ritter, T. Martinetz, K. Schulten, Neural Computation and Self-Organizing Maps,
    Addison-Wesley, 1992.

    Args:
        shape: units along each lattice axis, one to four numbers.
        learning_rate: :math:`\varepsilon`, in (0, 1]: a pair (first, last), or one number that does not fade.
        width: :math:`\sigma`, cells: a pair (first, last), or one number that does not fade; None goes from half the
            longest axis to half a cell.
        horizon: :math:`T`, inputs over which both fade.
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
        >>> som = SOM(shape=(8, 8), horizon=5000, random_state=0).partial_fit(inputs)
        >>> unit, distance = som.winner([0.5, 0.5])
        >>> distance < 0.1
        True
    """

    def __init__(
        self,
        shape: Sequence[int] = (30, 30),
        learning_rate: float | tuple[float, float] = (0.5, 0.01),
        width: float | tuple[float, float] | None = None,
        horizon: float = 20_000,
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
        self.width = width
        self.horizon = horizon
        self.lattice = lattice
        self.periodic = periodic
        self.bounds = bounds
        self.init = init
        self.dtype = dtype
        self.missing = missing
        self.random_state = random_state

    def _start(self, dims: int, rng: np.random.Generator) -> dict[str, NDArray[Any]]:
        self._rule()
        return {"codebook": start_codes(self.init, self.bounds, self._asked_lattice().units, dims, rng)}

    def _rule(self) -> NDArray[np.float64]:
        width = (max(max(self.topology_.shape) / 2, 0.5), 0.5) if self.width is None else self.width
        return fading_schedule(self.learning_rate, width, self.horizon)

    def _run(self, samples: NDArray[Any]) -> int:
        sheet, (missing, schedule) = self._sheet, self._ruled()
        return learn_som(
            sheet.codes,
            self._geometry,
            sheet.dims,
            missing,
            self._memory,
            sheet.work,
            samples,
            schedule,
        )
