"""Speed of every map beside the packages that have it, rules in NumPy and what this core can do at best, in one run.

All learn uniform inputs of four dimensions, one at a time, in one thread; the maps have learned 20,000 of them before,
unless it says otherwise. Contestants take turns, and medians of CPU time count: compare the ratios, not the times.

Example: python benchmarks/maps.py --sides 30 --turns 15
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from entries import CONVERGED, dsoms, gases, growing, links, soms
from rich.console import Console
from rich.table import Table
from turns import Contestant, machine, measure, uniform

DIMS = 4
LINKED = (900, 90_000)  # nodes of a map


def contestants(side: int) -> list[Contestant]:
    """Everything at one size."""
    inputs, shape = uniform(CONVERGED, DIMS), (side, side)
    return [one for enter in (dsoms, soms, gases, growing) for one in enter(shape, DIMS, inputs)]


def shown(title: str, rows: list[dict[str, Any]]) -> Table:
    """A table: the contestants of each group, and how many times the time of its first they take."""
    table = Table(title=title, title_justify="left")
    for name in ("", "us", "a second", "× first"):
        table.add_column(name, justify="right" if name else "left", no_wrap=True)
    group = ""
    for one in rows:
        if one["group"] != group:
            group = one["group"]
            table.add_section()
            table.add_row(f"[bold]{group}")
        cost = one["microseconds"]
        table.add_row(f"  {one['name']}", f"{cost:,.2f}", f"{1e6 / cost:,.0f}", f"{one['times']:,.2f}")
    return table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sides", type=int, nargs="+", default=[30, 100, 300], help="units along both axes")
    parser.add_argument("--turns", type=int, default=9, help="of which the median counts (default 9)")
    parser.add_argument("--json", type=Path, default=Path("runs/bench.json"), help="where the numbers go as well")
    chosen = parser.parse_args()
    console, found = Console(), {"machine": machine(), "dims": DIMS, "inputs before": CONVERGED}
    console.print(", ".join(f"{name} {value}" for name, value in machine().items()), highlight=False)
    for side in chosen.sides:
        title = f"{side}x{side} units, {DIMS} dimensions"
        found[title] = measure(contestants(side), DIMS, chosen.turns)
        console.print(shown(title, found[title]), highlight=False)
    every = [one for nodes in LINKED for one in links(nodes)]
    found["links"] = measure(every, DIMS, chosen.turns)
    console.print(shown("Hebbian links between two maps", found["links"]), highlight=False)
    chosen.json.parent.mkdir(parents=True, exist_ok=True)
    chosen.json.write_text(json.dumps(found, indent=2) + "\n")
    console.print(f"The same numbers: {chosen.json}")


if __name__ == "__main__":
    main()
