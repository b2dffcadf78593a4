"""The flags that experiment commands share, and how they change a description: file < short flag < dotted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, make_dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any

import tyro

from somatopy.cli.mirror import keys, mark, mirrored, plain, shown
from somatopy.cli.overrides import Option, aliases, chosen, damage_of_phase
from somatopy.experiment.changes import flagged
from somatopy.experiment.description import Description, DescriptionError, validated

__all__ = ["Flags", "OnCheckpoint", "OnRun", "Options", "parse"]

_DAMAGES = "none|paper|offset:A,B,C,D|KIND"
_OUT = "The run folder, new or empty; runs/<time>_<name>_seed<k> if none is named."
_Switch = Annotated[bool, tyro.conf.FlagCreatePairsOff]
_CANNOT = "The options lead to an experiment that cannot be run"
_BEHIND = """
Short options choose, dotted ones set any field of what is chosen.

Fields of another kind are shown with it: --learner fixed --help.

More is done in phase N by --phases.N.interventions.K.kind KIND.

K counts from 0 what is done in it: start, plastic, damage, then the rest.
"""


@dataclass(frozen=True)
class Flags:
    """Short flags; what is None leaves the description as it is."""

    eye: Annotated[str | None, mark("KIND", "What finds the marker.", None)] = None
    motion: Annotated[str | None, mark("dynamic|kinematic", "Physics, or joints that obey at once.", None)] = None
    learner: Annotated[str | None, mark("KIND", "What moves the head.", None)] = None
    minutes: Annotated[float | None, mark("MINUTES", "Robot time of the first phase.", None)] = None
    damage_minutes: Annotated[float | None, mark("MINUTES", "Robot time of the damaged phase.", None)] = None
    damage: Annotated[
        str | None, mark(_DAMAGES, "Damage of that phase, see somatopy list; numbers in rad, one a joint.", None)
    ] = None
    healed_minutes: Annotated[
        float | None, mark("MINUTES", "Robot time of a last phase, in which the damage is undone.", None)
    ] = None
    out: Annotated[Path | None, mark("FOLDER", _OUT, None)] = None
    json: Annotated[_Switch, mark(None, "Print one JSON object; all else goes to standard error.", None)] = False
    debug: Annotated[_Switch, mark(None, "Show tracebacks.", None)] = False


@dataclass(frozen=True)
class Options:
    """What the command line says.

    Attributes:
        description: the experiment that the flags lead to.
        flags: the short flags as they were given.
    """

    description: Description
    flags: Any

    @property
    def out(self) -> Path | None:
        """The folder that was named."""
        out: Path | None = self.flags.out
        return out

    @property
    def json(self) -> bool:
        """Whether to print one JSON object."""
        return bool(self.flags.json)


def parse(
    args: Sequence[str], description: Description, program: str, text: str, flags: type[Flags] = Flags
) -> Options:
    """Short flags, then dotted overrides, over `description`.

    Args:
        args: the command line behind the verb and its positional argument.
        description: what a preset or file says.
        program: how the command is called, for the help text.
        text: what it does, with an example, for the help text.
        flags: the short flags, where a command has more than the common ones.

    Raises:
        DescriptionError: an unknown option (the valid ones are listed), or a value that does not fit.
        SystemExit: help was asked for (0) or a value does not parse (2).
    """
    asked = [a for a in args if a not in ("-h", "--help")]
    known = {f.name for f in fields(flags)}
    groups = list(_by_option(asked))
    short = [word for words in groups if _name(words) in known for word in words]
    given = tyro.cli(flags, args=short, prog=program)
    table = flagged(vars(given), description)
    dotted = chosen(table, [Option.of(words) for words in groups if _name(words) not in known])
    described = _checked(table, groups)
    _check_names(groups, [*sorted(known), *keys(mirrored(described)), *aliases(described)])
    if len(asked) < len(args):
        _read(mirrored(described, as_help=True), flags, ["--help"], program, text + _BEHIND)
    words = [*short, *(word for option in dotted for word in option.words)]
    found = _read(mirrored(described), flags, words, program, text)
    return Options(_checked(plain(found.description), groups), given)


def _read(mirror: Any, flags: type[Flags], words: Sequence[str], program: str, text: str) -> Any:
    """Let tyro read the words into short flags and a mirror of the description."""
    entry = ("description", shown(type(mirror)), field(default_factory=lambda: mirror))
    command = make_dataclass("Command", [entry], bases=(flags,), frozen=True)
    return tyro.cli(command, args=words, prog=program, description=text, config=(tyro.conf.AvoidSubcommands,))


def _checked(table: Mapping[str, Any], groups: Sequence[list[str]]) -> Description:
    """The description of a table, or an error that names each key as it was written."""
    try:
        return validated(table, _CANNOT)
    except DescriptionError as error:
        said = str(error)
        for number, phase in enumerate(table["phases"]):
            place = damage_of_phase([entry["kind"] for entry in phase.get("interventions", ())])
            if place is not None and _damage_was_written(number, groups):
                said = said.replace(f"phases.{number}.interventions.{place}.", f"phases.{number}.damage.")
        raise DescriptionError(said) from error


def _damage_was_written(phase: int, groups: Sequence[list[str]]) -> bool:
    """Whether an option speaks of a phase's damage by its short form."""
    names = [_name(words) for words in groups]
    return (phase == 1 and "damage" in names) or any(name.startswith(f"phases.{phase}.damage") for name in names)


def _by_option(args: Sequence[str]) -> Iterator[list[str]]:
    """The words of each option."""
    group: list[str] = []
    for word in args:
        if word.startswith("--") and group:
            yield group
            group = []
        group.append(word)
    if group:
        yield group


def _name(words: Sequence[str]) -> str:
    return words[0].removeprefix("--").partition("=")[0].replace("-", "_")


# -- unknown options ---------------------------------------------------------------------------------------------------


def _check_names(groups: Sequence[list[str]], valid: Sequence[str]) -> None:
    for words in groups:
        name, word = _name(words), words[0].partition("=")[0]
        if not word.startswith("--"):
            raise DescriptionError(f"{word!r} was not expected here; options begin with --.")
        if name not in valid:
            raise DescriptionError(f"Unknown option {word}. {_meant(name, valid)}Valid ones: {_near(name, valid)}.")


def _meant(name: str, valid: Sequence[str]) -> str:
    likely = get_close_matches(name, valid, n=1, cutoff=0.8)
    return f"Did you mean {_written(likely[0])}? " if likely else ""


def _near(name: str, valid: Sequence[str]) -> str:
    """The options of the innermost table that exists, and the tables in it."""
    table = name
    while table and not any(key.startswith(f"{table}.") for key in valid):
        table = table.rpartition(".")[0]
    prefix = f"{table}." if table else ""
    there = [key.removeprefix(prefix).partition(".") for key in valid if key.startswith(prefix)]
    tables = [f"{prefix}{first}.*" for first, dot, _ in there if dot]
    single = [f"{prefix}{first}" for first, dot, _ in there if not dot]
    return ", ".join(map(_written, dict.fromkeys([*single, *tables])))


def _written(key: str) -> str:
    return "--" + key.replace("_", "-")


# -- commands on run folders -------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class OnRun:
    """What the commands that take a run folder share."""

    run: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(help="The run folder.", metavar="RUN")]
    json: Annotated[_Switch, mark(None, "Print one JSON object.", None)] = False
    debug: Annotated[_Switch, mark(None, "Show tracebacks.", None)] = False


@dataclass(frozen=True)
class OnCheckpoint(OnRun):
    """What the commands that go on from a run's checkpoint share."""

    anyway: Annotated[
        _Switch, mark(None, "Go on although versions or code are others than those that wrote the folder.", None)
    ] = False
