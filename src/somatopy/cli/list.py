"""somatopy list: what there is to choose from."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from textwrap import fill
from typing import Any

from somatopy.bodies import MODELS, Anatomy
from somatopy.cli.options import DEBUG, JSON
from somatopy.cli.words import read
from somatopy.experiment import PRESETS
from somatopy.experiment.description import stands_for
from somatopy.experiment.presets import CONTROLS
from somatopy.interventions import SUITE
from somatopy.registry import BABBLERS, BODIES, EYES, INTERVENTIONS, LEARNERS, MAPS, RULES, Kinds, UnknownKind

__all__ = ["main"]

TEXT = """List presets, robots, babbling ranges, and the kinds of each part. A name stands where the other
commands take it: `somatopy run paper --learner random`, or kind = "random" in a description.

example: somatopy list --json
"""
_WIDTH, _INDENT = 100, 22
Table = dict[str, dict[str, str]]


@dataclass(frozen=True)
class Options:
    """Options of this command."""

    json: JSON = False
    debug: DEBUG = False


def main(args: Sequence[str]) -> int:
    """Run `somatopy list [--json]`."""
    options = read(Options, args, "somatopy list", TEXT)
    table = _choices()
    print(json.dumps(table) if options.json else _laid_out(table))
    return 0


def _choices() -> Table:
    """Each title with the names under it, and what they are."""
    robots = {name: Anatomy.load(path) for name, path in MODELS.items()}
    done = _kinds(INTERVENTIONS)
    return {
        "presets": {name: _line(_maker(name).__doc__) for name in PRESETS},
        "bodies": {
            name: f"{robot.name}, a model for the kind mujoco: --body.model {name}." for name, robot in robots.items()
        }
        | _kinds(BODIES),
        "eyes": _kinds(EYES),
        "babblers": _kinds(BABBLERS),
        "babbling ranges": {name: ", ".join(["mechanical", *robot.ranges]) for name, robot in robots.items()},
        "learners": _kinds(LEARNERS),
        "maps": _kinds(MAPS),
        "rules": _kinds(RULES),
        "damages": {
            "none": "The robot stays as it is.",
            **{name: text for name, text in done.items() if stands_for("damage", name)},
            **{name: _settings_of(table) for name, table in SUITE.items() if name not in done},
        },
        "interventions": done,
    }


def _settings_of(damage: Mapping[str, Any]) -> str:
    """What a damage of the suite is: its kind and settings."""
    settings = ", ".join(f"{key} = {value}" for key, value in damage.items() if key != "kind")
    return f"The kind {damage['kind']} with {settings}."


def _laid_out(table: Table) -> str:
    """Titles, and under each its names with their texts, in lines of at most 100 columns."""
    return "\n\n".join("\n".join([title, *map(_entry, entries, entries.values())]) for title, entries in table.items())


def _entry(name: str, text: str) -> str:
    begin = f"  {name}".ljust(_INDENT - 2) + "  "
    return fill(text, _WIDTH, initial_indent=begin, subsequent_indent=" " * _INDENT, break_on_hyphens=False)


def _maker(preset: str) -> object:
    """What makes a preset, and says what it is."""
    return CONTROLS.get(preset.removeprefix("paper-"), PRESETS[preset])


def _kinds(kinds: Kinds) -> dict[str, str]:
    """Each kind of a sort, and the first line of what its settings say."""
    return {name: _said(kinds, name) for name in kinds}


def _said(kinds: Kinds, name: str) -> str:
    try:
        return _line(kinds.settings(name).__doc__)
    except UnknownKind as error:  # an installed package whose part cannot be found must not hide all others
        return f"{name} {error}."


def _line(text: str | None) -> str:
    return (text or "").strip().partition("\n")[0]
