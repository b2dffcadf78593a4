"""The few names that most users need, and an experiment in one call."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import somatopy
from somatopy.experiment import Description, DescriptionError

TABLE = {
    "name": "tiny",
    "body": {"motion": "kinematic"},
    "eye": {"kind": "geometric"},
    "learner": {"kind": "hebbian", "arm_map": {"shape": (5, 5)}, "head_map": {"shape": (5, 5)}},
    "phases": [{"name": "intact", "frames": 30}],
}


@pytest.fixture
def tiny() -> Description:
    return Description.model_validate(TABLE)


def test_every_name_resolves() -> None:
    """Each name in __all__ is there, is shown by dir, and says what it is."""
    for name in somatopy.__all__:
        assert getattr(somatopy, name).__doc__
        assert name in dir(somatopy)


def test_an_unknown_name_lists_the_known_ones() -> None:
    """The error is an AttributeError that says what there is."""
    with pytest.raises(AttributeError, match=r"no attribute 'DSON'; it has DSOM, .*, Description, .*, run"):
        _ = somatopy.DSON


def test_importing_it_alone_is_light() -> None:
    """No simulator, vision, compiler or plotting library is loaded before a name is used."""
    code = "import somatopy, sys; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    heavy = {"mujoco", "cv2", "numba", "numpy", "scipy", "sklearn", "pyarrow", "matplotlib", "pydantic", "tyro"}
    assert not heavy & set(loaded)


def test_run_gives_an_opened_folder_with_a_summary(tiny: Description, tmp_path: Path) -> None:
    """Experiment, then analysis; load_run opens the same again."""
    run = somatopy.run(tiny, tmp_path / "out")
    assert run.path == tmp_path / "out"
    assert run.frames(["frame"]).num_rows == 30
    summary = run.summary
    assert summary is not None and summary["phases"][0]["frames"] == 30
    again = somatopy.load_run(str(tmp_path / "out"))
    assert again.summary == summary and again.description == run.description
    assert somatopy.load_description(run.path / "experiment.toml") == tiny


def test_run_names_a_folder_of_its_own(tiny: Description, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without `out` it is runs/<time>_<name>_seed<k>."""
    monkeypatch.chdir(tmp_path)
    path = somatopy.run(tiny).path
    assert path.parent == Path("runs") and path.name.endswith("_tiny_seed0")


def test_run_refuses_a_used_folder(tiny: Description, tmp_path: Path) -> None:
    """Nothing in it is touched."""
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(DescriptionError, match=f"{tmp_path} is not empty"):
        somatopy.run(tiny, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_run_refuses_a_description_that_does_not_fit_before_it_writes(tiny: Description, tmp_path: Path) -> None:
    """No folder appears for an experiment that cannot be run."""
    with pytest.raises(DescriptionError, match=r"babbling.range 'wide'"):
        somatopy.run(tiny.replaced(babbling={"range": "wide"}), tmp_path / "out")
    assert not (tmp_path / "out").exists()
