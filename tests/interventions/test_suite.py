"""The damages of `--damages all` are what their names say, and each kind begins with what docs/damages.md says."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from somatopy.interventions import SUITE
from somatopy.registry import INTERVENTIONS

PAGE = (Path(__file__).parents[2] / "docs" / "damages.md").read_text(encoding="utf-8")
#: The table rows of the page by kind: what it does, with its settings; what it is called in `all`.
ROWS = {
    kind: (does, names)
    for kind, does, names in re.findall(r"^\| `([a-z-]+)` \| ([^|]*) \| ([^|]*) \|", PAGE, re.MULTILINE)
}
#: What the names of those say that are one of several strengths, or no damage that the kind begins with.
STRENGTHS: dict[str, dict[str, Any]] = {
    "offset-0.3": {"norm": 0.3},
    "offset-0.8": {"norm": 0.8},
    "offset-1.7": {"norm": 1.7},
    "dead-joint-1": {"joint": 1},
    "dead-joint-2": {"joint": 2},
    "camera-tilt": {"tilt": 10.0, "roll": 0.0},
    "camera-roll": {"tilt": 0.0, "roll": 10.0},
    "marker-5cm": {"by": 0.05},
    "marker-15cm": {"by": 0.15},
}


@pytest.mark.parametrize("kind", ROWS)
def test_kinds_begin_with_what_the_page_says(kind: str) -> None:
    """Every setting that it gives a value is there, and has that value where none is written."""
    settings = INTERVENTIONS.validated(kind)
    for name, value in re.findall(r"`(\w+) = ([^`]+)`", ROWS[kind][0]):
        said = tomllib.loads(f"value = {value}")["value"]
        assert getattr(settings, name) == (tuple(said) if isinstance(said, list) else said), name


def test_the_page_has_every_kind_and_every_name() -> None:
    """Each damage of `all` in the row of its kind."""
    assert len(ROWS) == 14
    listed = {name: kind for kind, (_, names) in ROWS.items() for name in re.findall(r"`([^`]+)`", names)}
    assert listed == {name: table["kind"] for name, table in SUITE.items()}


@pytest.mark.parametrize("name", SUITE)
def test_names_say_what_is_done(name: str) -> None:
    """How strong it is, or which joint; without any of these it is what the kind begins with."""
    kind = SUITE[name]["kind"]
    expected = INTERVENTIONS.validated({"kind": kind, **STRENGTHS.get(name, {})})
    assert INTERVENTIONS.validated(SUITE[name]) == expected
