"""Searches for good settings: an optimiser proposes conditions, each is run under some seeds, and a loss rates it.

The optimiser is one of optuna's. It proposes one batch of settings at a time, and gets the losses when all cells of the
batch have ended. Therefore the same search always proposes the same settings, however many processes run it, and can
continue where it was stopped.
"""

from __future__ import annotations

import importlib
import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from somatopy.analysis.cells import StudyResult
from somatopy.experiment.changes import changed
from somatopy.experiment.description import Description, DescriptionError
from somatopy.files import write_whole
from somatopy.registry.places import UnknownKind, found, is_importable
from somatopy.studies.api import backend_for
from somatopy.studies.driver import perform
from somatopy.studies.plan import Condition, Study, seeds_of
from somatopy.studies.reading import KEYS as STUDY_KEYS
from somatopy.studies.reading import base_of, distributions, flattened, space_of, with_changes

__all__ = ["LOSSES", "OPTIMISERS", "Search", "named_loss", "search", "searched"]

Loss = Callable[[StudyResult, str], float]

#: Losses by name. Others are named by their place: my_package.my_file:my_loss.
LOSSES = {"paper": "somatopy.analysis.paper_loss:paper"}
#: In the study folder: the loss of each proposal.
LOSSES_FILE = "losses.json"
OPTIMISERS = ("tpe", "random", "cmaes")
KEYS = ("space", "trials", "batch", "optimiser", "loss", "seed", "start")


@dataclass(frozen=True)
class Search:
    """A search: what is varied, within which limits, and how proposals are rated.

    Attributes:
        name: goes into the name of the study folder.
        base: the experiment that settings change.
        space: by key, the distribution that the optimiser draws from; see `space_of`.
        seeds: the seeds under which each proposal is run.
        trials: number of proposals.
        batch: number of proposals that are made at once.
        optimiser: one of `OPTIMISERS`.
        loss: the name of a loss, or its place.
        seed: seed of the optimiser.
        start: settings that are tried first.
        ceilings: whether ceilings are computed.
    """

    name: str
    base: Description
    space: Mapping[str, Mapping[str, Any]]
    seeds: tuple[int, ...]
    trials: int
    loss: str
    batch: int = 8
    optimiser: str = "tpe"
    seed: int = 0
    start: tuple[Mapping[str, Any], ...] = ()
    ceilings: bool = False

    def condition(self, number: int, point: Mapping[str, Any]) -> Condition:
        """The condition of a proposal."""
        name = _name(number)
        return Condition(name, changed(self.base, point, f"The {name}"), self.seeds, point)


def searched(table: Mapping[str, Any]) -> Search:
    """A search from plain data: a study's table with the key `search`.

    Raises:
        DescriptionError: an unknown key or value.
    """
    own = table["search"]
    if not isinstance(own, Mapping):
        raise DescriptionError(f"search must be a table of keys, not {own!r}; its keys: {', '.join(KEYS)}.")
    if unknown := [key for key in own if key not in KEYS]:
        raise DescriptionError(f"search has no key {unknown[0]!r}; its keys: {', '.join(KEYS)}.")
    _check_study(table)
    if own.get("optimiser", "tpe") not in OPTIMISERS:
        raise DescriptionError(
            f"search: optimiser = {own['optimiser']!r} is unknown; choose one of {', '.join(OPTIMISERS)}."
        )
    named_loss(own.get("loss", ""))
    what = Search(
        name=str(table.get("name", "search")),
        base=with_changes(changed(base_of(table), {"eye": "geometric"}), flattened(table.get("every", {})), "every"),
        space=_space(own.get("space", {})),
        seeds=seeds_of(table.get("seeds", 1), table.get("seed", 0)),
        trials=_whole(own, "trials", None),
        loss=own["loss"],
        batch=_whole(own, "batch", 8),
        optimiser=own.get("optimiser", "tpe"),
        seed=_whole(own, "seed", 0, least=0),
        start=_start(own.get("start", [])),
        ceilings=table.get("ceilings", False),
    )
    _try_out(what)
    return what


def _check_study(table: Mapping[str, Any]) -> None:
    if unknown := [key for key in table if key not in STUDY_KEYS]:
        raise DescriptionError(f"A study has no key {unknown[0]!r}; its keys: {', '.join(STUDY_KEYS)}.")
    if others := [key for key in ("grid", "conditions", "sweep", "keep_frames", "ceiling_every") if key in table]:
        raise DescriptionError(f"A study searches, or has {others[0]}: give one of both.")
    if not isinstance(table.get("ceilings", False), bool):
        raise DescriptionError(f"ceilings = {table['ceilings']!r} must be true or false.")


def _space(table: Any) -> dict[str, dict[str, Any]]:
    if not isinstance(table, Mapping) or not table:
        raise DescriptionError("search: space must say what is searched, such as speed = {low = 0.2, high = 0.8}.")
    return {key: space_of(key, value) for key, value in distributions(table).items()}


def _whole(own: Mapping[str, Any], key: str, default: int | None, least: int = 1) -> int:
    value = own.get(key, default)
    if not isinstance(value, int) or isinstance(value, bool) or value < least:
        raise DescriptionError(f"search: {key} = {value!r} must be a whole number from {least} up.")
    return value


def _start(points: Any) -> tuple[dict[str, Any], ...]:
    if not isinstance(points, list) or not all(isinstance(point, Mapping) for point in points):
        raise DescriptionError("search: start must be a list of tables, [[search.start]], each with all keys of space.")
    return tuple(flattened(point) for point in points)


def _try_out(what: Search) -> None:
    """Refuse now what would fail later: keys and choices that no description has, and starts beside the space."""
    first = {key: one["choices"][0] if "choices" in one else one["low"] for key, one in what.space.items()}
    for key, one in what.space.items():
        for value in one.get("choices", (first[key],)):
            with_changes(what.base, {**first, key: value}, f"search: {key} = {value!r}")
    for number, point in enumerate(what.start):
        if differing := what.space.keys() ^ point.keys():
            raise DescriptionError(f"search: start {number} and the space differ in {', '.join(sorted(differing))}.")
        for key, value in point.items():
            if not _lies_in(what.space[key], value):
                raise DescriptionError(f"search: start {number} has {key} = {value!r}, which is not in its space.")
        with_changes(what.base, point, f"search: start {number}")


def _lies_in(one: Mapping[str, Any], value: Any) -> bool:
    if "choices" in one:
        return value in one["choices"]
    whole = isinstance(one["low"], int) and isinstance(one["high"], int)
    is_number = isinstance(value, int if whole else int | float) and not isinstance(value, bool)
    return is_number and bool(one["low"] <= value <= one["high"])


def named_loss(name: str) -> Loss:
    """A loss: a function of a study and the name of a condition, which gives a number; less is better.

    Args:
        name: one of `LOSSES`, or the place of a function: of an installed module, or of one in the current folder.

    Raises:
        DescriptionError: there is none of that name.

    Example:
        >>> named_loss("paper").__module__
        'somatopy.analysis.paper_loss'
    """
    module, _, attribute = LOSSES.get(str(name), str(name)).partition(":")
    if not is_importable(module, attribute):
        raise DescriptionError(
            f"loss = {name!r} is unknown; choose one of {', '.join(LOSSES)}, or name a function of your own by its "
            "place: my_package.my_file:my_loss."
        )
    try:
        loss: Loss = found(module, attribute)
    except UnknownKind as error:
        raise DescriptionError(f"loss = {name!r} {error}.") from error
    if not callable(loss):
        raise DescriptionError(f"loss = {name!r} is no function of a study and the name of a condition, but {loss!r}.")
    return loss


def search(what: Search, out: str | Path | None = None, *, ray: str | None = None, **how: Any) -> StudyResult:
    """Run a search. Proposals that have been run in the folder already are not run again.

    Args:
        what: the search.
        out: the study folder; runs/<time>_<name> if None.
        ray: the address of a Ray cluster on which the cells run; this machine if None.
        how: `processes`, `backend` and `progress`, as `perform` takes them.

    Returns:
        The study folder, opened. Each condition is a proposal; losses are in its `losses.json`, null for a proposal
        that no description can have, or of which a cell failed.

    Raises:
        DescriptionError: optuna is missing, or the folder cannot be used, or no proposal can be run.
        Interrupted: on Ctrl-C; what has ended is kept.
    """
    optuna = _optuna(what.optimiser)
    loss, study = named_loss(what.loss), optuna.create_study(sampler=_sampler(optuna, what))
    for point in what.start:
        study.enqueue_trial(_encoded(what.space, point))
    conditions: list[Condition] = []
    losses: dict[str, float | None] = {}
    result = None
    while len(losses) < what.trials:
        size = min(what.batch, what.trials - len(losses))
        asked = [study.ask(_distributions(optuna, what.space)) for _ in range(size)]
        new = [_condition(what, trial) for trial in asked]
        if conditions := [*conditions, *filter(None, new)]:
            plan = Study(what.name, tuple(conditions), what.ceilings)
            result = _performed(plan, out if result is None else result.path, result, ray, how)
        for trial, condition in zip(asked, new, strict=True):
            value = _judged(loss, result, condition) if condition and result else None
            losses[_name(trial.number)] = value
            if value is None:
                study.tell(trial, state=optuna.trial.TrialState.FAIL)
            else:
                study.tell(trial, value)
        if result:
            write_whole(result.path / LOSSES_FILE, json.dumps({"loss": what.loss, "losses": losses}, indent=1) + "\n")
    if result is None:
        raise DescriptionError(f"None of the proposals of the search {what.name!r} can be run. Check its space.")
    return result


def _name(number: int) -> str:
    return f"trial {number:03d}"


def _condition(what: Search, trial: Any) -> Condition | None:
    """The condition of a proposal; None if no description has these settings together."""
    try:
        return what.condition(trial.number, _decoded(what.space, trial.params))
    except DescriptionError:
        return None


def _performed(
    plan: Study, out: Any, before: StudyResult | None, ray: str | None, how: Mapping[str, Any]
) -> StudyResult:
    """Run what is new; what failed in this search is not tried again before it is started anew."""
    if ray is not None:
        how = {**how, "backend": backend_for(plan, ray)}
    return perform(plan, out, failed=before.failures if before else (), **how)


def _judged(loss: Loss, result: StudyResult, condition: Condition) -> float | None:
    """The loss of a proposal; None if one of its cells failed, or it is not finite."""
    there = result.values(condition.name, "frames")
    value = float(loss(result, condition.name)) if there.keys() >= set(condition.seeds) else math.inf
    return value if math.isfinite(value) else None


def _optuna(optimiser: str) -> Any:
    try:
        import optuna

        if optimiser == "cmaes":
            importlib.import_module("cmaes")
    except ImportError as error:
        raise DescriptionError(
            f'A search needs the package {error.name}. Install it with: pip install "somatopy[search]"'
        ) from error
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    return optuna


def _sampler(optuna: Any, what: Search) -> Any:
    samplers = optuna.samplers
    if what.optimiser == "random":
        return samplers.RandomSampler(seed=what.seed)
    if what.optimiser == "cmaes":
        return samplers.CmaEsSampler(seed=what.seed, warn_independent_sampling=False)
    return samplers.TPESampler(seed=what.seed, multivariate=True, constant_liar=True)


def _distributions(optuna: Any, space: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    kinds = optuna.distributions
    found: dict[str, Any] = {}
    for key, one in space.items():
        if "choices" in one:
            found[key] = kinds.CategoricalDistribution(tuple(range(len(one["choices"]))))
        elif isinstance(one["low"], int) and isinstance(one["high"], int):
            found[key] = kinds.IntDistribution(one["low"], one["high"], log=bool(one.get("log")))
        else:
            found[key] = kinds.FloatDistribution(one["low"], one["high"], log=bool(one.get("log")))
    return found


def _decoded(space: Mapping[str, Mapping[str, Any]], params: Mapping[str, Any]) -> dict[str, Any]:
    """Settings from what the optimiser proposes, which knows choices by their places."""
    return {key: one["choices"][params[key]] if "choices" in one else params[key] for key, one in space.items()}


def _encoded(space: Mapping[str, Mapping[str, Any]], point: Mapping[str, Any]) -> dict[str, Any]:
    return {key: one["choices"].index(point[key]) if "choices" in one else point[key] for key, one in space.items()}
