"""Play a new user's first hour in a fresh clone and a fresh environment, and write its transcript, docs/first_hour.md.

    python scripts/first_hour.py [FOLDER to work in; a temporary one by default]

Every command is one that README or a page of docs tells the reader to type. The script stops at the first that fails.
"""

from __future__ import annotations

import os
import platform
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "first_hour.md"
MOST_LINES = 16  # of what a command prints
IRIS = (
    "from sklearn.datasets import load_iris; from somatopy import SOM; X = load_iris().data; "
    "som = SOM(shape=(10, 10), random_state=0).fit(X); "
    "print(f'mean distance to the nearest unit: {-som.score(X):.2f} cm')"
)
IN = ". .venv/bin/activate && "
TUTORIAL = f"{IN}mkdir -p tutorials && cd tutorials && python ../examples/tutorials/"
#: What is typed, and what a reader would want to know of it.
STEPS = (
    ("python3 -m venv .venv", "A virtual environment of its own."),
    ('.venv/bin/pip install ".[all]"', "somatopy with all that a reader needs."),
    (f"{IN}somatopy list", "Which experiments and which parts there are."),
    (f"{IN}somatopy demo --out runs/demo", "The student: see a robot learn."),
    (
        f"{IN}somatopy run best --minutes 20 --damage-minutes 10 --eye geometric --out runs/first",
        "The same learner for twenty minutes, and for ten more after the paper's damage, without pictures.",
    ),
    (f"{IN}somatopy report runs/first", "The page of this run."),
    (f"{IN}somatopy film runs/first --from 19 --to 20", "A film of its last minute before the damage."),
    (
        f"{IN}somatopy compare --learners best,hebbian,fixed --damages none,paper --seeds 2 "
        "--minutes 10 --out runs/compare",
        "The researcher: three learners under two seeds, with and without the damage.",
    ),
    (f"{TUTORIAL}study.py", "The researcher's tutorial: a study."),
    (f"{IN}somatopy check-body nao", "The engineer: what a robot's model has, here the one that comes with somatopy."),
    (f"{TUTORIAL}own_robot.py", "The engineer's tutorial: a robot of one's own, from its model to what it learns."),
    (f'{IN}python -c "{IRIS}"', "The data person: a map of a table."),
    (f"{TUTORIAL}first_map.py", "The data person's tutorial."),
    (f"{IN}python examples/own_learner.py 5", "A learner of one's own in 40 lines."),
)


def main(folder: Path) -> None:
    clone = folder / "somatopy"
    blocks = [_step(f"git clone {ROOT} {clone}", "The code.", folder, "git clone <this repository> && cd somatopy")]
    blocks += [_step(command, text, clone) for command, text in STEPS]
    PAGE.write_text(_page(blocks), encoding="utf-8")
    print(PAGE)


def _step(command: str, text: str, folder: Path, shown: str | None = None) -> str:
    print(f"$ {command}", flush=True)
    began = time.monotonic()
    clean = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "VIRTUAL_ENV")}
    clean["PIP_QUIET"] = "3"  # what pip says depends on the machine
    done = subprocess.run(
        command,
        shell=True,
        cwd=folder,
        env=clean,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    seconds = time.monotonic() - began
    if done.returncode:
        raise SystemExit(f"{command} ended with {done.returncode}:\n{done.stdout}")
    typed = (shown or command).replace(IN, "")
    return f"{text} {_took(seconds)}\n\n```\n$ {typed}\n{_printed(done.stdout, folder)}```\n"


def _took(seconds: float) -> str:
    return f"*{seconds:.0f} s.*" if seconds < 100 else f"*{seconds / 60:.1f} minutes.*"


def _printed(text: str, folder: Path) -> str:
    """The last lines as they stand on a screen in the end, without colours; paths begin in the clone."""
    lines = [re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", line.rsplit("\r", 1)[-1]).rstrip() for line in text.splitlines()]
    lines = [line.replace(f"{folder}/", "").replace(str(folder), ".") for line in lines if line]
    left_out = len(lines) - MOST_LINES
    kept = lines if left_out <= 1 else [f"... ({left_out} lines)", *lines[-MOST_LINES:]]
    return "".join(f"{line}\n" for line in kept)


def _page(blocks: list[str]) -> str:
    version = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    head = f"""# The first hour, as it was typed

This page is the transcript of a new user's first hour with somatopy: a fresh clone, a fresh environment, and the
commands of the README, one after the other, each with the time that it took. `python scripts/first_hour.py` plays it
again and writes this page. Of long answers only the end is shown.

Commit {version.stdout.strip()}, Python {platform.python_version()}, {platform.system()}, {os.cpu_count()} cores.

"""
    return head + "\n".join(blocks)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(Path(sys.argv[1]).resolve())
    else:
        with tempfile.TemporaryDirectory() as temporary:
            main(Path(temporary))
