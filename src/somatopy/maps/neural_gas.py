"""The neural gas of Martinetz and Schulten."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from somatopy.maps.neural_gas_kernels import learn_neural_gas
from somatopy.maps.sheet import SheetMap
from somatopy.maps.start import check_units, fading_schedule, start_codes

__all__ = ["NeuralGas"]


class NeuralGas(SheetMap):
    r"""Neural gas: units without a lattice, which move by their rank among the units nearest to the input.

    For each input :math:`v`, with :math:`k_i` the number of units nearer to it than unit :math:`i`, all codes move by

    .. math::
        \Delta w_i = \varepsilon(t) \, e^{-k_i / \lambda(t)} \, (v - w_i)

    Learning rate :math:`\varepsilon` and width :math:`\lambda` fade from a first value :math:`a` to a last one
    :math:`b` as :math:`a (b / a)^{t / T}` with the number :math:`t` of inputs seen so far, and stay there from the
    horizon :math:`T` on: `partial_fit` goes on where learning stands. Of units equally near, the first ranks first.

    Source: T. Martinetz, K. Schulten, A "neural-gas" network learns topologies, Artificial Neural Networks, 1991;
    T. Martinetz, S. Berkovich, K. Schulten, IEEE Transactions on Neural Networks 4(4), 1993.

    Args:
        units: how many.
        learning_rate: :math:`\varepsilon`, in (0, 1]: a pair (first, last), or one number that does not fade.
        width: :math:`\lambda`, ranks: a pair (first, last), or one number that does not fade.
        horizon: :math:`T`, inputs over which both fade.
        bounds: range (low, high) of the start codes, for all dimensions or one pair for each, shape (dims, 2).
        init: "uniform" draws the start codes within `bounds`; an array (units, dims) gives them.
        dtype: precision, "float64" or "float32".
        missing: "error" refuses inputs with NaN; "ignore" uses the coordinates that were observed.
        random_state: seed or NumPy Generator of the start codes.

    Example:
        >>> import numpy as np
        >>> inputs = np.random.default_rng(0).random((5000, 2))
        >>> gas = NeuralGas(units=64, horizon=5000, random_state=0).partial_fit(inputs)
        >>> unit, distance = gas.winner([0.5, 0.5])
        >>> distance < 0.1
        True
    """

    def __init__(
        self,
        units: int = 100,
        learning_rate: float | tuple[float, float] = (0.5, 0.005),
        width: float | tuple[float, float] = (10.0, 0.01),
        horizon: float = 20_000,
        bounds: ArrayLike = (0, 1),
        init: ArrayLike = "uniform",
        dtype: str = "float64",
        missing: str = "error",
        random_state: int | np.random.Generator | None = None,
    ) -> None:
        self.units = units
        self.learning_rate = learning_rate
        self.width = width
        self.horizon = horizon
        self.bounds = bounds
        self.init = init
        self.dtype = dtype
        self.missing = missing
        self.random_state = random_state

    def _start(self, dims: int, rng: np.random.Generator) -> dict[str, NDArray[Any]]:
        check_units("units", self.units)
        self._rule()
        return {"codebook": start_codes(self.init, self.bounds, self.units, dims, rng)}

    def _columns(self, units: int) -> int:
        return units

    def _run(self, samples: NDArray[Any]) -> int:
        sheet, (missing, schedule) = self._sheet, self._ruled()
        return learn_neural_gas(
            sheet.codes,
            sheet.columns,
            sheet.dims,
            missing,
            self._memory,
            sheet.work,
            samples,
            schedule,
        )

    def _rule(self) -> NDArray[np.float64]:
        return fading_schedule(self.learning_rate, self.width, self.horizon)
