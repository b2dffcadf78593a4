"""Conditions, seeds and cells: what makes two cells the same, and what they share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from somatopy.babbling import UniformBabbler
from somatopy.experiment import DescriptionError
from somatopy.experiment.building import hand_over
from somatopy.experiment.ceiling import EVERY
from somatopy.studies import Condition, Study
from somatopy.studies.plan import Cell, seeds_of


def test_cells_of_a_seed_stand_together(described: Callable[..., Any]) -> None:
    """In the order of the conditions, each with its own seeds."""
    study = Study("s", (Condition("a", described(), (3, 1)), Condition("b", described(damage="none"), (1, 2))))
    assert [(cell.condition, cell.seed) for cell in study.cells()] == [("a", 3), ("a", 1), ("b", 1), ("b", 2)]


def test_the_key_is_of_what_is_run_and_not_of_its_name(described: Callable[..., Any]) -> None:
    """Names of condition and experiment, and factors, do not count; seed, settings and the ceiling do."""
    one = described()
    cell = Cell("a", {}, one)
    assert Cell("b", {"x": 1}, one.replaced(name="other")).key == cell.key
    others = [Cell("a", {}, one.replaced(seed=1)), Cell("a", {}, described(babbling__speed=0.3))]
    others += [Cell("a", {}, one, ceiling=False), Cell("a", {}, one, every=1), Cell("a", {}, one, every=2)]
    assert len({cell.key, *(other.key for other in others)}) == 6
    assert Cell("a", {}, one, every=EVERY).key == cell.key  # as if it were not said
    assert Cell("a", {}, one, ceiling=False, every=1).key == others[2].key  # of a ceiling that nobody computes


def test_cells_that_differ_after_the_first_phase_share_it(described: Callable[..., Any]) -> None:
    """Also where the damage needs modules of its own, which the first phase does not load."""
    paper, none, other = (Cell("", {}, described(damage=d)) for d in ("paper", "none", "shuffled"))
    assert paper.code != none.code
    assert paper.trunk == none.trunk == other.trunk
    assert paper.movement == none.movement
    assert Cell("", {}, described(minutes=2)).trunk != paper.trunk
    assert Cell("", {}, described(learner="random")).trunk != paper.trunk
    assert Cell("", {}, described(learner="random")).movement == paper.movement


@pytest.mark.parametrize(
    ("conditions", "said"),
    [
        ([], "The study 's' has no conditions: give it at least one."),
        ([("a", (0,)), ("a", (1,))], "Conditions need names of their own; 'a' comes twice."),
        ([("a", ())], "The condition 'a' has no seeds: give it at least one."),
    ],
)
def test_a_study_that_is_none(conditions: list[Any], said: str, described: Callable[..., Any]) -> None:
    """One sentence says what is wrong."""
    with pytest.raises(DescriptionError) as caught:
        Study("s", tuple(Condition(name, described(), seeds) for name, seeds in conditions))
    assert str(caught.value) == said


@pytest.mark.parametrize("name", ["Mine", "Mine()", "__main__"])
def test_parts_that_other_processes_cannot_import_cannot_be_studied(name: str, described: Callable[..., Any]) -> None:
    """Local classes, parts as they are, and what stands in the program that was started."""

    class Mine(UniformBabbler):
        """A class that only this process has."""

        def __init__(self, arm: Any = None, start: Any = None, rng: Any = None) -> None:
            pass

    Mine.__module__ = "__main__" if name == "__main__" else __name__
    handed = hand_over(described(), babbler=Mine() if name == "Mine()" else Mine)
    with pytest.raises(DescriptionError, match=r"The condition 'a' has a part that only this process has .*Mine"):
        Study("s", (Condition("a", handed, (0,)),))


def test_seeds() -> None:
    """So many from one on, or a list."""
    assert seeds_of(3, 5) == (5, 6, 7) and seeds_of([4, 0]) == (4, 0) and seeds_of(range(2)) == (0, 1)


@pytest.mark.parametrize("seeds", [0, -1, True, "5", 2.0, [], [1, 1], [-1], [0.5], [True], None])
def test_seeds_that_are_none(seeds: Any) -> None:
    """The value and the valid ones are named."""
    with pytest.raises(DescriptionError) as caught:
        seeds_of(seeds)
    assert str(caught.value).startswith(f"seeds = {seeds!r} must be how many seeds there are, such as 5, or a list")


@pytest.mark.parametrize("seed", [-1, "5", 1.5, True, None])
def test_a_first_seed_that_is_none(seed: Any) -> None:
    """The key is `seed` then."""
    with pytest.raises(DescriptionError) as caught:
        seeds_of(2, seed)
    assert str(caught.value) == f"seed = {seed!r}, the first seed, must be a whole number from 0 up."


def test_the_papers_damage_by_word_and_by_number_is_one_cell_on_the_nao_alone(described: Callable[..., Any]) -> None:
    """Cells that ran before the word was there keep their digest; on another robot the word means other numbers."""
    numbers = described(damage={"kind": "offset", "offset": (0.1265, 1.1411, 1.2295, -0.2242)})
    word, other = described(damage="paper"), described(damage={"kind": "offset", "offset": (0.1, 1.0, 1.0, -0.2)})
    assert Cell("", {}, word).description == Cell("", {}, numbers).description != Cell("", {}, other).description
    elsewhere = [one.replaced(body=one.body.replaced(model="crane.toml")) for one in (word, numbers)]
    assert len({Cell("", {}, one).description for one in elsewhere}) == 2


def test_numbers_that_the_arm_cannot_have_are_refused_before_any_cell(described: Callable[..., Any]) -> None:
    """The condition, the key, both numbers and the joints are named."""
    wrong = described(damage={"kind": "offset", "offset": (0.1, 0.2, 0.3)})
    said = r"The condition 'short': phases.1.interventions.0.offset: 3 offsets; the arm has 4 joints: LShoulderPitch, "
    with pytest.raises(DescriptionError, match=said):
        Study("any", (Condition("short", wrong, (0,)),))
