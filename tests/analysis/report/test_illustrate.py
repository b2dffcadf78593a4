"""A folder's figures and page as the command line makes them: nothing of what the run was made of is imported."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import PIL.Image
import pytest
from matplotlib.figure import Figure
from tests.robots import Shape, joints, write_robot

from somatopy import paper
from somatopy import run as run_it
from somatopy.analysis.runs import Run, RunFolderError
from somatopy.bodies import BodyError, NoGL
from somatopy.cli.report import illustrate, portray, shots
from somatopy.experiment import film

RENDERED = ('kind = "geometric"', 'kind = "fiducial"')
FOUND = (230, 0, 126)  # the colour of rings and outlines


def photographs(asked: list[Any]) -> Any:
    """A camera that keeps what it is asked for."""

    def take(body: Any, arms: Any, heads: Any) -> list[film.Photograph]:
        asked.append((body, np.array(arms), np.array(heads)))
        return [film.Photograph(np.zeros((24, 32, 3), np.uint8), {}, None) for _ in arms]

    return take


def test_parts_are_never_imported(twinless_run: Any, edited: Any, monkeypatch: Any, tmp_path: Path) -> None:
    """Body, eye, learner and intervention of one's own may break when imported, or be gone: the report is whole."""
    (tmp_path / "mine.py").write_text("raise SystemExit('imported')")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    kinds = (('"my_lab.arms:RealArm"', '"mine:Arm"'), ('"geometric"', '"mine:Eye"'))
    run = edited(twinless_run, *kinds, ('"hebbian"', '"mine:Learner"'), ("'offset'", "'mine.harm:Tremor'"))
    text = illustrate(run.path).read_text(encoding="utf-8")
    assert "Learner learner · Eye eye · seed 7" in text and "damaged (Tremor)" in text
    assert "mine" not in sys.modules


@pytest.mark.parametrize("own", [("mujoco", "my_lab:Body"), ("fiducial", "my_lab:Eye")])
def test_only_somatopys_own_bodies_and_eyes_are_filmed(
    rich_copy: Any, edited: Any, monkeypatch: Any, own: tuple[str, str]
) -> None:
    """Pictures are drawn at the recorded postures, from the table of the body; another body or eye is not asked."""
    asked: list[Any] = []
    monkeypatch.setattr(film, "photographs", photographs(asked))
    run = edited(rich_copy, RENDERED)
    frames = [shot.frame for shot in shots(run)]
    ((body, arms, heads),) = asked
    assert body == run.description["body"] and frames
    np.testing.assert_array_equal(arms, run.postures("arm")[frames])
    np.testing.assert_array_equal(heads, run.postures("head")[frames])
    assert shots(edited(run, own)) == [] and len(asked) == 1


@pytest.mark.parametrize(
    ("error", "quiet"), [(NoGL("no OpenGL here"), False), (BodyError("my_robot.toml is gone"), True)]
)
def test_what_cannot_be_filmed_is_said(
    rich_copy: Any, edited: Any, monkeypatch: Any, capsys: Any, error: Exception, quiet: bool
) -> None:
    """Without OpenGL, or without the robot's file, the report is whole but for the filmstrip; the page says why."""

    def fail(*_: Any) -> None:
        raise error

    monkeypatch.setattr(film, "photographs", fail)
    page = illustrate(edited(rich_copy, RENDERED).path, quiet=quiet).read_text(encoding="utf-8")
    assert f'<p class="note">No filmstrip: {error}</p>' in page
    assert capsys.readouterr().err == ("" if quiet else f"No filmstrip: {error}\n")


def test_a_rendered_run_without_postures_has_no_filmstrip(make_run: Any, edited: Any) -> None:
    """There is nothing to draw it from."""
    assert shots(edited(make_run(np.ones(900)), RENDERED)) == []


def test_another_format_is_refused_before_anything_is_written(rich_copy: Any, edited: Any) -> None:
    """One sentence, and the folder is as it was."""
    old = edited(rich_copy, ("format = 2\n", ""))
    before = {path.name for path in old.path.iterdir()}
    with pytest.raises(RunFolderError, match=r"was recorded in an older format, .* or run its experiment again\.$"):
        illustrate(old.path)
    assert {path.name for path in old.path.iterdir()} == before


# -- a robot other than the NAO ----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def foreign(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A second or so of a robot that is no NAO, with the geometric eye."""
    folder = tmp_path_factory.mktemp("foreign")
    anatomy = write_robot(folder, Shape(joints("yz"), joints("zy")))
    base = paper()
    short = base.replaced(
        body=base.body.replaced(model=str(anatomy), motion="kinematic"),
        eye={"kind": "geometric"},
        phases=[base.phases[0].replaced(frames=90)],
    )
    return run_it(short, folder / "run", progress=False, ceiling=False)


@pytest.mark.gl
def test_the_page_shows_another_robot(foreign: Run) -> None:
    """Whatever the eye, the page has pictures of the robot, of frames in which the hand was seen."""
    text = illustrate(foreign.path).read_text(encoding="utf-8")
    assert "The robot, and what its eye sees" in text
    picture = np.asarray(PIL.Image.open(foreign.path / "figures" / "robot.png").convert("RGB"))
    assert (picture == FOUND).all(axis=2).sum() > 100  # rings around the eye, outlines of tags


def test_the_postures_shown_are_of_the_run(foreign: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both are of one frame each, arm and head together, in which the hand was seen."""
    asked: list[Any] = []

    def note(_: Any, postures: Any) -> Figure:
        asked.extend(postures)
        return Figure()

    monkeypatch.setattr("somatopy.cli.body_picture.body_picture", note)
    portray(foreign)
    seen = np.hstack([foreign.postures("arm"), foreign.postures("head")])[foreign.values("hit")]
    shown = [np.concatenate(pair) for pair in asked]
    assert len(shown) == 2 and all((seen == posture).all(axis=1).any() for posture in shown)
    assert (shown[0] != shown[1]).any()


def test_without_its_file_a_robot_is_not_shown(foreign: Run, edited: Any, capsys: Any) -> None:
    """The page is whole but for the picture, and why is said; a picture that is there is called an earlier one."""
    model = Path(foreign.description["body"]["model"])
    gone = edited(foreign, (model.name, "gone.toml"))
    (gone.path / "figures" / "robot.png").unlink(missing_ok=True)
    page = illustrate(gone.path).read_text(encoding="utf-8")
    assert "The robot, and what its eye sees" not in page and "No picture of the robot:" in page
    assert "No picture of the robot:" in capsys.readouterr().err
    (gone.path / "figures" / "robot.png").touch()
    portray(gone)
    assert capsys.readouterr().err.startswith("The picture of the robot is that of an earlier report: ")
