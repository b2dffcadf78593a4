"""Searches for settings: what their files may say, and that the same search proposes the same points, come what may."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from somatopy.analysis.cells import StudyResult, load_study, to_table
from somatopy.experiment import DescriptionError
from somatopy.studies import study
from somatopy.studies.local import Outcome
from somatopy.studies.plan import Study
from somatopy.studies.reading import KEYS as STUDY_KEYS
from somatopy.studies.reading import load_plan, planned
from somatopy.studies.search import KEYS, LOSSES_FILE, OPTIMISERS, Search, named_loss, search, searched

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


# -- the search itself, of cells that are made up: a row each, whose rate is the speed ------------------------------


class Pretended:
    """Cells end at once: the latest first if backwards; those over `limit` fail; after `kill` it is Ctrl-C."""

    def __init__(self, backwards: bool = False, limit: float = 1.0, kill: int = 1000) -> None:
        self.capacity = 3
        self.backwards, self.limit, self.kill = backwards, limit, kill
        self.ran: list[float] = []
        self._waiting: list[Any] = []

    def __call__(self, scratch: Path) -> Pretended:
        return self

    def submit(self, task: Any) -> None:
        self._waiting.append(task)

    def next(self) -> Outcome:
        if len(self.ran) >= self.kill:
            raise KeyboardInterrupt
        task = self._waiting.pop(-1 if self.backwards else 0)
        described = task.experiment
        speed = described["babbling"]["speed"]
        self.ran.append(speed)
        if speed > self.limit:
            return Outcome(task.key, None, "too fast")
        row = {column: None for column in ("hits_per_window", "slopes")}
        return Outcome(task.key, [{**row, "seed": described["seed"], "phase": 0, "frames": 90, "rate": speed}])

    def forget(self, trunk: str) -> None: ...

    def close(self) -> None:
        self._waiting.clear()


def found(what: Search, out: Path, backend: Pretended | None = None) -> StudyResult:
    return search(what, out, backend=backend or Pretended(), progress=False)


def points(result: StudyResult) -> list[dict[str, Any]]:
    """What was proposed, in order."""
    return [result.factors[name] for name in result.study["order"]]


def losses(folder: Path) -> dict[str, Any]:
    known: dict[str, Any] = json.loads((folder / LOSSES_FILE).read_text())["losses"]
    return known


@pytest.fixture(params=OPTIMISERS)
def what(request: pytest.FixtureRequest) -> Search:
    """A search with each optimiser, long enough that it has begun to learn: its last six of 18 proposals."""
    if request.param == "cmaes":
        pytest.importorskip("cmaes")
    start = [{"babbling.speed": 0.5, "learner.ties": "held"}]
    return searched(table(optimiser=request.param, trials=18, batch=6, start=start))


def test_proposals_depend_on_the_search_alone(what: Search, tmp_path: Path) -> None:
    """Neither the order in which cells end, nor Ctrl-C in the middle, changes what is proposed, nor what runs."""
    whole, broken = Pretended(), Pretended(backwards=True, kill=9)
    result = found(what, tmp_path / "whole", whole)
    assert points(result)[0] == {"babbling.speed": 0.5, "learner.ties": "held"}
    assert len(points(result)) == 18 == len(whole.ran)
    assert all(0.2 <= point["babbling.speed"] <= 0.8 for point in points(result))
    assert {point["learner.ties"] for point in points(result)} == {"held", "redrawn"}
    assert len({point["babbling.speed"] for point in points(result)}) == 18
    with pytest.raises(KeyboardInterrupt):
        found(what, tmp_path / "broken", broken)
    rest = Pretended(backwards=True)
    again = found(what, tmp_path / "broken", rest)
    assert points(again) == points(result)
    assert sorted([*broken.ran, *rest.ran]) == sorted(whole.ran)
    assert losses(tmp_path / "broken") == losses(tmp_path / "whole")
    assert losses(tmp_path / "whole")["trial 000"] == 0.0


@pytest.fixture
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing runs; each proposal has a row, whose rate is its speed."""

    def perform(plan: Study, out: Path, **how: Any) -> StudyResult:
        out.mkdir(exist_ok=True)
        rows = [
            {"condition": one.name, "seed": 0, "key": one.name, "phase": 0, "frames": 90, **one.factors}
            for one in plan.conditions
        ]
        known = {one.name: {"factors": one.factors} for one in plan.conditions}
        return StudyResult(out, to_table(rows), [], {"order": [*known], "conditions": known})

    monkeypatch.setattr("somatopy.studies.search.perform", perform)


@pytest.mark.usefixtures("at_once")
def test_optimisers_use_what_they_hear(tmp_path: Path) -> None:
    """Later proposals of the optimisers that learn lie nearer to the optimum than those of a random search."""
    ends = {}
    for optimiser in ("random", "tpe"):
        result = search(searched(table(optimiser=optimiser, trials=60, batch=5)), tmp_path / optimiser)
        ends[optimiser] = sum([*losses(result.path).values()][30:])
    assert ends["tpe"] < 0.6 * ends["random"]


@pytest.mark.usefixtures("at_once")
def test_another_seed_of_the_optimiser_proposes_others(tmp_path: Path) -> None:
    """So that a search can be done again."""
    first, second = (search(searched(table(seed=seed)), tmp_path / str(seed)) for seed in (0, 1))
    assert points(first) != points(second)


def test_proposals_that_fail_do_not_stop_it(tmp_path: Path) -> None:
    """They have no loss, are named as failures, run once in a search, and again when it is started anew."""
    what, backend = searched(table(trials=12, batch=3)), Pretended(limit=0.45)
    result = found(what, tmp_path / "out", backend)
    fast = [name for name, point in result.factors.items() if point["babbling.speed"] > 0.45]
    assert 0 < len(fast) < 12 and len(backend.ran) == 12
    assert {failure["condition"] for failure in result.failures} == {*fast}
    assert {name for name, value in losses(tmp_path / "out").items() if value is None} == {*fast}
    anew = Pretended(limit=0.45)
    assert points(found(what, tmp_path / "out", anew)) == points(result)
    assert len(anew.ran) == len(fast)


@pytest.mark.usefixtures("at_once")
def test_settings_that_no_description_has_have_no_loss(tmp_path: Path) -> None:
    """A speed below 0 cannot be proposed to a body: the optimiser hears that it failed, and nothing runs."""
    space = {"learner.ties": ["held"], "babbling.speed": {"low": -0.8, "high": 0.8}}
    what = replace(searched(table()), space=space | {"learner.ties": {"choices": ["held"]}}, trials=12)
    result = search(what, tmp_path / "out")
    known = losses(tmp_path / "out")
    assert len(known) == 12 and {*result.factors} == {name for name, value in known.items() if value is not None}
    assert 0 < len(points(result)) < 12 and all(point["babbling.speed"] > 0 for point in points(result))
    with pytest.raises(DescriptionError, match=r"None of the proposals of the search .* can be run"):
        search(replace(what, space={"babbling.speed": {"low": -0.8, "high": -0.1}}), tmp_path / "none")


def test_packages_that_are_missing_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the extra that has them."""
    for package, optimiser in (("cmaes", "cmaes"), ("optuna", "tpe")):
        monkeypatch.setitem(sys.modules, package, None)
        with pytest.raises(DescriptionError, match=rf'needs the package {package}. .*pip install "somatopy\[search\]"'):
            found(searched(table(optimiser=optimiser)), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_file_runs_for_real(tmp_path: Path, in_process: Any) -> None:
    """Keys joined by + have one value; a study in one call takes the file; losses are of the table that it leaves."""
    (tmp_path / "file.toml").write_text(
        """
ceilings = false
[every]
motion = "kinematic"
minutes = 0.1
damage_minutes = 0
[search]
loss = "LOSS"
trials = 2
batch = 1
[search.space]
babbling.speed = { low = 0.2, high = 0.8 }
"learner.arm_map.shape+learner.head_map.shape" = [[4, 4], [5, 5]]
""".replace("LOSS", LOSS)
    )
    result = search(searched(load_plan(tmp_path / "file.toml")), tmp_path / "out", backend=in_process, progress=False)
    assert result.conditions == ["trial 000", "trial 001"] and not result.failures
    for entry in result.study["conditions"].values():
        shapes = {str(entry["experiment"]["learner"][f"{side}_map"]["shape"]) for side in ("arm", "head")}
        assert len(shapes) == 1
    assert losses(tmp_path / "out") == {name: near_half(result, name) for name in result.conditions}
    again = study(tmp_path / "file.toml", out=tmp_path / "out", progress=False)
    assert again.table == result.table == load_study(tmp_path / "out").table
