"""What maps are tried on, and what is seen of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from sklearn.exceptions import NotFittedError

from somatopy.maps.base import Map
from somatopy.maps.topology import Topology

__all__ = ["DIMS", "GAPPY", "INPUTS", "Make", "Maps", "closeness", "play", "shown", "state_of", "topology_of"]

Make = Callable[[], Map]

DIMS = 3
INPUTS = np.random.default_rng(1).random((80, DIMS))
#: The same, three of four with one coordinate missing.
GAPPY = np.where(np.random.default_rng(2).integers(DIMS + 1, size=(80, 1)) == np.arange(DIMS), np.nan, INPUTS)
for _shared in (INPUTS, GAPPY):
    _shared.flags.writeable = False  # a map that writes to its inputs must not spoil the next check


@dataclass(frozen=True)
class Maps:
    """Makes maps of one seed, of other parameters if that is said."""

    make: Make

    def new(self, **parameters: Any) -> Map:
        """One that has learned nothing."""
        fresh: Map = self.make().set_params(**{"random_state": 1, "missing": "error"} | parameters)
        return fresh

    def seeded(self, seed: int) -> Map:
        """One of a seed."""
        return self.new(random_state=seed)

    def taught(self, inputs: Any = None, **parameters: Any) -> Map:
        """One that has learned some inputs at once; a copy of INPUTS if none are given."""
        return self.new(**parameters).partial_fit(INPUTS.copy() if inputs is None else inputs)

    def one_by_one(self, inputs: Any, **parameters: Any) -> Map:
        """One that has learned them one by one."""
        learner = self.new(**parameters)
        for x in inputs:
            learner.learn_one(x)
        return learner


def state_of(learner: Map) -> dict[str, Any] | None:
    """What a map has learned; None where it has not started."""
    try:
        return learner.state()
    except NotFittedError:
        return None


def topology_of(trained: Map) -> Topology | None:
    """Which units are neighbours; None where none ever are."""
    try:
        return trained.topology_
    except NotFittedError:
        raise
    except AttributeError:
        return None


def shown(trained: Map) -> list[Any]:
    """All that a map shows."""
    found: list[Any] = [trained.state(), trained.codebook_, trained.code(0), trained.samples_seen_]
    found += [trained.winner(INPUTS[0]), trained.winners(INPUTS[0], 1)]
    found += [trained.predict(INPUTS), trained.transform(INPUTS), list(trained.transform_chunks(INPUTS))]
    topology = topology_of(trained)
    return found if topology is None else [*found, topology.edges, topology.distances(0)]


def play(learner: Map, first: int, last: int) -> object:
    """The winners of some inputs, and all that the map shows then."""
    return [learner.learn_one(x) for x in INPUTS[first:last]], shown(learner)


def closeness(codes: Any) -> Callable[[Any, Any], bool]:
    """Whether distances agree as well as the precision of the codes has it."""
    return partial(np.allclose, rtol=0, atol=1e-5 if codes.dtype == np.float32 else 1e-7)
