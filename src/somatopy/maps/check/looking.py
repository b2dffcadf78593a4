"""The laws of looking: what a map shows agrees with itself, and looking changes nothing."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from functools import partial
from typing import Any

import numpy as np
from sklearn.exceptions import NotFittedError
from sklearn.metrics.pairwise import nan_euclidean_distances

from somatopy.contract import law, refused, same
from somatopy.maps.base import Map
from somatopy.maps.check.trials import INPUTS, Maps, closeness, shown, topology_of

__all__ = [
    "agrees_on_the_nearest",
    "joins_what_is_there",
    "looks_without_changing",
    "ranks_as_it_chooses",
    "shows_nothing_before_it_starts",
    "takes_the_first_of_equals",
]


def shows_nothing_before_it_starts(maps: Maps) -> None:
    """Looking at a map that has not started is a NotFittedError."""
    with law("before it starts, looking raises NotFittedError", "call check_is_fitted(self) first") as holds:
        fresh = maps.new()
        calls: dict[str, Callable[[], object]] = {"state": fresh.state, "code": partial(fresh.code, 0)}
        calls |= {name: partial(getattr(fresh, name), INPUTS[0]) for name in ("winner", "winners")}
        calls |= {name: partial(getattr(fresh, name), INPUTS) for name in ("predict", "transform")}
        calls |= {name: partial(getattr, fresh, name) for name in ("codebook_", "samples_seen_")}
        for name, call in calls.items():
            holds(_raises(NotFittedError, call), "{} answered", name)


def _raises(kind: type[Exception], call: Callable[[], object]) -> bool:
    try:
        call()
    except kind:
        return True
    return False


def agrees_on_the_nearest(maps: Maps) -> None:
    """All that tells distances and winners tells the same."""
    trained = maps.taught()
    codes, distances = trained.codebook_, trained.transform(INPUTS)
    with law("transform gives the Euclidean distance of each row to each unit", "leave it to Map") as holds:
        holds(closeness(codes)(distances, nan_euclidean_distances(INPUTS, codes)), "others than those to codebook_")
        holds(same(np.concatenate(list(trained.transform_chunks(INPUTS))), distances), "transform_chunks differs")
        names = trained.get_feature_names_out()
        holds(len(names) == len(codes), "{} names of features for {} units", len(names), len(codes))
    _agrees_row_by_row(trained, distances, closeness(codes))
    with law("code(unit) is that row of codebook_", "raise an IndexError where there is no such unit") as holds:
        for unit, code in enumerate(codes):
            holds(same(trained.code(unit), code), "{} for {}", trained.code(unit), code)
        holds(_raises(IndexError, partial(trained.code, len(codes))), "code({}) of as many units", len(codes))


def _agrees_row_by_row(trained: Map, distances: Any, close: Callable[[Any, Any], bool]) -> None:
    with law("winner, winners, predict and transform agree", "override all of them, or none") as holds:
        for x, row, unit in zip(INPUTS, distances, trained.predict(INPUTS), strict=True):
            holds(close(row[unit], row.min()), "predict says {}, but {} is nearer", unit, row.argmin())
            winner, distance = trained.winner(x)
            holds(winner == unit and close(distance, row[unit]), "winner says {}, {}", winner, distance)
            units, ordered = trained.winners(x, len(row))
            holds(same(np.sort(units), np.arange(len(row))) and units[0] == unit, "winners says {}", units)
            holds(close(ordered, row[units]) and (np.diff(ordered) >= 0).all(), "winners gives {}", ordered)
        for k in (0, distances.shape[1] + 1):
            holds(refused(partial(trained.winners, INPUTS[0], k)), "winners took k={}, which it does not have", k)


def takes_the_first_of_equals(maps: Maps) -> None:
    """Ties have one answer everywhere."""
    with law("of units equally near the first wins", "take argmin, which does") as holds:
        trained = maps.taught()
        state = trained.state()
        state["codebook"][:] = state["codebook"][-1]
        trained.restore(state)
        units, _ = trained.winners(INPUTS[0], len(state["codebook"]))
        holds(same(units, np.arange(len(units))), "winners says {}", units)
        holds(trained.winner(INPUTS[0])[0] == 0, "winner says {}", trained.winner(INPUTS[0])[0])
        holds(not trained.predict(INPUTS).any(), "predict says {}", trained.predict(INPUTS))
        holds(trained.learn_one(INPUTS[0]) == 0, "learn_one takes another")


def ranks_as_it_chooses(maps: Maps) -> None:
    """On a grid many units are as near as rounding tells."""
    with law("winner, winners and predict agree to the last bit", "find all of them from one distance") as holds:
        rng = np.random.default_rng(5)
        inputs = 0.1 * rng.integers(0, 4, (200, 6))
        trained = maps.taught(inputs[:80].copy())
        state = trained.state()
        state["codebook"][:] = 0.1 * rng.integers(0, 4, state["codebook"].shape)
        trained.restore(state)
        for x, unit in zip(inputs, trained.predict(inputs), strict=True):
            first = trained.winners(x, 1)[0][0]
            holds(trained.winner(x)[0] == unit == first, "{} for {}, of winners {}", unit, x, first)


def joins_what_is_there(maps: Maps) -> None:
    """The topology, where a map has one, is that of its units, all the time."""
    with law(
        "edges of topology_ join two units that are there, the lower number first, each pair once; they are adjacent",
        "see somatopy.maps.Topology",
    ) as holds:
        learner = maps.new()
        for x in INPUTS:
            learner.learn_one(x)
            topology, units = topology_of(learner), len(learner.codebook_)
            if topology is None:
                return
            edges = np.asarray(topology.edges)
            holds(edges.ndim == 2 and edges.shape[1] == 2, "edges of shape {}", edges.shape)
            one, other = edges.T
            inside = (one >= 0) & (one < other) & (other < units)
            holds(inside.all() and len(np.unique(edges, axis=0)) == len(edges), "{} for {} units", edges, units)
            holds(np.all(topology.adjacent(one, other)) and np.all(topology.adjacent(other, one)), "not adjacent")
            away = topology.distances(units - 1)
            holds(away.shape == (units,) and (away[:-1] > 0).all() and away[-1] == 0, "distances {}", away)


def looks_without_changing(maps: Maps) -> None:
    """A map that is watched learns what one does that is left alone."""
    watched, alone = maps.taught(INPUTS[:20]), maps.taught(INPUTS[:20])
    for x in INPUTS[20:50]:
        with law("looking changes nothing", "learn in _step only, and draw nothing") as holds:
            before = deepcopy(watched.state())
            found = shown(watched)
            holds(same(watched.state(), before), "state() is another after looking")
        with law("arrays that are given away are the caller's", "return copies") as holds:
            _overwrite(found)
            holds(same(watched.state(), before), "overwriting what was given changed state()")
        with law("looking changes nothing", "keep nothing of what it finds, and draw nothing") as holds:
            holds(watched.learn_one(x) == alone.learn_one(x), "another winner than without looking")
            holds(same(watched.state(), alone.state()), "learning goes on in another way than without looking")


def _overwrite(value: Any) -> None:
    if isinstance(value, np.ndarray) and value.flags.writeable:
        value.fill(7)
    for item in value.values() if isinstance(value, dict) else value if isinstance(value, (list, tuple)) else ():
        _overwrite(item)
