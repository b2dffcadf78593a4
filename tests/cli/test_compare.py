"""somatopy compare: learners x damages x seeds, from flags. What is planned is looked at; nothing runs."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from tests.robots import Shape, joints, write_robot

from somatopy.cli import main
from somatopy.experiment import Description
from somatopy.experiment.context import Context
from somatopy.interventions import SUITE
from somatopy.registry import INTERVENTIONS
from somatopy.studies import Study

Planned = Callable[..., Study]


@pytest.fixture
def planned(monkeypatch: pytest.MonkeyPatch) -> Planned:
    """The study that flags lead to."""
    seen: list[Any] = []

    def carry_out(study: Study, flags: Any) -> int:
        seen.append((study, flags))
        return 0

    monkeypatch.setattr("somatopy.cli.compare.carry_out", carry_out)

    def plan(*args: str) -> Study:
        assert main(["compare", *args]) == 0
        return seen[-1][0]

    return plan


def test_every_learner_with_every_damage_under_every_seed(planned: Planned) -> None:
    """Seeds are counted from --seed; learners of one seed meet the same movement."""
    study = planned("--learners", "hebbian, frozen,nearest", "--damages", "none,paper", "--seed", "5", "--seeds", "2")
    learners, damages = ("hebbian", "frozen", "nearest"), ("none", "paper")
    assert [c.factors for c in study.conditions] == [{"learner": a, "damage": b} for a in learners for b in damages]
    assert {condition.seeds for condition in study.conditions} == {(5, 6)}
    assert {condition.experiment.eye.kind for condition in study.conditions} == {"geometric"}
    cells = study.cells()
    assert len(cells) == 12 and len({cell.key for cell in cells}) == 12
    assert len({cell.movement for cell in cells}) == 2 and len({cell.trunk for cell in cells}) == 6


def test_defaults(planned: Planned) -> None:
    """Five seeds from 0; the paper's times; the paper's learner and two controls."""
    study = planned()
    assert {condition.factors["learner"] for condition in study.conditions} == {"hebbian", "random", "fixed"}
    assert {condition.seeds for condition in study.conditions} == {(0, 1, 2, 3, 4)}
    assert [phase.frames for phase in study.conditions[0].experiment.phases] == [177_823, 96_049]


@pytest.mark.parametrize(
    ("flags", "frames"),
    [
        (("--minutes", "3"), [1753, 947]),
        (("--minutes", "2", "--damage-minutes", "3"), [1800, 2700]),
        (("--damage-minutes", "3"), [177_823, 2700]),
        (("--minutes", "3", "--phases.1.frames", "70"), [1753, 70]),
        (("--minutes", "3", "--phases.0.frames", "70"), [70, 947]),
    ],
)
def test_minutes(flags: tuple[str, ...], frames: list[int], planned: Planned) -> None:
    """Alone they are those of both phases, in the paper's proportion; dotted flags win."""
    for condition in planned("--learners", "hebbian", *flags).conditions:
        assert [phase.frames for phase in condition.experiment.phases] == frames


def test_all_damages_are_one_of_each_and_may_be_undone(planned: Planned) -> None:
    """Each name of the suite once, with its settings, beside others; a last phase is as long as it was said."""
    study = planned(
        "--learners",
        "hebbian",
        "--damages",
        "none,all",
        "--minutes",
        "2",
        "--damage-minutes",
        "1",
        "--healed-minutes",
        "3",
    )
    assert [condition.factors["damage"] for condition in study.conditions] == ["none", *SUITE]
    for condition in study.conditions[1:]:
        phases = condition.experiment.phases
        assert [(phase.frames, len(phase.interventions)) for phase in phases] == [(1800, 0), (900, 1), (2700, 0)]
        assert SUITE[condition.factors["damage"]].items() <= INTERVENTIONS.dumped(phases[1].interventions[0]).items()
    single = planned("--learners", "hebbian", "--damages", "offset-1.7").conditions[0].experiment
    assert single.phases[1].interventions == study.conditions[3].experiment.phases[1].interventions


@pytest.mark.parametrize("count", [1, 2])
def test_all_leaves_out_what_an_arm_has_too_few_joints_for(
    count: int, planned: Planned, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """That is what cannot be built for it. Which is said, also if quiet; what is named by itself is refused."""
    model = write_robot(tmp_path, Shape(joints("yz"[:count]), joints("z")))
    robot = ("--learners", "fixed", "--body.model", str(model))
    study = planned(*robot, "--damages", "none,all", "--quiet")
    said = capsys.readouterr().err
    too_few = unbuildable(study.conditions[0].experiment)
    assert [c.factors["damage"] for c in study.conditions] == ["none", *(name for name in SUITE if name not in too_few)]
    assert [name for name in SUITE if f" {name} (needs " in said] == too_few
    assert main(["compare", *robot, "--damages", f"all,{too_few[0]}"]) == 2
    assert f"--damages {too_few[0]} needs an arm with " in capsys.readouterr().err


def unbuildable(experiment: Description) -> list[str]:
    """Damages of the suite that refuse the robot of an experiment."""
    found = []
    with closing(experiment.body.build(Context(experiment))) as body:
        for name, table in SUITE.items():
            try:
                INTERVENTIONS.validated(table).build(Context(experiment, body))
            except ValueError:
                found.append(name)
    return found


@pytest.mark.parametrize("separator", [",", ";", ", "])
def test_numbers_of_an_offset_belong_to_it(separator: str, planned: Planned) -> None:
    """Whatever separates damages, and however numbers are written."""
    words = separator.join(["none", "offset:0.1,-2e-3,+.3,1E2", "shuffled", "offset:1,2,3,4"])
    study = planned("--learners", "hebbian", "--damages", words)
    done = [condition.experiment.phases[1].interventions for condition in study.conditions]
    assert [[each.kind for each in phase] for phase in done] == [[], ["offset"], ["shuffled"], ["offset"]]
    assert done[1][0].offset == (0.1, -0.002, 0.3, 100.0) and done[3][0].offset == (1, 2, 3, 4)


def test_settings_are_those_of_all_who_have_them(planned: Planned) -> None:
    """Other learners begin with their own."""
    study = planned("--learners", "hebbian,random", "--learner.arm-map.shape", "8", "8", "--eye", "fiducial")
    assert study.conditions[0].experiment.learner.arm_map.shape == (8, 8)
    assert study.conditions[-1].experiment.learner.kind == "random"
    assert {condition.experiment.eye.kind for condition in study.conditions} == {"fiducial"}


@pytest.mark.parametrize(
    ("flags", "said"),
    [
        (("--learner", "fixed"), "--learner chooses one; compare takes several: --learners fixed,..."),
        (("--damage", "none"), "--damage chooses one; compare takes several: --damages none,..."),
        (("--learners", "hebian"), "The learner 'hebian' is unknown; choose kinds of learners (hebbian, best, random"),
        (("--damages", "papr"), "--damages 'papr' is unknown; choose none, paper or offset:a,b,c,d"),
        (("--seeds", "0"), "seeds = 0 must be how many seeds there are, such as 5"),
        (("--learners", ""), "The study 'compare' has no conditions: give it at least one."),
        (
            ("--learners", "fixed,fixed"),
            "Conditions need names of their own; 'fixed, none', 'fixed, paper' comes twice",
        ),
        (("--lerners", "x"), "Unknown option --lerners. Did you mean --learners?"),
    ],
)
def test_wrong_use(flags: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Exit 2, and one sentence."""
    assert main(["compare", *flags]) == 2
    assert capsys.readouterr().err.startswith(f"somatopy: {said}")


def test_a_dry_run_runs_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    """It says what would be needed."""
    small = ("--learner.arm-map.shape", "5", "5", "--learner.head-map.shape", "5", "5", "--motion", "kinematic")
    times = ("--minutes", "1", "--damage-minutes", "0.5")
    assert main(["compare", "--learners", "hebbian", "--seeds", "2", *small, *times, "--dry-run"]) == 0
    said = dict(line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines())
    # A seed's first phase counts once for both of its cells.
    assert said["cells"] == "4" and said["frames"] == f"{2 * (900 + 2 * 450):,}" and {"memory", "disk"} <= {*said}


def test_help_shows_what_it_takes(capsys: pytest.CaptureFixture[str]) -> None:
    """Where several learners and damages are named; a study folder."""
    assert main(["compare", "--help"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "--learners A,B" in said and "--damages A,B" in said and "--learner " not in said and "--damage " not in said
    assert "The study folder." in said
