"""Maps of tables: what fit learns, what it says, and how it compares with minisom on tables that everybody knows."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.distance import cdist
from sklearn import datasets
from sklearn.exceptions import ConvergenceWarning
from sklearn.model_selection import GridSearchCV, train_test_split
from sklearn.preprocessing import StandardScaler

from somatopy.maps import DSOM, SOM, Lattice, Map, NeuralGas, load_map
from somatopy.maps.fitting import unrest
from somatopy.maps.quality import topographic_error

IRIS = datasets.load_iris().data
TABLES: dict[str, Callable[[], Any]] = {
    "iris": datasets.load_iris,
    "wine": datasets.load_wine,
    "digits": datasets.load_digits,
    "cancer": datasets.load_breast_cancer,
}
#: Quantisation errors of minisom 2.3.6 on the rows that it learned and on the others, split by seed 0: 10 x 10 units,
#: PCA start, sigma 3, ten steps a row and at least 10,000, random_seed 0.
MINISOM = {
    ("iris", "raw"): (0.232159, 0.312595),
    ("iris", "standardised"): (0.297529, 0.384400),
    ("wine", "raw"): (13.56375, 22.23114),
    ("wine", "standardised"): (1.656872, 1.926174),
    ("digits", "raw"): (21.90919, 22.68627),
    ("digits", "standardised"): (4.978634, 5.190503),
    ("cancer", "raw"): (49.00479, 40.55089),
    ("cancer", "standardised"): (2.596859, 2.876628),
}


def halves(table: str, kind: str) -> list[Any]:
    """The rows to learn and the others."""
    X = TABLES[table]().data
    return list(train_test_split(StandardScaler().fit_transform(X) if kind != "raw" else X, random_state=0))


@pytest.mark.parametrize(("table", "kind"), MINISOM)
def test_defaults_are_as_near_to_a_table_as_minisom(table: str, kind: str) -> None:
    """SOM and neural gas of 100 units, made with no other parameter, on learned rows and on others; none warns."""
    halved = halves(table, kind)
    with warnings.catch_warnings():
        warnings.simplefilter("error", ConvergenceWarning)
        for chart in (SOM(shape=(10, 10), random_state=0), NeuralGas(random_state=0)):
            chart.fit(halved[0])
            for rows, error in zip(halved, MINISOM[table, kind], strict=True):
                assert -chart.score(rows) <= 1.05 * error


def test_a_map_of_many_units_fits_a_small_table() -> None:
    """With all defaults, far nearer than a single unit can be."""
    alone = cdist(IRIS, IRIS.mean(axis=0)[None]).mean()
    assert -SOM(random_state=0).fit(IRIS).score(IRIS) < 0.1 * alone


@pytest.mark.parametrize("make", [lambda **given: SOM(shape=(4, 5), **given), lambda **given: NeuralGas(20, **given)])
def test_schedules_end_when_fit_ends(make: Callable[..., Map]) -> None:
    """fit is that many passes in random order with the horizon at their end; both go on alike."""
    codes, rng = IRIS[:20], np.random.default_rng(3)
    fitted = make(init=codes, epochs=3, random_state=3).fit(IRIS)
    twin = make(init=codes, horizon=3 * len(IRIS))
    for _ in range(3):
        twin.partial_fit(IRIS[rng.permutation(len(IRIS))])
    np.testing.assert_array_equal(fitted.codebook_, twin.codebook_)
    np.testing.assert_array_equal(fitted.partial_fit(IRIS).codebook_, twin.partial_fit(IRIS).codebook_)


def test_a_map_from_a_file_goes_on_where_fit_ended(tmp_path: Path) -> None:
    """At the last learning rate and width, although its horizon has more inputs than fit learned."""
    fitted = SOM(shape=(4, 5), epochs=2, random_state=0).fit(IRIS)
    fitted.save(tmp_path / "map.npz")
    steady = SOM(shape=(4, 5), learning_rate=0.01, width=0.5, init=fitted.codebook_).initialise(4)
    expected = steady.partial_fit(IRIS).codebook_
    np.testing.assert_allclose(load_map(tmp_path / "map.npz").partial_fit(IRIS).codebook_, expected, atol=1e-12)


@pytest.mark.parametrize(("rows", "units"), [(150, 12), (150, 1), (20_000, 12)])
def test_epochs_of_none_are_500_inputs_a_unit(rows: int, units: int) -> None:
    """And one pass at least."""
    X = np.random.default_rng(0).random((rows, 2))
    for chart in (SOM(shape=(units,)), DSOM(shape=(units,)), NeuralGas(units)):
        passes = max(1, ceil(500 * units / rows))
        assert (chart.fit(X).n_iter_, chart.samples_seen_) == (passes, passes * rows)
    with pytest.raises(ValueError, match="epochs must be a whole number, at least 1; got 0"):
        SOM(epochs=0).fit(X)


def test_the_score_is_minus_the_mean_distance() -> None:
    """Of each row from the nearest code."""
    chart = NeuralGas(9, epochs=2, random_state=0).fit(IRIS)
    assert chart.score(IRIS) == pytest.approx(-cdist(IRIS, chart.codebook_).min(axis=1).mean())


def test_a_search_needs_no_scorer() -> None:
    """On held-out rows more units are nearer."""
    search = GridSearchCV(SOM(epochs=5, random_state=0), {"shape": [(2, 2), (6, 6)]}, cv=3).fit(IRIS)
    assert search.best_params_ == {"shape": (6, 6)} and search.best_score_ < 0


def test_what_fit_found_goes_with_its_map() -> None:
    """labels_ and n_iter_ are of the last fit, and gone once the map starts otherwise; partial_fit has none."""
    chart = SOM(shape=(3, 3), epochs=2, random_state=0).fit(IRIS)
    state = chart.state()
    np.testing.assert_array_equal(chart.labels_, cdist(IRIS, chart.codebook_).argmin(axis=1))
    for start in (lambda: chart.initialise(4), lambda: chart.restore(state)):
        chart.fit(IRIS)
        start()
        assert not hasattr(chart, "labels_") and not hasattr(chart, "n_iter_")
    assert not hasattr(SOM(shape=(3, 3)).partial_fit(IRIS), "labels_")


def test_inverse_transform_wants_a_distance_to_each_unit() -> None:
    """It names the shape that transform gives."""
    chart = SOM(shape=(3, 3), epochs=1).fit(IRIS)
    with pytest.raises(ValueError, match=r"each of the 9 units, as transform gives them, shape \(n, 9\); got shape"):
        chart.inverse_transform(IRIS)


@pytest.mark.parametrize(
    ("chart", "mend"),
    [
        (DSOM(shape=(8, 8), elasticity=4.0), "or lower the elasticity, which is 4 and holds units together"),
        (SOM(shape=(8, 8), learning_rate=0.001, epochs=1, init="uniform", bounds=(0, 1)), "It learned 1 pass over"),
    ],
)
def test_a_map_that_has_not_learned_says_so(chart: Map, mend: str) -> None:
    """By how much, after how many passes, and what helps."""
    with pytest.warns(ConvergenceWarning, match=rf"learning has not ended.* by \d+ % of the variance of X.*{mend}"):
        chart.set_params(random_state=0).fit(IRIS)


def test_a_stiff_map_that_has_learned_does_not_warn() -> None:
    """A wide last neighbourhood keeps units apart from their inputs; that is where they come to rest."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", ConvergenceWarning)
        stiff = SOM(shape=(6, 6), width=(3, 2), random_state=0).fit(IRIS)
    assert unrest(IRIS, stiff.labels_, stiff.codebook_) > 2 * unrest(
        IRIS, stiff.labels_, stiff.codebook_, stiff._neighbourhood
    )


def test_unrest_worked_out_by_hand() -> None:
    """Two units win 0 and 2, and 6: means 1 and 6, the first is 1 off for two rows; squares sum to 56 / 3 in all."""
    table, winners, codes = np.array([[0.0], [2.0], [6.0]]), np.array([0, 0, 1]), np.array([[2.0], [6.0]])
    assert unrest(table, winners, codes) == pytest.approx(2 * 1 / (56 / 3))
    # pulled by both alike, both units rest in the mean of all, 8 / 3
    both = unrest(table, winners, codes, lambda unit: np.ones(2))
    assert both == pytest.approx((2 * (2 / 3) ** 2 + (10 / 3) ** 2) / (56 / 3))


# The elasticity of a DSOM; a single pass, which need not end well, shows what is chosen
hasty = pytest.mark.filterwarnings("ignore:learning has not ended")


def chosen(X: Any, shape: tuple[int, ...] = (8, 8)) -> float:
    return float(DSOM(shape=shape, epochs=1, random_state=0).fit(X).elasticity_)


@hasty
def test_the_elasticity_depends_on_the_table_but_not_on_its_units() -> None:
    """The same of a table in other units; less in more dimensions, and with a row far from all others."""
    rng = np.random.default_rng(0)
    cubes = [rng.random((2000, dims)) for dims in (2, 3, 4, 6)]
    found = [chosen(X) for X in cubes]
    assert found == sorted(found, reverse=True) and 0.2 < found[-1] < found[0] <= 1.5
    assert chosen(1000 * cubes[1] - 7) == pytest.approx(found[1])
    heavy = np.exp(1.5 * rng.normal(size=(2000, 4)))
    assert chosen(heavy) < found[2]


def test_a_dsom_is_ordered_and_not_collapsed() -> None:
    """With all defaults, on squares and cubes: order that .1 does not give, at little more error than neural gas."""
    rng = np.random.default_rng(1)
    for dims in (2, 3):
        X = rng.random((2000, dims))
        dsom, loose = (DSOM(shape=(8, 8), elasticity=given, random_state=0).fit(X) for given in (None, 0.1))
        assert topographic_error(dsom, X) < 0.5 * topographic_error(loose, X)
        assert dsom.score(X) > 1.35 * NeuralGas(64, epochs=5, random_state=0).fit(X).score(X)


@hasty
def test_an_elasticity_that_is_given_or_a_presets_stays() -> None:
    """Only fit chooses, and only for `rougier`; what it chose holds on, until one is set."""
    assert DSOM(shape=(3, 3), elasticity=0.3, epochs=1).fit(IRIS).elasticity_ == 0.3
    assert DSOM(shape=(3, 3), preset="schillaci2016", epochs=1).fit(IRIS).elasticity_ == 1.5
    assert DSOM(shape=(3, 3)).partial_fit(IRIS).elasticity_ == 0.1
    dsom = DSOM(shape=(3, 3), epochs=1, random_state=0).fit(IRIS)
    before = dsom.elasticity_
    assert dsom.partial_fit(IRIS).elasticity_ == before != 0.1
    assert dsom.set_params(elasticity=0.2).elasticity_ == 0.2
    for X in ([[1.0, 2.0]], np.ones((9, 2))):  # nothing to tell it from
        assert DSOM(shape=(3, 3), epochs=1).fit(X).elasticity_ == 0.1


@hasty
def test_the_elasticity_is_that_of_inputs_that_move_the_map() -> None:
    """Of a regular hexagon any row sees the others 1, 1, sqrt(3), sqrt(3) and 2 away; 2 is the farthest.

    With one unit these are the nearest: the mean of their cubes by that of their squares is what moves the map, and
    the neighbourhood spans .8 cells of it. Corners of a simplex are all as far from each other as any two rows.
    """
    angles = np.arange(6) * np.pi / 3
    hexagon = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    moving = (2 + 2 * 3**1.5 + 8) / (2 + 2 * 3 + 4) / 2
    assert chosen(hexagon, (1,)) == pytest.approx(0.8 / moving)
    apart = np.eye(64 + 40)
    assert chosen(apart, (8, 8)) == pytest.approx(0.8 / 7 / np.sqrt(2))
    assert chosen(apart, (64,)) == pytest.approx(0.8 / 63)


@hasty
def test_a_lattice_of_one_axis_has_finer_cells_and_less_elasticity() -> None:
    """Of as many units: 64 along one axis are nearer to each other than 8 along each of two."""
    X = np.random.default_rng(0).random((1000, 2))
    assert chosen(X, (64,)) < chosen(X, (8, 8))
    assert Lattice((64,)).units == Lattice((8, 8)).units
