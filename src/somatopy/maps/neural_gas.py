"""The neural gas of Martinetz and Schulten."""

from __future__ import annotations

from math import ceil, exp
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from somatopy._jit import jit
from somatopy.maps.first_codes import first_codes
from somatopy.maps.kernels import all_usable, nearest_now, read_sample, squared_distances
from somatopy.maps.sheet import FadingMap
from somatopy.maps.start import NEGLIGIBLE, Fading, check_units, faded, fading_rule

__all__ = ["NeuralGas"]

Array = NDArray[Any]
Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

U = np.uint64  # unsigned indices spare the compiler Python's meaning of negative ones
BLOCK = U(96)


class NeuralGas(FadingMap):
    r"""Neural gas: units without a lattice, which move by their rank among the units nearest to the input.

    For each input :math:`v`, with :math:`k_i` the number of units nearer to it than unit :math:`i`, all codes move by

    .. math::
        \Delta w_i = \varepsilon(t) \, e^{-k_i / \lambda(t)} \, (v - w_i)

    Learning rate :math:`\varepsilon` and width :math:`\lambda` fade from a first value :math:`a` to a last one
    :math:`b` as :math:`a (b / a)^{t / T}` with the number :math:`t` of inputs seen so far, and stay there from the
    horizon :math:`T` on: `partial_fit` goes on where learning stands. Where `fit` starts, :math:`T` is the number of
    inputs that it learns, so that both are at their last values when it ends. Of units equally near, the first ranks
    first.

    Source: T. Martinetz, K. Schulten, A "neural-gas" network learns topologies, Artificial Neural Networks, 1991;
    T. Martinetz, S. Berkovich, K. Schulten, IEEE Transactions on Neural Networks 4(4), 1993.

    Args:
        units: how many.
        learning_rate: :math:`\varepsilon`, in (0, 1]: a pair (first, last), or one number that does not fade.
        width: :math:`\lambda`, ranks: a pair (first, last), or one number that does not fade.
        horizon: :math:`T`, inputs over which both fade where `partial_fit` or `learn_one` start.
        bounds: range (low, high) in which start codes are drawn, for all dimensions or one pair for each, shape
            (dims, 2); None is the range of the rows where `fit` starts, and 0 to 1 otherwise.
        init: "sample" takes rows as start codes, "uniform" draws them within `bounds`; an array (units, dims) gives
            them. "auto" is "sample" where `fit` starts, and "uniform" where `partial_fit` or `learn_one` do, since they
            know no table.
        epochs: passes of `fit` over the rows, in a new random order each; None is as many as make 500 inputs a unit.
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
        bounds: ArrayLike | None = None,
        init: ArrayLike = "auto",
        dtype: str = "float64",
        missing: str = "error",
        random_state: int | np.random.Generator | None = None,
        epochs: int | None = None,
    ) -> None:
        self.units = units
        self.learning_rate = learning_rate
        self.width = width
        self.horizon = horizon
        self.bounds = bounds
        self.init = init
        self.epochs = epochs
        self.dtype = dtype
        self.missing = missing
        self.random_state = random_state

    def _start_from(self, samples: Array, rng: np.random.Generator) -> dict[str, Array]:
        check_units("units", self.units)
        fading_rule(self.learning_rate, self.width, self.horizon)
        return {"codebook": first_codes(self.init, self.bounds, self.units, samples, rng), "horizon": np.array(0.0)}

    def _units_in_a_row(self, units: int) -> int:
        return units

    def _run(self, samples: Array, find: bool) -> tuple[int, int, float]:
        sheet = self._sheet
        return learn_neural_gas(
            sheet.codes,
            sheet.columns,
            self._allows_missing(),
            self._memory,
            sheet.work,
            samples,
            fading_rule(self.learning_rate, self.width, self._fades_over),
            find,
        )


@jit
def _farther(squared: Array, a: int, b: int) -> bool:
    """Whether unit a ranks behind unit b: by distance, equal ones by number."""
    return bool(squared[a] > squared[b] or (squared[a] == squared[b] and a > b))


@jit
def _move_down(heap: Integers, size: int, squared: Array) -> None:
    """Put the first of a heap, of which the farthest unit comes first, into its place."""
    place = 0
    while 2 * place + 1 < size:
        child = 2 * place + 1
        if child + 1 < size and _farther(squared, heap[child + 1], heap[child]):
            child += 1
        if not _farther(squared, heap[child], heap[place]):
            return
        heap[place], heap[child] = heap[child], heap[place]
        place = child


@jit
def _move_up(heap: Integers, place: int, squared: Array) -> None:
    """Put the last of a heap, which stands at `place`, into its place."""
    while place > 0 and _farther(squared, heap[place], heap[(place - 1) // 2]):
        heap[place], heap[(place - 1) // 2] = heap[(place - 1) // 2], heap[place]
        place = (place - 1) // 2


@jit
def _collect_nearest(squared: Array, units: int, count: int, heap: Integers) -> None:
    """Fill the heap with the `count` nearest of the units.

    Once it is full, most blocks of units hold none that is nearer than its farthest, which vectors tell at once.
    """
    for unit in range(count):
        heap[unit] = unit
        _move_up(heap, unit, squared)
    start, end = U(count), U(units)
    while start < end:
        stop, nearer, limit = min(start + BLOCK, end), np.int64(0), squared[heap[0]]
        for unit in range(start, stop):
            nearer |= np.int64(squared[unit] < limit)
        if nearer:
            for unit in range(np.int64(start), np.int64(stop)):
                if squared[unit] < squared[heap[0]]:
                    heap[0] = unit
                    _move_down(heap, count, squared)
        start = stop


@jit
def _pull(codes: Array, x: Array, unit: int, gain: float) -> None:
    """Move a unit towards x, in the coordinates of x that are known."""
    for k in range(codes.shape[0]):
        if x[k] == x[k]:
            codes[k, unit] += gain * (x[k] - codes[k, unit])


@jit
def learn_neural_gas(
    codes: Array,
    units: int,
    missing: bool,
    memory: Floats,
    work: Array,
    samples: Array,
    parameters: tuple[Any, ...],
    find: bool,
) -> tuple[int, int, float]:
    """Learn the samples in their order (the equation of `NeuralGas`).

    Args:
        codes: the codebook, (padded dims, 1, lanes); changed.
        units: how many; lanes behind them are copies of the last.
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
    fade, flat, x = Fading(*parameters), codes[:, 0], np.zeros(codes.shape[0], codes.dtype)
    heap, winner = np.empty(units, np.int64), 0
    for t in range(samples.shape[0]):
        read_sample(samples, t, x)
        rate = faded(fade.first_rate, fade.last_rate, memory[0], fade.horizon)
        width = faded(fade.first_width, fade.last_width, memory[0], fade.horizon)
        memory[0] += 1.0
        squared_distances(flat, x, samples.shape[1], work)
        count = int(min(ceil(NEGLIGIBLE * width), units))
        _collect_nearest(work, units, count, heap)
        for rank in range(count - 1, -1, -1):  # the farthest leaves the heap first
            winner = heap[0]
            _pull(flat, x, winner, rate * exp(-rank / width))
            heap[0] = heap[rank]
            _move_down(heap, rank, work)
        flat[:, units:] = flat[:, units - 1 : units]
    unit, distance = nearest_now(codes, units, x, samples.shape[1], work) if find else (-1, 0.0)
    return winner, unit, distance
