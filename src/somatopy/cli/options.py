"""The flags that experiment commands share, and how they change a description: file < short flag < dotted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, make_dataclass
from pathlib import Path
from typing import Annotated, Any, NoReturn

import tyro

from somatopy.cli.mirror import keys, mark, mirrored, plain, shown
from somatopy.cli.overrides import Option, aliases, chosen, damage_of_phase
from somatopy.cli.words import Word, check_flags, help_asked, laid_out, name_of, page, parsed, words_of, written
from somatopy.experiment.changes import flagged, scaled
from somatopy.experiment.description import Description, DescriptionError, validated
from somatopy.validation import meant

__all__ = ["DEBUG", "JSON", "QUIET", "SWITCH", "Flags", "OnCheckpoint", "OnRun", "Options", "parse"]

_DAMAGE = "Its damage: none, paper, offset:A,B,C,D (rad), or another that somatopy list names."
_MINUTES = "Robot time of all phases together, which keep their proportions; with --damage-minutes, of the first phase."
_EYE = "What finds the marker: fiducial (in rendered pictures) or geometric (computed, faster)."
_MOTION = "Physics (dynamic), or joints that obey at once (kinematic)."
_LEARNER = "What moves the head: best, hebbian (the paper's), or another that somatopy list names."
_OUT = "A folder, new or empty. (default: one in runs/)"
#: The type of an option without a value.
SWITCH = Annotated[bool, tyro.conf.FlagCreatePairsOff]
#: Switches that several commands have.
JSON = Annotated[SWITCH, mark(None, "Print one JSON object.", None)]
QUIET = Annotated[SWITCH, mark(None, "Say nothing but results and errors.", None)]
DEBUG = Annotated[SWITCH, mark(None, "Show tracebacks.", None)]
_CANNOT = "The options lead to an experiment that cannot be run"
_TABLES = """Further options set any field, such as --babbling.speed 0.5. They stand in the
tables {tables}.
--help TABLE lists the options of one, such as --help phases.
"""
_OF_A_TABLE = """These options set fields of {table}. Which there are depends on what is chosen:
for another choice, name it as well, as in --learner fixed --help learner.
"""
_OF_PHASES = """Phases, and what is done in them, are counted from 0 here, as places in a list:
phases.0 is what reports call phase 1. In --phases.N.interventions.K.kind KIND,
K counts start, plastic and damage as well, in this order, before the rest.
"""


@dataclass(frozen=True)
class Flags:
    """Short flags; what is None leaves the description as it is."""

    eye: Annotated[str | None, mark("KIND", _EYE, None)] = None
    motion: Annotated[str | None, mark("dynamic|kinematic", _MOTION, None)] = None
    learner: Annotated[str | None, mark("KIND", _LEARNER, None)] = None
    minutes: Annotated[float | None, mark("MINUTES", _MINUTES, None)] = None
    damage_minutes: Annotated[float | None, mark("MINUTES", "Robot time of the damaged phase.", None)] = None
    damage: Annotated[str | None, mark("KIND", _DAMAGE, None)] = None
    healed_minutes: Annotated[float | None, mark("MINUTES", "Robot time of a last phase without the damage.", None)] = (
        None
    )
    out: Annotated[Path | None, mark("FOLDER", _OUT, None)] = None
    json: JSON = False
    quiet: QUIET = False
    debug: DEBUG = False


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

    @property
    def quiet(self) -> bool:
        """Whether to say nothing but results and errors."""
        return bool(self.flags.quiet)


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
        DescriptionError: an unknown option (the valid ones are listed), a value that does not fit, or no frame to run.
        SystemExit: help was asked for, and has been printed.
    """
    asked, tables = _without_help(args)
    known = {word.name: word for word in words_of(flags)}
    groups = list(_by_option(asked))
    short = [words for words in groups if name_of(words[0]) in known]
    check_flags(short, known)
    given = parsed(flags, short, program, known)
    base = description if given.damage_minutes is not None else scaled(description, given.minutes)
    table = flagged({**vars(given), **({} if base is description else {"minutes": None})}, base)
    dotted = chosen(table, [Option.of(words) for words in groups if name_of(words[0]) not in known])
    described = _checked(table, groups)
    mirror = mirrored(described)
    _check_names(groups, [*known, *keys(mirror), *aliases(described)])
    if help_asked(args):
        _help(tables, mirrored(described, as_help=True), list(known.values()), program, text)
    options = known | {word.name: word for word in words_of(mirror)}
    found = parsed(_command(mirror, flags), [*short, *(option.words for option in dotted)], program, options)
    return Options(_with_frames(_checked(plain(found.description), groups)), given)


def _command(mirror: Any, flags: type[Flags]) -> type:
    """Short flags and a mirror of the description in one dataclass."""
    entry = ("description", shown(type(mirror)), field(default_factory=lambda: mirror))
    return make_dataclass("Command", [entry], bases=(flags,), frozen=True)


def _with_frames(description: Description) -> Description:
    if description.frames:
        return description
    raise DescriptionError(
        "The phases of this experiment have 0 frames in all, so that nothing would run. Give them robot time: "
        "--minutes 5."
    )


# -- help --------------------------------------------------------------------------------------------------------------


def _without_help(args: Sequence[str]) -> tuple[list[str], list[str]]:
    """The words that do not ask for help, and the tables that help is asked of."""
    left, tables, asking = [], [], False
    for word in args:
        asking = help_asked([word]) or (asking and not word.startswith("-"))
        if not asking:
            left.append(word)
        elif not help_asked([word]):
            tables.append(word)
    return left, tables


def _help(tables: Sequence[str], mirror: Any, flags: Sequence[Word], program: str, text: str) -> NoReturn:
    """Print the help of a command, or the options of the tables that are named."""
    words = list(words_of(mirror))
    parts = [_of_table(name, words) for name in tables] or [_of_command(words, flags, program, text)]
    print("\n\n".join(parts))
    raise SystemExit(0)


def _of_command(words: Sequence[Word], flags: Sequence[Word], program: str, text: str) -> str:
    single = [word for word in words if "." not in word.name]
    tables = dict.fromkeys(word.name.partition(".")[0] for word in words if "." in word.name)
    return page(program, text, [*single, *flags], _TABLES.format(tables=", ".join(tables)).rstrip())


def _of_table(name: str, words: Sequence[Word]) -> str:
    table = name.removeprefix("--").removesuffix(".*").replace("-", "_")
    own = [word for word in words if f"{word.name}.".startswith(f"{table}.")]
    if not own:
        tables = dict.fromkeys(word.name.rpartition(".")[0].replace("_", "-") for word in words if "." in word.name)
        every = dict.fromkeys(whole for each in tables for whole in (each.partition(".")[0], each))
        raise DescriptionError(
            f"There is no table {name!r} of options. {meant(name, every)}Tables: {', '.join(every)}."
        )
    behind = _OF_PHASES if table.startswith("phases") else ""
    return "\n".join([_OF_A_TABLE.format(table=name), laid_out(own), *([f"\n{behind.rstrip()}"] if behind else [])])


# -- what was written --------------------------------------------------------------------------------------------------


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
    names = [name_of(words[0]) for words in groups]
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


# -- unknown options ---------------------------------------------------------------------------------------------------


def _check_names(groups: Sequence[list[str]], valid: Sequence[str]) -> None:
    for words in groups:
        name, word = name_of(words[0]), words[0].partition("=")[0]
        if not word.startswith("--"):
            raise DescriptionError(f"{word!r} was not expected here; options begin with --.")
        if name not in valid:
            raise DescriptionError(
                f"Unknown option {word}. {meant(word, map(written, valid))}Valid ones: {_near(name, valid)}."
            )


def _near(name: str, valid: Sequence[str]) -> str:
    """The options of the innermost table that exists, and the tables in it."""
    table = name
    while table and not any(key.startswith(f"{table}.") for key in valid):
        table = table.rpartition(".")[0]
    prefix = f"{table}." if table else ""
    there = [key.removeprefix(prefix).partition(".") for key in valid if key.startswith(prefix)]
    tables = [f"{prefix}{first}.*" for first, dot, _ in there if dot]
    single = [f"{prefix}{first}" for first, dot, _ in there if not dot]
    return ", ".join(map(written, dict.fromkeys([*single, *tables])))


# -- commands on run folders -------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class OnRun:
    """What the commands that take a run folder share."""

    run: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(help="The run folder.", metavar="RUN")]
    json: JSON = False
    quiet: QUIET = False
    debug: DEBUG = False


@dataclass(frozen=True)
class OnCheckpoint(OnRun):
    """What the commands that go on from a run's checkpoint share."""

    anyway: Annotated[
        SWITCH, mark(None, "Go on although versions or code are others than those that wrote the folder.", None)
    ] = False
