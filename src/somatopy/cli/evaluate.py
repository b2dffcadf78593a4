"""somatopy evaluate: what a run has learned, on postures it never met."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from somatopy.cli.mirror import mark
from somatopy.cli.options import OnCheckpoint
from somatopy.cli.run import aside
from somatopy.cli.words import read
from somatopy.experiment.evaluate import evaluate

__all__ = ["main"]

TEXT = """Ask the learner of a run where it would look at random arm postures.

It prints how many of these gazes see the hand. Learning is off, and nothing in the run folder changes.

example: somatopy evaluate runs/20141013-120000_paper_seed0
"""


@dataclass(frozen=True)
class Options(OnCheckpoint):
    """Options of this command."""

    postures: Annotated[int, mark("INT", "How many postures to draw.")] = 2000


def main(args: Sequence[str]) -> int:
    """Run `somatopy evaluate RUN [--postures N] [--json]`."""
    options = read(Options, args, "somatopy evaluate", TEXT)
    with aside():
        result = evaluate(options.run, options.postures, anyway=options.anyway)
    if options.json:
        print(json.dumps(result))
        return 0
    error = result["gaze_error_deg"]
    damage = "no damage" if result["damage"] == "none" else f"damage {result['damage']}"
    print(f"{result['postures']} arm postures, drawn apart, learning off, {damage}, {result['eye']} eye")
    print(
        f"hand seen           {result['rate']:.1%} of them, {_percent(result['efficiency'])} of those that can be seen"
    )
    print(f"can be seen at all  {result['reachable']:.1%}")
    print(f"gaze error          median {error['median']:.1f} degrees, 95th percentile {error['p95']:.1f}")
    return 0


def _percent(share: float | None) -> str:
    return "n/a" if share is None else f"{share:.1%}"
