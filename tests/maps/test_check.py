"""The laws of maps: a sound map keeps them, and a map that breaks one is told which."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from copy import deepcopy
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray
from sklearn.utils.validation import check_is_fitted

from somatopy.contract import ContractError
from somatopy.maps import Lattice, Map
from somatopy.maps.check import check_map

Array = NDArray[Any]


class Means(Map):
    """A sound map: each unit is the mean of the inputs that it has won, the first of them in place of its start."""

    def __init__(
        self, max_units: int = 5, dtype: str = "float64", missing: str = "error", random_state: Any = None
    ) -> None:
        self.max_units = max_units
        self.dtype = dtype
        self.missing = missing
        self.random_state = random_state

    def _start(self, dims: int, rng: np.random.Generator) -> dict[str, Array]:
        return {"codebook": rng.random((self.max_units, dims)), "wins": np.zeros(self.max_units, dtype=int)}

    def _step(self, x: Array) -> int:
        unit = self._winner(x)
        self._learned["wins"][unit] += 1
        self._move(self._learned["codebook"][unit], x, self._learned["wins"][unit])
        return unit

    def _winner(self, x: Array) -> int:
        return int(self._winners(x[None])[0])

    def _move(self, code: Array, x: Array, wins: Any) -> None:
        seen = ~np.isnan(x)
        code[seen] += (x[seen] - code[seen]) / wins


# Members, parameters and seeds


class Stranger:
    """It derives from nothing."""


class Unmissing(Means):
    def __init__(self, max_units: int = 5, dtype: str = "float64", random_state: Any = None) -> None:
        self.max_units = max_units
        self.dtype = dtype
        self.random_state = random_state


class Eager(Means):
    def __init__(
        self, max_units: int = 5, dtype: str = "float64", missing: str = "error", random_state: Any = None
    ) -> None:
        super().__init__(max_units, dtype, missing, random_state)
        self.initialise(3)


class Guessing(Means):
    def predict(self, X: ArrayLike) -> Array:
        return super().predict(X) if self.__sklearn_is_fitted__() else np.zeros(len(np.asarray(X)), dtype=int)


class Unseeded(Means):
    def _start(self, dims: int, rng: np.random.Generator) -> dict[str, Array]:
        return super()._start(dims, np.random.default_rng())


class Wasteful(Means):
    def _start(self, dims: int, rng: np.random.Generator) -> dict[str, Array]:
        rng.random()
        return super()._start(dims, np.random.default_rng(0))


class Integral(Means):
    def _start(self, dims: int, rng: np.random.Generator) -> dict[str, Array]:
        whole = isinstance(self.random_state, int)
        return super()._start(dims, rng if whole else np.random.default_rng(0))


# Learning


class Batching(Means):
    def _learn(self, samples: Array) -> int:
        unit = super()._learn(samples)
        self._learned["codebook"] += 0.01 * (np.nanmean(samples) - self._learned["codebook"])
        return unit


class Miscounting(Means):
    @property
    def samples_seen_(self) -> int:
        return super().samples_seen_ - 1


class Confused(Means):
    def learn_one(self, x: ArrayLike) -> int:
        return (super().learn_one(x) + 1) % self.max_units


class Oblivious(Means):
    def _winner(self, x: Array) -> int:
        return int(np.argmin(((self._codes() - x) ** 2).sum(axis=1)))


class Failing(Means):
    def _step(self, x: Array) -> int:
        raise KeyError("oops")


class Numeric(Means):
    def _winner(self, x: Array) -> Any:
        return self._winners(x[None])[0]


class Belated(Means):
    def learn_and_find(self, x: ArrayLike) -> tuple[int, float]:
        if not self.__sklearn_is_fitted__():
            return super().learn_and_find(x)
        found = self.winner(x)
        self.learn_one(x)
        return found


class Scribbling(Means):
    def _step(self, x: Array) -> int:
        unit = super()._step(x)
        x[:] = 0.0
        return unit


class Clinging(Means):
    def _start(self, dims: int, rng: np.random.Generator) -> dict[str, Array]:
        return super()._start(dims, rng) | {"last": np.zeros(dims)}

    def _step(self, x: Array) -> int:
        self._learned["last"] = x
        return super()._step(x)


class Ordered(Means):
    def partial_fit(self, X: ArrayLike, y: object = None) -> Any:
        given = np.asarray(X)
        return super().partial_fit(given.ravel("A").reshape(given.shape))


class Trusting(Means):
    def _usable_input(self, x: ArrayLike) -> Array:
        return super()._usable_input(
            np.nan_to_num(x, nan=np.nan if self.missing == "ignore" else 0.0, posinf=0.0, neginf=0.0)
        )


class Hasty(Means):
    def learn_one(self, x: ArrayLike) -> int:
        counts = self.__dict__.get("_learned", {"samples_seen": np.zeros(1)})["samples_seen"]
        counts += 1
        unit = super().learn_one(x)
        counts -= 1
        return unit


class Stretching(Means):
    def winner(self, x: ArrayLike) -> tuple[int, float]:
        check_is_fitted(self)
        return super().winner(np.broadcast_to(x, self.n_features_in_) if np.size(x) == 1 else x)


# Gaps and precision


class Slower(Means):
    def _move(self, code: Array, x: Array, wins: Any) -> None:
        super()._move(code, x, wins + (self.missing == "ignore"))


class Holed(Means):
    def _move(self, code: Array, x: Array, wins: Any) -> None:
        code += (x - code) / wins


class Filling(Means):
    def _move(self, code: Array, x: Array, wins: Any) -> None:
        super()._move(code, np.nan_to_num(x), wins)


class Skipping(Means):
    def _move(self, code: Array, x: Array, wins: Any) -> None:
        if not np.isnan(x).any():
            super()._move(code, x, wins)


class Unscaled(Means):
    def _distances(self, samples: Array) -> Array:
        gaps = samples[:, None] - self._codes()
        distances: Array = np.sqrt(np.nansum(gaps**2, axis=2))
        return distances


class Widening(Means):
    @property
    def codebook_(self) -> Array:
        return super().codebook_.astype(np.float64)


class Coarse(Means):
    def _move(self, code: Array, x: Array, wins: Any) -> None:
        super()._move(code, x, wins)
        if code.dtype == np.float32:
            code[:] = code.astype(np.float16)


class Converting(Means):
    def _step(self, x: Array) -> int:
        self._learned["codebook"] = self._learned["codebook"].astype(self.dtype)
        return super()._step(x)


# Looking


class Squared(Means):
    def _distances(self, samples: Array) -> Array:
        return super()._distances(samples) ** 2


class Partial(Means):
    def transform_chunks(self, X: ArrayLike) -> Iterator[Array]:
        yield self.transform(X)[1:]


class Nameless(Means):
    @property
    def _n_features_out(self) -> int:
        return 2


class Dissenting(Means):
    def predict(self, X: ArrayLike) -> Array:
        order: Array = self.transform(X).argsort(axis=1)
        return order[:, 1]


class Unlabelled(Means):
    def fit_predict(self, X: ArrayLike, y: object = None) -> Array:
        labels: Array = super().fit_predict(X)
        return labels[::-1]


class Twice(Means):
    def fit(self, X: ArrayLike, y: object = None) -> Twice:
        return super().fit(X).partial_fit(X)


class Lenient(Means):
    def winners(self, x: ArrayLike, k: int = 2) -> tuple[Array, Array]:
        check_is_fitted(self)
        return super().winners(x, min(max(k, 1), self.max_units))


class Circular(Means):
    def code(self, unit: int) -> Array:
        check_is_fitted(self)
        return super().code(unit % self.max_units)


class Contrary(Means):
    def _winners(self, samples: Array) -> Array:
        last: Array = self.max_units - 1 - self._distances(samples)[:, ::-1].argmin(axis=1)
        return last


class Dangling(Means):
    @property
    def topology_(self) -> Lattice:
        return Lattice((self.max_units + 1,))


class Backward(Means):
    @property
    def topology_(self) -> Any:
        lattice = Lattice((self.max_units,))
        lattice.__dict__["edges"] = lattice.edges[:, ::-1]
        return lattice


class Estranged(Means):
    @property
    def topology_(self) -> Any:
        lattice = Lattice((self.max_units,))
        lattice.__dict__["edges"] = np.array([[0, 4]])
        return lattice


class Watchful(Means):
    def winner(self, x: ArrayLike) -> tuple[int, float]:
        found = super().winner(x)
        self._learned["wins"][found[0]] += 1
        return found


class Lending(Means):
    @property
    def codebook_(self) -> Array:
        check_is_fitted(self)
        return self._codes()


class Dreaming(Means):
    dreams = 0

    def predict(self, X: ArrayLike) -> Array:
        self.dreams += 1
        return super().predict(X)

    def _move(self, code: Array, x: Array, wins: Any) -> None:
        super()._move(code, x, wins + self.dreams)


# Keeping


class Enduring(Means):
    learned = 0

    def _move(self, code: Array, x: Array, wins: Any) -> None:
        self.learned += 1
        super()._move(code, x, wins + self.learned)


class Undying(Means):
    def __sklearn_clone__(self) -> Any:
        return deepcopy(self)


class Lax(Means):
    def _check_state(self, arrays: dict[str, Array], expected: dict[str, Array]) -> None: ...


class Early(Means):
    def restore(self, state: Any) -> None:
        if self.__sklearn_is_fitted__():
            self._learned["samples_seen"] += 1
        super().restore(state)


class Secretive(Means):
    def _start(self, dims: int, rng: np.random.Generator) -> dict[str, Array]:
        self.learned = 0
        return super()._start(dims, rng)

    def _move(self, code: Array, x: Array, wins: Any) -> None:
        self.learned += 1
        super()._move(code, x, wins + self.learned)


class Forgetful(Means):
    def __getstate__(self) -> Any:
        kept = super().__getstate__()
        return {name: value for name, value in kept.items() if name not in ("_learned", "n_features_in_")}


class Adopting(Means):
    def restore(self, state: Any) -> None:
        super().restore(state)
        self._learned["wins"] = state["wins"]


class Hoarding(Means):
    def _step(self, x: Array) -> int:
        self.__dict__.setdefault("diary", []).append(x.copy())
        return super()._step(x)


class Boundless(Means):
    def _start(self, dims: int, rng: np.random.Generator) -> dict[str, Array]:
        return {"codebook": rng.random((self.max_units + 1, dims)), "wins": np.zeros(self.max_units + 1, dtype=int)}


class Prepared(Means):
    def __init__(
        self, max_units: int = 5, dtype: str = "float64", missing: str = "error", random_state: Any = None
    ) -> None:
        super().__init__(max_units, dtype, missing, random_state)
        self.half = max_units // 2


THE_SAME = Means()


def test_a_sound_map_passes() -> None:
    """The one that the others spoil."""
    check_map(Means)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (Stranger, "all members and parameters of Map.*Stranger lacks .*codebook_"),
        (Unmissing, "all members and parameters of Map.*Unmissing lacks missing"),
        (lambda: THE_SAME, r"make\(\) gives a fresh map each time"),
        (Eager, r"make\(\) gives a fresh map each time"),
        (Guessing, "looking raises NotFittedError.*predict answered"),
        (Unseeded, "two of one seed differ"),
        (Wasteful, "seeds 1 and 2 give the same"),
        (Integral, r"random_state=np.random.default_rng\(1\) differ"),
        (Batching, "agree bit for bit.*learn_one and partial_fit differ"),
        (Miscounting, "samples_seen_ 79 of 80"),
        (Confused, "learn_one returns the winner before the update"),
        (Oblivious, r'learn_one returns the winner before the update \(missing="ignore"\)'),
        (Failing, "_start and _step run, and leave what the map needs.*KeyError: 'oops'"),
        (Belated, "learn_and_find gives what winner gives after learn_one.*where winner said"),
        (Numeric, r"learn_one returns the winner before the update.*np\.int64"),
        (Squared, "transform gives the Euclidean distance"),
        (Partial, "transform_chunks differs"),
        (Nameless, "2 names of features for 5 units"),
        (Dissenting, "winner, winners, predict and transform agree.*predict says"),
        (Unlabelled, "fit learns each row n_iter_ times.*fit_predict and labels_ differ"),
        (Twice, "fit learns each row n_iter_ times.*1 passes, 160 inputs"),
        (Lenient, "winners took k=0"),
        (Circular, r"code\(unit\) is that row of codebook_.*code\(5\) of as many units"),
        (Contrary, "of units equally near the first wins"),
        (Dangling, "edges of topology_ join two units that are there"),
        (Backward, "the lower number first"),
        (Estranged, "not adjacent"),
        (Watchful, r"looking changes nothing.*state\(\) is another"),
        (Lending, "arrays that are given away are the caller's"),
        (Dreaming, "looking changes nothing.*than without looking"),
        (Scribbling, "inputs of any kind teach the same, and stay as they are.*partial_fit of a plain array"),
        (Ordered, "partial_fit of an array in Fortran order teaches something else"),
        (Clinging, "a map keeps no input"),
        (Trusting, "refused before anything changes.*learn_one took"),
        (Stretching, r"refused before anything changes.*winner took \[1.0\]"),
        (Hasty, "refused before anything changes.*too late"),
        (Slower, 'missing="ignore" changes nothing where nothing is missing'),
        (Holed, "codes are finite"),
        (Unscaled, "those of nan_euclidean_distances"),
        (Skipping, "observed coordinates of an input are learned from"),
        (Filling, "where a coordinate is missing, that of no unit moves.*of 5 units 1 moved"),
        (Widening, "codes have the precision.*float64 where float32"),
        (Coarse, "a float32 map what it teaches a float64 map"),
        (Converting, "a dtype that is set while learning holds from the next start on"),
        (Enduring, "fit goes on from what was learned before"),
        (Undying, "the clone of a map that has learned has learned"),
        (Lax, "a state that does not fit is refused.*restore took a state with"),
        (Early, "a state that does not fit is refused.*too late"),
        (Secretive, "learning goes on bit for bit, at every stage.*taught, file: it goes on in another way"),
        (Forgetful, "learning goes on bit for bit, at every stage.*pickle"),
        (Hoarding, "memory is bounded: bytes a unit.*bytes a unit after 1000 inputs"),
        (Boundless, "memory is bounded.*6 units, where max_units is 5"),
        (Adopting, r"restore\(\) leaves the state that it is given alone"),
        (Prepared, "an estimator and a transformer of scikit-learn"),
    ],
)
def test_each_law_is_held(make: Callable[[], Map], message: str) -> None:
    """One map that breaks each."""
    with pytest.raises(ContractError, match=message):
        check_map(make)
