"""somatopy resume: continue a run after Ctrl-C or a kill."""

from __future__ import annotations

import json
from collections.abc import Sequence

import tyro

from somatopy.api import resume
from somatopy.cli.options import OnCheckpoint
from somatopy.cli.reproduce import CONTROLS_FOLDER, complete
from somatopy.cli.run import result

__all__ = ["main"]

TEXT = """Continue an interrupted or killed run from its last checkpoint, bit for bit.

What reproduce began is brought to its end: controls, band, figures and report.

example: somatopy resume runs/20141013-120000_paper_seed0
"""


def main(args: Sequence[str]) -> int:
    """Run `somatopy resume RUN [--anyway] [--json]`."""
    options = tyro.cli(OnCheckpoint, args=args, prog="somatopy resume", description=TEXT)
    resume(options.run, anyway=options.anyway)
    if (options.run / CONTROLS_FOLDER).is_dir():
        return complete(options.run, options.json, options.anyway)
    print(json.dumps(result(options.run)) if options.json else options.run)
    return 0
