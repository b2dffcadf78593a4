"""somatopy resume: continue a run after Ctrl-C or a kill."""

from __future__ import annotations

import json
from collections.abc import Sequence

from somatopy.api import resume
from somatopy.cli.options import OnCheckpoint
from somatopy.cli.reproduce import CONTROLS_FOLDER, complete
from somatopy.cli.run import aside, note, result
from somatopy.cli.words import read
from somatopy.experiment import RunFolder

__all__ = ["main"]

TEXT = """Continue an interrupted or killed run from its last checkpoint, bit for bit.

What reproduce began is brought to its end: controls, band, figures and report.

example: somatopy resume runs/20141013-120000_paper_seed0
"""


def main(args: Sequence[str]) -> int:
    """Run `somatopy resume RUN [--anyway] [--json]`."""
    options = read(OnCheckpoint, args, "somatopy resume", TEXT)
    opened = RunFolder(options.run)
    frames = opened.description().frames
    finished = opened.checkpoint()["session"]["done"] == frames
    with aside():
        resume(options.run, anyway=options.anyway, progress=not (finished or options.quiet))
    if finished and not options.quiet:
        note(f"{options.run} is finished: all its {frames:,} frames had been recorded before.")
    if (options.run / CONTROLS_FOLDER).is_dir():
        return complete(options.run, options.json, options.anyway, quiet=options.quiet)
    print(json.dumps(result(options.run)) if options.json else options.run)
    return 0
