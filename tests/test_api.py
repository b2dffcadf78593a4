"""The few names that most users need, and an experiment in one call."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import somatopy
from somatopy.analysis.runs import Run
from somatopy.api import fork, reopen, resume
from somatopy.experiment import Description, DescriptionError, Experiment, loop, recorder
from somatopy.experiment.checkpoint import FILE, locked
from somatopy.experiment.recorder import prepare_folder
from somatopy.learners import FixedGaze, NearestGaze

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


# -- resume ----------------------------------------------------------------------------------------------------------


@pytest.fixture
def small_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts and windows of 40 frames instead of 4,500."""
    for module in (loop, recorder):
        monkeypatch.setattr(module, "PART_FRAMES", 40)


def contents(run: Run | Path) -> dict[str, bytes]:
    """Frames, maps and summary."""
    path = run if isinstance(run, Path) else run.path
    found = [*path.glob("frames/*"), *path.glob("maps/*"), path / "summary.json"]
    return {str(file.relative_to(path)): file.read_bytes() for file in found}


def interrupted(description: Description, folder: Path, frame: int, **own: Any) -> Path:
    Experiment(description, **own).run(prepare_folder(folder, description), lambda running: running.done == frame)
    return folder


@pytest.mark.usefixtures("small_parts")
def test_resume_ends_as_run_does(tiny: Description, tmp_path: Path) -> None:
    """Frames, maps and summary of an interrupted and resumed run are those of one that was not; twice is once."""
    description = tiny.replaced(phases=[{"frames": 100}])
    expected = contents(somatopy.run(description, tmp_path / "whole"))
    folder = interrupted(description, tmp_path / "broken", 57)
    for given in (folder, str(folder)):
        assert resume(given).summary == somatopy.load_run(tmp_path / "whole").summary
        assert contents(folder) == expected


def test_reopen_stands_where_the_run_stood(tiny: Description, tmp_path: Path) -> None:
    """At the checkpoint, or at the beginning if there is none."""
    folder = interrupted(tiny, tmp_path / "run", 17)
    assert reopen(folder).done == 17
    (folder / FILE).unlink()
    assert reopen(folder).done == 0


def test_what_cannot_be_resumed(tiny: Description, tmp_path: Path) -> None:
    """No folder, no checkpoint in what looks like one, or a folder in use."""
    with pytest.raises(DescriptionError, match="No such file"):
        resume(tmp_path / "none")
    folder = interrupted(tiny, tmp_path / "run", 17)
    with locked(folder), pytest.raises(DescriptionError, match="Another process"):
        resume(folder)
    (folder / FILE).write_bytes(b"")
    with pytest.raises(DescriptionError, match="no checkpoint that can be read"):
        resume(folder)


@pytest.mark.usefixtures("small_parts")
def test_a_learner_of_your_own_is_resumed_with_it(tiny: Description, tmp_path: Path) -> None:
    """Whoever began with one must bring it again; then the end is the same."""

    def mine(arm: np.ndarray, head: np.ndarray, image: tuple[int, int], rng: np.random.Generator) -> NearestGaze:
        return NearestGaze(arm, head, rng)

    description = tiny.replaced(phases=[{"frames": 100}])
    expected = contents(somatopy.run(description, tmp_path / "whole", learner=mine))
    folder = interrupted(description, tmp_path / "broken", 57, learner=mine)
    with pytest.raises(DescriptionError, match="mine' is not somatopy's own"):
        resume(folder)
    assert len(contents(resume(folder, learner=mine))) == 4
    assert contents(folder) == expected


# -- fork ------------------------------------------------------------------------------------------------------------

FIRST = {"name": "intact", "frames": 90}
SECONDS: dict[str, list[dict[str, Any]]] = {
    "damaged": [{"name": "damaged", "frames": 70, "damage": {"kind": "offset"}}],
    "frozen": [{"name": "still", "frames": 50, "plastic": []}, {"name": "later", "frames": 20, "start": "afresh"}],
}


@pytest.fixture
def trained(tiny: Description, tmp_path: Path, small_parts: None) -> Path:
    """A run of the first phase and another one."""
    phases = [FIRST, {"name": "other", "frames": 60, "plastic": ["links"]}]
    return somatopy.run(tiny.replaced(phases=phases), tmp_path / "trained").path


@pytest.mark.parametrize("motion", ["kinematic", "dynamic"])
def test_a_fork_is_the_whole_experiment(tiny: Description, tmp_path: Path, motion: str, small_parts: None) -> None:
    """One first phase and several continuations: each gives the bytes of running all of it; the source stays."""
    tiny = tiny.replaced(body={"motion": motion})
    source = somatopy.run(tiny.replaced(phases=[FIRST, {"name": "long", "frames": 200}]), tmp_path / "trained").path
    before = contents(source)
    for name, phases in SECONDS.items():
        description = tiny.replaced(name=name, phases=[FIRST, *phases])
        forked = fork(source, description, out=tmp_path / f"{name} forked")
        whole = somatopy.run(description, tmp_path / f"{name} whole")
        assert contents(forked) == contents(whole)
        assert forked.description == whole.description
        assert {path.name for path in forked.path.iterdir()} == {path.name for path in whole.path.iterdir()}
    assert contents(source) == before


def test_a_fork_can_be_forked_and_resumed(tiny: Description, tmp_path: Path, trained: Path) -> None:
    """It has the checkpoints of the phases that it took over, and its own."""
    description = tiny.replaced(phases=[FIRST, *SECONDS["frozen"]])
    forked = fork(trained, description, out=tmp_path / "forked")
    expected = contents(forked)
    assert contents(resume(forked.path)) == expected
    for phase in (0, 1):
        assert contents(fork(forked.path, description, phase, tmp_path / f"again {phase}")) == expected
    (forked.path / FILE).unlink()
    assert contents(resume(forked.path)) == expected


def test_a_description_that_differs_before_the_fork_is_refused(
    tiny: Description, tmp_path: Path, trained: Path
) -> None:
    """Seed, robot, babbling, learner, eye or a phase before; the name and what comes after may differ."""
    phases = [FIRST, *SECONDS["damaged"]]
    for change in (
        {"seed": 1},
        {"babbling": {"speed": 0.7}},
        {"learner": {"kind": "random"}},
        {"body": {"motion": "dynamic"}},
        {"eye": {"kind": "fiducial"}},
        {"phases": [FIRST | {"frames": 91}, phases[1]]},
        {"phases": [FIRST | {"plastic": ["links"]}, phases[1]]},
        {"phases": [FIRST | {"damage": {"kind": "offset"}}, phases[1]]},
    ):
        with pytest.raises(DescriptionError, match=f"differs from that of {trained} before the end of phase 0"):
            fork(trained, tiny.replaced(**({"phases": phases} | change)), out=tmp_path / "forked")
    with pytest.raises(DescriptionError, match="before the end of phase 1"):
        fork(trained, tiny.replaced(phases=phases), phase=1, out=tmp_path / "forked")
    assert not (tmp_path / "forked").exists()


def test_a_phase_that_has_not_ended_is_refused(tiny: Description, tmp_path: Path, trained: Path) -> None:
    """Its number and the folder are named, and that the run must be resumed; so is a phase that there is not."""
    description = tiny.replaced(phases=[FIRST, *SECONDS["damaged"]])
    folder = interrupted(description, tmp_path / "broken", 120)
    fork(folder, description, 0, tmp_path / "fine")
    for phase in (1, 7):
        with pytest.raises(DescriptionError, match=rf"Phase {phase} of {folder} has not ended: .*Resume"):
            fork(folder, description, phase, tmp_path / "forked")
    assert not (tmp_path / "forked").exists()


def test_a_fork_needs_a_run_and_an_empty_folder(tiny: Description, tmp_path: Path, trained: Path) -> None:
    """Neither is guessed."""
    description = tiny.replaced(phases=[FIRST, *SECONDS["damaged"]])
    with pytest.raises(DescriptionError, match="No such file"):
        fork(tmp_path / "none", description, out=tmp_path / "forked")
    with pytest.raises(DescriptionError, match="is not empty"):
        fork(trained, description, out=trained)


def test_a_learner_of_your_own_may_stand_in_any_experiment(tiny: Description, tmp_path: Path) -> None:
    """It gets limits, image size and a generator; its name is in the run folder."""
    given: list[Any] = []

    def mine(*args: Any) -> FixedGaze:
        given.append(args)
        return FixedGaze([0.3, 0.1])

    run = somatopy.run(tiny, tmp_path / "out", learner=mine)
    ((arm, head, image, rng),) = given
    assert arm.shape == (4, 2) and head.shape == (2, 2) and image == (320, 240)
    assert isinstance(rng, np.random.Generator)
    assert run.description["learner"]["kind"] == "own" and run.description["learner"]["name"].endswith("mine")
    assert run.summary is not None and run.summary["learner"] == "own"
