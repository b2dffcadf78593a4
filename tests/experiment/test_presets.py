"""The paper's protocol, as section III and IV of the paper and its table of numbers give it, and its controls."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from somatopy.analysis.cells import load_study
from somatopy.analysis.paper_loss import paper as paper_loss
from somatopy.analysis.runs import Run
from somatopy.bodies import MujocoBody
from somatopy.clock import WINDOW
from somatopy.experiment import PRESETS, Description, Phase, Session, frames_of, paper
from somatopy.experiment.checkpoint import read_checkpoint
from somatopy.experiment.description import stands_for
from somatopy.experiment.presets import CONTROLS
from somatopy.registry import INTERVENTIONS

STUDIES = Path(__file__).parents[2] / "studies"
Short = Callable[..., Description]
RunShort = Callable[..., Run]


def test_the_paper_in_full() -> None:
    """177,823 frames intact (197.58 minutes), then 96,049 (106.72) shifted by the paper's offsets; 39, 21 windows."""
    intact, damaged = paper().phases
    assert (intact.frames, damaged.frames) == (177_823, 96_049)
    assert intact.frames == pytest.approx(frames_of(197.58), abs=5)
    assert damaged.frames == pytest.approx(frames_of(106.72), abs=5)
    assert (intact.frames // WINDOW, damaged.frames // WINDOW) == (39, 21)
    assert intact.damage == "none" and intact.interventions == ()
    [offset] = damaged.interventions
    assert INTERVENTIONS.dumped(offset) == {"kind": "offset", "offset": "paper"}


def test_the_second_phase_has_two_trends() -> None:
    """Degradation over the first 35 minutes, re-adaptation over the rest; phase 1 is one segment."""
    intact, damaged = paper().phases
    assert intact.trend_breaks == ()
    assert [w * WINDOW for w in damaged.trend_breaks] == [frames_of(35)]


def test_the_paper_learns_with_two_30x30_maps_and_a_link_rate_of_0_01() -> None:
    """Sizes and rates of section III; physics and the rendered eye are the default."""
    description = paper()
    learner = description.model_dump()["learner"]
    assert learner["kind"] == "hebbian" and learner["link_rate"] == 0.01
    assert learner["arm_map"]["shape"] == learner["head_map"]["shape"] == (30, 30)
    assert learner["arm_map"]["kind"] == learner["head_map"]["kind"] == "dsom"
    assert (learner["rule"]["kind"], learner["activation_slope"], learner["units"]) == ("positive", 1.0, "unit")
    assert (description.body.motion, description.eye.kind, description.body.model) == ("dynamic", "fiducial", "nao")


def test_the_preset_is_what_was_calibrated() -> None:
    """The settings with the least loss on the seeds that choose, rounded to two digits; docs/calibration.md."""
    plan = tomllib.loads((STUDIES / "calibration-choose" / "study.toml").read_text())
    result = load_study(STUDIES / "calibration-choose")
    best = plan["conditions"][min(result.conditions, key=lambda name: paper_loss(result, name))]["experiment"]
    table = paper().model_dump(mode="json")
    found = {
        "head_speed": (table["body"]["head_speed"], best["body"]["head_speed"]),
        "arm_speed": (table["babbling"]["speed"], best["babbling"]["speed"]),
        **{
            f"{side} {key}": (table["learner"][side][key], best["learner"][side][key])
            for side in ("arm_map", "head_map")
            for key in ("learning_rate", "elasticity")
        },
    }
    assert all(ours == float(f"{chosen:.2g}") for ours, chosen in found.values()), found
    assert best["babbling"]["range"] == MujocoBody("nao", motion="kinematic").ranges["confined"].tolist()


def test_the_library_of_2016_is_the_same_experiment_with_another_learner() -> None:
    """All but name and learner is the paper's; the learner is what docs and library say, and it can be built."""
    variant = PRESETS["paper-2016"]()
    assert variant.replaced(name="paper", learner=paper().learner) == paper()
    table = variant.model_dump()["learner"]
    for side in ("arm_map", "head_map"):
        assert (table[side]["preset"], table[side]["learning_rate"], table[side]["elasticity"]) == (
            "schillaci2016",
            0.2,
            1.5,
        )
    assert (table["rule"]["kind"], table["activation_slope"]) == ("normalised", 2.0)
    assert (table["units"], table["centring"]) == ("radian", "none")
    with Session(variant.replaced(body={"motion": "kinematic"}, eye="geometric")) as session:
        assert next(session).probes["arm_distance"] > 0


def test_presets_are_made_anew_and_valid() -> None:
    """Each preset builds a description that survives its own validation."""
    for make in PRESETS.values():
        description = make()
        assert description == make() == description.replaced()


# -- controls --------------------------------------------------------------------------------------------------------


def control(name: str, description: Description) -> Description:
    """That control of it, each phase after the first 100 frames long."""
    made = CONTROLS[name](description)
    return made.replaced(phases=[made.phases[0], *(p.replaced(frames=100) for p in made.phases[1:])])


@pytest.fixture
def run_control(run_short: RunShort, short: Short) -> Callable[[str], Run]:
    """Run a control of the short experiment."""
    return lambda name: run_short(name, **control(name, short()).model_dump())


def ends(run: Run) -> list[dict[str, Any]]:
    """The learner's state at the end of each phase."""
    return [read_checkpoint(run.path / f"phase-{k}.npz")["session"]["learner"] for k in range(2)]


def arms(run: Run) -> np.ndarray:
    return np.column_stack([run.postures("arm"), run.postures("arm", "command")])


def test_every_control_is_a_preset() -> None:
    """Named after the paper's experiment, of the same robot, eye, babbling and first phase's damage."""
    assert set(PRESETS) == {"paper", "paper-wide", "paper-2016", "best", *(f"paper-{name}" for name in CONTROLS)}
    for name, make in PRESETS.items():
        made = make()
        assert made.name == name
        if name == "best":
            continue
        if name != "paper-wide":
            assert (made.seed, made.body, made.eye, made.babbling) == (0, paper().body, paper().eye, paper().babbling)
        assert (made.phases[0].frames, made.phases[0].damage) == (177_823, "none")


def test_best_is_the_wide_experiment_with_another_learner() -> None:
    """An hour intact and half an hour damaged; else nothing differs from `paper-wide`."""
    best, wide = PRESETS["best"](), PRESETS["paper-wide"]()
    assert (best.learner.kind, [phase.frames for phase in best.phases]) == ("best", [54_000, 27_000])
    phases = [phase.replaced(frames=like.frames) for phase, like in zip(best.phases, wide.phases, strict=True)]
    assert best.replaced(name=wide.name, learner=wide.learner, phases=phases) == wide


def test_all_controls_of_a_seed_see_the_same_arm(run_control: Callable[[str], Run], run_short: RunShort) -> None:
    """Each runs, and moves the arm, and commands it, as the experiment itself does: open loop."""
    expected = arms(run_short())
    for name in CONTROLS:
        run = run_control(name)
        assert np.array_equal(arms(run), expected), name
        assert [int(n) for n in np.bincount(run.frames(["phase"])["phase"].to_numpy())] == [200, 100]


def changed(a: dict[str, Any], b: dict[str, Any]) -> set[str]:
    return {part for part, key in PARTS.items() if not np.array_equal(a[part][key], b[part][key])}


PARTS = {"arm_map": "codebook", "head_map": "codebook", "links": "link_weight"}


@pytest.mark.parametrize("name", ["frozen", "sampled"])
def test_frozen_maps_never_change_and_links_do(name: str, run_control: Callable[[str], Run], short: Short) -> None:
    """From the first frame to the last, in both phases."""
    with Session(control(name, short())) as session:
        start = session.learner.state()
    first, second = ends(run_control(name))
    assert changed(start, first) == changed(first, second) == {"links"}


@pytest.mark.parametrize(
    ("name", "learns"),
    [("stopped", set()), ("links-only", {"links"}), ("maps-only", {"arm_map", "head_map"}), ("shuffled", {"links"})],
)
def test_what_changes_after_the_first_phase(
    name: str, learns: set[str], run_control: Callable[[str], Run], run_short: RunShort
) -> None:
    """The first phase is that of the experiment; in the second only what the control names changes."""
    first, second = ends(run_control(name))
    assert changed(first, second) == learns
    assert not changed(first, ends(run_short())[0])


def test_shuffled_is_judged_intact_for_three_windows(short: Short) -> None:
    """Its second phase has no damage, nothing plastic and 3 windows; what came after the first phase is left away."""
    intact, after = CONTROLS["shuffled"](short()).phases
    assert intact == short().phases[0]
    assert (after.frames, after.damage) == (3 * WINDOW, "none")
    assert done(after) == [{"kind": "shuffled"}, {"kind": "plastic", "parts": ()}]


def done(phase: Phase) -> list[dict[str, Any]]:
    """What is done in a phase, as tables."""
    return [INTERVENTIONS.dumped(settings) for settings in phase.interventions]


def test_scratch_knows_nothing_after_the_first_phase(run_control: Callable[[str], Run], short: Short) -> None:
    """Later phases begin afresh, with all parts plastic and the damage of the experiment."""
    first, *later = CONTROLS["scratch"](short()).phases
    assert first == short().phases[0]
    assert [(done(p), p.frames) for p in later] == [
        ([{"kind": "afresh"}, *done(p)], p.frames) for p in short().phases[1:]
    ]
    one, two = ends(run_control("scratch"))
    assert changed(one, two) == set(PARTS)
    assert np.abs(one["arm_map"]["codebook"] - two["arm_map"]["codebook"]).mean() > 0.1


#: Settings of the learner that a control changes.
OF_THE_LEARNER = {"sampled": {"arm_codes"}, "delta": {"rule", "link_rate", "centring"}}


def test_a_control_keeps_the_settings_of_the_experiment(short: Short) -> None:
    """Map sizes, rates, seed and phases stay; only what makes it the control differs."""
    experiment = short(seed=9)
    for name, make in CONTROLS.items():
        made = make(experiment)
        assert (made.seed, made.body, made.babbling, made.phases[0].frames) == (
            9,
            experiment.body,
            experiment.babbling,
            200,
        )
        if made.learner.kind == "hebbian":
            before, after = vars(experiment.learner), vars(made.learner)
            assert {key for key in before if before[key] != after[key]} == OF_THE_LEARNER.get(name, set())


@pytest.mark.parametrize("name", ["random", "fixed", "nearest", "sampled", "delta"])
def test_a_control_with_another_learner_runs_whatever_parts_the_phases_name(name: str, short: Short) -> None:
    """What a phase says of the parts of the experiment's learner does not stop a control that has none of them."""
    phases = [{"name": "a", "plastic": ["links"]}, {"name": "b", "start": "shuffled", "plastic": ["arm_map"]}]
    with Session(CONTROLS[name](short(phases=phases))) as session:
        next(session)


@pytest.mark.parametrize("name", CONTROLS)
def test_a_control_keeps_the_damage_of_the_experiment(name: str, short: Short) -> None:
    """Interventions on the body or the senses stay in every phase that stays, in their order, own ones too."""
    offsets = [{"kind": "offset", "offset": [0.1 * k, 0, 0, 0]} for k in (1, 2)]
    phases = [{"name": "a"}, {"name": "b", "plastic": ["links"], "interventions": offsets}]
    made = CONTROLS[name](short(phases=phases))
    kept = [[settings for settings in p.interventions if stands_for("damage", settings.kind)] for p in made.phases]
    assert kept[0] == []
    if name != "shuffled":
        assert kept[1] == [INTERVENTIONS.validated(offset) for offset in offsets]
