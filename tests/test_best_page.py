"""docs/best.md: its tables are made from the committed cells, and its variants are what it says they are."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from somatopy.clock import FRAME
from somatopy.learners import BestLearner
from somatopy.learners.best.memory import CALM, KEPT_UNITS, LASTING, SURPRISE, UNITS
from somatopy.learners.best.schema import PULL
from somatopy.learners.best.visibility import KEPT
from somatopy.percept import Camera, Floats, Percept, Robot, Sighting, Space

ROOT = Path(__file__).parents[1]
ARM, HEAD = Space(("a", "b"), [-1.0, -1.0], [1.0, 1.0]), Space(("yaw", "pitch"), [-1.5, -0.7], [1.5, 0.7])
ROBOT = Robot({"arm": ARM, "head": HEAD}, ("head",), Camera("eye", 320, 240, fovy=0.83))


@pytest.fixture(scope="module", autouse=True)
def _from_the_repository() -> Iterator[None]:
    """Scripts and variants are found from the folder of the repository."""
    sys.path.insert(0, str(ROOT))
    yield
    sys.path.remove(str(ROOT))


@pytest.fixture(scope="module")
def varied() -> Any:
    return importlib.import_module("docs.best_variants").Varied


def hand(arm: Floats) -> Floats:
    """The head posture that centres the hand."""
    return np.array([0.8 * arm[0], 0.3 * arm[1]])


def stream(learner: Any, frames: int, seed: int = 0) -> list[Percept]:
    """Let a learner look for a hand that is hidden in a corner of the picture; the percepts that it met."""
    rng, arm, goal, met = np.random.default_rng(seed), np.zeros(2), np.zeros(2), []
    command = np.zeros(2)
    for frame in range(frames):
        goal = rng.uniform(-1, 1, 2) if frame % 20 == 0 else goal
        arm = arm + np.clip(goal - arm, -0.05, 0.05)
        head = np.clip(command, *HEAD.limits.T)
        apart = hand(arm) - head
        u, v = (159.5, 119.5) - 272 * apart
        seen = 0 < u < 319 and 0 < v < 239 and not (u < 120 and v < 120)
        met.append(Percept(frame * FRAME, arm, head, goal, head, Sighting((u, v), 0, 400.0) if seen else None, FRAME))
        learner.observe(met[-1])
        command = learner.gaze(met[-1])
    return met


@pytest.fixture(scope="module")
def lived() -> tuple[BestLearner, list[Percept]]:
    """A learner after 400 frames, and these."""
    learner = BestLearner(ROBOT, np.random.default_rng(0))
    return learner, stream(learner, 400)


def memory(learner: Any) -> Any:
    return learner.state()["memory"]


def from_here(varied: Any, learner: BestLearner, surprise: float = 0.0, **factors: Any) -> Any:
    """A variant that goes on from the state of a learner."""
    state = learner.state()
    state["memory"]["numbers"][SURPRISE] = surprise
    found = varied(ROBOT, np.random.default_rng(0), **factors)
    found.restore(state | {"late": {}})
    return found


def frame_of(met: list[Percept], seen: bool) -> Percept:
    return next(percept for percept in reversed(met) if (percept.sighting is not None) is seen)


def test_the_tables_are_made_from_the_committed_cells() -> None:
    """Every number between the page's comments follows from studies/; all blocks stand on the page."""
    made: Any = importlib.import_module("docs.make_best")
    written = made.PAGE.read_text(encoding="utf-8")
    assert made.page(made.tables(), written) == written
    assert {match[2] for match in made.BLOCK.finditer(written)} == made.BLOCKS.keys()


def test_an_edited_table_is_mended_and_other_text_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """What stands between two comments of one name is made anew."""
    made: Any = importlib.import_module("docs.make_best")
    text = "before\n<!-- parts -->\nold\n<!-- end of parts -->\nafter\n<!-- rates --> stays\n"
    monkeypatch.setattr(made, "BLOCKS", {"parts": lambda _: "new\n"})
    assert made.page({}, text) == text.replace("old", "new")


def test_efficiency_is_hits_by_visible_frames_of_the_windows() -> None:
    """Pooled: a window in which more could be seen weighs more; runs that are too short have none."""
    made: Any = importlib.import_module("docs.make_best")

    class Result:
        def values(self, name: str, column: str, phase: int) -> dict[int, list[float]]:
            hits, shares = {1: [0, 900, 2700], 2: [0]}, {1: [1.0, 0.4, 0.8], 2: [1.0]}
            return hits if column == "hits_per_window" else shares

    assert made.efficiency(Result(), "full", (0, 1, 3)) == {1: pytest.approx(100 * 3600 / 5400)}


def test_without_changes_it_is_the_learner_itself(varied: Any) -> None:
    """Bit for bit, over its first 300 frames."""
    one, other = BestLearner(ROBOT, np.random.default_rng(3)), varied(ROBOT, np.random.default_rng(3))
    stream(one, 300), stream(other, 300)
    for name, array in memory(one).items():
        np.testing.assert_array_equal(memory(other)[name], array, err_msg=name)


def test_variants_leave_out_the_arm_the_fine_map_and_the_pace(varied: Any) -> None:
    """Without the arm's part G is still learned; a coarse map measures by the limits; a restless one never slows."""
    plain, unmoved, coarse, restless = (
        varied(ROBOT, np.random.default_rng(0), **{name: True for name in names})
        for names in ((), ("unmoved",), ("coarse",), ("restless",))
    )
    restless._memory.numbers[CALM] = 1e6
    for learner in (plain, unmoved, coarse, restless):
        stream(learner, 300)
    assert plain._memory.sway.any() and not unmoved._memory.sway.any() and unmoved._memory.gain.any()
    np.testing.assert_array_equal(coarse._memory.extent, 1.0)
    np.testing.assert_array_equal(coarse._memory.apart, plain._memory.apart)
    assert restless._memory.numbers[CALM] == 0.0


@pytest.mark.parametrize(
    ("factor", "array"),
    [("plane", "plane"), ("turns", "turns"), ("sheet", "sheet"), ("fields", "fields"), ("strokes", "recent")],
)
def test_half_a_rate_learns_half_as_much_in_a_frame(varied: Any, lived: Any, factor: str, array: str) -> None:
    """And all other arrays learn as before; of the working memory, which also fades, half the stroke is left."""
    learner, met = lived
    before = memory(learner)
    whole, half = from_here(varied, learner), from_here(varied, learner, **{factor: 0.5})
    for one in (whole, half):
        one.observe(frame_of(met, seen=True))
    base = KEPT * before[array] if array == "recent" else before[array]
    change = memory(whole)[array] - base
    assert np.abs(change).max() > 1e-6
    np.testing.assert_allclose(memory(half)[array] - base, 0.5 * change, atol=1e-12)
    for name in set(before) - {array, "asked"}:
        np.testing.assert_array_equal(memory(half)[name], memory(whole)[name], err_msg=name)


def test_misses_that_teach_nothing_leave_visibility_alone(varied: Any, lived: Any) -> None:
    """The working memory fades all the same; a hit teaches as ever."""
    learner, met = lived
    before, one, whole = memory(learner), from_here(varied, learner, misses=0.0), from_here(varied, learner)
    one.observe(frame_of(met, seen=False))
    for name, kept in (("sheet", 1.0), ("fields", 1.0), ("recent", KEPT)):
        np.testing.assert_allclose(memory(one)[name], kept * before[name], atol=1e-12)
    one = from_here(varied, learner, misses=0.0)
    for each in (one, whole):
        each.observe(frame_of(met, seen=True))
    np.testing.assert_array_equal(memory(one)["fields"], memory(whole)["fields"])


def test_step_and_pull_are_the_two_ways_of_the_schema(varied: Any, lived: Any) -> None:
    """While it is surprised, the pull alone goes to the mean posture, and the two together are the whole."""
    learner, met = lived
    before, surprise = memory(learner), 0.4
    shifts = {}
    for step, pull in ((1.0, 1.0), (1.0, 0.0), (0.0, 1.0)):
        one = from_here(varied, learner, surprise, step=step, pull=pull)
        one.observe(frame_of(met, seen=True))
        shifts[step, pull] = memory(one)["shift"] - before["shift"]
        felt = memory(one)["felt"][0]
    np.testing.assert_allclose(shifts[0.0, 1.0], PULL * surprise * (before["home"] - felt), atol=1e-12)
    np.testing.assert_allclose(shifts[1.0, 0.0] + shifts[0.0, 1.0], shifts[1.0, 1.0], atol=1e-12)
    assert np.abs(shifts[1.0, 0.0]).max() > 1e-6


def test_without_memory_and_anticipation_it_looks_where_it_would_at_rest(varied: Any) -> None:
    """The gaze is then the prediction for the sensed posture."""
    learner = varied(ROBOT, np.random.default_rng(1), strokes=0.0, ahead=0.0)
    last = stream(learner, 200)[-1]
    np.testing.assert_array_equal(learner.gaze(last), learner.predict(last.arm))


def test_the_learner_that_centres_looks_at_the_hand(varied: Any) -> None:
    """Within half a cell of the direction that its polynomial says, computed here anew."""
    learner = varied(ROBOT, np.random.default_rng(1), centring=True, turns=0.0, drift=0.0)
    met = stream(learner, 200)
    held = memory(learner)
    cell = 2 * held["reach"] / (held["shape"] - 1)
    for percept in met[::20]:
        z = np.append(1.0, 2 * ((percept.arm - ARM.lower) / (ARM.upper - ARM.lower)) - 1)
        phi = [1.0, z[1], z[2], z[1] * z[1], z[1] * z[2], z[2] * z[2]]
        assert (np.abs(learner.predict(percept.arm) - np.clip(held["plane"] @ phi, *HEAD.limits.T)) < 0.51 * cell).all()


def test_the_learner_that_centres_later_is_the_whole_one_until_then(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bit for bit while the pixel gain has not settled; then all that visibility has learned is gone."""
    centring: Any = importlib.import_module("docs.best_centring")
    one, other = BestLearner(ROBOT, np.random.default_rng(3)), centring.CentringLater(ROBOT, np.random.default_rng(3))
    stream(one, 120), stream(other, 120)
    for name, array in memory(one).items():
        np.testing.assert_array_equal(memory(other)[name], array, err_msg=name)
    monkeypatch.setattr(centring, "SETTLED", 1)
    later = centring.CentringLater(ROBOT, np.random.default_rng(3))
    stream(later, 120)
    assert not memory(later)["fields"].any() and not memory(later)["recent"].any()
    assert memory(later)["sheet"].argmax() == len(memory(later)["sheet"]) // 2


def test_a_late_learner_knows_nothing_of_the_last_frames(varied: Any) -> None:
    """What it commands depends on percepts up to two frames ago, and on that one."""
    gazes = []
    for changed in (None, 58, 57):
        learner = varied(ROBOT, np.random.default_rng(1), late=2)
        for k, percept in enumerate(stream(BestLearner(ROBOT, np.random.default_rng(0)), 60)):
            if changed is not None and k >= changed:
                percept = replace(percept, arm=percept.arm + 0.3, sighting=None)
            learner.observe(percept)
        gazes.append(learner.gaze(percept))
    np.testing.assert_array_equal(gazes[0], gazes[1])
    assert (gazes[0] != gazes[2]).any()


def test_a_late_learner_goes_on_from_its_state(varied: Any) -> None:
    """Bit for bit, with the frames that are under way to it."""
    one, other = (varied(ROBOT, np.random.default_rng(1), late=3) for _ in range(2))
    met = stream(one, 100)
    other.restore(one.state())
    for percept in met:
        for each in (one, other):
            each.observe(percept)
        np.testing.assert_array_equal(one.gaze(percept), other.gaze(percept))


def test_with_the_gate_ajar_far_misses_teach_too(varied: Any, lived: Any) -> None:
    """A miss with the head turned away from the hand changes visibility, which it does not as a rule."""
    learner, met = lived
    last = frame_of(met, seen=False)
    away = Percept(last.time, last.arm, np.array([-1.4, 0.0]) * np.sign(hand(last.arm)[0] or 1), last.arm, last.head)
    before = memory(learner)["fields"]
    shut, ajar = from_here(varied, learner), from_here(varied, learner, ajar=True)
    shut.observe(away), ajar.observe(away)
    np.testing.assert_array_equal(memory(shut)["fields"], before)
    assert np.abs(memory(ajar)["fields"] - before).max() > 1e-6


def test_one_that_is_fickle_keeps_nothing(varied: Any, lived: tuple[BestLearner, list[Percept]]) -> None:
    """At the hit at which the learner itself keeps all of its units."""
    learner, met = lived
    for fickle in (False, True):
        found = from_here(varied, learner, surprise=1.0, fickle=fickle)
        found._memory.numbers[LASTING] = 0.25
        found.observe(frame_of(met, seen=True))
        assert found._memory.numbers[KEPT_UNITS] == (0.0 if fickle else found._memory.numbers[UNITS])
