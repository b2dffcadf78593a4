"""The ceiling: a grid that holds every legal head posture, bounds in their order, results kept on disk."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from somatopy.bodies import MujocoBody
from somatopy.experiment import ceiling as module
from somatopy.experiment.ceiling import Vantages, best_fixed_head, ceiling, reachable, reactive_hits
from somatopy.percept import Floats, JointGroup, Reading

COARSE = (25, 9)
FINE = (97, 29)


@pytest.fixture
def body() -> Iterator[MujocoBody]:
    body = MujocoBody("nao", "kinematic")
    yield body
    body.close()


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """No test reads or leaves anything in the user's own cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "somatopy" / "ceiling"


def wandering(body: MujocoBody, frames: int, seed: int = 0) -> Floats:
    """An arm that moves to random targets at 0.8 rad/s, (frames, n_arm)."""
    rng, arms, arm = np.random.default_rng(seed), [], 0.5 * (body.arm.lower + body.arm.upper)
    target = arm
    for frame in range(frames):
        if frame % 30 == 0:
            target = rng.uniform(body.arm.lower, body.arm.upper)
        arm = arm + np.clip(target - arm, -0.8 / 15, 0.8 / 15)
        arms.append(arm)
    return np.array(arms)


# -- head postures -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", [COARSE, FINE])
def test_grid_holds_only_legal_head_postures_and_comes_near_all(body: MujocoBody, shape: tuple[int, ...]) -> None:
    """Each is within the limits, coupled ones too; none that the head can take is farther off than half a step."""
    heads, rng = Vantages.of(body, shape).heads, np.random.default_rng(1)
    assert all((body.legal(head) == head).all() for head in heads)
    step = (body.head.upper - body.head.lower) / (np.array(shape) - 1)
    slope = 0.55  # rad of pitch limit lost per rad of yaw, at most: the corners that no grid of columns reaches
    for _ in range(1000):
        head = body.legal(rng.uniform(body.head.lower - 0.3, body.head.upper + 0.3))
        apart = np.abs(heads - head) / (0.5 * step + [0, 0.5 * slope * step[0]])
        assert apart.max(axis=1).min() <= 1 + 1e-9


def test_grid_reaches_the_limits_themselves(body: MujocoBody) -> None:
    """In every column of yaw stand the highest and the lowest legal pitch."""
    heads = Vantages.of(body, COARSE).heads
    for yaw in np.unique(heads[:, 0]):
        column = heads[heads[:, 0] == yaw, 1]
        assert column.min() == pytest.approx(body.legal([yaw, -9])[1])
        assert column.max() == pytest.approx(body.legal([yaw, 9])[1])


def test_grid_holds_each_head_posture_once_and_where_it_is(body: MujocoBody) -> None:
    """Places of the grid that are illegal by a step or more are empty, not filled with the nearest legal posture."""
    for shape in (COARSE, FINE):
        vantages = Vantages.of(body, shape)
        assert len(np.unique(vantages.heads, axis=0)) == len(vantages.heads)
        places = np.stack(np.unravel_index(vantages.cells, shape), axis=1)
        step = (body.head.upper - body.head.lower) / (np.array(shape) - 1)
        assert (np.abs(vantages.heads - body.head.lower - places * step) < step).all()


def test_robustness_is_the_distance_from_the_nearest_that_does_not_see(body: MujocoBody) -> None:
    """In steps of the grid along either joint; what lies beyond the limits counts as not seeing."""
    vantages = Vantages.of(body, COARSE)
    rng = np.random.default_rng(2)
    places = np.stack(np.unravel_index(vantages.cells, COARSE), axis=1)
    everywhere = np.stack(np.meshgrid(*(np.arange(-1, n + 1) for n in COARSE), indexing="ij"), axis=-1).reshape(-1, 2)
    for share in (0.5, 0.95, 1.0):
        seen = rng.uniform(size=len(places)) < share
        lit = set(map(tuple, places[seen]))
        dark = np.array([cell for cell in everywhere if tuple(cell) not in lit])
        expected = [np.abs(dark - place).max(axis=1).min() for place in places]
        np.testing.assert_array_equal(vantages.robustness(seen), expected)


# -- what can be seen --------------------------------------------------------------------------------------------------


def test_reachable_is_that_some_head_posture_sees(body: MujocoBody) -> None:
    """Whatever the order in which the arm postures come, although the last success is tried first."""
    vantages, rng = Vantages.of(body, COARSE), np.random.default_rng(3)
    arms = rng.uniform(body.arm.lower, body.arm.upper, (150, 4))
    some = np.array([vantages.seeing(arm).any() for arm in arms])
    assert 0.2 < some.mean() < 0.8
    np.testing.assert_array_equal(reachable(vantages, arms), some)
    np.testing.assert_array_equal(reachable(vantages, arms[::-1]), some[::-1])


def test_hardly_anything_seen_is_called_unreachable(body: MujocoBody) -> None:
    """Hits of random head postures that are not on the grid: the finer the grid the fewer lie above the ceiling."""
    coarse, fine, rng = Vantages.of(body, COARSE), Vantages.of(body, FINE), np.random.default_rng(4)
    arms = []
    while len(arms) < 200:
        arm = rng.uniform(body.arm.lower, body.arm.upper)
        head = body.legal(rng.uniform(body.head.lower, body.head.upper))
        if fine.eye.find(body.view(arm, head)) is not None:
            arms.append(arm)
    assert reachable(fine, np.array(arms)).mean() >= 0.985
    assert reachable(fine, np.array(arms)).sum() >= reachable(coarse, np.array(arms)).sum()


def test_reactive_gaze_stays_below_the_ceiling_and_needs_its_speed(body: MujocoBody) -> None:
    """A head at full speed nearly reaches the ceiling, a slow one falls behind, both hit only what can be seen."""
    arms, lazy = wandering(body, 300), MujocoBody("nao", "kinematic", head_speed=0.1)
    hits, possible = reactive_hits(Vantages.of(body, (49, 15)), arms)
    slow, same = reactive_hits(Vantages.of(lazy, (49, 15)), arms)
    lazy.close()
    np.testing.assert_array_equal(possible, same)
    assert 0.75 * possible.sum() < hits.sum() <= possible.sum() and slow.sum() < 0.8 * hits.sum()
    assert (hits & ~possible).mean() < 0.02


def test_reactive_gaze_keeps_an_arm_in_view_that_rests(body: MujocoBody) -> None:
    """In every frame, from the first on."""
    vantages = Vantages.of(body, COARSE)
    arms = np.tile([0.4, 0.0, -1.0, -0.9], (20, 1))
    hits, possible = reactive_hits(vantages, arms)
    assert hits.all() and possible.all()


def test_reactive_gaze_does_not_know_the_next_frame(body: MujocoBody) -> None:
    """It misses an arm that jumps out of its view, however near the head would have to go, and sees it soon after."""
    vantages, rng, jumps = Vantages.of(body, COARSE), np.random.default_rng(5), 0
    while jumps < 5:
        here, there = rng.uniform(body.arm.lower, body.arm.upper, (2, 4))
        (looks, _), (aims, sees) = (gazes_at(vantages, arm) for arm in (here, there))
        near = len(looks) and len(aims) and np.abs(looks[:, None] - aims).max() < body.head.velocity.min() / 15
        if not near or (np.abs(looks[:, None] - sees).max(axis=2) == 0).any():
            continue
        jumps += 1
        hits, possible = reactive_hits(vantages, np.repeat([here, there], [5, 5], axis=0))
        assert possible.all() and hits[:5].all() and not hits[5] and hits[7:].all()


def gazes_at(vantages: Vantages, arm: Floats) -> tuple[Floats, Floats]:
    """The most robust head postures for an arm posture, and all that see it."""
    seen = vantages.seeing(arm)
    value = vantages.robustness(seen)
    return vantages.heads[seen & (value == value.max())], vantages.heads[seen]


def test_servos_lag_makes_the_reactive_gaze_worse() -> None:
    """With physics the head is later than its set-points."""
    kinematic, dynamic = (MujocoBody("nao", motion) for motion in ("kinematic", "dynamic"))
    arms = wandering(kinematic, 300)
    quick, _ = reactive_hits(Vantages.of(kinematic, (49, 15)), arms)
    late, _ = reactive_hits(Vantages.of(dynamic, (49, 15)), arms)
    assert late.sum() < quick.sum()


def test_best_fixed_head_sees_more_than_any_other_on_the_grid(body: MujocoBody) -> None:
    """And it is legal."""
    arms = wandering(body, 100)
    best, vantages = best_fixed_head(body, arms, COARSE), Vantages.of(body, COARSE)
    counts = np.sum([vantages.seeing(arm) for arm in arms], axis=0)
    assert sum(vantages.eye.find(body.view(arm, best)) is not None for arm in arms) == counts.max() > 0
    np.testing.assert_array_equal(body.legal(best), best)


def test_best_fixed_head_is_the_most_robust_of_equals(body: MujocoBody) -> None:
    """Of one arm posture many see all there is: the best stands in their midst, so that all around it see it too."""
    arm, step = np.array([0.4, 0.0, -1.0, -0.9]), (body.head.upper - body.head.lower) / (np.array(COARSE) - 1)
    best, vantages = best_fixed_head(body, arm[None], COARSE), Vantages.of(body, COARSE)
    seen = vantages.seeing(arm)
    assert (vantages.heads[seen] != best).any(axis=1).sum() > 5
    around = (np.abs(vantages.heads - best) < 1.5 * step).all(axis=1)
    assert around.sum() == 9 and seen[around].all()


def test_best_fixed_head_of_many_arm_postures_is_that_of_every_kth(
    body: MujocoBody, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So that no more than enough are looked at, from the start to the end."""
    monkeypatch.setattr(module, "_ENOUGH", 4)
    here, there = [0.4, 0.0, -1.0, -0.9], [-0.5, 0.2, -1.0, -0.5]
    arms = np.array([here if k % 3 == 0 else there for k in range(11)])
    every, others = (best_fixed_head(body, np.array([arm]), COARSE) for arm in (here, there))
    assert (every != others).any()
    np.testing.assert_array_equal(best_fixed_head(body, arms, COARSE), every)


class Turning:
    """A head of a slow joint and a quick one that is at once where it is told to be."""

    def __init__(self) -> None:
        self.head = JointGroup(("slow", "quick"), -np.ones(2), np.ones(2), np.array([1.0, 8.0]))
        self.told: list[Floats] = []

    def another(self) -> Turning:
        return self

    def reset(self) -> Reading:
        return Reading(0.0, np.zeros(1), np.zeros(2), np.zeros(1), np.zeros(2))

    def step(self, arm: Floats, head: Floats) -> Reading:
        self.told.append(head)
        return Reading(0.0, arm, head, arm, head)

    def view(self, arm: Floats, head: Floats) -> None: ...

    def close(self) -> None: ...


def test_reactive_gaze_goes_where_it_is_soonest() -> None:
    """Of equally robust head postures, by the joint that takes longest at its own speed."""
    body: Any = Turning()
    vantages: Any = SimpleNamespace(
        body=body,
        eye=SimpleNamespace(find=lambda view: None),
        heads=np.array([[0.3, 0.0], [0.1, 0.9], [0.2, -0.1]]),
        seeing=lambda arm: np.ones(3, bool),
        robustness=lambda seen: np.array([2, 2, 2]),
    )
    reactive_hits(vantages, np.zeros((1, 1)))
    assert {tuple(head) for head in body.told} == {(0.1, 0.9)}


def test_best_fixed_head_needs_arm_postures(body: MujocoBody) -> None:
    """The message says so."""
    with pytest.raises(ValueError, match="at least one arm posture"):
        best_fixed_head(body, np.empty((0, 4)))


# -- the result --------------------------------------------------------------------------------------------------------


def test_result_is_plain_data_of_phases_and_full_windows(body: MujocoBody) -> None:
    """Every k-th frame of each phase; a window that a phase does not fill is left out."""
    arms = wandering(body, 170)
    result = ceiling([body, body], [arms[:100], arms[100:]], window=40, every=5, grid=COARSE)
    seen = reachable(Vantages.of(body, COARSE), arms)
    assert json.loads(json.dumps(result)) == result
    assert {key: result[key] for key in ("eye", "grid", "every")} == {"eye": "geometric", "grid": [25, 9], "every": 5}
    first, second = seen[0:100:5], seen[100:170:5]
    assert result["rate"] == pytest.approx(np.concatenate([first, second]).mean())
    assert [phase["rate"] for phase in result["phases"]] == [first.mean(), second.mean()]
    assert result["phases"][0]["per_window"] == [first[0:8].mean(), first[8:16].mean()]
    assert result["phases"][1]["per_window"] == [second[0:8].mean()]
    hits, possible = reactive_hits(Vantages.of(body, COARSE), arms)
    assert result["reactive"] == {"rate": hits.mean(), "ceiling_rate": possible.mean(), "frames": 170}


@pytest.mark.parametrize("every", [1, 7, 40])
def test_each_ten_seconds_have_the_rate_of_the_frames_in_them(body: MujocoBody, every: int) -> None:
    """150 frames each, whether or not the frames that are looked at fall on their borders; a rest is left out."""
    arms = wandering(body, 470)
    seen = reachable(Vantages.of(body, COARSE), arms)
    frames = range(0, 470, every)
    expected = [np.mean([seen[f] for f in frames if 150 * k <= f < 150 * (k + 1)]) for k in range(3)]
    result = ceiling([body], [arms], every=every, grid=COARSE)
    assert result["phases"][0]["per_ten_seconds"] == pytest.approx(expected)


@pytest.mark.parametrize("phases", [[], [np.empty((0, 4))]])
def test_without_frames_rates_are_null(body: MujocoBody, phases: list[Floats]) -> None:
    """Not zero: nothing was measured."""
    result = ceiling([body] * len(phases), phases, grid=COARSE)
    assert result["rate"] is None and result["reactive"] == {"rate": None, "ceiling_rate": None, "frames": 0}
    assert result["phases"] == [{"rate": None, "per_window": [], "per_ten_seconds": []}] * len(phases)


def test_reactive_bound_of_a_long_run_is_that_of_ten_minutes(body: MujocoBody) -> None:
    """Ten stretches of 900 frames from start to end; a run of ten minutes or less is taken whole."""
    run, vantages = np.arange(50_000.0)[:, None], [Vantages.of(body, COARSE)] * 2
    stretches = [part for _, part in module._stretches(vantages, [run[:20_000], run[20_000:]])]
    assert [len(part) for part in stretches] == [900] * 10
    assert stretches[0][0] == 0 and stretches[-1][-1] == 49_999
    assert all((np.diff(part[:, 0]) == 1).all() for part in stretches)
    [(_, whole)] = module._stretches(vantages, [run[:4000], run[4000:9000]])
    np.testing.assert_array_equal(whole, run[:9000])


def test_another_body_ends_a_stretch(body: MujocoBody) -> None:
    """The arm moves on from phase to phase, but no head can be two robots'; each frame counts once, with its body."""
    run = np.arange(300.0)[:, None]
    own, injured = Vantages.of(body, COARSE), Vantages.of(body, COARSE)
    phases = [run[:100], run[100:150], run[150:150], run[150:300]]
    found = list(module._stretches([own, own, injured, injured], phases))
    assert [owner for owner, _ in found] == [own, injured]
    np.testing.assert_array_equal(found[0][1], run[:150])
    np.testing.assert_array_equal(found[1][1], run[150:])


def test_each_phase_is_asked_of_its_own_body(body: MujocoBody) -> None:
    """With its camera taken away nothing can be seen; in the other phase all is as it was."""
    arms, blind = wandering(body, 60), MujocoBody("nao", "kinematic")
    blind.model.cam_pos[:] += 100.0
    injured = blind.another()
    result = ceiling([body, injured], [arms[:30], arms[30:]], every=1, grid=COARSE)
    assert result["phases"][1]["rate"] == 0.0
    assert result["phases"][0]["rate"] == reachable(Vantages.of(body, COARSE), arms[:30]).mean() > 0
    for robot in (blind, injured):
        robot.close()


# -- the cache ---------------------------------------------------------------------------------------------------------


class Computed(Exception):
    """Raised where a result should have been looked up."""


@pytest.fixture
def no_computing(monkeypatch: pytest.MonkeyPatch) -> Any:
    """From its call on nothing may be computed."""

    def forbid() -> None:
        def fail(*_: object) -> None:
            raise Computed

        monkeypatch.setattr(module, "reachable", fail)
        monkeypatch.setattr(module, "reactive_hits", fail)

    return forbid


def test_second_call_looks_the_result_up(body: MujocoBody, no_computing: Any) -> None:
    """Also for another body of the same kind; another arm, grid, speed or marker is another result."""
    arms = wandering(body, 30)
    injured = MujocoBody("nao", "kinematic")
    injured.model.cam_pos[:] += 0.001
    result = ceiling([body], [arms], grid=COARSE)
    no_computing()
    assert ceiling([MujocoBody("nao", "kinematic")], [arms.copy()], grid=COARSE) == result
    assert ceiling([body], [arms], window=10, grid=COARSE)["phases"][0]["per_window"]
    for other in (
        {"arms_by_phase": [arms + 1e-9]},
        {"bodies": [body, body], "arms_by_phase": [arms[:10], arms[10:]]},
        {"grid": (25, 8)},
        {"every": 7},
        {"bodies": [MujocoBody("nao", "kinematic", head_speed=1.0)]},
        {"bodies": [MujocoBody("nao", "dynamic")]},
        {"bodies": [injured]},
    ):
        with pytest.raises(Computed):
            ceiling(**{"bodies": [body], "arms_by_phase": [arms], "grid": COARSE, **other})


def test_runs_that_share_a_phase_share_what_could_be_seen_in_it(
    body: MujocoBody, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only the other phase is computed; the whole is as if nothing had been kept."""
    arms, other, asked = wandering(body, 60), wandering(body, 60, seed=1), []
    ceiling([body, body], [arms[:30], arms[30:]], grid=COARSE)

    def counted(vantages: Vantages, postures: Floats) -> Any:
        asked.append(postures)
        return reachable(vantages, postures)

    monkeypatch.setattr(module, "reachable", counted)
    result = ceiling([body, body], [arms[:30], other[30:]], grid=COARSE)
    assert len(asked) == 1
    np.testing.assert_array_equal(asked[0], other[30::10])
    monkeypatch.setenv("XDG_CACHE_HOME", "/dev/null")
    assert ceiling([body, body], [arms[:30], other[30:]], grid=COARSE) == result
    assert len(asked) == 3


def test_cache_that_cannot_be_written_changes_nothing(
    body: MujocoBody, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The folder's place is taken by a file."""
    arms = wandering(body, 30)
    result = ceiling([body], [arms], grid=COARSE)
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert ceiling([body], [arms], grid=COARSE) == result
    assert (tmp_path / "file").read_text() == ""


@pytest.mark.parametrize("content", ["", "{", "[1]"])
def test_broken_cache_file_is_written_anew(body: MujocoBody, cache: Path, content: str) -> None:
    """And no part of one is left behind."""
    arms = wandering(body, 30)
    result = ceiling([body], [arms], grid=COARSE)
    before = {file: file.read_text() for file in cache.iterdir()}
    for file in before:
        file.write_text(content)
    assert ceiling([body], [arms], grid=COARSE) == result
    assert {file: file.read_text() for file in cache.iterdir()} == before


def test_without_the_variable_the_cache_is_in_the_home_folder(
    body: MujocoBody, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In .cache/somatopy/ceiling."""
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    ceiling([body], [wandering(body, 10)], grid=COARSE)
    assert len([*(tmp_path / ".cache" / "somatopy" / "ceiling").iterdir()]) == 2
