"""Studies from TOML."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from somatopy.experiment import DescriptionError, paper
from somatopy.experiment.changes import changed
from somatopy.studies import Study, load_plan, planned
from somatopy.studies.reading import KEYS, space_of


def names(study: Study) -> list[str]:
    return [condition.name for condition in study.conditions]


def read(folder: Path, text: str) -> Study:
    (folder / "file.toml").write_text(text, encoding="utf-8")
    return planned(load_plan(folder / "file.toml"))


def test_the_least_study() -> None:
    """The paper with the geometric eye, under seed 0."""
    study = planned({})
    assert names(study) == ["all"] and study.conditions[0].seeds == (0,)
    assert study.conditions[0].experiment == changed(paper(), {"eye": "geometric"})
    assert (study.name, study.ceilings, study.keep_frames) == ("study", True, False)


def test_conditions_cross_grid_and_sweep(tmp_path: Path) -> None:
    """Each with its seeds and with what all have in common; factors say what a condition is."""
    study = read(
        tmp_path,
        """
        seed = 5
        seeds = 2
        ceilings = false
        ceiling_every = 3
        [every]
        minutes = 1
        eye = "fiducial"
        [every.babbling]
        speed = 0.5
        [[conditions]]
        name = "small"
        seeds = [7]
        learner.arm_map.shape = [8, 8]
        [[conditions]]
        name = "slow"
        seed = 1
        [conditions.babbling]
        speed = 0.25
        [grid]
        damage = ["none", "paper"]
        [sweep]
        draws = 2
        learner.link_rate = {low = 0.01, high = 0.02}
        """,
    )
    assert study.name == "file" and len(study.conditions) == 8 and not study.ceilings
    assert {cell.every for cell in study.cells()} == {3}
    by_name = {condition.name: condition for condition in study.conditions}
    small, slow = study.conditions[0], study.conditions[-1]
    rate = small.factors["learner.link_rate"]
    assert small.name == f"small, draw 0, link_rate {rate:.4g}, damage none" and small.seeds == (7,)
    assert slow.seeds == (1, 2) and slow.name.startswith("slow, draw 1, ") and slow.name.endswith("damage paper")
    assert small.experiment.learner.arm_map.shape == (8, 8) and small.experiment.babbling.speed == 0.5
    assert slow.experiment.babbling.speed == 0.25 and slow.factors["babbling.speed"] == 0.25
    assert {one.experiment.phases[0].frames for one in by_name.values()} == {900}
    assert {one.experiment.eye.kind for one in by_name.values()} == {"fiducial"}
    assert 0.01 <= rate <= 0.02 and small.experiment.learner.link_rate == rate


def test_what_all_have_in_common_may_be_of_another_learner(tmp_path: Path) -> None:
    """Settings of one learner stand in `every`; conditions with another learner do without them."""
    study = read(tmp_path, "[every]\nlearner.arm_map.shape = [8, 8]\n[grid]\nlearner = ['hebbian', 'random']")
    assert names(study) == ["learner hebbian", "learner random"]
    assert study.conditions[0].experiment.learner.arm_map.shape == (8, 8)


def test_points_of_a_grid_have_names_of_their_own() -> None:
    """Tables of one kind, numbers that are nearly alike, lists."""
    grid = {
        "learner": [{"kind": "hebbian"}, {"kind": "hebbian", "link_rate": 0.1}],
        "babbling": {"speed": [0.10001, 0.10002]},
    }
    assert names(planned({"grid": grid}))[2] == "learner hebbian link_rate 0.1, speed 0.10001"
    assert names(planned({"grid": {"learner.arm_map.shape": [[8, 8], [4, 2]]}})) == ["shape 8x8", "shape 4x2"]
    rates = {"learner.arm_map.learning_rate": [0.1], "learner.head_map.learning_rate": [0.2]}
    (name,) = names(planned({"grid": rates}))
    assert name == "learner.arm_map.learning_rate 0.1, learner.head_map.learning_rate 0.2"
    assert names(planned({"grid": {"control": ["none", "frozen"]}})) == ["control none", "control frozen"]


def test_a_description_file_beside_the_study_is_a_base(tmp_path: Path) -> None:
    """Named from where the study stands; a preset is one, too."""
    (tmp_path / "base.toml").write_text("seed = 3\n[[phases]]\nname = 'one'\nframes = 10\n", encoding="utf-8")
    study = read(tmp_path, "base = 'base.toml'")
    assert study.conditions[0].experiment.frames == 10
    frozen = planned({"preset": "paper-frozen"}).conditions[0].experiment
    assert frozen.replaced(name="paper") == changed(paper(), {"eye": "geometric", "control": "frozen"})


def test_draws_are_the_same_each_time_and_others_for_another_seed() -> None:
    """Values may come twice; each draw has its number."""

    def drawn(seed: int) -> list[Any]:
        sweep = {
            "draws": 6,
            "seed": seed,
            "damage": ["none", "paper"],
            "phases": {"0": {"frames": {"low": 1, "high": 2}}},
        }
        return [condition.factors for condition in planned({"sweep": sweep}).conditions]

    assert drawn(0) == drawn(0) != drawn(1)
    assert {one["phases.0.frames"] for one in drawn(0)} == {1, 2}


@pytest.mark.parametrize(("key", "low"), [("phases.0.frames", 1), ("babbling.speed", 1.0)])
def test_logarithmic_draws(key: str, low: float) -> None:
    """Half of them lie under the geometric mean, also where bounds and draws are whole numbers."""
    study = planned({"sweep": {"draws": 40, key: {"low": low, "high": 10_000 * low, "log": True}}})
    drawn = np.array([condition.factors[key] for condition in study.conditions])
    assert drawn.min() >= 1 and drawn.max() <= 10_000 and 8 <= (drawn < 100).sum() <= 32
    assert {type(condition.factors[key]) for condition in study.conditions} == {type(low)}


DRAWS = {"draws": 2}


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({"sedes": 3}, f"A study has no key 'sedes'; its keys: {', '.join(KEYS)} (did you mean seeds?)."),
        ({"seeds": 0}, "seeds = 0 must be how many seeds there are, such as 5, or a list of different ones"),
        ({"seed": "5"}, "seed = '5', the first seed, must be a whole number from 0 up."),
        ({"conditions": [{"name": "a", "seeds": "x"}]}, "seeds = 'x' must be how many seeds"),
        ({"conditions": [{"name": 3}]}, "Each of the conditions needs a name, a text; {'name': 3} has none."),
        ({"conditions": [{"seed": 3}]}, "Each of the conditions needs a name, a text; {'seed': 3} has none."),
        ({"conditions": []}, 'conditions must be a list of tables, such as [[conditions]] with name = "fast".'),
        ({"conditions": [{"name": "a"}] * 2}, "Conditions need names of their own; 'a' comes twice."),
        ({"grid": {"learner": "fixed"}}, "grid: learner = 'fixed' must be a list of the values to try."),
        ({"grid": {"learner": []}}, "grid: learner = [] must be a list of the values to try."),
        ({"grid": [1]}, "grid must be a table of keys, not [1]."),
        ({"grid": {"seed": [1, 2]}}, "grid has no key 'seed': write seed at the top of the study, or in one of"),
        ({"grid": {"seeds": [1, 2]}}, "grid has no key 'seeds': write seeds"),
        ({"every": {"name": "x"}}, "every has no key 'name': write name"),
        ({"sweep": {**DRAWS, "seeds": [1]}}, "sweep has no key 'seeds': write seeds"),
        ({"sweep": {**DRAWS, "seed": True, "eye": ["geometric"]}}, "sweep: seed = True must be a whole number from 0"),
        ({"name": ["a"]}, "name = ['a'] must be a text: it goes into the name of the study folder."),
        ({"name": ""}, "name = '' must be a text"),
        ({"every": 3}, "every must be a table of keys, not 3."),
        ({"every": {"lerner": "x"}}, "every: unknown key 'lerner'; valid keys there: name, seed, body, eye"),
        ({"every": {"damage": "x"}}, "every: damage = 'x' is unknown; choose none, paper or offset:a,b,c,d"),
        ({"every": {"minutes": "ten"}}, "every: Minutes must be finite and at least 0, not 'ten'."),
        ({"grid": {"damage": ["x"]}}, "The condition 'damage x': damage = 'x' is unknown; choose none, paper or"),
        ({"grid": {"babbling.sped": [1]}}, "The condition 'sped 1': unknown key 'babbling.sped'; valid keys there: "),
        ({"preset": "x"}, "preset = 'x' is unknown; choose one of paper, paper-wide, "),
        ({"preset": ["x"]}, "preset = ['x'] is unknown; choose one of paper, "),
        ({"preset": "paper", "base": "x"}, "A study begins with a preset or with a base, a description file: give one"),
        ({"ceilings": 1}, "ceilings = 1 must be true or false."),
        ({"ceiling_every": 0}, "ceiling_every = 0 must be a whole number from 1 up"),
        ({"ceiling_every": True}, "ceiling_every = True must be a whole number"),
        ({"keep_frames": "no"}, "keep_frames = 'no' must be true or false."),
        ({"sweep": {"babbling.speed": [0.1]}}, "sweep: draws = None must say how many conditions are drawn"),
        ({"sweep": DRAWS}, "sweep: name what is drawn by its key, such as babbling.speed = {low = 0.1, high = 0.8}."),
        (
            {"sweep": {**DRAWS, "seed": "x", "eye": ["geometric"]}},
            "sweep: seed = 'x' must be a whole number from 0 up.",
        ),
        (
            {"sweep": {**DRAWS, "babbling": {"speed": {"lo": 1}}}},
            "babbling.speed.lo = 1 is no distribution. Write {low",
        ),
    ],
)
def test_errors_name_key_value_and_choices(table: dict[str, Any], said: str) -> None:
    """Nothing has run then."""
    with pytest.raises(DescriptionError) as caught:
        planned(table)
    assert str(caught.value).startswith(said)


@pytest.mark.parametrize(
    "space",
    [
        *(3, "x", [], {"choices": []}, {"low": 2, "high": 1}, {"low": 1}, {"low": 0, "high": 1, "log": True}),
        *({"low": 0, "high": 1, "step": 1}, {"low": 0, "high": 1, "choices": [1]}, {"low": "a", "high": "b"}),
        *({"low": 0, "high": True}, {"low": 0.1, "high": float("inf")}, {"low": 0.1, "high": 1, "log": "yes"}),
    ],
)
def test_what_is_no_distribution(space: Any) -> None:
    """The key, the value and the ways to write one."""
    with pytest.raises(DescriptionError) as caught:
        space_of("some.key", space)
    assert str(caught.value).startswith(f"some.key = {space!r} is no distribution. Write {{low = 0.1, high = 0.8}}")


def test_files_that_are_none(tmp_path: Path) -> None:
    """Missing, no TOML, no text."""
    with pytest.raises(DescriptionError, match=r"Cannot read the study .*none.toml: No such file"):
        load_plan(tmp_path / "none.toml")
    for content, why in ((b"seeds =", "is not valid TOML: "), (b"\xff", "is not in UTF-8 .*Save it as UTF-8")):
        (tmp_path / "bad.toml").write_bytes(content)
        with pytest.raises(DescriptionError, match=f"The study .*bad.toml {why}"):
            load_plan(tmp_path / "bad.toml")
