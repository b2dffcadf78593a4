"""somatopy compare: learners and damages, under many seeds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from typing import Annotated, Any

from somatopy.cli.mirror import mark
from somatopy.cli.options import SWITCH, Flags, parse
from somatopy.cli.run import note
from somatopy.cli.study import carry_out
from somatopy.experiment import Description, DescriptionError, paper
from somatopy.experiment.building import arm_of
from somatopy.experiment.ceiling import EVERY
from somatopy.experiment.changes import changed, damage_named
from somatopy.experiment.presets import CONTROLS
from somatopy.experiment.progress import robot_time
from somatopy.interventions import JOINTS, SUITE
from somatopy.registry import LEARNERS
from somatopy.studies.plan import Condition, Study, seeds_of
from somatopy.validation import near

__all__ = ["main"]

TEXT = """Compare learners and damages under many seeds: every learner with every damage.

All runs begin with an intact phase and go on with a damaged one; --minutes is their robot time together. Without --eye
they have the geometric eye. Learners of one seed meet the same arm movement.

example: somatopy compare --learners hebbian,random,nearest --damages none,paper --seeds 5 --minutes 30
"""


@dataclass(frozen=True)
class CompareFlags(Flags):
    """The common flags, and those of a comparison; those that choose one point to those that take several."""

    learner: Annotated[str | None, mark("KIND", "", None)] = None
    damage: Annotated[str | None, mark("KIND", "", None)] = None
    out: Annotated[Path | None, mark("FOLDER", "The study folder. (default: a new one in runs/)", None)] = None
    learners: Annotated[str, mark("A,B,...", "Kinds of learners or controls, such as frozen.")] = "hebbian,random,fixed"
    damages: Annotated[str, mark("A,B,...", "Damages as in --damage; all: one of each.")] = "none,paper"
    seeds: Annotated[int, mark("N", "How many seeds, from --seed up.")] = 5
    processes: Annotated[int | None, mark("N", "Processes of this machine. (default: one a core)", None)] = None
    ray: Annotated[str | None, mark("ADDRESS", "Run on the Ray cluster at this address.", None)] = None
    ceiling_every: Annotated[int, mark("FRAMES", "From how many frames the ceiling looks at one.")] = EVERY
    dry_run: Annotated[SWITCH, mark(None, "Say what time, memory and disk it needs; run nothing.", None)] = False


def main(args: Sequence[str]) -> int:
    """Run `somatopy compare [OPTIONS]`."""
    base = changed(paper(), {"eye": "geometric"})
    options = parse(args, base, "somatopy compare", TEXT, CompareFlags)
    flags, described = options.flags, options.description
    for word, instead in (("learner", "--learners"), ("damage", "--damages")):
        if getattr(flags, word) is not None:
            raise DescriptionError(f"--{word} chooses one; compare takes several: {instead} {getattr(flags, word)},...")
    seeds = seeds_of(flags.seeds, described.seed)
    conditions = _crossed(described, _words(flags.learners), _damages(flags.damages, described), seeds)
    study = Study("compare", tuple(conditions), ceiling_every=flags.ceiling_every)
    if not (flags.quiet or flags.dry_run):
        note(f"In each run: {robot_time(described)}")
    return carry_out(study, replace(flags, out=options.out))


def _words(text: str) -> list[str]:
    return [word.strip() for word in text.split(",") if word.strip()]


def _damages(text: str, described: Description) -> list[str]:
    """Damages, of which `all` stands for those that the arm has joints enough for.

    Raises:
        DescriptionError: nobody knows one of them, or one that is named needs more joints.
    """
    named = _named(text)
    if not {"all", *JOINTS}.intersection(named):
        return named
    arm = arm_of(described)
    needed = {name: JOINTS.get(name, 1) for name in SUITE}
    there = f"{len(arm)} ({', '.join(arm.names)})"
    for name in named:
        if needed.get(name, 1) > len(arm):
            raise DescriptionError(
                f"--damages {name} needs an arm with {needed[name]} joints, and this one has {there}. Leave it out, or "
                "choose another damage, such as gain."
            )
    if "all" in named and (without := [f"{name} (needs {n})" for name, n in needed.items() if n > len(arm)]):
        note(f"Left out of --damages all, since the arm has too few joints, {there}: {', '.join(without)}.")
    whole = [name for name, n in needed.items() if n <= len(arm)]
    return [each for name in named for each in (whole if name == "all" else [name])]


def _named(text: str) -> list[str]:
    """Damages as they are named; the numbers of an offset are separated by commas, too."""
    found: list[str] = []
    for word in _words(text.replace(";", ",")):
        if found and found[-1].startswith("offset:") and _is_number(word):
            found[-1] += f",{word}"
        else:
            found.append(word)
    for word in found:
        if word != "all":
            damage_named(word, "--damages")
    return found


def _is_number(word: str) -> bool:
    try:
        return isfinite(float(word))
    except ValueError:
        return False


def _crossed(
    described: Description, learners: Sequence[str], damages: Sequence[str], seeds: tuple[int, ...]
) -> Iterator[Condition]:
    for learner in learners:
        for damage in damages:
            name = f"{learner}, {damage}"
            changes: dict[str, Any] = {"damage": damage, **_learner(learner)}
            yield Condition(name, changed(described, changes, name), seeds, {"learner": learner, "damage": damage})


def _learner(name: str) -> dict[str, Any]:
    """A control by its name, or a kind of learner."""
    if name in CONTROLS:
        return {"control": name}
    if name in LEARNERS or ":" in name:
        return {"learner": name}
    raise DescriptionError(
        f"The learner {name!r} is unknown; choose kinds of learners ({', '.join(LEARNERS)}), controls "
        f"({', '.join(CONTROLS)}){near(name, [*LEARNERS, *CONTROLS])}, or name one of your own by its place: "
        "my_package.my_file:MyLearner."
    )
