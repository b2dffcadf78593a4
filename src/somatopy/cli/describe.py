"""somatopy describe: the description file of an experiment, with comments."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from textwrap import wrap
from typing import Any

from somatopy.cli.mirror import described_fields, is_table, kinds_of
from somatopy.cli.run import parse_named
from somatopy.experiment import Description
from somatopy.registry import Settings

__all__ = ["commented", "main"]

TEXT = """Print the description file (TOML) of a preset, a file or a run folder: every setting with its meaning.

Change what you like in it and run it. It takes the options of somatopy run, and prints what they lead to.

example: somatopy describe paper --learner best > my.toml
"""
_HEAD = """An experiment for somatopy. Change what you like, and run it: somatopy run my.toml
docs/description.md explains the format. What you delete has its default; with
preset = "paper" as the first line it has the value of that preset instead."""
_WIDTH = 100


def main(args: Sequence[str]) -> int:
    """Run `somatopy describe PRESET|FILE|RUN [OPTIONS]`."""
    options = parse_named(args, "somatopy describe PRESET|FILE|RUN", TEXT)
    described = options.description
    print(json.dumps(described.model_dump(mode="json")) if options.json else commented(described), end="")
    return 0


def commented(description: Description) -> str:
    """A description as TOML with a comment above each key; it parses to the same description.

    Example:
        >>> import tomllib
        >>> from somatopy.experiment import paper
        >>> Description.model_validate(tomllib.loads(commented(paper()))) == paper()
        True
    """
    return "\n".join([*_comment(_HEAD), "", *_table(description, ())]) + "\n"


def _table(part: Any, path: tuple[str, ...]) -> Iterator[str]:
    """The lines of a table: its plain keys first, then the tables in it."""
    if isinstance(part, Settings):
        yield from _comment(kinds_of(part))
        yield f"kind = {json.dumps(part.kind)}"
    tables: list[tuple[str, Any]] = []
    for name, _, text in described_fields(part):
        value = getattr(part, name)
        if is_table(value) or (isinstance(value, tuple) and value and all(map(is_table, value))):
            tables.append((name, value))
        else:
            yield from _key(name, value, text)
    for name, value in tables:
        for item in value if isinstance(value, tuple) else [value]:
            yield ""
            yield from _comment(_about(item))
            heading = ".".join([*path, name])
            yield f"[[{heading}]]" if isinstance(value, tuple) else f"[{heading}]"
            yield from _table(item, (*path, name))


def _about(part: Any) -> str:
    return (type(part).__doc__ or "").strip().partition("\n")[0]


def _key(name: str, value: Any, text: str) -> Iterator[str]:
    yield from _comment(text)
    if value is None:
        yield f"# {name} = (not set)"
    else:
        yield f"{name} = {_written(value)}"


def _written(value: Any) -> str:
    """A value as TOML has it; what JSON writes of texts, finite numbers, truth values and lists is TOML, too."""
    return json.dumps(value, default=str)


def _comment(text: str) -> Iterator[str]:
    for line in text.splitlines():
        yield from wrap(line, _WIDTH, initial_indent="# ", subsequent_indent="# ", break_on_hyphens=False)
