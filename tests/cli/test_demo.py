"""somatopy demo, shortened: what it tells is what was recorded, and its film shows four scenes set by the clock."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest

from somatopy.analysis import load_run
from somatopy.analysis.runs import Run
from somatopy.bodies import NoGL
from somatopy.cli import demo as module
from somatopy.cli import main
from somatopy.cli.demo import demo, described, scenes, told


@pytest.fixture(autouse=True)
def page(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reports have tests of their own, and take seconds."""
    monkeypatch.setattr(module, "illustrate", lambda folder, quiet: folder / "report.html")


@pytest.mark.gl
def test_it_runs_films_and_tells(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Said before: what and how long. Said after: two sentences of numbers, the paths, what to type next."""
    folder = demo(tmp_path / "demo", seed=3, minutes=0.01, after=0.02)
    out, err = capsys.readouterr()
    assert "with the learner `best`" in err and "takes one to two minutes" in err
    run = load_run(folder)
    assert (run.description["seed"], run.description["eye"]["kind"]) == (3, "fiducial")
    assert run.values("phase").tolist() == [0] * 9 + [1] * 18
    seconds = imageio_ffmpeg.count_frames_and_secs(str(folder / "film.mp4"))
    assert seconds == (54, 3.6) and (folder / "film.gif").stat().st_size < 3_000_000
    assert f"Film:    {folder / 'film.mp4'}\nReport:  {folder / 'report.html'}\n" in out
    assert f"  somatopy film {folder} --from 0.01 --every 4\n" in out and "  somatopy reproduce --minutes 20" in out


def test_its_numbers_are_counted_in_the_record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """First and last minute of both phases, and the ceiling; without OpenGL another eye looks, and there is no film."""

    def none() -> str:
        raise NoGL("Cannot draw the robot's camera.")

    monkeypatch.setattr(module, "gl_backend", none)
    folder = demo(tmp_path / "demo", minutes=1.1, after=1.04)
    run = load_run(folder)
    hits, border = run.values("hit"), round(1.1 * 900)
    minutes = hits[:900], hits[border - 900 : border], hits[border : border + 900], hits[-900:]
    shares = [f"{100 * np.mean(minute):.0f} %" for minute in minutes]
    ceiling = json.loads((folder / "ceiling.json").read_text())["rate"]
    assert told(run) == (
        f"The robot saw its hand in {shares[0]} of the first minute, and in {shares[1]} of the last minute before the "
        f"damage (the best possible gaze: {100 * ceiling:.0f} %).\nIt saw its hand in {shares[2]} of the first minute "
        f"after the damage, and in {shares[3]} of the last minute."
    )
    assert run.description["eye"]["kind"] == "geometric" and not (folder / "film.mp4").exists()


@pytest.mark.parametrize("films", [False, True])
def test_quiet_it_says_only_what_was_seen(
    films: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The numbers, and where film and report are: nothing beside them, with a film and without."""
    asked: list[bool] = []

    def film(run: Run, scenes: object, quiet: bool) -> tuple[Path, Path]:
        asked.append(quiet)
        return run.path / "film.mp4", run.path / "film.gif"

    monkeypatch.setattr(module, "film", film)
    monkeypatch.setattr(module, "_possible", lambda: ("geometric", "" if films else "No OpenGL works here."))
    folder = demo(tmp_path / "demo", minutes=0.01, after=0.02, quiet=True)
    out, err = capsys.readouterr()
    shown = [f"Film:    {folder / 'film.mp4'}"] * films + [f"Report:  {folder / 'report.html'}"]
    assert (out, err) == ("\n".join([told(load_run(folder)), "", *shown, ""]), "") and asked == [True] * films


def test_scenes_are_set_by_the_clock() -> None:
    """The first and the last six seconds of both phases."""
    shown = [(scene.frames[0], scene.frames[-1], len(scene.frames)) for scene in scenes(described(0, 10, 5))]
    assert shown == [(0, 89, 90), (8910, 8999, 90), (9000, 9089, 90), (13410, 13499, 90)]
    assert "After 10 minutes of learning" in [scene.title for scene in scenes(described(0, 10, 5))]
    (harm,) = described(0, 10, 5).phases[1].interventions
    assert harm.kind == "mirrored"


def test_without_the_encoder_there_is_all_but_the_film(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It says so before it starts, with the command that installs it."""
    monkeypatch.setattr(module, "gl_backend", lambda: "egl")
    find = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "imageio_ffmpeg" else find(name))
    assert module._possible() == (
        "fiducial",
        'A film needs the package imageio-ffmpeg, which is not installed: pip install "somatopy[film]".',
    )


def test_wrong_use_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A folder that is not empty; an option that it has not."""
    (tmp_path / "keep.txt").write_text("mine")
    assert main(["demo", "--out", str(tmp_path)]) == 2
    assert "is not empty. Name another with --out" in capsys.readouterr().err
    assert main(["demo", "--minutes", "3"]) == 2
