"""Held-out postures: nothing learned, nothing changed, the same answer each time, and an answer that is right."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from somatopy.analysis.runs import Run
from somatopy.bodies import MujocoBody
from somatopy.experiment import Description, DescriptionError, Experiment, loop
from somatopy.experiment.checkpoint import FILE
from somatopy.experiment.damage import NoDamage
from somatopy.experiment.evaluate import evaluate
from somatopy.experiment.recorder import prepare_folder

Short = Callable[..., Description]
RunShort = Callable[..., Run]

KEYS = {"eye", "postures", "reachable", "rate", "efficiency", "gaze_error_deg"}
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


def test_the_learner_perceives_the_last_damage(run_short: RunShort) -> None:
    """A gaze that ignores the arm is judged alike with any damage; what was learned is asked of shifted postures."""
    hurt: dict[str, Any] = {"damage": {"kind": "offset"}}
    found = {}
    for name, learner in (("blind", AHEAD), ("learned", {"kind": "hebbian"})):
        for damage in ({}, hurt):
            phases = [{"name": "a", "frames": 200}, {"name": "b", "frames": 0, **damage}]
            found[name, bool(damage)] = evaluate(run_short(f"{name}{damage}", learner=learner, phases=phases).path, 200)
    assert found["blind", True] == found["blind", False]
    assert found["learned", True]["reachable"] == found["learned", False]["reachable"]
    assert found["learned", True]["gaze_error_deg"] != found["learned", False]["gaze_error_deg"]


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


def test_an_injured_body_is_judged_injured(run_short: RunShort, monkeypatch: pytest.MonkeyPatch) -> None:
    """With its camera torn off in the last phase nothing can be reached; intact, the same gaze sees much."""
    run = run_short(learner=AHEAD, phases=[{"name": "intact", "frames": 3}, {"name": "hurt", "frames": 3}])
    assert evaluate(run.path, 100)["rate"] > 0.05
    real = loop.build_damage
    monkeypatch.setattr(loop, "build_damage", lambda p, body: TornOff() if p.name == "hurt" else real(p, body))
    hurt = evaluate(run.path, 100)
    assert (hurt["rate"], hurt["reachable"], hurt["efficiency"]) == (0.0, 0.0, None)


class TornOff(NoDamage):
    """Takes the robot's cameras 100 m away."""

    def injure(self, body: MujocoBody) -> None:  # type: ignore[override]
        body.model.cam_pos[:] += 100.0


def test_postures_come_from_the_babbling_range(run_short: RunShort) -> None:
    """In a range where the hand hangs behind the robot nothing is reachable: the efficiency is unknown, not 0 or 1."""
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
    folder = prepare_folder(tmp_path / "run", short())
    Experiment(short()).run(folder, lambda running: running.done == 77)
    assert set(evaluate(folder, 20)) == KEYS


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
    for folder in (tmp_path / "none", tmp_path):
        with pytest.raises(DescriptionError, match=f"{folder / 'experiment.toml'}"):
            evaluate(folder)
    checkpoint = run.path / FILE
    whole = checkpoint.read_bytes()
    checkpoint.unlink()
    with pytest.raises(DescriptionError, match=f"{checkpoint} is no checkpoint that can be read: .*No such file"):
        evaluate(run.path)
    for broken in (b"", whole[:999], whole[:-1]):
        checkpoint.write_bytes(broken)
        with pytest.raises(DescriptionError, match=f"{checkpoint} is no checkpoint that can be read"):
            evaluate(run.path)
    other = run_short("other", learner={"kind": "random"}, phases=[{"frames": 3}])
    checkpoint.write_bytes((other.path / FILE).read_bytes())
    with pytest.raises(DescriptionError, match=f"{checkpoint} does not fit"):
        evaluate(run.path)
