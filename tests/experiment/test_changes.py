"""Changes by short words and dotted keys."""

from __future__ import annotations

from typing import Any

import pytest

from somatopy.experiment import DescriptionError, paper
from somatopy.experiment.changes import changed, damage_named
from somatopy.experiment.presets import CONTROLS


def test_nothing_changes_nothing() -> None:
    """Neither no words, nor words without a value, nor what is there already."""
    one = paper()
    assert changed(one, {}) == one
    assert changed(one, {"eye": None, "damage_minutes": None}) == one
    assert changed(one, {"learner": "hebbian", "babbling.speed": one.babbling.speed, "damage": "paper"}) == one


def test_words_are_for_what_they_stand_for() -> None:
    """Each short word agrees with the dotted keys behind it, with _ or - in it."""
    by_words = changed(paper(), {"motion": "kinematic", "eye": "geometric", "minutes": 2, "damage-minutes": 1})
    by_keys = changed(
        paper(), {"body.motion": "kinematic", "eye.kind": "geometric", "phases.0.frames": 1800, "phases.1.frames": 900}
    )
    assert by_words == by_keys


def test_dotted_keys_come_after_short_words() -> None:
    """Whatever the order in which they are written, and tables before what stands in them."""
    changes = {"phases.0.frames": 7, "learner.arm_map.shape": [3, 3], "minutes": 2, "learner": "hebbian"}
    for order in (changes, dict(reversed(changes.items()))):
        found = changed(paper(), order)
        assert found.phases[0].frames == 7 and found.learner.arm_map.shape == (3, 3)
    assert changed(paper(), {"babbling.speed": 0.5, "babbling": {"kind": "uniform"}}).babbling.speed == 0.5


def test_the_name_of_a_kind_keeps_its_settings_and_another_begins_anew() -> None:
    """For parts in parts, too."""
    slow = changed(paper(), {"learner.arm_map.shape": [4, 4]})
    assert changed(slow, {"learner": "hebbian"}) == slow
    assert changed(changed(slow, {"learner": "random"}), {"learner": "hebbian"}).learner.arm_map.shape == (30, 30)
    assert changed(slow, {"learner.arm_map": "som"}).learner.arm_map.shape == (30, 30)
    assert changed(slow, {"learner.arm_map.kind": "dsom"}) == slow


def test_entries_of_lists_are_set() -> None:
    """Counted from 0, of lists and of what the description keeps as tuples."""
    found = changed(paper(), {"learner.arm_map.shape.1": 5, "phases.1.trend_breaks.0": 3})
    assert found.learner.arm_map.shape == (30, 5) and found.phases[1].trend_breaks == (3,)
    place = "phases.1.interventions.0.offset"
    shifted = changed(paper(), {place: (0.1265, 1.1411, 1.2295, -0.2242)})
    offset = changed(shifted, {f"{place}.2": 0.5}).phases[1].interventions[0].offset
    assert offset == (0.1265, 1.1411, 0.5, -0.2242)


def test_damage_makes_a_second_phase_where_there_is_none() -> None:
    """Empty until minutes are said."""
    one = paper().replaced(phases=paper().phases[:1])
    found = changed(one, {"damage": "offset:0.1,0.2,0.3,0.4", "damage_minutes": 1})
    assert found.phases[0] == one.phases[0] and found.phases[1].frames == 900
    assert found.phases[1].interventions[0].offset == (0.1, 0.2, 0.3, 0.4)


@pytest.mark.parametrize("control", CONTROLS)
def test_controls_come_last(control: str) -> None:
    """What a control is made of has the other changes already."""
    quick = {"minutes": 1, "damage_minutes": 1}
    assert changed(paper(), {"control": control, **quick}) == CONTROLS[control](changed(paper(), quick))
    assert changed(paper(), {"control": "none"}) == paper()


def test_damages_by_table() -> None:
    """A whole table, also that of none."""
    assert damage_named({"kind": "none"}, "") is None
    assert damage_named({"kind": "offset", "offset": [1]}, "") == {"kind": "offset", "offset": [1]}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"lerner": "fixed"}, "S: unknown key 'lerner'; valid keys there: name, seed, body, eye, babbling, learner"),
        ({"babling.speed": 1}, "'babling.speed': 'babling' is no table of this experiment; keys there: name, seed, "),
        ({"seed.x": 1}, "'seed.x': 'seed' is no table of this experiment; keys there: name, seed, "),
        ({"babbling.sped": 1}, "S: unknown key 'babbling.sped'; valid keys there: kind, range, speed"),
        ({"babbling.speed": -1}, "S: babbling.speed = -1: must be greater than 0"),
        ({"phases.9.frames": 1}, "'phases.9.frames': there is no entry '9'; there are 2, counted from 0."),
        ({"phases.last.frames": 1}, "'phases.last.frames': there is no entry 'last'; there are 2, counted from 0."),
        ({"phases.1.start": "x"}, "phases.1.start = 'x' is unknown; choose one of continue, "),
        ({"minutes": "ten"}, "Minutes must be finite and at least 0, not 'ten'."),
        ({"minutes": True}, "Minutes must be finite and at least 0, not True."),
        ({"damage_minutes": -1}, "Minutes must be finite and at least 0, not -1."),
        ({"damage": "nothing"}, "damage = 'nothing' is unknown; choose none, paper or offset:a,b,c,d"),
        ({"damage": "offset:1,b"}, "damage = 'offset:1,b': could not convert string to float: 'b'. Write numbers, rad"),
        ({"phases.1.damage": "x"}, "phases.1.damage 'x' is unknown; choose none, paper or offset:a,b,c,d"),
        ({"learner": "x"}, "S: learner.kind = 'x' is unknown; choose one of hebbian, best, random, fixed, nearest, or"),
        ({"motion": "x"}, "S: body.motion = 'x': must be 'dynamic' or 'kinematic'"),
        ({"control": "x"}, "control = 'x' is unknown; choose none or one of random, fixed, "),
        ({"control": ["random"]}, "control = ['random'] is unknown; choose none or one of random, fixed, "),
        (
            {"phases.1.interventions": [{"x": 1}], "phases.1.plastic": "links"},
            "S: phases.1.interventions.1 lacks its kind; choose one of offset, ",
        ),
    ],
)
def test_errors_name_key_value_and_choices(changes: dict[str, Any], said: str) -> None:
    """And come as what the user can mend."""
    with pytest.raises(DescriptionError) as caught:
        changed(paper(), changes, "S")
    assert str(caught.value).startswith(said)


def test_a_kind_is_chosen_before_its_settings() -> None:
    """Also where a setting comes first in the alphabet, as "head" does before "kind"."""
    found: Any = changed(paper(), {"learner.head": [0.1, 0.2], "learner.kind": "fixed"}).learner
    assert (found.kind, found.head) == ("fixed", (0.1, 0.2))


def test_keys_that_are_joined_have_one_value() -> None:
    """As if each stood alone, short words among them; a wrong one is named by itself."""
    both = "learner.arm_map.elasticity + learner.head_map.elasticity"
    apart = {"learner.arm_map.elasticity": 0.7, "learner.head_map.elasticity": 0.7}
    assert changed(paper(), {both: 0.7}) == changed(paper(), apart) != paper()
    assert changed(paper(), {"minutes+damage-minutes": 3}) == changed(paper(), {"minutes": 3, "damage_minutes": 3})
    with pytest.raises(DescriptionError, match="elasticty"):
        changed(paper(), {"learner.arm_map.elasticity+learner.head_map.elasticty": 0.7})
