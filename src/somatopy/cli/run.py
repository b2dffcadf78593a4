"""somatopy run: a preset or a description file, into a run folder."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Sequence
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

from somatopy.analysis import load_run
from somatopy.api import run
from somatopy.cli.options import Options, parse
from somatopy.cli.words import help_asked
from somatopy.experiment import PRESETS, Description, DescriptionError, load_description
from somatopy.experiment.run_folder import DESCRIPTION
from somatopy.validation import meant

__all__ = ["aside", "described", "main", "note", "parse_named", "result"]

TEXT = """Run a preset, a description file (TOML), or once more what a run folder holds, and write a new run folder.

example: somatopy run paper --learner random --minutes 20 --babbling.speed 0.5
"""
PROGRAM = "somatopy run PRESET|FILE|RUN"


def main(args: Sequence[str]) -> int:
    """Run `somatopy run PRESET|FILE [OPTIONS]`."""
    options = parse_named(args, PROGRAM, TEXT)
    with aside():
        folder = run(options.description, options.out, progress=not options.quiet).path
    if options.json:
        print(json.dumps(result(folder)))
    else:
        print(folder)
    return 0


def parse_named(args: Sequence[str], program: str, text: str) -> Options:
    """The options of a command whose first word names a preset, a description file or a run folder.

    Raises:
        DescriptionError: nothing is named, nothing has that name, or the options do not fit.
    """
    named = bool(args) and not args[0].startswith("-")
    if not named and not help_asked(args):
        verb = program.rpartition(" ")[0]
        raise DescriptionError(
            f"Name a preset ({', '.join(PRESETS)}), a description file or a run folder: {verb} paper."
        )
    description = described(args[0]) if named else PRESETS["paper"]()
    return parse(args[1:] if named else args, description, program, text)


def described(name: str) -> Description:
    """The description of a preset, of a file, or of a run folder."""
    path = Path(name)
    if name in PRESETS:
        return PRESETS[name]()
    if os.path.isfile(path):  # false also for what no file can be called
        return load_description(path)
    if os.path.isfile(path / DESCRIPTION):
        return load_description(path / DESCRIPTION)
    raise DescriptionError(
        f"{name!r} is neither a preset ({', '.join(PRESETS)}) nor a description file nor a run folder. "
        f"{meant(name, PRESETS)}".strip()
    )


def result(folder: Path) -> dict[str, Any]:
    """What --json prints: the summary, with the folder and its cost beside it."""
    run = load_run(folder)
    return {"folder": str(folder), **(run.summary or {}), "cost": run.cost}


def aside() -> redirect_stdout[Any]:
    """While this context lasts, what a part of one's own prints goes to standard error: the result stands alone."""
    return redirect_stdout(sys.stderr)


def note(text: str) -> None:
    """Say something to the person, not to the program that reads standard output."""
    print(text, file=sys.stderr)
