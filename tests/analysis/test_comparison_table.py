"""Tables of a comparison: what they say, that they can be read back, that they fit."""

from __future__ import annotations

import csv
import io
from typing import Any

import pytest

from somatopy.analysis.comparison import MEASURES, compare
from somatopy.analysis.comparison_table import csv_table, latex_table, text_table
from somatopy.analysis.comparison_table import number as number_text

PLASTIC = {0: [0.50, 0.40], 1: [0.54, 0.42], 2: [0.58, 0.44]}
FROZEN = {0: [0.40, 0.20], 1: [0.42, 0.22], 2: [0.47, 0.21]}


@pytest.fixture
def study(make_study: Any) -> Any:
    """Two conditions, the second with a name that every format has trouble with."""
    return make_study({"plastic": PLASTIC, 'fro_zen, "50%" & {x}': FROZEN}, ("none", "offset"))


def test_text_says_what_was_measured(study: Any) -> None:
    """Means with their intervals, efficiency, and differences, by hand: 0.54 ± 4.303 · 0.04 / √3."""
    lines = text_table(compare(study)).splitlines()
    assert lines[1:3] == ["plastic", "  1 intact  3      54.0 [44.1, 63.9]  67.5 %"]
    assert lines[4] == 'fro_zen, "50%" & {x}'
    assert "−11.0 [−13.5, −8.5]" in lines[5] and lines[5].endswith(".005")
    assert lines[-1].endswith("Differences are to: plastic")


@pytest.mark.parametrize("name", ["a", "a condition of a name that is longer than any column of the table could be"])
def test_text_fits_a_terminal(make_study: Any, name: str) -> None:
    """Eighty columns, but for what a name alone takes."""
    text = text_table(compare(make_study({name: PLASTIC, "b": FROZEN}, ("none", "offset"))))
    assert all(len(line) <= 80 for line in text.replace(name, "").splitlines())


def test_text_of_nothing(make_study: Any) -> None:
    """A sentence."""
    assert "No cell has finished" in text_table(compare(make_study({}, order=["a"])))
    assert csv_table(compare(make_study({}, order=["a"]))) == ""


def test_csv_can_be_read_back(study: Any) -> None:
    """A row for each condition, phase, measure and segment, with all digits; what is unknown is empty."""
    comparison = compare(study)
    rows = list(csv.DictReader(io.StringIO(csv_table(comparison))))
    assert len(rows) == len(comparison.rows) == 2 * 2 * len(MEASURES)
    for row, found in zip(rows, comparison.rows, strict=True):
        assert (row["condition"], int(row["phase"]), row["measure"]) == (
            found.condition,
            found.phase,
            found.measure.column,
        )
        assert float(row["mean"]) == found.interval.mean and int(row["n"]) == 3
        difference = found.difference and found.difference.interval.mean
        assert row["difference"] == ("" if difference is None else repr(difference))
    assert rows[0]["against"] == "" and rows[-1]["against"] == "plastic"


def test_latex_has_as_many_cells_in_every_line(study: Any) -> None:
    """As many as the table has columns; names are escaped, and braces are balanced."""
    text = latex_table(compare(study))
    body = [line for line in text.splitlines() if line.endswith(r"\\")]
    columns = text.split(r"\begin{tabular}{")[1].split("}")[0]
    assert len(body) == 1 + 4
    assert {line.replace(r"\&", "").count("&") for line in body} == {len(columns) - 1}
    assert r'fro\_zen, "50\%" \& \{x\}' in text
    bare = text.replace(r"\{", "").replace(r"\}", "")
    assert bare.count("{") == bare.count("}") and bare.count("$") % 2 == 0
    assert "$-$11.0 [$-$13.5, $-$8.5]" in text and "−" not in text and "—" not in text


@pytest.mark.parametrize("name", ["[a]", "a^b~c\\d#$"])
def test_latex_names_are_no_commands(make_study: Any, name: str) -> None:
    """A bracket at a line's start would belong to the line before; every sign stands for itself."""
    text = latex_table(compare(make_study({"first": FROZEN, name: PLASTIC}, ("none", "offset"))))
    assert "\n[" not in text and "a^b" not in text and "#$" not in text.replace(r"\#\$", "")


def test_numbers_that_round_to_nothing_have_no_sign() -> None:
    """Neither −0.0 nor +0.0; others keep theirs."""
    found = [number_text(MEASURES[0], value, sign=True) for value in (-0.0001, 0.0001, 0.002, -0.002)]
    assert found == ["0.0", "0.0", "+0.2", "−0.2"]
