"""The plan of a study: conditions, each under some seeds. Every pair of a condition and a seed is a cell."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from somatopy.experiment.building import check_numbers
from somatopy.experiment.ceiling import EVERY
from somatopy.experiment.description import Description, DescriptionError
from somatopy.experiment.provenance import digest
from somatopy.interventions import PAPER_OFFSET
from somatopy.registry.places import NOT_BY_PLACE
from somatopy.studies.code import code_digest

__all__ = ["Cell", "Condition", "Study", "seeds_of"]

_KIND = re.compile(r'"kind":"([^"]*)"')


@dataclass(frozen=True, eq=False)
class Cell:
    """One run of a study: a condition under a seed.

    Attributes:
        condition: name of the condition.
        factors: the condition's value of each factor of the study.
        experiment: the description, with its seed.
        ceiling: whether ceiling and reactive bound are computed.
        every: the ceiling looks at one frame out of so many.
    """

    condition: str
    factors: Mapping[str, Any]
    experiment: Description
    ceiling: bool = True
    every: int = EVERY

    @property
    def seed(self) -> int:
        """Its seed."""
        return self.experiment.seed

    @cached_property
    def description(self) -> str:
        """A digest of what is run, independent of names and of the code that runs it."""
        bounds = "" if self.every == EVERY else f" ceiling every {self.every}"
        return digest(self._said(self.experiment) + (bounds if self.ceiling else " without ceiling"))

    @cached_property
    def code(self) -> str:
        """A digest of the code that runs it."""
        return code_digest(self.experiment)

    @property
    def key(self) -> str:
        """A digest of description and code. Cells with the same key have the same results."""
        return digest(self.description + self.code)

    @cached_property
    def training(self) -> Description | None:
        """The experiment up to the end of its first phase, which other cells may share; None if it has no other."""
        phases = self.experiment.phases
        return self.experiment.replaced(phases=phases[:1], name="training") if len(phases) > 1 else None

    @cached_property
    def trunk(self) -> str:
        """A digest of the first phase and its code. Cells with the same digest share that phase."""
        first = self.training or self.experiment
        return digest(self._said(first) + code_digest(first))

    @cached_property
    def movement(self) -> str:
        """A digest of what the arm's movement depends on."""
        one = self.experiment
        return digest(one.model_dump_json(include={"seed", "body", "babbling"}))

    @staticmethod
    def _said(experiment: Description) -> str:
        """The experiment as text. On a NAO, offset = "paper" and the paper's numbers are the same experiment."""
        said = experiment.model_dump(mode="json", exclude={"name"})
        if (said["body"]["kind"], said["body"].get("model")) == ("mujoco", "nao"):
            for settings in (each for phase in said["phases"] for each in phase["interventions"]):
                if (settings["kind"], settings.get("offset")) == ("offset", "paper"):
                    settings["offset"] = list(PAPER_OFFSET)
        return json.dumps(said, sort_keys=True)


@dataclass(frozen=True)
class Condition:
    """One of the conditions that a study compares: an experiment, run under several seeds.

    Attributes:
        name: its name, which no other condition of the study has.
        experiment: the experiment that is run under each of the seeds.
        seeds: the seeds.
        factors: its value of each factor of the study, by name.
    """

    name: str
    experiment: Description
    seeds: tuple[int, ...]
    factors: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Study:
    """Conditions and their seeds.

    Attributes:
        name: name of the study, which becomes part of the folder's name.
        conditions: what is compared.
        ceilings: whether the ceiling and the reactive bound of each cell are computed.
        keep_frames: whether the run folders of all cells are kept in the study folder.
        ceiling_every: the ceiling looks at one frame out of so many.

    Raises:
        DescriptionError: there are no conditions, two have the same name, a part cannot be imported by other processes,
            or `ceiling_every` is not a whole number from 1 up.

    Example:
        >>> from somatopy import paper
        >>> study = Study("two", (Condition("paper", paper(), (0, 1)),))
        >>> [(cell.condition, cell.seed) for cell in study.cells()]
        [('paper', 0), ('paper', 1)]
    """

    name: str
    conditions: tuple[Condition, ...]
    ceilings: bool = True
    keep_frames: bool = False
    ceiling_every: int = EVERY

    def __post_init__(self) -> None:
        if type(self.ceiling_every) is not int or self.ceiling_every < 1:
            raise DescriptionError(
                f"ceiling_every = {self.ceiling_every!r} must be a whole number from 1 up: the ceiling looks at "
                f"one frame out of so many. If it is not given, it is {EVERY}."
            )
        names = [condition.name for condition in self.conditions]
        if not names:
            raise DescriptionError(f"The study {self.name!r} has no conditions: give it at least one.")
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise DescriptionError(f"Conditions need names of their own; {', '.join(map(repr, twice))} comes twice.")
        for condition in self.conditions:
            _check(condition)

    def cells(self) -> list[Cell]:
        """All cells, those of one seed together, in the order of the conditions."""
        seeds = list(dict.fromkeys(seed for condition in self.conditions for seed in condition.seeds))
        return [
            Cell(
                condition.name,
                condition.factors,
                condition.experiment.replaced(seed=seed),
                self.ceilings,
                self.ceiling_every,
            )
            for seed in seeds
            for condition in self.conditions
            if seed in condition.seeds
        ]


def _check(condition: Condition) -> None:
    if not condition.seeds:
        raise DescriptionError(f"The condition {condition.name!r} has no seeds: give it at least one.")
    try:
        check_numbers(condition.experiment)
    except DescriptionError as error:
        raise DescriptionError(f"The condition {condition.name!r}: {error}") from error
    kinds = _KIND.findall(condition.experiment.model_dump_json())
    if here := [kind for kind in kinds if kind.startswith("__main__:") or NOT_BY_PLACE.search(kind)]:
        raise DescriptionError(
            f"The condition {condition.name!r} has a part that only this process has ({here[0]}). The processes of a "
            "study must import it: put it into a module, and name it by its place, my_package.my_file:MyLearner."
        )


def seeds_of(seeds: Any, seed: int = 0) -> tuple[int, ...]:
    """Seeds from a number of them, or from a list.

    Args:
        seeds: number of seeds, from `seed` up, or the seeds themselves.
        seed: the first one.

    Raises:
        DescriptionError: neither a positive number nor a list of different whole numbers from 0 up.

    Example:
        >>> seeds_of(3, seed=5), seeds_of([1, 4])
        ((5, 6, 7), (1, 4))
    """
    if not _is_seed(seed):
        raise DescriptionError(f"seed = {seed!r}, the first seed, must be a whole number from 0 up.")
    if isinstance(seeds, int) and not isinstance(seeds, bool):
        listed: Sequence[Any] = range(seed, seed + seeds)
    else:
        listed = seeds if isinstance(seeds, Sequence) and not isinstance(seeds, str) else ()
    if not listed or not all(map(_is_seed, listed)) or len(set(listed)) < len(listed):
        raise DescriptionError(
            f"seeds = {seeds!r} must be how many seeds there are, such as 5, or a list of different ones, such as "
            "[0, 1, 2]; seeds are whole numbers from 0 up."
        )
    return tuple(listed)


def _is_seed(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0
