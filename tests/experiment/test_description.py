"""Descriptions: TOML in and out, and errors that name the key, the value and the valid choices."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import FrozenInstanceError
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from somatopy.analysis.runs import Run
from somatopy.experiment import Description, DescriptionError, Phase, Session, frames_of, load_description, paper
from somatopy.experiment.description import SHORT_FORMS, validated
from somatopy.registry import INTERVENTIONS

RunShort = Callable[..., Run]
SHORT = frozenset(SHORT_FORMS)

DAMAGES = st.one_of(
    st.just({"kind": "none"}),
    st.lists(st.floats(-3, 3), min_size=1, max_size=7).map(lambda offset: {"kind": "offset", "offset": offset}),
)
MAPS = st.fixed_dictionaries(
    {},
    optional={
        "shape": st.tuples(st.integers(1, 50), st.integers(1, 50)).map(list),
        "learning_rate": st.floats(1e-6, 1),
        "elasticity": st.floats(1e-3, 10),
    },
)
LEARNERS = st.one_of(
    st.sampled_from([{"kind": "random"}, {"kind": "nearest"}, {"kind": "fixed"}]),
    st.lists(st.floats(-2, 2), min_size=2, max_size=2).map(lambda head: {"kind": "fixed", "head": head}),
    st.fixed_dictionaries({"kind": st.just("hebbian")}, optional={"arm_map": MAPS, "head_map": MAPS}),
    st.just({"kind": "hebbian", "arm_codes": "sampled"}),
)
TABLES = st.fixed_dictionaries(
    {},
    optional={
        "name": st.from_regex(r"[A-Za-z0-9._-]{1,20}", fullmatch=True),
        "seed": st.integers(0, 2**62),
        "body": st.fixed_dictionaries({}, optional={"head_speed": st.floats(0.1, 9), "motion": st.just("kinematic")}),
        "babbling": st.fixed_dictionaries({}, optional={"range": st.just([[-1.0, 1.0]] * 4), "speed": st.just(0.3)}),
        "learner": LEARNERS,
        "phases": st.lists(
            st.fixed_dictionaries(
                {"name": st.uuids().map(str), "frames": st.integers(0, 10**6), "damage": DAMAGES},
                optional={
                    "plastic": st.lists(st.sampled_from(["arm_map", "head_map", "links"]), max_size=3),
                    "start": st.sampled_from(["continue", "afresh", "shuffled"]),
                },
            ),
            min_size=1,
            max_size=4,
        ),
    },
)


@given(TABLES)
def test_toml_there_and_back(table: dict[str, Any]) -> None:
    """Any description, written as JSON-like data and read again, is equal."""
    description = validated(table, "table")
    assert validated(json.loads(description.model_dump_json()), "again") == description


@given(TABLES)
def test_a_file_reads_as_its_table(table: dict[str, Any]) -> None:
    """What load_description reads is what the table says."""
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "experiment.toml"
        path.write_text(tomli_w.dumps(table), encoding="utf-8")
        assert load_description(path) == validated(table, "table")


@pytest.mark.parametrize(
    "tables",
    [
        {},
        {"learner": {"kind": "random"}},
        {"learner": {"kind": "nearest"}, "eye": {"kind": "geometric"}},
        {"learner": {"kind": "hebbian", "arm_codes": "sampled", "arm_map": {"shape": [3, 3]}}},
        {
            "phases": [
                {"plastic": [], "frames": 2},
                {"name": "b", "plastic": ["links"], "start": "shuffled", "frames": 1},
            ]
        },
        {"learner": {"kind": "fixed", "head": [0.5, 0.25]}, "body": {"motion": "kinematic", "head_speed": 2.5}},
        {"babbling": {"range": [[-0.5, 1.1], [0.0, 1.25], [-0.65, 0.9], [-1.54, -0.08]], "speed": 0.3}},
    ],
)
def test_the_experiment_file_of_a_run_is_a_description(
    run_short: RunShort, short: Callable[..., Description], tables: dict[str, Any]
) -> None:
    """experiment.toml, with versions and citations in it, loads and is equal to what was run."""
    phases = [{"name": "a", "frames": 2}, {"name": "b", "frames": 1, "damage": {"kind": "offset"}}]
    tables = {"phases": phases, **tables}
    run = run_short(**tables)
    assert load_description(run.path / "experiment.toml") == short(**tables)
    assert {"versions", "cite"} <= run.description.keys()


def test_empty_means_the_defaults() -> None:
    """No key is required."""
    assert validated({}, "nothing") == Description()


def test_it_is_frozen() -> None:
    """No part of a description can be changed."""
    description = paper()
    for part, name in (
        *((description, "seed"), (description.body, "motion"), (description.body.camera, "fovy")),
        *((description.learner.arm_map, "shape"), (description.phases[0], "frames")),
    ):
        before = getattr(part, name)
        with pytest.raises((ValidationError, FrozenInstanceError)):
            setattr(part, name, 1)
        assert getattr(part, name) == before


LEARNER_KEYS = "kind, arm_map, head_map, rule, link_rate, activation_slope, units, centring, ties, arm_codes"
MAP_KEYS = "kind, shape, learning_rate, elasticity, preset, lattice, periodic"
PHASE_KEYS = "name, frames, interventions, trend_breaks, start, plastic, damage"


@pytest.mark.parametrize(
    ("table", "key", "valid"),
    [
        ({"sed": 1}, "sed", "name, seed, body, eye, babbling, learner, phases"),
        ({"body": {"model": "nao", "speed": 1}}, "body.speed", "kind, model, motion, head_speed, camera, marker"),
        ({"babbling": {"sped": 1}}, "babbling.sped", "kind, range, speed"),
        ({"learner": {"kind": "hebbian", "rate": 1}}, "learner.rate", LEARNER_KEYS),
        ({"learner": {"kind": "hebbian", "head_map": {"eta": 1}}}, "learner.head_map.eta", MAP_KEYS),
        ({"learner": {"kind": "random", "head": [0, 0]}}, "learner.head", "kind"),
        ({"learner": {"kind": "fixed", "arm_map": {}}}, "learner.arm_map", "kind, head"),
        ({"phases": [{}, {"minutes": 3}]}, "phases.1.minutes", PHASE_KEYS),
        ({"phases": [{"damage": {"kind": "offset", "ofset": []}}]}, "phases.0.damage.ofset", "kind, offset"),
        (
            {"phases": [{"interventions": [{"kind": "plastic", "part": 1}]}]},
            "phases.0.interventions.0.part",
            "kind, parts",
        ),
        ({"body": {"camera": {"fow": 3}}}, "body.camera.fow", "fovy"),
    ],
)
def test_an_unknown_key_lists_the_valid_ones_of_its_place(table: dict[str, Any], key: str, valid: str) -> None:
    """Nested, inside unions and inside phases, with the key as a file writes it, and nothing else in the message."""
    with pytest.raises(DescriptionError) as caught:
        validated(table, "my.toml")
    said, near, _ = str(caught.value).partition(" (did you mean ")
    assert said == f"my.toml: unknown key {key!r}; valid keys there: {valid}" + "." * (not near)


@pytest.mark.parametrize(
    ("table", "parts"),
    [
        ({"seed": -1}, ["seed = -1", "greater than or equal to 0"]),
        ({"seed": 1.5}, ["seed = 1.5", "integer"]),
        ({"seed": 2**63}, [f"seed = {2**63}", "less than"]),
        ({"phases": [{"frames": 10**19}]}, ["phases.0.frames = 1", "less than or equal to 1000000000000"]),
        ({"seed": "x"}, ["seed = 'x'", "whole number"]),
        ({"seed": "0"}, ["seed = '0': must be a whole number, not text."]),
        ({"seed": True}, ["seed = True: must be a whole number, not true or false."]),
        ({"phases": [{"frames": "9"}]}, ["phases.0.frames = '9'", "not text"]),
        ({"phases": [{"trend_breaks": [True]}]}, ["phases.0.trend_breaks.0 = True", "not true or false"]),
        ({"body": {"marker": {"size": "0.05"}}}, ["body.marker.size = '0.05'", "not text"]),
        ({"babbling": {"range": [["0", 1]]}}, ["babbling.range.0.0 = '0'", "not text"]),
        (
            {"learner": {"kind": "hebbian", "arm_map": {"shape": [True, "5"]}}},
            ["learner.arm_map.shape.0 = True", "learner.arm_map.shape.1 = '5'"],
        ),
        (
            {"phases": [{"damage": {"kind": "dead-joint", "joint": True}}]},
            ["phases.0.damage.joint = True: must be a whole number or text, not true or false"],
        ),
        ({"phases": [{"damage": {"kind": "offset", "offset": ["1"]}}]}, ["phases.0.damage.offset.0 = '1'"]),
        ({"name": "a b/c"}, ["name = 'a b/c': must hold only", "A to Z, a to z, digits"]),
        ({"body": 3}, ["body = 3: must be a table with its kind", "choose one of mujoco"]),
        ({"body": "nao"}, ["body.kind = 'nao' is unknown", "choose one of mujoco", "my_package.my_file:MyBody"]),
        ({"body": {"motion": "fast"}}, ["body.motion = 'fast'", "'dynamic' or 'kinematic'"]),
        ({"body": {"head_speed": 0}}, ["body.head_speed = 0", "greater than 0"]),
        ({"babbling": {"speed": float("inf")}}, ["babbling.speed = inf", "finite"]),
        ({"babbling": {"range": 3}}, ["babbling.range = 3", "must be a list"]),
        ({"babbling": {"range": [[0, 1], [float("nan"), 1]]}}, ["babbling.range.1.0 = nan", "finite"]),
        ({"babbling": {"range": [[0, 1], [1]]}}, ["babbling.range.1.1", "a value is missing"]),
        ({"learner": {"kind": "clever"}}, ["learner.kind = 'clever'", "hebbian, best, random, fixed, nearest"]),
        ({"learner": {}}, ["learner lacks its kind", "hebbian, best, random, fixed, nearest"]),
        ({"learner": {"kind": "hebbian", "arm_codes": "far"}}, ["learner.arm_codes = 'far'", "'uniform' or 'sampled'"]),
        ({"phases": [{"start": "again"}]}, ["phases.0.start = 'again'", "continue, afresh, shuffled"]),
        ({"phases": [{"plastic": "links"}]}, ["phases.0.plastic = 'links'", "must be a list"]),
        ({"phases": [{"plastic": [3]}]}, ["phases.0.plastic.0 = 3", "string"]),
        ({"phases": [{"interventions": {"kind": "offset"}}]}, ["phases.0.interventions", "must be a list"]),
        (
            {"phases": [{"interventions": [{"offset": [1]}]}]},
            ["phases.0.interventions.0 lacks its kind", "offset, random-offset"],
        ),
        (
            {"phases": [{"damage": {"kind": "none", "offset": []}}]},
            ["phases.0.damage", "none has no keys", "leave them out"],
        ),
        ({"eye": {"skip": 3}}, ["eye lacks its kind", "fiducial, geometric"]),
        ({"learner": {"kind": "hebbian", "link_rate": 0}}, ["learner.link_rate = 0", "greater than 0"]),
        (
            {"learner": {"kind": "hebbian", "arm_map": {"elasticity": "x"}}},
            ["learner.arm_map.elasticity = 'x'", "number"],
        ),
        ({"learner": {"kind": "hebbian", "arm_map": {"kind": "sam"}}}, ["learner.arm_map.kind = 'sam'", "dsom, som"]),
        ({"learner": {"kind": "hebbian", "rule": "anti"}}, ["learner.rule.kind = 'anti'", "positive, normalised"]),
        ({"phases": []}, ["phases", "at least one phase"]),
        ({"phases": 3}, ["phases = 3", "must be a list"]),
        ({"phases": [{"frames": -1}]}, ["phases.0.frames = -1", "greater than or equal to 0"]),
        ({"phases": [{"frames": 0.5}]}, ["phases.0.frames = 0.5", "integer"]),
        ({"phases": [{"name": "a"}, {"name": "a"}]}, ["phases", "names of their own", "['a', 'a']"]),
        ({"phases": [{"trend_breaks": [7, 3]}]}, ["phases.0.trend_breaks", "increasing", "[7, 3]"]),
        ({"phases": [{"trend_breaks": [0]}]}, ["phases.0.trend_breaks", "positive", "[0]"]),
        ({"phases": [{"damage": {"kind": "rust"}}]}, ["phases.0.damage.kind = 'rust'", "offset, random-offset"]),
        ({"phases": [{"damage": {"kind": "offset", "offset": [float("nan")]}}]}, ["phases.0.damage.offset.0 = nan"]),
    ],
)
def test_a_wrong_value_is_named_with_its_key(table: dict[str, Any], parts: list[str]) -> None:
    """Key as the file writes it, value, what would be right; one sentence, no word of the validator's machinery."""
    with pytest.raises(DescriptionError) as caught:
        validated(table, "my.toml")
    message = str(caught.value)
    assert message.startswith("my.toml: ") and message.count("my.toml") == 1
    assert all(part in message for part in parts), message
    assert not any(word in message for word in ("Value error", "tuple", "pydantic", "dataclass", "ctx", "\n"))


@pytest.mark.parametrize(
    ("arm_map", "parts"),
    [
        ({"shape": [9999, 9999]}, ["1e+07 units", "1.0e+08", "smaller"]),
        ({"shape": [0, 3]}, ["shape", "at least 1", "(0, 3)"]),
        ({"learning_rate": 2}, ["learning_rate", "over 0 and at most 1", "2.0"]),
        ({"elasticity": 0}, ["elasticity", "over 0", "0.0"]),
        ({"lattice": "round"}, ["unknown lattice 'round'", "rectangular", "hexagonal"]),
        ({"kind": "neural-gas"}, ["on a lattice", "NeuralGas is none"]),
    ],
)
def test_what_only_a_part_can_tell_is_told_when_the_session_is_built(
    short: Callable[..., Description], arm_map: dict[str, Any], parts: list[str]
) -> None:
    """Before a frame or a folder, with the key of the part."""
    with pytest.raises(DescriptionError) as caught:
        Session(short(learner={"kind": "hebbian", "arm_map": arm_map}))
    message = str(caught.value)
    assert message.startswith("learner: arm_map") and all(part in message for part in parts), message


def test_all_that_is_wrong_is_said_at_once() -> None:
    """Two mistakes, one message."""
    with pytest.raises(DescriptionError, match=r"seed = -1.*; .*unknown key 'foo'"):
        validated({"seed": -1, "foo": 2}, "my.toml")


def test_a_changed_copy_is_validated_again() -> None:
    """`replaced` changes top-level tables and refuses what a file could not say either."""
    assert paper().replaced(seed=7).seed == 7 and paper().seed == 0
    with pytest.raises(DescriptionError, match=r"The changed description: unknown key 'sed'; valid keys there: name, "):
        paper().replaced(sed=7)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"frames": -5}, r"The changed phase: frames = -5: .*greater than or equal to 0"),
        ({"minutes": 3}, r"unknown key 'minutes'; valid keys there: name, frames, interventions, .*, damage"),
        ({"trend_breaks": [7, 3]}, r"trend_breaks: .*increasing"),
        ({"damage": "rust"}, r"damage.kind = 'rust' is unknown; choose one of offset"),
        ({"damage": {"kind": "offset", "offset": [0, float("inf")]}}, r"damage.offset.1 = inf: must be finite"),
        ({"start": "again"}, r"start = 'again': choose one of continue"),
        ({"plastic": "links"}, r"plastic = 'links': must be a list"),
        ({"interventions": [{"kind": "rust"}]}, r"interventions.0.kind = 'rust' is unknown"),
    ],
)
def test_a_changed_phase_is_validated_again(changes: dict[str, Any], message: str) -> None:
    """With the key as a phase has it; the phase itself stays as it was."""
    phase, before = paper().phases[1], paper().phases[1]
    with pytest.raises(DescriptionError, match=message):
        phase.replaced(**changes)
    assert phase == before


@pytest.mark.parametrize(
    ("part", "changes", "message"),
    [
        ("body", {"motion": "fast"}, "motion.*'dynamic' or 'kinematic'"),
        ("body", {"camera": {"fovy": 0}}, "camera.fovy.*greater than 0"),
        ("babbling", {"speed": -1}, "speed.*greater than 0"),
        ("learner", {"link_rate": float("nan")}, "link_rate"),
        ("learner", {"arm_map": {"kind": "sam"}}, "arm_map.*'sam'"),
        ("learner", {"rate": 1}, "rate"),
    ],
)
def test_changed_settings_are_validated_again(part: str, changes: dict[str, Any], message: str) -> None:
    """As a DescriptionError in one sentence, which is what every caller of `replaced` gets."""
    settings = getattr(paper(), part)
    with pytest.raises(ValueError, match=message) as caught:
        settings.replaced(**changes)
    assert "\n" not in str(caught.value)


def test_changed_settings_keep_the_rest() -> None:
    """Of settings, too, all that is not named stays, and the new ones are of the same kind."""
    learner = paper().learner
    changed = learner.replaced(link_rate=0.5)
    assert (changed.link_rate, changed.kind) == (0.5, "hebbian") and changed.replaced(link_rate=0.01) == learner
    assert paper().body.replaced(camera={"fovy": 50}).camera.fovy == 50


# -- short forms of a phase --------------------------------------------------------------------------------------------

OFFSET = {"kind": "offset", "offset": [0.1, 0.2, 0.3, 0.4]}
NOISE = "somatopy.interventions.offset:JointOffset"


@pytest.mark.parametrize(
    ("table", "kinds", "damage"),
    [
        ({}, [], "none"),
        ({"damage": "none"}, [], "none"),
        ({"damage": {"kind": "none"}}, [], "none"),
        ({"damage": OFFSET}, ["offset"], "offset"),
        ({"damage": "offset"}, ["offset"], "offset"),
        ({"plastic": []}, ["plastic"], "none"),
        ({"plastic": ["links"], "damage": OFFSET}, ["plastic", "offset"], "offset"),
        ({"damage": OFFSET, "plastic": ["links"], "start": "afresh"}, ["afresh", "plastic", "offset"], "offset"),
        ({"start": "continue"}, [], "none"),
        ({"start": "shuffled", "interventions": [OFFSET]}, ["shuffled", "offset"], "offset"),
        (
            {"damage": OFFSET, "interventions": [OFFSET, {"kind": "afresh"}]},
            ["offset", "offset", "afresh"],
            "offset+offset",
        ),
        ({"interventions": [{"kind": NOISE, "offset": 1}, OFFSET]}, [NOISE, "offset"], f"{NOISE}+offset"),
    ],
)
def test_short_forms_become_interventions(table: dict[str, Any], kinds: list[str], damage: str) -> None:
    """In the order start, plastic, damage, then those that are listed, whatever the order of the keys.

    The damage is one text; what touches only the learner is none.
    """
    for said in (table, dict(reversed(table.items()))):
        phase = Phase.model_validate(said)
        assert [settings.kind for settings in phase.interventions] == kinds
        assert phase.damage == damage
        [same] = validated({"phases": [said]}, "table").phases
        assert same == phase == Phase(**said)


def test_a_short_form_says_what_its_table_says() -> None:
    """`plastic` lists parts, `damage` is the settings of an intervention; defaults are those of the kind."""
    phase = Phase(plastic=["links"], damage=OFFSET)  # type: ignore[call-arg]
    plastic, offset = phase.interventions
    assert plastic == INTERVENTIONS.validated({"kind": "plastic", "parts": ["links"]})
    assert offset == INTERVENTIONS.validated(OFFSET) != INTERVENTIONS.validated("offset")


@pytest.mark.parametrize(
    ("changes", "kinds"),
    [
        ({}, ["afresh", "plastic", "offset", "plastic"]),
        ({"frames": 1}, ["afresh", "plastic", "offset", "plastic"]),
        ({"damage": "none"}, ["afresh", "plastic", "plastic"]),
        ({"damage": OFFSET}, ["offset", "afresh", "plastic", "plastic"]),
        ({"start": "continue"}, ["plastic", "offset", "plastic"]),
        ({"start": "shuffled"}, ["shuffled", "plastic", "offset", "plastic"]),
        ({"plastic": None}, ["afresh", "offset"]),
        ({"plastic": [], "damage": "none"}, ["plastic", "afresh"]),
        ({"interventions": []}, []),
        ({"interventions": [OFFSET], "start": "afresh"}, ["afresh", "offset"]),
    ],
)
def test_a_short_form_replaces_what_it_stands_for(changes: dict[str, Any], kinds: list[str]) -> None:
    """All interventions of that sort go, all others stay in their order; `interventions` replaces every one."""
    phase = Phase.model_validate(
        {"start": "afresh", "plastic": ["links"], "damage": OFFSET, "interventions": [{"kind": "plastic"}]}
    )
    assert sorted(s.kind for s in phase.replaced(**changes).interventions) == sorted(kinds)


@given(TABLES)
def test_a_phase_written_long_is_the_phase_written_short(table: dict[str, Any]) -> None:
    """What a run folder holds, interventions in full, reads as what was written in short forms."""
    described = validated(table, "short")
    assert all(not SHORT.intersection(phase) for phase in described.model_dump()["phases"])
    assert validated(described.model_dump(mode="json"), "long") == described


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    """Missing, a folder, no TOML, no text: the path and the reason are in the message."""
    broken, binary = tmp_path / "broken.toml", tmp_path / "binary.toml"
    broken.write_text("seed = = 3")
    binary.write_bytes(b"\xff\xfe\x00")
    for path, reason in (
        (tmp_path / "none.toml", "No such file"),
        (tmp_path, "directory"),
        (broken, "not valid TOML.*line 1"),
        (binary, r"not in UTF-8 .*Save it as UTF-8\.$"),
    ):
        with pytest.raises(DescriptionError, match=f"{path}.*{reason}"):
            load_description(path)


def test_a_file_as_windows_writes_it_is_read(tmp_path: Path) -> None:
    """With a byte order mark, and with a carriage return at each end of line."""
    (tmp_path / "mine.toml").write_bytes(b"\xef\xbb\xbfseed = 7\r\n[learner]\r\nkind = 'best'\r\n")
    found = load_description(tmp_path / "mine.toml")
    assert (found.seed, found.learner.kind) == (7, "best")


def test_a_long_value_is_cut_short() -> None:
    """Its key and what is asked for stay in sight."""
    with pytest.raises(DescriptionError, match=r"seed = 'x{119}\.\.\.: must be a whole number, not text") as caught:
        validated({"seed": 5000 * "x"}, "my.toml")
    assert len(str(caught.value)) < 250


@pytest.mark.parametrize(("minutes", "frames"), [(0, 0), (1, 900), (0.2, 180), (197.58, 177_822), (1 / 900, 1)])
def test_minutes_are_900_frames_each(minutes: float, frames: int) -> None:
    """round(900 M)."""
    assert frames_of(minutes) == frames


@pytest.mark.parametrize("minutes", [-1, -1e-9, float("nan"), float("inf"), float("-inf")])
def test_minutes_must_be_finite_and_not_negative(minutes: float) -> None:
    """Anything else is refused, with the value."""
    with pytest.raises(DescriptionError, match=f"finite and at least 0, not {minutes}"):
        frames_of(minutes)


def test_phases_without_frames_are_legal() -> None:
    """0 frames is a length like any other."""
    description = validated({"phases": [{"name": "a", "frames": 0}, {"name": "b", "frames": 0}]}, "empty")
    assert description.frames == 0
