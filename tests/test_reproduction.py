"""The pages that say what the experiment shows: made from the committed tables, which today's code still gives."""

from __future__ import annotations

import importlib.util
import platform
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from somatopy.analysis.cells import load_study
from somatopy.studies import load_plan, planned
from somatopy.studies.recheck import recheck

ROOT = Path(__file__).parents[1]
STUDIES = ROOT / "studies"
#: How far a rate may be off on a machine other than the one that the table is from.
ELSEWHERE = 0.001


def script(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, ROOT / "docs" / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_reproduction_page_is_made_from_the_committed_tables() -> None:
    """Every number of docs/reproduction.md follows from studies/."""
    made: Any = script("make_reproduction")
    assert made.page(made.tables()) == made.PAGE.read_text(encoding="utf-8")


def test_the_calibration_page_is_made_from_the_committed_tables() -> None:
    """Every number of docs/calibration.md follows from studies/."""
    made: Any = script("make_calibration")
    assert made.page() == made.PAGE.read_text(encoding="utf-8")


def test_short_cells_give_what_is_committed() -> None:
    """Bit for bit on the machine that wrote the table, within .001 of the rates elsewhere."""
    committed = load_study(STUDIES / "short")
    again = recheck(planned(load_plan(STUDIES / "short.toml")), STUDIES / "short", 1)
    assert {(one.condition, one.cause) for one in again.reruns} == {("kinematic", ""), ("dynamic", "")}
    here = set(committed.table["host"].to_pylist()) == {platform.node()}
    for one in again.reruns:
        assert one.equal or (not here and one.differs.get("rate", 0.0) <= ELSEWHERE), one.text()


@pytest.mark.parametrize("folder", sorted(file.parent for file in STUDIES.glob("*/study.toml")), ids=lambda f: f.name)
def test_no_cell_of_a_committed_study_failed(folder: Path) -> None:
    """What is committed is whole, as far as it goes."""
    result = load_study(folder)
    assert result.failures == [] and len(result.table)


def test_committed_tables_are_small() -> None:
    """Under 5 MB in all, so that a clone stays quick."""
    assert sum(file.stat().st_size for file in STUDIES.rglob("*.parquet")) < 5e6
