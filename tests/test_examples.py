"""Every example runs to its end, shortened, and says what it promises; what CONTRIBUTING shows is true."""

from __future__ import annotations

import re
import runpy
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import somatopy
from somatopy import cli, paper
from somatopy.analysis.cells import load_study
from somatopy.analysis.runs import Run
from somatopy.cli.options import parse
from somatopy.contract import parts
from somatopy.experiment import PRESETS, Description, DescriptionError, Session, load_description
from somatopy.registry import SORTS
from somatopy.studies.code import modules_of

EXAMPLES = Path(__file__).parents[1] / "examples"
TESTED = {"forked_experiment", "own_learner", "own_map", "paper_in_ten_lines", "read_a_run", "watch_a_session"}

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
    phases = tuple(phase.replaced(frames=60, trend_breaks=()) for phase in description.phases)
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


def test_own_learner_joins_a_comparison(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From any folder that holds the file, in processes of their own; its code is part of its cells' keys."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.path", [*sys.path])
    shutil.copy(EXAMPLES / "own_learner.py", "joining.py")
    flags = ["--motion", "kinematic", "--minutes", "0.1", "--seeds", "1", "--processes", "1", "--damages", "none,gain"]
    assert cli.main(["compare", "--learners", "joining:QuadraticGaze", *flags, "--out", "out"]) == 0
    rows = load_study("out").table.to_pylist()
    assert [row["learner"] for row in rows] == ["joining:QuadraticGaze"] * 4
    assert all(row["learner_bytes"] > 1000 and row["learner_us"] > 0 for row in rows)
    described = paper().replaced(learner={"kind": "joining:QuadraticGaze"})
    assert modules_of(described)["joining"].samefile("joining.py")


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
    for expected in ("120 frames, seed 0", "hit_rate", "damaged", "windows of 5 minutes", "LElbowRoll"):
        assert expected in printed
    with pytest.raises(SystemExit, match=r"usage: python read_a_run\.py RUN"):
        example("read_a_run")


@pytest.mark.parametrize("flags", [(), pytest.param(("--pictures",), marks=pytest.mark.gl)])
def test_watch_a_session(example: Example, tmp_path: Path, flags: tuple[str, ...]) -> None:
    """It says every ten seconds how far the gaze was off and writes nothing, or the one picture that was asked for."""
    printed = example("watch_a_session", "0.4", *flags).splitlines()
    assert [line[:8] for line in printed if "degrees from the hand" in line] == ["  9.9 s:", " 19.9 s:"]
    found = re.search(r"seen in (\d+) of (\d+) frames", "\n".join(printed))
    assert found and (int(found[1]) == 300 or int(found[2]) == 360)
    assert "microseconds a frame" in printed[-1]
    assert [file.name for file in tmp_path.iterdir()] == (["hand.png"] if flags else [])


README = (EXAMPLES.parent / "README.md").read_text()
COMMANDS = (EXAMPLES.parent / "docs" / "commands.md").read_text()


def test_the_description_on_the_page_of_commands_is_valid(tmp_path: Path) -> None:
    """Of all its tables; the short forms that it speaks of lead to the same interventions."""
    text = COMMANDS.split("```toml")[1].split("```")[0]
    (tmp_path / "mine.toml").write_text(text)
    described = load_description(tmp_path / "mine.toml")
    damaged = described.phases[1]
    assert [settings.kind for settings in damaged.interventions] == ["plastic", "offset"]
    short = damaged.replaced(interventions=(), plastic=("links",), damage={"kind": "offset", "offset": (0.2, 0, 0, 0)})
    assert short == damaged


@pytest.mark.parametrize(
    "line", re.findall(r"^somatopy run .*$|(?<=`)somatopy run paper[^`|]*(?=`)", README + COMMANDS, flags=re.MULTILINE)
)
def test_the_runs_in_the_readme_can_be_asked_for(line: str) -> None:
    """Each flag is known and each value valid, but for the places of parts that readers have not written yet."""
    preset, *flags = shlex.split(line, comments=True)[2:]
    described = PRESETS[preset]()
    if "my_package" in line:
        with pytest.raises(DescriptionError, match=r"'my_package\.my_file:MyLearner' cannot be imported"):
            parse(flags, described, "somatopy run", "")
    else:
        assert parse(flags, described, "somatopy run", "").description != described


CONTRIBUTING = (EXAMPLES.parent / "CONTRIBUTING.md").read_text()


def test_contributing_knows_every_check() -> None:
    """Each shipped check stands in the table."""
    assert all(f"`{name}(" in CONTRIBUTING for name in somatopy.__all__ if name.startswith("check_"))


def rows(start: str) -> list[list[str]]:
    """Cells of the lines of CONTRIBUTING's tables that begin so."""
    return [line.strip("| ").split(" | ") for line in CONTRIBUTING.splitlines() if line.startswith(f"| {start}")]


@pytest.mark.parametrize("sort", SORTS)
def test_contributing_says_what_each_part_is_made_from(sort: str) -> None:
    """In the order in which it is given, for every sort of part; and the group of its entry points."""
    name = {"rule": "link rule"}.get(sort, sort)
    made_from = rows(f"**{name}**")[-1][1]
    assert re.findall(r"`(\w+)`", made_from) == list(SORTS[sort].made_from)
    assert ("nothing" in made_from) == (not SORTS[sort].made_from)
    assert re.search(rf"[`.]{'bodies' if sort == 'body' else f'{sort}s'}[`\"]", rows("an installed package")[0][1])


CONTRACTS = {"Body", "Eye", "Babbler", "Learner", "Intervention", "Stage", "Modelled"}


@pytest.mark.parametrize("name", sorted(set(parts.__all__) - CONTRACTS))
def test_contributing_names_all_members_of_a_capability(name: str) -> None:
    """Who has them has the capability; none is forgotten."""
    (row,) = rows(f"`{name}`")
    capability = getattr(parts, name)
    own = {*vars(capability), *capability.__annotations__}
    named = set(re.findall(r"`(\w+)[`(]", row[1]))
    assert named == {name for name in own if not name.startswith("_")}


def test_the_layers_in_contributing_are_those_that_are_held() -> None:
    """In the same order, without those that nobody has built yet."""
    held = runpy.run_path(str(EXAMPLES.parent / "tests" / "test_layers.py"))["LAYERS"]
    package = Path(somatopy.__file__).parent
    there = [[part for part in layer if any(package.glob(f"{part}*"))] for layer in held[1:]]
    drawn = CONTRIBUTING.partition("## Layers")[2].split("```\n")[1]
    assert [line.split(", ") for line in drawn.splitlines()] == [layer for layer in there if layer]


def test_the_parts_in_contributing_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both classes, named by their places in the current folder as the page says, with settings that are checked."""
    blocks = [text.split("```")[0] for text in CONTRIBUTING.split("```python\n")[1:]]
    (tmp_path / "page_of_contributing.py").write_text("".join(text for text in blocks if "class " in text))
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    place = "page_of_contributing:"
    described = shortened(somatopy.paper())
    stare = described.replaced(learner={"kind": f"{place}Stare", "where": 0.25})
    with Session(stare) as session:
        head = session.body.head
        assert next(session).gaze == pytest.approx(head.lower + 0.25 * (head.upper - head.lower))
        somatopy.check_learner(type(session.learner))
    with pytest.raises(DescriptionError, match=r"learner\.where = 1\.5"):
        described.replaced(learner={"kind": f"{place}Stare", "where": 1.5})
    gazes = []
    for learner in ("fixed", {"kind": f"{place}StareNearBest", "beside": 0.1}):
        with Session(described.replaced(learner=learner)) as session:
            gazes.append(next(session).gaze)
    assert gazes[1] == pytest.approx(gazes[0] + 0.1)
