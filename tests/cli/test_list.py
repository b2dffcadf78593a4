"""somatopy list: everything that can be chosen, for eyes and for programs."""

from __future__ import annotations

import json

import pytest

from somatopy.bodies import BODIES
from somatopy.cli import main
from somatopy.experiment import PRESETS

CHOICES = {
    "presets": set(PRESETS),
    "bodies": set(BODIES),
    "babbling ranges": set(BODIES),
    "learners": {"hebbian", "random", "fixed", "nearest"},
    "damages": {"none", "offset"},
}


def test_json_is_one_object_with_every_choice(capsys: pytest.CaptureFixture[str]) -> None:
    """Names as the other commands take them, each with a text."""
    assert main(["list", "--json"]) == 0
    out, err = capsys.readouterr()
    table = json.loads(out)
    for title, names in CHOICES.items():
        assert set(table[title]) == names and all(table[title].values())
    assert table["babbling ranges"]["nao"] == "mechanical, confined"
    assert err == "" and out.count("\n") == 1


def test_text_names_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    """Every title and every name stands at the beginning of a line."""
    assert main(["list"]) == 0
    words = [line.split("  ") for line in capsys.readouterr().out.splitlines()]
    starts = {next(part for part in line if part).strip() for line in words}
    assert set(CHOICES) | set().union(*CHOICES.values()) <= starts
