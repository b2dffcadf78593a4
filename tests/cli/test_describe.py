"""somatopy describe: a commented file of the same experiment."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from somatopy.cli import main
from somatopy.experiment import PRESETS, Description, load_description

CHANGED = ["--learner.arm-map.kind", "som", "--body.camera.fovy", "50", "--phases.0.plastic"]
RANGE = ["--babbling.range", "-1", "1", "0", "0.5", "-1", "1", "-1", "-0.5"]


@pytest.mark.parametrize(
    "args", [*([name] for name in PRESETS), ["best", "--damage", "drift"], ["paper", *CHANGED, *RANGE]]
)
def test_the_file_describes_the_same_experiment(
    args: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Read back it is what JSON says without comments; each key that is set stands below a comment."""
    assert main(["describe", *args]) == 0
    text, err = capsys.readouterr()
    (tmp_path / "my.toml").write_text(text, encoding="utf-8")
    assert main(["describe", *args, "--json"]) == 0
    described = load_description(tmp_path / "my.toml")
    assert described == Description.model_validate(json.loads(capsys.readouterr().out)) and err == ""
    lines = text.splitlines()
    keys = [number for number, line in enumerate(lines) if " = " in line and not line.startswith("#")]
    assert keys and all(lines[number - 1].startswith("#") for number in keys)
    assert max(map(len, (line for line in lines if line.startswith("#")))) <= 100
    if len(args) == 1:
        assert described == PRESETS[args[0]]()
