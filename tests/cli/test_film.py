"""somatopy film: as many frames as asked for, each what was recorded; what cannot be filmed is told in a sentence."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from somatopy.analysis import load_run
from somatopy.analysis.film import OUTSIDE, SHEET, Narrator, Sheet
from somatopy.bodies import NoGL, rendering
from somatopy.cli import main
from somatopy.experiment.film import Replay

SHORT = ["--motion", "kinematic", "--minutes", "0.05", "--damage-minutes", "0.05", "--damage", "marker-15cm"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of 45 frames, and 45 more with a longer hand, by the geometric eye."""
    made = tmp_path_factory.mktemp("runs") / "run"
    assert main(["run", "paper", "--eye", "geometric", *SHORT, "--out", str(made)]) == 0
    return made


@pytest.fixture
def copy(folder: Path, tmp_path: Path) -> Path:
    """The same, to be spoilt."""
    return Path(shutil.copytree(folder, tmp_path / "copy"))


@pytest.mark.gl
def test_each_frame_is_what_was_recorded(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """From, to and every choose frames of both phases; decoded they are the robot and its view in these postures."""
    assert main(["film", str(folder), "--from", "0.04", "--to", "0.06", "--every", "4", "--json"]) == 0
    out, err = capsys.readouterr()
    told = json.loads(out)
    chosen = [36, 40, 44, 48, 52]
    assert (told["frames"], told["seconds"], told["size"]) == (5, 5 / 15, list(SHEET))
    assert Path(told["gif"]).stat().st_size == told["bytes"]["film.gif"] < 3_000_000
    assert "unfinished" not in err
    decoding = imageio_ffmpeg.read_frames(told["film"])
    assert next(decoding)["size"] == SHEET
    films = [np.frombuffer(raw, np.uint8).reshape(SHEET[1], SHEET[0], 3).astype(int) for raw in decoding]
    assert len(films) == len(chosen)
    run = load_run(folder)
    sheet = Sheet(Narrator(run), Narrator(run).source + ", 4 times as fast")
    with Replay(run.description, OUTSIDE) as replay:
        drawn = [
            sheet.frame(k, replay.still(int(k >= 45), run.postures("arm")[k], run.postures("head")[k])) for k in chosen
        ]
    apart = np.array([[np.abs(film - one).mean() for one in drawn] for film in films])
    assert apart.diagonal().max() < 3 and (apart.argmin(axis=1) == np.arange(5)).all()


@pytest.mark.gl
def test_unfinished_runs_are_filmed_as_far_as_they_go(copy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One sentence says how far that is, above the progress; with --quiet there is neither."""
    part = copy / "frames" / "part-00000.parquet"
    pq.write_table(pq.read_table(part).slice(0, 50), part)
    assert main(["film", str(copy), "--every", "25"]) == 0
    out, err = capsys.readouterr()
    assert out.splitlines() == [str(copy / "film.mp4"), str(copy / "film.gif")]
    assert "is unfinished: 50 of its 90 frames are recorded, and can be filmed." in err and "film" in err
    assert main(["film", str(copy), "--every", "25", "--quiet"]) == 0
    assert capsys.readouterr() == (out, "")


def refused(args: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """What the command says when it refuses, in one paragraph and without a film."""
    assert main(["film", *args]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and not (Path(args[0]) / "film.mp4").exists()
    return err


@pytest.mark.parametrize(
    ("args", "said"),
    [
        (["--from", "0.2"], "--from 0.2 --to 0.1 is no stretch of"),
        (["--to", "7"], "of which 0.1 minutes are recorded: name two times in order, such as --from 0 --to 0.1."),
        (["--from", "-1"], "--from -1 --to 0.1 is no stretch"),
        (["--from", "nan"], "--from nan --to 0.1 is no stretch"),
        (["--every", "0"], "--every 0 must be at least 1"),
    ],
)
def test_stretches_that_are_none_are_refused(
    folder: Path, args: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Times are named with those that there are."""
    copied = Path(shutil.copytree(folder, tmp_path / "run", ignore=shutil.ignore_patterns("film.*")))
    assert said in refused([str(copied), *args], capsys)


def test_broken_folders_are_refused(copy: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """No folder, no frames, a damaged part, a robot that is gone, has other joints, or cannot be drawn."""
    (copy / "film.mp4").unlink(missing_ok=True)
    told = copy / "experiment.toml"
    text = told.read_text(encoding="utf-8")
    assert "is not a folder" in refused([str(tmp_path / "none")], capsys)
    assert "is not a run folder" in refused([str(tmp_path)], capsys)
    for change, said in (
        (('model = "nao"', 'model = "robby"'), "'robby'"),
        (('kind = "mujoco"', 'kind = "my_lab.arms:Arm"'), "my_lab"),
        (('kind = "mujoco"', 'kind = "handed over:__main__.Arm"'), "handed over"),
    ):
        assert change[0] in text
        told.write_text(text.replace(*change), encoding="utf-8")
        assert said in refused([str(copy)], capsys)
    told.write_text(text, encoding="utf-8")
    part = copy / "frames" / "part-00000.parquet"
    table = pq.read_table(part)
    labels = [
        {**field.metadata, b"label": field.metadata.get(b"label", b"").replace(b"Yaw", b"Jaw")}
        for field in table.schema
    ]
    renamed = pa.schema([field.with_metadata(label) for field, label in zip(table.schema, labels, strict=True)])
    pq.write_table(table.cast(renamed), part)
    assert "have the arm joints LShoulderPitch, LShoulderRoll, LElbowJaw" in refused([str(copy)], capsys)
    part.write_bytes(b"nonsense")
    assert "is damaged" in refused([str(copy)], capsys)
    part.unlink()
    assert "has no recorded frame yet" in refused([str(copy)], capsys)


def test_without_opengl_nothing_is_filmed(
    copy: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The sentence says what to install."""
    (copy / "film.mp4").unlink(missing_ok=True)

    def none() -> None:
        raise NoGL("Cannot draw the robot's camera: apt-get install libegl1")

    monkeypatch.setattr(rendering, "_context_class", none)
    assert "apt-get install libegl1" in refused([str(copy)], capsys)
