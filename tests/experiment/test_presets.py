"""The paper's protocol, as section III and IV of the paper and its table of numbers give it."""

from __future__ import annotations

import pytest

from somatopy.analysis.windows import WINDOW
from somatopy.experiment import PRESETS, frames_of, paper


def test_the_paper_in_full() -> None:
    """177,823 frames intact (197.58 minutes), then 96,049 (106.72) shifted by the paper's offsets; 39, 21 windows."""
    intact, damaged = paper().phases
    assert (intact.frames, damaged.frames) == (177_823, 96_049)
    assert intact.frames == pytest.approx(frames_of(197.58), abs=5)
    assert damaged.frames == pytest.approx(frames_of(106.72), abs=5)
    assert (intact.frames // WINDOW, damaged.frames // WINDOW) == (39, 21)
    assert intact.damage.kind == "none"
    assert damaged.damage.model_dump() == {"kind": "offset", "offset": (0.1265, 1.1411, 1.2295, -0.2242)}


def test_the_second_phase_has_two_trends() -> None:
    """Degradation over the first 35 minutes, re-adaptation over the rest; phase 1 is one segment."""
    intact, damaged = paper().phases
    assert intact.trend_breaks == ()
    assert [w * WINDOW for w in damaged.trend_breaks] == [frames_of(35)]


def test_the_paper_learns_with_two_30x30_maps_and_a_link_rate_of_0_01() -> None:
    """Sizes and rates of section III; physics and the rendered eye are the default."""
    description = paper()
    learner = description.learner.model_dump()
    assert learner["kind"] == "hebbian" and learner["link_rate"] == 0.01
    assert learner["arm_map"]["shape"] == learner["head_map"]["shape"] == (30, 30)
    assert (description.body.motion, description.eye.kind, description.body.model) == ("dynamic", "fiducial", "nao")


def test_presets_are_made_anew_and_valid() -> None:
    """Each preset builds a description that survives its own validation."""
    for make in PRESETS.values():
        description = make()
        assert description == make() == description.replaced()
