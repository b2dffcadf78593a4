"""The few names that most users need, and an experiment in one call."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import somatopy
from somatopy.analysis.cells import measures
from somatopy.analysis.relearning import of_phase
from somatopy.analysis.runs import Run
from somatopy.api import Interrupted, begin, finish, fork, play, reopen, resume
from somatopy.bodies import MujocoBody
from somatopy.experiment import Description, DescriptionError, RunFolder, Session, provenance, recorder, run_writer
from somatopy.experiment.checkpoint import read_checkpoint, write_checkpoint
from somatopy.experiment.run_folder import CHECKPOINT
from somatopy.interventions import JointOffset, NoIntervention
from somatopy.learners import FixedGaze, NearestGaze
from somatopy.percept import Robot

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
    with pytest.raises(DescriptionError, match=r"babbling: range 'broad' is unknown"):
        somatopy.run(tiny.replaced(babbling={"range": "broad"}), tmp_path / "out")
    assert not (tmp_path / "out").exists()


class Stumbles(FixedGaze):
    """A learner that fails, or gives no number, in its eighth frame."""

    def __init__(self, robot: Robot, rng: np.random.Generator, gaze: float = 0.0) -> None:
        super().__init__([0.0, 0.0])
        self.bad, self.left = gaze, 8

    def gaze(self, percept: Any) -> Any:
        self.left -= 1
        if not self.left and self.bad == 0.0:
            raise KeyError("effort")
        if not self.left and self.bad == 9.0:
            sys.exit()
        return np.full(2, self.bad if not self.left else 0.0)


@pytest.mark.parametrize(
    ("gaze", "error", "notes"),
    [
        (0.0, KeyError, [r"This came after 7 frames, in line \d+ of test_api\.py\.", "kept.*somatopy resume .*/out$"]),
        (9.0, RuntimeError, [r"This came after 7 frames, in line \d+ of test_api\.py\.", "somatopy resume .*/out$"]),
        (np.nan, ValueError, ["learner '.*' gives the head's target", "after 7 frames", "somatopy resume"]),
    ],
)
def test_an_error_of_a_part_says_where_it_came_and_how_to_go_on(
    gaze: float, error: type[Exception], notes: list[str], tiny: Description, tmp_path: Path
) -> None:
    """After hours nobody wants to run again with --debug to learn which line it was; and what ran is not lost."""
    with pytest.raises(error) as caught:
        somatopy.run(tiny, tmp_path / "out", learner=partial(Stumbles, gaze=gaze), progress=False)
    assert len(caught.value.__notes__) == len(notes)
    for said, expected in zip(caught.value.__notes__, notes, strict=True):
        assert re.search(expected, said)


def test_an_error_while_a_part_is_made_names_the_part(tiny: Description, tmp_path: Path) -> None:
    """Whatever its sort; no folder is left."""
    with pytest.raises(ZeroDivisionError) as caught:
        somatopy.run(tiny, tmp_path / "out", learner=lambda robot, rng: 1 / 0)
    assert re.search(r"while the part learner .* was made, in line \d+ of test_api\.py\.$", caught.value.__notes__[0])
    assert not (tmp_path / "out").exists()


# -- resume ----------------------------------------------------------------------------------------------------------


@pytest.fixture
def small_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts and windows of 40 frames instead of 4,500."""
    for module in (run_writer, recorder):
        monkeypatch.setattr(module, "PART_FRAMES", 40)


def contents(run: Run | Path) -> dict[str, bytes]:
    """Frames, maps and summary."""
    path = run if isinstance(run, Path) else run.path
    found = [*path.glob("frames/*"), *path.glob("maps/*"), path / "summary.json"]
    return {str(file.relative_to(path)): file.read_bytes() for file in found}


def interrupted(description: Description, folder: Path, frame: int, **own: Any) -> Path:
    with begin(description, folder, **own) as (session, opened), opened.recording(session):
        for _ in session:
            if session.done == frame:
                break
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
    """At the checkpoint; playing on from there and finishing is what `resume` does."""
    folder = interrupted(tiny, tmp_path / "run", 17)
    with reopen(folder) as (session, opened, since):
        assert (session.done, opened.path) == (17, folder)
        play(session, opened, since, progress=False)
        assert finish(session, folder).summary is not None
    assert contents(folder) == contents(somatopy.run(tiny, tmp_path / "whole"))


def test_without_a_checkpoint_nobody_goes_on(tiny: Description, tmp_path: Path) -> None:
    """Neither from zero nor from elsewhere: the message says what lacks, and no byte of the folder changes."""
    folder = interrupted(tiny, tmp_path / "run", 17)
    (folder / CHECKPOINT).unlink()
    before = everything(folder)
    with pytest.raises(DescriptionError, match=rf"{folder} has no {CHECKPOINT}.*nothing was changed"):
        resume(folder)
    assert everything(folder) == before


def everything(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_what_cannot_be_resumed(tiny: Description, tmp_path: Path) -> None:
    """No folder, no checkpoint in what looks like one, or a folder in use."""
    with pytest.raises(DescriptionError, match="none is not a folder"):
        resume(tmp_path / "none")
    folder = interrupted(tiny, tmp_path / "run", 17)
    with (
        reopen(folder) as (session, opened, since),
        opened.recording(session, since),
        pytest.raises(DescriptionError, match="Another process"),
    ):
        resume(folder)
    (folder / CHECKPOINT).write_bytes(b"")
    with pytest.raises(DescriptionError, match="no checkpoint that can be read"):
        resume(folder)


@pytest.mark.parametrize(
    ("before", "after", "keys"),
    [
        ("seed = 0", "seed = 1", ["seed"]),
        ("elasticity = 0.1", "elasticity = 0.2", ["learner.arm_map.elasticity", "learner.head_map.elasticity"]),
        ("frames = 30", "frames = 31", ["phases.0.frames"]),
        ('kind = "uniform"', 'kind = "uniform"\nrange = "confined"', ["babbling.range"]),
        ('motion = "kinematic"', 'motion = "dynamic"', ["body.motion"]),
    ],
)
def test_an_edited_description_is_refused(
    tiny: Description, tmp_path: Path, before: str, after: str, keys: list[str]
) -> None:
    """By resume, with the keys that were edited and no others; the run goes on once they are put back."""
    described = tiny.replaced(learner=tiny.learner.replaced(arm_map=SMALL, head_map=SMALL))
    folder = interrupted(described, tmp_path / "run", 17)
    file = folder / "experiment.toml"
    text = file.read_text().replace('range = "mechanical"\n', "")
    assert before in text
    file.write_text(text.replace(before, after))
    differ = "differs" if len(keys) == 1 else "differ"
    with pytest.raises(DescriptionError, match=f"is not what this run began with: {', '.join(keys)} {differ}\\."):
        resume(folder)
    file.write_text(text)
    assert resume(folder).frames(["frame"]).num_rows == 30


SMALL = {"kind": "dsom", "shape": (5, 5), "learning_rate": 0.1, "elasticity": 0.1}


def test_other_versions_go_on_only_when_told_to(
    tiny: Description, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What differs is named; told `anyway`, the folder names both, in the order in which they wrote it."""
    folder = interrupted(tiny, tmp_path / "run", 10)
    old = (folder / "experiment.toml").read_text()
    real = provenance.versions()
    monkeypatch.setattr(provenance, "versions", lambda: real | {"numpy": "9.9"})
    with pytest.raises(DescriptionError, match=r"another version.*: versions.numpy differs.*--anyway \(anyway=True"):
        resume(folder)
    assert (folder / "experiment.toml").read_text() == old
    for frame in (17, 24):
        with reopen(folder, anyway=frame == 17) as (session, opened, since), opened.recording(session, since):
            next(frame_ for frame_ in session if session.done == frame)
    monkeypatch.setattr(provenance, "versions", lambda: real | {"numba": "8.8"})
    run = resume(folder, anyway=True)
    assert (folder / "experiment.toml").read_text().startswith(old.rstrip())
    assert run.description["versions"] == real
    later = run.description["resumed"]
    assert [(entry["frame"], entry["versions"]["numpy"], entry["versions"]["numba"]) for entry in later] == [
        (10, "9.9", real["numba"]),
        (24, real["numpy"], "8.8"),
    ]
    assert somatopy.load_description(folder / "experiment.toml") == tiny


def test_other_code_is_another_version(tiny: Description, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A part of one's own whose file was edited; a comment in it is no other code."""
    monkeypatch.syspath_prepend(tmp_path)
    file = tmp_path / "gaze_of_mine.py"
    file.write_text(
        "from somatopy.learners import FixedGaze\n\ndef far(robot, rng):\n    return Mine([0.3, 0.1])\n\n"
        "class Mine(FixedGaze):\n    pass\n"
    )
    folder = interrupted(tiny.replaced(learner="gaze_of_mine:far"), tmp_path / "run", 10)
    file.write_text(file.read_text() + "# a word\n")
    with reopen(folder) as (session, _, _):
        assert session.done == 10
    file.write_text(file.read_text() + "OTHER = 1\n")
    with pytest.raises(DescriptionError, match="code of gaze_of_mine differs"):
        resume(folder)
    assert resume(folder, anyway=True).description["resumed"][0]["frame"] == 10


def test_the_file_that_a_description_names_counts(
    tiny: Description, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It may make a part of somatopy's: what it makes of it can change with it. So do rules named within a learner."""
    monkeypatch.syspath_prepend(tmp_path)
    sources = {
        "maker_of_gaze": "from somatopy.learners import FixedGaze\n\ndef far(*_):\n    return FixedGaze([0, 0])\n",
        "rule_of_mine": "from somatopy.links import PositiveHebb\n\nclass Mine(PositiveHebb):\n    pass\n",
    }
    learners: tuple[Any, ...] = ("maker_of_gaze:far", {"kind": "hebbian", "rule": {"kind": "rule_of_mine:Mine"}})
    for (name, source), learner in zip(sources.items(), learners, strict=True):
        file = tmp_path / f"{name}.py"
        file.write_text(source)
        folder = interrupted(tiny.replaced(learner=learner), tmp_path / name, 10)
        file.write_text(source + "OTHER = 1\n")
        with pytest.raises(DescriptionError, match=f"code of {name} differs"):
            resume(folder)


def test_a_folder_of_an_older_format_is_refused_in_one_sentence(tiny: Description, tmp_path: Path) -> None:
    """By resume, fork, evaluate, report and as a description; nothing in it changes."""
    from somatopy.analysis.runs import RunFolderError
    from somatopy.cli.report import illustrate
    from somatopy.experiment.evaluate import evaluate

    folder = somatopy.run(tiny, tmp_path / "run", progress=False).path
    file = folder / "experiment.toml"
    file.write_text(file.read_text().replace("format = 2\n", ""))
    before = everything(folder)
    for refused in (
        lambda: resume(folder),
        lambda: fork(folder, tiny),
        lambda: evaluate(folder, 3),
        lambda: somatopy.load_description(file),
        lambda: illustrate(folder),
    ):
        with pytest.raises((DescriptionError, RunFolderError), match="format") as caught:
            refused()
        message = str(caught.value)
        assert str(folder) in message and message.count(". ") == 0 and message.endswith(".")
    assert everything(folder) == before


def test_package_metadata_is_not_needed(tiny: Description, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From a source tree somatopy is not installed: the run folder says so, and the run goes on."""

    def missing(name: str) -> str:
        raise provenance.PackageNotFoundError(name)

    monkeypatch.setattr(provenance, "version", missing)
    run = somatopy.run(tiny, tmp_path / "run", progress=False)
    assert set(run.description["versions"].values()) == {"not installed"}
    assert resume(run.path).summary == run.summary


def test_runs_that_begin_in_one_second_have_folders_of_their_own(
    tiny: Description, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Four of the same name and seed at once."""
    monkeypatch.chdir(tmp_path)
    with ThreadPoolExecutor(4) as pool:
        folders = list(pool.map(lambda _: RunFolder.new(None, tiny).path, range(4)))
    assert len({*folders}) == 4 and all(folder.is_dir() for folder in folders)
    assert all(folder.parent == Path("runs") and "_tiny_seed0" in folder.name for folder in folders)


@pytest.mark.usefixtures("small_parts")
def test_a_learner_of_your_own_is_resumed_with_it(tiny: Description, tmp_path: Path) -> None:
    """Whoever began with one must bring it again; then the end is the same."""

    def mine(robot: Robot, rng: np.random.Generator) -> NearestGaze:
        return NearestGaze(robot, rng)

    def other(robot: Robot, rng: np.random.Generator) -> NearestGaze:
        return NearestGaze(robot, rng)

    description = tiny.replaced(phases=[{"frames": 100}])
    expected = contents(somatopy.run(description, tmp_path / "whole", learner=mine))
    folder = interrupted(description, tmp_path / "broken", 57, learner=mine)
    with pytest.raises(
        DescriptionError, match=r"mine' was handed over .* cannot be imported; hand it over again: learner="
    ):
        resume(folder)
    with pytest.raises(DescriptionError, match=r"began with the learner '.*mine'; '.*other' was handed over"):
        resume(folder, learner=other)
    for part, given in {"learner": 3, "babbler": "none", "interventions": {"a": [3]}}.items():
        with pytest.raises(DescriptionError, match=rf"^{part}: is no \w+: it is .*, which is neither .*\.$"):
            resume(folder, **{part: given})
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


def test_ceiling_and_maps_may_be_left_out(tiny: Description, tmp_path: Path, small_parts: None) -> None:
    """By run, resume and fork alike: those files are missing, and frames and all other measures are the same."""
    phases = [*tiny.phases, {"name": "more", "frames": 20}]
    two = tiny.replaced(phases=phases)
    without: dict[str, Any] = {"progress": False, "ceiling": False, "maps": False}
    whole = somatopy.run(two, tmp_path / "whole", progress=False)
    assert whole.ceiling is not None and (whole.path / "maps").exists()
    trained = somatopy.run(tiny, tmp_path / "trained", **without)
    runs = [
        somatopy.run(two, tmp_path / "run", **without),
        resume(interrupted(two, tmp_path / "resumed", 25), **without),
        fork(trained.path, two, 0, tmp_path / "forked", **without),
    ]
    for run in (trained, *runs):
        assert run.ceiling is None and not (run.path / "maps").exists() and not (run.path / "ceiling.json").exists()
    for run in runs:
        frames = {name: content for name, content in contents(run).items() if "frames" in name}
        assert frames and frames == {name: content for name, content in contents(whole).items() if "frames" in name}
        bounds = {
            "ceiling",
            "efficiency",
            "reactive",
            "ceiling_per_window",
            "miss_distance_rad",
            *of_phase([], [], "none", []),
        }
        bounds -= {"hits_per_minute"}
        found, expected = (
            [{k: v for k, v in row.items() if k not in bounds} for row in measures(r)] for r in (run, whole)
        )
        assert found == expected and [row["ceiling"] for row in measures(run)] == [None, None]


def test_a_fork_can_be_forked_and_resumed(tiny: Description, tmp_path: Path, trained: Path) -> None:
    """It has the checkpoints of the phases that it took over, and its own."""
    description = tiny.replaced(phases=[FIRST, *SECONDS["frozen"]])
    forked = fork(trained, description, out=tmp_path / "forked")
    expected = contents(forked)
    assert contents(resume(forked.path)) == expected
    for phase in (0, 1):
        assert contents(fork(forked.path, description, phase, tmp_path / f"again {phase}")) == expected


def test_a_run_with_a_part_as_it_is_can_be_forked(tiny: Description, tmp_path: Path) -> None:
    """A babbler that was handed over ready made, not as its class, is the same part when it is handed over again."""

    class Still:
        def command(self, time: float) -> np.ndarray:
            return np.zeros(4)

        def state(self) -> dict[str, Any]:
            return {}

        def restore(self, state: dict[str, Any]) -> None:
            pass

    own = {"babbler": Still()}
    source = somatopy.run(tiny.replaced(phases=[FIRST]), tmp_path / "trained", **own).path
    description = tiny.replaced(phases=[FIRST, {"name": "more", "frames": 10}])
    forked = fork(source, description, out=tmp_path / "forked", **own)
    assert contents(forked) == contents(somatopy.run(description, tmp_path / "whole", **own))


class Twist(NoIntervention):
    """Does nothing, under a name of its own."""


def test_a_fork_may_bring_an_intervention_of_its_own(tiny: Description, tmp_path: Path, trained: Path) -> None:
    """Its code is none that the source was written by; one that only the source had afterwards is no difference."""
    description = tiny.replaced(phases=[FIRST, {"name": "new", "frames": 10}])
    own = {"interventions": {"new": [Twist]}}
    forked = fork(trained, description, out=tmp_path / "forked", **own)
    assert contents(forked) == contents(somatopy.run(description, tmp_path / "whole", **own))
    plain = fork(forked.path, description, out=tmp_path / "plain")
    assert contents(plain) == contents(somatopy.run(description, tmp_path / "plain whole"))


def test_a_run_goes_on_with_the_interventions_that_it_began_with(tiny: Description, tmp_path: Path) -> None:
    """Others are refused, in its phases and in phases that it has not."""
    folder = interrupted(tiny, tmp_path / "run", 10)
    for phase in ("intact", "nope"):
        with pytest.raises(DescriptionError, match=f"began without the intervention .*Twist.* in a phase '{phase}'"):
            resume(folder, interventions={phase: [Twist]})
    assert resume(folder).summary["phases"]


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
    for none in (-1, 7, "x"):
        with pytest.raises(DescriptionError, match=f"{trained} has no phase {none!r} to fork after; choose one of 0 "):
            fork(trained, tiny, phase=none, out=tmp_path / "forked")  # type: ignore[arg-type]
    assert not (tmp_path / "forked").exists()


def test_a_phase_that_has_not_ended_is_refused(tiny: Description, tmp_path: Path, trained: Path) -> None:
    """Its number and the folder are named, and that the run must be resumed."""
    description = tiny.replaced(phases=[FIRST, *SECONDS["damaged"]])
    folder = interrupted(description, tmp_path / "broken", 120)
    fork(folder, description, 0, tmp_path / "fine")
    with pytest.raises(DescriptionError, match=rf"Phase 1 of {folder} has not ended: .*Resume"):
        fork(folder, description, 1, tmp_path / "forked")
    assert not (tmp_path / "forked").exists()


def test_a_fork_needs_a_run_and_an_empty_folder(tiny: Description, tmp_path: Path, trained: Path) -> None:
    """Neither is guessed."""
    description = tiny.replaced(phases=[FIRST, *SECONDS["damaged"]])
    with pytest.raises(DescriptionError, match="none is not a folder"):
        fork(tmp_path / "none", description, out=tmp_path / "forked")
    with pytest.raises(DescriptionError, match="is not empty"):
        fork(trained, description, out=trained)


@pytest.mark.parametrize(
    ("where", "name", "existed"), [(Twist, "begin", False), (Twist, "sense", True), (shutil, "copy2", False)]
)
def test_a_fork_without_a_frame_of_its_own_leaves_its_folder_as_it_was(
    tiny: Description, tmp_path: Path, trained: Path, where: Any, name: str, existed: bool
) -> None:
    """So that the same command can be given again: where a part fails as its phase begins, or a copy does."""
    description, folder = tiny.replaced(phases=[FIRST, {"name": "new", "frames": 10}]), tmp_path / "forked"
    own = {"interventions": {"new": [Twist]}}
    before = contents(trained)
    if existed:
        folder.mkdir()
    with pytest.MonkeyPatch.context() as patch, pytest.raises(ZeroDivisionError):
        patch.setattr(where, name, lambda *_: 1 / 0)
        fork(trained, description, out=folder, **own)
    assert folder.exists() == existed and not list(folder.glob("*"))
    assert contents(trained) == before and fork(trained, description, out=folder, ceiling=False, **own)


def test_a_learner_of_your_own_may_stand_in_any_experiment(tiny: Description, tmp_path: Path) -> None:
    """It gets a robot, which has limits and image size, and a generator; its name is in the run folder."""
    given: list[Any] = []

    def mine(*args: Any) -> FixedGaze:
        given.append(args)
        return FixedGaze([0.3, 0.1])

    run = somatopy.run(tiny, tmp_path / "out", learner=mine)
    ((robot, rng),) = given
    assert robot.arm.limits.shape == (4, 2) and robot.head.limits.shape == (2, 2)
    assert (robot.camera.width, robot.camera.height) == (320, 240) and robot.moves == ("head",)
    assert isinstance(rng, np.random.Generator)
    assert run.description["learner"]["kind"].endswith("mine")
    assert run.summary is not None and run.summary["learner"].endswith("mine")


# -- stopping --------------------------------------------------------------------------------------------------------

SIGNALS = (signal.SIGINT, signal.SIGTERM)
TWO = [{"name": "a", "frames": 60}, {"name": "b", "frames": 40}]


@pytest.fixture
def stoppable(tiny: Description) -> Description:
    return tiny.replaced(learner={"kind": "fixed", "head": [0.6, 0.3]}, phases=TWO)


def signalling(number: int, frame: int) -> Callable[[Robot, np.random.Generator], FixedGaze]:
    """A learner that sends a signal to this process in the middle of a frame."""

    class Signalling(FixedGaze):
        seen = 0

        def observe(self, percept: object) -> None:
            if self.seen == frame:
                os.kill(os.getpid(), number)
            self.seen += 1

        def gaze(self, percept: Any) -> np.ndarray:
            return np.array([0.6, 0.3])

    return lambda robot, rng: Signalling([0.6, 0.3])


@pytest.mark.parametrize("number", SIGNALS)
@pytest.mark.parametrize("frame", [0, 30, 59, 60])
def test_a_signal_ends_the_run_after_the_frame(stoppable: Description, tmp_path: Path, number: int, frame: int) -> None:
    """The frame under way is finished and in the checkpoint, and the exception says how to go on."""
    folder = tmp_path / "a folder"
    with pytest.raises(Interrupted) as caught:
        somatopy.run(stoppable, folder, progress=False, learner=signalling(number, frame))
    done = frame + 1
    assert read_checkpoint(folder / CHECKPOINT)["session"]["done"] == done
    assert somatopy.load_run(folder).frames(["frame"])["frame"].to_pylist() == list(range(done))
    frames = f"{done} frame{'s' if done > 1 else ''}"
    assert str(caught.value) == f"Interrupted after {frames}. Go on with: somatopy resume '{folder}'"
    assert isinstance(caught.value, KeyboardInterrupt)
    again = resume(folder, progress=False, learner=signalling(number, -1))
    assert again.frames(["frame"]).num_rows == 100


def test_a_resumed_run_can_be_interrupted_again(stoppable: Description, tmp_path: Path) -> None:
    """With the same exception."""
    folder = interrupted(stoppable, tmp_path / "run", 20, learner=signalling(signal.SIGINT, -1))
    with pytest.raises(Interrupted, match="Interrupted after 31 frames"):
        resume(folder, progress=False, learner=signalling(signal.SIGINT, 10))


def test_a_signal_in_the_last_frame_comes_too_late(stoppable: Description, tmp_path: Path) -> None:
    """The run has ended and is not called interrupted."""
    run = somatopy.run(stoppable, tmp_path / "run", learner=signalling(signal.SIGINT, 99))
    assert run.summary is not None and run.frames(["frame"]).num_rows == 100


@pytest.mark.parametrize("frame", [-1, 5])
def test_signals_mean_afterwards_what_they_meant_before(stoppable: Description, tmp_path: Path, frame: int) -> None:
    """Whether the run ended or was stopped."""
    before = [signal.getsignal(number) for number in SIGNALS]
    with pytest.raises(Interrupted) if frame >= 0 else nullcontext():
        somatopy.run(stoppable, tmp_path / "run", learner=signalling(signal.SIGTERM, frame))
    assert [signal.getsignal(number) for number in SIGNALS] == before


def test_off_the_main_thread_a_run_asks_for_no_signals(stoppable: Description, tmp_path: Path) -> None:
    """Only the main thread may; elsewhere a run ends as it does there, progress shown or not."""
    before = [signal.getsignal(number) for number in SIGNALS]
    with ThreadPoolExecutor(1) as pool:
        for progress in (True, False):
            run = pool.submit(somatopy.run, stoppable, tmp_path / f"run {progress}", progress=progress).result()
            assert run.summary is not None
    assert [signal.getsignal(number) for number in SIGNALS] == before


def test_interrupted_in_the_analysis_it_says_how_to_go_on(
    stoppable: Description, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All frames are there; resume makes what lacks."""

    def interrupting(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("somatopy.api.ceiling", interrupting)
        with pytest.raises(Interrupted, match=f"after the last frame. Go on with: somatopy resume {tmp_path / 'run'}"):
            somatopy.run(stoppable, tmp_path / "run")
    assert resume(tmp_path / "run").ceiling is not None


@pytest.mark.parametrize("progress", [True, False])
def test_progress_is_shown_unless_it_is_switched_off(
    stoppable: Description, tmp_path: Path, capsys: pytest.CaptureFixture[str], progress: bool
) -> None:
    """By run, resume and fork, on standard error; standard output is left alone."""
    options = {} if progress else {"progress": False}
    for act in (
        lambda: somatopy.run(stoppable, tmp_path / "run", **options),
        lambda: resume(interrupted(stoppable, tmp_path / "half", 20), **options),
        lambda: fork(tmp_path / "run", stoppable, out=tmp_path / "fork", **options),
    ):
        act()
        out, err = capsys.readouterr()
        assert out == "" and ("frames/s" in err if progress else err == "")


# -- the body is let go ----------------------------------------------------------------------------------------------


@pytest.fixture
def open_bodies(monkeypatch: pytest.MonkeyPatch) -> list[MujocoBody]:
    """Bodies that were made and not closed."""
    found: list[MujocoBody] = []
    make, close = MujocoBody.__init__, MujocoBody.close

    def making(self: MujocoBody, *args: Any, **options: Any) -> None:
        make(self, *args, **options)
        found.append(self)

    def closing(self: MujocoBody) -> None:
        close(self)
        found[:] = [body for body in found if body is not self]

    monkeypatch.setattr(MujocoBody, "__init__", making)
    monkeypatch.setattr(MujocoBody, "close", closing)
    return found


def test_bodies_are_closed_after_run_resume_and_fork(
    tiny: Description, tmp_path: Path, open_bodies: list[MujocoBody]
) -> None:
    """All of them."""
    run = somatopy.run(tiny, tmp_path / "run")
    resume(run.path)
    fork(run.path, tiny, out=tmp_path / "fork")
    assert open_bodies == []


def test_bodies_are_closed_on_an_error(
    tiny: Description, tmp_path: Path, trained: Path, open_bodies: list[MujocoBody]
) -> None:
    """By fork where the phase has not ended or the folder is used, by resume and reopen where nothing fits."""
    other = tiny.replaced(phases=[FIRST, {"name": "b", "frames": 1}])
    for call in (
        lambda: fork(trained, other, 1),
        lambda: fork(trained, other, out=trained),
        lambda: fork(trained, other.replaced(seed=3)),
        lambda: somatopy.run(tiny, trained),
        lambda: resume(mangled(trained, tmp_path / "mangled")),
        lambda: somatopy.run(tiny.replaced(eye="fiducial", babbling={"range": "broad"}), tmp_path / "new"),
    ):
        with pytest.raises(DescriptionError):
            call()
        assert open_bodies == []


def mangled(folder: Path, copy: Path) -> Path:
    """A copy of a run folder whose checkpoint lacks what the learner knew."""
    shutil.copytree(folder, copy)
    state = read_checkpoint(folder / CHECKPOINT)
    del state["session"]["learner"]
    write_checkpoint(copy / CHECKPOINT, state)
    return copy


# -- phases of 0 frames ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("before", "phase"), [([0, 90], 0), ([90, 0], 1), ([90, 0, 0], 2), ([0, 0], 1)])
def test_a_phase_of_0_frames_has_ended(
    tiny: Description, tmp_path: Path, small_parts: None, before: list[int], phase: int
) -> None:
    """A fork may begin there, with any interventions behind it, and has the bytes of the whole experiment."""
    shared = [{"name": f"shared {k}", "frames": frames} for k, frames in enumerate(before)]
    old = [*shared[: phase + 1], {"name": "old", "frames": 60, "plastic": ["links"]}]
    new = [*shared[: phase + 1], {"name": "new", "frames": 70, "damage": "offset", "interventions": ["offset"]}]
    source = somatopy.run(tiny.replaced(phases=old), tmp_path / "old")
    forked = fork(source.path, tiny.replaced(phases=new), phase, tmp_path / "forked")
    assert contents(forked) == contents(somatopy.run(tiny.replaced(phases=new), tmp_path / "whole"))


def test_interventions_of_your_own_are_handed_over(tiny: Description, tmp_path: Path) -> None:
    """By the name of their phase, beside the description's, and again to whoever goes on."""

    def shifted() -> JointOffset:
        return JointOffset([0.1, 0.0, 0.0, 0.0])

    own = {"interventions": {"intact": [shifted]}}
    folder = interrupted(tiny, tmp_path / "run", 10, **own)
    with pytest.raises(DescriptionError, match=r"hand it over again: interventions=\{PHASE: "):
        resume(folder)
    run = resume(folder, **own)
    sensed, perceived = run.postures("arm"), run.postures("arm", "percept")
    assert np.allclose(perceived - sensed, [0.1, 0, 0, 0]) and len(sensed) == 30
    with pytest.raises(DescriptionError, match="there is no phase 'damaged'; phases: intact"):
        Session(tiny, interventions={"damaged": [shifted]})
