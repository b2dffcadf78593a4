"""Run a study in one call."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from somatopy.analysis.cells import StudyResult
from somatopy.experiment.changes import changed
from somatopy.experiment.description import Description, DescriptionError
from somatopy.studies.driver import Backend, perform
from somatopy.studies.plan import Condition, Study, seeds_of
from somatopy.studies.reading import load_plan, planned

__all__ = ["backend_for", "study"]


def study(
    what: str | Path | Study | Mapping[str, Any],
    *,
    seeds: Any = 1,
    seed: int = 0,
    eye: str | None = "geometric",
    out: str | Path | None = None,
    processes: int | None = None,
    ray: str | None = None,
    progress: bool = True,
) -> StudyResult:
    """Run many experiments, each under many seeds, in processes of this machine or on a Ray cluster.

    Args:
        what: a study file (TOML), also that of a search; a study; or descriptions by the name of their condition.
        seeds: number of seeds, from `seed` up, or a list of seeds. Only for descriptions.
        seed: the first seed.
        eye: the eye for all descriptions that are given by name. By default it is the geometric one, a model of the
            detector that is four (with physics) to seventeen times as fast. None keeps the eye of each description.
        out: the study folder: new, empty, or one of a study to continue; runs/<time>_<name> if None.
        processes: number of processes; as many as there are cores if None.
        ray: the address of a Ray cluster on which the cells run, as docs/studies.md explains; this machine if None.
        progress: whether to show the progress on standard error.

    Returns:
        The study folder, opened: its `table` has one row for each phase of each run.

    Raises:
        DescriptionError: something cannot be run, the folder cannot be used, or no Ray cluster answers. Nothing has run
            then.
        Interrupted: on Ctrl-C. Finished cells are kept, and the same call continues the study.
    """
    if isinstance(what, str | Path):
        table = load_plan(what)
        if "search" in table:
            from somatopy.studies.search import search, searched

            return search(searched(table), out, processes=processes, ray=ray, progress=progress)
        plan = planned(table)
    elif isinstance(what, Study):
        plan = what
    else:
        plan = Study("study", tuple(_conditions(what, seeds_of(seeds, seed), eye)))
    return perform(plan, out, processes=processes, backend=backend_for(plan, ray), progress=progress)


def backend_for(plan: Study, ray: str | None) -> Callable[[Path], Backend] | None:
    """The backend for `perform` on a Ray cluster at an address; None for this machine.

    Raises:
        DescriptionError: see `on_cluster`.
    """
    if ray is None:
        return None
    from somatopy.studies.cluster import on_cluster

    return on_cluster(plan, ray)


def _conditions(described: Mapping[str, Description], seeds: tuple[int, ...], eye: str | None) -> list[Condition]:
    if not isinstance(described, Mapping) or not all(isinstance(name, str) for name in described):
        raise DescriptionError(
            'A study is a file, a Study, or descriptions by the name of their condition, such as {"paper": paper()}; '
            f"not {described!r:.100}."
        )
    if wrong := [name for name, one in described.items() if not isinstance(one, Description)]:
        raise DescriptionError(
            f"{wrong[0]!r} must be a description, such as paper(), not {described[wrong[0]]!r}. To make a "
            "study from the plain data of a study file, call somatopy.studies.planned."
        )
    return [Condition(name, changed(one, {"eye": eye}) if eye else one, seeds) for name, one in described.items()]
