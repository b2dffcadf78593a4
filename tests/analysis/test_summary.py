"""What summary.json holds."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from somatopy.analysis import summarise
from somatopy.analysis.runs import RunFolderError, load_run
from somatopy.analysis.summary import write_summary

COUNTS = ["damage", "frames", "hits", "rate", "hits_per_window", "efficiency_per_window", "trends"]
PHASE_KEYS = [*COUNTS, "arm_distortion", "head_distortion"]
NO_MARKS = {"start": None, "peak": None, "end": None}


def test_keys_are_the_contract(make_run: Any) -> None:
    """The documented keys, no more and no fewer."""
    summary = summarise(make_run(np.ones(3 * 4500), np.ones(100)))
    assert list(summary) == ["seed", "eye", "motion", "learner", "ceiling_rate", "reactive_rate", "phases"]
    assert [list(phase) for phase in summary["phases"]] == [PHASE_KEYS, PHASE_KEYS]
    assert list(summary["phases"][0]["trends"][0]) == ["first", "last", "slope", "slope_se", "intercept"]


def test_values_come_from_the_description(make_run: Any) -> None:
    """Seed, eye, motion, learner and each phase's damage are the description's."""
    summary = summarise(make_run(np.ones(5), np.ones(5), learner="random"))
    assert [summary[key] for key in ("seed", "eye", "motion", "learner")] == [7, "geometric", "kinematic", "random"]
    assert [phase["damage"] for phase in summary["phases"]] == ["none", "offset"]


def test_damage_is_the_kinds_of_what_is_done(make_run: Any) -> None:
    """In order, joined by +; freezing, renewing and shuffling what was learned is no damage."""
    kinds = ([], ["offset"], ["plastic"], ["afresh", "offset", "shuffled", "my_lab.harm:Tremor"])
    run = make_run(*(np.ones(5) for _ in kinds), interventions=kinds)
    assert [phase["damage"] for phase in summarise(run)["phases"]] == [
        "none",
        "offset",
        "none",
        "offset+my_lab.harm:Tremor",
    ]


@pytest.mark.parametrize("broken", ["3", '["offset"]', "[{offset = 1}]"])
def test_interventions_that_are_none_are_named(make_run: Any, broken: str) -> None:
    """The key is named, and what should stand there."""
    run = make_run(np.ones(5), np.ones(5))
    text = (run.path / "experiment.toml").read_text().replace("[{kind = 'offset'}]", broken)
    (run.path / "experiment.toml").write_text(text)
    with pytest.raises(RunFolderError, match=r"phases\.1\.interventions in .* must be a list of tables"):
        summarise(load_run(run.path))


def test_hits_are_counted_per_phase(make_run: Any) -> None:
    """Hits and windows restart with the phase, wherever the parts of the folder end."""
    first, second = np.arange(10_000) % 4 == 0, np.arange(5_000) % 2 == 0
    phases = summarise(make_run(first, second, part_frames=3_000))["phases"]
    assert [(phase["frames"], phase["hits"], phase["rate"]) for phase in phases] == [
        (10_000, 2_500, 0.25),
        (5_000, 2_500, 0.5),
    ]
    assert [phase["hits_per_window"] for phase in phases] == [[1125, 1125], [2250]]


def test_what_a_run_is_too_short_for_is_null(make_run: Any) -> None:
    """No window, no trend, no distortion: null or empty, and never a number."""
    short, empty = summarise(make_run(np.ones(1000), np.ones(0)))["phases"]
    assert (short["rate"], short["hits_per_window"], short["trends"]) == (1.0, [], [None])
    assert (empty["frames"], empty["hits"], empty["rate"], empty["trends"]) == (0, 0, None, [None, None])
    assert short["arm_distortion"] == empty["head_distortion"] == NO_MARKS


def test_the_papers_lines_are_recovered(make_run: Any, hits_with_counts: Any) -> None:
    """Windows on the three printed lines, over the paper's length, give those lines, up to rounded counts."""
    lines = [(12.147, 2175.176, 39), (-80.286, 2685.857, 7), (1.2154, 2255.264, 14)]
    counts = [intercept + slope * np.arange(windows) for slope, intercept, windows in lines]
    intact = hits_with_counts(counts[0], rest=177_823 - 39 * 4500)
    damaged = hits_with_counts(np.r_[counts[1], counts[2]], rest=96_049 - 21 * 4500)
    first, second = summarise(make_run(intact, damaged, part_frames=50_000))["phases"]
    trends = [*first["trends"], *second["trends"]]
    assert [(trend["first"], trend["last"]) for trend in trends] == [(0, 38), (0, 6), (7, 20)]
    for trend, (slope, intercept, windows) in zip(trends, lines, strict=True):
        # Rounding moves each count by at most 1/2, and least squares weighs it by |k - mean| / sum (k - mean)^2.
        away = np.abs(np.arange(windows) - (windows - 1) / 2)
        assert trend["slope"] == pytest.approx(slope, abs=0.5 * away.sum() / (away**2).sum())
        assert trend["intercept"] == pytest.approx(intercept, abs=1.0)


def test_distortion_runs_on_across_the_border(make_run: Any) -> None:
    """Start, peak and end are brute-force means of the last 1,800 inputs, those of the phase before included."""
    arm, head = np.random.default_rng(3).random((2, 7000))
    run = make_run(np.ones(4000), np.ones(3000), distances={"arm_distance": arm, "head_distance": head})
    for side, distance in (("arm", arm), ("head", head)):
        means = np.array([distance[end - 1800 : end].mean() for end in range(1800, 7001)])
        per_phase = means[:2201], means[2201:]
        for phase, expected in zip(summarise(run)["phases"], per_phase, strict=True):
            marks = phase[f"{side}_distortion"]
            assert marks == pytest.approx({"start": expected[0], "peak": expected.max(), "end": expected[-1]})


def test_a_phase_shorter_than_the_mean_leaves_the_start_to_the_next(make_run: Any) -> None:
    """Phase 1 ends before 1,800 inputs: null; phase 2 starts where 1,800 inputs are behind it."""
    distance = np.arange(3000.0)
    run = make_run(np.ones(1000), np.ones(2000), distances={"arm_distance": distance})
    first, second = (phase["arm_distortion"] for phase in summarise(run)["phases"])
    assert first == NO_MARKS
    assert second == pytest.approx({"start": np.mean(distance[:1800]), "peak": 2099.5, "end": 2099.5})


def test_learners_without_maps_have_no_distortion(make_run: Any) -> None:
    """Missing probes give null, also in a long run."""
    (phase,) = summarise(make_run(np.ones(5000), learner="random"))["phases"]
    assert phase["arm_distortion"] == phase["head_distortion"] == NO_MARKS


def test_killed_run_has_the_frames_that_are_there(make_run: Any) -> None:
    """A cut phase counts what was recorded, a phase never reached has none; both keep their entries."""
    run = make_run(np.ones(9000), np.ones(9000), np.ones(9000), part_frames=1000, recorded=14_000)
    assert [phase["frames"] for phase in summarise(run)["phases"]] == [9000, 5000, 0]


def test_run_killed_before_its_first_part(make_run: Any) -> None:
    """Nothing recorded: zero frames in every phase and no error."""
    run = make_run(np.ones(9000), np.ones(100), recorded=0, distances={"arm_distance": np.ones(9100)})
    phases = summarise(run)["phases"]
    assert [(phase["frames"], phase["rate"], phase["hits_per_window"]) for phase in phases] == [(0, None, [])] * 2


def test_efficiency_times_ceiling_is_hits(rich_run: Any) -> None:
    """In every window with a ceiling, efficiency * ceiling share * 4,500 frames are the hits; both bounds are there."""
    summary = summarise(rich_run)
    assert (summary["ceiling_rate"], summary["reactive_rate"]) == (0.5, 0.45)
    for phase, ceiling in zip(summary["phases"], rich_run.ceiling["phases"], strict=True):
        products = np.multiply(phase["efficiency_per_window"], ceiling["per_window"]) * 4500
        assert products == pytest.approx(phase["hits_per_window"])


def test_without_a_ceiling_there_is_no_efficiency(make_run: Any) -> None:
    """Null, not a number against nothing."""
    summary = summarise(make_run(np.ones(9000)))
    assert summary["ceiling_rate"] is summary["reactive_rate"] is summary["phases"][0]["efficiency_per_window"] is None


def test_summary_has_the_same_bytes_every_time(make_run: Any) -> None:
    """The same frames give the same file, however they are cut into parts; nothing else is left in the folder."""
    hits, distance = np.random.default_rng(0).random((2, 20_000))
    files = []
    for folder, part_frames in (("a", 4500), ("b", 4500), ("c", 777)):
        distances = {"arm_distance": distance}
        run = make_run(hits < 0.5, folder=folder, part_frames=part_frames, distances=distances)
        write_summary(run)
        write_summary(run)
        files.append((run.path / "summary.json").read_bytes())
        assert sorted(path.name for path in run.path.iterdir()) == ["experiment.toml", "frames", "summary.json"]
    assert files[0] == files[1] == files[2]


def test_summary_file_is_plain_json(make_run: Any) -> None:
    """It reads back as what was returned, ends with a newline and holds no NaN."""
    distance = np.full(5000, np.nan)
    run = make_run(np.ones(5000), distances={"arm_distance": distance})
    summary = write_summary(run)
    text = (run.path / "summary.json").read_text()
    assert json.loads(text) == summary == run.summary
    assert text.endswith("}\n")
    assert "NaN" not in text


@pytest.mark.parametrize("hit", [False, True])
def test_windows_without_scatter_are_plain_json(make_run: Any, hit: bool) -> None:
    """A learner that never sees the hand, or always does, has a flat trend with an error of 0."""
    (trend,) = write_summary(make_run(np.full(18_000, hit)))["phases"][0]["trends"]
    assert trend == {"first": 0, "last": 3, "slope": 0.0, "slope_se": 0.0, "intercept": 4500.0 * hit}


def test_incomplete_description_is_named(make_run: Any) -> None:
    """A description without its learner is named with the key it lacks."""
    run = make_run(np.ones(5))
    del run.description["learner"]["kind"]
    with pytest.raises(RunFolderError, match=r"\[learner\] in .*experiment\.toml lacks 'kind'"):
        summarise(run)
