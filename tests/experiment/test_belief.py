"""What a learner believes at held-out postures: asking changes nothing, and the file is the same however a run went."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.robots import Shape, joints, write_robot

from somatopy.analysis.runs import Run, load_run
from somatopy.experiment import Description, RunFolder, Session
from somatopy.experiment.belief import BELIEF, GRIDS, POSTURES, Beliefs
from somatopy.experiment.context import Context
from somatopy.learners import HebbianLearner

Short = Callable[..., Description]
RunShort = Callable[..., Run]

OFFSET = [0.1265, 1.1411, 1.2295, -0.2242]
BEST: dict[str, Any] = {"kind": "best"}


def arrays(run: Run | Path) -> dict[str, np.ndarray]:
    with np.load((run.path if isinstance(run, Run) else run) / BELIEF, allow_pickle=False) as file:
        return dict(file)


def recorded(description: Description, folder: Path, **settings: Any) -> Run:
    with Session(description) as session:
        opened = RunFolder.new(folder, session.description)
        with opened.recording(session, **settings):
            for _ in session:
                pass
    return load_run(opened.path)


NOISY = [
    {"name": "intact", "frames": 60},
    {"name": "noisy", "frames": 40, "damage": {"kind": "noise", "deviation": 0.3}},
]


@pytest.mark.parametrize("learner", [{"kind": "best"}, {"kind": "hebbian"}, {"kind": "random"}])
def test_asking_changes_no_frame(short: Short, tmp_path: Path, learner: dict[str, Any]) -> None:
    """Neither learner nor damage notice, also where the damage draws random numbers: frames are the same bytes."""
    description = short(learner=learner, phases=NOISY)
    asked, left = (recorded(description, tmp_path / str(maps), maps=maps) for maps in (True, False))
    assert [part.read_bytes() for part in asked.parts] == [part.read_bytes() for part in left.parts]
    assert (asked.path / BELIEF).exists() and not (left.path / BELIEF).exists()


def test_it_is_asked_at_the_ends_of_windows_and_phases(short: Short, tmp_path: Path, monkeypatch: Any) -> None:
    """Once where both meet; the phase is the one that ends there."""
    for module in ("run_writer", "recorder"):
        monkeypatch.setattr(f"somatopy.experiment.{module}.PART_FRAMES", 40)
    phases = [{"name": name, "frames": frames} for name, frames in (("a", 50), ("b", 30), ("c", 25), ("d", 0))]
    found = arrays(recorded(short(phases=phases), tmp_path / "run"))
    assert found["frame"].tolist() == [40, 50, 80, 105] and found["phase"].tolist() == [0, 0, 1, 2]
    assert found["belief"].shape == (4, POSTURES, len(found["heads"]))
    assert found["gaze"].shape == (4, POSTURES, 2)


def test_postures_are_in_the_babbling_range_visible_and_no_frames(run_short: RunShort, short: Short) -> None:
    """Drawn from a stream of their own: another seed, others; another learner or length, the same."""
    run = run_short()
    found = arrays(run)["arms"]
    with Session(short()) as session:
        low, high = Context(session.description, session.body).bounds().T
        for arm in found:
            seen = [session.body.view(arm, head) for head in arrays(run)["heads"]]  # type: ignore[attr-defined]
            assert any(session.eye.find(view) is not None for view in seen)  # type: ignore[attr-defined]
    assert found.shape == (POSTURES, 4) and ((low <= found) & (found <= high)).all()
    assert np.abs(run.postures("arm")[:, None] - found).max(axis=2).min() > 0
    other = run_short("other", learner={"kind": "random"}, phases=[{"frames": 20}])
    np.testing.assert_array_equal(arrays(other)["arms"], found)
    assert not np.isin(arrays(run_short("seed", seed=4, phases=[{"frames": 20}]))["arms"], found).any()


def test_grid_is_what_the_head_can_take(run_short: RunShort, short: Short) -> None:
    """Each gaze is legal and where `cells` say, less than a step from the grid's."""
    found = arrays(run_short())
    assert tuple(found["shape"]) == GRIDS[2]
    low, high = found["limits"].T
    steps = np.stack(np.unravel_index(found["cells"], GRIDS[2]), axis=1)
    step = (high - low) / (np.array(GRIDS[2]) - 1)
    assert (np.abs(found["heads"] - low - steps * step) < step).all()
    with Session(short()) as session:
        legal = [session.body.legal(head) for head in found["heads"]]  # type: ignore[attr-defined]
    np.testing.assert_array_equal(legal, found["heads"])


def test_the_learner_is_asked_as_the_damage_lets_it_feel(short: Short) -> None:
    """At the sum of posture and offset once the damage has come; before, at the posture."""
    with Session(short()) as session:
        beliefs = Beliefs(session)
        arms = beliefs.arrays["arms"]
        for frames, shift in ((200, 0.0), (100, OFFSET)):
            for _ in range(frames):
                next(session)
            beliefs.note(session)
            felt, learner = arms + shift, session.learner
            np.testing.assert_allclose(session.feel(arms), felt)
            assert isinstance(learner, HebbianLearner)
            expected = np.floor(255 * learner.belief(felt, beliefs.arrays["heads"]))
            np.testing.assert_array_equal(beliefs.arrays["belief"][-1], expected)
            gazes = [session.body.legal(learner.predict(arm)) for arm in felt]  # type: ignore[attr-defined]
            np.testing.assert_array_equal(beliefs.arrays["gaze"][-1], gazes)
        assert beliefs.arrays["belief"].any()


def test_drift_and_dead_joints_are_felt_as_at_that_time(short: Short) -> None:
    """What a damage has come to counts, and is not moved on by asking."""
    damages = [{"kind": "drift"}, {"kind": "dead-joint", "joint": 1}]
    for damage in damages:
        phases = [{"name": "a", "frames": 30}, {"name": "b", "frames": 60, "damage": damage}]
        with Session(short(phases=phases)) as session:
            frame = [next(session) for _ in range(90)][-1]
            arms = np.array([frame.reading.arm])
            first, again = session.feel(arms), session.feel(arms)
            np.testing.assert_array_equal(first, again)
            near = 0.01 if damage["kind"] == "drift" else 0.0
            assert (np.abs(first[0] - frame.percept.arm) <= near).all() and (first != arms).any()


def test_a_fork_keeps_what_was_noted_before(short: Short, tmp_path: Path) -> None:
    """Its file has the moments of the shared phase as they were, and then its own."""
    import somatopy
    from somatopy.api import fork

    quiet: dict[str, Any] = {"progress": False, "ceiling": False}
    whole = somatopy.run(short(learner=BEST), tmp_path / "whole", **quiet)
    other = short(learner=BEST, phases=[short().phases[0], {"name": "other", "frames": 30}])
    forked, found = arrays(fork(whole.path, other, 0, tmp_path / "fork", **quiet)), arrays(whole)
    assert forked["frame"].tolist() == [200, 230]
    for name in ("gaze", "belief"):
        np.testing.assert_array_equal(forked[name][0], found[name][0])


@pytest.mark.parametrize("axes", ["z", "zyx"])
def test_heads_of_one_and_of_three_joints(short: Short, tmp_path: Path, axes: str) -> None:
    """The grid has as many axes; what is noted fits it."""
    anatomy = write_robot(tmp_path, Shape(joints("yzy"), joints(axes)))
    body = {"model": str(anatomy), "motion": "kinematic"}
    phases = [{"name": "a", "frames": 60}]
    found = arrays(recorded(short(body=body, learner=BEST, phases=phases), tmp_path / "run"))
    assert tuple(found["shape"]) == GRIDS[len(axes)]
    assert found["heads"].shape == (found["belief"].shape[2], len(axes)) and found["gaze"].shape[2] == len(axes)


def test_a_learner_that_does_not_say_is_asked_where_it_would_look(run_short: RunShort) -> None:
    """No belief is kept, its gazes are."""
    found = arrays(run_short(learner={"kind": "fixed", "head": [0.3, 0.1]}, phases=[{"frames": 20}]))
    assert found["belief"].shape == (1, POSTURES, 0)
    np.testing.assert_array_equal(found["gaze"], np.tile([0.3, 0.1], (1, POSTURES, 1)))


class Twinless:
    """A robot without a model of itself: it shows no more than what each body must have."""

    def __init__(self, body: Any) -> None:
        self._body = body
        self.arm, self.head, self.camera, self.marker = body.arm, body.head, body.camera, body.marker
        self.reset, self.step, self.close = body.reset, body.step, body.close


def test_a_body_without_a_model_of_itself_has_no_file(short: Short, tmp_path: Path) -> None:
    """Nobody can tell what its head can take."""
    from somatopy.bodies import MujocoBody
    from somatopy.eyes import GeometricEye

    body = MujocoBody("nao", "kinematic")
    eye = GeometricEye(body.camera, body.marker, body.occluders)
    with Session(short(phases=[{"frames": 20}]), body=Twinless(body), eye=eye) as session:
        folder = RunFolder.new(tmp_path / "run", session.description)
        with folder.recording(session):
            for _ in session:
                pass
    assert not (tmp_path / "run" / BELIEF).exists()


def test_a_run_recorded_without_goes_on_without(short: Short, tmp_path: Path) -> None:
    """What was not asked in time cannot be asked later; nothing is made up."""
    recorded(short(), tmp_path / "run", maps=False)
    shutil.copy(tmp_path / "run" / "phase-0.npz", tmp_path / "run" / "checkpoint.npz")
    folder = RunFolder(tmp_path / "run")
    with Session(folder.description()) as session:
        since = folder.restore(session)
        with folder.recording(session, since):
            for _ in session:
                pass
    assert not (tmp_path / "run" / BELIEF).exists()
