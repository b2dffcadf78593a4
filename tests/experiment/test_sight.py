"""What could be seen, frame by frame: the ceiling's eye, asked of the body as it is in each phase."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import somatopy
from somatopy.analysis.runs import Run
from somatopy.bodies import MujocoBody
from somatopy.experiment import Description
from somatopy.experiment.belief import BELIEF
from somatopy.experiment.ceiling import Vantages, reachable
from somatopy.experiment.sight import SIGHT, STRETCH, STRETCHES, stretches, write_sight

Short = Callable[..., Description]
TILTED = {"kind": "camera", "tilt": 30.0, "roll": 0.0}


@pytest.fixture(scope="module")
def tilted(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run whose camera is turned in its second phase."""
    table = {
        "body": {"motion": "kinematic"},
        "eye": {"kind": "geometric"},
        "learner": {"kind": "best"},
        "phases": [{"name": "a", "frames": 80}, {"name": "b", "frames": 60, "damage": TILTED}],
    }
    return somatopy.run(Description.model_validate(table), tmp_path_factory.mktemp("runs") / "tilted", progress=False)


def arrays(run: Run, name: str) -> dict[str, np.ndarray]:
    with np.load(run.path / name, allow_pickle=False) as file:
        return dict(file)


def test_gazes_are_those_of_the_ceiling(tilted: Run) -> None:
    """In each phase by the body that it has: some see the hand where the ceiling says that it can be seen."""
    found, arms, phase = arrays(tilted, SIGHT), tilted.postures("arm"), tilted.values("phase")
    assert found["frame"].tolist() == list(range(140)) and set(found["stretch"][:80]) != set(found["stretch"][80:])
    body = MujocoBody("nao", "kinematic")
    seen = []
    for k in (0, 1):
        if k:
            body.turn_camera(np.radians(30.0), 0.0)
        vantages = Vantages.of(body)
        assert found["grid"] == len(vantages.heads)
        of_phase = arms[phase == k]
        np.testing.assert_array_equal(found["gazes"][phase == k] > 0, reachable(vantages, of_phase))
        looks = [body.view(of_phase[7], head) for head in vantages.heads]
        assert found["gazes"][80 * k + 7] == sum(vantages.eye.find(view) is not None for view in looks)
        seen.append((found["gazes"][phase == k][::10] > 0).mean())
    body.close()
    assert tilted.ceiling is not None and seen == [phase["rate"] for phase in tilted.ceiling["phases"]]


def test_truth_beside_beliefs_is_each_bodys_own(tilted: Run) -> None:
    """Gaze by gaze, as the eye itself says from the true poses; a turned camera sees other things."""
    seen, asked = arrays(tilted, SIGHT)["seen"], arrays(tilted, BELIEF)
    body = MujocoBody("nao", "kinematic")
    for k in (0, 1):
        if k:
            body.turn_camera(np.radians(30.0), 0.0)
        eye = Vantages.of(body, (5, 3)).eye
        for arm, row in zip(asked["arms"][:3], seen[k], strict=False):
            assert [eye.find(body.view(arm, head)) is not None for head in asked["heads"]] == row.tolist()
    body.close()
    assert seen[0].any(axis=1).all() and (seen[0] != seen[1]).any()


@pytest.mark.parametrize("frames", [1, 3000, 3001, 54_000])
def test_stretches_are_consecutive_from_start_to_end(frames: int) -> None:
    """And no longer together than ten of 20 seconds; a short phase is taken whole."""
    found = stretches(frames)
    assert sum(map(len, found)) == min(frames, STRETCHES * STRETCH)
    assert found[0][0] == 0 and found[-1][-1] == frames - 1
    assert all((np.diff(part) == 1).all() for part in found)


def test_only_first_and_last_phase_count_and_empty_runs_have_none(tmp_path: Path) -> None:
    """Of the phases that have frames."""
    body, rng = MujocoBody("nao", "kinematic"), np.random.default_rng(0)
    arms = [rng.uniform(body.arm.lower, body.arm.upper, (n, 4)) for n in (0, 3, 4, 5, 0)]
    write_sight(tmp_path, [body] * 5, arms)
    with np.load(tmp_path / SIGHT) as found:
        assert found["frame"].tolist() == [0, 1, 2, 7, 8, 9, 10, 11] and "seen" not in found
    write_sight(tmp_path, [body], [np.empty((0, 4))])
    with np.load(tmp_path / SIGHT) as found:
        assert len(found["frame"]) == len(found["gazes"]) == 0
    body.close()
