"""The pictures of what a learner knows: shading, outline and mark are where the arrays say."""

from __future__ import annotations

import base64
import io
import json
import re
from typing import Any

import numpy as np
import pytest
from PIL import Image

from somatopy.analysis.report import Source, render_report
from somatopy.analysis.report import beliefs as module
from somatopy.analysis.report.beliefs import MOMENTS, belief_panels, moments
from somatopy.analysis.sight import Beliefs, beliefs_of
from somatopy.analysis.summary import summarise

SAND, WHITE = (0xF2, 0xDF, 0xB8), (255, 255, 255)


def pixels(uri: str) -> np.ndarray:
    file = io.BytesIO(base64.b64decode(uri.partition(",")[2]))
    return np.asarray(Image.open(file).convert("RGB"))


def edges(path: str) -> set[tuple[float, ...]]:
    return {tuple(map(float, found)) for found in re.findall(r"M(\S+) (\S+)L(\S+) (\S+?)(?=M|$)", path)}


def test_shading_outline_and_mark_are_where_they_belong(rich_run: Any) -> None:
    """The first joint to the right, the second up; darker is believed more; sand cannot be taken."""
    panels, beliefs = belief_panels(rich_run, summarise(rich_run)), beliefs_of(rich_run)
    assert panels is not None and beliefs is not None and len(panels["panels"]) == 8
    wide, high = panels["size"][0] / 5, panels["size"][1] / 3
    for k, panel in enumerate(panels["panels"]):
        for t in (0, 8):
            picture = pixels(panel["images"][panel["image"][t]])
            assert picture.shape == (3, 5, 3) and tuple(picture[0, 4]) == SAND
            lightness = [int(picture[2 - cell % 3, cell // 3].sum()) for cell in range(14)]
            order = np.argsort(beliefs.belief[t, k], kind="stable")
            assert (np.diff(np.array(lightness)[order]) <= 0).all()
            seen = np.zeros((3 + 2, 5 + 2), bool)
            for cell in np.flatnonzero(beliefs.seen[beliefs.phase[t], k]):
                seen[1 + 2 - cell % 3, 1 + cell // 3] = True
            drawn = edges(panel["outlines"][panel["outline"][t]])
            assert len(drawn) == (seen[:, 1:] != seen[:, :-1]).sum() + (seen[1:] != seen[:-1]).sum()
            for x, y, *_ in drawn:
                around = seen[round(y / high) : round(y / high) + 2, round(x / wide) : round(x / wide) + 2]
                assert around.any() and not around.all()
            cell = np.abs(beliefs.heads - beliefs.gaze[t, k]).max(axis=1).argmin()
            expected = (cell // 3 + 0.5) * wide, (2 - cell % 3 + 0.5) * high
            assert panel["mark"][t] == pytest.approx(expected, abs=0.06)


def shaped(limits: list[list[float]], shape: tuple[int, ...], at: list[float]) -> Beliefs:
    """One posture at one moment: belief and truth count up with the cells; all gazes can be taken."""
    axes = [np.linspace(*ends, n) for ends, n in zip(limits, shape, strict=True)]
    heads = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(shape))
    belief = np.linspace(0, 255, len(heads)).astype(np.uint8)[None, None]
    cells, one = np.arange(len(heads)), np.array([0])
    gaze = np.array([[at]])
    return Beliefs(np.zeros((1, 4)), heads, shape, cells, np.array(limits), one, one, gaze, belief, belief > 200)


def test_a_head_of_one_joint_is_a_strip() -> None:
    """As wide as any panel, one row of cells, the mark in its middle."""
    beliefs = shaped([[-1.0, 3.0]], (9,), [2.0])
    size = module._size(beliefs)
    shade = module._flat(beliefs, beliefs.belief[0, 0], 0, 0)
    assert shade.tolist() == [beliefs.belief[0, 0].tolist()] and size == (module.WIDTH, module.LEAST)
    assert module._mark(beliefs, beliefs.gaze[0, 0], size) == pytest.approx([6.5 / 9 * size[0], size[1] / 2], abs=0.06)


@pytest.mark.parametrize(("third", "depth"), [(-0.3, 0), (0.02, 1), (0.3, 2)])
def test_a_head_of_three_joints_is_a_slice(third: float, depth: int) -> None:
    """At the step of the third joint that is nearest to the predicted gaze."""
    beliefs = shaped([[-1.0, 1.0], [-0.5, 0.5], [-0.3, 0.3]], (4, 5, 3), [0.0, 0.0, third])
    slices = module._flat(beliefs, beliefs.belief[0, 0], 0, module._depth(beliefs, beliefs.gaze[0, 0]))
    expected = [[beliefs.belief[0, 0, (a * 5 + b) * 3 + depth] for a in range(4)] for b in reversed(range(5))]
    assert slices.tolist() == expected


def test_no_more_moments_than_a_page_can_hold() -> None:
    """Spread evenly, the last among them."""
    assert moments(7) == list(range(7))
    many = moments(1000)
    assert len(many) == MOMENTS and many[0] == 0 and many[-1] == 999 and np.ptp(np.diff(many)) <= 1


def test_the_last_moment_is_shown_without_a_script(rich_run: Any) -> None:
    """Pictures, outlines and marks stand in the page itself; the slider is hidden until a script shows it."""
    page, panels = render_report([Source.of(rich_run.path)]), belief_panels(rich_run, summarise(rich_run))
    bare = re.sub(r"<script[^>]*>.*?</script>", " ", page, flags=re.DOTALL)
    assert panels is not None and bare.count("<image href=") == 8 and 'id="beliefs-controls" hidden' in bare
    for panel in panels["panels"]:
        assert panel["images"][panel["image"][-1]] in bare and panel["outlines"][panel["outline"][-1]] in bare
    assert "after 45 min, phase 2, damaged (offset)" in bare


def test_a_learner_that_does_not_say_shows_where_it_looks(rich_copy: Any, write_sight: Any) -> None:
    """No shading, no agreement; truth and gaze are there, and the page says why."""
    write_sight(rich_copy.path, (3, 3), told=False)
    page, panels = render_report([Source.of(rich_copy.path)]), belief_panels(rich_copy, summarise(rich_copy))
    assert panels is not None and not panels["told"]
    for panel in panels["panels"]:
        assert len(panel["images"]) == 1 and set(map(tuple, pixels(panel["images"][0]).reshape(-1, 3))) == {SAND, WHITE}
        assert len(panel["outlines"]) == 2
    assert "does not say what it believes" in page
    assert 'data-plot="plot-agreement"' not in page and 'data-plot="plot-missed_gazes"' in page


def test_bars_and_curve_carry_the_numbers(rich_run: Any) -> None:
    """A gap between phases; what grows above all is cut off, and its height is written there."""
    from somatopy.analysis.report.sight_charts import ages_chart, agreement_chart, gazes_chart
    from somatopy.analysis.sight import sight_of

    summary, sight, beliefs = summarise(rich_run), sight_of(rich_run), beliefs_of(rich_run)
    assert sight is not None and beliefs is not None
    charts = {draw.__name__: draw(rich_run, summary) for draw in (ages_chart, agreement_chart, gazes_chart)}
    drawn = {name: json.loads(chart.to_json()) for name, chart in charts.items() if chart is not None}
    curve = drawn["agreement_chart"]["data"][0]
    assert curve["x"] == [1, 2, 3, 4, 5, 6, 6, 7, 8, 9] and curve["y"][5] is None
    assert curve["y"][0] == pytest.approx(50 * sum(share[0] for share in beliefs.agreement()))
    for name, values in (("gazes_chart", sight.by_gazes), ("ages_chart", lambda p: sight.by_age(p)[0])):
        for phase, bars in enumerate(drawn[name]["data"]):
            shown = [np.nan if value is None else value for value in bars["y"]]
            np.testing.assert_allclose(shown, 100 * values(phase), atol=1e-3)
    assert drawn["gazes_chart"]["data"][0]["x"] == ["0", "1–4", "5–14", "15–49", "50–149", "150+"]
    assert drawn["ages_chart"]["data"][0]["x"] == ["0–1", "2–3", "4–7", "8–15", "16+"]
    top = drawn["gazes_chart"]["layout"]["yaxis"]["range"][1]
    assert (100 * sight.by_gazes(0)[0] > top) == ("annotations" in drawn["gazes_chart"]["layout"])
