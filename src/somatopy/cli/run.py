"""somatopy run: a preset or a description file, into a run folder."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from somatopy.analysis import load_run
from somatopy.api import run
from somatopy.cli.options import parse
from somatopy.experiment import PRESETS, Description, DescriptionError, load_description

__all__ = ["main", "note", "result"]

TEXT = """Run a preset or a description file (TOML) and write a run folder.

example: somatopy run paper --learner random --minutes 20 --babbling.speed 0.5
"""


def main(args: Sequence[str]) -> int:
    """Run `somatopy run PRESET|FILE [OPTIONS]`."""
    named = bool(args) and not args[0].startswith("-")
    helping = any(a in ("-h", "--help") for a in args)
    if not named and not helping:
        raise DescriptionError(f"Name a preset ({', '.join(PRESETS)}) or a description file: somatopy run paper.")
    description = _described(args[0]) if named else PRESETS["paper"]()
    options = parse(args[1:] if named else args, description, "somatopy run PRESET|FILE", TEXT)
    folder = run(options.description, options.out).path
    if options.json:
        print(json.dumps(result(folder)))
    else:
        print(folder)
    return 0


def _described(name: str) -> Description:
    if name in PRESETS:
        return PRESETS[name]()
    if not Path(name).is_file():
        raise DescriptionError(f"{name!r} is neither a preset ({', '.join(PRESETS)}) nor a description file.")
    return load_description(name)


def result(folder: Path) -> dict[str, Any]:
    """What --json prints: the summary, with the folder and its cost beside it."""
    run = load_run(folder)
    return {"folder": str(folder), **(run.summary or {}), "cost": run.cost}


def note(text: str) -> None:
    """Say something to the person, not to the program that reads standard output."""
    print(text, file=sys.stderr)
