"""Three short runs, held to the values that they had when they were kept: a change of shape changes no number."""

from __future__ import annotations

import platform
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from somatopy.analysis.runs import Run
from somatopy.api import fork, run
from somatopy.experiment import Description
from somatopy.experiment.checkpoint import read_checkpoint

DATA = Path(__file__).parents[1] / "data" / "three_runs.npz"
Arrays = dict[str, np.ndarray]

# -- how a run is read: what a change of names must adapt --------------------------------------------------------------

ARM = ("LShoulderPitch", "LShoulderRoll", "LElbowYaw", "LElbowRoll")
HEAD = ("HeadYaw", "HeadPitch")
COLUMNS = {
    "arm": [f"arm.{joint}" for joint in ARM],
    "head": [f"head.{joint}" for joint in HEAD],
    "arm_command": [f"arm_command.{joint}" for joint in ARM],
    "head_command": [f"head_command.{joint}" for joint in HEAD],
    "percept": [f"arm_percept.{joint}" for joint in ARM],
    "pixel": ["pixel_u", "pixel_v"],
    "winners": ["arm_winner", "head_winner"],
    "distances": ["arm_distance", "head_distance"],
    "gaze_error": ["gaze_error_rad"],
    "area": ["tag_area"],
} | {name: [name] for name in ("frame", "phase", "time_s", "hit", "tag", "overlap")}


def frames_of(run: Run) -> Arrays:
    """What was recorded of each frame, a row a frame."""
    return {
        name: np.column_stack([run.frames([column])[column].to_numpy() for column in columns])
        for name, columns in COLUMNS.items()
    }


def end_of(run: Run) -> Arrays:
    """What the learner knew in the end, what the summary says of each phase, and the bounds."""
    learner, summary, ceiling = (
        read_checkpoint(run.path / "checkpoint.npz")["session"]["learner"],
        run.summary,
        run.ceiling,
    )
    assert summary is not None and ceiling is not None
    return {
        "arm_codebook": learner["arm_map"]["codebook"],
        "head_codebook": learner["head_map"]["codebook"],
        **{name: learner["links"][name] for name in ("link_pre", "link_post", "link_weight")},
        "phase_frames": np.array([phase["frames"] for phase in summary["phases"]]),
        "phase_hits": np.array([phase["hits"] for phase in summary["phases"]]),
        "bounds": np.array([ceiling["rate"], ceiling["reactive"]["rate"], ceiling["reactive"]["ceiling_rate"]]),
    }


# -- the runs ----------------------------------------------------------------------------------------------------------

SMALL = {"shape": [10, 10]}
DAMAGED: dict[str, Any] = {"name": "damaged", "damage": {"kind": "offset"}}
TABLE: dict[str, Any] = {
    "name": "kept",
    "seed": 3,
    "eye": {"kind": "geometric"},
    "learner": {"kind": "hebbian", "arm_map": SMALL, "head_map": SMALL},
}


def described(**tables: Any) -> Description:
    return Description.model_validate(TABLE | tables)


def kinematic(folder: Path) -> Run:
    """The paper's learner, intact and damaged, without physics."""
    phases = [{"name": "intact", "frames": 800}, DAMAGED | {"frames": 400}]
    return run(described(body={"motion": "kinematic"}, phases=phases), folder / "kinematic")


def rendered(folder: Path) -> Run:
    """Physics, and the detector on pictures."""
    return run(described(eye={"kind": "fiducial"}, phases=[{"name": "intact", "frames": 150}]), folder / "rendered")


def forked(folder: Path) -> Run:
    """With physics: after a trained first phase, damage under which only the links learn."""
    first = {"name": "intact", "frames": 400}
    run(described(phases=[first]), folder / "trained")
    second = DAMAGED | {"frames": 200, "plastic": ["links"]}
    return fork(folder / "trained", described(phases=[first, second]), out=folder / "forked")


def values_of(run: Run) -> Arrays:
    """All that is kept of a run."""
    return {name: np.ascontiguousarray(array) for name, array in (frames_of(run) | end_of(run)).items()}


def made_with() -> list[str]:
    """What the last bits of a value can depend on besides our code."""
    return [
        *(f"{name} {version(name)}" for name in ("mujoco", "numba", "numpy", "opencv-python-headless")),
        f"{platform.machine()} {platform.libc_ver()}",
    ]


# -- the tests ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("make", [kinematic, pytest.param(rendered, marks=pytest.mark.gl), forked])
def test_every_value_is_the_one_that_was_kept(make: Any, tmp_path: Path) -> None:
    """Frames, codebooks, links and hits of the run, recomputed, equal the kept ones to the last bit.

    Where versions in the message differ, ask first whether they explain it; `tests/data/make_three_runs.py` says when
    the data may be written anew.
    """
    found, kept = values_of(make(tmp_path)), {}
    with np.load(DATA, allow_pickle=False) as file:
        kept = {name.split(".")[1]: file[name] for name in file.files if name.startswith(f"{make.__name__}.")}
        versions = f"kept with {file['made_with'].tolist()}, now {made_with()}"
    assert found.keys() == kept.keys()
    wrong = [name for name in kept if not same_values(found[name], kept[name])]
    assert not wrong, f"other values of the {make.__name__} run: {wrong}; {versions}"


def same_values(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether shapes and all numbers are equal, NaN being equal to NaN."""
    return np.array_equal(a, b, equal_nan=b.dtype.kind == "f")


def test_the_kept_runs_hold_what_can_go_wrong() -> None:
    """Each has hits and misses, several movements and links; damage shifts percepts; a fork freezes the maps."""
    with np.load(DATA, allow_pickle=False) as file:
        for name in ("kinematic", "rendered", "forked"):
            hits = file[f"{name}.hit"]
            assert 0.02 < hits.mean() < 0.98 and file[f"{name}.phase_hits"].sum() == hits.sum()
            assert len(np.unique(file[f"{name}.arm_command"], axis=0)) > 3
            assert len(file[f"{name}.link_weight"]) > 3
            damaged = file[f"{name}.phase"].ravel() == 1
            shift = file[f"{name}.percept"] - file[f"{name}.arm"]
            assert (np.abs(shift).max(axis=1) > 1).tolist() == damaged.tolist()
