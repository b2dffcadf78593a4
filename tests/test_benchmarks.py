"""The rules in NumPy that the maps are timed against compute what the maps compute; every command is timed."""

from __future__ import annotations

import importlib.util
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from somatopy.cli import VERBS
from somatopy.maps import DSOM, NeuralGas
from somatopy.studies.reading import planned

FOLDER = Path(__file__).parents[1] / "benchmarks"
INPUTS = np.random.default_rng(1).random((60, 4))


def benchmark(name: str) -> Any:
    spec = importlib.util.spec_from_file_location(name, FOLDER / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def rule(name: str) -> Callable[..., Any]:
    found: Callable[..., Any] = getattr(benchmark("peers"), name)
    return found


@pytest.mark.parametrize("name", ["plain_dsom", "tuned_dsom"])
def test_dsom_rules_are_those_of_the_map(name: str) -> None:
    """Same start codes and running maximum, same inputs: the same codes to rounding."""
    dsom = DSOM(shape=(5, 7), learning_rate=0.1, elasticity=0.5, random_state=0).partial_fit(INPUTS[:20])
    farthest = float(np.sqrt(dsom.state()["running_max_squared"]))
    codes = rule(name)(dsom.codebook_, (5, 7), 0.1, 0.5, farthest)(INPUTS[20:])
    np.testing.assert_allclose(codes, dsom.partial_fit(INPUTS[20:]).codebook_, rtol=0, atol=1e-12)


def test_the_neural_gas_rule_is_that_of_the_map() -> None:
    """Same start codes, same inputs: the same codes to rounding."""
    gas = NeuralGas(units=35, learning_rate=0.2, width=3.0, random_state=0).initialise(4)
    codes = rule("plain_gas")(gas.codebook_, 0.2, 3.0)(INPUTS)
    np.testing.assert_allclose(codes, gas.partial_fit(INPUTS).codebook_, rtol=0, atol=1e-12)


def test_every_command_is_timed() -> None:
    """Each verb is in the table. A command that needs a run is chosen together with that run, which comes first."""
    commands = benchmark("commands")
    assert {command.split()[0] for command in commands.COMMANDS} == {"--help", *VERBS}
    assert commands.needed([]) == list(commands.COMMANDS)
    run, asked = commands.needed(["evaluate"])
    assert asked == "evaluate quick" and run.startswith("run ") and run.endswith("--out quick")


def test_every_command_has_a_row_on_its_page() -> None:
    """In the table of times, whether it was measured or not."""
    page = (FOLDER.parent / "docs" / "commands.md").read_text(encoding="utf-8")
    table = page.partition("## How long a command takes")[2].partition("\n## ")[0]
    assert {*re.findall(r"^\| `somatopy ([a-z-]+)", table, re.MULTILINE)} == {"--help", *VERBS}


def test_the_timed_study_can_be_planned() -> None:
    """Two conditions under two seeds."""
    assert len(planned(tomllib.loads(benchmark("commands").STUDY)).cells()) == 4
