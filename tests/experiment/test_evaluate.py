"""Held-out postures: nothing learned, nothing changed, the same answer each time, and an answer that is right."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from somatopy.analysis.runs import Run
from somatopy.bodies import MujocoBody
from somatopy.contract import Stage
from somatopy.experiment import Description, DescriptionError, RunFolder, Session, session
from somatopy.experiment.evaluate import evaluate
from somatopy.experiment.run_folder import CHECKPOINT
from somatopy.eyes import GeometricEye
from somatopy.interventions import NoIntervention
from somatopy.learners import FixedGaze

Short = Callable[..., Description]
RunShort = Callable[..., Run]

KEYS = {"eye", "damage", "postures", "reachable", "rate", "efficiency", "gaze_error_deg"}
AWAY = {"kind": "fixed", "head": [-1.5, 0.0]}
AHEAD = {"kind": "fixed", "head": [0.6, 0.3]}


def contents(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_it_looks_on_and_answers_alike(run_short: RunShort) -> None:
    """No byte of the run folder changes, no file is added, and a second call says the same."""
    run = run_short()
    before = contents(run.path)
    result = evaluate(run.path, 150)
    assert result == evaluate(str(run.path), 150)
    assert contents(run.path) == before
    assert set(result) == KEYS and result["postures"] == 150 and result["eye"] == "geometric"


@pytest.mark.parametrize("learner", ["hebbian", "random", "nearest"])
def test_shares_fit_together(run_short: RunShort, learner: str) -> None:
    """What is seen is reachable; efficiency is seen of reachable; angles are in degrees and in order."""
    result = evaluate(run_short(learner={"kind": learner}).path, 150)
    assert 0 <= result["rate"] <= result["reachable"] <= 1
    assert result["efficiency"] == pytest.approx(result["rate"] / result["reachable"])
    assert 0 < result["gaze_error_deg"]["median"] <= result["gaze_error_deg"]["p95"] < 180


def test_a_gaze_is_judged_by_where_it_is(run_short: RunShort) -> None:
    """Away from the left arm nothing is seen; ahead of it much is. What can be reached does not depend on the gaze."""
    away, ahead = (evaluate(run_short(str(gaze["head"]), learner=gaze).path, 300) for gaze in (AWAY, AHEAD))
    assert away["rate"] == away["efficiency"] == 0.0
    assert away["gaze_error_deg"]["median"] > ahead["gaze_error_deg"]["median"] + 10
    assert ahead["rate"] > 0.05
    assert away["reachable"] == ahead["reachable"]


def test_numbers_are_those_of_the_postures_that_are_asked(run_short: RunShort, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each counted anew: the angle between optical axis and hand, its middle and its 95th of a hundred; what is seen.

    What is seen can be reached, also where no posture of the ceiling's grid sees it.
    """
    asked: list[Any] = []

    def nothing(vantages: Any, arms: Any) -> Any:
        asked.extend(arms)
        return np.zeros(len(arms), bool)

    monkeypatch.setattr("somatopy.experiment.evaluate.reachable", nothing)
    result = evaluate(run_short(learner=AHEAD).path, 101)
    with closing(MujocoBody("nao", motion="kinematic")) as body:
        eye = GeometricEye(body.camera, body.marker, body.occluders)
        views = [body.view(arm, np.array(AHEAD["head"])) for arm in asked]
    seen = [eye.find(view) is not None for view in views]
    ways = [(view.camera[3:].reshape(3, 3)[:, 2], view.marker[:3] - view.camera[:3]) for view in views]
    angles = sorted(np.degrees(np.arccos(-back @ way / np.linalg.norm(way))) for back, way in ways)
    assert result["gaze_error_deg"] == pytest.approx({"median": angles[50], "p95": angles[95]})
    assert result["rate"] == result["reachable"] == pytest.approx(sum(seen) / 101) and result["efficiency"] == 1.0
    assert 0 < sum(seen) < 101


def test_the_learner_perceives_the_damage_of_the_phase_reached(run_short: RunShort) -> None:
    """A gaze that ignores the arm is judged alike with any damage; what was learned is asked of shifted postures."""
    hurt: dict[str, Any] = {"damage": {"kind": "offset"}}
    found = {}
    for name, learner in (("blind", AHEAD), ("learned", {"kind": "hebbian"})):
        for damage in ({}, hurt):
            phases = [{"name": "a", "frames": 200}, {"name": "b", "frames": 1, "plastic": [], **damage}]
            if name == "blind":
                phases[1].pop("plastic")
            found[name, bool(damage)] = evaluate(run_short(f"{name}{damage}", learner=learner, phases=phases).path, 200)
            assert found[name, bool(damage)]["damage"] == ("offset" if damage else "none")
    assert _asked(found["blind", True]) == _asked(found["blind", False])
    assert found["learned", True]["reachable"] == found["learned", False]["reachable"]
    assert found["learned", True]["gaze_error_deg"] != found["learned", False]["gaze_error_deg"]


def _asked(result: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in result.items() if key != "damage"}


def test_a_phase_that_never_ran_damages_nothing(run_short: RunShort, short: Short, tmp_path: Path) -> None:
    """Of 0 frames, or not yet reached: the answer is that of a run without that phase, and the damage is "none"."""
    alone = {"name": "a", "frames": 200}
    expected = evaluate(run_short("alone", phases=[alone]).path, 200)
    assert expected["damage"] == "none"
    for name, hurt in (("none", {"kind": "offset"}), ("torn", TornOff)):
        never = {"name": "b", "frames": 0, "interventions": [hurt]}
        parts = {"interventions": {"b": [TornOff]}} if name == "torn" else {}
        assert evaluate(run_short(name, phases=[alone, never]).path, 200, **parts) == expected
        assert evaluate(run_short(f"{name} first", phases=[never, alone]).path, 200, **parts) == expected
    later = short(phases=[alone, {"name": "b", "frames": 50, "damage": {"kind": "offset"}}])
    assert evaluate(stopped_at(200, later, tmp_path / "stopped"), 200) == expected


def test_a_run_without_frames_has_no_damage(run_short: RunShort) -> None:
    """No phase has been reached, whatever the description has in store."""
    phases = [{"name": "a", "frames": 0}, {"name": "b", "frames": 0, "damage": {"kind": "offset"}}]
    assert evaluate(run_short(phases=phases).path, 20)["damage"] == "none"


def test_a_run_stopped_before_its_first_frame_has_no_damage(short: Short, tmp_path: Path) -> None:
    """Its first phase has not begun, so that nothing of it may be held."""
    Spy.calls.clear()
    own: dict[str, Any] = {"interventions": {"a": [Spy]}}
    with Session(short(phases=[{"name": "a", "frames": 50}]), **own) as session:
        folder = RunFolder.new(tmp_path / "run", session.description)
        with folder.recording(session):
            pass
    assert evaluate(folder.path, 5, **own)["damage"] == "none"
    assert not Spy.calls


def stopped_at(frame: int, description: Description, folder: Path, **own: Any) -> Path:
    """The folder of a run that was stopped after so many frames."""
    with Session(description, **own) as session:
        opened = RunFolder.new(folder, session.description)
        with opened.recording(session):
            for _ in session:
                if session.done == frame:
                    break
    return opened.path


class Spy(NoIntervention):
    """Counts what is done to it."""

    calls: ClassVar[list[str]] = []

    def begin(self, stage: Stage) -> None:
        self.calls.append("begin")

    def hold(self, stage: Stage) -> None:
        self.calls.append("hold")

    def release(self, stage: Stage) -> None:
        self.calls.append("release")


@pytest.mark.parametrize("frame", [60, 100, 120, 200])
def test_it_injures_once(frame: int, short: Short, tmp_path: Path) -> None:
    """In mid-phase, at the phase's last frame, and later where it is in force no more: nothing begins anew."""
    phases = [{"name": "a", "frames": 50}, {"name": "b", "frames": 50}, {"name": "c", "frames": 100}]
    own = {"interventions": {"b": [Spy]}}
    folder = stopped_at(frame, short(phases=phases), tmp_path / "run", **own)
    Spy.calls.clear()
    result = evaluate(folder, 5, **own)
    reached = frame <= 100
    assert Spy.calls == (["hold", "release"] if reached else [])
    assert result["damage"].endswith("Spy") == reached and (reached or result["damage"] == "none")


class Says(FixedGaze):
    """A learner whose answer is set from outside."""

    answer: Any = (0.6, 0.3)

    def __init__(self, robot: Any, rng: Any) -> None:
        super().__init__(np.zeros(len(robot.head)))

    def predict(self, arm: Any) -> Any:
        return self.answer


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        ((0.1,), r"predict\(\) of the learner '.*Says' gives the shape \(1,\); .* \(2,\), .* of HeadYaw, HeadPitch"),
        ((0.1, np.nan), r"The learner '.*Says' looks at \[0\.1, nan\] for the arm posture .* must give finite angles"),
    ],
)
def test_an_answer_that_is_no_posture_is_refused(
    answer: Any, said: str, run_short: RunShort, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the name of the learner; no number comes out of it."""
    run = run_short(learner={"kind": f"{__name__}:Says"}, phases=[{"frames": 3}])
    monkeypatch.setattr(Says, "answer", answer)
    with pytest.raises(ValueError, match=said):
        evaluate(run.path, 3)


def test_the_body_is_closed_whatever_happens(run_short: RunShort, monkeypatch: pytest.MonkeyPatch) -> None:
    """After an answer, and after a checkpoint that does not fit: no renderer and no connection is left open."""
    closed: list[MujocoBody] = []
    monkeypatch.setattr(MujocoBody, "close", lambda self: closed.append(self))
    run = run_short(learner=AHEAD, phases=[{"name": "a", "frames": 3}])
    closed.clear()
    evaluate(run.path, 3)
    assert closed
    closed.clear()
    other = run_short("other", learner={"kind": "random"}, phases=[{"frames": 3}])
    (run.path / CHECKPOINT).write_bytes((other.path / CHECKPOINT).read_bytes())
    closed.clear()
    with pytest.raises(DescriptionError):
        evaluate(run.path, 3)
    assert closed


def test_a_gaze_beyond_the_limits_is_judged_at_the_limits(run_short: RunShort) -> None:
    """A posture whose pitch its yaw forbids is judged as the one that the head can take instead."""
    illegal = [1.2, 0.51]
    body = MujocoBody("nao", "kinematic")
    legal = body.legal(illegal).tolist()
    body.close()
    assert legal != illegal
    found = []
    for name, head in (("illegal", illegal), ("legal", legal)):
        found.append(evaluate(run_short(name, learner={"kind": "fixed", "head": head}).path, 150))
    assert found[0] == found[1]


class TornOff(NoIntervention):
    """Takes the robot's cameras 100 m away."""

    alters_ceiling = True

    def hold(self, stage: Stage) -> None:
        stage.body.model.cam_pos[:] += 100.0  # type: ignore[attr-defined]

    def release(self, stage: Stage) -> None:
        stage.body.model.cam_pos[:] -= 100.0  # type: ignore[attr-defined]


def test_an_injured_body_is_judged_injured(run_short: RunShort) -> None:
    """With its camera torn off in the last phase nothing can be reached; intact, the same gaze sees much."""
    intact = {"name": "intact", "frames": 3}
    assert evaluate(run_short("well", learner=AHEAD, phases=[intact]).path, 100)["rate"] > 0.05
    phases = [intact, {"name": "hurt", "frames": 3, "interventions": [TornOff]}]
    hurt = evaluate(run_short("hurt", learner=AHEAD, phases=phases).path, 100, interventions={"hurt": [TornOff]})
    assert (hurt["rate"], hurt["reachable"], hurt["efficiency"]) == (0.0, 0.0, None)
    assert hurt["damage"].endswith("TornOff")


def test_postures_come_from_the_babbling_range(run_short: RunShort, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a range where the hand hangs behind the robot nothing is reachable: the efficiency is unknown, not 0 or 1.

    A session refuses such a range, were it not for the patch.
    """
    monkeypatch.setattr(session, "require_sight", lambda *_: None)
    behind = {"range": [[1.9, 2.0], [1.2, 1.3], [-0.1, 0.1], [-0.1, -0.04]]}
    result = evaluate(run_short(babbling=behind, learner=AHEAD, phases=[{"frames": 3}]).path, 50)
    assert (result["rate"], result["reachable"], result["efficiency"]) == (0.0, 0.0, None)


def test_every_posture_counts_once(run_short: RunShort) -> None:
    """Rates are shares of that many postures; of one posture, 0 or 1."""
    run = run_short(learner=AHEAD, phases=[{"frames": 3}])
    for postures in (1, 7, 40):
        result = evaluate(run.path, postures)
        assert (result["rate"] * postures) == pytest.approx(round(result["rate"] * postures))


def test_an_interrupted_run_can_be_asked(short: Short, tmp_path: Path) -> None:
    """It has a checkpoint."""
    assert set(evaluate(stopped_at(77, short(), tmp_path / "run"), 20)) == KEYS


def test_a_body_without_a_model_of_itself_cannot_be_asked(short: Short, tmp_path: Path) -> None:
    """The message says which run, and why."""
    own = {"body": Untwinned, "eye": Blind, "learner": lambda robot, rng: FixedGaze([0.6, 0.3])}
    folder = stopped_at(3, short(phases=[{"name": "a", "frames": 3}]), tmp_path / "run", **own)
    with pytest.raises(DescriptionError, match=f"body of {folder} has no model of itself"):
        evaluate(folder, 3, **own)


class Blind:
    """An eye that never sees."""

    def __init__(self, body: object) -> None: ...

    def look(self, reading: object) -> None:
        return None


class Untwinned:
    """A simulated robot that tells no more than a real one would."""

    def __init__(self) -> None:
        body = MujocoBody("nao", "kinematic")
        self.arm, self.head, self.camera, self.marker = body.arm, body.head, body.camera, body.marker
        self.reset, self.step, self.close = body.reset, body.step, body.close
        self.state, self.restore = body.state, body.restore


@pytest.mark.gl
def test_it_needs_no_pictures_even_of_a_rendered_run(run_short: RunShort, monkeypatch: pytest.MonkeyPatch) -> None:
    """The geometric eye judges; nothing is drawn."""
    run = run_short(eye={"kind": "fiducial"}, phases=[{"frames": 20}])

    def draw(*args: object) -> np.ndarray:
        raise AssertionError("a picture was drawn")

    monkeypatch.setattr(MujocoBody, "picture", draw)
    assert evaluate(run.path, 20)["eye"] == "geometric"


def test_what_cannot_be_asked_is_named(run_short: RunShort, tmp_path: Path) -> None:
    """No folder, no run folder, no checkpoint, a broken one, another experiment's, no postures."""
    run = run_short(phases=[{"frames": 3}])
    for postures in (0, -1):
        with pytest.raises(DescriptionError, match=f"At least one posture is needed, not {postures}"):
            evaluate(run.path, postures)
    for folder, why in ((tmp_path / "none", "is not a folder"), (tmp_path, "is not a run folder: .*experiment.toml")):
        with pytest.raises(DescriptionError, match=f"^{folder} {why}"):
            evaluate(folder)
    checkpoint = run.path / CHECKPOINT
    whole = checkpoint.read_bytes()
    checkpoint.unlink()
    with pytest.raises(DescriptionError, match=f"{run.path} has no {CHECKPOINT}.*nothing was changed"):
        evaluate(run.path)
    for broken in (b"", whole[:999], whole[:-1]):
        checkpoint.write_bytes(broken)
        with pytest.raises(DescriptionError, match=f"{checkpoint} is no checkpoint that can be read"):
            evaluate(run.path)
    other = run_short("other", learner={"kind": "random"}, phases=[{"frames": 3}])
    checkpoint.write_bytes((other.path / CHECKPOINT).read_bytes())
    with pytest.raises(DescriptionError, match=r"is not what this run began with: .*learner.kind"):
        evaluate(run.path)
