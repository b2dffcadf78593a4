"""Robots that nobody chose, each run, reported and evaluated: laws that hold whatever arm, head and camera are."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, example, given, settings
from hypothesis import strategies as st
from tests.robots import Joint, Shape, joints, write_robot

from somatopy import paper, run
from somatopy.analysis.runs import Run
from somatopy.analysis.table import comparison
from somatopy.api import resume
from somatopy.bodies import MujocoBody
from somatopy.cli import main
from somatopy.cli.report import illustrate
from somatopy.experiment import Description, DescriptionError
from somatopy.experiment.ceiling import Vantages, ceiling, reachable
from somatopy.experiment.evaluate import evaluate
from somatopy.interventions.offset import paper_offset

INTACT, DAMAGED = 1100, 700
MAP = {"shape": (6, 6)}
#: How far physics may push a joint past its limit: rad, m.
BEYOND = {"kinematic": {"rad": 1e-9, "m": 1e-9}, "dynamic": {"rad": 0.1, "m": 0.01}}


def ends(least: float, most: float) -> st.SearchStrategy[float]:
    return st.floats(least, most).map(lambda value: round(value, 3))


AXES = st.sampled_from("xyz")
HINGES = st.builds(Joint, AXES, ends(-1.2, -0.1), ends(0.1, 1.2), velocity=ends(0.5, 8))
SLIDES = st.builds(Joint, AXES, ends(-0.08, -0.01), ends(0.01, 0.08), st.just("slide"), ends(0.05, 1))
SHAPES = st.builds(
    Shape,
    st.lists(HINGES | HINGES | SLIDES, min_size=1, max_size=8).map(tuple),
    st.lists(HINGES | HINGES | SLIDES, min_size=1, max_size=3).map(tuple),
    st.tuples(st.integers(120, 640), st.integers(120, 640)),
    ends(30, 90),
    link=st.just(0.0) | ends(0.02, 0.1),
)
LEAST = Shape(joints("y"), joints("z"), (240, 320))
MOST = Shape(joints("yzxyzxyz", 0.4, slides="15"), joints("zyx", slides="2"), (640, 480), link=0.05)
NEVER = Shape(joints("yz", 0.3), joints("y", 0.3), shoulder=(-1.0, 0.0, 0.0))
ALWAYS = Shape(joints("yz", 0.1), joints("zy", 0.05), (640, 480))


def described(anatomy: Path, motion: str, seed: int) -> Description:
    """The paper's experiment, short, with small maps."""
    base = paper()
    return base.replaced(
        seed=seed,
        body=base.body.replaced(model=str(anatomy), motion=motion),
        eye={"kind": "geometric"},
        learner=base.learner.replaced(arm_map={"kind": "dsom", **MAP}, head_map={"kind": "dsom", **MAP}),
        phases=[base.phases[0].replaced(frames=INTACT), base.phases[1].replaced(frames=DAMAGED, trend_breaks=())],
    )


@contextmanager
def robot(shape: Shape, motion: str = "kinematic") -> Iterator[tuple[Path, MujocoBody]]:
    """A folder with the anatomy file, and the body."""
    with tempfile.TemporaryDirectory() as folder:
        anatomy = write_robot(Path(folder), shape)
        with closing(MujocoBody(anatomy, motion=motion)) as body:  # type: ignore[arg-type]
            yield anatomy, body


def check_refusal(refused: DescriptionError, body: MujocoBody) -> None:
    """A run is refused where no head posture shows the hand at any of its arm postures, and only there."""
    assert "the hand is never seen" in str(refused)
    arms = np.random.default_rng(0).uniform(*body.ranges["confined"].T, (300, len(body.arm)))
    assert reachable(Vantages.of(body), arms).mean() < 0.02


@given(shape=SHAPES, seed=st.integers(0, 99))
@example(shape=LEAST, seed=0)
@example(shape=MOST, seed=1)
@example(shape=NEVER, seed=2)
@example(shape=ALWAYS, seed=3)
@settings(max_examples=2, phases=[Phase.explicit, Phase.generate], suppress_health_check=[HealthCheck.too_slow])
def test_a_robot_runs_and_is_reported(shape: Shape, seed: int) -> None:
    """From the anatomy file to the page, as a user goes; what is said agrees with what was recorded."""
    with robot(shape) as (anatomy, body):
        description = described(anatomy, "kinematic", seed)
        try:
            done = run(description, anatomy.parent / "run", progress=False)
        except DescriptionError as refused:
            check_refusal(refused, body)
            return
        check_frames(done, body, shape, "kinematic")
        check_ceiling(done, body)
        check_said(done, body)
        check_evaluation(done.path)
        again = run(description, anatomy.parent / "again", progress=False, ceiling=False, maps=False)
        assert frames_of(again) == frames_of(done)


@given(shape=SHAPES, seed=st.integers(0, 99))
@settings(max_examples=2, phases=[Phase.generate], suppress_health_check=[HealthCheck.too_slow])
def test_a_robot_with_physics_runs_and_goes_on_bit_for_bit(shape: Shape, seed: int) -> None:
    """Servos move hinges and slides; resumed from the border of its phases, it writes the same bytes."""
    with robot(shape, "dynamic") as (anatomy, body):
        description = described(anatomy, "dynamic", seed)
        done = run(description, anatomy.parent / "run", progress=False, ceiling=False)
        check_frames(done, body, shape, "dynamic")
        stand_at_the_border(done.path)
        assert frames_of(resume(done.path, progress=False, ceiling=False)) == frames_of(done)


def frames_of(found: Run) -> list[bytes]:
    return [part.read_bytes() for part in found.parts]


def stand_at_the_border(folder: Path) -> None:
    """The run as it was when its first phase had ended."""
    (folder / "checkpoint.npz").write_bytes((folder / "phase-0.npz").read_bytes())


def check_frames(found: Run, body: MujocoBody, shape: Shape, motion: str) -> None:
    """As many as described; postures within limits; pixels in the picture; the arm is felt where the damage says."""
    phase, hit = found.values("phase"), found.values("hit")
    assert np.bincount(phase).tolist() == [INTACT, DAMAGED]
    for sense, group in (("arm", body.arm), ("head", body.head)):
        kinds = [joint.kind for joint in (shape.arm if sense == "arm" else shape.head)]
        assert found.units(sense) == tuple("m" if kind == "slide" else "rad" for kind in kinds) == group.units
        for role in ("sensed", "command"):
            far = np.array([BEYOND[motion][unit] if role == "sensed" else 1e-9 for unit in group.units])
            postures = found.postures(sense, role)  # type: ignore[arg-type]
            assert (postures >= group.lower - far).all() and (postures <= group.upper + far).all()
    pixels = np.column_stack([found.values("pixel_u"), found.values("pixel_v")])
    assert np.isnan(pixels[~hit]).all() and (found.values("tag")[~hit] == -1).all()
    side = 1.5 * np.sqrt(found.values("tag_area")[hit])[:, None]  # the tag is inside, the cube's centre behind it
    assert (pixels[hit] >= -side).all() and (pixels[hit] <= np.array(shape.size) + side).all()
    felt = found.postures("arm", "percept") - found.postures("arm")
    assert not felt[phase == 0].any()
    assert np.allclose(felt[phase == 1], paper_offset(body.arm))


def check_ceiling(found: Run, body: MujocoBody) -> None:
    """Nobody sees the hand more often than some head posture does, but for what lies between the steps of the grid."""
    phase, hit, arm = found.values("phase"), found.values("hit"), found.postures("arm")
    bound = ceiling([body, body], [arm[phase == 0], arm[phase == 1]], every=1)
    for index, entry in enumerate(bound["phases"]):
        assert hit[phase == index].mean() <= entry["rate"] + 0.02
    assert found.summary is not None and found.summary["ceiling_rate"] == pytest.approx(bound["rate"], abs=0.05)
    assert bound["reactive"]["rate"] <= bound["reactive"]["ceiling_rate"] + 0.02


def check_said(found: Run, body: MujocoBody) -> None:
    """Summary, table and page count the frames as recorded, and compare nothing with the paper's NAO."""
    phase, hit = found.values("phase"), found.values("hit")
    summary = json.loads((found.path / "summary.json").read_text(), parse_constant=pytest.fail)
    for index, entry in enumerate(summary["phases"]):
        hits = int(hit[phase == index].sum())
        assert (entry["hits"], entry["rate"]) == (hits, hits / entry["frames"])
        row = [row for row in comparison(summary) if row.quantity == "frames with the hand detected"][index]
        assert row.run == (hits, 100 * hits / entry["frames"])
    page = illustrate(found.path).read_text(encoding="utf-8")
    for entry in summary["phases"]:
        assert f"{100 * entry['rate']:.1f}\u00a0% of {entry['frames']:,} frames" in page
    for name, shift, unit in zip(body.arm.names, paper_offset(body.arm), body.arm.units, strict=True):
        assert f"{name} {shift:+.4g} {unit}" in page
    assert "of another robot" in page
    assert not any(theirs in page for theirs in ("91,658", "the paper, after 10 min", 'data-name="paper"'))
    assert all(figure.stat().st_size > 5000 for figure in (found.path / "figures").glob("*.png"))
    assert {f"{name}.png" for name in ("figure2", "figure3", "misses")} <= {
        figure.name for figure in (found.path / "figures").iterdir()
    } | ({"figure2.png"} if not found.snapshots else set())


def check_evaluation(folder: Path) -> None:
    """Shares are shares; what is seen can be seen."""
    asked = evaluate(folder, 150)
    assert asked["damage"] == "offset" and 0 <= asked["rate"] <= asked["reachable"] <= 1
    assert (asked["efficiency"] is None) == (asked["reachable"] == 0)
    assert asked["efficiency"] is None or 0 <= asked["efficiency"] <= 1
    assert 0 <= asked["gaze_error_deg"]["median"] <= asked["gaze_error_deg"]["p95"] <= 180


@pytest.mark.parametrize(
    "preset",
    [
        "best",
        *(f"paper-{name}" for name in ("random", "fixed", "nearest", "frozen")),
        *(f"paper-{name}" for name in ("sampled", "shuffled", "scratch", "stopped")),
    ],
)
def test_every_preset_runs_on_a_robot_of_one_head_joint(preset: str, tmp_path: Path, capsys: Any) -> None:
    """By its preset, as typed; after its robot time it says what stands for the paper's damage."""
    anatomy = write_robot(tmp_path, Shape(joints("yzy", slides="1"), joints("y"), (160, 120)))
    words = ["--body.model", str(anatomy), "--motion", "kinematic", "--eye", "geometric", "--minutes", "0.2"]
    length = (
        ["--phases.0.frames", "180", "--phases.1.frames", "90"]
        if preset == "paper-shuffled"
        else ["--damage-minutes", "0.1"]
    )
    assert main(["run", preset, *words, *length, "--out", str(tmp_path / "run")]) == 0
    time, said, *_ = capsys.readouterr().err.splitlines()
    assert time.startswith("Robot time: 0.3 minutes")
    assert said.startswith("The paper's damage is that of a NAO's arm.") == (preset != "paper-shuffled")
    assert Run(tmp_path / "run", {}).values("frame").tolist() == list(range(180 + 90))
