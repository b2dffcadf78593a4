"""Words of a command line: what they mean as help, read into a dataclass, or refused in one sentence."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Sequence
from contextlib import redirect_stderr, suppress
from dataclasses import MISSING, fields, is_dataclass
from io import StringIO
from textwrap import fill
from typing import Any, NamedTuple, TypeVar, get_type_hints

import tyro

from somatopy.experiment.description import DescriptionError
from somatopy.validation import meant

__all__ = ["Word", "check_flags", "help_asked", "laid_out", "page", "parsed", "read", "words_of", "written"]

T = TypeVar("T")
_WIDEST, _COLUMN = 100, 30
_HELP = ("-h", "--help")
#: What some placeholders for a value stand for.
_TAKES = {
    **dict.fromkeys(("INT", "N", "K", "FRAMES"), "a whole number"),
    "INT ...": "whole numbers",
    "FLOAT": "a number",
    "FLOAT ...": "numbers",
    "FLOAT|None": "a number, or None",
    "MINUTES": "a number of minutes",
    "True|False": "True or False",
}


class Word(NamedTuple):
    """An option of a command, or a place for a word without an option.

    Attributes:
        name: as it is written, without dashes before it.
        metavar: what stands for its value; empty for a switch.
        text: what it means.
        default: what the help says of its default.
        positional: whether no option stands before it.
        hidden: whether the help leaves it out, since it has neither text nor default.
    """

    name: str
    metavar: str
    text: str
    default: str
    positional: bool
    hidden: bool

    @property
    def usage(self) -> str:
        """How it is written."""
        return self.metavar if self.positional else f"{written(self.name)} {self.metavar}".rstrip()

    @property
    def takes(self) -> str:
        """What may stand in the place of its value."""
        choices = self.metavar.split("|")
        listed = len(choices) > 1 and all(choice == choice.lower() for choice in choices)
        said = f"one of {', '.join(choices)}" if listed else self.metavar or "no value"
        return _TAKES.get(self.metavar, said)


def written(name: str) -> str:
    """An option as it is written."""
    return "--" + name.replace("_", "-")


# -- what a command takes ----------------------------------------------------------------------------------------------


def words_of(part: Any, prefix: str = "") -> Iterator[Word]:
    """The words of a dataclass of options, or of a mirror, those of tables in it with dotted names.

    Args:
        part: the class, or an instance whose values are the defaults.
        prefix: of their names.
    """
    hints = get_type_hints(part if isinstance(part, type) else type(part), include_extras=True)
    for entry in fields(part):
        marks = getattr(hints[entry.name], "__metadata__", ())
        told = next((mark for mark in marks if hasattr(mark, "metavar")), None)
        value = entry.default if isinstance(part, type) else getattr(part, entry.name)
        name = prefix + ((told.name if told else None) or entry.name)
        if _is_table(value):
            yield from words_of(value, f"{name}.")
        elif isinstance(value, tuple) and any(map(_is_table, value)):
            for number, item in enumerate(value):
                yield from words_of(item, f"{name}.{number}.")
        elif told and tyro.conf.Fixed not in marks:
            positional = tyro.conf.Positional in marks
            default = _default(told, value)
            yield Word(name, told.metavar or "", told.help or "", default, positional, not (told.help or default))


def _is_table(value: Any) -> bool:
    return is_dataclass(value) and not isinstance(value, type)


def _default(told: Any, value: Any) -> str:
    if told.help_behavior_hint is not None:
        return str(told.help_behavior_hint)
    return "" if value is MISSING else f"(default: {_shown(value)})"


def _shown(value: Any) -> str:
    return " ".join(map(_shown, value)) if isinstance(value, tuple | list) else str(value)


# -- help --------------------------------------------------------------------------------------------------------------


def help_asked(args: Sequence[str]) -> bool:
    """Whether the words ask for help."""
    return any(word in _HELP for word in args)


def page(program: str, text: str, words: Sequence[Word], more: str = "") -> str:
    """The help of a command.

    Args:
        program: how it is called, without its options.
        text: what it does, with an example.
        words: what it takes.
        more: what stands at the end.
    """
    said = "\n\n".join(map(_paragraph, text.strip().split("\n\n")))
    return "\n\n".join([f"usage: {program} [OPTIONS]", said, laid_out(words), *([more] if more else [])])


def _width() -> int:
    return min(shutil.get_terminal_size().columns, _WIDEST) - 1


def _paragraph(text: str) -> str:
    """A paragraph as wide as the terminal; examples and lists keep their lines."""
    if text.startswith(("example:", " ")):
        return text
    return fill(" ".join(text.split()), _width(), break_on_hyphens=False)


def laid_out(words: Sequence[Word]) -> str:
    """Each word with its meaning beside it, as wide as the terminal."""
    return "\n".join(_entry(word) for word in words if not word.hidden)


def _entry(word: Word) -> str:
    width, begin = _width(), f"  {word.usage}"
    said = " ".join(filter(None, (word.text, word.default)))
    indent = " " * _COLUMN
    if len(begin) < _COLUMN - 1:
        return fill(said, width, initial_indent=begin.ljust(_COLUMN), subsequent_indent=indent, break_on_hyphens=False)
    usage = fill(begin.strip(), width, initial_indent="  ", subsequent_indent=" " * 6, break_on_hyphens=False)
    return f"{usage}\n{fill(said, width, initial_indent=indent, subsequent_indent=indent, break_on_hyphens=False)}"


# -- reading -----------------------------------------------------------------------------------------------------------


def read(command: type[T], args: Sequence[str], program: str, text: str) -> T:
    """The options of a command that takes no dotted ones.

    Args:
        command: a dataclass; each option takes one value or none.
        args: the words behind the verb.
        program: how the command is called: somatopy resume.
        text: what it does, with an example, for the help.

    Raises:
        DescriptionError: an unknown option (the valid ones are listed), a word too many or too few, or a wrong value.
        SystemExit: help was asked for, and has been printed.
    """
    words = list(words_of(command))
    places = [word for word in words if word.positional]
    if help_asked(args):
        print(page(" ".join([program, *(place.metavar for place in places)]), text, words))
        raise SystemExit(0)
    options = {word.name: word for word in words if not word.positional}
    groups = list(_grouped(args, options))
    check_flags([group for group in groups if group[0].startswith("-")], options)
    _check_places([group[0] for group in groups if not group[0].startswith("-")], places, text)
    found: T = parsed(command, groups, program, options)
    return found


def _grouped(args: Sequence[str], options: dict[str, Word]) -> Iterator[list[str]]:
    """The words of each option, and each other word alone."""
    left = list(args)
    while left:
        group = [left.pop(0)]
        known = options.get(name_of(group[0])) if group[0].startswith("--") else None
        if known and known.metavar and "=" not in group[0] and left and not left[0].startswith("--"):
            group.append(left.pop(0))
        yield group


def name_of(word: str) -> str:
    """The name of the option that a word is."""
    return word.removeprefix("--").partition("=")[0].replace("-", "_")


def check_flags(groups: Sequence[Sequence[str]], options: dict[str, Word]) -> None:
    """Refuse what is no option, options without their value, and more words than an option takes.

    Args:
        groups: options, each with the words behind it.
        options: those that there are, by name.
    """
    for first, *behind in groups:
        word = first.partition("=")[0]
        known = options.get(name_of(first))
        if known is None:
            said = meant(word, map(written, options))
            raise DescriptionError(f"Unknown option {word}. {said}Valid ones: {', '.join(map(written, options))}.")
        values = [*first.partition("=")[2:], *behind] if "=" in first else behind
        if known.metavar and (not values or ("=" in first and values == [""])):
            raise DescriptionError(f"{word} needs {known.takes} behind it: {known.usage}. {known.text}")
        if len(values) > bool(known.metavar):
            raise DescriptionError(f"{values[-1]!r} was not expected here: {word} takes {known.takes}.")


def _check_places(given: Sequence[str], places: Sequence[Word], text: str) -> None:
    many = any(place.metavar.endswith("...") for place in places)
    if len(given) < len(places):
        place, example = places[len(given)], text.partition("example: ")[2].partition("\n")[0]
        raise DescriptionError(f"{place.metavar.rstrip('.')} is missing: {place.text} For example: {example}")
    if len(given) > len(places) and not many:
        raise DescriptionError(f"{given[len(places)]!r} was not expected here; options begin with --.")


def parsed(command: Any, groups: Sequence[Sequence[str]], program: str, options: dict[str, Word]) -> Any:
    """Read options by a dataclass, or say which of them has a wrong value.

    Raises:
        DescriptionError: the option, its value, and what it takes.
    """
    with suppress(SystemExit):
        return _tyro(command, groups, program)
    own = [group for group in groups if group[0].startswith("--")]
    for group in own:
        try:
            _tyro(command, [*(other for other in groups if other not in own), group], program)
        except SystemExit:
            raise DescriptionError(_refusal(group, options)) from None
    raise DescriptionError(f"The words {' '.join(word for group in groups for word in group)} cannot be read.")


def _tyro(command: Any, groups: Sequence[Sequence[str]], program: str) -> Any:
    words = [word for group in groups for word in group]
    with redirect_stderr(StringIO()):  # what is wrong is said in one sentence instead
        return tyro.cli(command, args=words, prog=program, console_outputs=False, config=(tyro.conf.AvoidSubcommands,))


def _refusal(group: Sequence[str], options: dict[str, Word]) -> str:
    option, _, value = group[0].partition("=")
    values, known = " ".join(filter(None, (value, *group[1:]))), options.get(name_of(option))
    if known is None:
        return f"{option} {values} cannot be read."
    near = meant(values, known.metavar.split("|")) if "|" in known.metavar else ""
    wrong = f"{option} {values} cannot be read: it takes" if values else f"{option} needs"
    return f"{wrong} {known.takes}. {near}{known.text}"
