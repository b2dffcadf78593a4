"""What every map owes its users, run over every map and over a toy that only gives the abstract methods."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable, Mapping
from typing import Any, Self

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray
from sklearn.base import clone
from sklearn.exceptions import NotFittedError
from sklearn.utils.estimator_checks import check_estimator

from somatopy.maps import DSOM, Map
from somatopy.maps.base import as_sample, refuse

Floats = NDArray[np.float64]


class RunningMean(Map):
    """A map of one unit, the mean of its inputs."""

    @property
    def codebook_(self) -> Floats:
        return self._mean[None].copy()

    def initialise(self, dims: int) -> Self:
        self._mean, self._count, self.n_features_in_ = np.zeros(dims), 0, dims
        return self

    def learn_one(self, x: ArrayLike) -> int:
        sample = as_sample(x)
        if not self.__sklearn_is_fitted__():
            self.initialise(sample.size)
        self.winner(sample)
        self._learn(sample[None])
        return 0

    def winner(self, x: ArrayLike) -> tuple[int, float]:
        sample = as_sample(x)
        if not self.__sklearn_is_fitted__():
            raise NotFittedError
        if sample.shape != self._mean.shape or not np.isfinite(sample).all():
            raise ValueError(f"bad input {sample}")
        return 0, float(np.linalg.norm(sample - self._mean))

    def state(self) -> dict[str, NDArray[Any]]:
        return {"mean": self._mean.copy(), "count": np.array(self._count)}

    def restore(self, state: Mapping[str, ArrayLike]) -> None:
        self.initialise(np.asarray(state["mean"]).size)
        self._mean, self._count = np.array(state["mean"], dtype=float), int(np.asarray(state["count"]))

    def _learn(self, samples: Floats) -> None:
        for sample in samples:
            self._count += 1
            self._mean = self._mean + (sample - self._mean) / self._count

    def _winners(self, samples: Floats) -> NDArray[np.int64]:
        return np.zeros(len(samples), dtype=np.int64)

    def __sklearn_is_fitted__(self) -> bool:
        return hasattr(self, "_mean")


def dsom() -> DSOM:
    return DSOM(shape=(5, 4), elasticity=0.5, random_state=3)


MAPS = [pytest.param(dsom, id="DSOM"), pytest.param(RunningMean, id="toy")]
every_map = pytest.mark.parametrize("make", MAPS)
INPUTS = np.random.default_rng(1).random((60, 3))


def memory(trained: Map) -> bytes:
    """All that a map has learned, as bytes."""
    return b"".join(value.tobytes() for _, value in sorted(trained.state().items()))


@pytest.mark.filterwarnings("ignore::sklearn.exceptions.SkipTestWarning")
@every_map
def test_passes_scikit_learns_checks(make: Callable[[], Map]) -> None:
    """A map is a scikit-learn estimator and transformer."""
    check_estimator(make())


@every_map
def test_batch_learning_is_repeated_learning_of_one(make: Callable[[], Map]) -> None:
    """partial_fit, in any pieces, and repeated learn_one agree to the last bit."""
    one, whole, pieces = make(), make(), make()
    for x in INPUTS:
        one.learn_one(x)
    whole.partial_fit(INPUTS)
    pieces.partial_fit(INPUTS[:7]).partial_fit(INPUTS[7:8]).partial_fit(INPUTS[8:])
    assert memory(one) == memory(whole) == memory(pieces)


@every_map
def test_learning_returns_the_winner_before_the_update(make: Callable[[], Map]) -> None:
    """What learn_one returns is what winner said just before."""
    learner = make().initialise(3)
    for x in INPUTS:
        unit, _ = learner.winner(x)
        assert learner.learn_one(x) == unit


@every_map
def test_looking_changes_nothing(make: Callable[[], Map]) -> None:
    """winner, predict, transform, codebook_ and state are pure: learning goes on as if they had not been called."""
    watched, alone = make().partial_fit(INPUTS[:20]), make().partial_fit(INPUTS[:20])
    for x in INPUTS[20:]:
        before = memory(watched)
        watched.winner(x), watched.predict(INPUTS), watched.transform(INPUTS)
        watched.codebook_[:] = 7.0
        assert memory(watched) == before
        watched.learn_one(x)
        alone.learn_one(x)
    assert memory(watched) == memory(alone)


@every_map
def test_winner_predict_and_transform_agree(make: Callable[[], Map]) -> None:
    """The winner is the unit of the least distance, and winner tells that distance."""
    trained = make().fit(INPUTS)
    distances = trained.transform(INPUTS)
    np.testing.assert_array_equal(trained.predict(INPUTS), distances.argmin(axis=1))
    for x, row in zip(INPUTS, distances, strict=True):
        unit, distance = trained.winner(x)
        assert unit == row.argmin()
        assert distance == pytest.approx(row.min(), rel=1e-13)


@every_map
def test_inputs_of_any_kind_are_neither_kept_nor_changed(make: Callable[[], Map]) -> None:
    """Lists, read-only, strided and Fortran-ordered arrays teach the same; the caller's arrays stay the caller's."""
    frozen = INPUTS.copy()
    frozen.flags.writeable = False
    strided = np.repeat(np.repeat(INPUTS, 2, axis=0), 3, axis=1)[::2, ::3]
    expected = memory(make().partial_fit(INPUTS))
    for given in (frozen, strided, np.asfortranarray(INPUTS), INPUTS.tolist()):
        kept = copy.deepcopy(given)
        one = make()
        for x in given:
            one.learn_one(x)
        assert memory(one) == memory(make().partial_fit(given)) == expected
        np.testing.assert_array_equal(given, kept)


@every_map
def test_inputs_may_change_after_learning(make: Callable[[], Map]) -> None:
    """A map keeps no reference to what it was taught."""
    inputs = INPUTS.copy()
    learner = make().partial_fit(inputs)
    learner.learn_one(inputs[0])
    before = memory(learner)
    inputs[:] = -5.0
    assert memory(learner) == before


@every_map
def test_single_precision_inputs_count_as_their_double_values(make: Callable[[], Map]) -> None:
    """float32 inputs are widened, not computed with."""
    single = INPUTS.astype(np.float32)
    one = make()
    for x in single:
        one.learn_one(x)
    assert memory(one) == memory(make().partial_fit(single)) == memory(make().partial_fit(single.astype(np.float64)))


@every_map
def test_restored_maps_learn_on_bit_for_bit(make: Callable[[], Map]) -> None:
    """State taken in mid-learning, and pickles and copies, continue as the original does."""
    original = make().partial_fit(INPUTS[:30])
    restored = make()
    restored.restore(original.state())
    twins = [restored, pickle.loads(pickle.dumps(original)), copy.deepcopy(original)]
    original.partial_fit(INPUTS[30:])
    for twin in twins:
        for x in INPUTS[30:]:
            twin.learn_one(x)
        assert memory(twin) == memory(original)


@every_map
def test_fit_starts_anew_and_clone_forgets(make: Callable[[], Map]) -> None:
    """fit after learning equals fit of a new map; a clone has learned nothing."""
    used = make().partial_fit(INPUTS[::-1])
    assert memory(used.fit(INPUTS)) == memory(make().fit(INPUTS))
    with pytest.raises(NotFittedError):
        clone(used).winner(INPUTS[0])


@every_map
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_bad_values_are_refused_before_anything_changes(make: Callable[[], Map], value: float) -> None:
    """One bad value, in a batch even behind good inputs, and nothing of the call is learned."""
    learner = make().partial_fit(INPUTS)
    before = memory(learner)
    bad = INPUTS.copy()
    bad[5, 1] = value
    for act in (learner.learn_one, learner.winner):
        with pytest.raises(ValueError):
            act(bad[5])
    for act in (learner.partial_fit, learner.predict, learner.transform):
        with pytest.raises(ValueError):
            act(bad)
    assert memory(learner) == before


@every_map
@pytest.mark.parametrize("x", [[1.0, 2.0], [1.0], 1.0, [[1.0, 2.0, 3.0]], [], np.ones((3, 1))])
def test_wrong_lengths_are_refused_before_anything_changes(make: Callable[[], Map], x: ArrayLike) -> None:
    """Only vectors of the map's own length pass, even where NumPy would broadcast."""
    learner = make().partial_fit(INPUTS)
    before = memory(learner)
    for act in (learner.learn_one, learner.winner):
        with pytest.raises(ValueError):
            act(x)
    assert memory(learner) == before


def test_refusal_names_the_place_and_the_value() -> None:
    """The message says which value, of which input, and that nothing was learned."""
    with pytest.raises(ValueError, match=r"input\[1, 0\] is nan: inputs must be finite .*nothing has been learned"):
        raise refuse(np.array([[0.0, 1.0], [np.nan, np.inf]]))


def test_feature_names_count_the_units() -> None:
    """transform's columns are named after the map and the unit."""
    assert list(dsom().fit(INPUTS).get_feature_names_out()) == [f"dsom{i}" for i in range(20)]
