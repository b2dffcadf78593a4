"""The laws of learning: from which inputs, how precisely, and what it returns."""

from __future__ import annotations

from collections.abc import Iterator
from copy import deepcopy
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from sklearn.exceptions import NotFittedError
from sklearn.metrics.pairwise import nan_euclidean_distances

from somatopy.contract import law, refused, same
from somatopy.maps.check.trials import DIMS, GAPPY, INPUTS, Maps, closeness, state_of

__all__ = [
    "computes_as_precisely_as_asked",
    "finds_what_it_has_learned",
    "keeps_its_precision",
    "learns_around_gaps",
    "learns_in_any_pieces",
    "learns_tables",
    "moves_only_what_was_observed",
    "owns_its_inputs",
    "refuses_before_anything_changes",
    "returns_the_winner_before_the_update",
    "returns_the_winner_of_gaps_too",
    "runs",
]

LENGTHS: tuple[Any, ...] = ([1.0, 2.0], [1.0], 1.0, [[1.0, 2.0, 3.0]], [], np.ones((DIMS, 1)))


def runs(maps: Maps) -> None:
    """It starts and learns at all."""
    with law(
        "_start and _step run, and leave what the map needs",
        "mend the error; _start gives a dictionary of arrays with a codebook (units, dims), _step changes what is in "
        "self._learned, which Map has added samples_seen to",
    ):
        learner = maps.new().initialise(DIMS)
        for x in INPUTS[:10]:
            learner.learn_one(x)


def learns_in_any_pieces(maps: Maps) -> None:
    """How inputs are handed over does not matter."""
    for missing, inputs in (("error", INPUTS), ("ignore", GAPPY)):
        with law(
            f'partial_fit in any pieces and repeated learn_one agree bit for bit (missing="{missing}")',
            "let each input learn from what the ones before it have left, and keep nothing of a call",
        ) as holds:
            whole = maps.taught(inputs, missing=missing)
            pieces = maps.taught(inputs[:7], missing=missing).partial_fit(inputs[7:8]).partial_fit(inputs[8:])
            ways = {"learn_one": maps.one_by_one(inputs, missing=missing), "partial_fit in pieces": pieces}
            for way, learner in ways.items():
                holds(same(learner.state(), whole.state()), "{} and partial_fit differ", way)
            holds(whole.samples_seen_ == len(inputs), "samples_seen_ {} of {}", whole.samples_seen_, len(inputs))


def learns_tables(maps: Maps) -> None:
    """fit is so many passes over the rows, from one seed one map."""
    for missing, inputs in (("error", INPUTS), ("ignore", GAPPY)):
        with law(
            f'fit learns each row n_iter_ times, in an order of its seed, and tells the winners (missing="{missing}")',
            "leave fit to Map; a parameter `epochs` says how many passes, None is as many as make 500 inputs a unit",
        ) as holds:
            fitted, again = (maps.new(missing=missing).fit(inputs.copy()) for _ in range(2))
            holds(same(fitted.state(), again.state()), "two of one seed differ")
            passes = fitted.n_iter_
            holds(fitted.samples_seen_ == passes * len(inputs), "{} passes, {} inputs", passes, fitted.samples_seen_)
            holds(same(fitted.labels_, fitted.predict(inputs)), "labels_ and predict differ")
            holds(same(maps.new(missing=missing).fit_predict(inputs), fitted.labels_), "fit_predict and labels_ differ")
            quantised = fitted.inverse_transform(fitted.transform(inputs))
            holds(same(quantised, fitted.codebook_[fitted.labels_]), "inverse_transform gives other than the winners")
            if "epochs" not in fitted.get_params():
                whole = maps.taught(inputs, missing=missing)
                holds(same(fitted.state(), whole.state()), "without `epochs` fit is one pass in order; it differs")


def returns_the_winner_before_the_update(maps: Maps) -> None:
    """learn_one returns what winner said."""
    _returns_the_winner(maps, "error", INPUTS)


def returns_the_winner_of_gaps_too(maps: Maps) -> None:
    """The same of inputs that lack a coordinate."""
    _returns_the_winner(maps, "ignore", GAPPY)


def _returns_the_winner(maps: Maps, missing: str, inputs: Any) -> None:
    with law(
        f'learn_one returns the winner before the update (missing="{missing}")',
        "find it first, by _winners, which knows of NaN, and return it as an int",
    ) as holds:
        learner = maps.new(missing=missing).initialise(DIMS)
        for x in inputs:
            try:
                unit, _ = learner.winner(x)
            except NotFittedError:  # there are no units yet
                unit = 0
            returned = learner.learn_one(x)
            holds(isinstance(returned, int) and returned == unit, "{!r} where winner said {}", returned, unit)


def finds_what_it_has_learned(maps: Maps) -> None:
    """learn_and_find is two calls in one."""
    for missing, inputs, dtype in (
        ("error", INPUTS, "float64"),
        ("error", INPUTS, "float32"),
        ("ignore", GAPPY, "float64"),
    ):
        with law(
            f'learn_and_find gives what winner gives after learn_one, and teaches the same (missing="{missing}")',
            "search the updated codes, or leave it to Map",
        ) as holds:
            one, two = (maps.new(missing=missing, dtype=dtype) for _ in range(2))
            for x in inputs:
                two.learn_one(x)
                found, expected = one.learn_and_find(x), two.winner(x)
                holds(same(found, expected), "{} where winner said {} after learn_one", found, expected)
                holds(same([*map(type, found)], [int, float]), "a {} and a {}", *map(type, found))
            holds(same(one.state(), two.state()), "another state than that of learn_one")


def owns_its_inputs(maps: Maps) -> None:
    """Inputs stay the caller's, and may be of any kind."""
    with law(
        "inputs of any kind teach the same, and stay as they are", "leave them to Map, and write to no x"
    ) as holds:
        for name, given, plain in _kinds_of_inputs():
            kept = deepcopy(given)
            for way, learn in (("learn_one", maps.one_by_one), ("partial_fit", maps.taught)):
                expected = learn(plain.copy()).state()
                holds(same(learn(given).state(), expected), "{} of {} teaches something else", way, name)
                holds(same(given, kept), "{} of {} has changed it", way, name)
    with law("a map keeps no input", "keep copies of what must be remembered") as holds:
        given = INPUTS.copy()
        tampered = maps.taught(given)
        given[:] = 7.0
        holds(same(tampered.state(), maps.taught().state()), "overwriting the inputs changed what was learned")


def _kinds_of_inputs() -> Iterator[tuple[str, Any, Any]]:
    """A name, inputs of that kind, and the same as plain arrays."""
    frozen, single, whole = INPUTS.copy(), INPUTS.astype(np.float32), np.rint(9 * INPUTS)
    frozen.flags.writeable = False
    yield "a plain array", INPUTS.copy(), INPUTS
    yield "a list", INPUTS.tolist(), INPUTS
    yield "a read-only array", frozen, INPUTS
    yield "a strided array", np.repeat(np.repeat(INPUTS, 2, axis=0), 3, axis=1)[::2, ::3], INPUTS
    yield "an array in Fortran order", np.asfortranarray(INPUTS), INPUTS
    yield "a float32 array", single, single.astype(np.float64)
    yield "an array of integers", whole.astype(np.int64), whole


def refuses_before_anything_changes(maps: Maps) -> None:
    """An input that is not usable is an error, and no other harm."""
    absent = np.full((1, DIMS), np.nan)
    for missing, values in (("error", (np.nan, np.inf, -np.inf)), ("ignore", (absent, np.inf))):
        bad = [np.where(np.arange(len(INPUTS))[:, None] == 5, value, INPUTS) for value in values]
        with law(
            f'inputs that are not usable are refused before anything changes (missing="{missing}")',
            "raise a ValueError that names the value and its place, first of all",
        ) as holds:
            for learner in (maps.taught(missing=missing), maps.new(missing=missing)):
                before = deepcopy(state_of(learner))
                for name, given in _calls(bad, started=before is not None):
                    holds(refused(partial(getattr(learner, name), given)), "{} took {}", name, given)
                    holds(same(state_of(learner), before), "{} refused {} too late", name, given)


def _calls(bad: list[Any], *, started: bool) -> Iterator[tuple[str, Any]]:
    """What each method must not take: bad values, in a batch behind good ones, and if it has started wrong lengths."""
    singles = [*(X[5] for X in bad), *(LENGTHS if started else LENGTHS[2:])]
    batches = [*bad, INPUTS[:, :2], INPUTS[0]] if started else [*bad, INPUTS[0]]
    yield from ((name, x) for name in ("learn_one", "learn_and_find") for x in singles)
    yield from (("partial_fit", X) for X in batches)
    if started:
        yield from ((name, x) for name in ("winner", "winners") for x in singles)
        yield from ((name, X) for name in ("predict", "transform") for X in batches)


def learns_around_gaps(maps: Maps) -> None:
    """With missing="ignore" the observed coordinates are compared and learned from."""
    with law(
        'missing="ignore" changes nothing where nothing is missing', "ask for NaN, not for the parameter"
    ) as holds:
        trained = maps.taught(missing="ignore")
        holds(same(trained.state(), maps.taught().state()), "inputs without NaN teach something else")
    with law("codes are finite, also where inputs have NaN", "learn from the coordinates that were observed") as holds:
        codes = maps.taught(GAPPY, missing="ignore").codebook_
        holds(np.isfinite(codes).all(), "{}", codes)
    with law("distances from inputs with NaN are those of nan_euclidean_distances", "leave it to Map") as holds:
        expected, close = nan_euclidean_distances(GAPPY, trained.codebook_), closeness(trained.codebook_)
        holds(close(trained.transform(GAPPY), expected), "transform gives others")
        for x, row, unit in zip(GAPPY, expected, trained.predict(GAPPY), strict=True):
            holds(close(row[unit], row.min()), "predict says {} for {}; {} is nearer", unit, x, row.argmin())
            winner, distance = trained.winner(x)
            holds(winner == unit and close(distance, row[unit]), "winner says {}, {} for {}", winner, distance, x)


def moves_only_what_was_observed(maps: Maps) -> None:
    """Inputs that lack a coordinate move the others."""
    learner, present = maps.taught(missing="ignore"), [0, 2]
    codes = [learner.codebook_]
    with law("observed coordinates of an input are learned from", "move the codes in these coordinates") as holds:
        for x in INPUTS:
            learner.learn_one([x[0], np.nan, x[2]])
            codes.append(learner.codebook_)
        holds(not same(codes[0][:, present], codes[-1][:, present]), "80 inputs that lack the second changed no code")
    swaps = len({len(book) for book in codes}) > 1  # of maps that grow: one unit may go as another one comes
    with law("where a coordinate is missing, that of no unit moves", "leave NaN out of the update") as holds:
        for before, after in pairwise(codes):
            moved = np.count_nonzero(~np.isin(after[:, 1], before[:, 1])) - max(len(after) - len(before), 0)
            holds(moved <= swaps, "of {} units {} moved where the input has NaN", len(after), moved)


def computes_as_precisely_as_asked(maps: Maps) -> None:
    """The precision is that of dtype, and float32 is enough to learn the same."""
    with law("codes have the precision that dtype asks for", "compute in the type of the codebook") as holds:
        single, double = (maps.taught(dtype=dtype) for dtype in ("float32", "float64"))
        for name, trained in (("float32", single), ("float64", double)):
            for codes in (trained.codebook_, trained.state()["codebook"], trained.code(0)):
                holds(codes.dtype == name, "{} where {} was asked for", codes.dtype, name)
    with law(
        "from one state an input teaches a float32 map what it teaches a float64 map, but for rounding (1e-5)",
        "subtract before you square, and add up no small terms to large sums",
    ) as holds:
        for x in INPUTS:
            single.restore(double.state())  # each time, as rounding may choose between units that are equally near
            distances = double.transform(x[None])[0]
            unit, expected = single.learn_one(x), double.learn_one(x)
            holds(distances[unit] - distances[expected] < 1e-5, "winner {} where {} is nearer", unit, expected)
            codes, others = single.codebook_, double.codebook_
            close = codes.shape == others.shape and np.allclose(codes, others, rtol=0, atol=1e-5)
            holds(close or unit != expected, "{} and {} from the input {}", codes, others, x)


def keeps_its_precision(maps: Maps) -> None:
    """A map is not spoilt by what is set while it learns."""
    with law(
        "a dtype that is set while learning holds from the next start on; until then learning goes on as it was",
        "ask the codebook for its type, not the parameter",
    ) as holds:
        for dtype, other in (("float64", "float32"), ("float32", "float64")):
            changed = maps.taught(INPUTS[:30], dtype=dtype).set_params(dtype=other).partial_fit(INPUTS[30:])
            holds(
                same(changed.state(), maps.taught(dtype=dtype).state()), "{} set to {} learned otherwise", dtype, other
            )
            anew = changed.fit(INPUTS).codebook_.dtype
            holds(anew == other, "codes are {} after the next start, not {}", anew, other)
