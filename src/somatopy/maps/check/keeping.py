"""The laws of keeping: seeds, states, files, copies, and memory that is bounded."""

from __future__ import annotations

import pickle
from copy import deepcopy
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from sklearn.base import clone

from somatopy.contract import check_state, law, refused, same
from somatopy.maps.base import Map
from somatopy.maps.check.trials import DIMS, INPUTS, Maps, play, state_of
from somatopy.maps.storage import load_map

__all__ = [
    "draws_from_its_seed",
    "goes_on_from_files_and_copies",
    "goes_on_from_states",
    "refuses_states_that_do_not_fit",
    "starts_anew",
    "stays_small",
]

MOST = 2.0  # times the bytes a unit after 1000 inputs that there may be after 4000


def draws_from_its_seed(maps: Maps) -> None:
    """All chance comes from random_state."""
    with law(
        "one seed, one map; an equal generator gives the same, another seed another where anything is drawn",
        "draw all random numbers from the generator that _start is given",
    ) as holds:
        generator = np.random.default_rng(1)
        unused = deepcopy(generator.bit_generator.state)
        first, again, drawn = (_life(maps.new(random_state=seed)) for seed in (1, 1, generator))
        holds(same(first, again), "two of one seed differ")
        holds(same(first, drawn), "random_state=1 and random_state=np.random.default_rng(1) differ")
        draws = generator.bit_generator.state != unused
        holds(not draws or not same(first, _life(maps.new(random_state=2))), "seeds 1 and 2 give the same")


def _life(learner: Map) -> list[dict[str, Any]]:
    """States from the start on; learning may forget the start codes."""
    return [learner.initialise(DIMS).state(), *(learner.partial_fit(INPUTS[t:][:8].copy()).state() for t in (0, 8, 16))]


def starts_anew(maps: Maps) -> None:
    """Nothing of what was learned outlives a start."""
    with law("fit and initialise start anew, and a clone has learned nothing", "set everything in _start") as holds:
        used, expected, fitted = maps.taught(INPUTS[::-1]), maps.taught().state(), maps.new().fit(INPUTS).state()
        holds(state_of(clone(used)) is None, "the clone of a map that has learned has learned")
        holds(same(clone(used).fit(INPUTS).state(), fitted), "a clone learns otherwise")
        holds(same(used.fit(INPUTS).state(), fitted), "fit goes on from what was learned before")
        holds(same(used.initialise(DIMS).partial_fit(INPUTS).state(), expected), "initialise leaves something")


def refuses_states_that_do_not_fit(maps: Maps) -> None:
    """A bad state is an error, and no other harm."""
    with law(
        "a state that does not fit is refused before anything changes",
        "check all of it in _check_state, and change nothing before _adopt",
    ) as holds:
        wrong = _wrong_states(maps.taught().state())
        for learner in (maps.new(), maps.taught(INPUTS[:30])):
            before = deepcopy(state_of(learner))
            for name, given in wrong.items():
                holds(refused(partial(learner.restore, given)), "restore took a state with {}", name)
                holds(same(state_of(learner), before), "a state with {} was refused too late", name)


def _wrong_states(state: dict[str, Any]) -> dict[str, dict[str, Any]]:
    wrong: dict[str, dict[str, Any]] = {"an unknown array": state | {"no such": np.zeros(1)}, "nothing": {}}
    for name, values in state.items():
        wrong[f"no {name}"] = {other: state[other] for other in state if other != name}
        if values.size:
            wrong[f"{name} of another shape"] = state | {name: np.stack([values, values])}
        wrong[f"{name} of text"] = state | {name: values.astype(str)}
        if values.dtype.kind == "f" and values.size:
            wrong[f"{name} of NaN"] = state | {name: np.full_like(values, np.nan)}
    return wrong


def goes_on_from_files_and_copies(maps: Maps) -> None:
    """Saving, pickling and copying lose nothing."""
    with law(
        "from a file, a pickle or a copy learning goes on bit for bit, at every stage",
        "keep all that learning changes in _learned, parameters that are numbers, text or arrays, and the class at the "
        "top of a module, where pickle finds it",
    ) as holds:
        stages = {
            "unfitted": maps.new(),
            "initialised": maps.new().initialise(DIMS),
            "taught": maps.taught(INPUTS[:30]),
        }
        for stage, original in stages.items():
            copies = {"file": _filed(original), "pickle": pickle.loads(pickle.dumps(original))}
            copies["copy"] = deepcopy(original)
            future, end = play(original, 30, 60), original.state()
            for name, other in copies.items():
                holds(type(other) is type(original), "the {} holds a {}", name, type(other).__name__)
                holds(same(play(other, 30, 60), future), "{}, {}: it goes on in another way", stage, name)
                holds(same(other.state(), end), "{}, {}: it ends in another state", stage, name)


def _filed(original: Map) -> Map:
    with TemporaryDirectory() as folder:
        original.save(Path(folder) / "map.npz")
        return load_map(Path(folder) / "map.npz")


def goes_on_from_states(maps: Maps) -> None:
    """A state is all that there is to keep."""
    check_state(maps.seeded, play)


def stays_small(maps: Maps) -> None:
    """A map may learn for ever."""
    with law(
        "memory is bounded: bytes a unit do not grow with the inputs, nor units beyond max_units",
        "keep sums, not inputs; count the units",
    ) as holds:
        learner, sizes = maps.new(), []
        most = learner.get_params().get("max_units")
        for inputs in np.random.default_rng(3).random((4, 1000, DIMS)):
            units = len(learner.partial_fit(inputs).codebook_)
            sizes.append(len(pickle.dumps(learner)) / units)
            holds(most is None or units <= most, "{} units, where max_units is {}", units, most)
        holds(sizes[-1] <= MOST * sizes[0], "{:.0f} bytes a unit after 1000 inputs, {:.0f} after 4000", *sizes[::3])
