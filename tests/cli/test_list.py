"""somatopy list: everything that can be chosen, for eyes and for programs."""

from __future__ import annotations

import json

import pytest

from somatopy.bodies import MODELS
from somatopy.cli import main
from somatopy.experiment import PRESETS
from somatopy.interventions import SUITE
from somatopy.registry import LEARNERS

DAMAGES = {"offset", "random-offset", "gain", "swapped", "permuted", "dead-joint", "noise", "drift"}
DAMAGES |= {"head-offset", "mirrored", "camera", "marker", "longer-arm", "arm-speed", "babbling-range"}
CHOICES = {
    "presets": set(PRESETS),
    "bodies": {*MODELS, "mujoco"},
    "babbling ranges": set(MODELS),
    "learners": {"hebbian", "best", "random", "fixed", "nearest"},
    "damages": {"none", *SUITE} | DAMAGES,
    "eyes": {"fiducial", "geometric"},
    "babblers": {"uniform"},
    "maps": {"dsom", "som", "neural-gas", "growing-neural-gas", "evolving-som", "grow-when-required"},
    "rules": {"positive", "normalised", "delta"},
    "interventions": {"plastic", "afresh", "shuffled"} | DAMAGES,
}


def test_json_is_one_object_with_every_choice(capsys: pytest.CaptureFixture[str]) -> None:
    """Names as the other commands take them, each with a text."""
    assert main(["list", "--json"]) == 0
    out, err = capsys.readouterr()
    table = json.loads(out)
    assert set(table) == set(CHOICES)
    for title, names in CHOICES.items():
        assert set(table[title]) == names and all(table[title].values())
    assert table["babbling ranges"]["nao"] == "mechanical, confined, wide"
    assert err == "" and out.count("\n") == 1


def test_text_names_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    """Every title and every name stands at the beginning of a line."""
    assert main(["list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    starts = {next(part for part in line.split("  ") if part).strip() for line in lines if line}
    assert set(CHOICES) | set().union(*CHOICES.values()) <= starts
    assert max(map(len, lines)) <= 100


def test_a_kind_that_cannot_be_imported_hides_no_other(capsys: pytest.CaptureFixture[str]) -> None:
    """Its line says why."""
    LEARNERS.add("broken", "no_such_package:Learner")
    try:
        assert main(["list", "--json"]) == 0
    finally:
        LEARNERS.remove("broken")
    learners = json.loads(capsys.readouterr().out)["learners"]
    assert "no_such_package" in learners["broken"] and learners["random"].startswith("Control")
