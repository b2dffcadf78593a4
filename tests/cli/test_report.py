"""somatopy report: the page of a run as the recorder wrote it, and of several."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from unittest.mock import Mock

import pytest

from somatopy.analysis.cells import load_study
from somatopy.analysis.claims import CLAIMS
from somatopy.bodies import NoGL
from somatopy.cli import main
from somatopy.cli import report as module
from somatopy.experiment import film

SMALL = ["--eye", "geometric", "--motion", "kinematic", "--minutes", "5", "--damage-minutes", "0"]


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """A short run with maps of one window, and its copy under another seed."""
    folder = tmp_path_factory.mktemp("runs")
    first, second = folder / "first", folder / "second"
    assert main(["run", "paper", *SMALL, "--seed", "1", "--out", str(first)]) == 0
    shutil.copytree(first, second)
    text = (second / "experiment.toml").read_text(encoding="utf-8")
    (second / "experiment.toml").write_text(text.replace("seed = 1", "seed = 2"), encoding="utf-8")
    return [first, second]


def test_a_run_gets_figures_and_a_page(runs: list[Path], capsys: pytest.CaptureFixture[str]) -> None:
    """The page's path on standard output; figures and page in the run folder."""
    assert main(["report", str(runs[0])]) == 0
    page = runs[0] / "report.html"
    assert capsys.readouterr().out == f"{page}\n"
    drawn = {path.name for path in (runs[0] / "figures").iterdir()}
    assert {"figure2.png", "figure3.svg", "figure4.png", "figure5.svg", "efficiency.png", "misses.svg"} <= drawn
    assert 'id="maps-data"' in page.read_text(encoding="utf-8")


def test_quiet_it_leaves_missing_pictures_to_the_page(
    runs: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Here a filmstrip, since there is no OpenGL. Either way the page is told why; the terminal, unless quiet."""
    folder = Path(shutil.copytree(runs[0], tmp_path / "run"))
    text = (folder / "experiment.toml").read_text(encoding="utf-8")
    (folder / "experiment.toml").write_text(text.replace('"geometric"', '"fiducial"'), encoding="utf-8")
    monkeypatch.setattr(module, "save_figures", lambda *_: None)
    written = Mock(return_value=folder / "report.html")
    monkeypatch.setattr(module, "write_report", written)
    monkeypatch.setattr(film, "photographs", Mock(side_effect=NoGL("No OpenGL works here.")))
    why = "No filmstrip: No OpenGL works here."
    for flags, said in (([], f"{why}\n"), (["--quiet"], "")):
        assert main(["report", str(folder), *flags]) == 0
        assert capsys.readouterr() == (f"{folder / 'report.html'}\n", said)
        written.assert_called_with([folder], None, [why])


def test_several_runs_are_compared(runs: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One page, in the first folder or where --out says; --json gives every verdict of every run."""
    folders = [str(folder) for folder in runs]
    assert main(["report", *folders]) == 0
    assert (runs[0] / "comparison.html").is_file() and not (runs[1] / "comparison.html").exists()
    capsys.readouterr()
    page = tmp_path / "both.html"
    assert main(["report", *folders, "--out", str(page), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["report"] == str(page) and told["bytes"] == page.stat().st_size
    assert [run["folder"] for run in told["runs"]] == folders
    assert all(set(run["claims"]) == {claim.key for claim in CLAIMS} for run in told["runs"])


TINY = ["--learners", "random,fixed", "--damages", "none", "--seeds", "2", "--minutes", "1", "--damage-minutes", "0"]


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two learners under two seeds, for a minute."""
    folder = tmp_path_factory.mktemp("studies") / "tiny"
    assert main(["compare", *TINY, "--motion", "kinematic", "--processes", "1", "--out", str(folder)]) == 0
    return folder


def test_a_comparison_ends_with_a_table(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its measures on standard output, whether cells ran or had ended before; the folder on the other."""
    assert main(["compare", *TINY, "--motion", "kinematic", "--processes", "1", "--out", str(study)]) == 0
    out, err = capsys.readouterr()
    learners = [line for line in out.splitlines() if line in ("random", "fixed")]
    assert learners == ["random", "fixed"] and out.count("  intact ") == 2
    level = [float(line.split()[1]) for line in out.splitlines() if line.startswith("  intact ")]
    rows = load_study(study).table.to_pylist()
    for found, kind in zip(level, learners, strict=True):
        plateaus = [row["plateau"] for row in rows if row["learner"] == kind and row["phase"] == 0]
        assert found == pytest.approx(100 * sum(plateaus) / 2, abs=0.05)
    assert str(study) not in out and f"somatopy report {study}" in err
    assert all(len(line) <= 120 for line in out.splitlines())


def test_a_study_gets_a_page_and_tables(study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """In its folder, or where --out says; --json gives the rows of the table."""
    assert main(["report", str(study)]) == 0
    assert capsys.readouterr().out == f"{study / 'report.html'}\n"
    assert (study / "table.csv").is_file() and (study / "table.tex").is_file()
    page = tmp_path / "mine.html"
    assert main(["report", str(study), "--against", "fixed, none", f"--out={page}", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    rates = {row["condition"]: row for row in told["rows"] if row["measure"] == "rate"}
    assert (told["report"], told["bytes"], told["failures"]) == (str(page), page.stat().st_size, [])
    assert rates["random, none"]["against"] == "fixed, none" and rates["random, none"]["pairs"] == 2
    assert rates["fixed, none"]["difference"] is None
    assert "Differences to fixed, none" in page.read_text(encoding="utf-8")


def test_wrong_use_of_a_study_is_told(study: Path, runs: list[Path], capsys: pytest.CaptureFixture[str]) -> None:
    """A condition that is not there, a study among others, --against without a study."""
    for args, part in (
        (["report", str(study), "--against", "x"], "there are: 'random, none', 'fixed, none'."),
        (["report", str(runs[0]), str(study)], "is a study, which has a report of its own"),
        (["report", str(runs[0]), "--against", "x"], "is none: leave it out"),
        (["report", str(study), "--against"], "--against needs NAME behind it: --against NAME"),
    ):
        assert main(args) == 2
        assert part in capsys.readouterr().err


@pytest.mark.parametrize(
    ("args", "parts"),
    [
        ([], ["RUN is missing", "somatopy report runs/first"]),
        (["nowhere"], ["nowhere is not a folder"]),
        (["."], ["is not a run folder", "experiment.toml"]),
        ([".", "--seed", "1"], ["Unknown option --seed", "--against, --out, --json, --quiet, --debug"]),
        ([".", "--out"], ["--out needs FILE behind it: --out FILE"]),
        ([".", "--jso"], ["Unknown option --jso. Did you mean --json?"]),
        ([".", "--out", "nowhere/page.html"], ["there is no folder nowhere"]),
        (["nowhere", "--out", "."], ["--out . is a folder: name a file"]),
    ],
)
def test_wrong_use_is_told(
    args: list[str],
    parts: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Exit code 2 and one paragraph."""
    monkeypatch.chdir(tmp_path)
    assert main(["report", *args]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1
    assert all(part in err for part in parts), err


@pytest.mark.gl
def test_a_run_with_the_rendered_eye_gets_a_filmstrip(tmp_path: Path) -> None:
    """Pictures are drawn again from the recorded postures."""
    folder = tmp_path / "rendered"
    assert (
        main(
            ["run", "paper", "--motion", "kinematic", "--minutes", "0.1", "--damage-minutes", "0", "--out", str(folder)]
        )
        == 0
    )
    assert main(["report", str(folder)]) == 0
    assert (folder / "figures" / "filmstrip.png").is_file()
    assert "What the head camera saw" in (folder / "report.html").read_text(encoding="utf-8")
