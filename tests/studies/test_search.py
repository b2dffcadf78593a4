"""Searches for settings: what their files may say, and that the same search proposes the same points, come what may."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

from somatopy.experiment import DescriptionError
from somatopy.studies.reading import KEYS as STUDY_KEYS
from somatopy.studies.reading import load_plan, planned
from somatopy.studies.search import KEYS, OPTIMISERS, named_loss, searched

EVERY = {
    "motion": "kinematic",
    "minutes": 0.1,
    "damage_minutes": 0,
    "learner.arm_map.shape": [4, 4],
    "learner.head_map.shape": [4, 4],
}
SPACE = {"babbling.speed": {"low": 0.2, "high": 0.8, "log": True}, "learner.ties": ["redrawn", "held"]}
LOSS = f"{__name__}:near_half"


def near_half(result: Any, condition: str) -> float:
    """A loss that needs no run: how far the speed is from .5."""
    return abs(float(result.factors[condition]["babbling.speed"]) - 0.5)


def table(other: Any = None, **own: Any) -> dict[str, Any]:
    """A study's table with a search."""
    found = {"loss": LOSS, "trials": 6, "batch": 2, "space": SPACE, **own}
    return {"name": "tiny", "every": EVERY, "search": found, **(other or {})}


def refused(**own: Any) -> str:
    with pytest.raises(DescriptionError) as caught:
        searched(table(**own))
    return str(caught.value)


def test_a_search_from_a_table() -> None:
    """All that it says stands in the search; what it leaves out has defaults."""
    found = searched(table({"seeds": 2, "seed": 5}, start=[{"babbling": {"speed": 0.5}, "learner": {"ties": "held"}}]))
    assert (found.name, found.seeds, found.trials, found.batch) == ("tiny", (5, 6), 6, 2)
    assert (found.optimiser, found.seed, found.ceilings, found.base.eye.kind) == ("tpe", 0, False, "geometric")
    assert found.space == {"babbling.speed": SPACE["babbling.speed"], "learner.ties": {"choices": ["redrawn", "held"]}}
    assert found.start == ({"babbling.speed": 0.5, "learner.ties": "held"},)


def test_the_kept_search_can_be_run() -> None:
    """The file of the calibration: five starts, all in its space."""
    found = searched(load_plan(Path(__file__).parents[2] / "studies" / "calibration-search.toml"))
    assert (found.trials, found.loss, len(found.start)) == (80, "paper", 5)


@pytest.mark.parametrize(
    "own, message",
    [
        ({"trails": 3}, f"search has no key 'trails'; its keys: {', '.join(KEYS)}."),
        ({"other": {"search": 3}}, f"search must be a table of keys, not 3; its keys: {', '.join(KEYS)}."),
        ({"other": {"sedes": 3}}, f"A study has no key 'sedes'; its keys: {', '.join(STUDY_KEYS)}."),
        ({"other": {"grid": {"learner": ["nearest"]}}}, "A study searches, or has grid: give one of both."),
        ({"other": {"keep_frames": True}}, "A study searches, or has keep_frames: give one of both."),
        ({"other": {"ceilings": 1}}, "ceilings = 1 must be true or false."),
        ({"space": {}}, "search: space must say what is searched, such as speed = {low = 0.2, high = 0.8}."),
        ({"trials": 0}, "search: trials = 0 must be a whole number from 1 up."),
        ({"trials": None}, "search: trials = None must be a whole number from 1 up."),
        ({"batch": True}, "search: batch = True must be a whole number from 1 up."),
        ({"seed": "one"}, "search: seed = 'one' must be a whole number from 0 up."),
        ({"optimiser": "adam"}, f"search: optimiser = 'adam' is unknown; choose one of {', '.join(OPTIMISERS)}."),
        ({"start": 1}, "search: start must be a list of tables, [[search.start]], each with all keys of space."),
        ({"start": [{"babbling.speed": 0.5}]}, "search: start 0 and the space differ in learner.ties."),
        (
            {"start": [{"babbling.speed": 0.5, "learner.ties": "last"}]},
            "search: start 0 has learner.ties = 'last', which is not in its space.",
        ),
        (
            {"start": [{"babbling.speed": 0.9, "learner.ties": "held"}]},
            "search: start 0 has babbling.speed = 0.9, which is not in its space.",
        ),
    ],
)
def test_what_a_search_may_not_say(own: dict[str, Any], message: str) -> None:
    """Each is one sentence with what is wrong and what is valid."""
    assert refused(**own) == message


def test_keys_and_choices_are_tried_before_anything_runs() -> None:
    """A key that no description has, and a choice that one of the parts does not know."""
    assert "speeed" in refused(space={"babbling.speeed": {"low": 0.1, "high": 0.2}})
    message = refused(space={**SPACE, "learner.rule": ["positive", "negative"]})
    assert message.startswith("search: learner.rule = 'negative'")


@pytest.mark.parametrize("name", ["", "papers", "no-module:loss", ".relative:loss", "module:"])
def test_unknown_losses(name: str) -> None:
    """What is neither a name nor a place."""
    assert refused(loss=name) == (
        f"loss = {name!r} is unknown; choose one of paper, or name a function of your own by its place: "
        "my_package.my_file:my_loss."
    )


def test_losses_by_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a module, and of one in the current folder; what is not there, or fails, is said."""
    assert named_loss(LOSS).__name__ == "near_half"
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    (tmp_path / "losses_of_mine.py").write_text("def mine(result, condition):\n    return 3\n\n\nFOUR = 4\n")
    (tmp_path / "broken_losses.py").write_text("1 / 0\n")
    assert named_loss("losses_of_mine:mine")(None, "") == 3  # type: ignore[arg-type]
    assert "losses_of_mine has no yours; it has mine" in refused(loss="losses_of_mine:yours")
    assert "broken_losses fails with ZeroDivisionError" in refused(loss="broken_losses:mine")
    assert "is no function" in refused(loss="losses_of_mine:FOUR")
    assert "cannot be imported" in refused(loss="no_such_losses:mine")


def test_a_search_is_no_fixed_plan() -> None:
    """Nobody runs the base of a search alone by mistake."""
    with pytest.raises(DescriptionError, match="proposes its conditions as it goes"):
        planned(table())
