"""somatopy resume: continue a run after Ctrl-C or a kill."""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from somatopy.analysis import load_run
from somatopy.analysis.runs import RunFolderError
from somatopy.api import resume
from somatopy.cli.mirror import mark
from somatopy.cli.options import SWITCH, OnCheckpoint
from somatopy.cli.reproduce import CONTROLS_FOLDER, complete
from somatopy.cli.run import note, result
from somatopy.cli.words import read
from somatopy.experiment import RunFolder

__all__ = ["main"]

TEXT = """Continue an interrupted or killed run from its last checkpoint, bit for bit.

What reproduce began is brought to its end: controls, band, figures and report.

example: somatopy resume runs/20141013-120000_paper_seed0
"""


@dataclass(frozen=True)
class Options(OnCheckpoint):
    """Options of this command."""

    quiet: Annotated[SWITCH, mark(None, "Say nothing but results and errors.", None)] = False


def main(args: Sequence[str]) -> int:
    """Run `somatopy resume RUN [--anyway] [--json]`."""
    options = read(Options, args, "somatopy resume", TEXT)
    frames = RunFolder(options.run).description().frames
    if _recorded(options.run) == frames and not options.quiet:
        note(f"{options.run} is finished: all its {frames:,} frames are recorded. No frame runs again.")
    resume(options.run, anyway=options.anyway, progress=not options.quiet)
    if (options.run / CONTROLS_FOLDER).is_dir():
        return complete(options.run, options.json, options.anyway, quiet=options.quiet)
    print(json.dumps(result(options.run)) if options.json else options.run)
    return 0


def _recorded(folder: Path) -> int | None:
    """Frames in a run folder, as far as it can be read."""
    with suppress(RunFolderError):
        return len(load_run(folder).values("hit"))
    return None
