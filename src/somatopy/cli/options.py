"""The flags that experiment commands share, and how they change a description: file < short flag < dotted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro
from pydantic import BaseModel, ValidationError

from somatopy.experiment.description import (
    Description,
    DescriptionError,
    FixedControl,
    Hebbian,
    NearestControl,
    RandomControl,
    explain,
    frames_of,
    validated,
)

__all__ = ["LEARNERS", "OnRun", "Options", "parse"]

LEARNERS = {"hebbian": Hebbian, "random": RandomControl, "fixed": FixedControl, "nearest": NearestControl}

_DAMAGES = "none|paper|offset:a,b,c,d"
_OUT = "The run folder, new or empty; runs/<time>_<name>_seed<k> if none."
_Switch = Annotated[bool, tyro.conf.FlagCreatePairsOff]


@dataclass(frozen=True)
class Flags:
    """Short flags; what is None leaves the description as it is."""

    eye: Annotated[Literal["fiducial", "geometric"] | None, tyro.conf.arg(help="What finds the marker.")] = None
    motion: Annotated[Literal["dynamic", "kinematic"] | None, tyro.conf.arg(help="Physics or none.")] = None
    learner: Annotated[
        Literal["hebbian", "random", "fixed", "nearest"] | None, tyro.conf.arg(help="What moves the head.")
    ] = None
    minutes: Annotated[float | None, tyro.conf.arg(help="Robot time of the first phase.")] = None
    damage_minutes: Annotated[float | None, tyro.conf.arg(help="Robot time of the damaged phase.")] = None
    damage: Annotated[str | None, tyro.conf.arg(metavar=_DAMAGES, help="Damage of that phase.")] = None
    out: Annotated[Path | None, tyro.conf.arg(help=_OUT)] = None
    json: Annotated[_Switch, tyro.conf.arg(help="Print one JSON object, all else to standard error.")] = False
    debug: Annotated[_Switch, tyro.conf.arg(help="Show tracebacks.")] = False


@dataclass(frozen=True)
class Options(Flags):
    """Flags, and the description that they and the dotted overrides lead to."""

    description: Annotated[Description, tyro.conf.FlagConversionOff, tyro.conf.arg(name="")] = field(
        default_factory=Description
    )


def parse(args: Sequence[str], description: Description, program: str, text: str) -> Options:
    """Short flags, then dotted overrides, over `description`.

    Args:
        args: the command line behind the verb and its positional argument.
        description: what a preset or file says.
        program: how the command is called, for the help text.
        text: what it does, with an example, for the help text.

    Raises:
        DescriptionError: an unknown option (the valid ones are listed), or a value that does not fit.
        SystemExit: help was asked for (0) or a value does not parse (2).
    """
    helpless = [a for a in args if a not in ("-h", "--help")]
    known = {f.name for f in fields(Flags)}
    short = [a for name, a in _by_option(helpless) if name in known]
    flags = tyro.cli(Flags, args=[a for group in short for a in group], prog=program)
    described = _apply(flags, description)
    _check_names(helpless, known, described)
    try:
        return tyro.cli(
            Options,
            args=args,
            default=Options(description=described),
            prog=program,
            description=text,
            config=(tyro.conf.AvoidSubcommands,),
        )
    except ValidationError as error:
        raise DescriptionError(f"The options lead to an experiment that cannot be run: {explain(error)}.") from error


def _by_option(args: Sequence[str]) -> Iterator[tuple[str, list[str]]]:
    """Each option's name, with underscores, and its words."""
    group: list[str] = []
    for word in args:
        if word.startswith("--") and group:
            yield _name(group[0]), group
            group = []
        group.append(word)
    if group:
        yield _name(group[0]), group


def _name(word: str) -> str:
    return word.removeprefix("--").partition("=")[0].replace("-", "_")


def _check_names(args: Sequence[str], known: set[str], description: Description) -> None:
    keys = list(_keys(description))
    for name, group in _by_option(args):
        if not group[0].startswith("--"):
            raise DescriptionError(f"{group[0]!r} was not expected here; options begin with --.")
        if name not in known and name not in keys:
            valid = ", ".join("--" + k.replace("_", "-") for k in _near(name, keys) or [*sorted(known), *keys])
            raise DescriptionError(f"Unknown option {group[0].partition('=')[0]}. Valid ones: {valid}.")


def _near(name: str, keys: Sequence[str]) -> list[str]:
    """The keys of the innermost table that an unknown dotted name has in common with them."""
    while name := name.rpartition(".")[0]:
        if near := [key for key in keys if key.startswith(name + ".")]:
            return near
    return []


def _keys(value: Any, prefix: str = "") -> Iterator[str]:
    """Dotted keys of the description's leaves."""
    if isinstance(value, BaseModel):
        for name in type(value).model_fields:
            yield from _keys(getattr(value, name), f"{prefix}.{name}" if prefix else name)
    elif isinstance(value, tuple) and value and isinstance(value[0], BaseModel):
        for k, item in enumerate(value):
            yield from _keys(item, f"{prefix}.{k}")
    else:
        yield prefix


def _apply(flags: Flags, description: Description) -> Description:
    table = description.model_dump()
    if flags.motion:
        table["body"]["motion"] = flags.motion
    for part, kind in (("learner", flags.learner), ("eye", flags.eye)):
        if kind and kind != table[part]["kind"]:
            table[part] = {"kind": kind}
    phases = table["phases"] = list(table["phases"])
    if flags.minutes is not None:
        phases[0]["frames"] = frames_of(flags.minutes)
    if flags.damage_minutes is not None or flags.damage is not None:
        if len(phases) < 2:
            phases.append({"name": "damaged", "frames": 0, "damage": {"kind": "offset"}, "trend_breaks": (7,)})
        if flags.damage_minutes is not None:
            phases[1]["frames"] = frames_of(flags.damage_minutes)
        if flags.damage is not None:
            phases[1]["damage"] = _damage(flags.damage)
    return validated(table, "The options lead to an experiment that cannot be run")


def _damage(text: str) -> dict[str, Any]:
    """A damage from its short form."""
    kind, _, numbers = text.partition(":")
    if text == "none":
        return {"kind": "none"}
    if text == "paper":
        return {"kind": "offset"}
    if kind == "offset" and numbers:
        try:
            return {"kind": "offset", "offset": tuple(float(n) for n in numbers.split(","))}
        except ValueError as error:
            raise DescriptionError(f"--damage {text!r}: {error}. Write numbers, rad, one a joint.") from error
    raise DescriptionError(f"--damage {text!r} is unknown; choose none, paper or offset:a,b,c,d (rad, one a joint).")


@dataclass(frozen=True)
class OnRun:
    """What the commands that take a run folder share."""

    run: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(help="The run folder.", metavar="RUN")]
    json: Annotated[_Switch, tyro.conf.arg(help="Print one JSON object.")] = False
    debug: Annotated[_Switch, tyro.conf.arg(help="Show tracebacks.")] = False
