"""Write docs/learners.md and its figures: docs/learners.template.md with the numbers of the tables in studies/.

python docs/make_learners.py             from the tables that are there, whole or not
python docs/make_learners.py --run       run what is missing first, study by study; each says before what it costs
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

from learners_cells import NAMES, STUDIES, bounds, tables
from learners_figures import draw
from learners_page import page
from somatopy.analysis.cells import load_study
from somatopy.studies import planned
from somatopy.studies.driver import perform
from somatopy.studies.estimate import estimate
from somatopy.studies.reading import load_plan

DOCS = Path(__file__).parent
PAGE, IMAGES = DOCS / "learners.md", DOCS / "img"


def run() -> None:
    """All studies, each from where it was stopped; each says first what it costs."""
    for name in NAMES:
        study = planned(load_plan(STUDIES / f"{name}.toml"))
        result = load_study(STUDIES / name) if (STUDIES / name / "study.toml").exists() else None
        there = set(result.table["key"].to_pylist()) if result else set()
        missing = sum(cell.key not in there for cell in study.cells())
        if missing:
            print(f"{name}: {missing:,} cells are missing. The whole study:\n{estimate(study).text()}", file=sys.stderr)
            perform(study, STUDIES / name)
    print("Bounds and misses: up to ten minutes of one core.", file=sys.stderr)
    subprocess.run([sys.executable, str(DOCS / "measure_learners.py")], check=True)


def main() -> None:
    """Run what is not finished if asked for, then write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", action="store_true", help="run what is missing first")
    if parser.parse_args().run:
        run()
    found = tables()
    draw(found, IMAGES)
    PAGE.write_text(page(found, bounds()), encoding="utf-8")
    print(PAGE, file=sys.stderr)


if __name__ == "__main__":
    main()
