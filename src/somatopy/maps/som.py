"""The self-organising map of Kohonen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from somatopy._jit import jit
from somatopy.maps.first_codes import first_codes
from somatopy.maps.kernels import all_usable, nearest_lane, nearest_now, read_sample, unit_at
from somatopy.maps.lattice_kernels import LEAST, TABLES, pull_by_gaussian
from somatopy.maps.sheet import FadingMap, LatticeMap
from somatopy.maps.start import Fading, faded, fading_rule, remembered

__all__ = ["SOM"]

Array = NDArray[Any]
Floats = NDArray[np.float64]


class SOM(FadingMap, LatticeMap):
    r"""Self-organising map: a lattice that unfolds over its inputs while its neighbourhood shrinks.

    For each input :math:`v`, with the winner :math:`s` the unit nearest to it, all codes move by

    .. math::
        \Delta w_i = \varepsilon(t) \, \exp\left(-\frac{\|p_i - p_s\|^2}{2 \sigma(t)^2}\right) (v - w_i)

    with lattice positions :math:`p` in cells. Learning rate :math:`\varepsilon` and width :math:`\sigma` fade from a
    first value :math:`a` to a last one :math:`b` as :math:`a (b / a)^{t / T}` with the number :math:`t` of inputs seen
    so far, and stay at the last one from the horizon :math:`T` on: `partial_fit` goes on where learning stands. Where
    `fit` starts, :math:`T` is the number of inputs that it learns, so that both are at their last values when it ends.

    Source: T. Kohonen, Self-organized formation of topologically correct feature maps, Biological Cybernetics 43, 1982;
    the Gaussian and the fading as in H. Ritter, T. Martinetz, K. Schulten, Neural Computation and Self-Organizing Maps,
    Addison-Wesley, 1992.

    Args:
        shape: units along each lattice axis, one to four numbers.
        learning_rate: :math:`\varepsilon`, in (0, 1]: a pair (first, last), or one number that does not fade.
        width: :math:`\sigma`, cells: a pair (first, last), or one number that does not fade; None goes from half the
            longest axis to half a cell.
        horizon: :math:`T`, inputs over which both fade where `partial_fit` or `learn_one` start.
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
        >>> from sklearn.datasets import load_iris
        >>> iris = load_iris(as_frame=True).data
        >>> som = SOM(shape=(10, 10), random_state=0).fit(iris)
        >>> som.score(iris) > -0.3  # cm from a flower to its unit, in the mean; a single unit is at best 1.9 away
        True
        >>> som.predict(iris).shape, som.n_iter_
        ((150,), 334)
    """

    def __init__(
        self,
        shape: Sequence[int] = (30, 30),
        learning_rate: float | tuple[float, float] = (0.5, 0.01),
        width: float | tuple[float, float] | None = None,
        horizon: float = 20_000,
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
        self.width = width
        self.horizon = horizon
        self.lattice = lattice
        self.periodic = periodic
        self.bounds = bounds
        self.init = init
        self.epochs = epochs
        self.dtype = dtype
        self.missing = missing
        self.random_state = random_state

    def _start_from(self, samples: Array, rng: np.random.Generator) -> dict[str, Array]:
        lattice = self._lattice_of_parameters()
        som_rule(lattice.shape, self.learning_rate, self.width, self.horizon)
        return {"codebook": first_codes(self.init, self.bounds, lattice, samples, rng), "horizon": np.array(0.0)}

    def _neighbourhood(self, unit: int) -> Floats:
        width = som_rule(self._lattice.shape, self.learning_rate, self.width, self.horizon)[3]
        pulls: Floats = np.exp(-0.5 * (self._lattice.distances(unit) / width) ** 2)
        return pulls

    def _run(self, samples: Array, find: bool) -> tuple[int, int, float]:
        sheet = self._sheet
        return learn_som(
            sheet.codes,
            self._geometry,
            self._allows_missing(),
            self._memory,
            sheet.work,
            samples,
            som_rule(self._lattice.shape, self.learning_rate, self.width, self._fades_over),
            find,
        )


@remembered
def som_rule(shape: tuple[int, ...], learning_rate: Any, width: Any, horizon: Any) -> tuple[Any, ...]:
    """The values of a `Fading`; where no width is given, it goes from half the longest axis to half a cell.

    Raises:
        ValueError: if one is not valid.
    """
    width = (max(max(shape) / 2, 0.5), 0.5) if width is None else width
    return fading_rule(learning_rate, width, horizon)


@jit
def learn_som(
    codes: Array,
    geometry: Floats,
    missing: bool,
    memory: Floats,
    work: Array,
    samples: Array,
    parameters: tuple[Any, ...],
    find: bool,
) -> tuple[int, int, float]:
    """Learn the samples in their order (the equation of `SOM`).

    Args:
        codes: the codebook, (padded dims, rows, lanes); changed.
        geometry: of the lattice, in cells.
        missing: whether values of the samples may be missing.
        memory: number of inputs so far; changed.
        work: scratch.
        samples: shape (n, dims), n at least 1.
        parameters: the values of a `Fading`.
        find: whether to find the winner after the last update too.

    Returns:
        The winner of the last sample before its update; -1, and nothing has changed, if a value is not usable. Then
        the winner of the last sample after its update, and its distance, if that was asked for.
    """
    if not all_usable(samples, missing):
        return -1, -1, 0.0
    fade, columns = Fading(*parameters), int(geometry[-1, 0])
    padded, rows, lanes = codes.shape
    flat, x, at = codes.reshape(padded, rows * lanes), np.zeros(padded, codes.dtype), 0
    found, apart, tables = np.empty(rows, np.int64), np.empty(rows), np.empty((TABLES, lanes), codes.dtype)
    for t in range(samples.shape[0]):
        read_sample(samples, t, x)
        at = nearest_lane(flat, x, samples.shape[1], work)
        rate = faded(fade.first_rate, fade.last_rate, memory[0], fade.horizon)
        width = faded(fade.first_width, fade.last_width, memory[0], fade.horizon)
        memory[0] += 1.0
        scale = max(2.0 * width * width, LEAST)
        pull_by_gaussian(codes, geometry, x, work, at, found, apart, tables, rate, scale, False)
    unit, distance = nearest_now(codes, columns, x, samples.shape[1], work) if find else (-1, 0.0)
    return unit_at(at, lanes, columns), unit, distance
