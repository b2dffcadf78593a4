"""somatopy reproduce: the paper from end to end."""

from __future__ import annotations

import json
from collections.abc import Sequence

from somatopy.analysis import load_run
from somatopy.analysis.figures import figure3, save
from somatopy.analysis.table import comparison, render
from somatopy.cli.options import parse
from somatopy.cli.run import note, result, run_options
from somatopy.experiment import paper

__all__ = ["main"]

TEXT = """Reproduce the paper: run its whole experiment, print its table beside the paper's, draw its Figure 3.

In full it is 304 minutes of robot time. A quick look:
example: somatopy reproduce --minutes 20 --damage-minutes 10
"""


def main(args: Sequence[str]) -> int:
    """Run `somatopy reproduce [OPTIONS]`."""
    options = parse(args, paper(), "somatopy reproduce", TEXT)
    folder = run_options(options)
    run = load_run(folder)
    figures = save(figure3(run), folder / "figures", "figure3")
    table = render(comparison(run.summary or {}))
    if options.json:
        print(json.dumps(result(folder)))
    else:
        print(table)
    note(f"Run folder: {folder}\nFigure 3:   {figures[0]}")
    return 0
