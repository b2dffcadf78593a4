"""somatopy list: what there is to choose from."""

from __future__ import annotations

import json
from collections.abc import Sequence

from somatopy.bodies import BODIES, Anatomy
from somatopy.cli.options import LEARNERS
from somatopy.experiment import DescriptionError, paper
from somatopy.experiment.description import NoDamage, OffsetDamage
from somatopy.experiment.presets import CONTROLS

__all__ = ["main"]

TEXT = """usage: somatopy list [--json]

List presets, bodies with their babbling ranges, learners and damages.

example: somatopy list --json
"""


def main(args: Sequence[str]) -> int:
    """Run `somatopy list [--json]`."""
    if any(a in ("-h", "--help") for a in args):
        print(TEXT, end="")
        return 0
    if unknown := [a for a in args if a not in ("--json", "--debug")]:
        raise DescriptionError(f"Unknown option {unknown[0]}. Valid ones: --json, --debug.")
    table = {
        "presets": {"paper": _line(paper.__doc__)}
        | {f"paper-{name}": _line(control.__doc__) for name, control in CONTROLS.items()},
        "bodies": {name: Anatomy.load(path).name for name, path in BODIES.items()},
        "babbling ranges": {
            name: ", ".join(["mechanical", *Anatomy.load(path).ranges]) for name, path in BODIES.items()
        },
        "learners": {name: _line(choice.__doc__) for name, choice in LEARNERS.items()},
        "damages": {m.model_fields["kind"].default: _line(m.__doc__) for m in (NoDamage, OffsetDamage)},
    }
    if "--json" in args:
        print(json.dumps(table))
        return 0
    for title, entries in table.items():
        print(title)
        for name, text in entries.items():
            print(f"  {name:<18}{text}")
    return 0


def _line(text: str | None) -> str:
    return (text or "").strip().partition("\n")[0]
