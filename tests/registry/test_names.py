"""Kinds are found by name and by place, in files too; what is missing is named."""

from __future__ import annotations

import json
import shlex
import sys
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import tomli_w
from pydantic import ValidationError

from somatopy.experiment import Description, load_description
from somatopy.experiment.description import DescriptionError
from somatopy.learners import RandomGaze
from somatopy.learners.hebbian import Hebbian
from somatopy.registry import (
    BABBLERS,
    BODIES,
    INTERVENTIONS,
    LEARNERS,
    MAPS,
    RULES,
    SORTS,
    Kinds,
    Settings,
    UnknownKind,
)
from somatopy.validation import explain

Write = Callable[[str], str]
Stand = Callable[..., str]
CONTEXT: Any = SimpleNamespace(robot="the robot", rng="the generator")
KINDS = [(sort, name) for sort, kinds in SORTS.items() for name in kinds]


def said(kinds: Kinds, value: Any) -> str:
    """Why a value is refused."""
    with pytest.raises(ValueError) as caught:
        kinds.validated(value)
    error = caught.value
    return explain(error, lambda keys: []) if isinstance(error, ValidationError) else str(error)


def built(settings: Settings) -> Any:
    return settings.build(CONTEXT)


def test_there_is_a_sort_for_each_part_of_an_experiment() -> None:
    """Each is known by its name, and the kind that it takes where none is said exists."""
    assert list(SORTS) == ["body", "eye", "babbler", "learner", "map", "rule", "intervention"]
    for sort, kinds in SORTS.items():
        assert kinds.sort == sort and len(list(kinds)) > 0
        assert kinds.default is None or kinds.default in kinds


def test_ours_are_there() -> None:
    """What a description could name before can still be named."""
    assert {"hebbian", "random", "fixed", "nearest"} <= set(LEARNERS)
    assert {"dsom", "som", "neural-gas", "growing-neural-gas", "evolving-som", "grow-when-required"} <= set(MAPS)
    assert {"positive", "normalised"} <= set(RULES) and {"mujoco"} <= set(BODIES) and {"uniform"} <= set(BABBLERS)
    assert {"offset", "plastic", "afresh", "shuffled"} <= set(INTERVENTIONS)


@pytest.mark.parametrize(("sort", "name"), KINDS)
def test_a_kind_is_called_by_its_name(sort: str, name: str) -> None:
    """Its settings know it, whether found by name, or by the place where they stand."""
    kinds = SORTS[sort]
    settings = kinds.validated(name)
    assert isinstance(settings, Settings) and settings.kind == name
    assert kinds.dumped(settings)["kind"] == name
    assert kinds.validated({"kind": name}) == settings
    assert kinds.settings(name).__doc__


@pytest.mark.parametrize(("sort", "name"), KINDS)
def test_what_is_dumped_is_read_as_the_same(sort: str, name: str) -> None:
    """As plain data, and through TOML (which has no None) and JSON (which has no tuples)."""
    kinds = SORTS[sort]
    settings = kinds.validated(name)
    table = kinds.dumped(settings)
    assert kinds.validated(table) == settings == kinds.validated(settings)
    assert kinds.validated(json.loads(json.dumps(table))) == settings
    assert kinds.validated(tomllib.loads(tomli_w.dumps(without_none(table)))) == settings


def without_none(table: dict[str, Any]) -> dict[str, Any]:
    kept = {key: value for key, value in table.items() if value is not None}
    return {key: without_none(value) if isinstance(value, dict) else value for key, value in kept.items()}


@pytest.mark.parametrize(
    ("place", "name"),
    [("somatopy.learners.hebbian:Hebbian", "hebbian"), ("somatopy.learners.controls:RandomGaze", "random")],
)
def test_a_place_that_has_a_name_is_called_by_it(place: str, name: str) -> None:
    """Found by place or by name, handed over as settings or as the part itself, it is one and the same kind."""
    assert LEARNERS.settings(place) is LEARNERS.settings(name)
    assert LEARNERS.validated(place) == LEARNERS.validated(name)
    assert LEARNERS.validated(RandomGaze).kind == "random" and LEARNERS.validated(Hebbian).kind == "hebbian"


def test_equal_settings_are_equal() -> None:
    """The same values of one kind; another value or another kind is not."""
    one, two = (LEARNERS.validated({"kind": "hebbian", "link_rate": 0.2}) for _ in range(2))
    assert one == two and hash(one) == hash(two)
    assert one != LEARNERS.validated("hebbian") != LEARNERS.validated("random")
    assert MAPS.validated({"kind": "som", "shape": [3, 3]}) == MAPS.validated({"kind": "som", "shape": (3, 3)})
    assert LEARNERS.validated("random") == LEARNERS.validated("random") != LEARNERS.validated("nearest")


def test_a_name_that_is_added_can_be_removed() -> None:
    """While it is there it is a kind; then it is unknown again, and its part is called by its place."""
    kinds = Kinds("learner", ("robot", "rng"))
    assert list(kinds) == []
    kinds.add("idle", "somatopy.learners.nearest:NearestGaze")
    try:
        assert list(kinds) == ["idle"] and kinds.validated("idle").kind == "idle"
    finally:
        kinds.remove("idle")
        LEARNERS.add("nearest", "somatopy.learners.nearest:NearestGaze")
    assert list(kinds) == []
    with pytest.raises(UnknownKind, match="is unknown"):
        kinds.settings("idle")


@pytest.mark.parametrize(("sort", "own"), [("learner", "MyLearner"), ("map", "MyMap"), ("babbler", "MyBabbler")])
def test_an_unknown_name_is_answered_with_those_that_exist(sort: str, own: str) -> None:
    """And with how to name a kind of one's own."""
    kinds = SORTS[sort]
    expected = f"is unknown; choose one of {', '.join(kinds)}, or name one of your own by its place: "
    with pytest.raises(UnknownKind) as caught:
        kinds.settings("mine")
    assert str(caught.value) == f"{expected}my_package.my_file:{own}"
    assert said(kinds, {"kind": "mine", "rate": 3}) == f"kind = 'mine' {caught.value}"


@pytest.mark.parametrize("value", [None, 3, [], ["hebbian"], 1.5])
def test_what_can_be_no_kind_is_refused(value: Any) -> None:
    """A number, a list or nothing: the valid kinds are listed."""
    assert said(LEARNERS, value) == f"must be a table with its kind; choose one of {', '.join(LEARNERS)}"


def test_a_table_without_a_kind_is_the_default_or_refused() -> None:
    """Where there is a usual one it is that; a learner must be named."""
    assert BABBLERS.validated({"speed": 0.5}).kind == "uniform" and MAPS.validated({}).kind == "dsom"
    assert said(LEARNERS, {"link_rate": 1}) == f"lacks its kind; choose one of {', '.join(LEARNERS)}"


def test_an_unknown_key_is_answered_with_those_that_exist() -> None:
    """The kind among them."""
    assert (
        said(BABBLERS, {"kind": "uniform", "sped": 1})
        == "unknown key 'sped'; valid keys there: kind, range, speed (did you mean speed?)"
    )


# -- places ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("source", "name", "message"),
    [
        ("class Mine: ...", "Yours", "does not exist: MODULE has no Yours; it has Mine"),
        ("import json", "Mine", "does not exist: MODULE has no Mine; it has nothing"),
        ("class Mine:\n    def here(self): ...", "Mine.Inner", "does not exist: MODULE has no Inner; it has here"),
        ("mine = 3", "mine.Inner", "does not exist: MODULE has no Inner; it has nothing"),
        ("import nowhere_at_all", "Mine", r"\(No module named 'nowhere_at_all'\)\. MODULE was found, but"),
        (
            "from json import nothing",
            "Mine",
            "cannot be imported: MODULE fails with ImportError: cannot import name 'n",
        ),
        ("1 / 0", "Mine", "cannot be imported: MODULE fails with ZeroDivisionError: division by zero"),
        ("def (", "Mine", "cannot be imported: MODULE fails with SyntaxError: "),
        ("raise SystemExit(3)", "Mine", "cannot be imported: MODULE fails with SystemExit: 3"),
    ],
)
def test_what_is_missing_at_a_place_is_named(write: Write, source: str, name: str, message: str) -> None:
    """The name and those that are there, or what the import said."""
    module = write(source)
    with pytest.raises(UnknownKind, match=message.replace("MODULE", module)):
        LEARNERS.settings(f"{module}:{name}")


def test_a_module_that_is_nowhere_is_told_with_where_it_was_sought(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Among what is installed, in PYTHONPATH, and in the current folder; and how to put it into the last two."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    message = said(LEARNERS, "no_such_file.inner:Mine")
    assert message.startswith("kind = 'no_such_file.inner:Mine' cannot be imported (No module named 'no_such_file'). ")
    assert f"in the current folder {tmp_path}. Change to the folder that holds no_such_file.py or" in message
    assert message.endswith(": PYTHONPATH=path/to/folder somatopy ...")


def test_where_another_package_has_the_name_it_is_told_which(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was found instead, by its folder or its file."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    for place, where in (("json.mine:Mine", Path(json.__file__).parent), ("shlex.mine:Mine", Path(shlex.__file__))):
        package = place.partition(".")[0]
        assert f"{package} was found, {where}, and has no module mine" in said(LEARNERS, place)


@pytest.mark.parametrize(
    "place", ["my-file:Mine", ":Mine", "my_file:", "my_file.py:Mine()", "a/b.py:Mine", "a..b:Mine"]
)
def test_what_is_no_place_is_told_how_to_write_one(place: str) -> None:
    """Paths, calls and names that Python has not."""
    expected = "is not the place of a part; write it as my_package.my_file:MyLearner"
    assert said(LEARNERS, place) == f"kind = '{place}' {expected}"


def test_a_class_within_a_class_has_a_place(write: Write) -> None:
    """Names may go on after the first."""
    module = write("class Outer:\n    class Mine:\n        def __init__(self, robot, rng): ...\n")
    assert LEARNERS.validated(f"{module}:Outer.Mine").kind == f"{module}:Outer.Mine"


# -- kinds of one's own in descriptions --------------------------------------------------------------------------------


@pytest.fixture
def added(write: Write, source: str) -> Iterator[None]:
    """One learner, one map and one intervention, each a class in a module, added as somatopy adds its own."""
    module = write(
        source
        + """
from somatopy.interventions import NoIntervention
from somatopy.maps import DSOM
from somatopy.validation import explain

class Chart(DSOM):
    pass

class Dazed(NoIntervention):
    def __init__(self, share: float = 0.5):
        self.share = share
"""
    )
    own = ((LEARNERS, "gazer", "Mine"), (MAPS, "chart", "Chart"), (INTERVENTIONS, "dazed", "Dazed"))
    for kinds, name, attribute in own:
        kinds.add(name, f"{module}:{attribute}")
    yield
    for kinds, name, _ in own:
        kinds.remove(name)


@pytest.mark.usefixtures("added")
def test_kinds_that_are_added_are_found_in_files(tmp_path: Path) -> None:
    """One class in a module and one line: listed, read from TOML, validated, and written as they were read."""
    assert "gazer" in list(LEARNERS) and "chart" in list(MAPS) and "dazed" in list(INTERVENTIONS)
    path = tmp_path / "own.toml"
    path.write_text(
        '[learner]\nkind = "gazer"\nrate = 2\n'
        '[[phases]]\nname = "one"\nframes = 9\n[[phases.interventions]]\nkind = "dazed"\nshare = 0.25\n'
    )
    description = load_description(path)
    assert description.learner.kind == "gazer" and built(description.learner).rate == 2.0
    (dazed,) = description.phases[0].interventions
    assert (dazed.kind, dazed.build(CONTEXT).share) == ("dazed", 0.25)
    assert description.phases[0].damage == "dazed"
    assert Description.model_validate(json.loads(description.model_dump_json())) == description
    chart = Description.model_validate({"learner": {"kind": "hebbian", "arm_map": {"kind": "chart", "shape": [3, 3]}}})
    assert chart.learner.arm_map.kind == "chart"  # type: ignore[attr-defined]


@pytest.mark.usefixtures("added")
@pytest.mark.parametrize(
    ("learner", "message"),
    [
        ("rate = 'fast'", "learner.rate = 'fast': "),
        ("rat = 1", "unknown key 'learner.rat'; valid keys there: kind, rate, label"),
    ],
)
def test_settings_of_kinds_that_are_added_are_checked_in_files(tmp_path: Path, learner: str, message: str) -> None:
    """As those of ours: the key, the value and the valid ones."""
    path = tmp_path / "own.toml"
    path.write_text(f'[learner]\nkind = "gazer"\n{learner}\n')
    with pytest.raises(DescriptionError, match=message):
        load_description(path)


def test_a_description_names_the_kind_that_it_does_not_know() -> None:
    """The key, the value, and what to choose."""
    with pytest.raises(
        ValidationError, match="kind = 'mine' is unknown; choose one of hebbian, best, random, fixed, nearest"
    ):
        Description.model_validate({"learner": {"kind": "mine"}})
    with pytest.raises(
        DescriptionError, match=r"learner\.kind = 'mine' is unknown; choose one of hebbian, best, random, fixed"
    ):
        Description().replaced(learner="mine")
