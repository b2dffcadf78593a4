"""How long each command takes with its usual arguments: time on the clock, and time of the processor.

Time of the processor is user and system time of the command and of all processes that it starts. Neighbours on the
machine change it less than the time on the clock. The kernels are compiled before anything is measured. Commands on a
run folder get the run of the row before them.

Example: python benchmarks/commands.py list evaluate
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from time import perf_counter

STUDY = """
name = "speeds"
preset = "paper"
seeds = 2

[every]
motion = "kinematic"
minutes = 10

[grid]
babbling.speed = [0.25, 0.8]
"""
#: Commands in the order in which they run. The short ones come first, so that a table grows soon.
COMMANDS = (
    "--help",
    "list",
    "describe paper",
    "check-body nao",
    "run paper --minutes 10 --eye geometric --motion kinematic --out quick",
    "resume quick",
    "evaluate quick",
    "report quick",
    "film quick",
    "run paper --minutes 10 --eye geometric --out physics",
    "run best --minutes 10 --eye geometric --out best",
    "run paper --minutes 10 --out rendered",
    "report rendered",
    "compare --learners hebbian,random --damages none,paper --seeds 2 --minutes 10 --out comparison",
    "report comparison",
    "study plan.toml --out study",
    "demo --out demo",
    "reproduce --minutes 20 --damage-minutes 10 --out reproduced",
)
WARM = ("run paper --minutes 0.1 --eye geometric --out warm", "run best --minutes 0.1 --eye geometric --out warmer")


def spent() -> float:
    """Time of the processor that ended child processes have taken so far, s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def took(command: str, folder: str) -> tuple[float, float]:
    """Run a command; its time on the clock and that of the processor, s."""
    before, start = spent(), perf_counter()
    words = [sys.executable, "-m", "somatopy", *command.split()]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"somatopy {command}: exit code {done.returncode}\n{done.stderr}")
    return perf_counter() - start, spent() - before


def needed(words: list[str]) -> list[str]:
    """The commands that have one of the words in them, and the runs that these need."""
    chosen = [command for command in COMMANDS if not words or any(word in command.split() for word in words)]
    folders = {command.split()[1] for command in chosen if len(command.split()) > 1}
    return [command for command in COMMANDS if command in chosen or command.rpartition("--out ")[2] in folders]


def main() -> None:
    """Run the commands, and print a row of the table for each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("words", nargs="*", help="measure only commands that have one of these words, such as report")
    commands = needed(parser.parse_args().words)
    with tempfile.TemporaryDirectory() as folder:
        with open(f"{folder}/plan.toml", "w", encoding="utf-8") as plan:
            plan.write(STUDY)
        for command in WARM:
            took(command, folder)
        print(f"{os.cpu_count()} processors\n\n| command | s | s of the processor |\n|---|---|---|", flush=True)
        for command in commands:
            clock, processor = took(command, folder)
            print(f"| `somatopy {command}` | {clock:.1f} | {processor:.1f} |", flush=True)


if __name__ == "__main__":
    main()
