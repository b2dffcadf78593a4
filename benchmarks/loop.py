"""What a frame costs, whole and by part, in each combination of body and eye; the budgets are in the last column.

The time is that of the processor, so that neighbours on the machine count less; all combinations take turns, and the
median of the turns is shown. Microseconds differ between machines: compare the rows of one run.

Example: python benchmarks/loop.py --frames 3000 --turns 5
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack
from statistics import median
from time import process_time

from somatopy import paper
from somatopy.bodies import NoGL
from somatopy.experiment import Description, RunFolder, Session

#: Name, motion, eye, whether the arm's movement is stored beforehand, budget (us a frame on one core, ceiling aside).
CASES = (
    ("kinematic, geometric", "kinematic", "geometric", False, 40),
    ("dynamic, geometric", "dynamic", "geometric", False, 150),
    ("dynamic with a stored arm movement, geometric", "dynamic", "geometric", True, 100),
    ("dynamic, rendered", "dynamic", "fiducial", False, 1200),
)
PARTS = ("physics", "render", "detect", "babble", "damage", "learn", "record")
WARM = 1000


def described(motion: str, eye: str, frames: int) -> Description:
    """The paper's experiment, as long as it is measured."""
    phases = [{"name": "measured", "frames": frames}]
    return paper().replaced(name="loop", body={"motion": motion}, eye={"kind": eye}, phases=phases)


def costs(description: Description, stored: bool, turn: int, turns: int) -> Iterator[dict[str, float]]:
    """The cost of a frame in each turn, us: of all of it, and of its parts."""
    with ExitStack() as stack:
        session = stack.enter_context(Session(description))
        if stored:
            session.share_arm(compute=True)
        out = stack.enter_context(tempfile.TemporaryDirectory())
        folder = RunFolder.new(f"{out}/run", session.description)
        stack.enter_context(folder.recording(session))
        for _ in range(WARM):
            next(session)
        for _ in range(turns):
            before, start = dict(session.seconds), process_time()
            for _ in range(turn):
                next(session)
            spent = process_time() - start
            parts = {part: session.seconds[part] - before[part] for part in session.seconds}
            yield {name: 1e6 * took / turn for name, took in (("all", spent), *parts.items())}


def main() -> None:
    """Measure, in turns, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=3000, help="frames in a turn")
    parser.add_argument("--turns", type=int, default=5)
    args = parser.parse_args()
    running = {}
    for name, motion, eye, stored, _ in CASES:
        try:
            description = described(motion, eye, WARM + args.turns * args.frames)
            running[name] = costs(description, stored, args.frames, args.turns)
        except NoGL as error:
            print(f"{name}: left out. {error}")
    found: dict[str, list[dict[str, float]]] = {name: [] for name in running}
    for _ in range(args.turns):
        for name, turns in running.items():
            found[name].append(next(turns))
    print("| | " + " | ".join(("all", *PARTS[:-1], "budget")) + " |")
    for name, _, _, _, budget in CASES:
        row = [median(turn[part] for turn in found[name]) for part in ("all", *PARTS[:-1])] if name in found else []
        print(f"| {name} | " + " | ".join([*(f"{value:,.1f}" for value in row), str(budget)]) + " |")


if __name__ == "__main__":
    main()
