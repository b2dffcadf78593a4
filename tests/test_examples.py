"""Every example runs to its end, shortened, and says what it promises; what CONTRIBUTING shows is true."""

from __future__ import annotations

import re
import runpy
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import somatopy
from somatopy.analysis.runs import Run
from somatopy.bodies import Anatomy
from somatopy.experiment import Description

EXAMPLES = Path(__file__).parents[1] / "examples"
TESTED = {"forked_experiment", "own_learner", "own_map", "paper_in_ten_lines", "read_a_run"}

Example = Callable[..., str]


@pytest.fixture
def example(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Example:
    """Runs an example with arguments, in a folder of its own, and gives what it printed."""

    def run(name: str, *args: str) -> str:
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr("sys.argv", [name, *args])
        runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")
        return capsys.readouterr().out

    return run


def shortened(description: Description) -> Description:
    """A few seconds of each phase, without pictures or physics."""
    phases = tuple(phase.model_copy(update={"frames": 60, "trend_breaks": ()}) for phase in description.phases)
    return description.replaced(phases=phases, eye={"kind": "geometric"}, body={"motion": "kinematic"})


def test_each_example_is_tested_and_fits_a_screen_or_two() -> None:
    """None is forgotten; none is longer than 100 lines."""
    files = list(EXAMPLES.glob("*.py"))
    assert {file.stem for file in files} == TESTED
    assert all(len(file.read_text().splitlines()) <= 100 for file in files)


def test_paper_in_ten_lines(example: Example, monkeypatch: pytest.MonkeyPatch) -> None:
    """The hit rate of both phases, and the run folder."""
    real = somatopy.run
    monkeypatch.setattr(somatopy, "run", lambda description: real(shortened(description)))
    printed = example("paper_in_ten_lines").splitlines()
    assert len(printed) == 3 and all(re.search(r"hand seen in [\d.]+% of 60 frames", line) for line in printed[:2])
    assert (Path(printed[2]) / "summary.json").is_file()


def test_own_learner(example: Example) -> None:
    """It keeps the contract; both learners are scored."""
    printed = example("own_learner", "0.1")
    assert printed.startswith("QuadraticGaze keeps the contract")
    assert len(re.findall(r"(HebbianLearner|QuadraticGaze) saw the hand in [\d.]+% of 0.1 minutes", printed)) == 2


def test_own_map() -> None:
    """It keeps the contract; both maps are scored. It runs by itself, since pickle looks its class up by its module."""
    command = [sys.executable, EXAMPLES / "own_map.py"]
    printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    assert printed.startswith("RecentMeans keeps the laws of maps")
    assert len(re.findall(r"(RecentMeans|NeuralGas): error 0\.\d+, and 0\.\d+ where the inputs", printed)) == 2


def test_the_page_on_own_maps_shows_the_example() -> None:
    """Its class is that of the program, to the letter."""
    shown = (EXAMPLES.parent / "docs" / "maps" / "own_map.md").read_text().split("```python\n")[1].split("```")[0]
    assert shown in (EXAMPLES / "own_map.py").read_text()


def test_forked_experiment(example: Example, tmp_path: Path) -> None:
    """One line before damage and one for each continuation; all continue the same training."""
    lines = example("forked_experiment", "0.2").splitlines()
    assert [line.split("  ")[0] for line in lines[1:]] == [
        f"{name} learn" for name in ("both", "links", "maps", "nothing")
    ]
    runs = [somatopy.load_run(path) for path in (tmp_path / "runs").glob("*_*_*_*")]
    hits = {tuple(run.frames(["hit"], stop=180)["hit"].to_pylist()) for run in runs}
    assert len(runs) == 4 and len(hits) == 1
    assert all(run.frames(["hit"]).num_rows == 360 for run in runs)


def test_read_a_run(example: Example, tmp_path: Path) -> None:
    """Phases, windows and joints of a run; without a run it says how to be used."""
    run: Run = somatopy.run(shortened(somatopy.paper()), tmp_path / "run")
    printed = example("read_a_run", str(run.path))
    for expected in ("120 frames, seed 0", "hit_rate", "damaged", "windows of 5 minutes", "arm_LElbowRoll_rad"):
        assert expected in printed
    with pytest.raises(SystemExit, match=r"usage: python read_a_run\.py RUN"):
        example("read_a_run")


def test_contributing_knows_every_check() -> None:
    """Each shipped check stands in the table."""
    text = (EXAMPLES.parent / "CONTRIBUTING.md").read_text()
    assert all(f"`{name}(" in text for name in somatopy.__all__ if name.startswith("check_"))


def test_the_anatomy_in_contributing_is_valid(tmp_path: Path) -> None:
    """All its keys are known, and none that is needed is missing."""
    text = (EXAMPLES.parent / "CONTRIBUTING.md").read_text()
    (tmp_path / "my_robot.toml").write_text(text.split("```toml")[1].split("```")[0])
    assert Anatomy.load(tmp_path / "my_robot.toml").arm.joints == ("shoulder", "elbow")
