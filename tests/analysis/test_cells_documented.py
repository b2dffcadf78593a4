"""docs/studies.md says what the tables of a study hold: the same columns, types and words as the code."""

from __future__ import annotations

from pathlib import Path

from somatopy.analysis.cells import COLUMNS, COSTS
from somatopy.analysis.comparison import Comparison, compare
from somatopy.analysis.comparison_table import csv_rows

PAGE = Path(__file__).parents[2] / "docs" / "studies.md"


def rows_of(heading: str) -> list[list[str]]:
    """Cells of all table rows under a heading, heads and rules left out."""
    section = PAGE.read_text(encoding="utf-8").split(f"## {heading}\n")[1].split("\n## ")[0]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in section.splitlines() if line[:1] == "|"]
    return [row for row in rows if row[0].startswith("`")]


def test_the_schema_of_the_table_of_cells_is_documented() -> None:
    """Every column, in order, with its type and meaning."""
    expected = [[f"`{column.name}`", column.type, column.text] for column in (*COLUMNS, *COSTS)]
    assert rows_of("The table of cells") == expected


def test_the_columns_of_the_table_to_copy_are_documented(make_study: object) -> None:
    """All of them, in order."""
    assert callable(make_study)
    comparison: Comparison = compare(make_study({"a": {0: [0.5]}}))
    named = [name.strip("` ") for row in rows_of("Reports of studies") for name in row[0].split(",")]
    assert named == [*csv_rows(comparison)[0]]
